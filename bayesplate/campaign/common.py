"""What is left over on all boards alike: residuals of one mode pooled over a campaign."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayesplate.board.board import Board
from bayesplate.board.setup_keys import edge_letters
from bayesplate.frequencies.laws import cents
from bayesplate.labels import Label
from bayesplate.results.modes import ModeRow
from bayesplate.results.summary import Summary

CLEAR = 0.05
"""What the p-value of a mode, multiplied by the number of modes, has to stay below."""
FEWEST = 2
"""Boards that must have a reading before it says what they have in common."""


@dataclass(frozen=True)
class CommonResidual:
    """Residuals of one mode, measured over predicted, cents."""

    mean_cents: float  # mean of the residuals, each weighted by its board's noise
    # standard error of the mean: of the noise, or of the scatter between the boards where that is larger
    error_cents: float
    # of that error: those of the boards, and where it is of the noise those of the residuals that tell it
    degrees_of_freedom: int
    scatter_cents: float  # standard deviation between the boards
    boards: Mapping[str, float]  # each board's own

    @property
    def p_value(self) -> float:
        """How often a mode that has nothing in common would have a mean as far from zero: Student's, both sides."""
        from scipy.stats import t

        return float(2.0 * t.sf(abs(self.mean_cents) / self.error_cents, self.degrees_of_freedom))


def common_residuals(summaries: Mapping[str, Summary], boards: Mapping[str, Board]) -> dict[str, CommonResidual]:
    """Every mode that several boards have, in the order in which boards name them first.

    A mode is the same where the setups have one name and are held alike, whatever label the laboratory begins at. The
    key is the label as the first board held so counts; with the setup where the boards' setups have different names,
    and with the letters of the edges where one name stands for several ways to hold a board.
    """
    ways = _ways(summaries, boards)
    spare = {board: max(len(summary.modes) - boards[board].symmetry.n, 0) for board, summary in summaries.items()}
    found: dict[str, dict[str, tuple[float, float]]] = {}
    for board, summary in summaries.items():
        for row in summary.modes:
            noise = float(cents(np.asarray(summary.noise[row.setup].q50)))
            found.setdefault(_key(row, boards[board], ways), {})[board] = (row.residual_cents, noise)
    return {
        key: _pooled(each, sum(spare[board] for board in each)) for key, each in found.items() if len(each) >= FEWEST
    }


def clear_of_zero(common: Mapping[str, CommonResidual]) -> list[str]:
    """Labels of the modes whose mean is clear of zero, as many modes as were asked being allowed for (Bonferroni)."""
    return [label for label, one in common.items() if one.p_value * len(common) < CLEAR]


def _ways(summaries: Mapping[str, Summary], boards: Mapping[str, Board]) -> dict[tuple[str, str], Label]:
    """The first label by name of a setup and letters of its edges, of the first board that was held so."""
    found: dict[tuple[str, str], Label] = {}
    for board, summary in summaries.items():
        for row in summary.modes:
            setup = boards[board].setup(row.setup)
            found.setdefault((setup.name, edge_letters(setup.edges)), setup.first_label)
    return found


def _key(row: ModeRow, board: Board, ways: Mapping[tuple[str, str], Label]) -> str:
    setup, label = board.setup(row.setup), Label.parse(row.label)
    way = (setup.name, edge_letters(setup.edges))
    first = ways[way]
    shown = Label(label.m - setup.first_label.m + first.m, label.n - setup.first_label.n + first.n)
    has_names = len({name for name, _ in ways}) > 1
    is_held_in_several = len([name for name, _ in ways if name == setup.name]) > 1
    parts = [part for part, is_told in zip(way, (has_names, is_held_in_several), strict=True) if is_told]
    return " ".join([*parts, str(shown)])


def _pooled(each: Mapping[str, tuple[float, float]], n_spare: int) -> CommonResidual:
    """From the residual and the noise of each board, cents, and how many residuals to spare tell that noise."""
    residuals, noise = np.array(list(each.values())).T
    weights = noise**-2.0
    total = weights.sum()
    mean = float(weights @ residuals / total)
    scatter = float(weights @ (residuals - mean) ** 2 / total / (len(each) - 1))
    is_noise = 1.0 / total >= scatter
    return CommonResidual(
        mean_cents=mean,
        error_cents=float(np.sqrt(1.0 / total if is_noise else scatter)),
        degrees_of_freedom=len(each) - 1 + (n_spare if is_noise else 0),
        scatter_cents=float(np.std(residuals, ddof=1)),
        boards={board: residual for board, (residual, _) in each.items()},
    )
