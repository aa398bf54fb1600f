"""`diagnose` of a campaign: what its boards lack in common, judged by boards that were left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

from bayesplate.board.campaign import SharedSection
from bayesplate.campaign.boards import Member
from bayesplate.campaign.claim import SharedClaim, TaughtBoard, judge, taught_boards
from bayesplate.campaign.common import common_residuals
from bayesplate.campaign.diagnosis import (
    FORMAT,
    CampaignDiagnosis,
    PooledErrors,
    named,
    next_step,
    pooled_rms,
)
from bayesplate.campaign.search import Explanation, explanations, search_board, shown
from bayesplate.campaign.shared import shared_by
from bayesplate.campaign.summary import CampaignSummary
from bayesplate.commands.campaign import Campaign
from bayesplate.commands.campaign_fit import (
    SHARED,
    CampaignFitResult,
    boards_of,
    campaign_run,
    fit_boards,
    fitted_together,
    summed_up,
)
from bayesplate.commands.fitting import FIT, FitResult, Run, Stages
from bayesplate.commands.shown import Shown, show_campaign_diagnosis
from bayesplate.diagnosis.baseline import baseline_of
from bayesplate.diagnosis.claim import IMPROBABLE
from bayesplate.diagnosis.forms import forms
from bayesplate.effects import EFFECTS
from bayesplate.errors import InputError
from bayesplate.files import write_text
from bayesplate.report.plots import CampaignPlots
from bayesplate.results.contract import as_json, json_text
from bayesplate.results.folder import BEFORE, DIAGNOSIS

_SEARCH = 2.0
"""How long the search takes beside a fit."""


@dataclass(frozen=True, eq=False, repr=False)
class CampaignDiagnoseResult:
    """What a diagnosis of a campaign leaves.

    Attributes
    ----------
    folder : Path or None
        Where its files are; None if none were asked for.
    diagnosis : CampaignDiagnosis
    before : dict of FitResult
        By board: without what is shared.
    after : CampaignFitResult
        With it; boards side by side where nothing is shared.
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
        """The figures: `found.plot.left_out()`."""
        return CampaignPlots(self.after.summary, self.diagnosis)

    def to_arviz(self) -> Any:
        """The draws of what is shared, as of `CampaignFitResult.to_arviz`."""
        return self.after.to_arviz()

    def to_json(self) -> dict[str, Any]:
        """The content of diagnosis.json."""
        content: dict[str, Any] = as_json(self.diagnosis)
        return content

    def shown(self) -> Shown:
        """Tables and sentences for a person."""
        return show_campaign_diagnosis(self.diagnosis)

    def _repr_html_(self) -> str:
        return self.shown().html(self.diagnosis.name)

    def __repr__(self) -> str:
        one = self.diagnosis
        told = ", ".join(one.effects) or "nothing"
        claim = "claimed" if one.claim else "not claimed"
        return f"<CampaignDiagnoseResult of {one.name}: {one.verdict}, {told} shared, {claim}>"


def diagnose_campaign(campaign: Campaign, run: Run, *, report: bool) -> CampaignDiagnoseResult:
    """Diagnose a campaign; `bayesplate.diagnose` says what is raised.

    Where the card names what is shared, that is judged: each board by what the others teach it, against the same boards
    without it. Otherwise every effect that boards may have alike is tried, and the one that stands out is judged so.
    """
    alone = _without_shared(campaign)
    campaign.pose()
    of_a_board = 2.0 * FIT + (0.0 if campaign.shared else _SEARCH)
    with campaign_run(alone, run, len(campaign.problems) * of_a_board + SHARED, f"{BEFORE}/"):
        found = replace(_diagnosed(campaign, alone, run), folder=run.path)
    if run.folder is not None:
        path = run.folder.path
        for name, one in found.before.items():
            one.write(path / BEFORE / name)
        write_text(path / DIAGNOSIS, json_text(found.diagnosis))
        found.after.write(path, report=report, diagnosis=found.diagnosis)
        run.folder.close()
    return found


def _diagnosed(campaign: Campaign, alone: Campaign, run: Run) -> CampaignDiagnoseResult:
    """The diagnosis of a campaign whose boards can be fitted; nothing is written but checkpoints."""
    could_share = () if campaign.shared else shareable(campaign)
    before = fit_boards(alone, run, f"{BEFORE}/")
    if campaign.shared:
        verdict, reason = "named", "the card names what the boards share"
        effects = tuple(dict.fromkeys(one.effect for one in campaign.shared))
        searched: tuple[Explanation, ...] = ()
        with_shared = campaign
    else:
        searched = _searched(before, could_share, run.stages)
        verdict, effects, reason = named(searched) if searched else ("none needed", (), "no effect could be shared")
        with_shared = _sharing(campaign, searched[0].effects if effects else ())
    if with_shared.shared:
        after = fitted_together(with_shared, run)
    else:
        after = summed_up(with_shared, before, before, None, (), run.seed)
    taught: Mapping[str, TaughtBoard] = {}
    claim: SharedClaim | None = None
    if after.learnt is not None:
        members = {name: Member(one.inference, one.draws, ()) for name, one in before.items()}
        taught = taught_boards(after.learnt, members, run.seed)
        claim = judge(taught)
    diagnosis = _diagnosis(campaign, verdict, effects, reason, searched, taught, claim, before, after, run.seed)
    return CampaignDiagnoseResult(None, diagnosis, before, after)


