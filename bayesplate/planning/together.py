"""Boards of a campaign as one belief: each board's own constants and inputs, and what all share, to first order."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.board.prior import PriorCard
from bayesplate.campaign.given import GivenShared
from bayesplate.campaign.scatter import expected_width
from bayesplate.campaign.shared import Shared
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.planning.beliefs import NOTHING_LACKS, Belief, Beliefs, KnownBoard, laws_of, log_moduli
from bayesplate.planning.gains import Readings
from bayesplate.planning.laws import BareLaw, bare_law
from bayesplate.planning.stations import new_stations
from bayesplate.posterior.laplace import noise_widenings
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.target import Posterior

LINEAR = (
    "the plan is computed to first order about each board's least-squares estimate, and peaks without a label are "
    "taken for the modes that are expected there"
)
_STEP = 1e-4
_A_PEAK_IS = 0.015
"""ln of a frequency ratio up to which a peak without a label is taken for the mode that is expected there."""
_TELLING = 2
"""Boards that are looked at held another way, and cut shorter: those that tell most of what is shared."""
SHORT = 0.5
"""Of the length of a board that is cut for the purpose: what bends on a shorter wave gives way more in shear."""
_WITHOUT = ("thickness_profile", "outline_profile")


def beliefs_together(
    boards: Sequence[Board],
    priors: Sequence[PriorCard],
    shared: Sequence[Shared],
    tell: Callable[[float], None] | None = None,
) -> Beliefs:
    """What is believed of all boards of a campaign, shared effects declared, each solved once."""
    every: list[_Linear] = []
    for board, prior in zip(boards, priors, strict=True):
        every.append(_linear(board, prior, shared))
        if tell is not None:
            tell(len(every) / len(boards))
    beliefs = _joined(every, [one.name for one in shared])
    known = list(beliefs.boards)
    for i in _telling(known):
        board, values = known[i].board, known[i].values
        ways = (_from_estimate(bare_law(board, way, values)) for way in new_stations(board, values, priors[i]))
        known[i] = replace(known[i], laws=(*known[i].laws, *ways))
    return replace(beliefs, boards=tuple(known))


def _joined(every: Sequence[_Linear], shared: Sequence[str]) -> Beliefs:
    """Boards side by side: the own columns of each in turn, then the shared ones, which are standard normal before."""
    n, n_of = len(shared), len(MODULI)
    n_own = [len(one.precision) - n for one in every]
    starts, setups = np.cumsum([0, *n_own]), np.cumsum([0, *(len(one.noise) for one in every)])
    n_u = int(starts[-1]) + n
    precision, wanted, middle = np.zeros((n_u, n_u)), np.zeros((n + n_of * len(every), n_u)), np.zeros(n)
    precision[n_u - n :, n_u - n :] = wanted[:n, n_u - n :] = np.eye(n)
    known = []
    for i, one in enumerate(every):
        board, columns = one.known.board, np.r_[starts[i] : starts[i + 1], n_u - n : n_u]
        precision[np.ix_(columns, columns)] += one.precision
        log, gradient = log_moduli(board, np.log(board.symmetry.free_of(one.known.values)))
        middle = np.r_[middle, log]
        wanted[n + n_of * i : n + n_of * (i + 1), columns] = gradient @ one.known.columns
        wide = np.zeros((len(gradient.T), n_u))
        wide[:, columns] = one.known.columns
        known.append(replace(one.known, columns=wide, first_setup=int(setups[i])))
    explanation = Belief(
        members=(),
        words=NOTHING_LACKS,
        probability=1.0,
        mean=np.zeros((1, n_u)),
        covariance=np.asarray(np.linalg.inv(precision))[None],
        noise=np.concatenate([one.noise for one in every])[None],
        middle=middle[None],
        wanted=wanted[None],
    )
    return Beliefs(tuple(known), (explanation,), tuple(shared), "campaign", (LINEAR,))


class _Linear(NamedTuple):
    """A board by itself, its columns of u its own, then the shared ones; its noise; and what its readings say.

    The precision, (n_u, n_u) array, has the priors of its own inputs, but not those of what is shared.
    """

    known: KnownBoard
    noise: Floats
    precision: Floats


def _linear(board: Board, prior: PriorCard, shared: Sequence[Shared]) -> _Linear:
    """Solve a board at its least-squares estimate, and take the slopes there."""
    estimate = weighted_least_squares(board)
    noise = np.array([setup.noise.median for setup in board.setups]) * noise_widenings(board, estimate.residuals)
    laws = tuple(_from_estimate(_with_peaks(law)) for law in laws_of(board, estimate.values, prior, is_elsewhere=False))
    return _judged(board, prior, shared, estimate.values, noise, laws)


def _judged(
    board: Board, prior: PriorCard, shared: Sequence[Shared], values: Values, noise: Floats, laws: tuple[BareLaw, ...]
) -> _Linear:
    """A board with the precision that the readings of its laws give."""
    columns = _columns(board, prior, shared, values, noise)
    n, n_own = board.symmetry.n, columns.shape[1] - len(shared)
    precision = np.diag(np.r_[np.zeros(n), np.ones(n_own - n), np.zeros(len(shared))])
    names = [setup.name for setup in board.setups]
    for law in laws:
        base = law.station.base
        rows = law.slopes[0, : law.station.n_old] @ columns
        variance = noise[names.index(base.name)] ** 2 + ReadingErrors.of(base).own_variance
        precision += rows.T @ (rows / variance[:, None])
    across = precision[:n_own, n_own:]
    pull = precision[n_own:, n_own:] - across.T @ np.linalg.solve(precision[:n_own, :n_own], across)
    return _Linear(KnownBoard(board, values, laws, columns, pull=pull), noise, precision)


def _telling(boards: Sequence[KnownBoard]) -> list[int]:
    """The boards that tell most of what is shared."""
    told = [0.0 if one.pull is None else float(np.trace(one.pull)) for one in boards]
    return sorted(range(len(told)), key=lambda i: -told[i])[:_TELLING]


def _from_estimate(law: BareLaw) -> BareLaw:
    """The law counted from the estimate, where all columns of u are zero, inputs and what is shared among them."""
    return replace(law, middle=law.solved[0])


def _with_peaks(law: BareLaw) -> BareLaw:
    """The law with the modes that a peak without a label stands by among those that were read."""
    station, n_old = law.station, law.station.n_old
    peaks, further = station.base.peaks, range(n_old, len(station.setup.readings))
    if not peaks:
        return law
    misses = np.abs(np.log([one.frequency.mean for one in peaks]) - law.solved[0, n_old:, None])
    beside = {n_old + int(i): peaks[j] for i, j in enumerate(misses.argmin(axis=1)) if misses[i, j] < _A_PEAK_IS}
    order = [*range(n_old), *beside, *(i for i in further if i not in beside)]
    new = (replace(station.setup.readings[i], frequency=peak.frequency) for i, peak in beside.items())
    base = replace(station.base, readings=(*station.base.readings, *new))
    setup = replace(station.setup, readings=tuple(station.setup.readings[i] for i in order))
    taken = replace(station, setup=setup, base=base, n_old=n_old + len(beside))
    return BareLaw(taken, law.solved[:, order], law.middle[order], law.slopes[:, order], law.off_place[:, order])


def _columns(board: Board, prior: PriorCard, shared: Sequence[Shared], values: Values, noise: Floats) -> Floats:
    """What a board's own columns, then the shared ones, do to its constants and inputs: (n_fitted, n_u) array.

    Where a shared number scatters, how far the board is off it, in what is expected of boards, is one of its own.
    """
    given = GivenShared(Posterior(board, prior, (), "exact", False), tuple(shared))
    fitted, own = Parameters(board).fitted_columns, given.own_columns
    theta = Parameters(board).theta(values, noise)
    start = np.r_[theta[own], given.z_of(theta[None, :])[0]]
    free = np.flatnonzero(np.isin(own, fitted))
    steps = _STEP * np.eye(start.size)[[*free, *range(own.size, start.size)]]
    above, below = (given.theta(x[:, : own.size], x[:, own.size :])[:, fitted] for x in (start + steps, start - steps))
    of_own, of_shared = np.split((above - below).T / (2.0 * _STEP), [free.size], axis=1)
    width = expected_width(shared)
    apart = np.flatnonzero(width)
    return np.column_stack([of_own, of_shared[:, apart] * width[apart], of_shared])


@dataclass(frozen=True, eq=False)
class FurtherBoard:
    """One more board that could be measured."""

    like: Board
    sentence: str
    labels: tuple[str, ...]  # of the modes to read
    readings: Readings  # what it says of the shared parameters


def further_boards(beliefs: Beliefs, priors: Sequence[PriorCard], shared: Sequence[Shared]) -> Iterator[FurtherBoard]:
    """One more board: like each that was measured, and like the two that tell most but cut to half their length."""
    for i, (one, prior) in enumerate(zip(beliefs.boards, priors, strict=True) if shared else ()):
        name = one.board.name
        labels = tuple(str(label) for law in one.laws for label in law.station.setup.labels[: law.station.n_old])
        yield _further(beliefs, one, f"Measure one more board like {name}, {len(labels)} modes", labels)
        if i in _telling(beliefs.boards):
            noise = beliefs.explanations[0].noise[0, one.first_setup, None]
            cut = _cut(one, noise, prior, shared)
            labels = tuple(map(str, cut.laws[0].station.base.labels))
            sentence = f"Measure one more board half as long as {name}, its {len(labels)} lowest modes"
            yield _further(beliefs, cut, sentence, labels)


def _further(beliefs: Beliefs, one: KnownBoard, sentence: str, labels: tuple[str, ...]) -> FurtherBoard:
    """What a board says of the shared parameters, as readings of noise one."""
    assert one.pull is not None
    values, directions = np.linalg.eigh(one.pull)
    slopes = np.zeros((1, len(values), beliefs.explanations[0].mean.shape[1]))
    slopes[0, :, -len(values) :] = (directions * np.sqrt(np.maximum(values, 0.0))).T
    readings = Readings((np.zeros((1, len(values))),), (slopes,), (np.ones((1, len(values))),))
    return FurtherBoard(one.board, sentence, labels, readings)


def _cut(one: KnownBoard, noise: Floats, prior: PriorCard, shared: Sequence[Shared]) -> KnownBoard:
    """A board of the same stuff and width but half as long, as many of its lowest modes read, without profiles."""
    board = one.board.without(_WITHOUT)
    halved = {name: board.inputs[name] for name in ("length_x", "mass") if name in board.inputs}
    cut = {
        name: replace(q, mean=SHORT * q.mean, sd=SHORT * q.sd, readings=(), at_x=(), at_y=())
        for name, q in halved.items()
    }
    attached = tuple(  # at the same fraction of the shorter board
        replace(item, places=tuple((SHORT * x, y) for x, y in item.places)) for item in board.setups[0].attached
    )
    first = replace(board.setups[0], readings=(), peaks=(), attached=attached)
    bare = replace(board.with_priors(cut), setups=(first,), chosen=())
    values = {name: value for name, value in one.values.items() if name in bare.inputs or name in RIGIDITIES}
    values |= {name: np.asarray(SHORT * float(one.values[name])) for name in halved}
    law = laws_of(bare, values, prior, is_elsewhere=False)[0]
    read = law.station.setup.readings[: len(board.setups[0].readings)]
    station = replace(law.station, base=replace(law.station.base, readings=read), n_old=len(read))
    return _judged(bare, prior, shared, values, noise, (replace(law, station=station),)).known
