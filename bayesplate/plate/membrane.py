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
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import Any, Literal

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.setup import Ends
from bayesplate.plate.fields import Field
from bayesplate.plate.terms import Deflections

Curvature = Literal["bow", "cup", "twist"]

CURVATURES: tuple[Curvature, ...] = ("bow", "cup", "twist")
"""Of the strain along x, along y, and of the shear strain, of which a twist counts twice."""
MODULI = ("Q_11", "Q_12", "Q_22", "Q_66")

_Held = tuple[Ends, Ends, float, Field | None]
"""How a membrane is held, its aspect ratio, and the field that its stiffness follows."""

_ELEMENTS = 24
"""Of second order along the longer side: energies of shapes of four waves are within two parts in a thousand."""
_FEWEST = 16
_GROUNDED = 1e-9
"""Share of the stiffness that holds a free membrane from drifting; no strain loads such a motion."""
_DOUBLED = np.array([1.0, 1.0, 2.0])


@dataclass(frozen=True, eq=False)
class _Matrices:
    """Sparse matrices of a membrane of unit area."""

    stiffness: tuple[Any, ...]  # (n, n), by the moduli
    # (n, n_w): of a stress along x, along y, and in shear, that goes with the deflection at the nodes
    loads: tuple[Any, ...]
    mass: Any  # (n_w, n_w): integral of the product of two deflections
    places: Floats  # (2, n_w): of the deflections, as fractions of the sides
    held: Indices  # (n_held,): unknowns that edges hold


def membrane_terms(
    deflections: Deflections,
    aspect_ratio: float,
    moduli: tuple[float, ...],
    curvatures: tuple[Curvature, ...] = CURVATURES,
    thickness: Field | None = None,
) -> Floats:
    """Membrane energies, (n_pairs * 4, n_vectors, n_vectors), by `curvature_pairs` and by the moduli.

    For a plate of unit area: what a unit of the product of the two curvatures (each pair once, a cross term both ways)
    and of the modulus gives to the stiffness. The in-plane fields are solved at the `moduli` Q_11, Q_12, Q_22, Q_66, of
    which the ratios count; the stiffness of the membrane goes with the `thickness` over the plate.
    """
    held = deflections.x.ends, deflections.y.ends, aspect_ratio, thickness
    made = _matrices(*held)
    at_nodes = _at(deflections, made.places)
    loads = [load @ at_nodes for load in made.loads]
    squares = at_nodes.T @ (made.mass @ at_nodes)
    fields = {one: _solved(held, moduli, CURVATURES.index(one), loads) for one in curvatures}
    found = []
    for one, other in curvature_pairs(curvatures):
        both = ((CURVATURES.index(each), fields[each]) for each in (one, other))
        terms = _energies(made, loads, squares, *both)
        found.append((0.5 if one == other else 1.0) * (terms + np.swapaxes(terms, -1, -2)))
    return np.concatenate(found)


def curvature_pairs(curvatures: Sequence[Curvature]) -> tuple[tuple[Curvature, Curvature], ...]:
    """The pairs of curvatures whose products count, in the order of `membrane_terms`."""
    return tuple(combinations_with_replacement(curvatures, 2))


def _at(deflections: Deflections, places: Floats) -> Floats:
    """Deflections at places, which are those of a lattice: (n_places, n_vectors) array."""
    sides, at = zip(*(np.unique(np.round(one, 9), return_inverse=True) for one in places), strict=True)
    return np.asarray(deflections.on(*sides)[:, at[0], at[1]].T)


def _coupling(moduli: tuple[float, ...]) -> Floats:
    """Q as a matrix of the three strains."""
    q_11, q_12, q_22, q_66 = moduli
    return np.array([[q_11, q_12, 0.0], [q_12, q_22, 0.0], [0.0, 0.0, q_66]])


def _solved(held: _Held, moduli: tuple[float, ...], curvature: int, loads: Sequence[Floats]) -> Floats:
    """In-plane fields of deflections, of which the loads are given, under a unit of a curvature: (n, n_vectors)."""
    stresses = _DOUBLED[curvature] * _coupling(moduli)[:, curvature]
    load = sum(stress * one for stress, one in zip(stresses, loads, strict=True))
    free, factors = _factors(held, moduli)
    fields = np.zeros_like(loads[0])
    fields[free] = factors.solve(np.asarray(load)[free])
    return fields


@lru_cache(maxsize=16)
def _factors(held: _Held, moduli: tuple[float, ...]) -> tuple[Indices, Any]:
    """Unknowns that no edge holds, and the factors of their stiffness."""
    from scipy.sparse import csc_array, diags_array
    from scipy.sparse.linalg import splu

    made = _matrices(*held)
    whole = sum(modulus * part for modulus, part in zip(moduli, made.stiffness, strict=True))
    free = np.setdiff1d(np.arange(whole.shape[0]), made.held)
    kept = csc_array(whole)[free][:, free]
    ground = np.full(free.size, _GROUNDED * float(kept.diagonal().max()))
    return free, splu(csc_array(kept + diags_array(ground)))


def _energies(
    made: _Matrices, loads: Sequence[Floats], squares: Floats, one: tuple[int, Floats], other: tuple[int, Floats]
) -> Floats:
    """Integrals of the product of the strains under two curvatures, by the moduli: (4, n_vectors, n_vectors) array."""
    (a, fields_a), (b, fields_b) = one, other
    found = []
    for modulus, stiffness in enumerate(made.stiffness):
        coupling = _DOUBLED[:, None] * _coupling(tuple(float(modulus == k) for k in range(4))) * _DOUBLED
        terms = fields_a.T @ (stiffness @ fields_b) + coupling[a, b] * squares
        for i, load in enumerate(loads):
            if coupling[i, a]:
                terms -= coupling[i, a] / _DOUBLED[i] * (load.T @ fields_b)
            if coupling[i, b]:
                terms -= coupling[i, b] / _DOUBLED[i] * (fields_a.T @ load)
        found.append(terms)
    return np.stack(found)


@lru_cache(maxsize=16)
def _matrices(ends_x: Ends, ends_y: Ends, aspect_ratio: float, thickness: Field | None) -> _Matrices:
    """The membrane by scikit-fem: two in-plane fields and the deflection, all of second order on rectangles."""
    from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad
    from skfem.helpers import grad

    sides = np.sqrt(aspect_ratio), 1.0 / np.sqrt(aspect_ratio)
    n_x, n_y = (max(_FEWEST, round(_ELEMENTS * side / max(sides))) for side in sides)
    mesh = MeshQuad.init_tensor(np.linspace(0.0, 1.0, n_x + 1), np.linspace(0.0, 1.0, n_y + 1)).with_defaults()
    fields = Basis(mesh, ElementVector(ElementQuad2()), intorder=6)
    deflection = fields.with_element(ElementQuad2())

    def strains(u: Any) -> tuple[Any, Any, Any]:
        slope = grad(u)
        return slope[0, 0] / sides[0], slope[1, 1] / sides[1], slope[0, 1] / sides[1] + slope[1, 0] / sides[0]

    at_points = np.asarray(fields.global_coordinates())
    factor = np.ones(at_points.shape[1:]) if thickness is None else thickness(*at_points)

    def stiffness(i: int, j: int) -> Any:
        def form(u: Any, v: Any, at: Any) -> Any:
            of_u, of_v = strains(u), strains(v)
            both = of_u[i] * of_v[j]
            return at.factor * (both if i == j else both + of_u[j] * of_v[i])

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
        held=np.unique(np.concatenate(held)) if held else np.empty(0, dtype=np.intp),
    )
