"""Residuals that all boards have in common: those of one mode, pooled over a campaign."""

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

CLEAR_BELOW = 0.05
"""Bound on the p-value of a mode, multiplied by the number of modes."""
FEWEST_POOLED_BOARDS = 2
"""Boards that must have a mode for its residuals to be pooled."""


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
    """The pooled residual of each mode that several boards have, in the order in which boards name the modes first.

    A mode is the same where the setups have one name and the same edge conditions, whatever the laboratory's first
    label. The key is the label by the first label of the first such board; with the setup where the boards' setups
    have different names, and with the letters of the edges where setups of one name have different edge conditions.
    """
    first_labels = _first_labels(summaries, boards)
    n_spare = {board: max(len(summary.modes) - boards[board].symmetry.n, 0) for board, summary in summaries.items()}
    by_mode: dict[str, dict[str, tuple[float, float]]] = {}
    for board, summary in summaries.items():
        for row in summary.modes:
            noise = float(cents(np.asarray(summary.noise[row.setup].q50)))
            by_mode.setdefault(_mode_key(row, boards[board], first_labels), {})[board] = (row.residual_cents, noise)
    return {
        key: _pool_residuals(by_board, sum(n_spare[board] for board in by_board))
        for key, by_board in by_mode.items()
        if len(by_board) >= FEWEST_POOLED_BOARDS
    }


def modes_clear_of_zero(common: Mapping[str, CommonResidual]) -> list[str]:
    """Labels of the modes with a mean clear of zero, corrected for the number of modes (Bonferroni)."""
    return [label for label, residual in common.items() if residual.p_value * len(common) < CLEAR_BELOW]


def _first_labels(summaries: Mapping[str, Summary], boards: Mapping[str, Board]) -> dict[tuple[str, str], Label]:
    """The laboratory's first label by name of a setup and letters of its edges, from the first board with these."""
    first_labels: dict[tuple[str, str], Label] = {}
    for board, summary in summaries.items():
        for row in summary.modes:
            setup = boards[board].setup(row.setup)
            first_labels.setdefault((setup.name, edge_letters(setup.edges)), setup.first_label)
    return first_labels


def _mode_key(row: ModeRow, board: Board, first_labels: Mapping[tuple[str, str], Label]) -> str:
    setup, label = board.setup(row.setup), Label.parse(row.label)
    setup_and_edges = (setup.name, edge_letters(setup.edges))
    first_label = first_labels[setup_and_edges]
    common_label = Label(label.m - setup.first_label.m + first_label.m, label.n - setup.first_label.n + first_label.n)
    has_names = len({name for name, _ in first_labels}) > 1
    is_held_in_several = len([name for name, _ in first_labels if name == setup.name]) > 1
    words = [
        word for word, is_needed in zip(setup_and_edges, (has_names, is_held_in_several), strict=True) if is_needed
    ]
    return " ".join([*words, str(common_label)])


def _pool_residuals(by_board: Mapping[str, tuple[float, float]], n_spare: int) -> CommonResidual:
    """Pool the residual and the noise of each board, cents; `n_spare` residuals beyond the constants tell the noise."""
    residuals, noise = np.array(list(by_board.values())).T
    weights = noise**-2.0
    total = weights.sum()
    mean = float(weights @ residuals / total)
    scatter = float(weights @ (residuals - mean) ** 2 / total / (len(by_board) - 1))
    is_noise = 1.0 / total >= scatter
    return CommonResidual(
        mean_cents=mean,
        error_cents=float(np.sqrt(1.0 / total if is_noise else scatter)),
        degrees_of_freedom=len(by_board) - 1 + (n_spare if is_noise else 0),
        scatter_cents=float(np.std(residuals, ddof=1)),
        boards={board: residual for board, (residual, _) in by_board.items()},
    )
