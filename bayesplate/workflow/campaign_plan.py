"""`plan` of a campaign: which reading, or which further board, narrows what its boards share most."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict

from bayesplate.errors import Fault, InputError
from bayesplate.planning.assembled import Bench
from bayesplate.planning.campaign import benches, entry, joined, joined_entry, joint_of, readings
from bayesplate.planning.plan import FORMAT, Plan
from bayesplate.planning.proposals import EXPLANATIONS, Costs
from bayesplate.planning.words import campaign_line
from bayesplate.posterior.sampling import Progress
from bayesplate.workflow.campaign import Campaign
from bayesplate.workflow.stages import Stages

LINEAR = (
    "to first order about each board's least-squares estimate, peaks without a label taken for the modes that are "
    "expected there"
)
_BOARDS, _READINGS = 6.0, 4.0
"""How long the parts take beside each other."""


def plan_campaign(
    campaign: Campaign,
    goal: str | None,
    costs: Costs,
    seed: int,
    progress: Callable[[Progress], None] | None = None,
) -> tuple[Plan, tuple[Bench, ...]]:
    """The plan of a campaign; `bayesplate.plan` says what the arguments mean.

    Raises
    ------
    InputError
        If explanations are to be told apart: a campaign's plan is about what its card shares.
    """
    if goal == EXPLANATIONS:
        wanted = "E_x, E_y, G_xy or constants for a campaign, or none for what its boards share"
        raise InputError(Fault("goal", wanted, EXPLANATIONS, "plan one of its boards to tell explanations apart"))
    stages = Stages(progress, _BOARDS + _READINGS)
    stages.begin("boards of the campaign", _BOARDS)
    boards = [one.prepared.board for one in campaign.problems]
    priors = [one.prior for one in campaign.problems]
    joint = joint_of(boards, priors, campaign.shared, stages.reached)
    stages.begin("gains of further readings", _READINGS)
    listed = readings(joint, priors, campaign.shared, costs, goal)
    together = joined(joint, listed, goal)
    drawn = benches(joint, together[-1] if together else listed[:1])
    proposals = tuple(entry(joint, one, campaign.shared, goal) for one in listed)
    made = Plan(
        format=FORMAT,
        name=campaign.name,
        title=campaign.card.title,
        seed=seed,
        card_sha256=campaign.card.sha256,
        basis="campaign",
        goal=goal,
        costs=asdict(costs),
        explanations=(),
        entropy=0.0,
        first=campaign_line(proposals, goal),
        proposals=proposals,
        sequences=tuple(joined_entry(joint, one, campaign.shared, goal) for one in together),
        bench=tuple(one.entry for one in drawn),
        notes=(LINEAR,),
    )
    return made, drawn
