"""What fitted boards are good for: figures of makers, limits that they meet, and partners that match them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI
from bayesplate.results.board_rows import BoardRow
from bayesplate.results.log_figures import FIGURES, LogFigure, covariance_along, target_thickness, triangle
from bayesplate.results.normal_box import box_probability
from bayesplate.results.pairs import Pair, proposed_pairs

Floats = NDArray[np.float64]

MATCH_PERCENT = 10.0
TARGET = "target_thickness"
SHOWN = ("density", "wave_speed_x", "wave_speed_y", "radiation_ratio_x", "anisotropy")
"""Figures of makers that every grading has."""
_NINETY = 1.6448536269514722
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
        middle, low, high = (np.exp(mean + at * sd) / figure.per_unit for at in (0.0, -_NINETY, _NINETY))
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
    request : GradingRequest

    Returns
    -------
    Grading
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
