"""The plate: the two-dimensional element as oracle, rigid motions, and one pencil of each class."""

from __future__ import annotations

import numpy as np
import pytest
from dense_pencils import dense, spectrum, together, whole
from scipy.linalg import eigh
from skfem import Basis, BilinearForm, ElementQuadBFS, MeshQuad

from bayesplate.plate.fields import Fabric
from bayesplate.plate.line import N_POINTS_CUT, line
from bayesplate.plate.plate import plate_of
from bayesplate.plate.shear import SHEAR_FLEXIBLE
from bayesplate.plate.terms import EdgeTerm, Parity, PlateTerm, PointMotion, PointTerm, ProjectedTerms, Weights
from bayesplate.plate.thin import THIN, thin_plate

WORDS = {"c": "clamped", "s": "supported", "f": "free"}
EDGES = ("cccc", "ffff", "cfff", "sfff", "ssff", "sfsf", "fcsc", "csfs", "scsf", "fscf")
"""At x0, x1, y0 and y1: every pair of ends along x, every one along y, and every number of rigid motions."""
FREE = ("free", "free")
MESH = (6, 4)
SPRUCE = Weights(np.array([5.35, 0.75, 0.31, 1.0]), np.ones(1))


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


@pytest.mark.parametrize("edges", EDGES)
def test_classes_together_have_the_spectrum_of_the_two_dimensional_element(two_dimensional, edges):
    """The element knows nothing of lines, products and symmetry: the classes must lose and add no mode."""
    ends_x, ends_y = ([WORDS[one] for one in edges[at : at + 2]] for at in (0, 2))
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

    plate = thin_plate(tuple(ends_x), tuple(ends_y), *MESH)
    found = [spectrum(own, SPRUCE) for own in plate.classes]
    eigenvalues = np.sort(np.concatenate(found))

    assert eigenvalues.size == kept.size
    # Rigid motions are zero to rounding: 1e-8 of the highest of the twelve.
    np.testing.assert_allclose(eigenvalues[:12], expected, rtol=1e-8, atol=1e-8 * expected[-1])
    # Lowest elastic eigenvalues of these boards lie above 1; zeros come out below 1e-9.
    assert [np.sum(one < 1e-4) for one in found] == [own.n_rigid for own in plate.classes]


@pytest.mark.parametrize("parity", [Parity(0, 1), Parity(1, 0)])
def test_deflections_have_the_parity_of_their_class(parity):
    """On a lattice, and at places across that differ along the plate."""
    own = thin_plate(FREE, ("clamped", "clamped"), 4, 6).symmetry_class(parity)
    deflections = own.deflections(np.random.default_rng(3).standard_normal((own.n_dof, 2)))
    x, y = np.array([0.1, 0.4]), np.array([0.2, 0.3, 0.45])
    here, mirrored = deflections.on(x, y), deflections.on(x, 1 - y)

    np.testing.assert_allclose(deflections.on(1 - x, y), (-1.0) ** parity.x * here, atol=1e-12)
    np.testing.assert_allclose(mirrored, (-1.0) ** parity.y * here, atol=1e-12)
    across = deflections.across(x, np.stack([y, 1 - y]))
    np.testing.assert_allclose(across, np.stack([here[:, 0], mirrored[:, 1]], axis=1), atol=1e-12)


@pytest.mark.parametrize("parity", [Parity(0, 0), Parity(1, 0)])
@pytest.mark.parametrize("outline", [None, lambda x: (0.1 + 0.0 * x, 0.9 + 0.0 * x)], ids=["rectangle", "outline"])
def test_integrals_of_deflections_are_sums_over_the_plate(parity, outline):
    x, y = (line(ends, 4, n_points=N_POINTS_CUT) for ends in (("clamped", "clamped"), FREE))
    own = plate_of(THIN, x, y).symmetry_class(parity)
    deflections = own.deflections(np.random.default_rng(4).standard_normal((own.n_dof, 3)))
    low, high = (0.0, 1.0) if outline is None else (0.1, 0.9)
    at, weights = np.polynomial.legendre.leggauss(4)
    cuts = np.unique(np.clip(np.linspace(0.0, 1.0, 5), low, high))

    def points(nodes):
        lengths = np.diff(nodes)[:, None]
        return (nodes[:-1, None] + lengths * (at + 1.0) / 2.0).ravel(), (lengths * weights / 2.0).ravel()

    (at_x, along_x), (at_y, along_y) = points(np.linspace(0.0, 1.0, 5)), points(cuts)
    expected = along_x @ deflections.on(at_x, at_y) @ along_y

    np.testing.assert_allclose(deflections.integrals(outline), expected, atol=1e-12)


