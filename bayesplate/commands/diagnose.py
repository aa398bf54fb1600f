"""`diagnose`: residual, search, verdict, refit, and the error before and after."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.prior import PriorCard
from bayesplate.board.values import Key
from bayesplate.commands.arguments import check_arguments, integer_reader
from bayesplate.commands.campaign import Campaign, dispatch_card
from bayesplate.commands.campaign_diagnose import CampaignDiagnoseResult, diagnose_campaign
from bayesplate.commands.fitting import FIT_TIME, FitResult, Run, with_board
from bayesplate.commands.options import CARD, Effects, Force, OnProgress, Out, Report, Resume, Seed, SetupFile
from bayesplate.commands.prepare import CardSource
from bayesplate.commands.printout import Printout, show_diagnosis
from bayesplate.commands.problem import Problem, require_normal_noise
from bayesplate.diagnosis.baseline import baseline_of
from bayesplate.diagnosis.claim import Claim, effects_named_in_part, judge_claim, nested_errors_of_board
from bayesplate.diagnosis.findings import Case, FittedModel, diagnosis_of
from bayesplate.diagnosis.folds import find_carrying_modes
from bayesplate.diagnosis.joint import full_search
from bayesplate.diagnosis.known import known_fits
from bayesplate.diagnosis.null_control import CHANCE_SHARE, FALSE_ALARMS, N_SETS, force_choices, null_control
from bayesplate.diagnosis.readings import wrong_reading
from bayesplate.diagnosis.result import Diagnosis, diagnosis_json
from bayesplate.diagnosis.search import SearchResult
from bayesplate.diagnosis.sizes import refit_board
from bayesplate.diagnosis.stated import stated_claims
from bayesplate.diagnosis.verdict import Explanation, Verdict, decide_verdict, explanation_words
from bayesplate.diagnosis.words import relabelled_sentence, worse_fit_sentence
from bayesplate.errors import NotConvergedError, NotIdentifiableError
from bayesplate.estimates.leave_one_out import carrying_modes, indices_of, unite_carrying_modes
from bayesplate.files import write_text
from bayesplate.planning.bench import plan_first_line
from bayesplate.planning.explained import search_beliefs, surviving_explanations
from bayesplate.planning.proposals import BELIEFS_STREAM, Planner
from bayesplate.report.plots import DiagnosePlots
from bayesplate.results.contract import json_text
from bayesplate.results.folder import BEFORE_FOLDER, DIAGNOSIS_FILE, hold_output_folders
from bayesplate.results.summary import Summary
from bayesplate.streams import random_stream

FEWEST_NULL_SETS = math.ceil(1.0 / min(CHANCE_SHARE, FALSE_ALARMS)) - 1
"""Fewest simulated boards n with 1 / (n + 1), the chance of the board at hand to be first, within both levels."""
_NULL_STREAM = 7
_MOST_FINALISTS = 3
_SEARCH_TIME, _KNOWN_TIME, _CONTROL_TIME, _CHOICE_TIME = 3.0, 0.5, 0.5, 0.5
"""Times of the stages, relative to FIT_TIME, for the time that is left."""


@dataclass(frozen=True, eq=False, repr=False)
class DiagnoseResult:
    """Result of `diagnose` for a board.

    Attributes
    ----------
    folder : Path or None
        Where its files are; None if none were asked for.
    diagnosis : Diagnosis
    before, after : FitResult
        The fits without the added effect and with it; the same where none was added.
    """

    folder: Path | None
    diagnosis: Diagnosis
    before: FitResult
    after: FitResult

    @property
    def summary(self) -> Summary:
        """The summary of the model that the diagnosis ends with."""
        return self.after.summary

    @cached_property
    def plot(self) -> DiagnosePlots:
        """The figures: `result.plot.signatures()`."""
        after = self.after
        return DiagnosePlots(after.draws, after.summary, self.diagnosis)

    def to_arviz(self) -> Any:
        """The draws of the model that the diagnosis ends with, as of `bayesplate.FitResult.to_arviz`."""
        return self.after.to_arviz()

    def to_json(self) -> dict[str, Any]:
        """The content of diagnosis.json."""
        return diagnosis_json(self.diagnosis)

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_diagnosis(self.diagnosis, self.summary.identifiability)

    def __repr__(self) -> str:
        return repr(self.diagnosis).replace("<Diagnosis", "<DiagnoseResult", 1)

    def _repr_html_(self) -> str:
        return self.diagnosis._repr_html_()


@hold_output_folders()
@check_arguments()
def diagnose(
    card: Annotated[Problem | CardSource | Campaign, CARD],
    *,
    out: Out = None,
    report: Report = True,
    seed: Seed = 1,
    effects: Effects = None,
    setup: SetupFile = None,
    force: Force = False,
    resume: Resume = False,
    n_null: Annotated[int, Key(integer_reader(FEWEST_NULL_SETS))] = N_SETS,
    progress: OnProgress = None,
) -> DiagnoseResult | CampaignDiagnoseResult:
    """Trace the residual of a fit to an effect that the model lacks, add it, and report the error before and after.

    Parameters
    ----------
    card : Problem, str, path, Board or Campaign
        A problem, the name of a shipped board or campaign card, the path of a card, or a board made in Python. Of a
        campaign what its card names as shared is judged by boards that were left out; if it names nothing, effects that
        the boards may have alike are searched for.
    out : path, optional
        Output folder, for diagnosis.json and what `fit` writes; nothing is written without it.
    report : bool
        Whether to write report.html, its figures and tables beside the numbers.
    seed : int
        Everything random follows from it.
    effects : sequence of str, optional
        Declared effects in place of the card's; they are part of the model before the search.
    setup : path, optional
        A file with a table [setup] that takes the place of the card's, key by key: what `pick` writes.
    force, resume : bool
        Replace the results in the folder, or continue an interrupted run.
    n_null : int
        Data sets of the null control at most; with fewer than 49 chance cannot be told from an effect at the two per
        cent that count as a false alarm.
    progress : callable, optional
        Called when a stage begins and after every chunk of sampling, with the share of the run that is done.

    Returns
    -------
    DiagnoseResult or CampaignDiagnoseResult
        The latter of a campaign.

    Raises
    ------
    InputError, NotIdentifiableError, NotConvergedError, CheckpointError
        As `bayesplate.fit`, of the fit without further effects; also if a problem asks for robust noise.
    """
    run = Run(seed, out, force=force, resume=resume, progress=progress)
    return dispatch_card(
        card,
        lambda problem: _diagnose_board(problem, run, n_null, report=report),
        lambda campaign: diagnose_campaign(campaign, run, report=report),
        effects=effects,
        setup=setup,
    )


def _diagnose_board(problem: Problem, run: Run, n_null: int, *, report: bool) -> DiagnoseResult:
    """Fit one board, diagnose the fit, and write the result."""
    require_normal_noise([problem])
    run.open({BEFORE_FOLDER: problem}, 2.0 * FIT_TIME + _SEARCH_TIME + _KNOWN_TIME + _CONTROL_TIME + _CHOICE_TIME)
    before = run.fit(problem, BEFORE_FOLDER, "fit without further effects", tells_failure=True)
    diagnosis, after = _diagnose_fit(problem, before, run, n_null)
    if run.folder is not None:
        path = run.folder.path
        if after is not before:
            before.write(path / BEFORE_FOLDER)
        after.write(path)
        write_text(path / DIAGNOSIS_FILE, json_text(diagnosis_json(diagnosis)))
        if report:
            after.write_page(path, diagnosis)
        run.folder.close()
    return DiagnoseResult(run.path, diagnosis, before, after)


def _diagnose_fit(problem: Problem, before: FitResult, run: Run, n_null: int) -> tuple[Diagnosis, FitResult]:
    """Search, null control, verdict and refits of a fitted board; nothing is written but checkpoints."""
    posed, stages = before.inference.problem, run.stages
    stages.begin("search for effects", _SEARCH_TIME)
    ground, search = full_search(baseline_of(posed), tell=stages.reached)
    stages.begin("effects that are known", _KNOWN_TIME)
    known_effect_fits = known_fits(posed, stages.reached)
    stages.begin("the same search on simulated boards", _CONTROL_TIME)
    control = null_control(ground, np.random.default_rng([run.seed, _NULL_STREAM]), n_null, search.log_odds)
    verdict = decide_verdict(search, control)
    folds = nested_errors_of_board(search, control, verdict.judged_index)
    finalists = verdict.refitted_explanations[:_MOST_FINALISTS]
    stages.remaining_time = FIT_TIME * len(finalists) + (_CHOICE_TIME if verdict.index else 0.0)
    refits, failures = _refit_finalists(problem, before, run, search, finalists)
    fits = {0: before, **refits}
    known_carrying = (
        carrying_modes(posed.board, fit.errors.leverages, posed.board.symmetry.moduli) for fit in known_effect_fits
    )
    fit_carrying = (fit.summary.carrying_modes for fit in fits.values())
    united_modes = unite_carrying_modes(
        find_carrying_modes(search, verdict.judged_index), *fit_carrying, *known_carrying
    )
    folds = folds and folds.without(indices_of(united_modes, posed.board))
    in_part = effects_named_in_part(search, verdict, folds)
    final_index = verdict.judged_index if (verdict.index or in_part) and verdict.judged_index in fits else 0
    after = fits[final_index]
    if verdict.index and folds is not None and folds.is_counted.any():
        stages.begin("the same search on simulated boards, made to choose", _CHOICE_TIME)
        control = force_choices(ground, control, float(folds.ratio[0]), folds.carrying_readings)
    notes = [*after.inference.problem.doubts, *failures]  # a doubt that an effect explains is none any more
    if final_index:
        effect_words = next(
            explanation_words(search, finalist) for finalist in finalists if finalist.index == final_index
        )
        sentence = relabelled_sentence(posed.board, after.inference.problem.board, effect_words)
        notes += [sentence] if sentence else []
    fitted_models = {
        index: FittedModel(index, fit.summary, fit.draws, _measured_frequencies(fit)) for index, fit in fits.items()
    }
    diagnosis = diagnosis_of(
        Case(
            result=search,
            verdict=verdict,
            control=control,
            nested_errors=folds,
            before=fitted_models[0],
            after=fitted_models[final_index],
            claim=judge_claim(search, verdict, control, folds) if final_index else Claim(),
            recommendation=advice(search, verdict, before.problem.prior, run.seed),
            known_fits=known_effect_fits,
            stated_claims=stated_claims(posed, known_effect_fits) if known_effect_fits else (),
            finalists=[
                (finalist, fitted_models[finalist.index]) for finalist in finalists if finalist.index in fitted_models
            ],
            has_slip=bool(after.inference.problem.slip_remarks),
            notes=tuple(notes),
            effects_in_part=in_part,
            carrying_modes=united_modes,
        )
    )
    return diagnosis, after


def _refit_finalists(
    problem: Problem, before: FitResult, run: Run, search: SearchResult, finalists: Sequence[Explanation]
) -> tuple[dict[int, FitResult], list[str]]:
    """The fits with the finalists among the explanations, by index, and a sentence for each that failed.

    A fit fails too if its readings look wrong under it and it misses them by more than the fit before.
    """
    fits, failures = {}, []
    for explanation in finalists:
        try:
            name = "-".join((*explanation.members, str(explanation.index)))
            stage = f"fit with {explanation_words(search, explanation)}"
            fit = run.fit(with_board(problem, refit_board(search, explanation.index)), name, stage)
            sentence = worse_fit_sentence(before.summary, fit.summary, explanation_words(search, explanation))
            if fit.inference.problem.slip_remarks and sentence:
                failures.append(sentence)
            else:
                fits[explanation.index] = fit
        except (NotIdentifiableError, NotConvergedError) as error:
            failures.append(f"the model could not be fitted again with {' and '.join(explanation.members)}: {error}")
    return fits, failures


def _measured_frequencies(fit: FitResult) -> NDArray[np.float64]:
    """Frequencies of the readings that have a label in a fit: (n_modes,) array, Hz."""
    return np.concatenate([setup.measured for setup in fit.inference.problem.board.setups])


def advice(result: SearchResult, verdict: Verdict, prior: PriorCard, seed: int) -> str:
    """What to do next: read a wrong reading again, or the first line of the plan; empty if nothing would help."""
    if verdict.word == "unexplained":
        return wrong_reading(result)
    survivors = surviving_explanations(result, [explanation.members for explanation in verdict.explanations])
    planner = Planner(search_beliefs(result, prior, random_stream(seed, BELIEFS_STREAM), survivors), seed)
    return plan_first_line(planner, planner.rank_proposals())
