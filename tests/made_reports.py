"""Quick fits whose reports tests look at, their pages with any texts in place of the card's, and words in figures."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from runs import sample_loosely

from bayesplate.board.board import Board
from bayesplate.commands.fit import fit
from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.posterior.draws import Draws
from bayesplate.report.page import fit_page, write_report
from bayesplate.results.summary import Summary

FIGURES = (
    "board", "constants", "corner", "modes", "percentiles", "predictive", "priors", "residuals", "sampler", "shares",
)  # fmt: skip
"""Of the report of a fit."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit and its card."""

    card: Board
    draws: Draws
    summary: Summary

    def write(self, folder: Path, diagnosis: Diagnosis | None = None) -> Path:
        """Its report in a folder."""
        return write_report(folder, self.card, self.draws, self.summary, diagnosis)

    def page(self, title: str = "", source: str = "", diagnosis: Diagnosis | None = None) -> str:
        """Its page without figures, with another title and source."""
        problem = self.draws.problem
        board = replace(problem.board, title=title, source=source)
        draws = replace(self.draws, inference=replace(self.draws.inference, problem=replace(problem, board=board)))
        card = replace(self.card, title=title, source=source)
        return fit_page(card, draws, self.summary, {}, diagnosis)


def fitted(card: str) -> Fit:
    """Fit a board as far as the loose gate lets it, in memory."""
    with pytest.MonkeyPatch.context() as patched:
        sample_loosely(patched)
        result = fit(card)
    return Fit(prepare(card).card, result.draws, result.summary)


def cut_off(figure: Figure, texts: Iterable[Text], margin: float = 0.0) -> list[str]:
    """Texts of a figure that reach beyond it by more than a margin, pixels."""
    figure.draw_without_rendering()
    width, height = figure.bbox.size
    found = []
    for text in texts:
        box = text.get_window_extent()
        least, most = min(box.x0, box.y0), max(box.x1 - width, box.y1 - height)
        found += [text.get_text()] if least < -margin or most > margin else []
    return found
