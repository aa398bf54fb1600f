"""`pick` as a maker and a laboratory use it: files in, the [setup] out, labels, and nothing where it is refused."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import runs
from click.testing import CliRunner
from generator.sand import photograph
from made_recordings import CARD, E_X, E_Y, G_XY, SENSOR, SIDES, board, hits, write_taps, write_wav
from PIL import Image

import bayesplate
from bayesplate.cli import main
from bayesplate.commands.prepare import prepare
from bayesplate.errors import InputError
from bayesplate.recordings.sweeps import Sweep

TRUTH = {"E_x": E_X, "E_y": E_Y, "G_xy": G_XY}
HIGHEST = 430.0


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A folder with a card, three hits between two places, and a picture of sand; what was picked is in out/."""
    folder = tmp_path_factory.mktemp("bench")
    (folder / "planted.toml").write_text(CARD)
    rng = np.random.default_rng(2)
    for number in range(3):
        force, heard = hits(rng, [0.05], (0.02, 0.02), rate=4000.0)
        write_wav(folder / f"hit{number + 1}.wav", 4000.0, force, -heard)  # the sensor faces the hammer
    solved = board().modes
    Image.fromarray(np.round(255.0 * photograph(rng, solved.shape(2), SIDES)).astype(np.uint8)).save(
        folder / "sand.png"
    )
    sensor, sand = f"{1e3 * SENSOR[0]:g},{1e3 * SENSOR[1]:g}", f"{board().damped[2]:.0f}={folder / 'sand.png'}"
    arguments = [str(folder / f"hit{number}.wav") for number in (1, 2, 3)]
    arguments += ["--card", str(folder / "planted.toml"), "--hammer", "20,20", "--sensor", sensor, "--sand", sand]
    arguments += ["--sensor-mass", "0.6,0.1", "--highest", str(HIGHEST), "--out", str(folder / "out"), "--json"]
    result = CliRunner().invoke(main, ["pick", *arguments])
    assert result.exit_code == 0, result.output
    return folder, runs.read_json(result.stdout)


def test_json_has_the_planted_modes_with_labels_signs_and_errors(bench):
    _, found = bench
    truth = dict(zip(("({},{})".format(*name) for name, _ in board().modes.names()), board().damped, strict=False))
    likely = [peak for peak in found["peaks"] if peak["spurious_probability"] < 0.5 and peak["hz"] < 400.0]

    assert found["polarity"] == "opposite"
    assert len(likely) >= 7
    for peak in likely:
        label = peak["labels"][0]
        assert label["probability"] > 0.9
        assert abs(peak["hz"] - truth[label["label"]]) < max(4.0 * peak["sd_hz"], 1e-4 * peak["hz"])
        m, n = (int(index) for index in label["label"].strip("()").split(","))
        assert peak["sign"] == ("+" if (m + n) % 2 == 0 else "-")  # opposite corners


def test_the_fragment_is_a_setup_and_completes_the_card(bench):
    folder, found = bench
    setup = tomllib.loads((folder / "out" / "setup.toml").read_text())["setup"]
    prepared = prepare(folder / "planted.toml", setup=folder / "out" / "setup.toml")
    (read,) = prepared.card.setups

    assert setup["hammer"]["at_mm"] == [20, 20]
    assert setup["attached"] == [{"kind": "accelerometer", "at_mm": [560, 197], "mass_g": {"mean": 0.6, "sd": 0.1}}]
    n_likely = sum(peak["spurious_probability"] < 0.5 for peak in found["peaks"])
    assert len(read.readings) + len(read.peaks) == n_likely
    assert read.noise.median == pytest.approx(1e-3)
    assert setup["label_confidence"]["(2,1)"] > 0.9  # the sand said so
    assert read.ends_x == ("free", "free")


def test_the_page_shows_everything_and_fetches_nothing(bench):
    folder, found = bench
    page = (folder / "out" / "recordings.html").read_text()

    for peak in found["peaks"]:
        assert f"{peak['hz']:.2f}"[:-1] in page
    assert page.count("data:image/svg+xml;base64,") == 3
    assert "http" not in page.replace("http-equiv", "").replace("http://www.w3.org", "")
    assert {file.name for file in (folder / "out" / "figures").iterdir()} == {
        f"{name}.{ending}" for name in ("spectra", "errors", "stability") for ending in ("png", "svg")
    }


def test_places_and_masses_that_its_card_cannot_have_are_refused_before_anything_is_read(tmp_path):
    (tmp_path / "planted.toml").write_text(CARD)
    place = "wanted a place on the free part of the board"
    outside = {"hammer": [(0.6, 0.02)], "sensor": [(0.02, -0.003), (0.58, 0.217)], "sensor_mass": (0.3, 0.0)}
    for given, *faults in (
        (outside, f"hammer: {place}, x 0 to 580 mm, y 0 to 217 mm, got [600,", f"sensor 1: {place}",
         "sensor_mass: wanted less than the board's own 253.8 g, got 300 g"),
        ({"sensor": [(0, 0), (0.1, 0)], "sensor_mass": (0.03, 0.0)},
         "sensor_mass: wanted at most 2% of the board's 253.8 g for a sensor that rov"),
        # a microphone may be anywhere: then the files are read, which are not there
        ({"sensor": [(-0.01, 0.0)], "motion": "pressure"}, "a.wav: wanted a recording", "b.wav: wanted a recording"),
    ):  # fmt: skip
        with pytest.raises(InputError) as caught:
            bayesplate.pick(["a.wav", "b.wav"], card=tmp_path / "planted.toml", **given)
        for told, fault in zip(caught.value.faults, faults, strict=True):
            assert str(told).startswith(fault)