def _without_shared(campaign: Campaign) -> Campaign:
    """The boards side by side, without the shared effects."""
    names = {one.effect for one in campaign.shared}
    if not names:
        return campaign
    problems = tuple(
        replace(one, prepared=one.prepared.with_effects([e for e in one.prepared.board.effects if e not in names]))
        for one in campaign.problems
    )
    return replace(campaign, problems=problems, shared=())


def _sharing(campaign: Campaign, effects: Sequence[str]) -> Campaign:
    """The boards with effects that they share, as ratios where an effect has ratios."""
    if not effects:
        return campaign
    problems = tuple(
        replace(one, prepared=one.prepared.with_effects((*one.prepared.board.effects, *effects)))
        for one in campaign.problems
    )
    ways = {name: "ratio" if EFFECTS[name].ratios else "value" for name in effects}
    sections = tuple(SharedSection.model_validate({"effect": name, "as": way}) for name, way in ways.items())
    card = campaign.card.model_copy(update={"shared": sections})
    return replace(campaign, problems=problems, shared=shared_by(card, [one.prepared.board for one in problems]))


def shareable(campaign: Campaign) -> tuple[tuple[str, ...], ...]:
    """Effects, single and in pairs, that all boards may have, of one size each, alike on one rig, day or species."""
    can_act = set.intersection(*(set(forms(one.prepared.board)) for one in campaign.problems))
    able = [name for name, effect in EFFECTS.items() if effect.is_of_campaign and name in can_act]
    single = [name for name in able if _has_one_size(campaign, (name,))]
    pairs = (pair for pair in combinations(single, 2) if _has_one_size(campaign, pair))
    return (*((name,) for name in single), *pairs)


def _has_one_size(campaign: Campaign, effects: Sequence[str]) -> bool:
    """Whether a fit could share these effects, and no board has one size of them per setup."""
    try:
        sharing = _sharing(campaign, effects)
    except InputError:
        return False
    boards = [one.prepared.board for one in sharing.problems]
    return all(len(one.parameters(board)) == 1 for one in sharing.shared for board in boards)


def _searched(
    before: Mapping[str, FitResult], effects: Sequence[tuple[str, ...]], stages: Stages
) -> tuple[Explanation, ...]:
    """Explanations by the tables of all boards together."""
    if not effects:
        return ()
    tried = [name for name, *others in effects if not others]
    searches = []
    for name, one in before.items():
        stages.begin(f"search on board {name}", _SEARCH)
        searches.append(search_board(name, baseline_of(one.inference.problem), tried, stages.reached))
    return explanations(searches, shown(searches, effects))


def _diagnosis(
    campaign: Campaign,
    verdict: str,
    effects: tuple[str, ...],
    reason: str,
    searched: tuple[Explanation, ...],
    taught: Mapping[str, TaughtBoard],
    claim: SharedClaim | None,
    before: Mapping[str, FitResult],
    after: CampaignFitResult,
    seed: int,
) -> CampaignDiagnosis:
    none = next((one.probability for one in searched if one.way == "none"), None)
    counts = {name: len(one.summary.modes) for name, one in before.items()}
    errors_before = {name: one.summary.error.in_sample_rms_cents for name, one in before.items()}
    errors_after = {name: one.error.in_sample_rms_cents for name, one in after.summary.boards.items()}
    pooled_before, pooled_after = pooled_rms(errors_before, counts), pooled_rms(errors_after, counts)
    left_before = pooled_rms({n: t.before_rms_cents for n, t in taught.items()}, counts) if taught else pooled_before
    left_after = pooled_rms({n: t.after_rms_cents for n, t in taught.items()}, counts) if taught else pooled_after
    holds = claim is not None and claim.holds and verdict == "named" and (none is None or none < IMPROBABLE)
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
        explanations=searched,
        probability_of_none=none,
        conditions=claim,
        left_out_boards=taught,
        before=PooledErrors(pooled_before, left_before),
        after=PooledErrors(pooled_after, left_after),
        common_residual=after.summary.common_residual,
        common_residual_before=common_residuals({name: one.summary for name, one in before.items()}, boards_of(before)),
        recommendation=next_step(
            after.summary.common_residual,
            claim,
            len(before),
            is_declared=bool(campaign.shared),
            verdict=verdict,
            explanations=searched,
        ),
        notes=after.summary.warnings,
    )
