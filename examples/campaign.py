"""A campaign: what six boards of one laboratory share, judged by the boards that were left out.

Six free half-tops were measured on one day with one accelerometer. Each of them alone cannot tell transverse shear from
the sensor's mass. Together they teach both, and each board is asked whether it wants what the other five teach it. The
card spruce-half-tops-shear names the same boards and shares transverse shear alone; spruce-half-tops-search names
nothing as shared, and has it searched for.

    python examples/campaign.py --out campaign --results campaign/results

prints what was found and writes it as a page, NAME.md. It goes board by board, for a quarter of an hour to an hour, and
can be resumed.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import bayesplate
from bayesplate.campaign.diagnosis import campaign_claim_sentence
from bayesplate.campaign.tables import boards_table, common_table, searched_tables, shared_table, taught_table
from bayesplate.results.tables import Table

CAMPAIGN = "spruce-half-tops"


def markdown(table: Table) -> str:
    """A table as Markdown, its title above."""
    lines = [table.columns, tuple("---" for _ in table.columns), *table.texts]
    return f"{table.title}:\n\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def page(found: bayesplate.CampaignDiagnoseResult) -> str:
    """What a diagnosis of a campaign found, as a page of the documentation."""
    diagnosis, summary = found.diagnosis, found.summary
    tables = [*searched_tables(diagnosis)]
    errors = f"{diagnosis.before.in_sample_rms_cents:.1f} cents"
    left_over = {"": diagnosis.common_residual}
    if summary.shared:
        tables += [shared_table(summary.shared), *(taught_table(summary, name) for name in summary.shared)]
        errors += f" without what is shared, {diagnosis.after.in_sample_rms_cents:.1f} with it"
        left_over = {
            ", before what they share": diagnosis.common_residual_before,
            ", after what they share": diagnosis.common_residual,
        }
    tables.append(boards_table(summary))
    parts = [
        f"# {found.after.campaign.card.title or summary.name}",
        "Written by `examples/campaign.py`; do not edit.",
        campaign_claim_sentence(diagnosis),
        f"Error of all labelled modes, each board's constants fitted: {errors}.",
        *(markdown(one) for one in tables),
    ]
    for words, common in left_over.items():
        left = replace(common_table(common), title="Measured over predicted, cents")
        parts += [f"## What is left over on all boards alike{words}", markdown(left)]
    parts += [f"- {warning}" for warning in summary.warnings]
    parts += [f"What to do next: {diagnosis.recommendation}."] if diagnosis.recommendation else []
    return "\n\n".join(part.rstrip() for part in parts) + "\n"


def main() -> None:
    """Diagnose the campaign, print the page, and write it where told."""
    parser = argparse.ArgumentParser(description="What six boards share.")
    parser.add_argument("card", nargs="?", default=CAMPAIGN, help="card of a campaign (default: the shipped one)")
    parser.add_argument("--out", type=Path, help="folder for the page, NAME.md")
    parser.add_argument("--results", type=Path, help="folder for the results of the run")
    parser.add_argument("--resume", action="store_true", help="continue an interrupted run of --results")
    arguments = parser.parse_args()
    results = arguments.results
    if arguments.resume and results is None:
        parser.error("--resume needs --results, the folder of the run to go on with")
    found = bayesplate.diagnose(
        arguments.card,
        out=results,
        resume=arguments.resume,
        force=results is not None and not arguments.resume,
    )
    text = page(found)
    print(text)
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
        (arguments.out / f"{found.summary.name}.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
