"""`fit` from card to files: what the output contract promises is in them, and in SI units."""

from __future__ import annotations

from typing import Any

import arviz
import numpy as np
import pytest
from runs import Run, read_json

import bayesplate
from bayesplate.board.board import Board
from bayesplate.board.prior import load_prior
from bayesplate.board.shelf import shelf_folder
from bayesplate.results.contract import as_json

QUANTILES = ("q05", "q25", "q50", "q75", "q95")
ELASTIC = {"E_x": "Pa", "E_y": "Pa", "G_xy": "Pa"}
RIGIDITY = {"D_x": "N m", "D_y": "N m", "D_s": "N m"}
INPUTS = dict.fromkeys(("length_x", "length_y", "thickness"), "m")
INPUTS |= {"mass": "kg", "density": "kg/m^3", "poisson_xy": "1"}
GROUPS = ("posterior", "log_likelihood", "posterior_predictive", "sample_stats", "observed_data")

FINNISH_HZ = {"(1,0)": 52, "(1,1)": 98, "(2,0)": 310, "(1,2)": 337, "(2,1)": 398, "(2,2)": 637}
FIEMME_HZ = {"(0,0)": 57, "(0,1)": 100, "(1,0)": 130, "(1,1)": 162, "(0,2)": 170, "(1,2)": 224}
UNLABELLED_2R = [404.01, 543.70, 594.09, 671.20, 707.01, 850.00, 995.25]


@pytest.fixture(scope="module")
def summaries(fiemme: bayesplate.FitResult, finnish: Run, free: Run) -> dict[str, dict[str, Any]]:
    assert fiemme.folder is not None
    text = (fiemme.folder / "summary.json").read_text(encoding="utf-8")
    assert text.endswith("}\n")
    return {"fiemme": read_json(text), "finnish": finnish.summary, "free": free.summary}


def test_every_quantity_has_its_unit_and_quantiles_in_order(summaries):
    for board in ["fiemme", "finnish", "free"]:
        summary = summaries[board]
        noise = dict.fromkeys(summary["noise"], "1")
        wanted = {"elastic": ELASTIC, "rigidity": RIGIDITY, "noise": noise, "inputs": INPUTS}
        for place, names in wanted.items():
            for name, entry in summary[place].items():
                assert set(entry) == {"mean", "sd", *QUANTILES, "unit"}
                assert entry["unit"] == names[name]
                assert entry["sd"] > 0
                assert sorted(entry[q] for q in QUANTILES) == [entry[q] for q in QUANTILES]
        for entry in summary["derived"].values():
            assert set(entry) == {"mean", "sd", *QUANTILES, "unit"}


def test_constants_are_in_si_units(summaries):
    """By hand from the summary's own medians: D = E h^3 / 12 (1 - nu^2 E_y / E_x), D_s = G h^3 / 3 with h = 3 mm.

    Where one number decides, the median of a function is the function of the median, but for the interpolation between
    two draws; where E_y / E_x joins in, its spread of 8 % moves the factor by 0.1 %.
    """
    for board in ("fiemme", "finnish"):
        elastic, rigidity = ({n: e["q50"] for n, e in summaries[board][p].items()} for p in ("elastic", "rigidity"))
        factor = 0.003**3 / 12 / (1 - 0.51**2 * elastic["E_y"] / elastic["E_x"])
        assert rigidity["D_x"] == pytest.approx(elastic["E_x"] * factor, rel=2e-3)
        assert rigidity["D_y"] == pytest.approx(elastic["E_y"] * factor, rel=2e-3)
        assert rigidity["D_s"] == pytest.approx(elastic["G_xy"] * 0.003**3 / 3, rel=1e-12)
        speed = summaries[board]["derived"]["wave_speed_x"]
        density = {"fiemme": 399.0, "finnish": 473.9}[board]
        assert speed["unit"] == "m/s"
        assert speed["q50"] == pytest.approx(np.sqrt(elastic["E_x"] / density), rel=1e-6)


def test_the_paper_s_own_constants_lie_in_the_posterior(summaries):
    """Its least squares, from its own coefficients: inside the central 99.9 % of a normal with our mean and sd."""
    printed = {"fiemme": (10.4e9, 1.003e9, 0.530e9), "finnish": (13.0e9, 0.702e9, 0.668e9)}
    for board, constants in printed.items():
        for name, value in zip(ELASTIC, constants, strict=True):
            entry = summaries[board]["elastic"][name]
            assert abs(value - entry["mean"]) < 3.3 * entry["sd"], (board, name)