def test_a_sweep_is_given_by_its_file_as_by_its_numbers_and_no_other_file_stands_for_it(tmp_path):
    rate, sweep = 4000.0, Sweep(20.0, 900.0, 4.0)
    times = np.arange(round(2.0 * rate)) / rate
    poles = 2.0 * np.pi * (-board().hertz * board().damping + 1j * board().damped)
    impulse = board().residues((0.02, 0.02), SENSOR) @ np.imag(np.exp(poles[:, None] * times))
    response = np.convolve(sweep.signal(rate), impulse)
    response = response + 1e-3 * np.abs(response).max() * np.random.default_rng(1).standard_normal(response.size)
    heard = write_wav(tmp_path / "heard.wav", rate, response)
    played = write_wav(tmp_path / "played.wav", rate, sweep.signal(rate))

    by_file, by_numbers = (
        bayesplate.pick([heard], sweep=which, motion="displacement", highest=HIGHEST).summary.likely
        for which in (str(played), "20,900,4")
    )

    assert len(by_numbers) >= 5
    for peak in by_numbers:
        assert np.abs(board().damped / peak.hz - 1.0).min() < max(1e-3, 4.0 * peak.sd_hz / peak.hz)
    np.testing.assert_allclose([peak.hz for peak in by_file], [peak.hz for peak in by_numbers], rtol=1e-4)
    unrated = tmp_path / "unrated.csv"
    unrated.write_text("sound\n" + "\n".join(f"{sample:.6g}" for sample in sweep.signal(rate)))
    (heard_table := tmp_path / "heard.csv").write_text("sound\n" + "\n".join(f"{one:.6g}" for one in response))
    in_tables = bayesplate.pick([heard_table], sweep=unrated, rate=rate, motion="displacement", highest=HIGHEST)
    np.testing.assert_allclose([peak.hz for peak in in_tables.summary.likely], [p.hz for p in by_numbers], rtol=1e-3)
    for which, fault in (
        (heard, "heard.wav: wanted a sweep, as it was played, got its level goes up and down by"),
        (tmp_path / "nowhere.wav", "nowhere.wav: wanted a recording, got no such file"),
        (Path("nowhere"), "sweep: wanted F1,F2,SECONDS or a file"),
    ):
        with pytest.raises(InputError) as caught:
            bayesplate.pick([heard], sweep=which, motion="displacement", highest=HIGHEST)
        assert str(caught.value).startswith(fault)


def test_a_fragment_of_another_name_is_one_more_setup_and_one_of_the_same_replaces_all_readings(tmp_path):
    """Edges and noise of the card stay; of two sets of readings of one setup nobody could tell which is meant."""
    card, fragment = tmp_path / "planted.toml", tmp_path / "fragment.toml"
    card.write_text(CARD + 'unlabelled_hz = [404]\n[setup.frequencies_hz]\n"(1,1)" = 51\n')
    edges = 'edges = { x0 = "clamped", x1 = "free", y0 = "free", y1 = "free" }\n'
    fragment.write_text(f'[setup]\nname = "held"\n{edges}unlabelled_hz = [31]\n')
    first, second = prepare(card, setup=fragment).card.setups

    assert (first.name, second.name, second.ends_x) == ("setup", "held", ("clamped", "free"))
    assert [str(reading.label) for reading in first.readings] == ["(1,1)"]

    fragment.write_text('[setup.frequencies_hz]\n"(2,0)" = 76.2\n')
    (setup,) = prepare(card, setup=fragment).card.setups

    assert [(str(reading.label), reading.frequency.mean) for reading in setup.readings] == [("(2,0)", 76.2)]
    assert setup.peaks == ()
    assert setup.noise.median == pytest.approx(1e-3)


@pytest.mark.slow
def test_from_phone_taps_to_a_posterior_that_holds_the_truth(tmp_path):
    """Two recordings of six taps each, hum and all, in one go; the wrong density is the negative control."""
    (tmp_path / "planted.toml").write_text(CARD)
    taps = write_taps(tmp_path, np.random.default_rng(6))
    found = bayesplate.pick(
        taps, card=tmp_path / "planted.toml", motion="pressure", highest=500.0, out=tmp_path / "out"
    )
    fragment = tmp_path / "out" / "setup.toml"

    fitted = bayesplate.fit(tmp_path / "planted.toml", setup=fragment).summary
    wrong = tmp_path / "wrong" / "planted.toml"
    wrong.parent.mkdir()
    wrong.write_text(CARD.replace("= 429", "= 450"))
    control = bayesplate.fit(wrong, setup=fragment).summary

    assert json.loads((tmp_path / "out" / "pick.json").read_text())["n_hits"] == found.summary.n_hits == 12
    for name, truth in TRUTH.items():
        assert abs(fitted.elastic[name].mean - truth) < 3.5 * fitted.elastic[name].sd
        assert abs(control.elastic[name].mean - truth) > 3.5 * control.elastic[name].sd
