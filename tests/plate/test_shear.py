"""The shear-flexible plate: energies by hand, Navier's exact plate, the paper's finite elements, and its thin limit."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import ritz
from bars import meets
from deflected import power
from dense_pencils import dense
from scipy.linalg import eigh

from bayesplate.plate.line import line
from bayesplate.plate.mesh import mesh
from bayesplate.plate.naming import find
from bayesplate.plate.plate import plate_of
from bayesplate.plate.shear import (
    SHEAR_ELEMENTS_PER_SIDE,
    SHEAR_FLEXIBLE,
    SHEAR_MASSES,
    SHEAR_TERMS,
    shear_flexible_plate,
)
from bayesplate.plate.solve import solve
from bayesplate.plate.terms import Weights
from bayesplate.plate.thin import thin_plate

SUPPORTS = {
    "supported": ritz.ALL_SUPPORTED,
    "free": ritz.ALL_FREE,
    "hinged at one edge": {"x0": "supported", "x1": "free", "y0": "free", "y1": "free"},
    "mixed": {"x0": "supported", "x1": "clamped", "y0": "clamped", "y1": "free"},
}
ISOTROPIC = ritz.Plate.from_moduli(
    10e9, 10e9, 10e9 / 2.6, 0.3, rho=450.0, h=0.02, L_x=1.0, L_y=1.0, edges=ritz.ALL_CLAMPED
)
G_ISOTROPIC = (10e9 / 2.6, 10e9 / 2.6)
G_SPRUCE = (0.62e9, 0.023e9)

# Two independent elements at the paper's mean constants, converged, and what the paper prints.
FINITE_ELEMENTS = {
    "cantilever": (ritz.FINNISH, [51.24, 99.87, 315.08, 335.59, 394.40, 629.69], [51, 100, 315, 336, 394, 629]),
    "clamped": (ritz.FIEMME, [56.20, 97.91, 130.35, 161.47, 168.88, 221.53], [56, 98, 130, 161, 169, 221]),
}


def weights_of(board, G_xz, G_yz):
    """S_x / (m L_x / L_y) and so on, written out: kappa G / (rho L^2), and the rotary inertia of a layer of h."""
    shear = [5 / 6 * G / (board.rho * L**2) for G, L in ((G_xz, board.L_x), (G_yz, board.L_y))]
    rotary = [board.h**2 / (12 * L**2) for L in (board.L_x, board.L_y)]
    return Weights(np.array([*board.unit_weights, *shear]), np.array([1.0, *rotary]))


def thin_part(weights):
    return Weights(weights.stiffness[:4], weights.mass[:1])


def solved(board, shear_moduli, n_modes, shape=None):
    weights = weights_of(board, *shear_moduli)
    return solve(
        shear_flexible_plate(*board.ends, *(shape or mesh(weights, SHEAR_ELEMENTS_PER_SIDE))), weights, n_modes
    )


def rounding(board, weights):
    """What rounding may leave of an eigenvalue at worst: the last digit of the stiffest unknown's own."""
    plate = shear_flexible_plate(*board.ends, *mesh(weights, SHEAR_ELEMENTS_PER_SIDE))
    pencils = (own.pencil(plate.elements(weights)) for own in plate.classes)
    return np.finfo(float).eps * max((k.diagonal() / m.diagonal()).max() for k, m in pencils)


def cents(first, second):
    """Between the frequencies of two lists of eigenvalues."""
    return 600.0 * np.log2(np.asarray(first) / np.asarray(second))


def with_thickness(board, thickness):
    """The same material at another thickness; rigidities go with its cube."""
    cube = (thickness / board.h) ** 3
    return replace(board, h=thickness, D_x=board.D_x * cube, D_y=board.D_y * cube, D_s=board.D_s * cube)


