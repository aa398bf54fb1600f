"""grading.html: many boards sorted by their constants, makers' figures, a specification, and pairs that match."""

from __future__ import annotations

from pathlib import Path

from bayesplate.report.grading_figures import every_grading_picture
from bayesplate.report.page import from_template, save_page
from bayesplate.report.saving import drawing
from bayesplate.results.batch_summary import BatchSummary
from bayesplate.results.folder import PAGE
from bayesplate.results.grading import TARGET, Grading
from bayesplate.results.grading_table import MOST_LISTED, best_first, doubts_sentence, grading_tables, marked
from bayesplate.results.log_figures import limit_told
from bayesplate.results.pairs import LEAST_PROBABILITY
from bayesplate.results.tables import Table
from bayesplate.results.words import percent

GRADING_PAGE = "grading.html"
_TABLES = ("constants", "makers", "limits", "pairs", "doubts")


@drawing()
def write_grading_page(folder: Path, graded: Grading, summary: BatchSummary, *, has_pages: bool) -> Path:
    """Write the page and its figures as PNG and SVG.

    Parameters
    ----------
    folder : Path
        Must be there.
    graded : Grading
    summary : BatchSummary
        Of the same boards.
    has_pages : bool
        Whether each board has a page of its own in boards/NAME.

    Returns
    -------
    Path
    """
    tables: dict[str, Table | None] = {**dict.fromkeys(_TABLES), **grading_tables(graded)}
    pages = [(marked(graded, i), f"boards/{graded.names[i]}/{PAGE}") for i in best_first(graded)[:MOST_LISTED]]
    return save_page(
        folder / GRADING_PAGE,
        every_grading_picture(graded),
        lambda pictures: from_template(
            "grading.html",
            title=f"{summary.n_fitted} boards, graded",
            sentences=sentences(graded, summary),
            failures=failures_table(summary),
            pictures=pictures,
            tables=tables,
            matching=matching_sentence(graded),
            has_target=TARGET in graded.request.figures,
            links=pages if has_pages else [],
        ),
    )


def sentences(graded: Grading, summary: BatchSummary) -> tuple[str, ...]:
    """The page in short."""
    told = [f"{summary.n_fitted} of {summary.n_boards} boards were fitted."]
    if graded.meets_all is not None and graded.names:
        meets = graded.meets_all[graded.trusted]
        limits = ", ".join(limit_told(name, limit) for name, limit in graded.request.limits.items())
        n_sure, n_maybe = int((meets >= 0.9).sum()), int((meets >= 0.5).sum())
        told.append(
            f"{limits}: {n_sure} boards meet this with 90 % or more, {n_maybe} with 50 % or more; "
            f"{float(meets.sum()):.1f} are to be expected."
        )
    if graded.pairs:
        best = graded.pairs[0]
        first, second = graded.names[best.first], graded.names[best.second]
        told.append(
            f"{len(graded.pairs)} pairs are proposed; the likeliest match is {first} with {second}, "
            f"{percent(best.probability)}."
        )
    in_doubt = doubts_sentence(graded)
    return (*told, f"{in_doubt}.") if in_doubt else tuple(told)


def matching_sentence(graded: Grading) -> str:
    """When two boards match."""
    within = ", ".join(f"{name} within {value:g} %" for name, value in graded.request.match_percent.items())
    return (
        f"Two boards match where {within}, all at once. The errors of two boards are taken to be independent. The "
        f"likeliest pair is taken first, then the likeliest of the boards that are left; pairs below "
        f"{percent(LEAST_PROBABILITY)} are not proposed."
    )


def failures_table(summary: BatchSummary) -> Table | None:
    """The boards that were not fitted, with the reason; None where all were."""
    if not summary.failed:
        return None
    some = summary.failed[:MOST_LISTED]
    which = "" if len(some) == len(summary.failed) else f", the first {MOST_LISTED} of {len(summary.failed)}"
    rows = tuple((one.name, one.outcome, one.message) for one in some)
    return Table(f"Boards that were not fitted{which}", ("board", "outcome", "message"), rows)
