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

from bayesplate.board.material import MODULI
from bayesplate.board.prior import PriorCard
from bayesplate.board.values import Key
from bayesplate.commands.arguments import checked, whole
from bayesplate.commands.campaign import Campaign, by_kind
from bayesplate.commands.campaign_diagnose import CampaignDiagnoseResult, diagnose_campaign
from bayesplate.commands.fitting import FIT, FitResult, Run, with_board
from bayesplate.commands.options import CARD, Effects, Force, OnProgress, Out, Report, Resume, Seed, SetupFile
from bayesplate.commands.prepare import Card
from bayesplate.commands.problem import Problem
from bayesplate.commands.shown import Shown, show_diagnosis
from bayesplate.diagnosis.baseline import baseline_of
from bayesplate.diagnosis.claim import Claim, judge_claim, named_in_part, nested_of
from bayesplate.diagnosis.findings import Case, Side, diagnosis_of
from bayesplate.diagnosis.folds import carrying
from bayesplate.diagnosis.joint import full_search
from bayesplate.diagnosis.known import known_fits
from bayesplate.diagnosis.null_control import BY_CHANCE, FALSE_ALARMS, N_SETS, made_to_choose, null_control
from bayesplate.diagnosis.readings import wrong_reading
from bayesplate.diagnosis.result import Diagnosis, diagnosis_json
from bayesplate.diagnosis.search import SearchResult
from bayesplate.diagnosis.sizes import refit_board
from bayesplate.diagnosis.stated import stated_claims
from bayesplate.diagnosis.verdict import Answer, Verdict, answer_words, decide
from bayesplate.diagnosis.words import relabelled_sentence
from bayesplate.errors import Fault, InputError, NotConvergedError, NotIdentifiableError
from bayesplate.estimates.leave_one_out import carrying_modes, indices_of, united
from bayesplate.files import write_text
from bayesplate.planning.bench import first_of
from bayesplate.planning.explained import believed, survivors
from bayesplate.planning.proposals import BELIEFS, Planner
from bayesplate.report.plots import DiagnosePlots
from bayesplate.results.contract import json_text
from bayesplate.results.folder import BEFORE, DIAGNOSIS, run_of_its_own
from bayesplate.results.summary import Summary
from bayesplate.streams import stream

FEWEST_NULL = math.ceil(1.0 / min(BY_CHANCE, FALSE_ALARMS)) - 1
"""Among n simulated boards the one at hand is first by chance in a share of 1 / (n + 1), which is to be that small."""
_NULL_LINE = 7
_MOST_FINALISTS = 3
_SEARCH, _KNOWN, _CONTROL, _CHOICE = 3.0, 0.5, 0.5, 0.5
"""How long the parts take beside each other, for the time that is left."""


