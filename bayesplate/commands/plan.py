"""`plan`: what to measure next, by what it is expected to give and what it costs."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from bayesplate.board.board import Board
from bayesplate.board.campaign import CampaignCard
from bayesplate.board.words import EFFECT_NAMES
from bayesplate.campaign.shared import SharedParameter
from bayesplate.commands.arguments import check_arguments
from bayesplate.commands.campaign import Campaign, dispatch_card
from bayesplate.commands.fitting import Stages
from bayesplate.commands.options import (
    CARD,
    Effects,
    Force,
    Goal,
    Minutes,
    OnProgress,
    Out,
    RivalEffects,
    Seed,
    SetupFile,
)
from bayesplate.commands.prepare import CardSource, PreparedBoard
from bayesplate.commands.printout import Printout, show_plan
from bayesplate.commands.problem import Problem, require_normal_noise
from bayesplate.diagnosis.baseline import baseline_of
from bayesplate.diagnosis.hypotheses import RELABELLING
from bayesplate.diagnosis.joint import full_search
from bayesplate.diagnosis.verdict import ALTERNATIVE_FACTOR
from bayesplate.effects import effect_faults
from bayesplate.errors import Fault, InputError, NotIdentifiableError
from bayesplate.files import make_folder, require_new_files, write_text
from bayesplate.planning.beliefs import Beliefs, prior_beliefs
from bayesplate.planning.bench import Bench, draw_up_plan
from bayesplate.planning.campaign import campaign_beliefs
from bayesplate.planning.explained import explanations_of_effects, search_beliefs, survivors_by_support
from bayesplate.planning.gains import EXPLANATIONS
from bayesplate.planning.plan import Plan
from bayesplate.planning.proposals import BELIEFS_STREAM, Costs, Planner
from bayesplate.report.plots import PlanPlots
from bayesplate.results.contract import json_text
from bayesplate.results.folder import DIAGNOSIS_FILE
from bayesplate.streams import random_stream

PLAN_FILE = "plan.json"
_GAINS_STEM, _BENCH_STEM = "plan", "plan-bench"
_POSE_TIME, _SEARCH_TIME, _PLAN_TIME = 1.0, 12.0, 4.0
"""Times of the stages, relative to each other."""
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class PlanResult:
    """Result of `plan`.

    Attributes
    ----------
    summary : Plan
        What plan.json holds.
    benches : tuple of Bench
        Figures of the modes to look for, with the places of sensor and hammer.
    files : tuple of Path
        Those that were written.
    """

    summary: Plan
    benches: tuple[Bench, ...]
    files: tuple[Path, ...]

    @property
    def plot(self) -> PlanPlots:
        """The figures: `result.plot.gains()`, `result.plot.bench()`."""
        return PlanPlots(self.summary, self.benches)

    def __repr__(self) -> str:
        return repr(self.summary).replace("<Plan", "<PlanResult", 1)

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_plan(self.summary)

    def _repr_html_(self) -> str:
        return self.printout().html(self.summary.title or self.summary.name)


@check_arguments()
def plan(
    card: Annotated[Problem | CardSource | Campaign, CARD],
    *,
    goal: Goal = None,
    costs: Minutes = None,
    between: RivalEffects = None,
    out: Out = None,
    effects: Effects = None,
    setup: SetupFile = None,
    seed: Seed = 1,
    force: Force = False,
    progress: OnProgress = None,
) -> PlanResult:
    """Rank what could be measured next by what it is expected to give.

    Parameters
    ----------
    card : Problem, str, path, Board or Campaign
        A problem, the name of a shipped board or campaign card, the path of a card, or a board made in Python. A board
        without frequencies is planned from its prior.
    goal : str, optional
        "E_x", "E_y", "G_xy": the interval of this constant; "constants": those of all three; "explanations": the doubt
        between them. By default both together.
    costs : dict of float, optional
        Minutes of a "reading" (1), a "clamping" (10), a "board" (30).
    between : sequence of str, optional
        Effects that are to be told apart, no effect being one more possibility; by default those that survive the
        search of `diagnose`. Each must be able to act on the board, and not be declared.
    out : path, optional
        Folder of plan.json, the figure of gains and the sheets for the bench; nothing is written without it. A
        diagnosis of the same card that is there is not made again.
    effects : sequence of str, optional
        Declared effects in place of the card's.
    setup : path, optional
        A file with a table [setup] that takes the place of the card's, key by key: what `pick` writes.
    seed : int
        Everything random follows from it.
    force : bool
        Replace files that are there.
    progress : callable, optional
        Called when a stage begins.

    Returns
    -------
    PlanResult

    Raises
    ------
    InputError
        If the card, an argument or the folder cannot be used; then nothing is written.
    NotIdentifiableError
        If explanations are to be told apart on a board whose frequencies do not even tell the constants.
    """
    folder = None if out is None else Path(out)
    request = dispatch_card(
        card,
        lambda problem: _PlanRequest(
            problem.board, (problem,), (), partial(_board_beliefs, problem, goal, between, seed, folder, progress)
        ),
        lambda campaign: _PlanRequest(
            campaign.card,
            campaign.problems,
            campaign.shared,
            partial(_campaign_beliefs, campaign, goal, between, progress),
        ),
        effects=effects,
        setup=setup,
        may_lack_frequencies=True,
    )
    files = () if folder is None else require_new_files(folder, _file_names(), force=force)
    planner = Planner(request.compute_beliefs(), seed, goal, Costs(**(costs or {})))
    planned_card, priors = request.card, [problem.prior for problem in request.problems]
    new_plan, benches = draw_up_plan(
        planner, planned_card.name, planned_card.title, planned_card.sha256, priors, request.shared
    )
    written = () if folder is None else _write(new_plan, benches, folder, files)
    return PlanResult(new_plan, benches, written)


@dataclass(frozen=True)
class _PlanRequest:
    """A board or a campaign whose measurements are planned, and the function that computes its beliefs."""

    card: Board | CampaignCard
    problems: Sequence[Problem]
    shared: Sequence[SharedParameter]
    compute_beliefs: Callable[[], Beliefs]


def _file_names() -> list[str]:
    """Files that a plan may write."""
    return [
        PLAN_FILE,
        *(f"{stem}.{ending}" for stem in (_GAINS_STEM, _BENCH_STEM, f"{_BENCH_STEM}-2") for ending in ("png", "svg")),
    ]


def _board_beliefs(
    problem: Problem,
    goal: str | None,
    between: Sequence[str] | None,
    seed: int,
    folder: Path | None,
    progress: OnProgress,
) -> Beliefs:
    """Beliefs of a board: from a search, from a finished diagnosis, or from the prior."""
    require_normal_noise([problem])
    prepared, rng = problem.prepared, random_stream(seed, BELIEFS_STREAM)
    read_setups = tuple(setup for setup in prepared.board.setups if setup.readings or setup.peaks)
    unread = [setup.name for setup in prepared.board.setups if setup not in read_setups] if read_setups else []
    notes = tuple(f"setup '{name}' has no frequencies yet, and no reading is planned in it" for name in unread)
    board = replace(prepared.board, setups=read_setups or prepared.board.setups, notes=(*prepared.board.notes, *notes))
    prepared, prior = replace(prepared, board=board), prepared.prior
    if between is not None:
        _require_rivals(board, between)
    stages = Stages(progress, _POSE_TIME + _SEARCH_TIME + _PLAN_TIME)
    stages.begin("estimate", _POSE_TIME)
    needs_frequencies = between is not None or goal == EXPLANATIONS
    if not read_setups:
        if needs_frequencies:
            raise InputError(_frequencies_fault("between" if between else "goal", "a board without any"))
        return prior_beliefs(board, prior, rng)
    try:
        baseline = baseline_of(replace(problem, prepared=prepared).posed)
    except NotIdentifiableError as error:
        if needs_frequencies:
            raise
        return prior_beliefs(board, prior, rng, (f"planned from the prior alone: {error}",))
    finished = None if folder is None or between else _read_diagnosis(folder, prepared)
    tried_effects = between or (
        None if finished is None else sorted({name for members in finished.support for name in members})
    )
    stages.begin("search for effects", _SEARCH_TIME)
    _, search = full_search(baseline, tried_effects, stages.reached)
    stages.begin("gains of further readings", _PLAN_TIME)
    hypotheses = None
    if between:
        hypotheses = explanations_of_effects(search, between)
    elif finished is not None:
        hypotheses = survivors_by_support(search, finished.support, finished.none, finished.rivals)
    return search_beliefs(search, prior, rng, hypotheses)


def _campaign_beliefs(
    campaign: Campaign, goal: str | None, between: Sequence[str] | None, progress: OnProgress
) -> Beliefs:
    """Beliefs of several boards and of what they share: effects are not searched for."""
    require_normal_noise(campaign.problems)
    if between is not None:
        raise InputError(_frequencies_fault("between", "a campaign"))
    if goal == EXPLANATIONS:
        wanted = "E_x, E_y, G_xy or constants for a campaign, or none for what its boards share"
        raise InputError(Fault("goal", wanted, EXPLANATIONS, "plan one of its boards to tell explanations apart"))
    stages = Stages(progress, _SEARCH_TIME + _PLAN_TIME)
    stages.begin("boards of the campaign", _SEARCH_TIME)
    campaign.pose()
    boards = [problem.posed.board for problem in campaign.problems]
    priors = [problem.prior for problem in campaign.problems]
    beliefs = campaign_beliefs(boards, priors, campaign.shared, stages.reached)
    stages.begin("gains of further readings", _PLAN_TIME)
    return beliefs


def _frequencies_fault(place: str, got: str) -> Fault:
    """The fault that explanations cannot be told apart."""
    return Fault(place, "the frequencies of a board, by which effects are told apart", got)


def _require_rivals(board: Board, between: Sequence[str]) -> None:
    """Refuse effects that cannot be told apart: those that cannot act on the board, and those that it declares."""
    faults = [Fault("between", "effects that are not declared", name) for name in between if name in board.effects]
    undeclared = replace(board, effects=tuple(name for name in between if name not in board.effects))
    faults += [Fault("between", fault.wanted, fault.got) for fault in effect_faults(undeclared)]
    if faults:
        raise InputError(faults)


@dataclass(frozen=True)
class _FinishedDiagnosis:
    """Probabilities of the explanations of a finished diagnosis that may survive, and that of no effect."""

    support: Mapping[tuple[str, ...], float]
    none: float
    rivals: frozenset[tuple[str, ...]]


def _read_diagnosis(folder: Path, prepared: PreparedBoard) -> _FinishedDiagnosis | None:
    """The diagnosis of the same card in a folder; None if there is none, or it explains nothing."""
    try:
        diagnosis: dict[str, Any] = json.loads((folder / DIAGNOSIS_FILE).read_text(encoding="utf-8"))
        is_same = (
            diagnosis["card_sha256"] == prepared.card.sha256 and tuple(diagnosis["declared"]) == prepared.board.effects
        )
        if not is_same or diagnosis["verdict"] == "unexplained":
            return None
        support = {tuple(entry["effects"]): float(entry["probability"]) for entry in diagnosis["explanations"]}
        p_none = float(diagnosis["probability_of_none"])
        listed_effects = diagnosis["effects"] if diagnosis["verdict"] == "indistinguishable group" else ()
        effect_names = {name for members in (*support, listed_effects) for name in members}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    is_altered = not all(0.0 <= probability <= 1.0 + _ROUNDING for probability in (*support.values(), p_none))
    if is_altered or not effect_names <= {*EFFECT_NAMES, RELABELLING}:
        return None
    highest = max(support.values(), default=0.0)
    rivals = frozenset(members for members in support if members and set(members) <= set(listed_effects))
    survivors = {
        members: p
        for members, p in support.items()
        if members and p > 0.0 and (ALTERNATIVE_FACTOR * p >= highest or members in rivals)
    }
    return _FinishedDiagnosis(survivors, p_none, rivals) if survivors else None


def _write(new_plan: Plan, benches: Sequence[Bench], folder: Path, files: Sequence[Path]) -> tuple[Path, ...]:
    """Write a plan and its figures, in place of all files of an earlier one; the files that were written."""
    from bayesplate.report.planning import bench_sheet, gains_picture
    from bayesplate.report.saving import matplotlib_defaults, save_figure

    make_folder(folder)
    write_text(files[0], json_text(new_plan))
    with matplotlib_defaults():
        figures = [gains_picture(new_plan).figure, *(bench_sheet(bench) for bench in benches)]
        for i, figure in enumerate(figures):
            for path in files[1 + 2 * i : 3 + 2 * i]:
                save_figure(figure, path)
    n_written = 1 + 2 * len(figures)
    for path in files[n_written:]:
        path.unlink(missing_ok=True)
    return tuple(files[:n_written])
