"""What to measure next in a campaign: a reading on one of its boards, weighing what is shared, or one more board."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.attached import AttachedItem
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.board.prior import PriorCard
from bayesplate.campaigns.shared import Shared
from bayesplate.planning.assembled import BAND, KNOWN_NOW, MOST_BENCHES, Bench, bench_of
from bayesplate.planning.inputs_read import WEIGHED_TO, measurements
from bayesplate.planning.joint import BoardInJoint, Joint, board_in_joint, held_elsewhere
from bayesplate.planning.plan import GainEntry, ProposalEntry, SequenceEntry
from bayesplate.planning.proposals import CONSTANTS, FAINT, Costs

Floats = NDArray[np.float64]

BEST = 3
SHORT = 0.5
"""Of the length of a board that is cut for the purpose: what bends on a shorter wave gives way more in shear."""
_WITHOUT = ("thickness_profile", "outline_profile")
_CUT = 2
"""Boards of which a shorter one is looked at."""
_HELD_ELSEWHERE = 2
"""Boards that are looked at held another way: those that tell most of what is shared."""


class ToFind(NamedTuple):
    """Modes of a board, by the places of the board, of its setup, and of the modes in that setup's law."""

    board: int
    setup: int
    modes: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Reading:
    """One thing that could be measured next in a campaign.

    Attributes
    ----------
    what, board, setup, sentence : str
        See `bayesplate.planning.plan.ProposalEntry`.
    cost : float
        Minutes.
    labels : tuple of str
    rows : (n, n_u) array
    variance : (n,) array
    further : ToFind or None
        Modes that are to be looked for; None elsewhere.
    """

    what: str
    board: str
    setup: str
    sentence: str
    cost: float
    labels: tuple[str, ...]
    rows: Floats
    variance: Floats
    further: ToFind | None = None

    def excludes(self, other: Reading) -> bool:
        """Whether both are the same, or two ways to know one size better, each counted from what is known now."""
        is_size = self.what == other.what == "size"
        return self is other or (is_size and np.array_equal(self.rows, other.rows))


def joint_of(
    boards: Sequence[Board], priors: Sequence[PriorCard], shared: Sequence[Shared],
    tell: Callable[[float], None] | None = None,
) -> Joint:  # fmt: skip
    """All boards of a campaign, each solved once.

    Parameters
    ----------
    boards : sequence of Board
        The shared effects declared.
    priors : sequence of PriorCard
        One per board.
    shared : sequence of Shared
    tell : callable, optional
        Told after every board which share of them is done.
    """
    made = []
    for board, prior in zip(boards, priors, strict=True):
        made.append(board_in_joint(board, prior, shared))
        if tell is not None:
            tell(len(made) / len(boards))
    order = sorted(range(len(made)), key=lambda i: -float(np.trace(made[i].of_shared)))
    for i in order[:_HELD_ELSEWHERE]:
        made[i] = held_elsewhere(made[i], priors[i], shared)
    return Joint(tuple(made), len(shared))


def readings(
    joint: Joint, priors: Sequence[PriorCard], shared: Sequence[Shared], costs: Costs, goal: str | None
) -> tuple[Reading, ...]:
    """Everything that could be measured next, the most promising first."""
    listed = [one for i in range(len(joint.boards)) for one in _of_board(joint, i, costs, goal)]
    listed += list(_of_shared(joint, shared, costs))
    listed += list(_boards(joint, priors, shared, costs))
    ranked = sorted(((worth(joint, (one,), goal), i) for i, one in enumerate(listed)), key=lambda pair: -pair[0])
    return tuple(listed[i] for value, i in ranked if value > FAINT)


def worth(joint: Joint, some: Sequence[Reading], goal: str | None) -> float:
    """What readings are worth, nats: the mean shrinkage of what is shared, of the constants, or of one of them."""
    of_shared, of_moduli, _ = _ratios(joint, some)
    if goal in MODULI:
        return float(-np.log(of_moduli[MODULI.index(goal)]))
    wanted = of_moduli if goal == CONSTANTS or not joint.n_shared else of_shared
    return float(-np.mean(np.log(wanted)))


def _ratios(joint: Joint, some: Sequence[Reading]) -> tuple[Floats, Floats, float]:
    rows, variance = np.concatenate([one.rows for one in some]), np.concatenate([one.variance for one in some])
    return joint.ratios(rows, variance)


