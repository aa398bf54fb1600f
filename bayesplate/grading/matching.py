"""Grading of fitted boards: the limits that they meet, and book-matched pairs."""

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
LEAST_MATCH_PROBABILITY = 0.05
"""Pairs with a smaller probability of matching are not proposed."""
_N_NEIGHBOURS = 12
"""Nearest boards examined as partners of each board."""
TARGET_THICKNESS = "target_thickness"
MAKERS_FIGURES = ("density", "wave_speed_x", "wave_speed_y", "radiation_ratio_x", "anisotropy")
"""Makers' figures in every grading."""
HALF_WIDTH_90 = 1.6448536269514722
"""Half the width of a normal 90 % interval, standard deviations."""


@dataclass(frozen=True)
class GradingRequest:
    """Tolerances, limits and target by which boards are graded.

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
        """Figures shown of each board besides its moduli, by name."""
        names = dict.fromkeys((*MAKERS_FIGURES, *(name for name in self.limits if name not in MODULI)))
        target = {} if self.rigidity is None else {TARGET_THICKNESS: target_thickness(self.rigidity)}
        return {**{name: FIGURES[name] for name in names}, **target}


@dataclass(frozen=True, slots=True)
class BoardPair:
    """Two boards, by their indices, and the probability that they match."""

    first: int
    second: int
    probability: float


@dataclass(frozen=True, eq=False)
class Grading:
    """Graded boards; arrays are in the order of the names.

    Attributes
    ----------
    request : GradingRequest
    names : tuple of str
    doubts : tuple of str
        Why a board's constants are not to be trusted; empty where there is no doubt.
    log_mean : (n, 7) array
        Mean of ln E_x, E_y, G_xy, D_x, D_y, D_s and density, SI.
    log_covariance : (n, 7, 7) array
    limit_probabilities : dict of (n,) array
        Probability that each limit is met, by the name of its figure.
    all_limits_probability : (n,) array or None
        Probability that all limits are met; None without limits.
    pairs : tuple of BoardPair
        None of them with a board in doubt.
    """

    request: GradingRequest
    names: tuple[str, ...]
    doubts: tuple[str, ...]
    log_mean: Floats
    log_covariance: Floats
    limit_probabilities: Mapping[str, Floats]
    all_limits_probability: Floats | None
    pairs: tuple[BoardPair, ...]

    def log(self, figure: LogFigure, boards: slice | Sequence[int] = slice(None)) -> tuple[Floats, Floats]:
        """Mean and standard deviation of the logarithm of a figure of some boards, SI: (n,) arrays."""
        return figure.log(self.log_mean[boards], self.log_covariance[boards])

    def spread(self, figure: LogFigure, boards: slice | Sequence[int] = slice(None)) -> tuple[Floats, Floats, Floats]:
        """Median and ends of the 90 % interval of some boards, in the figure's unit: (n,) arrays."""
        mean, sd = self.log(figure, boards)
        median, low, high = (
            np.exp(mean + n_sd * sd) / figure.per_unit for n_sd in (0.0, -HALF_WIDTH_90, HALF_WIDTH_90)
        )
        return median, low, high

    @property
    def trusted(self) -> NDArray[np.intp]:
        """Indices of the boards that are not in doubt."""
        return np.flatnonzero([not doubt for doubt in self.doubts])

    @property
    def partners(self) -> dict[int, tuple[int, float]]:
        """Index of each board's partner and the probability that they match, by the index of the board."""
        partners = {pair.first: (pair.second, pair.probability) for pair in self.pairs}
        return partners | {pair.second: (pair.first, pair.probability) for pair in self.pairs}


