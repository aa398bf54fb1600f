"""What a command prints: its tables, its sentences, its JSON; the command line only lays them out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bayesplate.campaign.diagnosis import CampaignDiagnosis, campaign_claim_sentence
from bayesplate.campaign.summary import CampaignCheck, CampaignSummary
from bayesplate.campaign.tables import campaign_check_tables, campaign_tables, diagnosis_tables
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.diagnosis.tables import every_table
from bayesplate.diagnosis.words import alike_sentence, carrying_words, known_sentences, verdict_sentence, warnings
from bayesplate.effects.words import effect_names
from bayesplate.estimates.leave_one_out import carrying_sentence
from bayesplate.grading.boards import BatchSummary
from bayesplate.grading.matching import Grading
from bayesplate.grading.tables import MOST_ON_TERMINAL, doubts_sentence, grading_tables
from bayesplate.planning.plan import Plan
from bayesplate.planning.tables import plan_tables
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.sampling import Progress as Progress  # for the terminal, which sees the commands alone
from bayesplate.results.checking import CheckReport
from bayesplate.results.command_tables import (
    METHODS_REMARK,
    check_tables,
    forward_table,
    methods_table,
    proposal_remarks,
    sheet_tables,
)
from bayesplate.results.comparison import Comparison
from bayesplate.results.contract import json_text as json_text
from bayesplate.results.fit_tables import fitted_constants, modes_table, peaks_table
from bayesplate.results.sheets import ModesReport
from bayesplate.results.summary import Summary
from bayesplate.results.tables import Table, notebook_html, render
from bayesplate.results.words import percent, two_digits

PLAN_REMARK = (
    "the highest gain stands first: the drop of the doubt, in nats, and the mean logarithm by which the intervals "
    "shrink, or what was asked for"
)
SEEN_REMARK = "seen: residue of a mode between hammer and sensor, of the largest that its figure could give"
NOTHING_HELPS = "nothing that was looked at would help by a twentieth"


@dataclass(frozen=True)
class Printout:
    """What a command prints: tables, remarks, warnings, and a closing sentence."""

    tables: tuple[Table, ...]
    remarks: tuple[str, ...]
    warnings: tuple[str, ...]
    closing: str

    def html(self, heading: str) -> str:
        """The same for a notebook, under a heading."""
        return notebook_html(heading, (*self.remarks, *self.warnings, self.closing), self.tables)

    def printed(self, width: int, *, styled: bool) -> str:
        """The same for a terminal of `width` columns, with bold letters where `styled`."""
        sentences = (*(f"- {text}" for text in self.remarks), *(f"! {text}" for text in self.warnings), self.closing)
        blocks: tuple[Table | str, ...] = (*self.tables, *sentences)
        return "".join(render(block, "terminal", width=width, styled=styled) for block in blocks)


def show_campaign_check(report: CampaignCheck) -> Printout:
    """What `check` finds of a campaign."""
    notes = tuple(f"{name}: {note}" for name, board in report.boards.items() for note in board.notes)
    n_doubts = sum(board.n_doubts for board in report.boards.values())
    closing = f"nothing was sampled. bayesplate check tells more of each board. {_next_after_check(n_doubts)}"
    return Printout(campaign_check_tables(report), (), notes, closing)


def show_check(report: CheckReport) -> Printout:
    """What `check` finds of a board."""
    closing = f"{report.law} law; nothing was sampled. {_next_after_check(report.n_doubts)}"
    return Printout(check_tables(report), (*report.identifiability, report.invisible), report.notes, closing)


def _next_after_check(n_doubts: int) -> str:
    """What to do once a card has no fault: what is in doubt comes first, for a fit would take it as it stands."""
    fit = "bayesplate fit, with the same card and options"
    return f"Next: settle what is in doubt above; then {fit}" if n_doubts else f"Next: {fit}"


def show_fit(summary: Summary) -> Printout:
    """The summary of a fitted board."""
    peaks = peaks_table(summary)
    tables = (fitted_constants(summary), modes_table(summary), *([peaks] if peaks else []))
    error, model = summary.error, summary.model
    left_out = error.leave_one_out_rms_cents
    several = len(summary.noise) > 1
    noise = ", ".join(
        f"{percent(interval.q50, 2)}" + f" in {setup}" * several for setup, interval in summary.noise.items()
    )
    effects = f" with {effect_names(model.effects)}" if model.effects else ""
    kind = "isotropic, " if model.isotropic else ""
    closing = (
        f"{kind}{model.theory} plate{effects}, {model.law} law. Error rms "
        f"{error.in_sample_rms_cents:.1f} cents in sample, "
        + (f"{left_out:.1f} left out" if left_out is not None else summary.why_no_left_out)
        + f"; noise {noise}; the linear law is off by {two_digits(error.linearisation_rms_cents)} cents."
    )
    return Printout(tables, summary.identifiability, summary.warnings, closing)


def show_campaign_fit(summary: CampaignSummary) -> Printout:
    """The summary of a fitted campaign."""
    board_warnings = tuple(f"{name}: {note}" for name, board in summary.boards.items() for note in board.warnings)
    errors = [board.error.in_sample_rms_cents for board in summary.boards.values()]
    pooled = (sum(error**2 for error in errors) / len(errors)) ** 0.5
    closing = f"{len(errors)} boards; error rms {pooled:.1f} cents in sample, each board counted once."
    return Printout(campaign_tables(summary), (), (*summary.warnings, *board_warnings), closing)


def show_batch(summary: BatchSummary, grading: Grading) -> Printout:
    """The result of `batch`."""
    aside = tuple(f"{file} is a card of another kind and was left aside" for file in summary.aside)
    closing = f"{summary.n_fitted} of {summary.n_boards} boards fitted."
    tables = tuple(table for name, table in grading_tables(grading, MOST_ON_TERMINAL).items() if name != "makers")
    in_doubt = doubts_sentence(grading)
    return Printout(tables, aside, (in_doubt,) if in_doubt else (), closing)


def show_compare(comparison: Comparison) -> Printout:
    """The result of `compare`."""
    theories = comparison.theories
    tables = [table for theory in theories for table in (methods_table(comparison.name, theory), forward_table(theory))]
    theories_by_source: dict[str, list[str]] = {}
    for theory in theories:
        for origin in theory.coefficients:
            setup = f", setup {origin.setup}" if len(theory.coefficients) > 1 else ""
            theories_by_source.setdefault(origin.sentence, []).append(theory.theory + setup)
    remarks = [
        f"coefficients of paper and percentile ({', '.join(theory_names)}): {source}"
        for source, theory_names in theories_by_source.items()
    ]
    carrying = carrying_sentence(comparison.carrying_modes)
    last_remarks = (METHODS_REMARK, *([carrying] if carrying else []))
    return Printout(tuple(tables), (*remarks, *last_remarks), (), comparison.verdict.sentence)


def show_campaign_diagnosis(diagnosis: CampaignDiagnosis) -> Printout:
    """The diagnosis of a campaign."""
    reason = "" if diagnosis.conditions is None else f"the reason: {diagnosis.reason}"  # it closes with it otherwise
    remarks = tuple(sentence for sentence in (reason, diagnosis.recommendation) if sentence)
    closing = f"Verdict: {diagnosis.verdict}. {campaign_claim_sentence(diagnosis)}"
    return Printout(diagnosis_tables(diagnosis), remarks, diagnosis.notes, closing)


def show_diagnosis(diagnosis: Diagnosis, identifiability: Sequence[str] = ()) -> Printout:
    """The diagnosis of a board, and what the readings leave open of the model that it ends with."""
    sentences = (
        *known_sentences(diagnosis),
        carrying_words(diagnosis),
        *diagnosis.sentences,
        alike_sentence(diagnosis),
        *identifiability,
        diagnosis.recommendation,
    )
    remarks = tuple(sentence for sentence in sentences if sentence)
    return Printout(every_table(diagnosis), remarks, tuple(warnings(diagnosis)), verdict_sentence(diagnosis))


def show_modes(report: ModesReport) -> Printout:
    """The report of `modes`."""
    files = f"; sheet to print: {', '.join(report.files)}" if report.files else ""
    return Printout(sheet_tables(report), proposal_remarks(report), report.notes, f"Frequencies {report.basis}{files}")


def show_plan(plan: Plan) -> Printout:
    """The result of `plan`."""
    remarks = (PLAN_REMARK, SEEN_REMARK) if plan.bench else (PLAN_REMARK,) if plan.proposals else ()
    return Printout(plan_tables(plan), remarks, plan.notes, plan.first or NOTHING_HELPS)


def progress_text(progress: Progress, seconds: float = 0.0) -> str:
    """Where a run stands after so many seconds, in one line: the share done, the time left, and the sampling."""
    if not progress.stage:
        return _sampling_text(progress)
    share = progress.done or 0.0
    time_left = f", about {_time_words(seconds * (1.0 - share) / share)} left" if 0.0 < share < 1.0 else ""
    sampling = f"; {_sampling_text(progress)}" if progress.n_steps else ""
    return f"{100.0 * share:.0f} % done{time_left}: {progress.stage}{sampling}"


def _time_words(seconds: float) -> str:
    """A duration in seconds or minutes."""
    return f"{max(round(seconds), 1)} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"


def _sampling_text(progress: Progress) -> str:
    text = f"sampling: step {progress.n_steps} of at most {progress.max_steps}"
    if progress.n_taus is None:
        return text
    return f"{text}; {progress.n_taus:.0f} of {Gate().tau_count_min:.0f} autocorrelation times"