def mean_square(deflections):
    """A mass term of the mean deflection, as of a support that moves with the board."""
    means = deflections.integrals(None)
    return np.outer(means, means)


def bump(x, y):
    return np.exp(x * y) + 0.3 * np.sin(3.0 * x + y)


PLACE, BESIDE = PointMotion(((1.0, 0.3, 0.8), (-2.0, 0.9, 0.1))), PointMotion(((-1.0, 0.2, 0.2),), coordinate=1)
FURTHER = (
    PlateTerm(("slope_x", "slope_x")),
    EdgeTerm(0, (True, True), "w"),
    EdgeTerm(1, (True, True), "turn_y"),
    PointTerm(((1.0, BESIDE, BESIDE), (0.5, PLACE, PointMotion(coordinate=0)))),
)
HEAVY = (
    PointTerm(
        ((0.3, PLACE, PLACE), (1.0, PointMotion(coordinate=0), PointMotion(coordinate=0)), (1.0, BESIDE, BESIDE))
    ),
)


def varied(kinematics, is_split):
    """A plate with two fields of each group and every kind of further term."""
    is_sheared = kinematics is SHEAR_FLEXIBLE
    x, y = (line(ends, 4, is_sheared, is_split) for ends in (("clamped", "clamped"), FREE))
    fields = {group: [None, bump] for group in ("along", "bending", "shear", "mass", "rotary")}
    return plate_of(kinematics, x, y, Fabric(fields, is_turned=True)).with_terms(FURTHER, HEAVY)


def some_weights(plate, seed=2):
    rng = np.random.default_rng(seed)
    return Weights(*(rng.uniform(0.5, 2.0, len(terms)) for terms in (plate.stiffness, plate.masses)))


@pytest.mark.parametrize("is_split", [True, False])
@pytest.mark.parametrize("kinematics", [THIN, SHEAR_FLEXIBLE], ids=["thin", "shear-flexible"])
def test_the_pencil_of_a_class_is_its_terms_on_every_unknown(kinematics, is_split):
    """Assembled of elements, and from the strains of unit vectors: all fields, edges, places and ties are in both."""
    plate = varied(kinematics, is_split)
    weights = some_weights(plate)
    assert len(plate.classes) == (4 if is_split else 1)
    assert plate.n_coordinates == 2
    for own in plate.classes:
        for found, expected in zip(dense(own, weights), whole(own, weights), strict=True):
            np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_energies_and_pencils_on_given_deflections_are_those_of_the_terms():
    """Terms that exist on deflections only among them: energies are the diagonals, a pencil the sum for each draw."""
    mean = [ProjectedTerms(mean_square)]
    plate = varied(SHEAR_FLEXIBLE, is_split=True).with_terms(mean, mean)
    own = plate.classes[0]
    draws = [some_weights(plate, seed) for seed in range(3)]
    vectors = np.random.default_rng(7).standard_normal((own.n_dof, 4))

    spanned = own.on_span([own.pencil(plate.elements(one)) for one in draws], together(draws), vectors)
    energies = own.energies(vectors)

    for side, terms in enumerate((own.project_stiffness(vectors), own.project_masses(vectors))):
        diagonals = np.diagonal(terms, axis1=1, axis2=2)
        np.testing.assert_allclose(energies[side], diagonals.T, rtol=1e-9, atol=1e-12 * np.abs(diagonals).max())
        expected = np.stack([vectors.T @ whole(own, one)[side] @ vectors for one in draws])
        np.testing.assert_allclose(spanned[side], expected, atol=1e-11 * np.abs(expected).max())


def test_what_the_masses_give_to_coordinates_beside_the_plate():
    plate = varied(THIN, is_split=False)
    (own,) = plate.classes
    vectors = np.zeros((own.n_dof, 2))
    vectors[own.n_on_plate :] = [[1.0, 2.0], [3.0, 4.0]]

    found = own.project_coordinates(vectors)

    np.testing.assert_array_equal(found[:-1], 0.0)
    np.testing.assert_allclose(found[-1], [[1.0 + 9.0, 2.0 + 12.0], [14.0, 4.0 + 16.0]])
