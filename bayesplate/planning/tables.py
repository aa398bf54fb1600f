"""A plan as people read it: tables, the first line, and gains in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from bayesplate.board.material import MODULI
from bayesplate.campaign.tables import shared_words
from bayesplate.effects.words import joined
from bayesplate.planning.gains import CONSTANTS, EXPLANATIONS
from bayesplate.planning.plan import ExplanationEntry, Gain, Plan, ProposalEntry
from bayesplate.results.tables import Table
from bayesplate.results.words import percent

MOST = 12
"""Proposals that a table lists; plan.json has all."""


def plan_tables(plan: Plan) -> tuple[Table, ...]:
    """Explanations, proposals, sequences, and what to look for at the bench; empty ones left out."""
    every = (_explanations(plan), _proposals(plan), _sequences(plan), *_benches(plan))
    return tuple(table for table in every if table.rows)


def _explanations(plan: Plan) -> Table:
    rows = tuple((one.words, f"{100.0 * one.probability:.0f} %") for one in plan.explanations)
    return Table(f"What may be the case on {plan.name}", ("explanation", "probability"), rows if len(rows) > 1 else ())


def _columns(plan: Plan) -> tuple[str, ...]:
    shared = plan.proposals[0].gain.shared if plan.proposals else {}
    names = tuple(shared_words(name) for name in shared) if shared else MODULI
    doubt = ("doubt falls by",) if len(plan.explanations) > 1 else ()
    return (*doubt, *names, "min", "gain", "gain /min")


def _cells(gain: Gain, cost: float, plan: Plan) -> tuple[str, ...]:
    doubt: tuple[str, ...] = ()
    if len(plan.explanations) > 1:
        drop = gain.explanations
        doubt = (str(percent(None if drop is None or not plan.entropy else drop / plan.entropy)),)
    left = gain.shared.values() if gain.shared else (getattr(gain, name) for name in MODULI)
    shrunk = tuple(f"{100.0 * value:.0f} %" for value in left)
    return (*doubt, *shrunk, f"{cost:g}", f"{gain.score:.2f}", f"{gain.score_per_minute:.3f}")


def _proposals(plan: Plan) -> Table:
    rows = tuple((one.sentence, *_cells(one.gain, one.cost_minutes, plan)) for one in plan.proposals[:MOST])
    return Table(
        f"What to measure next on {plan.name}: intervals after, in % of now", ("proposal", *_columns(plan)), rows
    )


def _sequences(plan: Plan) -> Table:
    rows = tuple(
        (
            "\n".join(f"{number}. {step}" for number, step in enumerate(one.steps, start=1)),
            *_cells(one.gain, one.cost_minutes, plan),
        )
        for one in plan.sequences
    )
    return Table("The best two and the best three together", ("steps", *_columns(plan)), rows)


def _benches(plan: Plan) -> tuple[Table, ...]:
    return tuple(
        Table(
            f"At the bench, setup {one.setup}: sensor at {_place(one.sensor_mm)}, hammer at {_place(one.hammer_mm)}",
            ("mode", "Hz", "likely Hz", "seen"),
            tuple(
                (mode.label, f"{mode.hz:.1f}", f"{mode.low_hz:.1f} to {mode.high_hz:.1f}", f"{100.0 * mode.seen:.0f} %")
                for mode in one.modes
            ),
        )
        for one in plan.bench
    )


def _place(place: tuple[float, float]) -> str:
    return f"x = {place[0]:.0f}, y = {place[1]:.0f} mm"


WORTH = 0.05
"""A gain below this, nats, is no reason to measure: an interval would shrink by less than a twentieth."""
_CLEAR = 2.0
"""Standard errors that a gain must stand above zero."""


def first_line(
    proposals: Sequence[ProposalEntry], explanations: Sequence[ExplanationEntry], entropy: float, goal: str | None
) -> str:
    """What to do next and what it is expected to give: the best proposal that helps with the goal; empty if none."""
    for one in proposals:
        shrunk, doubt = _shrunk(one.gain, goal), _of_doubt(one.gain, explanations, entropy)
        intervals = _of_intervals(shrunk)
        by_goal = {None: doubt or intervals, EXPLANATIONS: doubt, CONSTANTS: intervals}
        if by_goal.get(goal, goal in shrunk):
            return f"{one.sentence}: {joined([words for words in (doubt, intervals) if words])}."
    return ""


def _of_doubt(gain: Gain, explanations: Sequence[ExplanationEntry], entropy: float) -> str:
    """How far the doubt between explanations would fall, in words; empty where it is not clear that it would."""
    drop, error = gain.explanations, gain.explanations_error
    if drop is None or error is None or drop < max(WORTH, _CLEAR * error):
        return ""
    return f"the doubt between {_names(explanations)} would fall by {percent(drop / entropy)}"


def _names(explanations: Sequence[ExplanationEntry]) -> str:
    """Explanations in words; where one is two effects, it is told which of them are meant to be alone."""
    paired = {name for one in explanations if len(one.effects) > 1 for name in one.effects}
    ways = ["together" if len(one.effects) > 1 else "alone" if paired & {*one.effects} else "" for one in explanations]
    return joined([f"{one.words} {way}".rstrip() for one, way in zip(explanations, ways, strict=True)])


def _of_intervals(shrunk: Mapping[str, float]) -> str:
    """How far intervals would shrink, in words."""
    if not shrunk:
        return ""
    noun, verb = ("interval", "it is") if len(shrunk) == 1 else ("intervals", "they are")
    sizes = joined([f"{100.0 * value:.0f}" if value >= 0.1 else f"{100.0 * value:.2g}" for value in shrunk.values()])
    return f"the {noun} of {joined(list(shrunk))} would shrink to {sizes} % of what {verb}"


def _shrunk(gain: Gain, goal: str | None) -> dict[str, float]:
    """What is left of each interval that shrinks by as much as is worth telling, and for sure.

    Those of what boards share, where they share something and nothing else was asked for.
    """
    shared = {shared_words(name): value for name, value in gain.shared.items()} if goal is None else {}
    left = shared or {name: getattr(gain, name) for name in MODULI}
    least = max(WORTH, _CLEAR * gain.constants_error)
    return {name: value for name, value in left.items() if -math.log(value) >= least}