@dataclass(frozen=True, eq=False, repr=False)
class DiagnoseResult:
    """What a diagnosis leaves.

    Attributes
    ----------
    folder : Path or None
        Where its files are; None if none were asked for.
    diagnosis : Diagnosis
    before, after : FitResult
        The same where nothing was added.
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
        """The figures: `found.plot.signatures()`."""
        after = self.after
        return DiagnosePlots(after.inference, after.draws, after.summary, self.diagnosis)

    def to_arviz(self) -> Any:
        """The draws of the model that the diagnosis ends with, as of `bayesplate.FitResult.to_arviz`."""
        return self.after.to_arviz()

    def to_json(self) -> dict[str, Any]:
        """The content of diagnosis.json."""
        return diagnosis_json(self.diagnosis)

    def shown(self) -> Shown:
        """Tables and sentences for a person."""
        return show_diagnosis(self.diagnosis)

    def __repr__(self) -> str:
        return repr(self.diagnosis).replace("<Diagnosis", "<DiagnoseResult", 1)

    def _repr_html_(self) -> str:
        return self.diagnosis._repr_html_()


@run_of_its_own()
@checked()
def diagnose(
    card: Annotated[Problem | Card | Campaign, CARD],
    *,
    out: Out = None,
    report: Report = True,
    seed: Seed = 1,
    effects: Effects = None,
    setup: SetupFile = None,
    force: Force = False,
    resume: Resume = False,
    n_null: Annotated[int, Key(whole(FEWEST_NULL))] = N_SETS,
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
        Told when a part begins and after every chunk of sampling, with the share of the whole that is done.

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
    return by_kind(
        card,
        lambda problem: _diagnose_board(problem, run, n_null, report=report),
        lambda campaign: diagnose_campaign(campaign, run, report=report),
        effects=effects,
        setup=setup,
    )


def _diagnose_board(problem: Problem, run: Run, n_null: int, *, report: bool) -> DiagnoseResult:
    """Fit one board, diagnose the fit, and write what was found."""
    if problem.robust:
        wanted = "a problem with normal noise, which the search for an effect assumes"
        raise InputError(Fault("robust", wanted, "Student's distribution"))
    run.open({BEFORE: problem}, 2.0 * FIT + _SEARCH + _KNOWN + _CONTROL + _CHOICE)
    before = run.fit(problem, BEFORE, "fit without further effects", tells_failure=True)
    diagnosis, after = _diagnosed(problem, before, run, n_null)
    if run.folder is not None:
        path = run.folder.path
        if after is not before:
            before.write(path / BEFORE)
        after.write(path)
        write_text(path / DIAGNOSIS, json_text(diagnosis_json(diagnosis)))
        if report:
            after.write_page(path, diagnosis)
        run.folder.close()
    return DiagnoseResult(run.path, diagnosis, before, after)


def _diagnosed(problem: Problem, before: FitResult, run: Run, n_null: int) -> tuple[Diagnosis, FitResult]:
    """Search, null control, verdict and refits of a fitted board; nothing is written but checkpoints."""
    posed, stages = before.inference.problem, run.stages
    stages.begin("search for effects", _SEARCH)
    ground, found = full_search(baseline_of(posed), tell=stages.reached)
    stages.begin("effects that are known", _KNOWN)
    known = known_fits(posed, stages.reached)
    stages.begin("the same search on simulated boards", _CONTROL)
    control = null_control(ground, np.random.default_rng([run.seed, _NULL_LINE]), n_null, found.against_none)
    verdict = decide(found, control)
    folded = nested_of(found, control, verdict.tried)
    in_part = named_in_part(found, verdict, folded)
    finals = verdict.fitted_again[:_MOST_FINALISTS]
    stages.left = FIT * len(finals) + (_CHOICE if verdict.index else 0.0)
    again, failures = _fitted_again(problem, run, found, finals)
    fits = {0: before, **again}
    last = verdict.tried if (verdict.index or in_part) and verdict.tried in fits else 0
    after = fits[last]
    known_carrying = (carrying_modes(posed.board, one.errors.leverages, MODULI) for one in known)
    of_fits = (one.summary.carrying_modes for one in fits.values())
    carrying_any = united(carrying(found, verdict.tried), *of_fits, *known_carrying)
    folded = folded and folded.without(indices_of(carrying_any, posed.board))
    if verdict.index and folded is not None and folded.counted.any():
        stages.begin("the same search on simulated boards, made to choose", _CHOICE)
        control = made_to_choose(ground, control, float(folded.ratio[0]), folded.carried)
    notes = [*after.inference.problem.doubts, *failures]  # what an effect explains is no doubt any more
    if last:
        with_words = next(answer_words(found, one) for one in finals if one.index == last)
        told = relabelled_sentence(posed.board, after.inference.problem.board, with_words)
        notes += [told] if told else []
    sides = {index: Side(index, one.summary, one.draws, _measured(one)) for index, one in fits.items()}
    diagnosis = diagnosis_of(
        Case(
            found=found,
            verdict=verdict,
            control=control,
            folded=folded,
            before=sides[0],
            after=sides[last],
            claim=judge_claim(found, verdict, control, folded) if last else Claim(),
            recommendation=advice(found, verdict, before.problem.prior, run.seed),
            known=known,
            stated_claims=stated_claims(posed, known) if known else (),
            finalists=[(one, sides[one.index]) for one in finals if one.index in sides],
            has_slip=bool(posed.slips),
            notes=tuple(notes),
            in_part=in_part,
            carrying=carrying_any,
        )
    )
    return diagnosis, after


def _fitted_again(
    problem: Problem, run: Run, found: SearchResult, finals: Sequence[Answer]
) -> tuple[dict[int, FitResult], list[str]]:
    """The fits with the finalists among the answers, by index, and a sentence for each that failed."""
    fits, failures = {}, []
    for answer in finals:
        try:
            name = "-".join((*answer.members, str(answer.index)))
            stage = f"fit with {answer_words(found, answer)}"
            fits[answer.index] = run.fit(with_board(problem, refit_board(found, answer.index)), name, stage)
        except (NotIdentifiableError, NotConvergedError) as error:
            failures.append(f"the model could not be fitted again with {' and '.join(answer.members)}: {error}")
    return fits, failures


def _measured(one: FitResult) -> NDArray[np.float64]:
    """Frequencies of the readings that have a label in a fit: (n_modes,) array, Hz."""
    return np.concatenate([setup.measured for setup in one.inference.problem.board.setups])


def advice(found: SearchResult, verdict: Verdict, prior: PriorCard, seed: int) -> str:
    """What to do next: read a wrong reading again, or the first line of the plan; empty if nothing would help."""
    if verdict.word == "unexplained":
        return wrong_reading(found)
    left = survivors(found, [one.members for one in verdict.stands_for])
    planner = Planner(believed(found, prior, stream(seed, BELIEFS), left), seed)
    return first_of(planner, planner.ranked())
