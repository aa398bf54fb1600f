"""Figures of a campaign: shared numbers and who taught them, boards side by side, what is common, boards left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.campaigns.common import CommonResidual, clear_of_zero
from bayesplate.campaigns.diagnosis import CampaignDiagnosis
from bayesplate.campaigns.summary import CampaignSummary
from bayesplate.campaigns.tables import shared_name
from bayesplate.plate.material import MODULI
from bayesplate.plate.parameter import unit_of_people
from bayesplate.report.constants import modulus_title
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREY,
    LIGHT,
    ORANGE,
    SKY,
    SMALL,
    VERMILLION,
    WORDS,
    Picture,
    drawable,
    legend_below,
    short,
    stacked,
)
from bayesplate.report.symbols import in_figure
from bayesplate.results.contract import Spread
from bayesplate.results.words import GPA, interval, plus_minus

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROW = 0.235
_LEFT = 1.25
_LONGEST = 16


def shared_picture(summary: CampaignSummary, name: str) -> Picture:
    """One shared number: each board alone, what the others teach it, and all boards together.

    Parameters
    ----------
    summary : CampaignSummary
    name : str
        Of the number.

    Returns
    -------
    Picture
    """
    one = summary.shared[name]
    factor = unit_of_people(one.all_boards.unit)[0]
    boards = list(one.own)
    figure, (panel,) = stacked([_ROW * len(boards) + 0.1], left=_LEFT, bottom=0.95)
    _named_rows(panel, boards)
    low, high = one.all_boards.q05 * factor, one.all_boards.q95 * factor
    panel.axvspan(low, high, color=LIGHT, label="all boards, 90 %")
    panel.axvline(one.all_boards.q50 * factor, color=BLUE, lw=1.4, label="all boards, median")
    for row, board in enumerate(boards):
        left = summary.left_out_boards[board]
        color = VERMILLION if left.refuses else BLUE
        _bar(panel, row - 0.14, one.own[board], factor, color=color, marker="s" if left.refuses else "o")
        _bar(panel, row + 0.18, one.others[board], factor, color=GREY, marker="D", face="white")
    handles = panel.get_legend_handles_labels()[0]
    handles += [_handle(BLUE, "o", "the board alone, 90 %"), _handle(GREY, "D", "the others, 90 %", face="white")]
    if any(board.refuses for board in summary.left_out_boards.values()):
        handles.append(_handle(VERMILLION, "s", "does not want what they teach"))
    title = shared_name(name, one)
    panel.set_xlabel(in_figure(title), fontsize=SMALL)
    legend_below(figure, handles, 2)
    told = "; ".join(f"{board} {plus_minus(own, factor)}" for board, own in one.own.items())
    alt = f"From all boards {plus_minus(one.all_boards, factor)}, 90 % {interval(one.all_boards, factor)}. {told}."
    caption = (
        "Each board by itself, and below it what all the others say. A board whose bar stands clear of the others' "
        "does not want their value."
    )
    if one.scatter is not None:
        caption += " Boards differ here: the grey band is where their median lies, not each of them."
    stem = "".join(letter if letter.isalnum() else "-" for letter in name)
    return Picture(f"shared-{stem}", title, alt, caption, figure)


def boards_picture(summary: CampaignSummary) -> Picture:
    """The boards' constants below each other, with the band in which the next board would lie."""
    boards = list(summary.boards)
    figure, panels = stacked([_ROW * len(boards) + 0.1] * 3, left=_LEFT, top=0.3, bottom=0.8, gap=0.62)
    for panel, name in zip(panels, MODULI, strict=True):
        _named_rows(panel, boards)
        if summary.population is not None:
            entry = summary.population.next_board[name]
            panel.axvspan(entry.q05 * GPA, entry.q95 * GPA, color=LIGHT, label="the next board, 90 %")
        for row, board in enumerate(boards):
            _bar(panel, row, summary.boards[board].elastic[name], GPA, color=BLUE, marker="o")
        panel.set_title(modulus_title(name), fontsize=WORDS, loc="left", weight="bold")
        panel.set_xlabel("GPa", fontsize=SMALL)
    handles = [*panels[0].get_legend_handles_labels()[0], _handle(BLUE, "o", "board, 90 %")]
    legend_below(figure, handles, 2)
    told = "; ".join(f"{board} E_x {plus_minus(one.elastic.E_x, GPA)} GPa" for board, one in summary.boards.items())
    caption = "Every board under what all of them teach of what they share."
    return Picture("boards", "The constants of all boards", f"Three rows of bars: {told}.", caption, figure)


