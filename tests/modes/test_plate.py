"""The plate's matrices: energies by hand, the two-dimensional element as oracle, rigid motions of every support."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.linalg import eigh
from skfem import Basis, BilinearForm, ElementQuadBFS, MeshQuad

from bayesplate.modes.plate import Parity, Weights
from bayesplate.modes.thin import THIN_TERMS, thin_plate

ENDS = list(product(("clamped", "supported", "free"), repeat=2))
EDGES = [pytest.param(x, y, id="".join(end[0] for end in x + y)) for x, y in product(ENDS, ENDS)]
MESH = (5, 4)
SPRUCE = Weights(np.array([5.35, 0.75, 0.31, 1.0]), np.ones(1))

# Polynomials f(x) g(y) on the unit square, and by hand: int w_xx^2, int w_yy^2, 2 int w_xx w_yy, int w_xy^2, int w^2.
ENERGIES = {
    "x^2 + y^2": (4.0, 4.0, 8.0, 0.0, 28 / 45),
    "xy": (0.0, 0.0, 0.0, 1.0, 1 / 9),
    "x^2 y": (4 / 3, 0.0, 0.0, 4 / 3, 1 / 15),
    "x^2 y^2": (4 / 5, 4 / 5, 8 / 9, 16 / 9, 1 / 25),
    "x^3 y^2": (12 / 5, 4 / 7, 8 / 5, 12 / 5, 1 / 35),
}
PRODUCTS = {
    "x^2 + y^2": [(2, 0), (0, 2)],
    "xy": [(1, 1)],
    "x^2 y": [(2, 1)],
    "x^2 y^2": [(2, 2)],
    "x^3 y^2": [(3, 2)],
}


def spectrum(block, weights):
    """All eigenvalues of a class, by a dense solver."""
    return eigh(block.stiffness(weights).toarray(), block.mass(weights).toarray(), eigvals_only=True)


@pytest.mark.parametrize("polynomial", ENERGIES)
def test_energies_of_polynomials_by_hand(polynomial):
    """A free plate holds bicubics exactly, so its terms are their integrals; x^2 + y^2 fixes the factor of the mix."""
    plate = thin_plate(("free", "free"), ("free", "free"), 2, 3)

    def power(line, k):
        return line.interpolate(lambda x: x**k, lambda x: k * x ** max(k - 1, 0))

    grid = sum(np.outer(power(plate.line_x, p), power(plate.line_y, q)) for p, q in PRODUCTS[polynomial])
    energies = np.zeros(len(THIN_TERMS) + 1)
    for block in plate.blocks:
        vector = (block.spread_x.T @ grid @ block.spread_y).ravel()
        energies += [vector @ block.matrix(term) @ vector for term in (*block.terms, *block.masses)]

    np.testing.assert_allclose(energies, ENERGIES[polynomial], rtol=1e-11, atol=1e-12)


@pytest.fixture(scope="module")
def two_dimensional():
    """Stiffness and mass of the free plate by the Bogner-Fox-Schmit element on the same mesh, and its basis."""
    xx, yy, mix, xy = SPRUCE.stiffness
    nodes = [np.linspace(0.0, 1.0, n + 1) for n in MESH]
    basis = Basis(MeshQuad.init_tensor(*nodes).with_defaults(), ElementQuadBFS(), intorder=8)

    def energy(u, v, w):
        mixed = u.hess[0, 0] * v.hess[1, 1] + u.hess[1, 1] * v.hess[0, 0]
        along = xx * u.hess[0, 0] * v.hess[0, 0] + yy * u.hess[1, 1] * v.hess[1, 1]
        return along + mix * mixed + xy * u.hess[0, 1] * v.hess[0, 1]

    return BilinearForm(energy).assemble(basis), BilinearForm(lambda u, v, w: u * v).assemble(basis), basis


@pytest.mark.parametrize(("ends_x", "ends_y"), EDGES)
def test_classes_together_have_the_spectrum_of_the_two_dimensional_element(two_dimensional, ends_x, ends_y):
    """The element knows nothing of lines, products and symmetry: the classes must lose and add no mode."""
    stiffness, mass, basis = two_dimensional
    held = {"left": ends_x[0], "right": ends_x[1], "bottom": ends_y[0], "top": ends_y[1]}
    along = {"left": "u_y", "right": "u_y", "bottom": "u_x", "top": "u_x"}
    fixed = [np.array([], dtype=int)]
    for edge, end in held.items():
        nodal = basis.get_dofs(edge).nodal
        names = {"clamped": ["u", "u_x", "u_y", "u_xy"], "supported": ["u", along[edge]], "free": []}[end]
        fixed += [nodal[name] for name in names]
    kept = np.setdiff1d(np.arange(basis.N), np.concatenate(fixed))
    expected = eigh(stiffness[kept][:, kept].toarray(), mass[kept][:, kept].toarray(), eigvals_only=True)[:12]

    plate = thin_plate(ends_x, ends_y, *MESH)
    eigenvalues = np.sort(np.concatenate([spectrum(block, SPRUCE) for block in plate.blocks]))

    assert eigenvalues.size == kept.size
    # Rigid motions are zero to rounding: 1e-8 of the highest of the twelve.
    np.testing.assert_allclose(eigenvalues[:12], expected, rtol=1e-8, atol=1e-8 * expected[-1])


@pytest.mark.parametrize(("ends_x", "ends_y"), EDGES)
def test_zero_eigenvalues_are_counted_for_every_support(ends_x, ends_y):
    # Lowest elastic eigenvalues of these boards lie above 1; zeros come out below 1e-9.
    for block in thin_plate(ends_x, ends_y, *MESH).blocks:
        assert np.sum(spectrum(block, SPRUCE) < 1e-4) == block.n_rigid


@pytest.mark.parametrize(
    ("ends_x", "ends_y", "parities"),
    [
        (("free", "free"), ("clamped", "clamped"), [(0, 0), (0, 1), (1, 0), (1, 1)]),
        (("clamped", "free"), ("free", "free"), [(0, 0), (0, 1)]),
        (("free", "free"), ("clamped", "supported"), [(0, 0), (1, 0)]),
        (("clamped", "free"), ("supported", "free"), [(0, 0)]),
    ],
)
def test_classes_are_those_of_like_opposite_edges(ends_x, ends_y, parities):
    plate = thin_plate(ends_x, ends_y, 3, 4)

    assert [block.parity for block in plate.blocks] == parities
    for beams in product(range(3), range(3)):
        assert plate.block(plate.parity(beams)).parity in parities


def test_spread_keeps_the_parity_of_its_class():
    plate = thin_plate(("free", "free"), ("clamped", "clamped"), 4, 5)
    block = plate.block(Parity(0, 1))
    x, y = np.array([0.1, 0.4]), np.array([0.2, 0.3])
    grid = block.spread(np.random.default_rng(3).standard_normal((block.n_dof, 1)))[0]

    def deflection(x, y):
        return plate.line_x.shapes(x) @ grid @ plate.line_y.shapes(y).T

    np.testing.assert_allclose(deflection(1 - x, y), deflection(x, y), atol=1e-12)
    np.testing.assert_allclose(deflection(x, 1 - y), -deflection(x, y), atol=1e-12)