def test_the_summary_is_strict_json_that_names_what_was_run(fiemme, summaries):
    summary = summaries["fiemme"]
    card = Board.from_toml("fiemme-spruce-clamped")

    assert summary == as_json(fiemme.summary)
    assert (summary["format"], summary["name"], summary["seed"]) == (1, "fiemme-spruce-clamped", 1)
    assert summary["card_sha256"] == card.sha256
    assert {"python", "bayesplate", "numpy", "scipy", "emcee"} <= set(summary["versions"])
    assert "unknown" not in summary["versions"].values()
    assert summary["converged"] is True
    assert summary["sampler"]["ensembles"] == 4
    assert summary["sampler"]["rhat_max"] <= 1.01
    assert summary["sampler"]["ess_min"] >= 400


def test_the_law_is_chosen_by_its_error(summaries):
    """A quarter of the noise: the clamped board's modes hardly change within its posterior, the cantilever's do."""
    for board, law in {"fiemme": "linear", "finnish": "exact", "free": "linear"}.items():
        summary = summaries[board]
        assert summary["model"]["law"] == law
        limit = 0.25 * 1200 / np.log(2) * next(iter(summary["noise"].values()))["q50"]
        assert (summary["error"]["linearisation_rms_cents"] < limit) == (law == "linear")


def test_modes_are_keyed_by_label(summaries):
    for board, setup, hertz in [("fiemme", "clamped", FIEMME_HZ), ("finnish", "cantilever", FINNISH_HZ)]:
        modes = {mode["label"]: mode for mode in summaries[board]["modes"]}

        assert {label: mode["measured_hz"] for label, mode in modes.items()} == hertz
        for mode in modes.values():
            assert mode["setup"] == setup
            predicted = mode["predicted_hz"]
            assert predicted["q05"] < predicted["mean"] < predicted["q95"]
            assert abs(mode["residual_cents"]) < 60
        assert sum(mode["leverage"] for mode in modes.values()) == pytest.approx(3.0, abs=1e-9)


def test_peaks_are_assigned_to_modes(free):
    """2R: fourteen of its sixteen peaks are one mode for certain; (4,0) is at 404 Hz, which nobody labelled."""
    peaks = {peak["hz"]: peak for peak in free.summary["peaks"]}
    modes = {mode["label"]: mode for mode in free.summary["modes"]}

    assert len(peaks) == 16
    assert set(UNLABELLED_2R) == {hertz for hertz, peak in peaks.items() if peak["stated"] is None}
    for hertz, peak in peaks.items():
        shares = [one["probability"] for one in peak["assignments"]]
        assert sum(shares) + peak["spurious_probability"] == pytest.approx(1.0, abs=0.03)  # the least are left out
        assert shares == sorted(shares, reverse=True)
        expected = 1200 * np.log2(hertz / peak["predicted_hz"]["mean"])
        assert peak["residual_cents"] == pytest.approx(expected, abs=1e-9)
        best = peak["assignments"][0]
        if best["probability"] > 0.5:
            assert modes[best["label"]]["measured_hz"] == hertz
    assert peaks[404.01]["assignments"][0]["label"] == "(4,0)"
    assert sum(peak["assignments"][0]["probability"] > 0.95 for peak in peaks.values()) >= 14
    assert {mode["label_origin"] for mode in modes.values()} == {"doubtful", "proposed"}
    (spectrum,) = free.summary["spectra"]
    assert (spectrum["missed_probability"], spectrum["spurious_probability"]) == (0.2, 0.02)
    assert sum(mode["seen_probability"] for mode in spectrum["modes"]) == pytest.approx(
        sum(1.0 - peak["spurious_probability"] for peak in peaks.values()), abs=1e-6
    )


def test_the_archive_of_a_board_with_peaks_holds_what_each_factor_says(free):
    """Readings whose label is sure, and all the others of a setup together."""
    group = arviz.from_netcdf(str(free.folder / "posterior.nc"), engine="h5netcdf")["log_likelihood"]

    assert group["readings_and_peaks"].dims == ("chain", "draw", "factor")
    assert group["factor"].values.tolist() == ["free peaks"]


@pytest.fixture(scope="module")
def archive(fiemme: bayesplate.FitResult) -> Any:
    assert fiemme.folder is not None
    return arviz.from_netcdf(str(fiemme.folder / "posterior.nc"), engine="h5netcdf")


