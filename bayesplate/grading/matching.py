"""What fitted boards are good for: limits that they meet, and partners that match them like the halves of a book."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI
from bayesplate.grading.boards import BoardRow
from bayesplate.grading.figures import FIGURES, LogFigure, box_probability, covariance_along, target_thickness, triangle

Floats = NDArray[np.float64]
Rows = NDArray[np.signedinteger]

_NEAREST = 12
"""Partners that are looked at for each board."""
_AT_ONCE = 16
"""Boards whose pairs are judged together, so that the memory hardly grows with the number of boards."""
LEAST_PROBABILITY = 0.05
"""Pairs that match with less are not proposed."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two boards, by their places, and the probability that they match."""

    first: int
    second: int
    probability: float


def proposed_pairs(log_mean: Floats, triangles: Floats, percent: Mapping[str, float]) -> tuple[Pair, ...]:
    """Pairs of boards, each board at most once, the likeliest match first.

    Two boards match if each constant of the one is that of the other within its tolerance:
    |ln(E_a / E_b)| <= ln(1 + tolerance). Their errors are taken to be independent, and those of one board's constants
    vary together as its readings tell them. The likeliest pair is taken first, then the likeliest of those that are
    left, and so on.

    Parameters
    ----------
    log_mean : (n, 7) array
        Of the names of `JOINT`.
    triangles : (n, 28) array
        Upper ones of their covariance.
    percent : dict of float
        Tolerance of each figure that has to match.

    Returns
    -------
    tuple of Pair
        Those that match with at least 5 %.
    """
    if len(log_mean) < 2 or not percent:
        return ()
    first, second, probability = _matches(log_mean, triangles, percent)
    pairs, taken = [], np.zeros(len(log_mean), dtype=bool)
    for i in np.lexsort((second, first, -probability)):
        if not taken[first[i]] and not taken[second[i]]:
            pairs.append(Pair(int(first[i]), int(second[i]), float(probability[i])))
            taken[[first[i], second[i]]] = True
    return tuple(pairs)


def _matches(log_mean: Floats, triangles: Floats, percent: Mapping[str, float]) -> tuple[Rows, Rows, Floats]:
    """All pairs that may be proposed: both boards and the probability that they match, (n_pairs,) arrays."""
    along = np.stack([FIGURES[name].direction for name in percent])
    width = np.log1p(np.array(list(percent.values())) / 100.0)
    mean = log_mean @ along.T
    variances = (covariance_along(one[None], triangles)[:, 0, 0] for one in along)
    nearest = _nearest(mean, np.stack(list(variances), axis=1), width)
    first, second = np.empty((2, nearest.size), dtype=np.int32)
    probability, n = np.empty(nearest.size), 0
    for start in range(0, len(mean), _AT_ONCE):
        one, other = _pairs_of(nearest, start, start + _AT_ONCE)
        covariance = covariance_along(along, triangles[one]) + covariance_along(along, triangles[other])
        found = box_probability(mean[one] - mean[other], covariance, -width, width)
        may_match = found >= LEAST_PROBABILITY
        some = slice(n, n := n + int(may_match.sum()))
        first[some], second[some], probability[some] = one[may_match], other[may_match], found[may_match]
    return first[:n], second[:n], probability[:n]


def _pairs_of(nearest: Rows, start: int, end: int) -> tuple[Rows, Rows]:
    """The pairs of some boards with their partners: two (n_pairs,) arrays, the first board before the second.

    Among the pairs of all boards each is there once.
    """
    own = np.arange(start, min(end, len(nearest)))[:, None]
    partners = nearest[own[:, 0]]
    is_mutual = np.any(nearest[partners] == own[:, :, None], axis=2)
    row, column = np.nonzero((partners >= 0) & ((own < partners) | ~is_mutual))
    one, other = own[row, 0], partners[row, column]
    return np.minimum(one, other), np.maximum(one, other)


def _nearest(mean: Floats, variance: Floats, width: Floats) -> Rows:
    """The likeliest partners of each board if the constants were independent: (n, 12) array, -1 where there are fewer.

    Only boards that may match at all are looked at: that a figure of two of them is between two limits is no more
    probable than that it is below the upper one. Along the first figure those boards are neighbours.
    """
    from scipy.special import ndtr, ndtri

    found = np.full((len(mean), _NEAREST), -1, dtype=np.int32)
    farthest = -ndtri(LEAST_PROBABILITY)  # standard deviations beyond the width
    order = np.argsort(mean[:, 0], kind="stable")
    first = mean[order, 0]
    reach = width[0] + farthest * np.sqrt(variance[order, 0] + variance[:, 0].max())
    starts, ends = np.searchsorted(first, first - reach), np.searchsorted(first, first + reach, side="right")
    for i, own in enumerate(order):
        others = np.delete(order[starts[i] : ends[i]], i - starts[i])
        for k, limit in enumerate(width):
            far = limit + farthest * np.sqrt(variance[others, k] + variance[own, k])
            others = others[np.abs(mean[others, k] - mean[own, k]) <= far]
        apart = np.abs(mean[others] - mean[own])
        sd = np.sqrt(np.maximum(variance[others] + variance[own], 1e-24))
        within = ndtr((width - apart) / sd) - ndtr((-width - apart) / sd)
        together = np.log(np.maximum(within, 1e-300)).sum(axis=1)
        likeliest = others[np.argsort(-together, kind="stable")[:_NEAREST]]
        found[own, : len(likeliest)] = likeliest
    return found


