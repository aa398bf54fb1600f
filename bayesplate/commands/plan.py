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
from bayesplate.campaign.shared import Shared
from bayesplate.commands.arguments import checked
from bayesplate.commands.campaign import Campaign, by_kind
from bayesplate.commands.fitting import Stages
from bayesplate.commands.options import CARD, Between, Effects, Force, Goal, Minutes, OnProgress, Out, Seed
from bayesplate.commands.prepare import Card, Prepared
from bayesplate.commands.problem import Problem
from bayesplate.commands.shown import Shown, show_plan
from bayesplate.diagnosis.baseline import baseline_of
from bayesplate.diagnosis.hypotheses import RELABELLING
from bayesplate.diagnosis.joint import full_search
from bayesplate.diagnosis.verdict import WITHIN
from bayesplate.effects import effect_faults
from bayesplate.errors import Fault, InputError, NotIdentifiableError
from bayesplate.files import make_folder, require_new, write_text
from bayesplate.planning.beliefs import Beliefs, prior_beliefs
from bayesplate.planning.bench import Bench, drawn_up
from bayesplate.planning.explained import asked, believed, surviving
from bayesplate.planning.gains import EXPLANATIONS
from bayesplate.planning.plan import Plan
from bayesplate.planning.proposals import BELIEFS, Costs, Planner
from bayesplate.planning.together import beliefs_together
from bayesplate.report.plots import PlanPlots
from bayesplate.results.contract import json_text
from bayesplate.results.folder import DIAGNOSIS
from bayesplate.streams import stream