def _of_board(joint: Joint, place: int, costs: Costs, goal: str | None) -> Iterator[Reading]:
    """Further modes of one board, its modes again, the board held another way, and readings of its sizes."""
    one = joint.boards[place]
    name = one.board.name
    for i, law in enumerate(one.laws):
        if law.station.is_new:
            yield _elsewhere(joint, place, i, costs)
            continue
        read = one.was_read(i)
        best: list[int] = []
        for _ in range(min(BEST, int((~read).sum()))):
            left = [int(j) for j in np.flatnonzero(~read) if j not in best]
            gains = [worth(joint, (_further(joint, place, i, [*best, j], costs),), goal) for j in left]
            best.append(left[int(np.argmax(gains))])
        if best:
            yield _further(joint, place, i, sorted(best), costs)
        old = [int(j) for j in np.flatnonzero(read)]
        if old:
            again = f"Measure all {len(old)} modes of board {name} again on another day"
            cost = costs.clamping + len(old) * costs.reading
            found = _of_modes(joint, place, i, old, ("again", again, cost))
            told, variance = (each[old] for each in one.another_day(i))
            yield replace(found, rows=(1.0 - told)[:, None] * found.rows, variance=variance)
    columns = {column.removeprefix("z[").removesuffix("]"): i for i, column in enumerate(one.names)}
    for measured in measurements(one.board):
        if measured.parameter.name in columns:
            own = np.zeros((1, one.moduli.shape[1]))
            own[0, columns[measured.parameter.name]] = 1.0
            row = joint.rows(place, own, np.zeros((1, joint.n_shared)))
            words = f"{measured.sentence}, board {name}"
            cost = measured.n * costs.reading
            yield Reading("size", name, "", words, cost, (), row, np.array([1.0 / measured.precision]))


def _further(joint: Joint, place: int, setup: int, chosen: Sequence[int], costs: Costs) -> Reading:
    """Modes of a board that were not read."""
    one = joint.boards[place]
    labels = ", ".join(str(one.laws[setup].station.setup.labels[j]) for j in chosen)
    sentence = f"Measure modes {labels} of board {one.board.name} as well"
    found = _of_modes(joint, place, setup, chosen, ("modes", sentence, len(chosen) * costs.reading))
    return replace(found, further=ToFind(place, setup, tuple(chosen)))


def _elsewhere(joint: Joint, place: int, setup: int, costs: Costs) -> Reading:
    """The lowest modes of a board in a way in which it was never held."""
    one = joint.boards[place]
    station = one.laws[setup].station
    chosen = tuple(range(len(station.setup.readings)))
    labels = ", ".join(map(str, station.setup.labels))
    sentence = f"Measure board {one.board.name} {station.held}, modes {labels}"
    cost = costs.clamping + len(chosen) * costs.reading
    found = _of_modes(joint, place, setup, chosen, ("edges", sentence, cost))
    return replace(found, setup=station.setup.name, further=ToFind(place, setup, chosen))


def _of_modes(joint: Joint, place: int, setup: int, chosen: Sequence[int], told: tuple[str, str, float]) -> Reading:
    """Some modes of a board: what it is, the order to do it, and its cost."""
    one, rows = joint.boards[place], list(chosen)
    what, sentence, cost = told
    station = one.laws[setup].station
    labels = tuple(str(station.setup.labels[j]) for j in rows)
    seen = joint.rows(place, one.own[setup][rows], one.shared[setup][rows])
    variance = one.variance(setup)[rows]
    return Reading(what, one.board.name, station.base.name, sentence, cost, labels, seen, variance)


def _of_shared(joint: Joint, shared: Sequence[Shared], costs: Costs) -> Iterator[Reading]:
    """Weighing the thing that all boards carry."""
    for i, one in enumerate(shared):
        if one.effect == "attached_mass" and not one.to:
            row = np.zeros((1, joint.starts[-1] + joint.n_shared))
            row[0, joint.starts[-1] + i] = 1.0
            sd = WEIGHED_TO / one.prior.median / max(one.prior.log_sd, 1e-12)
            yield Reading("size", "", "", "Weigh what is attached to every board", costs.reading, (), row,
                          np.array([sd**2]))  # fmt: skip


def _boards(joint: Joint, priors: Sequence[PriorCard], shared: Sequence[Shared], costs: Costs) -> Iterator[Reading]:
    """One more board: like each that was measured, and like the two that tell most but cut to half their length."""
    if not shared:
        return
    listed = []
    for one in joint.boards:
        read = sum(int(one.was_read(i).sum()) for i in range(len(one.laws)))
        sentence = f"Measure one more board like {one.board.name}, {read} modes"
        labels = tuple(
            str(label)
            for i, law in enumerate(one.laws)
            for label, was_read in zip(law.station.setup.labels, one.was_read(i), strict=True)
            if was_read
        )
        listed.append(_board(joint, one, one.of_shared, sentence, labels, costs))
    yield from listed
    order = sorted(range(len(listed)), key=lambda i: -worth(joint, (listed[i],), None))
    for i in order[:_CUT]:
        other = _cut(joint.boards[i], priors[i], shared)
        labels = tuple(str(label) for label in other.laws[0].station.setup.labels[: other.laws[0].station.n_old])
        name = other.board.name
        sentence = f"Measure one more board half as long as {name}, its {len(labels)} lowest modes"
        yield _board(joint, other, other.of_shared, sentence, labels, costs)


