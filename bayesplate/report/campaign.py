"""What the page of a campaign shows: what boards share and who taught it, boards side by side, what is left over."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.board.material import MODULI
from bayesplate.board.parameter import unit_of_people
from bayesplate.campaign.common import CommonResidual, clear_of_zero
from bayesplate.campaign.diagnosis import CampaignDiagnosis, claim_sentence
from bayesplate.campaign.summary import CampaignSummary
from bayesplate.campaign.tables import (
    boards_table,
    common_table,
    population_table,
    searched_tables,
    shared_name,
    shared_table,
    shared_words,
    taught_table,
)
from bayesplate.report.constants import modulus_title
from bayesplate.report.page import from_template, save_page
from bayesplate.report.saving import drawing
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREY,
    LIGHT,
    ORANGE,
    ROW,
    SKY,
    VERMILLION,
    Picture,
    drawable,
    heading,
    in_figure,
    in_rows,
    key,
    legend_below,
    name_rows,
    short,
    stacked,
    whisker,
)
from bayesplate.results.contract import Spread
from bayesplate.results.folder import PAGE
from bayesplate.results.words import GPA, interval, plus_minus

_LEFT = 1.25
_LONGEST = 16


def shared_picture(summary: CampaignSummary, name: str) -> Picture:
    """One shared number, by its name: each board alone, what the others teach it, and all boards together."""
    one = summary.shared[name]
    factor = unit_of_people(one.all_boards.unit)[0]
    boards = list(one.own)
    figure, panel = in_rows(_shown(boards), left=_LEFT, bottom=0.95)
    low, middle, high = _ends(one.all_boards, factor)
    panel.axvspan(low, high, color=LIGHT, label="all boards, 90 %")
    panel.axvline(middle, color=BLUE, lw=1.4, label="all boards, median")
    alone, refusing, others = (BLUE, "o"), (VERMILLION, "s"), (GREY, "D")
    refuses = [summary.left_out_boards[board].refuses for board in boards]
    for row, board in enumerate(boards):
        whisker(panel, row - 0.14, _ends(one.own[board], factor), *(refusing if refuses[row] else alone))
        whisker(panel, row + 0.18, _ends(one.others[board], factor), *others, mfc="white")
    title = shared_name(name, one)
    panel.set(xlabel=in_figure(title))
    keys = [key("the board alone, 90 %", *alone), key("the others, 90 %", *others, mfc="white")]
    legend_below(figure, 2, *keys, *([key("disagrees with what they teach", *refusing)] if any(refuses) else []))
    told = "; ".join(f"{board} {plus_minus(own, factor)}" for board, own in one.own.items())
    alt = f"From all boards {plus_minus(one.all_boards, factor)}, 90 % {interval(one.all_boards, factor)}. {told}."
    caption = (
        "Each board by itself, and below it what all the others say. A board whose bar stands clear of the others' "
        "disagrees with their value."
    )
    if one.scatter is not None:
        caption += " Boards differ here: the grey band is where their median lies, not each of them."
    stem = "".join(letter if letter.isalnum() else "-" for letter in name)
    return Picture(f"shared-{stem}", title, alt, caption, figure)


def boards_picture(summary: CampaignSummary) -> Picture:
    """The boards' constants below each other, with the band in which the next board would lie."""
    boards = list(summary.boards)
    figure, panels = stacked([ROW * len(boards) + 0.1] * 3, left=_LEFT, top=0.3, bottom=0.8, gap=0.62)
    for panel, name in zip(panels, MODULI, strict=True):
        name_rows(panel, _shown(boards))
        if summary.population is not None:
            low, _, high = _ends(summary.population.next_board[name], GPA)
            panel.axvspan(low, high, color=LIGHT, label="the next board, 90 %")
        for row, board in enumerate(boards):
            whisker(panel, row, _ends(summary.boards[board].elastic[name], GPA), BLUE)
        heading(panel, modulus_title(name))
        panel.set(xlabel="GPa")
    legend_below(figure, 2, key("board, 90 %", BLUE, "o"))
    told = "; ".join(f"{board} E_x {plus_minus(one.elastic.E_x, GPA)} GPa" for board, one in summary.boards.items())
    caption = "Every board under what all of them teach of what they share."
    return Picture("boards", "The constants of all boards", f"Three rows of bars: {told}.", caption, figure)


