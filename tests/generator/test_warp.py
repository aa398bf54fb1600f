"""Warp against the table of physics.md, a limit in closed form, another writing of the strains, its symmetries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from generator.effects import (
    ClampRotation,
    TransverseShear,
)
from generator.known_boards import BEAMS, FIEMME, FINNISH, HALF_TOP, cents
from generator.naming import frequencies
from generator.plate import EDGES, Plate, solve
from generator.warp import Warp

MM = 1e-3
BOWL = Warp(1.3 * MM, 2.0 * MM, 16.0 * MM)
SADDLE = replace(BOWL, bow=-BOWL.bow)
TABLE = {
    "cup 1": (Warp(cup=1.0 * MM), [0.1, 30.3, 1.2, 0.0, 0.8, 10.8, 1.5, 0.9, 4.7]),
    "cup 2": (Warp(cup=2.0 * MM), [0.3, 115.0, 4.8, 0.1, 2.6, 42.7, 5.9, 3.8, 18.8]),
    "bow 2": (Warp(bow=2.0 * MM), [0.0, 0.4, 0.0, 29.4, 5.3, 0.4, 0.0, 4.1, 0.0]),
    "twist 8": (Warp(twist=8.0 * MM), [48.7, 0.0, 12.0, 0.0, 2.7, 0.2, 3.1, 3.1, 0.0]),
    "dome": (BOWL, [152.6, 52.2, 46.4, 31.7, 12.1, 25.2, 13.6, 23.9, 8.0]),
    "saddle": (SADDLE, [147.4, 73.2, 46.5, 29.7, 22.3, 15.6, 14.7, 13.2, 8.1]),
}
SHEAR = TransverseShear(0.62e9, 0.03e9)


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize(("warp", "printed"), TABLE.values(), ids=TABLE)
def test_table_of_the_half_top(warp: Warp, printed: list[float], is_sheared: bool) -> None:
    """Printed to 0.1 cent by a solver of 13 polynomials: half a unit of the last digit and as much for that solver.

    So stiff in shear that only the rotary inertia is left, the shifts are the same.
    """
    plate = replace(HALF_TOP, shear=(1e13, 1e13)) if is_sheared else HALF_TOP

    assert cents(plate, [warp], BEAMS["half-top"]) == pytest.approx(printed, abs=0.1)


def test_stiff_cross_section_is_a_deeper_beam() -> None:
    """1 + (4/45) c^2 / (h^2 / 12) of an arc that keeps its shape; a thousand times stiffer it gives 0.03 cents way."""
    c = 1.0 * MM
    stiff = replace(HALF_TOP, E_y=1e3 * HALF_TOP.E_x, G_xy=1e3 * HALF_TOP.E_x, nu_xy=1e-4)
    flat, cupped = (solve(stiff, warp, n_modes=4).frequencies[3] for warp in ((), [Warp(cup=c)]))
    deeper = 600.0 * np.log2(1.0 + 4.0 / 45.0 * c**2 / (stiff.h**2 / 12.0))

    assert deeper == pytest.approx(52.02, abs=0.01)
    assert 1200.0 * np.log2(cupped / flat) == pytest.approx(deeper, abs=0.05)


@pytest.mark.parametrize("plate", [FINNISH, HALF_TOP, FIEMME], ids=["cantilever", "free", "clamped"])
def test_what_signs_mean(plate: Plate) -> None:
    """All at once change nothing, that of the twist alone nothing; a dome is no saddle."""
    warp = Warp(0.5 * MM, 0.8 * MM, 2.0 * MM)
    found = {
        signs: solve(plate, [Warp(*(np.multiply(signs, (warp.cup, warp.bow, warp.twist))))], 9).frequencies[3:]
        for signs in ((1, 1, 1), (-1, -1, -1), (1, 1, -1), (1, -1, 1))
    }

    assert found[-1, -1, -1] == pytest.approx(found[1, 1, 1], rel=1e-9)
    assert found[1, 1, -1] == pytest.approx(found[1, 1, 1], rel=1e-9)
    assert np.abs(1200.0 * np.log2(found[1, -1, 1] / found[1, 1, 1])).max() > 1.0


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


def test_a_saddle_of_equal_rises_does_not_stretch_under_one_half_wave() -> None:
    """Supported, w = sin sin: kx w_yy + ky w_xx is zero where cup = -bow, so there is no stress; a dome has some."""
    supported = replace(FIEMME, edges=dict.fromkeys(EDGES, "supported"))
    saddle, dome = (cents(supported, [Warp(1.0 * MM, bow)], [(0, 0)])[0] for bow in (-1.0 * MM, 1.0 * MM))

    assert saddle == pytest.approx(0.0, abs=1e-3)
    assert dome > 10.0


def test_the_membrane_ends_at_the_outline() -> None:
    """A narrower rectangle inside wider polynomials is the narrower board; its cup goes with its width squared."""
    width, cup = 0.95 * HALF_TOP.L_y, 2.0 * MM
    narrow = replace(HALF_TOP, L_y=width)
    inside = replace(HALF_TOP, outline=((0.0, width), (HALF_TOP.L_x, width)))
    found = solve(inside, [Warp(cup)], 9, (11, 11)).frequencies[3:]
    expected = solve(narrow, [Warp(cup * 0.95**2)], 9, (11, 11)).frequencies[3:]

    assert found == pytest.approx(expected, rel=1e-6)