def _board(
    joint: Joint, one: BoardInJoint, precision: Floats, sentence: str, labels: tuple[str, ...], costs: Costs
) -> Reading:
    rows = joint.of_shared(precision)
    cost = costs.board + len(labels) * costs.reading
    return Reading("board", "", one.board.setups[0].name, sentence, cost, labels, rows, np.ones(len(rows)))


def _cut(one: BoardInJoint, prior: PriorCard, shared: Sequence[Shared]) -> BoardInJoint:
    """A board of the same stuff and width but half as long, as many of its lowest modes read, without profiles."""
    board = one.board.without(_WITHOUT)
    known = {name: board.inputs[name] for name in ("length_x", "mass") if name in board.inputs}
    cut = {
        name: replace(q, mean=SHORT * q.mean, sd=SHORT * q.sd, readings=(), at_x=(), at_y=())
        for name, q in known.items()
    }
    values = {**one.values, **{name: np.asarray(SHORT * float(one.values[name])) for name in known}}
    first = replace(board.setups[0], readings=(), peaks=(), attached=_moved(board))
    bare = replace(board.with_priors(cut), setups=(first,), chosen=())
    values = {name: value for name, value in values.items() if name in bare.inputs or name in RIGIDITIES}
    empty = board_in_joint(bare, prior, shared, values)
    law = empty.laws[0]
    n = min(one.laws[0].station.n_old, len(law.station.setup.readings))
    read = replace(law, station=replace(law.station, n_old=n))
    return replace(empty, laws=(read,), noise=one.noise[:1])


def _moved(board: Board) -> tuple[AttachedItem, ...]:
    """What is attached, at the same fraction of the shorter board."""
    return tuple(
        replace(item, places=tuple((SHORT * x, y) for x, y in item.places)) for item in board.setups[0].attached
    )


def entry(joint: Joint, one: Reading, shared: Sequence[Shared], goal: str | None) -> ProposalEntry:
    """A reading as it is written."""
    gain = _gain(joint, (one,), shared, goal, one.cost)
    return ProposalEntry(one.what, one.board, one.setup, one.sentence, one.cost, one.labels, gain)


def _gain(joint: Joint, some: Sequence[Reading], shared: Sequence[Shared], goal: str | None, cost: float) -> GainEntry:
    of_shared, of_moduli, information = _ratios(joint, some)
    E_x, E_y, G_xy = (float(value) for value in of_moduli)
    value = worth(joint, some, goal)
    return GainEntry(
        E_x=E_x,
        E_y=E_y,
        G_xy=G_xy,
        constants=float(-np.mean(np.log(of_moduli))),
        constants_error=0.0,
        explanations=None,
        explanations_error=None,
        information=information,
        shared={one.name: float(value) for one, value in zip(shared, of_shared, strict=True)},
        score=value,
        score_per_minute=value / cost,
    )


def joined(
    joint: Joint, listed: Sequence[Reading], goal: str | None, longest: int = 3
) -> tuple[tuple[Reading, ...], ...]:
    """The best two and the best three together, found one by one: each goes with those found before it."""
    chosen, result = list(listed[:1]), []
    while chosen and len(chosen) < min(longest, len(listed)):
        left = [one for one in listed if not any(one.excludes(other) for other in chosen)]
        if not left:
            break
        chosen.append(max(left, key=lambda one: worth(joint, (*chosen, one), goal)))
        result.append(tuple(chosen))
    return tuple(result)


def joined_entry(joint: Joint, steps: Sequence[Reading], shared: Sequence[Shared], goal: str | None) -> SequenceEntry:
    """Readings together as they are written."""
    cost = sum(one.cost for one in steps)
    return SequenceEntry(tuple(one.sentence for one in steps), cost, _gain(joint, steps, shared, goal, cost))


def benches(joint: Joint, steps: Sequence[Reading]) -> tuple[Bench, ...]:
    """For each board of which modes are to be read, where they are expected."""
    wanted = [(one, one.further) for one in steps if one.further is not None]
    return tuple(_bench(joint, one, modes) for one, modes in wanted[:MOST_BENCHES])


def _bench(joint: Joint, reading: Reading, wanted: ToFind) -> Bench:
    from scipy.special import ndtri

    one = joint.boards[wanted.board]
    law = one.laws[wanted.setup]
    spread = np.einsum("nu,uv,nv->n", reading.rows, joint.covariance, reading.rows) + reading.variance
    ends = law.solved[0, list(wanted.modes), None] + np.sqrt(spread)[:, None] * ndtri(np.array(BAND))
    return bench_of(one.board, law, wanted.modes, ends, one.values, KNOWN_NOW, goes_on=not law.station.is_new)