def common_picture(common: Mapping[str, CommonResidual]) -> Picture:
    """What is left over, by the label of the mode: each board, and the mean with its error."""
    figure, panel = in_rows(list(common), left=0.75, bottom=0.95)
    clear = clear_of_zero(common)
    usual, beyond = (BLUE, "o"), (ORANGE, "D")
    small: Any = {"mfc": "white", "ms": 3.5}
    for row, (label, one) in enumerate(common.items()):
        values = list(one.boards.values())
        panel.plot(values, [row] * len(values), "o", mec="black", mew=0.6, zorder=4, **small)
        ends = (one.mean_cents - 2.0 * one.error_cents, one.mean_cents, one.mean_cents + 2.0 * one.error_cents)
        whisker(panel, row, ends, *(beyond if label in clear else usual), ms=7)
    panel.axvline(0, color=DARK, lw=0.8)
    panel.set(xlabel="measured above (+) or below (-) the fit, cents")
    keys = [key("mean ± 2 errors", *usual), key("a board", "black", "o", lw=0.0, **small)]
    legend_below(figure, 2, *keys, *([key("mean, clear of zero", *beyond)] if clear else []))
    told = "; ".join(f"{label} {one.mean_cents:+.0f} ± {one.error_cents:.0f}" for label, one in common.items())
    caption = (
        "What all boards have in common here is no board's own: the model lacks it on all of them, or the labels err "
        "alike. What scatters about zero is each board's own."
    )
    return Picture("common", "Left over on all boards alike", f"Means, cents: {told}.", caption, figure)


def left_out_picture(diagnosis: CampaignDiagnosis) -> Picture:
    """Each board left out: how much better the others predict it with what they share."""
    boards = list(diagnosis.left_out_boards)
    figure, panel = in_rows(_shown(boards), left=_LEFT, bottom=0.75)
    for row, one in enumerate(diagnosis.left_out_boards.values()):
        is_better = one.log_score_gain > 0
        panel.barh(row, one.log_score_gain, height=0.6, color=SKY if is_better else VERMILLION,
                   edgecolor="black", lw=0.6, hatch="" if is_better else "///")  # fmt: skip
    panel.axvline(0, color=DARK, lw=0.8)
    panel.set(xlabel="gain in log score, the others teaching")
    told = "; ".join(f"{board} {one.log_score_gain:+.1f}" for board, one in diagnosis.left_out_boards.items())
    caption = (
        "To the right: the board's readings are more probable with the effect as the other boards teach it than "
        "without it. A claim rests on these bars alone."
    )
    return Picture("left-out", "Boards that were left out", f"Gains: {told}.", caption, figure)


def _shown(names: Iterable[str]) -> list[str]:
    return [short(drawable(name), _LONGEST) for name in names]


def _ends(entry: Spread, factor: float) -> tuple[float, float, float]:
    """Lower end, median and upper end of a 90 % interval."""
    return entry.q05 * factor, entry.q50 * factor, entry.q95 * factor


def every_picture(summary: CampaignSummary, diagnosis: CampaignDiagnosis | None = None) -> dict[str, list[Picture]]:
    told = diagnosis is not None and bool(diagnosis.left_out_boards)
    return {
        "diagnosis": [left_out_picture(diagnosis)] if diagnosis is not None and told else [],
        "shared": [shared_picture(summary, name) for name in summary.shared],
        "boards": [boards_picture(summary)],
        "common": [common_picture(summary.common_residual)] if summary.common_residual else [],
    }


@drawing()
def write_campaign_report(
    folder: Path, title: str, summary: CampaignSummary, diagnosis: CampaignDiagnosis | None = None
) -> Path:
    """Write the page and its figures as PNG and SVG into a folder, which is made; returns the path of report.html."""
    shared = summary.shared
    return save_page(
        folder / PAGE,
        every_picture(summary, diagnosis),
        lambda pictures: from_template(
            "campaign.html",
            title=title or summary.name,
            name=summary.name,
            sentences=sentences(summary, diagnosis),
            warnings=summary.warnings,
            boards=list(summary.boards),
            pictures=pictures,
            diagnosis_tables=() if diagnosis is None else searched_tables(diagnosis),
            shared_tables=(shared_table(shared), *(taught_table(summary, name) for name in shared)) if shared else (),
            boards_table=boards_table(summary),
            common_table=common_table(summary.common_residual) if summary.common_residual else None,
            population_table=None if summary.population is None else population_table(summary.population),
        ),
    )


def sentences(summary: CampaignSummary, diagnosis: CampaignDiagnosis | None = None) -> tuple[str, ...]:
    told = []
    if diagnosis is not None:
        told += [claim_sentence(diagnosis)]
        told += [] if diagnosis.declared or diagnosis.conditions is None else [f"Why: {diagnosis.reason}."]
    for name, one in summary.shared.items():
        factor, unit = unit_of_people(one.all_boards.unit)
        unit = f" {unit}" * bool(unit)
        told.append(
            f"From {len(summary.boards)} boards: {shared_words(name)} {plus_minus(one.all_boards, factor, unit)}, nine "
            f"times in ten {interval(one.all_boards, factor, unit)}."
        )
        if one.scatter is not None:
            told.append(f"The boards' own differ from it by {plus_minus(one.scatter, 100.0)} %.")
    residuals = [mode.residual_cents for one in summary.boards.values() for mode in one.modes]
    pooled = np.sqrt(np.mean(np.square(residuals)))
    told.append(f"The fitted boards miss their labelled modes by {pooled:.1f} cents in all.")
    if diagnosis is not None and diagnosis.recommendation:
        told.append(f"What to do next: {diagnosis.recommendation}.")
    return tuple(told)
