"""What fitted boards are good for: limits that they meet, and partners that match them like the halves of a book."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.board.material import MODULI
from bayesplate.grading.boards import BoardRow
from bayesplate.grading.figures import FIGURES, LogFigure, box_probability, covariance_along, target_thickness

MATCH_PERCENT = 10.0
LEAST_PROBABILITY = 0.05
"""Pairs that match with less are not proposed."""
_NEAREST = 12
"""Partners that are looked at for each board."""
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


@dataclass(frozen=True, slots=True)
class Pair:
    """Two boards, by their places, and the probability that they match."""

    first: int
    second: int
    probability: float


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
        Of ln E_x, E_y, G_xy, D_x, D_y, D_s and density, SI.
    log_covariance : (n, 7, 7) array
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
    log_covariance: Floats
    meets: Mapping[str, Floats]
    meets_all: Floats | None
    pairs: tuple[Pair, ...]

    def log(self, figure: LogFigure, boards: slice | Sequence[int] = slice(None)) -> tuple[Floats, Floats]:
        """Mean and standard deviation of the logarithm of a figure of some boards, SI: (n,) arrays."""
        return figure.log(self.log_mean[boards], self.log_covariance[boards])

    def spread(self, figure: LogFigure, boards: slice | Sequence[int] = slice(None)) -> tuple[Floats, Floats, Floats]:
        """Median, and the ends of the 90 % interval of some boards, in the unit of people: (n,) arrays."""
        mean, sd = self.log(figure, boards)
        middle, low, high = (np.exp(mean + at * sd) / figure.per_unit for at in (0.0, -NINETY, NINETY))
        return middle, low, high

    @property
    def trusted(self) -> NDArray[np.intp]:
        """Places of the boards that are not in doubt."""
        return np.flatnonzero([not one for one in self.doubts])

    @property
    def partners(self) -> dict[int, tuple[int, float]]:
        """Place of each board's partner and the probability that they match, by the place of the board."""
        both = {pair.first: (pair.second, pair.probability) for pair in self.pairs}
        return both | {pair.second: (pair.first, pair.probability) for pair in self.pairs}


def grade(rows: Sequence[BoardRow], request: GradingRequest) -> Grading:
    """Grade fitted boards, constants and density log-normal together with the moments of the logs of the draws."""
    fitted = [(row, row.joint) for row in rows if row.joint is not None]
    log_mean = np.array([joint.log_mean for _, joint in fitted]).reshape(-1, 7)
    covariance = np.array([joint.log_covariance for _, joint in fitted]).reshape(-1, 7, 7)
    some = np.flatnonzero([not row.doubt for row, _ in fitted])
    meets, meets_all = _meets(log_mean, covariance, request.limits)
    pairs = proposed_pairs(log_mean[some], covariance[some], request.match_percent)
    return Grading(
        request=request,
        names=tuple(row.name for row, _ in fitted),
        doubts=tuple(row.doubt for row, _ in fitted),
        log_mean=log_mean,
        log_covariance=covariance,
        meets=meets,
        meets_all=meets_all,
        pairs=tuple(Pair(int(some[one.first]), int(some[one.second]), one.probability) for one in pairs),
    )


def proposed_pairs(log_mean: Floats, covariance: Floats, percent: Mapping[str, float]) -> tuple[Pair, ...]:
    """Pairs of boards, each board at most once, the likeliest match first; none that matches with less than 5 %.

    Two boards match if each figure of the one is that of the other within its tolerance, a name and per cents of
    `percent`: |ln(E_a / E_b)| <= ln(1 + tolerance). Their errors are taken to be independent.
    """
    from scipy.spatial import KDTree

    if len(log_mean) < 2 or not percent:
        return ()
    along = np.stack([FIGURES[name].direction for name in percent])
    width = np.log1p(np.array(list(percent.values())) / 100.0)
    mean, own = log_mean @ along.T, covariance_along(along, covariance)
    spread = np.median(2.0 * np.diagonal(own, axis1=1, axis2=2), axis=0)
    tree = KDTree(mean / np.sqrt(width**2 + spread))
    partners = tree.query(tree.data, k=min(_NEAREST + 1, len(mean)))[1]
    boards = np.broadcast_to(np.arange(len(mean))[:, None], partners.shape)
    both = np.unique(np.sort(np.stack([boards.ravel(), partners.ravel()], axis=1), axis=1), axis=0)
    first, second = both[both[:, 0] < both[:, 1]].T
    probability = box_probability(mean[first] - mean[second], own[first] + own[second], -width, width)
    pairs: list[Pair] = []
    taken: set[int] = set()
    for i in np.argsort(-probability, kind="stable"):
        pair = Pair(int(first[i]), int(second[i]), float(probability[i]))
        if pair.probability >= LEAST_PROBABILITY and taken.isdisjoint((pair.first, pair.second)):
            pairs.append(pair)
            taken |= {pair.first, pair.second}
    return tuple(pairs)


def _meets(
    log_mean: Floats, covariance: Floats, limits: Mapping[str, tuple[float | None, float | None]]
) -> tuple[dict[str, Floats], Floats | None]:
    """The probability of each limit, and of all."""
    if not limits:
        return {}, None
    along = np.stack([FIGURES[name].direction for name in limits])
    mean = log_mean @ along.T + np.log([FIGURES[name].factor for name in limits])
    both = covariance_along(along, covariance)
    low = np.array([-np.inf if one is None else np.log(one) for one, _ in limits.values()])
    high = np.array([np.inf if one is None else np.log(one) for _, one in limits.values()])
    each = {name: _within(mean, both, low, high, slice(i, i + 1)) for i, name in enumerate(limits)}
    return each, _within(mean, both, low, high, slice(None))


def _within(mean: Floats, covariance: Floats, low: Floats, high: Floats, some: slice) -> Floats:
    """The probability of some of the limits."""
    return box_probability(mean[:, some], covariance[:, some, some], low[some], high[some])
