"""The membrane of a plate that is not flat: a curved plate stretches where it bends.

A stress-free shape of curvatures kappa = (k_x, k_y, 2 k_xy) couples the deflection w to two in-plane fields u:

    strain = L u - kappa w,    energy = h / 2 int strain' Q strain,    Q = (Q_11, Q_12, Q_22, Q_66) of plane stress

The fields follow any deflection without inertia, so that they are eliminated: for each of the three curvatures they are
solved once for given deflections. The energy is then quadratic in the curvatures, and linear in the four moduli as long
as the fields stay those of the moduli they were solved at: it is stationary there, so that moduli a fifth away change a
shift of 100 cents by less than one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import Any, Literal

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.setup import EdgeConditions
from bayesplate.plate.fields import Field, Outline
from bayesplate.plate.terms import Deflections

Curvature = Literal["bow", "cup", "twist"]

CURVATURES: tuple[Curvature, ...] = ("bow", "cup", "twist")
"""Curvatures of the strain along x, along y, and of the shear strain, in which a twist counts twice."""
MODULI = ("Q_11", "Q_12", "Q_22", "Q_66")

_Membrane = tuple[EdgeConditions, EdgeConditions, float, Field | None, Outline | None]
"""End conditions of a membrane along x and along y, its aspect ratio, the field of its stiffness, and its outline."""

_MOST_ELEMENTS = 24
"""Elements of second order along the longer side: energies of shapes of four waves are within two in a thousand."""
_FEWEST_ELEMENTS = 16
_GROUND_SHARE = 1e-9
"""Share of the stiffness that keeps a free membrane from drifting; no strain loads such a motion."""
_STRAIN_COUNTS = np.array([1.0, 1.0, 2.0])


@dataclass(frozen=True, eq=False)
class _Matrices:
    """Sparse matrices of a membrane of unit area."""

    stiffness: tuple[Any, ...]  # (n, n), by the moduli
    # (n, n_w): loads of a stress along x, along y, and in shear, proportional to the deflection at the nodes
    loads: tuple[Any, ...]
    mass: Any  # (n_w, n_w): integral of the product of two deflections
    places: Floats  # (2, n_w): of the deflections, as fractions of the sides
    held_unknowns: Indices  # (n_held,): unknowns that edges hold


def membrane_terms(
    deflections: Deflections,
    aspect_ratio: float,
    moduli: tuple[float, ...],
    curvatures: tuple[Curvature, ...] = CURVATURES,
    thickness: Field | None = None,
    outline: Outline | None = None,
) -> Floats:
    """Membrane energies, (n_pairs * 4, n_vectors, n_vectors), by `curvature_pairs` and by the moduli.

    For a plate of unit area: the stiffness per unit of the product of two curvatures (each pair once, a cross term both
    ways) and of the modulus. The in-plane fields are solved at the `moduli` Q_11, Q_12, Q_22, Q_66, of which only the
    ratios matter; the stiffness of the membrane goes with the `thickness` over the plate. Within an `outline` the
    rectangle of unit area is that of the widest width, and so is the aspect ratio.
    """
    membrane = deflections.x.ends, deflections.y.ends, aspect_ratio, thickness, outline
    matrices = _matrices(*membrane)
    at_nodes = _deflections_at(deflections, matrices.places)
    loads = [load @ at_nodes for load in matrices.loads]
    squares = at_nodes.T @ (matrices.mass @ at_nodes)
    fields = {name: _in_plane_fields(membrane, moduli, CURVATURES.index(name), loads) for name in curvatures}
    energies = []
    for first, second in curvature_pairs(curvatures):
        pair = ((CURVATURES.index(name), fields[name]) for name in (first, second))
        terms = _energies(matrices, loads, squares, *pair)
        energies.append((0.5 if first == second else 1.0) * (terms + np.swapaxes(terms, -1, -2)))
    return np.concatenate(energies)


def curvature_pairs(curvatures: Sequence[Curvature]) -> tuple[tuple[Curvature, Curvature], ...]:
    """The pairs of curvatures whose products count, in the order of `membrane_terms`."""
    return tuple(combinations_with_replacement(curvatures, 2))


def _deflections_at(deflections: Deflections, places: Floats) -> Floats:
    """Deflections at places that lie on lines across the plate, equally many on each: (n_places, n_vectors) array."""
    x, y = np.round(places, 9)
    order = np.lexsort((y, x))
    lines = np.unique(x)
    at_nodes = np.empty((x.size, len(deflections.coefficients)))
    at_nodes[order] = deflections.across(lines, y[order].reshape(lines.size, -1)).reshape(-1, x.size).T
    return at_nodes


def _stress_matrix(moduli: tuple[float, ...]) -> Floats:
    """Q as a matrix of the three strains."""
    q_11, q_12, q_22, q_66 = moduli
    return np.array([[q_11, q_12, 0.0], [q_12, q_22, 0.0], [0.0, 0.0, q_66]])


def _in_plane_fields(membrane: _Membrane, moduli: tuple[float, ...], curvature: int, loads: Sequence[Floats]) -> Floats:
    """In-plane fields under a unit of one curvature, from the loads of given deflections: (n, n_vectors)."""
    stresses = _STRAIN_COUNTS[curvature] * _stress_matrix(moduli)[:, curvature]
    total = sum(stress * load for stress, load in zip(stresses, loads, strict=True))
    free, factors = _stiffness_factors(membrane, moduli)
    fields = np.zeros_like(loads[0])
    fields[free] = factors.solve(np.asarray(total)[free])
    return fields


@lru_cache(maxsize=16)
def _stiffness_factors(membrane: _Membrane, moduli: tuple[float, ...]) -> tuple[Indices, Any]:
    """Unknowns that no edge holds, and the factors of their stiffness."""
    from scipy.sparse import csc_array, diags_array
    from scipy.sparse.linalg import splu

    matrices = _matrices(*membrane)
    stiffness = sum(modulus * matrix for modulus, matrix in zip(moduli, matrices.stiffness, strict=True))
    free = np.setdiff1d(np.arange(stiffness.shape[0]), matrices.held_unknowns)
    free_stiffness = csc_array(stiffness)[free][:, free]
    ground = np.full(free.size, _GROUND_SHARE * float(free_stiffness.diagonal().max()))
    return free, splu(csc_array(free_stiffness + diags_array(ground)))


def _energies(
    matrices: _Matrices, loads: Sequence[Floats], squares: Floats, first: tuple[int, Floats], second: tuple[int, Floats]
) -> Floats:
    """Integrals of the product of the strains under two curvatures, by the moduli: (4, n_vectors, n_vectors) array."""
    (a, fields_a), (b, fields_b) = first, second
    energies = []
    for modulus, stiffness in enumerate(matrices.stiffness):
        coupling = (
            _STRAIN_COUNTS[:, None] * _stress_matrix(tuple(float(modulus == k) for k in range(4))) * _STRAIN_COUNTS
        )
        terms = fields_a.T @ (stiffness @ fields_b) + coupling[a, b] * squares
        for i, load in enumerate(loads):
            if coupling[i, a]:
                terms -= coupling[i, a] / _STRAIN_COUNTS[i] * (load.T @ fields_b)
            if coupling[i, b]:
                terms -= coupling[i, b] / _STRAIN_COUNTS[i] * (fields_a.T @ load)
        energies.append(terms)
    return np.stack(energies)


@lru_cache(maxsize=16)
def _matrices(
    ends_x: EdgeConditions,
    ends_y: EdgeConditions,
    aspect_ratio: float,
    thickness: Field | None,
    outline: Outline | None,
) -> _Matrices:
    """The membrane by scikit-fem: two in-plane fields and the deflection, all of second order on rectangles."""
    from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad
    from skfem.helpers import grad

    sides = np.sqrt(aspect_ratio), 1.0 / np.sqrt(aspect_ratio)
    n_x, n_y = (max(_FEWEST_ELEMENTS, round(_MOST_ELEMENTS * side / max(sides))) for side in sides)
    mesh = MeshQuad.init_tensor(np.linspace(0.0, 1.0, n_x + 1), np.linspace(0.0, 1.0, n_y + 1)).with_defaults()
    if outline is not None:
        x, y = mesh.p
        low, high = outline(x)
        mesh = replace(mesh, doflocs=np.stack([x, low + (high - low) * y]))
    fields = Basis(mesh, ElementVector(ElementQuad2()), intorder=6)
    deflection = fields.with_element(ElementQuad2())

    def strains(u: Any) -> tuple[Any, Any, Any]:
        slope = grad(u)
        return slope[0, 0] / sides[0], slope[1, 1] / sides[1], slope[0, 1] / sides[1] + slope[1, 0] / sides[0]

    at_points = np.asarray(fields.global_coordinates())
    factor = np.ones(at_points.shape[1:]) if thickness is None else thickness(*at_points)

    def stiffness(i: int, j: int) -> Any:
        def form(u: Any, v: Any, at: Any) -> Any:
            strains_u, strains_v = strains(u), strains(v)
            product = strains_u[i] * strains_v[j]
            return at.factor * (product if i == j else product + strains_u[j] * strains_v[i])

        return BilinearForm(form).assemble(fields, factor=factor)

    def load(i: int) -> Any:
        form = BilinearForm(lambda w, v, at: at.factor * strains(v)[i] * w)
        return form.assemble(deflection, fields, factor=factor)

    held = [
        fields.get_dofs(side).all()
        for side, end in zip(("left", "right", "bottom", "top"), (*ends_x, *ends_y), strict=True)
        if end == "clamped"
    ]
    return _Matrices(
        stiffness=(stiffness(0, 0), stiffness(0, 1), stiffness(1, 1), stiffness(2, 2)),
        loads=tuple(load(i) for i in range(3)),
        mass=BilinearForm(lambda w, v, at: at.factor * w * v).assemble(deflection, factor=factor),
        places=deflection.doflocs,
        held_unknowns=np.unique(np.concatenate(held)) if held else np.empty(0, dtype=np.intp),
    )
