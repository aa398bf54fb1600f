"""The membrane of a curved plate: closed forms, symmetry, convergence, and what frozen in-plane fields cost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deflected import deflections, power

import bayesplate.plate.membrane as membrane
from bayesplate.plate.beams import beam_functions
from bayesplate.plate.line import line
from bayesplate.plate.membrane import CURVATURES, curvature_pairs, membrane_terms

FREE, CLAMPED = ("free", "free"), ("clamped", "clamped")
SPRUCE = (12.07, 0.402, 1.006, 0.9)
ASPECT = 2.67


def sides(ends_x=FREE, ends_y=FREE, n_x=12, n_y=8):
    return line(ends_x, n_x, is_split=False), line(ends_y, n_y, is_split=False)


def polynomials(x, y):
    """Deflections 1, x, y, x y, x^2, y^2 on two sides, whose functions are those of free ones."""

    orders = [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2)]
    return deflections(x, y, [np.outer(power(x, i), power(y, j)) for i, j in orders])


def total(terms, curvatures, moduli=SPRUCE, names=CURVATURES):
    """The energies that curvatures make of the terms."""
    bent = dict(zip(CURVATURES, curvatures, strict=True))
    weights = np.concatenate([bent[a] * bent[b] * np.array(moduli) for a, b in curvature_pairs(names)])
    return np.tensordot(weights, terms, axes=1)


@pytest.fixture(scope="module")
def free_terms():
    return membrane_terms(polynomials(*sides()), ASPECT, SPRUCE)


@pytest.mark.parametrize("curvatures", [(0.0, 1.0, 0.0), (0.6, -1.0, 0.3)])
def test_rigid_motions_of_a_free_plate_strain_nothing(free_terms, curvatures):
    """A shift and the two turns of a curved plate are motions of a body: in-plane fields of second order undo them."""
    energies = total(free_terms, curvatures)
    # The strain that the in-plane fields undo is kappa w itself, of energy Q kappa^2 times int w^2: here of order one.
    assert np.abs(energies[:3, :3]).max() < 1e-6 * max(SPRUCE)


def test_bent_along_its_curvature_a_plate_stays_a_cylinder(free_terms):
    """What is left of x^2 is what strains that are linear on each element miss: its length to the fourth over 180."""
    along, cupped = total(free_terms, (1.0, 0.0, 0.0)), total(free_terms, (0.0, 1.0, 0.0))
    missed = SPRUCE[0] * (1.0 / membrane._ELEMENTS) ** 4 / 180.0
    assert along[4, 4] == pytest.approx(missed, rel=0.05)
    assert cupped[4, 4] > 100.0 * missed


def test_a_clamped_strip_that_is_shifted_stretches_as_a_whole():
    """Held on all sides, a uniform deflection w = 1 inside cannot be undone: kappa' Q kappa is the upper bound."""
    free, held = (
        total(membrane_terms(polynomials(*sides(ends, ends)), ASPECT, SPRUCE), (0.0, 1.0, 0.0))[0, 0]
        for ends in (FREE, CLAMPED)
    )
    assert free < 1e-6
    assert held == pytest.approx(SPRUCE[2], rel=1e-6)  # a uniform stress is in balance, so that no field relieves it


@pytest.mark.parametrize("curvatures", [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_other_moduli_cost_a_part_of_the_second_order(curvatures):
    """Fields of moduli a fifth off: the energy is above the exact one by at most the square of that, four per cent."""
    w = polynomials(*sides())
    w = replace(w, coefficients=w.coefficients[3:])
    for k in range(4):
        others = tuple(one * (1.2 if i == k else 1.0) for i, one in enumerate(SPRUCE))
        exact = total(membrane_terms(w, ASPECT, others), curvatures, others)
        frozen = total(membrane_terms(w, ASPECT, SPRUCE), curvatures, others)
        above = np.linalg.eigvalsh(frozen - exact)
        scale = np.abs(np.linalg.eigvalsh(exact)).max()
        assert above.min() > -1e-9 * scale
        assert above.max() < 0.04 * scale


def test_converged_in_its_elements(monkeypatch):
    """Twice as many elements change energies of bending shapes by less than two parts in a thousand."""
    beams = beam_functions(FREE)
    shapes = [
        np.outer(*(beams.coefficients[:, k] for k in orders)) for orders in ((2, 0), (0, 2), (2, 1), (3, 2), (4, 1))
    ]
    w = deflections(beams.side, beams.side, shapes)
    coarse = membrane_terms(w, ASPECT, SPRUCE)
    monkeypatch.setattr(membrane, "_ELEMENTS", 2 * membrane._ELEMENTS)
    membrane._matrices.cache_clear()
    membrane._factors.cache_clear()
    fine = membrane_terms(w, ASPECT, SPRUCE)
    membrane._matrices.cache_clear()
    membrane._factors.cache_clear()
    for curvatures in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)):
        apart = total(coarse, curvatures) - total(fine, curvatures)
        assert np.abs(apart).max() < 2e-3 * np.diagonal(total(fine, curvatures)).max()
