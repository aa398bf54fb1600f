"""The page of a campaign: shared numbers and the boards that teach them, boards side by side, common residuals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.board.material import MODULI
from bayesplate.board.parameter import display_unit
from bayesplate.campaign.common import CommonResidual, modes_clear_of_zero
from bayesplate.campaign.diagnosis import CampaignDiagnosis, campaign_claim_sentence
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
from bayesplate.report.page import render_page, save_page
from bayesplate.report.saving import matplotlib_defaults
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREY,
    LIGHT,
    ORANGE,
    ROW_HEIGHT,
    SKY,
    VERMILLION,
    Picture,
    draw_heading,
    draw_legend,
    draw_whisker,
    drawable_text,
    legend_entry,
    mathtext,
    name_rows,
    panel_with_rows,
    shorten,
    stacked_panels,
)
from bayesplate.results.contract import Spread
from bayesplate.results.folder import PAGE_FILE
from bayesplate.results.words import GPA, interval, plus_minus

_LEFT = 1.25
_LONGEST = 16


def shared_picture(summary: CampaignSummary, name: str) -> Picture:
    """A shared number: from each board alone, from the other boards, and from all boards."""
    shared = summary.shared[name]
    factor = display_unit(shared.all_boards.unit)[0]
    boards = list(shared.own)
    figure, panel = panel_with_rows(_short_names(boards), left=_LEFT, bottom=0.95)
    low, middle, high = _interval_ends(shared.all_boards, factor)
    panel.axvspan(low, high, color=LIGHT, label="all boards, 90 %")
    panel.axvline(middle, color=BLUE, lw=1.4, label="all boards, median")
    alone_style, refusing_style, others_style = (BLUE, "o"), (VERMILLION, "s"), (GREY, "D")
    is_refusing = [summary.left_out_boards[board].refuses for board in boards]
    for row, board in enumerate(boards):
        draw_whisker(
            panel,
            row - 0.14,
            _interval_ends(shared.own[board], factor),
            *(refusing_style if is_refusing[row] else alone_style),
        )
        draw_whisker(panel, row + 0.18, _interval_ends(shared.others[board], factor), *others_style, mfc="white")
    title = shared_name(name, shared)
    panel.set(xlabel=mathtext(title))
    entries = [
        legend_entry("the board alone, 90 %", *alone_style),
        legend_entry("the others, 90 %", *others_style, mfc="white"),
    ]
    draw_legend(
        figure,
        2,
        *entries,
        *([legend_entry("disagrees with what they teach", *refusing_style)] if any(is_refusing) else []),
    )
    details = "; ".join(f"{board} {plus_minus(spread, factor)}" for board, spread in shared.own.items())
    alt = (
        f"From all boards {plus_minus(shared.all_boards, factor)}, 90 % {interval(shared.all_boards, factor)}. "
        f"{details}."
    )
    caption = (
        "Each board by itself, and below it what all the others say. A board whose bar stands clear of the others' "
        "disagrees with their value."
    )
    if shared.scatter is not None:
        caption += " Boards differ here: the grey band is where their median lies, not each of them."
    stem = "".join(letter if letter.isalnum() else "-" for letter in name)
    return Picture(f"shared-{stem}", title, alt, caption, figure)


def boards_picture(summary: CampaignSummary) -> Picture:
    """The constants of all boards, with the interval of the next board where there is a population."""
    boards = list(summary.boards)
    figure, panels = stacked_panels([ROW_HEIGHT * len(boards) + 0.1] * 3, left=_LEFT, top=0.3, bottom=0.8, gap=0.62)
    for panel, name in zip(panels, MODULI, strict=True):
        name_rows(panel, _short_names(boards))
        if summary.population is not None:
            low, _, high = _interval_ends(summary.population.next_board[name], GPA)
            panel.axvspan(low, high, color=LIGHT, label="the next board, 90 %")
        for row, board in enumerate(boards):
            draw_whisker(panel, row, _interval_ends(summary.boards[board].elastic[name], GPA), BLUE)
        isotropic = all(board.model.isotropic for board in summary.boards.values())
        draw_heading(panel, modulus_title(name, isotropic=isotropic))
        panel.set(xlabel="GPa")
    draw_legend(figure, 2, legend_entry("board, 90 %", BLUE, "o"))
    details = "; ".join(f"{board} E_x {plus_minus(fit.elastic.E_x, GPA)} GPa" for board, fit in summary.boards.items())
    caption = "Every board under what all of them teach of what they share."
    return Picture("boards", "The constants of all boards", f"Three rows of bars: {details}.", caption, figure)


def common_picture(common: Mapping[str, CommonResidual]) -> Picture:
    """Common residuals by the label of the mode: each board, and the mean with its error."""
    figure, panel = panel_with_rows(list(common), left=0.75, bottom=0.95)
    clear_labels = modes_clear_of_zero(common)
    usual_style, clear_style = (BLUE, "o"), (ORANGE, "D")
    board_style: Any = {"mfc": "white", "ms": 3.5}
    for row, (label, residual) in enumerate(common.items()):
        values = list(residual.boards.values())
        panel.plot(values, [row] * len(values), "o", mec="black", mew=0.6, zorder=4, **board_style)
        ends = (
            residual.mean_cents - 2.0 * residual.error_cents,
            residual.mean_cents,
            residual.mean_cents + 2.0 * residual.error_cents,
        )
        draw_whisker(panel, row, ends, *(clear_style if label in clear_labels else usual_style), ms=7)
    panel.axvline(0, color=DARK, lw=0.8)
    panel.set(xlabel="measured above (+) or below (-) the fit, cents")
    entries = [
        legend_entry("mean ± 2 errors", *usual_style),
        legend_entry("a board", "black", "o", lw=0.0, **board_style),
    ]
    draw_legend(figure, 2, *entries, *([legend_entry("mean, clear of zero", *clear_style)] if clear_labels else []))
    details = "; ".join(
        f"{label} {residual.mean_cents:+.0f} ± {residual.error_cents:.0f}" for label, residual in common.items()
    )
    caption = (
        "What all boards have in common here is no board's own: the model lacks it on all of them, or the labels err "
        "alike. What scatters about zero is each board's own."
    )
    return Picture("common", "Left over on all boards alike", f"Means, cents: {details}.", caption, figure)


def left_out_picture(diagnosis: CampaignDiagnosis) -> Picture:
    """Each left-out board: gain in log score by the shared effect as the other boards teach it."""
    boards = list(diagnosis.left_out_boards)
    figure, panel = panel_with_rows(_short_names(boards), left=_LEFT, bottom=0.75)
    for row, left_out in enumerate(diagnosis.left_out_boards.values()):
        is_better = left_out.log_score_gain > 0
        panel.barh(row, left_out.log_score_gain, height=0.6, color=SKY if is_better else VERMILLION,
                   edgecolor="black", lw=0.6, hatch="" if is_better else "///")  # fmt: skip
    panel.axvline(0, color=DARK, lw=0.8)
    panel.set(xlabel="gain in log score, the others teaching")
    details = "; ".join(
        f"{board} {left_out.log_score_gain:+.1f}" for board, left_out in diagnosis.left_out_boards.items()
    )
    caption = (
        "To the right: the board's readings are more probable with the effect as the other boards teach it than "
        "without it. A claim asks that most bars do so, and clearly in sum."
    )
    return Picture("left-out", "Boards that were left out", f"Gains: {details}.", caption, figure)


def _short_names(names: Iterable[str]) -> list[str]:
    return [shorten(drawable_text(name), _LONGEST) for name in names]


def _interval_ends(entry: Spread, factor: float) -> tuple[float, float, float]:
    """Lower end, median and upper end of a 90 % interval."""
    return entry.q05 * factor, entry.q50 * factor, entry.q95 * factor


def campaign_pictures(summary: CampaignSummary, diagnosis: CampaignDiagnosis | None = None) -> dict[str, list[Picture]]:
    has_left_out = diagnosis is not None and bool(diagnosis.left_out_boards)
    return {
        "diagnosis": [left_out_picture(diagnosis)] if diagnosis is not None and has_left_out else [],
        "shared": [shared_picture(summary, name) for name in summary.shared],
        "boards": [boards_picture(summary)],
        "common": [common_picture(summary.common_residual)] if summary.common_residual else [],
    }


@matplotlib_defaults()
def write_campaign_report(
    folder: Path, title: str, summary: CampaignSummary, diagnosis: CampaignDiagnosis | None = None
) -> Path:
    """Write the page and its figures as PNG and SVG into a folder, which is made; returns the path of report.html."""
    shared = summary.shared
    return save_page(
        folder / PAGE_FILE,
        campaign_pictures(summary, diagnosis),
        lambda pictures: render_page(
            "campaign.html",
            title=title or summary.name,
            name=summary.name,
            sentences=campaign_sentences(summary, diagnosis),
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


def campaign_sentences(summary: CampaignSummary, diagnosis: CampaignDiagnosis | None = None) -> tuple[str, ...]:
    sentences = []
    if diagnosis is not None:
        sentences += [campaign_claim_sentence(diagnosis)]
        sentences += [] if diagnosis.declared or diagnosis.conditions is None else [f"Why: {diagnosis.reason}."]
    for name, shared in summary.shared.items():
        factor, unit = display_unit(shared.all_boards.unit)
        unit = f" {unit}" * bool(unit)
        sentences.append(
            f"From {len(summary.boards)} boards: {shared_words(name)} {plus_minus(shared.all_boards, factor, unit)}, "
            f"nine times in ten {interval(shared.all_boards, factor, unit)}."
        )
        if shared.scatter is not None:
            sentences.append(f"The boards' own differ from it by {plus_minus(shared.scatter, 100.0)} %.")
    residuals = [mode.residual_cents for fit in summary.boards.values() for mode in fit.modes]
    pooled = np.sqrt(np.mean(np.square(residuals)))
    sentences.append(f"The fitted boards miss their labelled modes by {pooled:.1f} cents in all.")
    if diagnosis is not None and diagnosis.recommendation:
        sentences.append(f"What to do next: {diagnosis.recommendation}.")
    return tuple(sentences)
