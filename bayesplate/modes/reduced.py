"""The plate on a reduced basis: few vectors hold its modes over a whole region, thousands of times faster than a solve.

The basis holds the modes at the centre and what those at points around it have beside these, in the order of their
singular values, as many as bring the frequencies within a tolerance at points that were held out. All terms are
projected on it, so that the exact frequencies of a draw are the eigenvalues of a small pencil; its diagonal at the
centre is the linear law.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.beams import Beams
from bayesplate.modes.classes import SymmetryClass
from bayesplate.modes.naming import Place, beam_parts, fits, name_parts
from bayesplate.modes.plate import Plate
from bayesplate.modes.solve import ClassModes, solve_classes
from bayesplate.modes.terms import Parity, Weights

Floats = NDArray[np.float64]

SPARE = 4
"""Modes above the highest wanted one of a class that are solved and kept too."""
_FEW = 9
"""Training points that are always solved, all of them."""
_LONG = 5
"""Vectors over modes from which on more snapshots are solved: the more there are, the fewer vectors they need."""
_GROWTH = 1.2
_KEPT = 1.0, 1.5, 2.0
"""Modes at the centre that a step starts from, over those that are solved."""
_SPANNED = 1e-6
"""Singular value of what a snapshot adds, over its own size, from which on it counts."""
_BATCH = 512
"""Draws whose small matrices are held at once."""


@dataclass(frozen=True, eq=False)
class ReducedClass:
    """One symmetry class on few vectors: its modes at the centre, mass-orthonormal there, and what completes them.

    Attributes
    ----------
    parity : Parity
    stiffness : (n_terms, r, r) array
        Projected stiffness terms.
    masses : (n_masses, r, r) array
        Projected mass terms.
    n_kept : int
        How many of the vectors, the first ones, are modes at the centre from which those of a draw are found.
    products : tuple of (int, int)
        Orders of the products of beam functions that name its modes.
    parts : (r, n_products) array
        What each vector has of these.
    squares : (r, r) array
        Mean products of the vectors' deflections.
    beside : (n_masses, r, r) array
        What each mass term gives to the coordinates beside the plate.
    n_rigid : int
        Rigid motions in the basis: the lowest eigenvalues, which are left out.
    """

    parity: Parity
    stiffness: Floats
    masses: Floats
    n_kept: int
    products: tuple[Beams, ...]
    parts: Floats
    squares: Floats
    beside: Floats
    n_rigid: int = 0

    def eigenvalues(self, weights: Weights) -> Floats:
        """Elastic eigenvalues of many draws, increasing: (n_draws, n_kept - n_rigid) array, s^-2.

        Not a number at a draw that is no plate.
        """
        return np.concatenate([self._eigenvalues(part) for part in _batches(weights)])

    def _eigenvalues(self, weights: Weights) -> Floats:
        step = _stepped(_weighted(weights.stiffness, self.stiffness), self.mass(weights), self.n_kept, self.n_rigid)
        values = (pencil_values(step.stiffness, step.mass) - step.shift)[:, self.n_rigid :]
        return np.where(values[:, :1] > 0.0, values, np.nan)

    def modes(self, weights: Weights, n_modes: int) -> tuple[Floats, Floats]:
        """Lowest elastic modes of many draws: (n_draws, n) eigenvalues, s^-2, and (n_draws, r, n) vectors.

        The vectors are combinations of the basis, normalised in the draw's mass. Neither is a number at a draw that is
        no plate.
        """
        step = _stepped(_weighted(weights.stiffness, self.stiffness), self.mass(weights), self.n_kept, self.n_rigid)
        values, turned = pencil_modes(step.stiffness, step.mass)
        elastic = slice(self.n_rigid, self.n_rigid + n_modes)
        values, vectors = (values - step.shift)[:, elastic], step.vectors @ turned[:, :, elastic]
        is_plate = values[:, 0] > 0.0
        return np.where(is_plate[:, None], values, np.nan), np.where(is_plate[:, None, None], vectors, np.nan)

    def mass(self, weights: Weights) -> Floats:
        """Mass matrices of many draws on the basis: (n_draws, r, r) array."""
        return _weighted(weights.mass, self.masses)

    def ranks(self, weights: Weights, n_modes: int, least: float = 0.0) -> NDArray[np.intp]:
        """Which of the lowest elastic modes each of `products` names, with at least that correlation, at many draws.

        Returns
        -------
        (n_draws, n_products) array of int
            From 0; `n_modes` where it names none of them, -1 at a draw that is no plate.
        """
        found = np.full((len(weights.stiffness), len(self.products)), -1, dtype=np.intp)
        values, vectors = self.modes(weights, n_modes)
        for draw in np.flatnonzero(np.isfinite(values).all(axis=1)):
            found[draw] = n_modes
            for mode, (product, correlation) in enumerate(name_parts(self._fits(weights.mass[draw], vectors[draw]))):
                if correlation >= least:
                    found[draw, product] = mode
        return found

    def _fits(self, mass: Floats, vectors: Floats) -> Floats:
        """How well each mode of a draw fits each product: (n_modes, n_products) array."""
        forms = np.stack([self.squares, np.tensordot(mass, self.beside, axes=1)])
        squares, beside = np.einsum("rm,frs,sm->fm", vectors, forms, vectors, optimize=True)
        return fits(vectors.T @ self.parts, squares, 1.0 - beside)

    def energies(self, weights: Weights, n_modes: int) -> tuple[Floats, Floats]:
        """What each term has of the lowest modes of one draw: (n_modes, n_terms) and (n_modes, n_masses) arrays.

        The ratio of their weighted sums is omega^2 to second order around the draw.
        """
        vectors = self.modes(weights, n_modes)[1][0]
        stiffness, mass = (
            np.einsum("rm,trs,sm->mt", vectors, terms, vectors, optimize=True)
            for terms in (self.stiffness, self.masses)
        )
        return stiffness, mass


@dataclass(frozen=True, eq=False)
class ReducedOrderModel:
    """The plate on a basis of few vectors in each class that holds wanted modes.

    Attributes
    ----------
    places : tuple of Place
        The wanted modes, in the caller's order.
    classes : tuple of ReducedClass
    worst_cents : float
        Largest error against full solves that were held out when the basis was built.
    """

    places: tuple[Place, ...]
    classes: tuple[ReducedClass, ...]
    worst_cents: float

    def eigenvalues(self, weights: Weights) -> Floats:
        """Eigenvalue of each wanted mode for many draws: (n_draws, n_modes) array, s^-2."""
        values = np.empty((weights.stiffness.shape[0], len(self.places)))
        for own in self.classes:
            columns, ranks = self._of(own)
            values[:, columns] = own.eigenvalues(weights)[:, ranks]
        return values

    def ranks(self, weights: Weights, least: float = 0.0) -> dict[Beams, NDArray[np.intp]]:
        """Rank in its class of the mode that each product of beam functions names, at many draws.

        Parameters
        ----------
        weights : Weights
        least : float
            Correlation of its shape with the product from which on a mode has that name.

        Returns
        -------
        dict of (n_draws,) array of int
            By the orders along x and y; those that name none of the lowest modes have the highest rank of all. -1 at a
            draw that is no plate.
        """
        found: dict[Beams, NDArray[np.intp]] = {}
        for own in self.classes:
            n_modes = max(self._of(own)[1]) + 1 + SPARE
            found |= dict(zip(own.products, own.ranks(weights, n_modes, least).T, strict=True))
        return found

    def energies(self, weights: Weights) -> tuple[Floats, Floats]:
        """What each term has of each wanted mode of one draw: (n_modes, n_terms) and (n_modes, n_masses) arrays."""
        stiffness, mass = (np.empty((len(self.places), part.shape[1])) for part in weights)
        for own in self.classes:
            columns, ranks = self._of(own)
            stiffness[columns], mass[columns] = (part[ranks] for part in own.energies(weights, max(ranks) + 1))
        return stiffness, mass

    def _of(self, own: ReducedClass) -> tuple[list[int], list[int]]:
        """Which of the wanted modes are of a class, and their ranks there."""
        both = [(i, place.rank) for i, place in enumerate(self.places) if place.parity == own.parity]
        return [i for i, _ in both], [rank for _, rank in both]


def reduced_order_model(
    plate: Plate,
    places: Sequence[Place],
    centre: Weights,
    around: Iterable[Weights],
    held_out: Sequence[Weights],
    tolerance: float,
) -> ReducedOrderModel:
    """Project a plate on its modes at `centre` and `around` it, and check the result at the points `held_out`.

    Of many points around the first half will do if the error at the held-out ones stays within the tolerance and the
    basis short. While that is not so, the second half joins the basis, then half of the held-out points. The check is
    made at those that did not join: they lie as far out as the others, and none was chosen for its error, so that it is
    an honest sample of the error over the region.

    Parameters
    ----------
    plate : Plate
    places : sequence of Place
        The modes wanted.
    centre : Weights
        At the estimate.
    around, held_out : sequences of Weights
        At least one is held out. Points that are no plates are left out.
    tolerance : float, cents

    Returns
    -------
    ReducedOrderModel

    Raises
    ------
    numpy.linalg.LinAlgError
        If none of the held-out points is a plate.
    """
    n_modes = {p: 1 + SPARE + max(one.rank for one in places if one.parity == p) for p in {o.parity for o in places}}
    training = [centre, *around]
    n_first = len(training) if len(training) <= _FEW else 1 + len(training) // 2
    (middle,) = _solved(plate, [centre], n_modes)
    snapshots, checks = (_solved(plate, points, n_modes) for points in (training[1:n_first], held_out))
    if not checks:
        raise np.linalg.LinAlgError("none of the points that were held out is a plate")
    n_joined, later = 0, training[n_first:]
    while True:
        joined = [*snapshots, *checks[:n_joined]]
        found = [_reduced(plate.symmetry_class(p), middle, joined, checks[n_joined:], tolerance, p) for p in n_modes]
        worst = max(cents for _, cents in found)
        is_long = any(own.stiffness.shape[-1] > _LONG * own.n_kept for own, _ in found)
        if (worst > tolerance or is_long) and later:
            snapshots, later = [*snapshots, *_solved(plate, later, n_modes)], []
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
    own: SymmetryClass,
    middle: _Solved,
    snapshots: Sequence[_Solved],
    checks: Sequence[_Solved],
    tolerance: float,
    parity: Parity,
) -> tuple[ReducedClass, float]:
    """The smallest basis of a class that is within the tolerance at the points that check it, and its error there."""
    centre, first = middle[0], middle[1][parity]
    vectors = _basis(
        own, centre, first, np.hstack([of_class[parity].vectors for _, of_class in snapshots] or [first.vectors])
    )
    exact = np.stack([of_class[parity].eigenvalues[:-SPARE] for _, of_class in checks])
    points = [centre, *(weights for weights, _ in checks)]
    pencils = [own.pencil(own.plate.elements(one)) for one in points]
    stiffness, mass = own.on_span(pencils, Weights(*(np.stack(part) for part in zip(*points, strict=True))), vectors)

    def tried(size: int, n_kept: int) -> tuple[Floats, float]:
        """What turns the first vectors to modes at the centre, and the error of their law where it is checked."""
        turn = pencil_modes(stiffness[:1, :size, :size], mass[:1, :size, :size])[1][0]
        turned = [turn.T @ one[1:, :size, :size] @ turn for one in (stiffness, mass)]
        step = _stepped(turned[0], turned[1], n_kept, own.n_rigid)
        values = (pencil_values(step.stiffness, step.mass) - step.shift)[:, own.n_rigid :]
        ratios = values[:, : exact.shape[1]] / exact
        return turn, 600.0 * float(np.abs(np.log2(np.where(ratios > 0.0, ratios, np.inf))).max())

    fewest, most = first.vectors.shape[1] + own.n_rigid, vectors.shape[1]
    for n_kept in sorted({min(round(times * fewest), most) for times in _KEPT}):
        (turn, cents), size = tried(most, n_kept), most
        if cents <= tolerance:
            sizes = list(_sizes(n_kept, most))
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


class _Step(NamedTuple):
    """Vectors after a step from the first ones, (n, r, n_kept); stiffness and mass on them; the shift, (n, 1), s^-2."""

    vectors: Floats
    stiffness: Floats
    mass: Floats
    shift: Floats


def _stepped(stiffness: Floats, mass: Floats, n_kept: int, n_rigid: int) -> _Step:
    """One step of inverse iteration on pencils of (n, r, r) arrays.

    The shift lifts rigid motions off zero; it is the draw's own, so that eigenvalues are homogeneous in the stiffness.
    """
    shift = (stiffness[:, n_rigid, n_rigid] / mass[:, n_rigid, n_rigid])[:, None, None]
    shifted = stiffness + shift * mass
    if stiffness.shape[-1] == n_kept:
        return _Step(np.eye(n_kept)[None], shifted, mass, shift[:, :, 0])
    loads = mass[:, :, :n_kept]
    vectors = np.asarray(np.linalg.solve(shifted, loads), dtype=np.float64)
    across = np.swapaxes(vectors, -1, -2)
    return _Step(vectors, across @ loads, across @ (mass @ vectors), shift[:, :, 0])


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


def pencil_values(stiffness: Floats, mass: Floats) -> Floats:
    """All eigenvalues of pencils of (n, r, r) arrays, increasing: (n, r); not numbers where no mass is positive."""
    whitened, is_mass = _whitened(stiffness, mass)[:2]
    return np.where(is_mass[:, None], np.linalg.eigvalsh(whitened), np.nan)


def pencil_modes(stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
    """The same, and the mass-normalised vectors: (n, r) and (n, r, r) arrays."""
    whitened, is_mass, inverse = _whitened(stiffness, mass)
    values, turned = np.linalg.eigh(whitened)
    return np.where(is_mass[:, None], values, np.nan), np.swapaxes(inverse, -1, -2) @ turned


def _whitened(stiffness: Floats, mass: Floats) -> tuple[Floats, NDArray[np.bool_], Floats]:
    """Stiffness in coordinates in which the mass is one; which masses are positive; inverses of their factors."""
    try:
        factors = np.linalg.cholesky(mass)
        is_mass = np.ones(len(mass), dtype=bool)
    except np.linalg.LinAlgError:
        is_mass = np.linalg.eigvalsh(mass)[:, 0] > 0.0
        factors = np.linalg.cholesky(np.where(is_mass[:, None, None], mass, np.eye(mass.shape[-1])))
    inverse = np.linalg.inv(factors)
    return inverse @ stiffness @ np.swapaxes(inverse, -1, -2), is_mass, inverse


def _batches(weights: Weights) -> Iterator[Weights]:
    for start in range(0, max(len(weights.stiffness), 1), _BATCH):
        yield Weights(*(part[start : start + _BATCH] for part in weights))


def _weighted(weights: Floats, terms: Floats) -> Floats:
    """Weighted sums of terms, one (r, r) matrix per draw."""
    n_terms, r, _ = terms.shape
    return (weights @ terms.reshape(n_terms, r * r)).reshape(-1, r, r)
