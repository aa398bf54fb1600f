"""A plan, drawn up: proposals, sequences, the first line, and what to do at the bench."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from bayesplate.board.prior import PriorCard
from bayesplate.campaign.shared import Shared
from bayesplate.planning.beliefs import Beliefs
from bayesplate.planning.bench import Bench, benches
from bayesplate.planning.plan import FORMAT, ExplanationEntry, Plan
from bayesplate.planning.proposals import Planner, Proposal
from bayesplate.planning.words import first_line


def drawn_up(
    planner: Planner,
    name: str,
    title: str,
    card_sha256: str,
    priors: Sequence[PriorCard] = (),
    shared: Sequence[Shared] = (),
) -> tuple[Plan, tuple[Bench, ...]]:
    """The plan as plan.json has it, and the sheets for the bench."""
    beliefs, listed = planner.beliefs, planner.ranked(priors, shared)
    together = planner.sequences(listed)
    drawn = benches(beliefs, together[-1][0] if together else listed[:1])
    made = Plan(
        format=FORMAT,
        name=name,
        title=title,
        seed=planner.seed,
        card_sha256=card_sha256,
        basis=beliefs.basis,
        goal=planner.goal,
        costs=asdict(planner.costs),
        explanations=_entries(beliefs),
        entropy=beliefs.entropy,
        first=first_of(planner, listed),
        proposals=tuple(one.entry for one in listed),
        sequences=tuple(entry for _, entry in together),
        bench=tuple(one.entry for one in drawn),
        notes=beliefs.notes,
    )
    return made, drawn


def first_of(planner: Planner, listed: Sequence[Proposal]) -> str:
    """The first line of a plan: what to do next; empty where nothing would help."""
    beliefs = planner.beliefs
    if beliefs.wrong is not None:
        return beliefs.wrong
    return first_line([one.entry for one in listed], _entries(beliefs), beliefs.entropy, planner.goal)


def _entries(beliefs: Beliefs) -> tuple[ExplanationEntry, ...]:
    return tuple(ExplanationEntry(one.members, one.words, one.probability) for one in beliefs.explanations)
