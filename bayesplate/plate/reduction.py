"""How a reduced basis is made: which points are solved, which vectors span it, and how many of them are enough.

The basis is checked against full solves that it was not made from.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.plate.classes import SymmetryClass
from bayesplate.plate.naming import ModePlace, beam_parts, modes_to_hold
from bayesplate.plate.pencils import inverse_step, pencil_modes, pencil_values
from bayesplate.plate.plate import Plate
from bayesplate.plate.reduced import SPARE_MODES, ReducedClass, ReducedOrderModel
from bayesplate.plate.solve import ClassModes, solve_classes
from bayesplate.plate.terms import Parity, Weights

_FEWEST_POINTS = 9
"""Number of training points, the centre among them, below which all of them are solved at once."""
_LONG_BASIS = 5
"""Vectors per mode above which more snapshots are solved: with more snapshots fewer vectors are needed."""
_EXTRA_VECTORS = 8
"""Vectors that every basis has beside the modes: without them it would fail far beyond the points that check it."""
_BASIS_GROWTH = 1.2
_STEP_RATIOS = 1.0, 1.5, 2.0
"""Modes at the centre that a step starts from, over those that are solved."""
_SPANNED_SHARE = 1e-6
"""Singular value of a direction that snapshots add, over their own size, above which it joins the basis."""


def reduced_order_model(
    plate: Plate,
    places: Sequence[ModePlace],
    centre: Weights,
    around: Iterable[Weights],
    held_out: Sequence[Weights],
    tolerance: float,
) -> ReducedOrderModel:
    """Project a plate on its modes at `centre` and `around` it, and check it at the points `held_out`, in cents.

    Of many points around, the first half is enough if the error at the held-out points stays within the tolerance and
    the basis short. Otherwise the second half joins the basis, then half of the held-out points. The check is made at
    the points that did not join: they lie as far out as the others, and none was chosen for its error, so that it is an
    honest sample of the error over the region. Points that are no plates are left out; LinAlgError if the centre or all
    held-out points are none.
    """
    n_modes = modes_to_hold(places)
    n_trained = {parity: n + SPARE_MODES for parity, n in n_modes.items()}
    training = list(around)
    n_first = len(training) if len(training) < _FEWEST_POINTS else (1 + len(training)) // 2
    middle = centre, solve_classes(plate, centre, n_trained)
    snapshots = _solve_points(plate, training[:n_first], n_trained)
    checks = _solve_points(plate, held_out, n_modes)
    if not checks:
        raise np.linalg.LinAlgError("none of the points that were held out is a plate")
    n_joined, later_points = 0, training[n_first:]
    while True:
        joined = [*snapshots, *checks[:n_joined]]
        reductions = [
            _reduce_class(plate.symmetry_class(p), middle, joined, checks[n_joined:], tolerance) for p in n_modes
        ]
        worst = max(cents for _, cents in reductions)
        is_long = any(
            reduced.stiffness.shape[-1] > _LONG_BASIS * n_trained[reduced.parity] for reduced, _ in reductions
        )
        if (worst > tolerance or is_long) and later_points:
            snapshots, later_points = [*snapshots, *_solve_points(plate, later_points, n_trained)], []
        elif worst > tolerance and not n_joined and len(checks) > 1:
            n_joined = len(checks) // 2
        else:
            return ReducedOrderModel(tuple(places), tuple(reduced for reduced, _ in reductions), worst)


_SolvedPoint = tuple[Weights, dict[Parity, ClassModes]]


def _solve_points(plate: Plate, points: Iterable[Weights], n_modes: dict[Parity, int]) -> list[_SolvedPoint]:
    """The points that are plates, and their modes.

    An expansion to second order in fields need not be positive where several of them are far out at once.
    """
    solved = []
    for weights in points:
        try:
            modes = solve_classes(plate, weights, n_modes)
        except np.linalg.LinAlgError:
            continue
        if all((class_modes.eigenvalues > 0.0).all() for class_modes in modes.values()):
            solved.append((weights, modes))
    return solved


def _reduce_class(
    symmetry_class: SymmetryClass,
    middle: _SolvedPoint,
    snapshots: Sequence[_SolvedPoint],
    checks: Sequence[_SolvedPoint],
    tolerance: float,
) -> tuple[ReducedClass, float]:
    """The smallest basis of a class that is within the tolerance at the points that check it, and its error there."""
    parity = symmetry_class.parity
    centre, centre_modes = middle[0], middle[1][parity]
    vectors = _basis(
        symmetry_class,
        centre,
        centre_modes,
        np.hstack([modes[parity].vectors for _, modes in snapshots] or [centre_modes.vectors]),
    )
    exact = np.stack([modes[parity].eigenvalues for _, modes in checks])
    points = [centre, *(weights for weights, _ in checks)]
    pencils = [symmetry_class.pencil(symmetry_class.plate.elements(point)) for point in points]
    stiffness, mass = symmetry_class.on_span(
        pencils, Weights(*(np.stack(w) for w in zip(*points, strict=True))), vectors
    )

    def try_basis(size: int, n_kept: int) -> tuple[Floats, float]:
        """Rotation of the first `size` vectors to modes at the centre, and the worst error at the checks, cents."""
        rotation = pencil_modes(stiffness[:1, :size, :size], mass[:1, :size, :size])[1][0]
        rotated = [rotation.T @ matrices[1:, :size, :size] @ rotation for matrices in (stiffness, mass)]
        step = inverse_step(rotated[0], rotated[1], n_kept, symmetry_class.n_rigid)
        values = (pencil_values(step.stiffness, step.mass) - step.shift)[:, symmetry_class.n_rigid :]
        ratios = values[:, : exact.shape[1]] / exact
        return rotation, 600.0 * float(np.abs(np.log2(np.where(ratios > 0.0, ratios, np.inf))).max())

    fewest, most = centre_modes.vectors.shape[1] + symmetry_class.n_rigid, vectors.shape[1]
    for n_kept in sorted({min(round(times * fewest), most) for times in _STEP_RATIOS}):
        (rotation, cents), size = try_basis(most, n_kept), most
        if cents <= tolerance:
            sizes = list(_basis_sizes(min(n_kept + _EXTRA_VECTORS, most), most))
            size = sizes[bisect_left(sizes, True, key=lambda n: try_basis(n, n_kept)[1] <= tolerance)]
            rotation, cents = try_basis(size, n_kept)
            break
    basis = vectors[:, :size] @ rotation
    parts, squares = beam_parts(symmetry_class, basis)
    reduced = ReducedClass(
        parity=parity,
        stiffness=symmetry_class.project_stiffness(basis),
        masses=symmetry_class.project_masses(basis),
        n_kept=n_kept,
        products=tuple(symmetry_class.plate.elastic_products[parity]),
        parts=parts,
        squares=squares,
        coordinate_masses=symmetry_class.project_coordinates(basis),
        n_rigid=symmetry_class.n_rigid,
    )
    return reduced, cents


def _basis(symmetry_class: SymmetryClass, weights: Weights, centre_modes: ClassModes, snapshots: Floats) -> Floats:
    """Rigid motions, the modes at the centre, then what snapshots add to them by singular value: (n_dof, r).

    Orthonormal in the energy of the centre, in which each snapshot is scaled to one: the part of a mode that the basis
    lacks then counts by its share of the mode's own energy, which is the error of its eigenvalue.
    """
    stiffness, mass = symmetry_class.pencil(symmetry_class.plate.elements(weights))
    norm = stiffness + float(centre_modes.eigenvalues[0]) * mass
    base = _orthonormal(norm, np.hstack([centre_modes.rigid, centre_modes.vectors]))
    sizes = np.sqrt(np.einsum("ij,ij->j", snapshots, norm @ snapshots))
    remainders = snapshots / sizes
    for _ in range(2):
        remainders = remainders - base @ (base.T @ (norm @ remainders))
    squared, rotation = np.linalg.eigh(remainders.T @ (norm @ remainders))
    directions = np.flatnonzero(squared > _SPANNED_SHARE**2)[::-1]
    return np.hstack([base, _orthonormal(norm, remainders @ (rotation[:, directions] / np.sqrt(squared[directions])))])


def _orthonormal(norm: Floats, vectors: Floats) -> Floats:
    """Vectors, each made orthonormal to those before it."""
    return np.asarray(np.linalg.solve(np.linalg.cholesky(vectors.T @ (norm @ vectors)), vectors.T).T)


def _basis_sizes(fewest: int, most: int) -> Iterator[int]:
    """Sizes of a basis that are tried, growing."""
    size = fewest
    while size < most:
        yield size
        size = max(size + 2, round(_BASIS_GROWTH * size))
    yield most