def navier(board, G_xz, G_yz, n_modes):
    """omega^2 of the hard-supported plate: deflection and the two turnings as sines and cosines, exact."""
    S_x, S_y = 5 / 6 * board.h * G_xz, 5 / 6 * board.h * G_yz
    twist, mixed = board.D_s / 4, board.nu_xy * board.D_y + board.D_s / 4
    mass = board.rho * board.h * np.diag([1.0, board.h**2 / 12, board.h**2 / 12])
    lowest = []
    for m in range(1, 9):
        for n in range(1, 9):
            a, b = m * np.pi / board.L_x, n * np.pi / board.L_y
            stiffness = [
                [S_x * a**2 + S_y * b**2, -S_x * a, -S_y * b],
                [-S_x * a, board.D_x * a**2 + twist * b**2 + S_x, mixed * a * b],
                [-S_y * b, mixed * a * b, board.D_y * b**2 + twist * a**2 + S_y],
            ]
            lowest.append(eigh(stiffness, mass, eigvals_only=True)[0])
    return np.sort(lowest)[:n_modes]


# Integrals over the unit square by hand, for w = x^2 y^2, g_x = x y^2, g_y = x y.
ENERGIES = {
    "xx": 1 / 5,  # (2 y^2 - y^2)^2
    "yy": 2 / 15,  # (2 x^2 - x)^2
    "mix": 1 / 9,  # 2 (2 y^2 - y^2) (2 x^2 - x)
    "xy": 7 / 12,  # (4 x y - x y - y / 2)^2
    "shear_x": 1 / 15,
    "shear_y": 1 / 9,
    "board": 1 / 25,
    "rotary_x": 1 / 15,  # (2 x y^2 - x y^2)^2
    "rotary_y": 2 / 45,  # (2 x^2 y - x y)^2
}


def unsplit(n_x=6, n_y=5):
    """A plate without held edges and without classes: the unknowns of w, g_x and g_y are those of the two lines."""
    x, y = (line(("free", "free"), n, is_sheared=True, is_split=False) for n in (n_x, n_y))
    (own,) = plate_of(SHEAR_FLEXIBLE, x, y).classes
    return x, y, own


def fields(x, y, *powers):
    """Unknowns of w, g_x and g_y, each x^i y^j or, for None, nothing."""
    nothing = np.zeros(x.n_functions * y.n_functions)
    return np.concatenate([nothing if p is None else np.kron(power(x, p[0]), power(y, p[1])) for p in powers])


def test_energies_of_polynomials_are_those_found_by_hand():
    x, y, own = unsplit()

    found = own.energies(fields(x, y, (2, 2), (1, 2), (1, 1))[:, None])

    energies = dict(zip(SHEAR_TERMS + SHEAR_MASSES, np.hstack(found)[0], strict=True))
    assert energies == pytest.approx(ENERGIES, rel=1e-12)


def test_rigid_motions_strain_nothing():
    """A shift and two turns: no force on any unknown from any term, beside the largest entry of its matrix."""
    x, y, own = unsplit()
    motions = np.stack([fields(x, y, powers, None, None) for powers in ((0, 0), (1, 0), (0, 1))], axis=1)

    terms = own.project_stiffness(np.eye(own.n_dof))

    assert max(np.abs(term @ motions).max() / np.abs(term).max() for term in terms) < 1e-12


@pytest.mark.parametrize(("support", "n_rigid", "slenderness"), [("free", 3, 2000), ("hinged at one edge", 1, 20)])
def test_rigid_motions_are_left_out_and_nothing_else(support, n_rigid, slenderness):
    """Counted in the dense spectrum; the solver's lowest mode is the first one above them."""
    board = replace(with_thickness(ritz.FREE_SPRUCE, ritz.FREE_SPRUCE.L_y / slenderness), edges=SUPPORTS[support])
    weights = weights_of(board, 10e9, 0.01e9)
    plate = shear_flexible_plate(*board.ends, 8, 8)
    found = solve(plate, weights, 5)
    shift = 1e-2 * found.eigenvalues[0]

    # Inverted, so that the stiff end of the spectrum costs the soft end no digits.
    pencils = [dense(own, weights) for own in plate.classes]
    inverse = np.concatenate([eigh(m, k + shift * m, eigvals_only=True) for k, m in pencils])
    expected = np.sort(1.0 / inverse[inverse > 1e-9 / shift] - shift)

    assert sum(own.n_rigid for own in plate.classes) == n_rigid
    assert np.abs(expected[:n_rigid]).max(initial=0.0) < 1e-5 * found.eigenvalues[0]
    np.testing.assert_allclose(found.eigenvalues, expected[n_rigid:][:5], rtol=1e-6)