PLAN = "plan.json"
_GAINS, _BENCH = "plan", "plan-bench"
_POSE, _SEARCH, _PLAN = 1.0, 12.0, 4.0
"""How long the parts take beside each other."""
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class PlanResult:
    """What `plan` leaves.

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

    def shown(self) -> Shown:
        """Tables and sentences for a person."""
        return show_plan(self.summary)

    def _repr_html_(self) -> str:
        return self.shown().html(self.summary.title or self.summary.name)


@checked()
def plan(
    card: Annotated[Problem | Card | Campaign, CARD],
    *,
    goal: Goal = None,
    costs: Minutes = None,
    between: Between = None,
    out: Out = None,
    effects: Effects = None,
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
    seed : int
        Everything random follows from it.
    force : bool
        Replace files that are there.
    progress : callable, optional
        Told when a part begins.

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
    asked = by_kind(
        card,
        lambda problem: _Asked(
            problem.board, (problem,), (), partial(_of_board, problem, goal, between, seed, folder, progress)
        ),
        lambda campaign: _Asked(
            campaign.card, campaign.problems, campaign.shared, partial(_of_campaign, campaign, goal, between, progress)
        ),
        effects=effects,
        may_lack_frequencies=True,
    )
    files = () if folder is None else require_new(folder, _names(), force=force)
    planner = Planner(asked.believed(), seed, goal, Costs(**(costs or {})))
    named, priors = asked.card, [one.prior for one in asked.problems]
    made, drawn = drawn_up(planner, named.name, named.title, named.sha256, priors, asked.shared)
    if folder is not None:
        _write(made, drawn, folder, files)
    return PlanResult(made, drawn, tuple(path for path in files if path.exists()))


@dataclass(frozen=True)
class _Asked:
    """A board or a campaign that is planned, and the function that makes its beliefs."""

    card: Board | CampaignCard
    problems: Sequence[Problem]
    shared: Sequence[Shared]
    believed: Callable[[], Beliefs]


def _names() -> list[str]:
    """Files that a plan may write."""
    return [PLAN, *(f"{stem}.{ending}" for stem in (_GAINS, _BENCH, f"{_BENCH}-2") for ending in ("png", "svg"))]


def _of_board(
    given: Problem,
    goal: str | None,
    between: Sequence[str] | None,
    seed: int,
    folder: Path | None,
    progress: OnProgress,
) -> Beliefs:
    """Beliefs of a board: from a search, from a finished diagnosis, or from the prior."""
    prepared, rng = given.prepared, stream(seed, BELIEFS)
    board, prior = prepared.board, prepared.prior
    if between is not None:
        _require_possible(board, between)
    stages = Stages(progress, _POSE + _SEARCH + _PLAN)
    stages.begin("estimate", _POSE)
    asks_of_effects = between is not None or goal == EXPLANATIONS
    if not any(setup.readings or setup.peaks for setup in board.setups):
        if asks_of_effects:
            raise InputError(_untold("between" if between else "goal", "a board without any"))
        return prior_beliefs(board, prior, rng)
    try:
        baseline = baseline_of(Problem(prepared).posed)
    except NotIdentifiableError as error:
        if asks_of_effects:
            raise
        return prior_beliefs(board, prior, rng, (f"planned from the prior alone: {error}",))
    finished = None if folder is None or between else _finished(folder, prepared)
    tried = between or (None if finished is None else sorted({name for one in finished.support for name in one}))
    stages.begin("search for effects", _SEARCH)
    _, searched = full_search(baseline, tried, stages.reached)
    stages.begin("gains of further readings", _PLAN)
    among = None
    if between:
        among = asked(searched, between)
    elif finished is not None:
        among = surviving(searched, finished.support, finished.none, finished.rivals)
    return believed(searched, prior, rng, among)


def _of_campaign(campaign: Campaign, goal: str | None, between: Sequence[str] | None, progress: OnProgress) -> Beliefs:
    """Beliefs of several boards and of what they share: effects are not searched for."""
    if between is not None:
        raise InputError(_untold("between", "a campaign"))
    if goal == EXPLANATIONS:
        wanted = "E_x, E_y, G_xy or constants for a campaign, or none for what its boards share"
        raise InputError(Fault("goal", wanted, EXPLANATIONS, "plan one of its boards to tell explanations apart"))
    stages = Stages(progress, _SEARCH + _PLAN)
    stages.begin("boards of the campaign", _SEARCH)
    boards = [one.prepared.board for one in campaign.problems]
    priors = [one.prior for one in campaign.problems]
    beliefs = beliefs_together(boards, priors, campaign.shared, stages.reached)
    stages.begin("gains of further readings", _PLAN)
    return beliefs


def _untold(place: str, got: str) -> Fault:
    """The fault that explanations cannot be told apart."""
    return Fault(place, "the frequencies of a board, by which effects are told apart", got)


def _require_possible(board: Board, between: Sequence[str]) -> None:
    """Refuse effects that cannot be told apart: those that cannot act on the board, and those that it declares."""
    faults = [Fault("between", "effects that are not declared", name) for name in between if name in board.effects]
    others = replace(board, effects=tuple(name for name in between if name not in board.effects))
    faults += [Fault("between", one.wanted, one.got) for one in effect_faults(others)]
    if faults:
        raise InputError(faults)


@dataclass(frozen=True)
class _Finished:
    """Probabilities of the answers of a finished diagnosis that may survive, and that of no effect."""

    support: Mapping[tuple[str, ...], float]
    none: float
    rivals: frozenset[tuple[str, ...]]


def _finished(folder: Path, prepared: Prepared) -> _Finished | None:
    """The diagnosis of the same card in a folder; None if there is none, or it explains nothing."""
    try:
        told: dict[str, Any] = json.loads((folder / DIAGNOSIS).read_text(encoding="utf-8"))
        same = told["card_sha256"] == prepared.card.sha256 and tuple(told["declared"]) == prepared.board.effects
        if not same or told["verdict"] == "unexplained":
            return None
        support = {tuple(one["effects"]): float(one["probability"]) for one in told["answers"]}
        none = float(told["probability_of_none"])
        listed = told["effects"] if told["verdict"] == "indistinguishable group" else ()
        named = {name for one in (*support, listed) for name in one}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    is_altered = not all(0.0 <= one <= 1.0 + _ROUNDING for one in (*support.values(), none))
    if is_altered or not named <= {*EFFECT_NAMES, RELABELLING}:
        return None
    highest = max(support.values(), default=0.0)
    rivals = frozenset(members for members in support if members and set(members) <= set(listed))
    near = {one: p for one, p in support.items() if one and p > 0.0 and (WITHIN * p >= highest or one in rivals)}
    return _Finished(near, none, rivals) if near else None


def _write(made: Plan, drawn: Sequence[Bench], folder: Path, files: Sequence[Path]) -> None:
    from bayesplate.report.planning import bench_sheet, gains_picture
    from bayesplate.report.saving import drawing, save_figure

    make_folder(folder)
    write_text(files[0], json_text(made))
    with drawing():
        figures = [gains_picture(made).figure, *(bench_sheet(one) for one in drawn)]
        for i, figure in enumerate(figures):
            for path in files[1 + 2 * i : 3 + 2 * i]:
                save_figure(figure, path)
