"""The membrane of a curved plate: rigid motions, convergence, and what frozen in-plane fields cost."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from deflected import deflections, power

import bayesplate.plate.membrane as membrane
from bayesplate.plate.beams import beam_functions
from bayesplate.plate.line import line
from bayesplate.plate.membrane import CURVATURES, curvature_pairs, membrane_terms

FREE = ("free", "free")
SPRUCE = (12.07, 0.402, 1.006, 0.9)
ASPECT = 2.67


def polynomials(*orders):
    """Deflections x^i y^j on two sides, whose functions are those of free ones."""
    x, y = (line(FREE, n, is_split=False) for n in (12, 8))
    return deflections(x, y, [np.outer(power(x, i), power(y, j)) for i, j in orders])


def total(terms, curvatures, moduli=SPRUCE, names=CURVATURES):
    """The energies that curvatures make of the terms."""
    bent = dict(zip(CURVATURES, curvatures, strict=True))
    weights = np.concatenate([bent[a] * bent[b] * np.array(moduli) for a, b in curvature_pairs(names)])
    return np.tensordot(weights, terms, axes=1)


@pytest.mark.parametrize("curvatures", [(0.0, 1.0, 0.0), (0.6, -1.0, 0.3)])
def test_energies_are_symmetric_never_negative_and_none_of_rigid_motions(curvatures):
    """A shift and the two turns of a curved plate are motions of a body: in-plane fields of second order undo them."""
    w = polynomials((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2))
    energies = total(membrane_terms(w, ASPECT, SPRUCE), curvatures)
    # The strain that the in-plane fields undo is kappa w itself, of energy Q kappa^2 times int w^2: here of order one.
    assert np.abs(energies[:3, :3]).max() < 1e-6 * max(SPRUCE)
    assert energies == pytest.approx(energies.T, abs=1e-12 * np.abs(energies).max())
    assert np.linalg.eigvalsh(energies).min() > -1e-9 * np.abs(energies).max()


@pytest.mark.parametrize("curvatures", [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_other_moduli_cost_a_part_of_the_second_order(curvatures):
    """Fields of moduli a fifth off: the energy is above the exact one by at most the square of that, four per cent."""
    w = polynomials((1, 1), (2, 0), (0, 2))
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
    monkeypatch.setattr(membrane, "_MOST_ELEMENTS", 2 * membrane._MOST_ELEMENTS)
    for name in ("_matrices", "_stiffness_factors"):  # without what they hold of the coarse mesh, which stays in place
        monkeypatch.setattr(membrane, name, lru_cache(getattr(membrane, name).__wrapped__))
    fine = membrane_terms(w, ASPECT, SPRUCE)
    for curvatures in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)):
        apart = total(coarse, curvatures) - total(fine, curvatures)
        assert np.abs(apart).max() < 2e-3 * np.diagonal(total(fine, curvatures)).max()
