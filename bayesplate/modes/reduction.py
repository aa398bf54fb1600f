"""How a reduced-order model is built: which points are solved, which vectors span the basis, how it is used cheapest.

It is checked against full solves that it has not seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.naming import Place, beam_parts
from bayesplate.modes.nearby import BESIDE, modes_nearby
from bayesplate.modes.plate import Block, Parity, PlateMatrices, Weights
from bayesplate.modes.reduced import SPARE, WHOLE, ReducedBlock, ReducedOrderModel
from bayesplate.modes.solve import ClassModes, solve_class
from bayesplate.modes.threads import in_threads

ACCEPTED_CENTS = 0.1
_RESISTS = 1e-6
_LOWEST_SHARE = 1e-7
_FEW = 9
"""Training points that are always solved, all of them."""
_STEADY = 0.05
_HARDLY_MORE = 1.1
"""Error of a cheap way to use a basis over that of the whole basis, where the latter is above what is accepted."""
_BEYOND = 10
"""Modes above the wanted ones that are kept from it."""
_LARGE, _LARGE_PENCIL = 80, 60
"""Vectors from which on steps from the modes at the centre pay, without and with masses."""
_SHARED = 2 / 3
"""Share of them that is tried before the whole: the last ones, which are what the modes have most in common."""
_STEPS = 1, 2
"""How many are tried, each with fewer and with more vectors kept."""


def reduced_order_model(
    plate: PlateMatrices,
    places: Sequence[Place],
    centre: Weights,
    around: Iterable[Weights],
    held_out: Sequence[Weights],
    accepted_cents: float = ACCEPTED_CENTS,
) -> ReducedOrderModel:
    """Project a plate on its modes at `centre` and `around` it, and check the result at the points `held_out`.

    Of many points around the first half will do if the error at the held-out ones stays below what is accepted. While
    it does not, the second half joins the basis, then half of the held-out points. The check is
    made at those that did not join: they lie as far out as the others, and none was chosen for its error, so that it is
    an honest sample of the error over the region.

    Parameters
    ----------
    plate : PlateMatrices
    places : sequence of Place
        The modes wanted.
    centre : Weights
        At the estimate.
    around, held_out : sequences of Weights
        At least one is held out.
    accepted_cents : float

    Returns
    -------
    ReducedOrderModel
    """
    ranks: dict[Parity, int] = {}
    for place in places:
        ranks[place.parity] = max(ranks.get(place.parity, 0), place.rank + 1)
    training = [centre, *around]
    blocks = []
    worst = 0.0
    for parity, n_modes in ranks.items():
        block, error = _reduce(plate, parity, n_modes, training, held_out, accepted_cents)
        blocks.append(block)
        worst = max(worst, error)
    return ReducedOrderModel(tuple(places), tuple(blocks), worst)


def _reduce(
    plate: PlateMatrices,
    parity: Parity,
    n_modes: int,
    training: list[Weights],
    held_out: Sequence[Weights],
    accepted_cents: float,
) -> tuple[ReducedBlock, float]:
    block = plate.block(parity)

    n_first = len(training) if len(training) <= _FEW else 1 + len(training) // 2
    known = solve_class(block, training[0], n_modes + SPARE + BESIDE)
    first = known.of(range(min(n_modes + SPARE, known.eigenvalues.size)))

    def near(points: Sequence[Weights]) -> list[ClassModes]:
        return _of_plates(lambda one: modes_nearby(block, one, known, n_modes + SPARE), points)[1]

    trained = [first, *near(training[1:n_first])]
    # Where the model is judged each plate is solved by itself: a mode that the known ones lack would be missed there.
    held_out, checks = _of_plates(lambda one: solve_class(block, one, n_modes + SPARE), held_out)
    if not checks:
        raise np.linalg.LinAlgError("none of the points that were held out is a plate")
    # A second mass or a support lets elastic modes carry some rigid motion; otherwise they are orthogonal to it.
    rigid = first.rigid[:, : block.n_rigid if block.n_masses > 1 or _is_supported(block, first) else 0]
    exact = np.stack([solution.eigenvalues[:n_modes] for solution in checks])
    is_steady = _is_steady([*training, *held_out])
    stiffness, mass = (np.stack(w) for w in zip(*held_out, training[0], strict=True))
    seen = Weights(np.eye(len(stiffness)), mass)
    n_solved = n_first
    rounds = (n_first, 0), (len(training), 0), (len(training), len(held_out) // 2)
    for n_trained, n_joined in dict.fromkeys(rounds):
        trained += near(training[n_solved:n_trained])
        n_solved = max(n_solved, n_trained)
        elastic = np.concatenate([solution.vectors for solution in (*trained, *checks[:n_joined])], axis=1)
        vectors = _orthonormal(block, rigid, elastic, first, training[0], is_steady)
        # A basis and a way to use it are judged by the stiffness at these points alone; its terms follow in the end.
        whole = _projected(plate, block, vectors, Weights(stiffness, mass), rigid.shape[1], first, is_steady)
        checked, against = Weights(*(w[n_joined:-1] for w in seen)), exact[n_joined:]
        of_basis = _worst_cents(whole, checked, against)
        if of_basis <= accepted_cents:
            break
    # Where the basis itself is not that good, the first way that adds hardly anything to its error will do.
    bar = accepted_cents if of_basis <= accepted_cents else _HARDLY_MORE * of_basis
    for way in _cheapest_first(whole, seen.at(-1), n_modes):
        cents = _worst_cents(way[0], checked, against)
        if cents <= bar:  # at the latest the last way, which is the whole basis
            break
    used, turn = way
    return replace(used, stiffness=block.project_stiffness(vectors @ turn)), cents


def _of_plates(
    solve: Callable[[Weights], ClassModes], points: Sequence[Weights]
) -> tuple[list[Weights], list[ClassModes]]:
    """The points that are plates, and their modes.

    An expansion to second order in fields need not be positive where several of them are far out at once.
    """

    def modes_of(weights: Weights) -> ClassModes | None:
        try:
            return solve(weights)
        except np.linalg.LinAlgError:
            return None

    found = zip(points, in_threads(modes_of, points), strict=True)
    kept = [(weights, modes) for weights, modes in found if modes is not None]
    return [weights for weights, _ in kept], [modes for _, modes in kept]


def _is_supported(block: Block, solution: ClassModes) -> bool:
    """Whether a stiffness term resists the rigid motions."""
    if not block.n_rigid:
        return False
    every = (block.project(block.terms, vectors) for vectors in (solution.rigid, solution.vectors))
    resists, bends = (np.abs(terms).max(axis=(1, 2)) for terms in every)
    return bool((resists > _RESISTS * bends).any())


def _orthonormal(
    block: Block,
    rigid: NDArray[np.float64],
    elastic: NDArray[np.float64],
    centre: ClassModes,
    weights: Weights,
    is_steady: bool,
) -> NDArray[np.float64]:
    """Basis of the span of some vectors, orthonormal in energy, or in the mass if that is steady: (n_dof, r) array.

    Directions that the vectors hardly span are dropped; what they have most in common comes last.
    """
    vectors = np.concatenate([rigid, elastic], axis=1)
    highest = float(centre.eigenvalues[-1])
    norm = block.stiffness(weights) + highest * block.mass(weights)
    gram = vectors.T @ (norm @ vectors)
    scale = 1.0 / np.sqrt(np.diagonal(gram))
    shares, directions = np.linalg.eigh(scale[:, None] * gram * scale)
    kept = shares > _LOWEST_SHARE * shares[-1]
    basis = (vectors * scale) @ (directions[:, kept] / np.sqrt(shares[kept]))
    if is_steady:
        steady = np.tensordot(weights.mass, block.project_masses(basis), axes=1)
        basis = basis @ np.linalg.inv(np.linalg.cholesky(steady)).T
    return np.asarray(basis)


def _projected(
    plate: PlateMatrices,
    block: Block,
    basis: NDArray[np.float64],
    points: Weights,
    n_rigid: int,
    centre: ClassModes,
    is_steady: bool,
) -> ReducedBlock:
    """The stiffness at some points and the masses on a basis, the latter where it is not orthonormal in them."""
    stiffness = block.project(block.stored_stiffness(points), basis) + block.further_stiffness(points, basis)
    size = basis.shape[1]
    masses = np.empty((0, size, size)) if is_steady else block.project_masses(basis)
    deflections = block.spread(basis)
    parts = beam_parts(plate, deflections, block.parity)
    named = np.stack(list(parts.values()), axis=1)
    weighed = plate.line_x.mass @ deflections @ plate.line_y.mass
    squares = deflections.reshape(size, -1) @ weighed.reshape(size, -1).T
    magnets = block.beside(basis)
    beside = np.einsum("kj,jr,js->krs", block.masses_beside, magnets, magnets, optimize=True)
    first = float(centre.eigenvalues[0])
    return ReducedBlock(
        block.parity, stiffness, masses, named, tuple(parts), n_rigid, first, squares=squares, beside=beside
    )


def _worst_cents(block: ReducedBlock, checked: Weights, exact: NDArray[np.float64]) -> float:
    """Largest error against (n_points, n_modes) eigenvalues of full solves."""
    ratios = block.eigenvalues(checked)[:, : exact.shape[1]] / exact
    return 600.0 * float(np.abs(np.log2(ratios)).max())


def _cheapest_first(
    whole: ReducedBlock, centre: Weights, n_modes: int
) -> Iterator[tuple[ReducedBlock, NDArray[np.float64]]]:
    """Ways to find the modes of a draw on a basis: of a large one first from the modes at the centre; then as it is.

    A part of a basis that is orthonormal in the mass would not span what its vectors have in common.
    """
    size = whole.stiffness.shape[-1]
    n_condensed, n_stepped = (whole.n_rigid + n for n in (n_modes + _BEYOND, 2 * n_modes))
    every = np.eye(size)
    if size > max(WHOLE, 2 * n_condensed):
        turned, turn = _on_modes(whole, every, centre)
        yield replace(turned, n_kept=n_condensed), turn
    if size > (_LARGE_PENCIL if len(whole.masses) else _LARGE):
        last = every[:, size - max(round(_SHARED * size), n_condensed) :]
        for part in [last, every] if len(whole.masses) else [every]:
            kept = [n for n in sorted({n_condensed, n_stepped}) if part.shape[1] > 2 * n]
            if kept:
                turned, turn = _on_modes(whole, part, centre)
                yield from ((replace(turned, n_kept=n, n_steps=steps), turn) for steps in _STEPS for n in kept)
            elif part is last:
                yield _turned(whole, part), part
    yield whole, every


def _on_modes(
    whole: ReducedBlock, part: NDArray[np.float64], centre: Weights
) -> tuple[ReducedBlock, NDArray[np.float64]]:
    """A part of a basis turned to its modes at the centre, in the order of their frequencies, and what turns it."""
    from scipy.linalg import eigh

    stiffness = part.T @ np.tensordot(centre.stiffness, whole.stiffness, axes=1) @ part
    mass = part.T @ np.tensordot(centre.mass, whole.masses, axes=1) @ part if len(whole.masses) else None
    turn = part @ eigh(stiffness, mass)[1]
    return _turned(whole, turn), turn


def _turned(whole: ReducedBlock, turn: NDArray[np.float64]) -> ReducedBlock:
    stiffness, masses = (turn.T @ terms @ turn for terms in (whole.stiffness, whole.masses))
    squares, beside = turn.T @ whole.squares @ turn, turn.T @ whole.beside @ turn
    parts = turn.T @ whole.parts
    return replace(whole, stiffness=stiffness, masses=masses, parts=parts, squares=squares, beside=beside)


def _is_steady(points: Sequence[Weights]) -> bool:
    """Whether all mass weights stay within a few per cent of those of the first point."""
    first = points[0].mass
    return all(np.all(np.abs(point.mass - first) <= _STEADY * np.abs(first)) for point in points)
