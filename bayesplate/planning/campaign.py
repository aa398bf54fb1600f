"""Beliefs about the boards of a campaign: each board's own constants and inputs, and shared parameters, linearised."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.board.prior import PriorCard
from bayesplate.campaign.conditional import ConditionalPosterior
from bayesplate.campaign.scatter import expected_width
from bayesplate.campaign.shared import SharedParameter
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.planning.beliefs import NO_EFFECT, Beliefs, ExplanationTerms, KnownBoard, log_moduli, station_laws
from bayesplate.planning.gains import PlannedReadings
from bayesplate.planning.laws import BareLaw, bare_law
from bayesplate.planning.stations import new_stations
from bayesplate.posterior.laplace import noise_widenings
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.target import Posterior

LINEAR_NOTE = (
    "the plan is computed to first order about each board's least-squares estimate, and peaks without a label are "
    "taken for the modes that are expected there"
)
_STEP = 1e-4
_PEAK_REACH = 0.015
"""ln of a frequency ratio up to which a peak without a label is taken for the mode that is expected there."""
_N_INFORMATIVE = 2
"""Boards for which new stations and a shorter cut are tried: those most informative about the shared parameters."""
CUT_SHARE = 0.5
"""Length of a cut board over that of the board it is like: shorter waves give way more in shear."""
_PROFILES = ("thickness_profile", "outline_profile")


def campaign_beliefs(
    boards: Sequence[Board],
    priors: Sequence[PriorCard],
    shared: Sequence[SharedParameter],
    tell: Callable[[float], None] | None = None,
) -> Beliefs:
    """Beliefs about all boards of a campaign, with shared effects declared; each board is solved once."""
    linear_boards: list[_LinearBoard] = []
    for board, prior in zip(boards, priors, strict=True):
        linear_boards.append(_linearise_board(board, prior, shared))
        if tell is not None:
            tell(len(linear_boards) / len(boards))
    beliefs = _join_boards(linear_boards, [parameter.name for parameter in shared])
    known_boards = list(beliefs.boards)
    for i in _informative_boards(known_boards):
        board, values = known_boards[i].board, known_boards[i].values
        new_laws = (
            _count_from_estimate(bare_law(board, station, values)) for station in new_stations(board, values, priors[i])
        )
        known_boards[i] = replace(known_boards[i], laws=(*known_boards[i].laws, *new_laws))
    return replace(beliefs, boards=tuple(known_boards))


def _join_boards(linear_boards: Sequence[_LinearBoard], shared: Sequence[str]) -> Beliefs:
    """Boards side by side: the own columns of each in turn, then the shared ones, whose prior is standard normal."""
    n, n_of = len(shared), len(MODULI)
    n_own = [len(linear.precision) - n for linear in linear_boards]
    starts, setups = np.cumsum([0, *n_own]), np.cumsum([0, *(len(linear.noise) for linear in linear_boards)])
    n_u = int(starts[-1]) + n
    precision, target_slopes, middle = np.zeros((n_u, n_u)), np.zeros((n + n_of * len(linear_boards), n_u)), np.zeros(n)
    precision[n_u - n :, n_u - n :] = target_slopes[:n, n_u - n :] = np.eye(n)
    known_boards = []
    for i, linear in enumerate(linear_boards):
        board, columns = linear.known_board.board, np.r_[starts[i] : starts[i + 1], n_u - n : n_u]
        precision[np.ix_(columns, columns)] += linear.precision
        log, gradient = log_moduli(board, np.log(board.symmetry.free_of(linear.known_board.values)))
        middle = np.r_[middle, log]
        target_slopes[n + n_of * i : n + n_of * (i + 1), columns] = gradient @ linear.known_board.columns
        wide = np.zeros((len(gradient.T), n_u))
        wide[:, columns] = linear.known_board.columns
        known_boards.append(replace(linear.known_board, columns=wide, first_setup=int(setups[i])))
    explanation = ExplanationTerms(
        members=(),
        words=NO_EFFECT,
        probability=1.0,
        mean=np.zeros((1, n_u)),
        covariance=np.asarray(np.linalg.inv(precision))[None],
        noise=np.concatenate([linear.noise for linear in linear_boards])[None],
        middle=middle[None],
        target_slopes=target_slopes[None],
    )
    return Beliefs(tuple(known_boards), (explanation,), tuple(shared), "campaign", (LINEAR_NOTE,))


class _LinearBoard(NamedTuple):
    """A linearised board by itself: its columns of u are its own, then the shared ones.

    The precision, (n_u, n_u) array, of its readings includes the priors of its own inputs, but not those of the shared
    parameters.
    """

    known_board: KnownBoard
    noise: Floats
    precision: Floats


def _linearise_board(board: Board, prior: PriorCard, shared: Sequence[SharedParameter]) -> _LinearBoard:
    """Solve a board and its slopes at its least-squares estimate."""
    estimate = weighted_least_squares(board)
    noise = np.array([setup.noise.median for setup in board.setups]) * noise_widenings(board, estimate.residuals)
    laws = tuple(
        _count_from_estimate(_add_peaks(law)) for law in station_laws(board, estimate.values, prior, is_elsewhere=False)
    )
    return _weigh_readings(board, prior, shared, estimate.values, noise, laws)


def _weigh_readings(
    board: Board,
    prior: PriorCard,
    shared: Sequence[SharedParameter],
    values: Values,
    noise: Floats,
    laws: tuple[BareLaw, ...],
) -> _LinearBoard:
    """A board with the precision of the readings of its laws."""
    columns = _board_columns(board, prior, shared, values, noise)
    n, n_own = board.symmetry.n, columns.shape[1] - len(shared)
    precision = np.diag(np.r_[np.zeros(n), np.ones(n_own - n), np.zeros(len(shared))])
    names = [setup.name for setup in board.setups]
    for law in laws:
        base = law.station.base
        rows = law.slopes[0, : law.station.n_old] @ columns
        variance = noise[names.index(base.name)] ** 2 + ReadingErrors.of(base).own_variance
        precision += rows.T @ (rows / variance[:, None])
    coupling = precision[:n_own, n_own:]
    shared_precision = precision[n_own:, n_own:] - coupling.T @ np.linalg.solve(precision[:n_own, :n_own], coupling)
    return _LinearBoard(KnownBoard(board, values, laws, columns, shared_precision=shared_precision), noise, precision)


def _informative_boards(boards: Sequence[KnownBoard]) -> list[int]:
    """Indices of the boards most informative about the shared parameters."""
    information = [
        0.0 if known_board.shared_precision is None else float(np.trace(known_board.shared_precision))
        for known_board in boards
    ]
    return sorted(range(len(information)), key=lambda i: -information[i])[:_N_INFORMATIVE]


def _count_from_estimate(law: BareLaw) -> BareLaw:
    """The law about the estimate, where all columns of u are zero, those of inputs and shared parameters too."""
    return replace(law, middle=law.solved[0])


def _add_peaks(law: BareLaw) -> BareLaw:
    """The law with the modes that lie closest to a peak without a label among the readings."""
    station, n_old = law.station, law.station.n_old
    peaks, further = station.base.peaks, range(n_old, len(station.setup.readings))
    if not peaks:
        return law
    misses = np.abs(np.log([peak.frequency.mean for peak in peaks]) - law.solved[0, n_old:, None])
    nearest_mode = misses.argmin(axis=0)  # of each peak, which is read once
    peak_of = {
        n_old + i: peaks[j]
        for i, j in enumerate(misses.argmin(axis=1))
        if misses[i, j] < _PEAK_REACH and nearest_mode[j] == i
    }
    order = [*range(n_old), *peak_of, *(i for i in further if i not in peak_of)]
    new = (replace(station.setup.readings[i], frequency=peak.frequency) for i, peak in peak_of.items())
    base = replace(station.base, readings=(*station.base.readings, *new))
    setup = replace(station.setup, readings=tuple(station.setup.readings[i] for i in order))
    taken = replace(station, setup=setup, base=base, n_old=n_old + len(peak_of))
    return BareLaw(taken, law.solved[:, order], law.middle[order], law.slopes[:, order], law.mass_shift_sd[:, order])


def _board_columns(
    board: Board, prior: PriorCard, shared: Sequence[SharedParameter], values: Values, noise: Floats
) -> Floats:
    """Derivatives of a board's constants and inputs by its own columns, then the shared ones: (n_fitted, n_u) array.

    Where a shared parameter scatters between boards, the deviation of the board, in expected widths, is a column of its
    own.
    """
    conditional = ConditionalPosterior(Posterior(board, prior, (), "exact", False), tuple(shared))
    fitted, own_columns = Parameters(board).fitted_columns, conditional.own_columns
    theta = Parameters(board).theta(values, noise)
    start = np.r_[theta[own_columns], conditional.z_of(theta[None, :])[0]]
    free = np.flatnonzero(np.isin(own_columns, fitted))
    steps = _STEP * np.eye(start.size)[[*free, *range(own_columns.size, start.size)]]
    above, below = (
        conditional.theta(x[:, : own_columns.size], x[:, own_columns.size :])[:, fitted]
        for x in (start + steps, start - steps)
    )
    of_own, of_shared = np.split((above - below).T / (2.0 * _STEP), [free.size], axis=1)
    width = expected_width(shared)
    scattering = np.flatnonzero(width)
    return np.column_stack([of_own, of_shared[:, scattering] * width[scattering], of_shared])


@dataclass(frozen=True, eq=False)
class FurtherBoard:
    """A further board that could be measured."""

    template: Board
    sentence: str
    labels: tuple[str, ...]  # of the modes to read
    readings: PlannedReadings  # its information about the shared parameters


def further_boards(
    beliefs: Beliefs, priors: Sequence[PriorCard], shared: Sequence[SharedParameter]
) -> Iterator[FurtherBoard]:
    """Further boards: like each that was measured, and like the two most informative ones but cut to half length."""
    for i, (known_board, prior) in enumerate(zip(beliefs.boards, priors, strict=True) if shared else ()):
        name = known_board.board.name
        labels = tuple(
            str(label) for law in known_board.laws for label in law.station.setup.labels[: law.station.n_old]
        )
        yield _further_board(beliefs, known_board, f"Measure one more board like {name}, {len(labels)} modes", labels)
        if i in _informative_boards(beliefs.boards):
            noise = beliefs.explanations[0].noise[0, known_board.first_setup, None]
            cut = _cut_board(known_board, noise, prior, shared)
            labels = tuple(map(str, cut.laws[0].station.base.labels))
            sentence = f"Measure one more board half as long as {name}, its {len(labels)} lowest modes"
            yield _further_board(beliefs, cut, sentence, labels)


def _further_board(beliefs: Beliefs, known_board: KnownBoard, sentence: str, labels: tuple[str, ...]) -> FurtherBoard:
    """A further board, with its information about the shared parameters as readings of noise one."""
    assert known_board.shared_precision is not None
    values, directions = np.linalg.eigh(known_board.shared_precision)
    slopes = np.zeros((1, len(values), beliefs.explanations[0].mean.shape[1]))
    slopes[0, :, -len(values) :] = (directions * np.sqrt(np.maximum(values, 0.0))).T
    readings = PlannedReadings((np.zeros((1, len(values))),), (slopes,), (np.ones((1, len(values))),))
    return FurtherBoard(known_board.board, sentence, labels, readings)


def _cut_board(
    known_board: KnownBoard, noise: Floats, prior: PriorCard, shared: Sequence[SharedParameter]
) -> KnownBoard:
    """A board of the same material and width but half as long, no profiles.

    As many of its lowest modes are read as the first setup of the board has readings, as far as they are looked at.
    """
    board = known_board.board.without(_PROFILES)
    halved = {name: board.inputs[name] for name in ("length_x", "mass") if name in board.inputs}
    cut = {
        name: replace(q, mean=CUT_SHARE * q.mean, sd=CUT_SHARE * q.sd, readings=(), at_x=(), at_y=())
        for name, q in halved.items()
    }
    attached = tuple(  # at the same fraction of the shorter board
        replace(item, places=tuple((CUT_SHARE * x, y) for x, y in item.places)) for item in board.setups[0].attached
    )
    first = replace(board.setups[0], readings=(), peaks=(), attached=attached)
    bare = replace(board.with_priors(cut), setups=(first,), effect_forms=())
    values = {name: value for name, value in known_board.values.items() if name in bare.inputs or name in RIGIDITIES}
    values |= {name: np.asarray(CUT_SHARE * float(known_board.values[name])) for name in halved}
    law = station_laws(bare, values, prior, is_elsewhere=False)[0]
    readings = law.station.setup.readings[: len(board.setups[0].readings)]
    station = replace(law.station, base=replace(law.station.base, readings=readings), n_old=len(readings))
    return _weigh_readings(bare, prior, shared, values, noise, (replace(law, station=station),)).known_board
