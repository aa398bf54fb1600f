"""`diagnose` of a campaign: an effect that its boards share, judged by boards that were left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

from bayesplate.board.campaign import SharedSection
from bayesplate.campaign.boards import FittedBoard
from bayesplate.campaign.claim import SharedClaim, TaughtBoard, judge_shared_effect, taught_boards
from bayesplate.campaign.common import common_residuals
from bayesplate.campaign.diagnosis import (
    FORMAT,
    CampaignDiagnosis,
    PooledErrors,
    campaign_verdict,
    next_step,
    pooled_rms,
)
from bayesplate.campaign.search import CampaignExplanation, rank_campaign_explanations, search_board, visible_effects
from bayesplate.campaign.shared import find_shared_parameters
from bayesplate.campaign.summary import CampaignSummary
from bayesplate.commands.campaign import Campaign
from bayesplate.commands.campaign_fit import (
    SHARED_TIME,
    CampaignFitResult,
    campaign_result,
    campaign_run,
    fit_boards,
    fit_together,
    fitted_boards,
)
from bayesplate.commands.fitting import FIT_TIME, FitResult, Run, Stages
from bayesplate.commands.printout import Printout, show_campaign_diagnosis
from bayesplate.commands.problem import require_normal_noise
from bayesplate.diagnosis.baseline import baseline_of
from bayesplate.diagnosis.claim import IMPROBABLE_BELOW
from bayesplate.diagnosis.forms import forms
from bayesplate.effects import EFFECTS
from bayesplate.errors import InputError
from bayesplate.files import write_text
from bayesplate.report.plots import CampaignPlots
from bayesplate.results.contract import as_json, json_text
from bayesplate.results.folder import BEFORE_FOLDER, DIAGNOSIS_FILE

_SEARCH_TIME = 2.0
"""Time of the search, relative to FIT_TIME."""


@dataclass(frozen=True, eq=False, repr=False)
class CampaignDiagnoseResult:
    """Result of `diagnose` for a campaign.

    Attributes
    ----------
    folder : Path or None
        Where its files are; None if none were asked for.
    diagnosis : CampaignDiagnosis
    before : dict of FitResult
        By board: the fit without shared effects.
    after : CampaignFitResult
        The fit with them; each board alone where nothing is shared.
    """

    folder: Path | None
    diagnosis: CampaignDiagnosis
    before: Mapping[str, FitResult]
    after: CampaignFitResult

    @property
    def summary(self) -> CampaignSummary:
        """The summary of the model that the diagnosis ends with."""
        return self.after.summary

    @cached_property
    def plot(self) -> CampaignPlots:
        """The figures: `result.plot.left_out()`."""
        return CampaignPlots(self.after.summary, self.diagnosis)

    def to_arviz(self) -> Any:
        """The draws of what is shared, as of `CampaignFitResult.to_arviz`."""
        return self.after.to_arviz()

    def to_json(self) -> dict[str, Any]:
        """The content of diagnosis.json."""
        content: dict[str, Any] = as_json(self.diagnosis)
        return content

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_campaign_diagnosis(self.diagnosis)

    def _repr_html_(self) -> str:
        return self.printout().html(self.diagnosis.name)

    def __repr__(self) -> str:
        diagnosis = self.diagnosis
        effects = ", ".join(diagnosis.effects) or "nothing"
        claim = "claimed" if diagnosis.claim else "not claimed"
        return f"<CampaignDiagnoseResult of {diagnosis.name}: {diagnosis.verdict}, {effects} shared, {claim}>"


def diagnose_campaign(campaign: Campaign, run: Run, *, report: bool) -> CampaignDiagnoseResult:
    """Diagnose a campaign; `bayesplate.diagnose` says what is raised.

    Shared effects that the card names are judged: each board is predicted from the others, with these effects and
    without. Otherwise every effect that the boards may share is tried, and the one that stands out is judged likewise.
    """
    require_normal_noise(campaign.problems)
    unshared = _without_shared(campaign)
    campaign.pose()
    time_per_board = 2.0 * FIT_TIME + (0.0 if campaign.shared else _SEARCH_TIME)
    with campaign_run(unshared, run, len(campaign.problems) * time_per_board + SHARED_TIME, f"{BEFORE_FOLDER}/"):
        result = replace(_diagnose_boards(campaign, unshared, run), folder=run.path)
    if run.folder is not None:
        path = run.folder.path
        for name, fit in result.before.items():
            fit.write(path / BEFORE_FOLDER / name)
        write_text(path / DIAGNOSIS_FILE, json_text(result.diagnosis))
        result.after.write(path, report=report, diagnosis=result.diagnosis)
        run.folder.close()
    return result


def _diagnose_boards(campaign: Campaign, unshared: Campaign, run: Run) -> CampaignDiagnoseResult:
    """The diagnosis of a campaign whose boards can be fitted; nothing is written but checkpoints."""
    candidates = () if campaign.shared else shareable_effects(campaign)
    before = fit_boards(unshared, run, f"{BEFORE_FOLDER}/")
    if campaign.shared:
        verdict, reason = "named", "the card names what the boards share"
        effects = tuple(dict.fromkeys(parameter.effect for parameter in campaign.shared))
        search_explanations: tuple[CampaignExplanation, ...] = ()
        with_shared = campaign
    else:
        search_explanations = _search_boards(before, candidates, run.stages)
        verdict, effects, reason = (
            campaign_verdict(search_explanations)
            if search_explanations
            else ("none needed", (), "no effect could be shared")
        )
        with_shared = _share_effects(campaign, search_explanations[0].effects if effects else ())
    if with_shared.shared:
        after = fit_together(with_shared, run)
    else:
        after = campaign_result(with_shared, before, before, None, (), run.seed)
    left_out_boards: Mapping[str, TaughtBoard] = {}
    claim: SharedClaim | None = None
    if after.shared_posterior is not None:
        members = {name: FittedBoard(fit.draws, ()) for name, fit in before.items()}
        left_out_boards = taught_boards(after.shared_posterior, members, run.seed)
        claim = judge_shared_effect(left_out_boards)
    diagnosis = _diagnosis(
        campaign, verdict, effects, reason, search_explanations, left_out_boards, claim, before, after, run.seed
    )
    return CampaignDiagnoseResult(None, diagnosis, before, after)


def _without_shared(campaign: Campaign) -> Campaign:
    """The boards side by side, without the shared effects."""
    names = {parameter.effect for parameter in campaign.shared}
    if not names:
        return campaign
    problems = tuple(
        replace(
            problem,
            prepared=problem.prepared.with_effects([e for e in problem.prepared.board.effects if e not in names]),
        )
        for problem in campaign.problems
    )
    return replace(campaign, problems=problems, shared=())


def _share_effects(campaign: Campaign, effects: Sequence[str]) -> Campaign:
    """The boards with effects that they share, as ratios where an effect has ratios."""
    if not effects:
        return campaign
    problems = tuple(
        replace(problem, prepared=problem.prepared.with_effects((*problem.prepared.board.effects, *effects)))
        for problem in campaign.problems
    )
    kinds = {name: "ratio" if EFFECTS[name].ratios else "value" for name in effects}
    sections = tuple(SharedSection.model_validate({"effect": name, "as": kind}) for name, kind in kinds.items())
    card = campaign.card.model_copy(update={"shared": sections})
    return replace(
        campaign,
        problems=problems,
        shared=find_shared_parameters(card, [problem.prepared.board for problem in problems]),
    )


def shareable_effects(campaign: Campaign) -> tuple[tuple[str, ...], ...]:
    """Effects, single and in pairs, that all boards may share with one size, as those of one rig, day or species."""
    can_act = set.intersection(*(set(forms(problem.prepared.board)) for problem in campaign.problems))
    candidates = [name for name, effect in EFFECTS.items() if effect.is_of_campaign and name in can_act]
    single_effects = [name for name in candidates if _has_one_size(campaign, (name,))]
    pairs = (pair for pair in combinations(single_effects, 2) if _has_one_size(campaign, pair))
    return (*((name,) for name in single_effects), *pairs)


def _has_one_size(campaign: Campaign, effects: Sequence[str]) -> bool:
    """Whether a fit could share these effects: no board has one size of them per setup, all boards the same prior."""
    try:
        with_shared = _share_effects(campaign, effects)
    except InputError:
        return False
    boards = [problem.prepared.board for problem in with_shared.problems]
    sizes = [[parameter.parameters(board) for board in boards] for parameter in with_shared.shared]
    return all(len(own) == 1 and own[0].prior == of_boards[0][0].prior for of_boards in sizes for own in of_boards)


def _search_boards(
    before: Mapping[str, FitResult], effects: Sequence[tuple[str, ...]], stages: Stages
) -> tuple[CampaignExplanation, ...]:
    """Explanations from the search tables of all boards together."""
    if not effects:
        return ()
    single_effects = [name for name, *partners in effects if not partners]
    searches = []
    for name, fit in before.items():
        stages.begin(f"search on board {name}", _SEARCH_TIME)
        searches.append(search_board(name, baseline_of(fit.inference.problem), single_effects, stages.reached))
    return rank_campaign_explanations(searches, visible_effects(searches, effects))


def _diagnosis(
    campaign: Campaign,
    verdict: str,
    effects: tuple[str, ...],
    reason: str,
    search_explanations: tuple[CampaignExplanation, ...],
    left_out_boards: Mapping[str, TaughtBoard],
    claim: SharedClaim | None,
    before: Mapping[str, FitResult],
    after: CampaignFitResult,
    seed: int,
) -> CampaignDiagnosis:
    p_none = next((explanation.probability for explanation in search_explanations if explanation.way == "none"), None)
    counts = {name: len(fit.summary.modes) for name, fit in before.items()}
    errors_before = {name: fit.summary.error.in_sample_rms_cents for name, fit in before.items()}
    errors_after = {name: summary.error.in_sample_rms_cents for name, summary in after.summary.boards.items()}
    pooled_before, pooled_after = pooled_rms(errors_before, counts), pooled_rms(errors_after, counts)
    left_out_before = (
        pooled_rms({n: t.before_rms_cents for n, t in left_out_boards.items()}, counts)
        if left_out_boards
        else pooled_before
    )
    left_out_after = (
        pooled_rms({n: t.after_rms_cents for n, t in left_out_boards.items()}, counts)
        if left_out_boards
        else pooled_after
    )
    holds = claim is not None and claim.holds and verdict == "named" and (p_none is None or p_none < IMPROBABLE_BELOW)
    return CampaignDiagnosis(
        format=FORMAT,
        name=campaign.name,
        seed=seed,
        card_sha256=campaign.card.sha256,
        verdict=verdict,
        claim=holds,
        effects=effects,
        declared=bool(campaign.shared),
        reason=reason,
        explanations=search_explanations,
        probability_of_none=p_none,
        conditions=claim,
        left_out_boards=left_out_boards,
        before=PooledErrors(pooled_before, left_out_before),
        after=PooledErrors(pooled_after, left_out_after),
        common_residual=after.summary.common_residual,
        common_residual_before=common_residuals(
            {name: fit.summary for name, fit in before.items()}, fitted_boards(before)
        ),
        recommendation=next_step(
            after.summary.common_residual,
            claim,
            len(before),
            is_declared=bool(campaign.shared),
            verdict=verdict,
            explanations=search_explanations,
        ),
        notes=after.summary.warnings,
    )
