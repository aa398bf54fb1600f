"""`modes`: the table of the lowest modes, the sheet's files, and boards that were not measured yet."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import ritz
import runs
from click.testing import CliRunner

from bayesplate.board.board import Board, board_density, vibrating_lengths
from bayesplate.board.setup import Setup
from bayesplate.cli import main
from bayesplate.commands.modes import modes
from bayesplate.commands.prepare import prepare
from bayesplate.commands.printout import show_modes
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.frequencies.laws import cents

UNMEASURED = """\
format = 1
name = "not-yet"

[plate]
length_x_mm = 400
length_y_mm = 200
thickness_mm = 3
density_kg_m3 = 450

[material]
prior = "spruce"
poisson_xy = 0.4

[setup]
edges = { x0 = "supported", x1 = "supported", y0 = "supported", y1 = "supported" }
"""


@pytest.fixture(scope="session")
def finnish_sheet(tmp_path_factory):
    """The cantilever board through the command line, with its output folder."""
    folder = tmp_path_factory.mktemp("modes")
    result = CliRunner().invoke(main, ["modes", "finnish-spruce-cantilever", "--json", "--out", str(folder)])
    assert result.exit_code == 0, result.stderr
    return runs.Run(result.exit_code, result.stdout, result.stderr, folder)


def test_the_table_of_the_cantilever_board(finnish_sheet):
    (setup,) = runs.read_json(finnish_sheet.stdout)["setups"]
    by_label = {mode["label"]: mode for mode in setup["modes"]}

    assert len(setup["modes"]) == 12
    assert [mode["hz"] for mode in setup["modes"]] == sorted(mode["hz"] for mode in setup["modes"])
    # At the weighted estimate, by another solver: twelve polynomials a side, within 0.03 cents of twenty.
    board = prepare("finnish-spruce-cantilever").board
    (held,) = board.setups
    nominal = board.nominal()
    sides = (float(length) for length in vibrating_lengths(nominal, held))
    material = (float(nominal["poisson_xy"]), float(board_density(nominal)), float(nominal["thickness"]))
    bare = ritz.Ritz(ritz.Plate(*weighted_least_squares(board).rigidities, *material, *sides, held.edges), 12)
    hertz = ritz.solve(bare, bare.stiffness).frequencies[:12]
    assert cents(np.log([mode["hz"] for mode in setup["modes"]] / hertz)) == pytest.approx(np.zeros(12), abs=0.5)
    for label, measured in zip(held.labels, held.measured, strict=True):
        mode = by_label[str(label)]
        assert mode["residual_cents"] == pytest.approx(float(cents(np.log(measured / mode["hz"]))), abs=1e-6)
    for mode in setup["modes"]:
        assert sum(mode["share_percent"].values()) == pytest.approx(100, abs=0.2)
        assert mode["share_percent"]["effects"] == 0
        assert (mode["measured_hz"] is None) == (mode["likely_hz"] is not None)
        if mode["likely_hz"] is not None:  # what the others foretell
            low, high = mode["likely_hz"]
            assert mode["hz"] == pytest.approx(np.sqrt(low * high))
            # No less than the expected noise of a clamped board, 0.8 %; no more than an error of 10 % in a stiffness.
            assert 0.967 * 0.008 <= np.log(high / low) / 2 < 0.5 * 0.10
    # The paper's (1,0): a = 3.21, b really negative.
    assert (by_label["(1,0)"]["a"], by_label["(1,0)"]["b"]) == pytest.approx((3.21, -0.34), abs=0.05)


def test_the_sheet_is_replaced_where_it_is_forced(finnish_sheet):
    first = runs.files_in(finnish_sheet.folder)
    arguments = ["modes", "finnish-spruce-cantilever", "--out", str(finnish_sheet.folder)]
    forced = CliRunner().invoke(main, [*arguments, "--force", "--quiet"])

    assert set(first) == {"modes.png", "modes.svg"}
    assert first["modes.png"].startswith(b"\x89PNG")
    assert b"<svg" in first["modes.svg"]
    assert (forced.exit_code, forced.stdout) == (0, "")
    assert runs.files_in(finnish_sheet.folder) == first  # no time stamp: the same bytes


def test_shear_has_a_share_where_it_is_declared():
    (setup,) = modes("fiemme-spruce-clamped", effects=["transverse_shear"]).summary.setups

    assert setup.theory == "shear-flexible"
    assert all(0 < mode.share_percent.effects < 15 for mode in setup.modes)


def test_a_board_not_measured_yet_is_computed_from_the_prior(tmp_path):
    """Supported all round: closed form, omega^2 = pi^4 (D_x m^4 / L_x^4 + ... ) / rho h, at the median of the prior.

    To first order ln f has half the shares times the prior's log sds; two thirds of a normal lie within 0.967 sd.
    """
    (tmp_path / "not-yet.toml").write_text(UNMEASURED, encoding="utf-8")
    result = modes(tmp_path / "not-yet.toml")
    (setup,) = result.summary.setups
    E_x, E_y, G, h, rho, nu = 11e9, 0.95e9, 0.67e9, 3e-3, 450.0, 0.4
    D_x, D_y = (E * h**3 / 12 / (1 - nu**2 * E_y / E_x) for E in (E_x, E_y))
    D_s = G * h**3 / 3
    log_sds = np.log([1.35, 1.75, 1.5])

    for mode in setup.modes[:6]:
        m, n = (int(number) + 1 for number in mode.label.strip("()").split(","))
        x, y = m * np.pi / 0.4, n * np.pi / 0.2
        squared = (D_x * x**4 + D_y * y**4 + (2 * nu * D_y + D_s) * x**2 * y**2) / (rho * h)
        assert mode.hz == pytest.approx(np.sqrt(squared) / (2 * np.pi), rel=1e-3)
    for mode in setup.modes:
        shares = np.array([mode.share_percent.D_x, mode.share_percent.D_y, mode.share_percent.D_s]) / 100
        half_width = 0.967 * np.sqrt(np.sum((shares * log_sds / 2) ** 2))
        low, high = mode.likely_hz
        assert low < mode.hz < high
        assert np.log(high / low) / 2 == pytest.approx(half_width, rel=0.1)
    assert "median of the prior" in result.summary.basis


def test_a_setup_not_measured_yet_is_computed_from_those_that_were():
    board = Board.from_toml("finnish-spruce-cantilever")
    bench = replace(board.setups[0], name="bench")
    planned = Setup.from_frequencies({}, edges="free", name="free")
    report = modes(replace(board, setups=(bench, planned))).summary
    alone = modes(board).summary

    assert report.basis == alone.basis
    assert [mode.hz for mode in report.setups[0].modes] == [mode.hz for mode in alone.setups[0].modes]
    low, high = report.setups[1].modes[0].likely_hz
    assert high / low < 1.1  # from the prior, a factor of two


def test_bare_peaks_are_given_labels_and_told_how_to_write_them(tmp_path):
    """The peaks of a shipped card, its labels taken away: the sheet is then that of the labels."""
    card = tmp_path / "bare.toml"
    card.write_text(
        UNMEASURED.replace('"supported"', '"free"').replace("not-yet", "bare")
        + "unlabelled_hz = [40.1, 63.9, 96.9, 108.3, 123.6, 176.2]\n"
    )
    report = modes(card).summary
    shown = show_modes(report)

    assert shown.tables[0].title == "Labels proposed for the peaks of bare"
    assert "no peak has a label, so these are proposals" in shown.remarks[0]
    assert report.basis.endswith("with the labels proposed")
    assert [one.measured_hz for one in report.proposed] == [40.1, 63.9, 96.9, 108.3, 123.6, 176.2]
    for one in report.proposed:
        assert sum(one.probability.values()) == pytest.approx(1.0)
    measured = {mode.label: mode.measured_hz for mode in report.setups[0].modes if mode.measured_hz is not None}
    assert measured == {one.label: one.measured_hz for one in report.proposed if one.label}
    other = [replace(one, setup="other") for one in report.proposed]
    two = replace(report, setups=(report.setups[0],) * 2, proposed=(*report.proposed, *other))
    (remark,) = show_modes(two).remarks
    own, others = re.findall(r"frequencies_hz = \{ .*? \}(?= in setup)", remark)
    assert tomllib.loads(own) == tomllib.loads(others) == {"frequencies_hz": measured}
    assert [row[0] for row in show_modes(two).tables[0].rows][-1] == "176.2 other"
