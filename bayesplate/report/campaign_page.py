"""report.html of a campaign: what the boards share and who taught it, boards side by side, what is left over."""

from __future__ import annotations

from pathlib import Path

from bayesplate.board.parameter import unit_of_people
from bayesplate.campaigns.diagnosis import CampaignDiagnosis, claim_sentence
from bayesplate.campaigns.summary import CampaignSummary
from bayesplate.campaigns.tables import (
    boards_table,
    common_table,
    population_table,
    searched_tables,
    shared_name,
    shared_table,
    taught_table,
)
from bayesplate.report.campaign_figures import every_picture, pooled_rms_cents
from bayesplate.report.page import from_template, save_page
from bayesplate.report.saving import drawing
from bayesplate.results.folder import PAGE
from bayesplate.results.words import interval, plus_minus


@drawing()
def write_campaign_report(
    folder: Path, title: str, summary: CampaignSummary, diagnosis: CampaignDiagnosis | None = None
) -> Path:
    """Write the page and its figures as PNG and SVG.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    title : str
        Of the campaign; any text.
    summary : CampaignSummary
    diagnosis : CampaignDiagnosis, optional

    Returns
    -------
    Path
        Of report.html.
    """
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
    """The page in short."""
    told = []
    if diagnosis is not None:
        told += [claim_sentence(diagnosis)]
        told += [] if diagnosis.declared or diagnosis.conditions is None else [f"Why: {diagnosis.reason}."]
    for name, one in summary.shared.items():
        factor = unit_of_people(one.all_boards.unit)[0]
        told.append(
            f"{shared_name(name, one)}: {plus_minus(one.all_boards, factor)} from {len(summary.boards)} boards, nine "
            f"times in ten {interval(one.all_boards, factor)}."
        )
        if one.scatter is not None:
            told.append(f"The boards' own differ from it by {plus_minus(one.scatter, 100.0)} %.")
    told.append(f"The fitted boards miss their labelled modes by {pooled_rms_cents(summary):.1f} cents in all.")
    if diagnosis is not None and diagnosis.recommendation:
        told.append(f"What to do next: {diagnosis.recommendation}.")
    return tuple(told)
