"""Frequencies of plates: handbooks, exact formulas, Ritz, finite elements, and how they converge to these."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import ritz
from closed_forms import navier
from either_theory import G_SPRUCE, SQUARE, SUPPORTS, cents, solved, with_thickness
from limits import meets

from bayesplate.plate.mesh import ELEMENTS_PER_SIDE, mesh
from bayesplate.plate.terms import Weights

THICK = ritz.Plate.from_moduli(10e9, 10e9, 10e9 / 2.6, 0.3, rho=450.0, h=0.1, L_x=1.0, L_y=1.0, edges=ritz.ALL_CLAMPED)
G_ISOTROPIC = (10e9 / 2.6, 10e9 / 2.6)
BOARDS = {"square": SQUARE, "finnish": ritz.FINNISH, "fiemme": ritz.FIEMME, "guitar": ritz.FREE_SPRUCE}

# omega L^2 sqrt(rho h / D) of the lowest mode of an isotropic square plate, nu = 0.3.
HANDBOOK = {"clamped": 35.9852, "free": 13.4682, "cantilever": 3.4711}

# Two independent elements at the paper's mean constants, converged, and what the paper prints.
FINITE_ELEMENTS = {
    "cantilever": (ritz.FINNISH, [51.24, 99.87, 315.08, 335.59, 394.40, 629.69], [51, 100, 315, 336, 394, 629]),
    "clamped": (ritz.FIEMME, [56.20, 97.91, 130.35, 161.47, 168.88, 221.53], [56, 98, 130, 161, 169, 221]),
}


def hertz(board, n_modes, shape=None):
    return np.sqrt(solved(board, n_modes, shape=shape).eigenvalues) / (2.0 * np.pi)


@cache
def reference(board_name, support, n_modes=12):
    """Frequencies by Ritz; between 20 and 26 polynomials they move by 0.0016 % at most (square cantilever)."""
    return ritz.frequencies(replace(BOARDS[board_name], edges=SUPPORTS[support]), n_modes, n=26)


@pytest.mark.parametrize(("support", "omega"), HANDBOOK.items())
def test_lowest_mode_of_a_square_plate_is_that_of_the_handbooks(support, omega):
    board = replace(SQUARE, edges=SUPPORTS[support])

    assert np.sqrt(solved(board, 1).eigenvalues[0]) == pytest.approx(omega, rel=1e-4)


SUPPORTED = {
    "spruce": (ritz.FINNISH, None, None, "closed form, supported all round, 12 modes", 0.346),
    "isotropic, sheared, very thin": (
        with_thickness(THICK, 1 / 2000), G_ISOTROPIC, (20, 18), "closed form with transverse shear, 6 modes", 0.1,
    ),
    "spruce, sheared, a tenth thick": (
        with_thickness(ritz.FREE_SPRUCE, ritz.FREE_SPRUCE.L_y / 10), G_SPRUCE, (20, 18),
        "closed form with transverse shear, 6 modes", 0.1,
    ),
}  # fmt: skip


@pytest.mark.parametrize(("board", "shear_moduli", "shape", "words", "limit"), SUPPORTED.values(), ids=SUPPORTED)
def test_supported_plate_has_the_exact_spectrum(board, shear_moduli, shape, words, limit):
    board = replace(board, edges=ritz.ALL_SUPPORTED)
    n_modes = 12 if shear_moduli is None else 6

    off = np.abs(cents(solved(board, n_modes, shear_moduli, shape).eigenvalues, navier(board, shear_moduli, n_modes)))

    # The first mode of the thin plate within 0.01 %.
    assert off[0] < 0.173
    meets("V10", words, off.max(), at_most=limit, unit="cents")


def test_the_exact_sheared_plate_is_not_the_thin_one():
    """The closed form above would not notice a plate without shear if the plate were thin: these are 50 cents apart."""
    assert cents(*(navier(THICK, shear_moduli, 6) for shear_moduli in (G_ISOTROPIC, None))).max() < -50.0


@pytest.mark.parametrize(
    ("board_name", "support"),
    [("finnish", "cantilever"), ("fiemme", "clamped"), ("guitar", "free"), ("square", "mixed"), ("finnish", "mixed")],
)
def test_twelve_modes_agree_with_ritz_on_the_production_mesh(board_name, support):
    """First mode within 0.01 %, twelve within 0.02 % (a third of a cent)."""
    board = replace(BOARDS[board_name], edges=SUPPORTS[support])

    off = 2.0 * np.abs(cents(hertz(board, 12), reference(board_name, support)))

    assert off[0] < 0.173
    meets("V10", "Ritz in Legendre polynomials, 12 modes", off.max(), at_most=0.346, unit="cents")


@pytest.mark.parametrize("ratio", [1e-4, 0.3, 1e5])
def test_mesh_follows_the_wavelengths_and_keeps_its_size(ratio):
    n_x, n_y = mesh(Weights(np.array([1.0, ratio, 0.1, 0.5]), np.ones(1)))

    assert n_x % 2 == n_y % 2 == 0
    # Rounding to even numbers moves each by at most 1 of at least 12.
    assert n_x * n_y == pytest.approx(ELEMENTS_PER_SIDE**2, rel=0.1)
    assert n_x / n_y == pytest.approx(np.clip(ratio**0.25, 1 / 3, 3), rel=0.1)


@pytest.mark.parametrize(
    ("board_name", "support", "n_modes", "lowest", "highest"),
    [
        ("square", "supported", 6, 3.7, 4.3),
        ("fiemme", "clamped", 6, 3.7, 4.3),
        ("finnish", "cantilever", 1, 1.7, 2.5),
    ],
)
def test_observed_order_of_convergence(board_name, support, n_modes, lowest, highest):
    """Order four for smooth modes; about two where a clamped edge ends at a free one and the corner is singular."""
    board = replace(BOARDS[board_name], edges=SUPPORTS[support])
    sizes = np.array([6, 8, 12, 16])
    errors = np.array([hertz(board, n_modes, (n, n)) / reference(board_name, support)[:n_modes] - 1 for n in sizes])

    orders = -np.polyfit(np.log(sizes), np.log(errors), 1)[0]

    assert np.all(errors > 0), "a Ritz value must lie above"
    words = "order of convergence, smooth modes" if lowest > 3.0 else "order of convergence, singular corners"
    meets("V10", words, orders.min(), at_least=lowest, at_most=highest)
    meets("V10", words, orders.max(), at_least=lowest, at_most=highest)


def test_convergence_of_a_shear_flexible_plate_is_of_fourth_order():
    board = with_thickness(replace(THICK, edges=ritz.ALL_SUPPORTED), 0.02)
    exact = navier(board, G_ISOTROPIC, 4)

    coarse, fine = (solved(board, 4, G_ISOTROPIC, (n, n)).eigenvalues / exact - 1.0 for n in (6, 12))

    assert np.log2(coarse / fine).min() > 3.7


@pytest.mark.parametrize("name", FINITE_ELEMENTS)
def test_frequencies_at_the_papers_means_are_those_of_its_finite_elements(name):
    board, converged, printed = FINITE_ELEMENTS[name]

    frequencies = np.sqrt(solved(board, 6, G_SPRUCE).eigenvalues) / (2.0 * np.pi)

    assert np.abs(1200.0 * np.log2(frequencies / converged)).max() < 1.0
    # Printed to 1 Hz, from constants printed to three digits: 0.4 % in E_x is 0.2 % in a frequency.
    np.testing.assert_allclose(frequencies, printed, atol=0.5, rtol=0.002)


@pytest.mark.parametrize("board", [ritz.FREE_SPRUCE, ritz.FINNISH], ids=["free", "cantilever"])
def test_production_mesh_is_converged(board):
    """Six modes to 0.3 cent."""
    production, fine = (solved(board, 6, G_SPRUCE, shape).eigenvalues for shape in (None, (24, 24)))

    assert np.abs(cents(production, fine)).max() < 0.3


@pytest.mark.parametrize("support", ["hinged at one edge", "mixed"])
def test_limit_is_the_thin_plate(support):
    """At h / L_y = 1 / 2000 with stiff shear, six modes to 0.3 cent; both plates on meshes of their own."""
    board = replace(with_thickness(ritz.FREE_SPRUCE, ritz.FREE_SPRUCE.L_y / 2000), edges=SUPPORTS[support])

    stiff, thin = (solved(board, 6, shear_moduli).eigenvalues for shear_moduli in ((10e9, 10e9), None))

    assert np.abs(cents(stiff, thin)).max() < 0.3


def test_nothing_locks():
    """On eight elements a side the error stays within twice that of the thin plate, however thin the board is.

    Not just that of the thin plate, because elements graded towards free edges are the wider within; an element that
    locks would be hundreds of cents off at h / L = 1 / 20 000.
    """
    E = 10e9
    shear_moduli = (E / 2.6, E / 2.6)
    board = ritz.Plate.from_moduli(E, E, E / 2.6, 0.3, rho=450.0, h=0.02, L_x=1.0, L_y=1.0, edges=SUPPORTS["mixed"])
    coarse, fine = (solved(board, 3, shape=(n, n)).eigenvalues for n in (8, 24))
    allowed = cents(coarse, fine).max()

    errors = []
    for slenderness in (20, 1000, 20000):
        thinner = with_thickness(board, board.L_y / slenderness)
        coarse, fine = (solved(thinner, 3, shear_moduli, (n, n)).eigenvalues for n in (8, 16))
        errors.append(cents(coarse, fine).max())

    assert max(errors) < 2.0 * allowed