def grade(rows: Sequence[BoardRow], request: GradingRequest) -> Grading:
    """Grade fitted boards; constants and density are taken to be jointly log-normal, with the draws' log moments."""
    fitted = [(row, row.joint) for row in rows if row.joint is not None]
    log_mean = np.array([joint.log_mean for _, joint in fitted]).reshape(-1, 7)
    covariance = np.array([joint.log_covariance for _, joint in fitted]).reshape(-1, 7, 7)
    trusted = np.flatnonzero([not row.doubt for row, _ in fitted])
    limit_probabilities, all_limits_probability = _limit_probabilities(log_mean, covariance, request.limits)
    pairs = proposed_pairs(log_mean[trusted], covariance[trusted], request.match_percent)
    return Grading(
        request=request,
        names=tuple(row.name for row, _ in fitted),
        doubts=tuple(row.doubt for row, _ in fitted),
        log_mean=log_mean,
        log_covariance=covariance,
        limit_probabilities=limit_probabilities,
        all_limits_probability=all_limits_probability,
        pairs=tuple(BoardPair(int(trusted[pair.first]), int(trusted[pair.second]), pair.probability) for pair in pairs),
    )


def proposed_pairs(log_mean: Floats, covariance: Floats, percent: Mapping[str, float]) -> tuple[BoardPair, ...]:
    """Pairs of boards, each board at most once, the likeliest match first; none below a probability of 5 %.

    Two boards match if each figure of `percent` agrees within its tolerance in per cent: |ln(E_a / E_b)| <=
    ln(1 + tolerance). The errors of two boards are taken to be independent.
    """
    if len(log_mean) < 2 or not percent:
        return ()
    directions = np.stack([FIGURES[name].direction for name in percent])
    width = np.log1p(np.array(list(percent.values())) / 100.0)
    mean, covariances = log_mean @ directions.T, covariance_along(directions, covariance)
    spread = np.median(2.0 * np.diagonal(covariances, axis1=1, axis2=2), axis=0)
    points = mean / np.sqrt(width**2 + spread)
    pairs: list[BoardPair] = []
    boards, n_pairs = np.arange(len(mean)), -1
    while boards.size > 1 and len(pairs) > n_pairs:  # the nearest of a board may all have found their partners
        n_pairs = len(pairs)
        first, second = boards[_near_pairs(points[boards])]
        probability = box_probability(
            mean[first] - mean[second], covariances[first] + covariances[second], -width, width
        )
        paired: set[int] = set()
        for i in np.argsort(-probability, kind="stable"):
            pair = BoardPair(int(first[i]), int(second[i]), float(probability[i]))
            if pair.probability >= LEAST_MATCH_PROBABILITY and paired.isdisjoint((pair.first, pair.second)):
                pairs.append(pair)
                paired |= {pair.first, pair.second}
        boards = np.setdiff1d(boards, list(paired))
    return tuple(sorted(pairs, key=lambda pair: -pair.probability))


def _near_pairs(points: Floats) -> NDArray[np.intp]:
    """Indices of the boards of all pairs of which one is among the nearest of the other: (2, n_pairs) array."""
    from scipy.spatial import KDTree

    tree = KDTree(points)
    partners = tree.query(points, k=min(_N_NEIGHBOURS + 1, len(points)))[1]
    boards = np.broadcast_to(np.arange(len(points))[:, None], partners.shape)
    candidates = np.unique(np.sort(np.stack([boards.ravel(), partners.ravel()], axis=1), axis=1), axis=0)
    return np.asarray(candidates[candidates[:, 0] < candidates[:, 1]].T)


def _limit_probabilities(
    log_mean: Floats, covariance: Floats, limits: Mapping[str, tuple[float | None, float | None]]
) -> tuple[dict[str, Floats], Floats | None]:
    """Probability that each limit is met, and that all are."""
    if not limits:
        return {}, None
    directions = np.stack([FIGURES[name].direction for name in limits])
    mean = log_mean @ directions.T + np.log([FIGURES[name].factor for name in limits])
    covariances = covariance_along(directions, covariance)
    low = np.array([-np.inf if least is None else np.log(least) for least, _ in limits.values()])
    high = np.array([np.inf if greatest is None else np.log(greatest) for _, greatest in limits.values()])
    probabilities = {
        name: _joint_probability(mean, covariances, low, high, slice(i, i + 1)) for i, name in enumerate(limits)
    }
    return probabilities, _joint_probability(mean, covariances, low, high, slice(None))


def _joint_probability(mean: Floats, covariance: Floats, low: Floats, high: Floats, selection: slice) -> Floats:
    """Joint probability that the selected limits are met."""
    return box_probability(mean[:, selection], covariance[:, selection, selection], low[selection], high[selection])