def test_the_archive_opens_in_arviz_with_its_five_groups(archive, fiemme):
    posterior = archive["posterior"]
    assert {*ELASTIC, *RIGIDITY, "noise"} <= set(posterior.data_vars)
    for group in GROUPS[:4]:
        assert archive[group].sizes["chain"] == 4
        assert archive[group].sizes["draw"] == posterior.sizes["draw"]
    for group in ("log_likelihood", "posterior_predictive"):
        assert archive[group]["frequency"].dims == ("chain", "draw", "reading")
    predicted = archive["posterior_predictive"]["frequency"].values
    np.testing.assert_array_equal(predicted, np.round(predicted))  # as the readings are
    observed = archive["observed_data"]["frequency"]
    assert dict(zip(observed["reading"].values.tolist(), observed.values.tolist(), strict=True)) == {
        f"clamped {label}": hertz for label, hertz in FIEMME_HZ.items()
    }
    assert posterior["noise"]["setup"].values.tolist() == ["clamped"]
    for name, entry in fiemme.summary.elastic.items():
        assert float(posterior[name].mean()) == pytest.approx(entry.mean, rel=1e-12)


def test_the_archive_holds_what_was_judged_and_everything_that_a_run_follows_from(archive, summaries):
    """ArviZ would take walkers of one ensemble for independent draws; what was judged stands beside the draws."""
    stats, sampler, told = archive["sample_stats"], summaries["fiemme"]["sampler"], archive.attrs
    file = shelf_folder("boards") / "fiemme-spruce-clamped.toml"

    assert list(stats["parameter"].values) == ["log_D_x", "log_D_y", "log_D_s", "log_noise[clamped]"]
    assert "lp" in stats.data_vars
    assert float(stats["tau"].max()) == sampler["tau_max"]
    assert float(stats["rhat"].max()) == sampler["rhat_max"]
    assert float(stats["ess"].min()) == sampler["ess_min"]
    assert told["card"] == file.read_text(encoding="utf-8")
    assert told["card_sha256"] == Board.from_toml("fiemme-spruce-clamped").sha256
    assert (told["seed"], told["prior"]) == ("1", "weakly-informative")
    assert read_json(told["versions"]) == summaries["fiemme"]["versions"]
    assert set(read_json(told["priors"])) == set(load_prior("weakly-informative").constants)


def test_the_table_gives_every_mean_with_its_sd(finnish):
    """To the digits of the table: two significant ones of the sd."""
    assert finnish.exit_code == 0
    for name, entry in finnish.summary["elastic"].items():
        row = next(line for line in finnish.stdout.splitlines() if name in line)
        mean, sd = (float(word) for word in row.split("│")[2].split("±"))
        digits = len(row.split("│")[2].split("±")[1].strip().partition(".")[2])
        assert mean == pytest.approx(entry["mean"] / 1e9, abs=0.5001 * 10**-digits)
        assert sd == pytest.approx(entry["sd"] / 1e9, abs=0.5001 * 10**-digits)
        assert len(f"{sd:.{digits}f}".replace(".", "").lstrip("0")) == 2
    assert all(label in finnish.stdout for label in FINNISH_HZ)
    assert finnish.stdout.endswith(f"written to {finnish.folder}\n")


def test_only_the_results_are_left_and_json_is_the_summary(fiemme_files, finnish, free):
    assert (free.exit_code, free.stderr) == (0, "")
    assert read_json(free.stdout) == free.summary
    numbers = {"summary.json", "posterior.nc"}
    tables = {"constants.csv", "constants.tex"}
    figures = {name for name in fiemme_files if name.startswith("figures/")}
    assert set(fiemme_files) == {*numbers, "report.html", *tables, *figures}
    assert len(figures) == 20
    assert set(free.files) == set(finnish.files) == numbers


@pytest.mark.usefixtures("quickly")
def test_of_several_setups_noise_modes_and_readings_say_in_which(tmp_path):
    result = bayesplate.fit("steel-air-water", out=tmp_path / "out", report=False)
    setups = result.problem.board.setups
    labels = [(setup.name, str(label)) for setup in setups for label in setup.labels]

    assert list(result.summary.noise) == ["air", "water"]
    assert [(mode.setup, mode.label) for mode in result.summary.modes] == labels
    readings = arviz.from_netcdf(str(tmp_path / "out" / "posterior.nc"), engine="h5netcdf")["observed_data"]["reading"]
    assert readings.values.tolist() == [f"{setup} {label}" for setup, label in labels]