@pytest.mark.parametrize(
    ("board", "shear_moduli", "slenderness"),
    [(ISOTROPIC, G_ISOTROPIC, 2000), (ritz.FREE_SPRUCE, G_SPRUCE, 10)],
    ids=["isotropic", "spruce"],
)
def test_supported_plate_has_the_exact_spectrum(board, shear_moduli, slenderness):
    board = replace(with_thickness(board, board.L_y / slenderness), edges=ritz.ALL_SUPPORTED)

    found = solved(board, shear_moduli, 6, (20, 18))

    worst = np.abs(cents(found.eigenvalues, navier(board, *shear_moduli, 6))).max()
    meets("V10", "closed form with transverse shear, 6 modes", worst, at_most=0.1, unit="cents")


def test_the_exact_plate_is_not_the_thin_one():
    """The closed form above would not notice a plate without shear if the plate were thin: these are 50 cents apart."""
    board = replace(with_thickness(ISOTROPIC, 0.1), edges=ritz.ALL_SUPPORTED)
    thin = solve(thin_plate(*board.ends, 16, 16), thin_part(weights_of(board, *G_ISOTROPIC)), 6)

    assert cents(navier(board, *G_ISOTROPIC, 6), thin.eigenvalues).max() < -50.0


@pytest.mark.parametrize("name", FINITE_ELEMENTS)
def test_frequencies_at_the_papers_means_are_those_of_its_finite_elements(name):
    board, converged, printed = FINITE_ELEMENTS[name]

    frequencies = np.sqrt(solved(board, G_SPRUCE, 6).eigenvalues) / (2.0 * np.pi)

    assert np.abs(1200.0 * np.log2(frequencies / converged)).max() < 1.0
    # Printed to 1 Hz, from constants printed to three digits: 0.4 % in E_x is 0.2 % in a frequency.
    np.testing.assert_allclose(frequencies, printed, atol=0.5, rtol=0.002)


@pytest.mark.parametrize("board", [ritz.FREE_SPRUCE, ritz.FINNISH], ids=["free", "cantilever"])
def test_production_mesh_is_converged(board):
    """Six modes to 0.3 cent."""

    production, fine = (solved(board, G_SPRUCE, 6, shape).eigenvalues for shape in (None, (24, 24)))

    assert np.abs(cents(production, fine)).max() < 0.3


@pytest.mark.parametrize("support", ["hinged at one edge", "mixed"])
def test_limit_is_the_thin_plate(support):
    """At h / L_y = 1 / 2000 with stiff shear, six modes to 0.3 cent; both plates on meshes of their own."""
    board = replace(with_thickness(ritz.FREE_SPRUCE, ritz.FREE_SPRUCE.L_y / 2000), edges=SUPPORTS[support])
    weights = weights_of(board, 10e9, 10e9)

    thin = solve(thin_plate(*board.ends, *mesh(weights)), thin_part(weights), 6)

    assert np.abs(cents(solved(board, (10e9, 10e9), 6).eigenvalues, thin.eigenvalues)).max() < 0.3


def test_nothing_locks():
    """On eight elements a side the error stays within twice that of the thin plate, however thin the board is.

    Not just that of the thin plate, because elements graded towards free edges are the wider within; an element that
    locks would be hundreds of cents off at h / L = 1 / 20 000.
    """
    board = replace(ISOTROPIC, edges=SUPPORTS["mixed"])
    weights = thin_part(weights_of(board, *G_ISOTROPIC))
    coarse, fine = (solve(thin_plate(*board.ends, n, n), weights, 3).eigenvalues for n in (8, 24))
    allowed = cents(coarse, fine).max()

    errors = []
    for slenderness in (20, 1000, 20000):
        thinner = with_thickness(board, board.L_y / slenderness)
        coarse, fine = (solved(thinner, G_ISOTROPIC, 3, (n, n)).eigenvalues for n in (8, 16))
        errors.append(cents(coarse, fine).max())

    assert max(errors) < 2.0 * allowed


