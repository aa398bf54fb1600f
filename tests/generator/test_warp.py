"""Warp against the table of physics.md, and what its sizes mean."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from generator.effects import (
    ClampRotation,
)
from generator.known_boards import BEAMS, FIEMME, HALF_TOP, cents
from generator.naming import frequencies
from generator.plate import EDGES, solve
from generator.warp import Warp

MM = 1e-3
BOWL = Warp(1.3 * MM, 2.0 * MM, 16.0 * MM)
SADDLE = replace(BOWL, bow=-BOWL.bow)
TABLE = {
    "dome": (BOWL, [152.6, 52.2, 46.4, 31.7, 12.1, 25.2, 13.6, 23.9, 8.0]),
    "saddle": (SADDLE, [147.4, 73.2, 46.5, 29.7, 22.3, 15.6, 14.7, 13.2, 8.1]),
}


@pytest.mark.parametrize(("warp", "printed"), TABLE.values(), ids=TABLE)
def test_table_of_the_half_top(warp: Warp, printed: list[float]) -> None:
    """Printed to 0.1 cent by a solver of 13 polynomials: half a unit of the last digit and as much for that solver."""
    assert cents(HALF_TOP, [warp], BEAMS["half-top"]) == pytest.approx(printed, abs=0.1)


def test_curvatures_are_those_a_straightedge_shows() -> None:
    """The unloaded shape drawn from them: rises of the middles, a corner lifted off the plane of the other three."""
    plate = replace(HALF_TOP, L_x=0.55, covered=0.03, whole=0.58)
    xx, yy, twice_xy = BOWL.curvatures(plate)
    L_x, L_y = 0.58, plate.L_y

    def shape(x: float, y: float) -> float:
        x, y = x - 0.5 * L_x, y - 0.5 * L_y
        return 0.5 * xx * x**2 + 0.5 * yy * y**2 + 0.5 * twice_xy * x * y

    assert shape(0.5 * L_x, 0.0) - shape(0.5 * L_x, 0.5 * L_y) == pytest.approx(BOWL.cup)
    assert shape(0.0, 0.5 * L_y) - shape(0.5 * L_x, 0.5 * L_y) == pytest.approx(BOWL.bow)
    assert shape(L_x, L_y) - shape(L_x, 0.0) - shape(0.0, L_y) + shape(0.0, 0.0) == pytest.approx(BOWL.twist)


def test_only_clamped_edges_hold_the_board_in_its_plane() -> None:
    """Supported all round it slides: a dome stiffens (0,0) much less than clamped springs of no resistance do."""
    supported = replace(FIEMME, edges=dict.fromkeys(EDGES, "supported"))
    dome = Warp(1.0 * MM, 1.0 * MM)
    slides = cents(supported, [dome], [(0, 0)])[0]
    loose = ClampRotation(1e-6)
    flat, held = (solve(FIEMME, [loose, *warp], 1).frequencies[0] for warp in ((), [dome]))

    assert frequencies(supported, (), [(0, 0)])[0][0, 0] == pytest.approx(flat, rel=1e-6)
    assert 1200.0 * np.log2(held / flat) > 2.0 * slides > 0.0


def test_the_membrane_ends_at_the_outline() -> None:
    """A narrower rectangle inside wider polynomials is the narrower board; its cup goes with its width squared."""
    width, cup = 0.95 * HALF_TOP.L_y, 2.0 * MM
    narrow = replace(HALF_TOP, L_y=width)
    inside = replace(HALF_TOP, outline=((0.0, width), (HALF_TOP.L_x, width)))
    found = solve(inside, [Warp(cup)], 9, (11, 11)).frequencies[3:]
    expected = solve(narrow, [Warp(cup * 0.95**2)], 9, (11, 11)).frequencies[3:]

    assert found == pytest.approx(expected, rel=1e-6)