def common_picture(common: Mapping[str, CommonResidual]) -> Picture:
    """What is left over, mode by mode: each board, and the mean with its error.

    Parameters
    ----------
    common : dict of CommonResidual
        By label.
    """
    labels = list(common)
    figure, (panel,) = stacked([_ROW * len(labels) + 0.1], left=0.75, bottom=0.95)
    _named_rows(panel, labels)
    clear = clear_of_zero(common)
    for row, (label, one) in enumerate(common.items()):
        values = list(one.boards.values())
        panel.plot(values, [row] * len(values), "o", mfc="white", mec="black", mew=0.6, ms=3.5, zorder=4)
        color = ORANGE if label in clear else BLUE
        ends = (one.mean_cents - 2.0 * one.error_cents, one.mean_cents + 2.0 * one.error_cents)
        panel.hlines(row, *ends, color=color, lw=3)
        panel.plot(one.mean_cents, row, "D" if color == ORANGE else "o", color=color, mec="black", mew=0.6, ms=7)
    panel.axvline(0, color=DARK, lw=0.8)
    panel.set_xlabel("measured above (+) or below (-) the fit, cents", fontsize=SMALL)
    handles = [_handle(BLUE, "o", "mean ± 2 errors"), _handle("black", "o", "a board", face="white", lw=0.0)]
    if clear:
        handles.append(_handle(ORANGE, "D", "mean, clear of zero"))
    legend_below(figure, handles, 2)
    told = "; ".join(f"{label} {one.mean_cents:+.0f} ± {one.error_cents:.0f}" for label, one in common.items())
    caption = (
        "What all boards have in common here is no board's own: the model lacks it on all of them, or the labels err "
        "alike. What scatters about zero is each board's own."
    )
    return Picture("common", "Left over on all boards alike", f"Means, cents: {told}.", caption, figure)


def left_out_picture(diagnosis: CampaignDiagnosis) -> Picture:
    """Each board left out: how much better the others predict it with what they share."""
    boards = list(diagnosis.left_out_boards)
    figure, (panel,) = stacked([_ROW * len(boards) + 0.1], left=_LEFT, bottom=0.75)
    _named_rows(panel, boards)
    for row, one in enumerate(diagnosis.left_out_boards.values()):
        is_better = one.log_score_gain > 0
        panel.barh(row, one.log_score_gain, height=0.6, color=SKY if is_better else VERMILLION,
                   edgecolor="black", lw=0.6, hatch="" if is_better else "///")  # fmt: skip
    panel.axvline(0, color=DARK, lw=0.8)
    panel.set_xlabel("gain in log score, the others teaching", fontsize=SMALL)
    told = "; ".join(f"{board} {one.log_score_gain:+.1f}" for board, one in diagnosis.left_out_boards.items())
    caption = (
        "To the right: the board's readings are more probable with the effect as the other boards teach it than "
        "without it. A claim rests on these bars alone."
    )
    return Picture("left-out", "Boards that were left out", f"Gains: {told}.", caption, figure)


def _named_rows(panel: Axes, names: Sequence[str]) -> None:
    """A row for each name, the first on top."""
    panel.set(ylim=(len(names) - 0.5, -0.5))
    shown = [short(drawable(name), _LONGEST) for name in names]
    panel.set_yticks(range(len(names)), shown, fontsize=SMALL, parse_math=False)
    panel.tick_params(axis="y", length=0)
    panel.spines["left"].set_visible(False)
    panel.grid(axis="x", color="0.9", lw=0.6)
    panel.set_axisbelow(True)


def _bar(panel: Axes, row: float, entry: Spread, factor: float, *, color: Any, marker: str, face: str = "") -> None:
    """A 90 % interval with its median."""
    panel.hlines(row, entry.q05 * factor, entry.q95 * factor, color=color, lw=1.8)
    panel.plot(entry.q50 * factor, row, marker, color=color, mfc=face or color, mec="black", mew=0.6, ms=5)


def _handle(color: Any, marker: str, label: str, *, face: str = "", lw: float = 1.8) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], color=color, marker=marker, mfc=face or color, mec="black" if lw else color, mew=0.6, ms=5,
                  lw=lw, label=label)  # fmt: skip


def every_picture(summary: CampaignSummary, diagnosis: CampaignDiagnosis | None = None) -> dict[str, list[Picture]]:
    """The figures of the page, by the place where they stand."""
    told = diagnosis is not None and bool(diagnosis.left_out_boards)
    return {
        "diagnosis": [left_out_picture(diagnosis)] if diagnosis is not None and told else [],
        "shared": [shared_picture(summary, name) for name in summary.shared],
        "boards": [boards_picture(summary)],
        "common": [common_picture(summary.common_residual)] if summary.common_residual else [],
    }


def pooled_rms_cents(summary: CampaignSummary) -> float:
    """Error of all labelled modes of all boards, cents."""
    residuals = [mode.residual_cents for one in summary.boards.values() for mode in one.modes]
    return float(np.sqrt(np.mean(np.square(residuals))))