def test_softer_shear_lowers_every_frequency():
    """From G_yz = 10 GPa to 10 MPa; the mode with most twist loses most, and the energies sum up all the way."""
    board = ritz.FINNISH
    moduli = [10e9, 1e9, 100e6, 23e6, 10e6]
    found = [solved(board, (0.62e9, G_yz), 6) for G_yz in moduli]

    assert all(np.all(cents(softer.eigenvalues, stiffer.eigenvalues) < 0.0) for stiffer, softer in pairwise(found))
    assert cents(found[-1].eigenvalues, found[0].eigenvalues)[5] == pytest.approx(-80.5, abs=0.5)
    for G_yz, modes in zip(moduli, found, strict=True):
        weights = weights_of(board, 0.62e9, G_yz)
        summed = modes.coefficients @ weights.stiffness / modes.eigenvalues
        assert np.all(np.abs(summed - 1.0) < 0.05 * rounding(board, weights) / modes.eigenvalues)
        np.testing.assert_allclose(modes.mass_coefficients @ weights.mass, 1.0, rtol=1e-12)


def test_energies_are_the_derivatives_of_the_eigenvalues():
    """Hellmann-Feynman: a share of energy is what the eigenvalue gains from its term, shear and inertia included."""
    weights = weights_of(ritz.FINNISH, *G_SPRUCE)
    plate = shear_flexible_plate(*ritz.FINNISH.ends, 12, 12)
    modes = solve(plate, weights, 4)
    step = 1e-3

    def slopes(own, rebuild):
        for i in range(own.size):
            up, down = (solve(plate, rebuild(own * (1.0 + s * (np.arange(own.size) == i))), 4) for s in (step, -step))
            yield (up.eigenvalues - down.eigenvalues) / (2.0 * step * modes.eigenvalues)

    stiffness = np.stack(list(slopes(weights.stiffness, lambda w: Weights(w, weights.mass))), axis=1)
    mass = np.stack(list(slopes(weights.mass, lambda w: Weights(weights.stiffness, w))), axis=1)

    shares = modes.coefficients * weights.stiffness / modes.eigenvalues[:, None]
    np.testing.assert_allclose(stiffness, shares, atol=1e-5)
    np.testing.assert_allclose(mass, -modes.mass_coefficients * weights.mass, atol=1e-5)


def test_convergence_is_of_fourth_order():
    board = replace(ISOTROPIC, edges=SUPPORTS["supported"])
    exact = navier(board, *G_ISOTROPIC, 4)

    coarse, fine = (solved(board, G_ISOTROPIC, 4, (n, n)).eigenvalues / exact - 1.0 for n in (6, 12))

    assert np.log2(coarse / fine).min() > 3.7


def test_exchanging_x_and_y_changes_nothing():
    board = replace(ritz.FINNISH, edges=SUPPORTS["mixed"])
    exchange = [1, 0, 2, 3, 5, 4]

    one = solved(board, G_SPRUCE, 6, (12, 10))
    other = solved(board.swapped, G_SPRUCE[::-1], 6, (10, 12))

    np.testing.assert_allclose(other.eigenvalues, one.eigenvalues, rtol=1e-7)
    np.testing.assert_allclose(other.coefficients[:, exchange], one.coefficients, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(other.mass_coefficients[:, [0, 2, 1]], one.mass_coefficients, rtol=1e-5)


def test_modes_keep_the_names_of_the_thin_plate():
    board = ritz.FINNISH
    weights = weights_of(board, *G_SPRUCE)
    beams = [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2)]

    sheared = find(shear_flexible_plate(*board.ends, 14, 14), weights, beams)
    thin = find(thin_plate(*board.ends, 14, 14), thin_part(weights), beams)

    places = [{b: (f.place.parity, f.place.rank) for b, f in found.items()} for found in (sheared, thin)]
    assert places[0] == places[1]
    assert all(mode.place.is_certain for mode in sheared.values())
