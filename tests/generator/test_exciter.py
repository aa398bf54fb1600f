"""The exciter against the table of physics.md and a series of modes in closed form, and the magnet's own mode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

from generator.effects import NoEffect
from generator.exciter import Exciter
from generator.known_boards import BEAMS, DRIVEN
from generator.naming import LEAST_CORRELATION, frequencies, named
from generator.plate import EDGES, solve

QUARTER = ((0.25 * DRIVEN.L_x, 0.25 * DRIVEN.L_y),)
THIRD = ((DRIVEN.L_x / 3.0, DRIVEN.L_y / 3.0),)
MIDDLE = ((0.5 * DRIVEN.L_x, 0.5 * DRIVEN.L_y),)
TABLE = {
    "38.6 Hz": (38.6, QUARTER, [46.5, 27.2, 12.7, 14.4, 4.2, -1.8]),
    "a third in": (38.6, THIRD, [154.7, 52.9, 25.5, 14.5, 0.6, -0.1]),
}
"""Resonance of the magnet, Hz, place, and shifts, cents, by a solver of 13 polynomials, four of them for the edges."""


def shifts(effect: NoEffect, n: int) -> np.ndarray:
    """Shift of each mode of the clamped board by an exciter, cents, with n polynomials along each side."""
    bare, driven = (frequencies(DRIVEN, effects, BEAMS["clamped"], (n, n))[0] for effects in ((), [effect]))
    return np.array([1200.0 * np.log2(driven[mode] / bare[mode]) for mode in bare])


@pytest.mark.parametrize(("resonance", "places", "printed"), TABLE.values(), ids=TABLE)
def test_table_of_the_clamped_board(resonance: float, places, printed: list[float]) -> None:
    """With the table's own 13 - 4 polynomials, 0.5 cents: its 38.6 Hz is rounded, worth 0.15 and 0.4 in (0,0)."""
    exciter = Exciter.at_resonance(resonance, 48e-3, places)

    assert exciter.mass - exciter.coil_mass == pytest.approx(46.4e-3)
    assert shifts(exciter, 9) == pytest.approx(printed, abs=0.5)


def dynamic_stiffness(exciter: Exciter, omega: float) -> float:
    """Force over deflection of an exciter whose coil moves by one."""
    m, k = exciter.mass - exciter.coil_mass, exciter.suspension
    magnet = k if exciter.magnet == "held" else k * -m * omega**2 / (k - m * omega**2)
    return magnet - exciter.coil_mass * omega**2


@pytest.mark.parametrize("magnet", ["free", "held"])
def test_supported_board_against_its_series_of_modes(magnet: str) -> None:
    """Where the receptance of 400 x 400 sine modes cancels the exciter's.

    0.2 cents: 24 polynomials leave up to 1.3, and 16 and 24 together, extrapolated by their squares, a seventh of it.
    """
    plate = replace(DRIVEN, edges=dict.fromkeys(EDGES, "supported"))
    place = (0.3 * plate.L_x, 0.4 * plate.L_y)
    exciter = Exciter(30e-3, (place,), 2e-3, 3500.0, magnet)
    m, n = np.pi * np.arange(1, 401)[:, None] / plate.L_x, np.pi * np.arange(1, 401)[None, :] / plate.L_y
    twist = 4.0 * plate.G_xy * plate.h**3 / 12.0 + 2.0 * plate.nu_xy * plate.D_y
    inertia = plate.rho * plate.h
    squares = (plate.D_x * m**4 + plate.D_y * n**4 + twist * m**2 * n**2) / inertia
    moved = 4.0 * (np.sin(m * place[0]) * np.sin(n * place[1])) ** 2 / (inertia * plate.L_x * plate.L_y)

    def out_of_balance(hz: float) -> float:
        omega = 2.0 * np.pi * hz
        return 1.0 / dynamic_stiffness(exciter, omega) + float(np.sum(moved / (squares - omega**2)))

    coarse, fine = (solve(plate, [exciter], 6, (n, n)).frequencies for n in (16, 24))
    found = fine + (fine - coarse) * 16**2 / (24**2 - 16**2)
    exact = [scipy.optimize.brentq(out_of_balance, 0.998 * hz, 1.002 * hz, xtol=1e-9) for hz in found]

    assert 1200.0 * np.log2(found / exact) == pytest.approx(0.0, abs=0.2)


def test_the_magnets_own_mode_takes_no_label() -> None:
    """It bends the board like (0,0): in the middle, by its shape alone, it would take that label from the board."""
    resonance = 38.6
    exciter = Exciter.at_resonance(resonance, 48e-3, MIDDLE)
    modes = solve(DRIVEN, [exciter], 14)
    labels = named(modes, DRIVEN.edges)
    lowest = modes.frequencies[0]

    assert modes.shares[0] < 0.2
    assert np.all(modes.shares[1:] > 0.8)
    assert 0.7 * resonance < lowest < resonance  # the board gives way too
    assert lowest not in [labels[mode][0] for mode in BEAMS["clamped"]]
    assert solve(DRIVEN, [replace(exciter, magnet="held")], 14).shares == pytest.approx(1.0)


def test_a_magnet_that_swings_with_the_board_leaves_the_label_in_doubt() -> None:
    """At 80 Hz (0,0) is half the magnet's motion in two modes: no board is planted on such a label."""
    doubtful, clear = (
        frequencies(DRIVEN, [Exciter.at_resonance(hz, 48e-3, QUARTER)], BEAMS["clamped"])[1] for hz in (80.0, 28.0)
    )

    assert doubtful < LEAST_CORRELATION < 0.9 < clear
