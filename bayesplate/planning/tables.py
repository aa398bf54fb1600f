"""A plan in words: its tables, its first line, and gains in sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from bayesplate.board.material import MODULI
from bayesplate.campaign.tables import shared_words
from bayesplate.effects.words import join_words
from bayesplate.planning.gains import CONSTANTS, EXPLANATIONS
from bayesplate.planning.plan import ExplanationEntry, Gain, Plan, ProposalEntry
from bayesplate.results.tables import Table
from bayesplate.results.words import hertz_range, percent

MOST_PROPOSALS = 12
"""Most proposals in a table; plan.json has all."""


def plan_tables(plan: Plan) -> tuple[Table, ...]:
    """Tables of explanations, proposals, sequences, and modes to look for at the bench; empty ones are left out."""
    tables = (_explanations(plan), _proposals(plan), _sequences(plan), *_benches(plan))
    return tuple(table for table in tables if table.rows)


def _explanations(plan: Plan) -> Table:
    rows = tuple((explanation.words, f"{100.0 * explanation.probability:.0f} %") for explanation in plan.explanations)
    return Table(f"What may be the case on {plan.name}", ("explanation", "probability"), rows if len(rows) > 1 else ())


def shared_names(plan: Plan) -> tuple[str, ...]:
    """The shared parameters that a plan without a goal shows in place of the moduli."""
    return tuple(plan.proposals[0].gain.shared) if plan.proposals and plan.goal is None else ()


def _columns(plan: Plan) -> tuple[str, ...]:
    names = tuple(map(shared_words, shared_names(plan))) or MODULI
    doubt = ("doubt falls by",) if len(plan.explanations) > 1 else ()
    return (*doubt, *names, "min", "gain", "gain /min")


def _cells(gain: Gain, cost: float, plan: Plan) -> tuple[str, ...]:
    doubt: tuple[str, ...] = ()
    if len(plan.explanations) > 1:
        drop = gain.explanations
        doubt = (str(percent(None if drop is None or not plan.entropy else drop / plan.entropy)),)
    shared = shared_names(plan)
    ratios = (gain.shared[name] for name in shared) if shared else (getattr(gain, name) for name in MODULI)
    shrunk = tuple(f"{100.0 * value:.0f} %" for value in ratios)
    return (*doubt, *shrunk, f"{cost:g}", f"{gain.score:.2f}", f"{gain.score_per_minute:.3f}")


def _proposals(plan: Plan) -> Table:
    rows = tuple(
        (proposal.sentence, *_cells(proposal.gain, proposal.cost_minutes, plan))
        for proposal in plan.proposals[:MOST_PROPOSALS]
    )
    return Table(
        f"What to measure next on {plan.name}: intervals after, in % of now{_over_boards(plan)}",
        ("proposal", *_columns(plan)),
        rows,
    )


def _over_boards(plan: Plan) -> str:
    return ", the mean over all boards" if plan.basis == "campaign" else ""


def _sequences(plan: Plan) -> Table:
    rows = tuple(
        (
            "\n".join(f"{number}. {step}" for number, step in enumerate(sequence.steps, start=1)),
            *_cells(sequence.gain, sequence.cost_minutes, plan),
        )
        for sequence in plan.sequences
    )
    return Table("The best two and the best three together", ("steps", *_columns(plan)), rows)


def _benches(plan: Plan) -> tuple[Table, ...]:
    return tuple(
        Table(
            f"At the bench, {f'board {bench.board}, ' if plan.basis == 'campaign' else ''}setup {bench.setup}"
            f"{f', with {bench.added_mass}' if bench.added_mass else ''}: "
            f"sensor at {_place_words(bench.sensor_mm)}, hammer at {_place_words(bench.hammer_mm)}",
            ("mode", "Hz", "likely Hz", "seen"),
            tuple(
                (mode.label, f"{mode.hz:.1f}", hertz_range(mode.low_hz, mode.high_hz), f"{100.0 * mode.seen:.0f} %")
                for mode in bench.modes
            ),
        )
        for bench in plan.bench
    )


def _place_words(place: tuple[float, float]) -> str:
    return f"x = {place[0]:.0f}, y = {place[1]:.0f} mm"


WORTHWHILE_GAIN = 0.05
"""Least gain, nats, that is a reason to measure: below it an interval would shrink by less than a twentieth."""
_CLEAR_ERRORS = 2.0
"""Standard errors by which a gain must exceed zero."""


def first_line(
    proposals: Sequence[ProposalEntry], explanations: Sequence[ExplanationEntry], entropy: float, goal: str | None
) -> str:
    """The best proposal that helps with the goal, with its expected gain, as a sentence; empty if there is none."""
    for proposal in proposals:
        shrunk, doubt = _shrunk_intervals(proposal.gain, goal), _doubt_words(proposal.gain, explanations, entropy)
        intervals = _interval_words(shrunk)
        by_goal = {None: doubt or intervals, EXPLANATIONS: doubt, CONSTANTS: intervals}
        if by_goal.get(goal, goal in shrunk):
            return f"{proposal.sentence}: {join_words([words for words in (doubt, intervals) if words])}."
    return ""


def _doubt_words(gain: Gain, explanations: Sequence[ExplanationEntry], entropy: float) -> str:
    """The fall of the doubt between explanations in words; empty where it is small or uncertain."""
    drop, error = gain.explanations, gain.explanations_error
    if drop is None or error is None or drop < max(WORTHWHILE_GAIN, _CLEAR_ERRORS * error):
        return ""
    return f"the doubt between {_explanation_words(explanations)} would fall by {percent(drop / entropy)}"


def _explanation_words(explanations: Sequence[ExplanationEntry]) -> str:
    """Explanations in words; the effects of a pair are marked "together", and "alone" where they are alone."""
    paired = {name for explanation in explanations if len(explanation.effects) > 1 for name in explanation.effects}
    ways = [
        "together" if len(explanation.effects) > 1 else "alone" if paired & {*explanation.effects} else ""
        for explanation in explanations
    ]
    return join_words(
        [f"{explanation.words} {way}".rstrip() for explanation, way in zip(explanations, ways, strict=True)]
    )


def _interval_words(shrunk: Mapping[str, float]) -> str:
    """The shrinkage of intervals in words."""
    if not shrunk:
        return ""
    noun, verb = ("interval", "it is") if len(shrunk) == 1 else ("intervals", "they are")
    sizes = join_words(
        [f"{100.0 * value:.0f}" if value >= 0.1 else f"{100.0 * value:.2g}" for value in shrunk.values()]
    )
    return f"the {noun} of {join_words(list(shrunk))} would shrink to {sizes} % of what {verb}"


def _shrunk_intervals(gain: Gain, goal: str | None) -> dict[str, float]:
    """Ratio after over before of each interval that shrinks by a worthwhile amount, beyond its error.

    The intervals of shared parameters, where boards share some and no goal was given, otherwise those of the moduli.
    """
    shared = {shared_words(name): value for name, value in gain.shared.items()} if goal is None else {}
    ratios = shared or {name: getattr(gain, name) for name in MODULI}
    least = max(WORTHWHILE_GAIN, _CLEAR_ERRORS * gain.constants_error)
    return {name: value for name, value in ratios.items() if -math.log(value) >= least}
