"""The shear-flexible plate: energies by hand, rigid motions, and its thin limit."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import ritz
from deflected import power
from dense_pencils import dense
from either_theory import SUPPORTS, assembled, cents, solved, weights_of, with_thickness
from scipy.linalg import eigh

from bayesplate.plate.line import line
from bayesplate.plate.plate import plate_of
from bayesplate.plate.shear import SHEAR_FLEXIBLE, SHEAR_MASSES, SHEAR_TERMS
from bayesplate.plate.solve import solve

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


def fields(x, y, *powers):
    """Unknowns of w, g_x and g_y, each x^i y^j or, for None, nothing."""
    nothing = np.zeros(x.n_functions * y.n_functions)
    return np.concatenate([nothing if p is None else np.kron(power(x, p[0]), power(y, p[1])) for p in powers])


def test_energies_of_polynomials_are_those_found_by_hand():
    """Of a plate without held edges and without classes: its unknowns are those of the two lines."""
    x, y = (line(("free", "free"), n, is_sheared=True, is_split=False) for n in (6, 5))
    (own,) = plate_of(SHEAR_FLEXIBLE, x, y).classes

    found = own.energies(fields(x, y, (2, 2), (1, 2), (1, 1))[:, None])

    energies = dict(zip(SHEAR_TERMS + SHEAR_MASSES, np.hstack(found)[0], strict=True))
    assert energies == pytest.approx(ENERGIES, rel=1e-12)


@pytest.mark.parametrize(("support", "n_rigid", "slenderness"), [("free", 3, 2000), ("hinged at one edge", 1, 20)])
def test_rigid_motions_are_left_out_and_nothing_else(support, n_rigid, slenderness):
    """Counted in the dense spectrum; the solver's lowest mode is the first one above them."""
    board = replace(with_thickness(ritz.FREE_SPRUCE, ritz.FREE_SPRUCE.L_y / slenderness), edges=SUPPORTS[support])
    shear_moduli = (10e9, 0.01e9)
    weights, plate = weights_of(board, shear_moduli), assembled(board, shear_moduli, (8, 8))
    found = solve(plate, weights, 5)
    shift = 1e-2 * found.eigenvalues[0]

    # Inverted, so that the stiff end of the spectrum costs the soft end no digits.
    pencils = [dense(own, weights) for own in plate.classes]
    inverse = np.concatenate([eigh(m, k + shift * m, eigvals_only=True) for k, m in pencils])
    expected = np.sort(1.0 / inverse[inverse > 1e-9 / shift] - shift)

    assert sum(own.n_rigid for own in plate.classes) == n_rigid
    assert np.abs(expected[:n_rigid]).max(initial=0.0) < 1e-5 * found.eigenvalues[0]
    np.testing.assert_allclose(found.eigenvalues, expected[n_rigid:][:5], rtol=1e-6)


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


def test_softer_shear_lowers_every_frequency():
    """From G_yz = 10 GPa to 10 MPa; the mode with most twist loses most."""
    found = [solved(ritz.FINNISH, 6, (0.62e9, G_yz)).eigenvalues for G_yz in (10e9, 1e9, 100e6, 10e6)]

    assert all(np.all(cents(softer, stiffer) < 0.0) for stiffer, softer in pairwise(found))
    assert cents(found[-1], found[0])[5] == pytest.approx(-80.5, abs=0.5)
