"""Sand: pictures of the generator's shapes are told apart by the package's, and what is no picture is refused."""

from __future__ import annotations

import numpy as np
import pytest
import ritz
from generator.sand import photograph
from made_recordings import refusal
from PIL import Image

from bayesplate.commands.prepare import prepare
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.frequencies.system import system_of
from bayesplate.recordings.sand import read_picture, sand_evidence, straighten_picture

GRID = np.linspace(0.0, 1.0, 61)
MODES = {"finnish-spruce-cantilever": (ritz.FINNISH, (1, 5)), "fiemme-spruce-clamped": (ritz.FIEMME, (2, 5))}
"""Board and some of its modes, none of a veering pair."""


def shapes_of(name: str, plate: ritz.Plate, n_modes: int = 10) -> np.ndarray:
    """The package's shapes at the constants of the generator's plate."""
    board = prepare(name).board
    values = {**board.nominal(), "D_x": plate.D_x, "D_y": plate.D_y, "D_s": plate.D_s}
    modes, _ = spectrum(system_of(board, board.setups[0]), values, n_modes)
    return modes.displacement(GRID, GRID)


@pytest.mark.parametrize("name", MODES)
def test_the_mode_is_told_from_all_others_and_a_picture_of_nothing_from_none(name):
    """Ten modes without a word on the frequency, lines lighter or darker than the board.

    A picture of noise alone is the negative control.
    """
    plate, shown = MODES[name]
    solved = ritz.solve(ritz.Ritz(plate))
    shapes = shapes_of(name, plate)
    rng = np.random.default_rng(3)
    for mode in shown:
        picture = photograph(rng, solved.shape(mode), (plate.L_x, plate.L_y))
        evidence = sand_evidence(straighten_picture(picture), shapes)
        assert int(np.argmax(evidence)) == mode
        assert np.exp(evidence[mode]) / np.exp(evidence).sum() > 0.5
    np.testing.assert_allclose(sand_evidence(straighten_picture(1.0 - picture), shapes), evidence, atol=1e-6)
    nothing = sand_evidence(straighten_picture(np.clip(0.5 + 0.2 * rng.standard_normal((120, 240)), 0.0, 1.0)), shapes)
    assert np.exp(nothing).max() / np.exp(nothing).sum() < 0.5


def test_a_picture_is_read_as_it_is_seen(tmp_path):
    """Rows run downward: the light upper half comes first."""
    values = np.full((60, 120), 40, dtype=np.uint8)
    values[:30] = 200
    Image.fromarray(values).convert("RGB").save(tmp_path / "a.png")

    np.testing.assert_allclose(read_picture(tmp_path / "a.png"), values / 255.0, atol=0.01)


def test_a_picture_is_read_as_its_camera_was_held_whatever_its_shades_are(tmp_path):
    values = np.full((60, 120), 40, dtype=np.uint8)
    values[:30] = 200
    Image.fromarray(values.astype(np.uint16) * 257).save(tmp_path / "deep.png")
    turned = Image.fromarray(values.T[::-1])
    orientation = turned.getexif()
    orientation[0x0112] = 6  # to be turned by a quarter, clockwise
    turned.save(tmp_path / "turned.png", exif=orientation)
    clear = np.zeros((60, 120, 4), dtype=np.uint8)
    clear[..., 3] = 255 - values
    Image.fromarray(clear).save(tmp_path / "clear.png")

    for name in ("deep", "turned", "clear"):
        np.testing.assert_allclose(read_picture(tmp_path / f"{name}.png"), values / 255.0, atol=0.01, err_msg=name)


def test_what_is_no_picture_with_lines_is_refused(tmp_path):
    (tmp_path / "a.png").write_bytes(b"not a picture")
    (tmp_path / "a.svg").write_bytes(b"<svg/>")
    Image.fromarray(np.full((60, 60), 99, dtype=np.uint8)).save(tmp_path / "blank.png")
    Image.fromarray(np.arange(8000, dtype=np.uint8).reshape(20, 400)).save(tmp_path / "thin.png")
    broken = bytearray((tmp_path / "blank.png").read_bytes())
    broken[8:12] = b"\0\0\0\1"
    (tmp_path / "broken.png").write_bytes(broken)
    (tmp_path / "folder.png").mkdir()
    for name, said in {
        "a.png": "a.png: wanted a PNG or JPEG picture, got another kind of file",
        "broken.png": "broken.png: wanted a PNG or JPEG picture, got Truncated",
        "folder.png": "folder.png: wanted a PNG or JPEG picture, got Is a directory",
        "thin.png": "thin.png: wanted a picture of the whole board, got 400 x 20 (is it cropped to the board?)",
        "a.svg": 'a.svg: wanted a PNG or JPEG picture, got ".svg" (crop it to the board',
        "a.jpg": "a.jpg: wanted a picture, got no such file",
        "blank.png": "blank.png: wanted a picture with lines on it, got one shade",
    }.items():
        assert said in refusal(read_picture, tmp_path / name)
