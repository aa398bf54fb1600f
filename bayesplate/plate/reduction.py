"""How a reduced basis is made: which points are solved, which vectors span it, how many of them are enough.

It is checked against full solves that it has not seen.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.plate.classes import SymmetryClass
from bayesplate.plate.naming import Place, beam_parts, reaching
from bayesplate.plate.pencils import pencil_modes, pencil_values, stepped
from bayesplate.plate.plate import Plate
from bayesplate.plate.reduced import SPARE, ReducedClass, ReducedOrderModel
from bayesplate.plate.solve import ClassModes, solve_classes
from bayesplate.plate.terms import Parity, Weights

_FEW = 9
"""Training points, the centre among them, that are always solved, all of them."""
_LONG = 5
"""Vectors over modes from which on more snapshots are solved: the more there are, the fewer vectors they need."""
_BESIDE = 8
"""Vectors that every basis has beside the modes: far beyond the points that check it these alone would not do."""
_GROWTH = 1.2
_KEPT = 1.0, 1.5, 2.0
"""Modes at the centre that a step starts from, over those that are solved."""
_SPANNED = 1e-6
"""Singular value of what a snapshot adds, over its own size, from which on it counts."""


def reduced_order_model(
    plate: Plate,
    places: Sequence[Place],
    centre: Weights,
    around: Iterable[Weights],
    held_out: Sequence[Weights],
    tolerance: float,
) -> ReducedOrderModel:
    """Project a plate on its modes at `centre` and `around` it, and check it at the points `held_out`, in cents.

    Of many points around the first half will do if the error at the held-out ones stays within the tolerance and the
    basis short. While that is not so, the second half joins the basis, then half of the held-out points. The check is
    made at those that did not join: they lie as far out as the others, and none was chosen for its error, so that it is
    an honest sample of the error over the region. Points that are no plates are left out; LinAlgError if the centre or
    all that are held out are none.
    """
    n_modes = reaching(places)
    n_trained = {parity: n + SPARE for parity, n in n_modes.items()}
    training = list(around)
    n_first = len(training) if len(training) < _FEW else (1 + len(training)) // 2
    middle = centre, solve_classes(plate, centre, n_trained)
    snapshots = _solved(plate, training[:n_first], n_trained)
    checks = _solved(plate, held_out, n_modes)
    if not checks:
        raise np.linalg.LinAlgError("none of the points that were held out is a plate")
    n_joined, later = 0, training[n_first:]
    while True:
        joined = [*snapshots, *checks[:n_joined]]
        found = [_reduced(plate.symmetry_class(p), middle, joined, checks[n_joined:], tolerance) for p in n_modes]
        worst = max(cents for _, cents in found)
        is_long = any(own.stiffness.shape[-1] > _LONG * n_trained[own.parity] for own, _ in found)
        if (worst > tolerance or is_long) and later:
            snapshots, later = [*snapshots, *_solved(plate, later, n_trained)], []
        elif worst > tolerance and not n_joined and len(checks) > 1:
            n_joined = len(checks) // 2
        else:
            return ReducedOrderModel(tuple(places), tuple(own for own, _ in found), worst)


_Solved = tuple[Weights, dict[Parity, ClassModes]]


def _solved(plate: Plate, points: Iterable[Weights], n_modes: dict[Parity, int]) -> list[_Solved]:
    """The points that are plates, and their modes.

    An expansion to second order in fields need not be positive where several of them are far out at once.
    """
    found = []
    for weights in points:
        try:
            modes = solve_classes(plate, weights, n_modes)
        except np.linalg.LinAlgError:
            continue
        if all((of_class.eigenvalues > 0.0).all() for of_class in modes.values()):
            found.append((weights, modes))
    return found


def _reduced(
    own: SymmetryClass, middle: _Solved, snapshots: Sequence[_Solved], checks: Sequence[_Solved], tolerance: float
) -> tuple[ReducedClass, float]:
    """The smallest basis of a class that is within the tolerance at the points that check it, and its error there."""
    parity = own.parity
    centre, first = middle[0], middle[1][parity]
    vectors = _basis(
        own, centre, first, np.hstack([of_class[parity].vectors for _, of_class in snapshots] or [first.vectors])
    )
    exact = np.stack([of_class[parity].eigenvalues for _, of_class in checks])
    points = [centre, *(weights for weights, _ in checks)]
    pencils = [own.pencil(own.plate.elements(one)) for one in points]
    stiffness, mass = own.on_span(pencils, Weights(*(np.stack(part) for part in zip(*points, strict=True))), vectors)

    def tried(size: int, n_kept: int) -> tuple[Floats, float]:
        """What turns the first vectors to modes at the centre, and the error of their law where it is checked."""
        turn = pencil_modes(stiffness[:1, :size, :size], mass[:1, :size, :size])[1][0]
        turned = [turn.T @ one[1:, :size, :size] @ turn for one in (stiffness, mass)]
        step = stepped(turned[0], turned[1], n_kept, own.n_rigid)
        values = (pencil_values(step.stiffness, step.mass) - step.shift)[:, own.n_rigid :]
        ratios = values[:, : exact.shape[1]] / exact
        return turn, 600.0 * float(np.abs(np.log2(np.where(ratios > 0.0, ratios, np.inf))).max())

    fewest, most = first.vectors.shape[1] + own.n_rigid, vectors.shape[1]
    for n_kept in sorted({min(round(times * fewest), most) for times in _KEPT}):
        (turn, cents), size = tried(most, n_kept), most
        if cents <= tolerance:
            sizes = list(_sizes(min(n_kept + _BESIDE, most), most))
            size = sizes[bisect_left(sizes, True, key=lambda one: tried(one, n_kept)[1] <= tolerance)]
            turn, cents = tried(size, n_kept)
            break
    basis = vectors[:, :size] @ turn
    parts, squares = beam_parts(own, basis)
    reduced = ReducedClass(
        parity=parity,
        stiffness=own.project_stiffness(basis),
        masses=own.project_masses(basis),
        n_kept=n_kept,
        products=tuple(own.plate.elastic_products[parity]),
        parts=parts,
        squares=squares,
        beside=own.project_beside(basis),
        n_rigid=own.n_rigid,
    )
    return reduced, cents


def _basis(own: SymmetryClass, weights: Weights, first: ClassModes, snapshots: Floats) -> Floats:
    """Rigid motions, the modes at the centre, then what snapshots have beside them by singular value: (n_dof, r).

    Orthonormal in the energy of the centre, of which each snapshot has one: what a mode lacks then counts by its share
    of the mode's own energy, which is the error of its eigenvalue.
    """
    stiffness, mass = own.pencil(own.plate.elements(weights))
    norm = stiffness + float(first.eigenvalues[0]) * mass
    known = _orthonormal(norm, np.hstack([first.rigid, first.vectors]))
    sizes = np.sqrt(np.einsum("ij,ij->j", snapshots, norm @ snapshots))
    rest = snapshots / sizes
    for _ in range(2):
        rest = rest - known @ (known.T @ (norm @ rest))
    squared, turn = np.linalg.eigh(rest.T @ (norm @ rest))
    kept = np.flatnonzero(squared > _SPANNED**2)[::-1]
    return np.hstack([known, _orthonormal(norm, rest @ (turn[:, kept] / np.sqrt(squared[kept])))])


def _orthonormal(norm: Floats, vectors: Floats) -> Floats:
    """Vectors of which each is made orthonormal to those before it."""
    return np.asarray(np.linalg.solve(np.linalg.cholesky(vectors.T @ (norm @ vectors)), vectors.T).T)


def _sizes(fewest: int, most: int) -> Iterator[int]:
    """Sizes of a basis that are tried, growing."""
    size = fewest
    while size < most:
        yield size
        size = max(size + 2, round(_GROWTH * size))
    yield most