MATCH_PERCENT = 10.0
TARGET = "target_thickness"
SHOWN = ("density", "wave_speed_x", "wave_speed_y", "radiation_ratio_x", "anisotropy")
"""Figures of makers that every grading has."""
NINETY = 1.6448536269514722
"""Half the width of a normal 90 % interval, standard deviations."""


@dataclass(frozen=True)
class GradingRequest:
    """What boards are graded by.

    Attributes
    ----------
    match_percent : dict of float
        Within how many per cent each constant of two boards has to be for them to match.
    limits : dict of (float or None, float or None)
        A specification: least and greatest value of figures by name, SI units; None where there is no limit.
    rigidity : float or None
        D_x in N m for which each board's thickness is wanted.
    """

    match_percent: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(MODULI, MATCH_PERCENT))
    limits: Mapping[str, tuple[float | None, float | None]] = field(default_factory=dict)
    rigidity: float | None = None

    @property
    def figures(self) -> dict[str, LogFigure]:
        """What is shown of each board besides its moduli, by name."""
        names = dict.fromkeys((*SHOWN, *(name for name in self.limits if name not in MODULI)))
        target = {} if self.rigidity is None else {TARGET: target_thickness(self.rigidity)}
        return {**{name: FIGURES[name] for name in names}, **target}


@dataclass(frozen=True, eq=False)
class Grading:
    """Fitted boards and what they are good for; arrays are in the order of the names.

    Attributes
    ----------
    request : GradingRequest
    names : tuple of str
    doubts : tuple of str
        Why a board's constants are not to be trusted, empty where nothing speaks against them.
    log_mean : (n, 7) array
        Of the names of `JOINT`.
    triangles : (n, 28) array of float32
        Upper ones of the covariance: for there may be very many boards, and draws do not tell more digits.
    meets : dict of (n,) array
        Probability of each limit by the name of its figure.
    meets_all : (n,) array or None
        Of all limits together; None where there is none.
    pairs : tuple of Pair
        None of them with a board in doubt.
    """

    request: GradingRequest
    names: tuple[str, ...]
    doubts: tuple[str, ...]
    log_mean: Floats
    triangles: Floats
    meets: Mapping[str, Floats]
    meets_all: Floats | None
    pairs: tuple[Pair, ...]

    def spread(self, figure: LogFigure, boards: slice | Sequence[int] = slice(None)) -> tuple[Floats, Floats, Floats]:
        """Median, and the ends of the 90 % interval of some boards, in the unit of people: (n,) arrays."""
        mean, sd = figure.log(self.log_mean[boards], self.triangles[boards])
        middle, low, high = (np.exp(mean + at * sd) / figure.per_unit for at in (0.0, -NINETY, NINETY))
        return middle, low, high

    @property
    def trusted(self) -> NDArray[np.intp]:
        """Places of the boards that are not in doubt."""
        return np.flatnonzero([not one for one in self.doubts])

    @property
    def partners(self) -> tuple[NDArray[np.int32], Floats]:
        """Place of each board's partner, -1 where it has none, and the probability that they match: (n,) arrays."""
        partner, probability = np.full(len(self.names), -1, dtype=np.int32), np.zeros(len(self.names))
        for pair in self.pairs:
            partner[[pair.first, pair.second]] = pair.second, pair.first
            probability[[pair.first, pair.second]] = pair.probability
        return partner, probability


def grade(rows: Sequence[BoardRow], request: GradingRequest) -> Grading:
    """Grade the boards that were fitted.

    Constants and density of a board are taken to be log-normal together, with the means and the covariance of the
    logarithms of its draws.

    Parameters
    ----------
    rows : sequence of BoardRow
        Fitted or not.
    """
    names: list[str] = []
    doubts: list[str] = []
    log_mean: Floats = np.empty((len(rows), 7))
    upper: Floats = np.empty((len(rows), 28), dtype=np.float32)
    for row in rows:
        if row.joint is not None:
            log_mean[len(names)] = row.joint.log_mean
            upper[len(names)] = triangle(row.joint.log_covariance)
            names.append(row.name)
            doubts.append(row.doubt)
    log_mean, upper = log_mean[: len(names)], upper[: len(names)]
    meets, meets_all = _meets(log_mean, upper, request.limits)
    graded = Grading(request, tuple(names), tuple(doubts), log_mean, upper, meets, meets_all, ())
    some = graded.trusted
    pairs = proposed_pairs(log_mean[some], upper[some], request.match_percent)
    return replace(graded, pairs=tuple(Pair(int(some[p.first]), int(some[p.second]), p.probability) for p in pairs))


def _meets(
    log_mean: Floats, triangles: Floats, limits: Mapping[str, tuple[float | None, float | None]]
) -> tuple[dict[str, Floats], Floats | None]:
    """The probability of each limit, and of all."""
    if not limits:
        return {}, None
    along = np.stack([FIGURES[name].direction for name in limits])
    offset = np.log([FIGURES[name].factor for name in limits])
    low = np.array([-np.inf if one is None else np.log(one) for one, _ in limits.values()])
    high = np.array([np.inf if one is None else np.log(one) for _, one in limits.values()])
    mean, covariance = log_mean @ along.T + offset, covariance_along(along, triangles)
    each = {
        name: box_probability(mean[:, i : i + 1], covariance[:, i : i + 1, i : i + 1], low[i : i + 1], high[i : i + 1])
        for i, name in enumerate(limits)
    }
    return each, box_probability(mean, covariance, low, high)
