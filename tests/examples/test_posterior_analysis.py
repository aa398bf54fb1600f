"""The example of a fit: it runs, and gives the numbers of the board."""

from __future__ import annotations

import pytest

# GPa, from an independent exact fit of the thin plate (README); the percentile band of the paper lies beside it.
MEANS = {"E_x": 13.3, "E_y": 0.638, "G_xy": 0.603}
SDS = {"E_x": 0.40, "E_y": 0.045, "G_xy": 0.022}


def test_the_numbers_of_the_cantilever_board(load, tmp_path):
    numbers = load("posterior_analysis").run(tmp_path / "figure.png", corner=tmp_path / "corner.png")

    for name, row in numbers.items():
        assert row["mean"] == pytest.approx(MEANS[name], abs=0.15 * SDS[name])
        assert row["sd"] == pytest.approx(SDS[name], rel=0.1)
    assert numbers["E_x"]["within_percentile_band"] > 0.4
    assert max(numbers[name]["within_percentile_band"] for name in ("E_y", "G_xy")) < 0.2
    for name in ("figure.png", "corner.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
