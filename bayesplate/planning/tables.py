"""The tables that people read of a plan."""

from __future__ import annotations

from bayesplate.board.material import MODULI
from bayesplate.planning.plan import Gain, Plan
from bayesplate.planning.words import shared_words
from bayesplate.results.tables import Table
from bayesplate.results.words import MISSING

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
    doubt = ("doubt, nats",) if len(plan.explanations) > 1 else ()
    return (*doubt, *names, "min", "gain", "gain /min")


def _cells(gain: Gain, cost: float, plan: Plan) -> tuple[str, ...]:
    doubt: tuple[str, ...] = ()
    if len(plan.explanations) > 1:
        told = gain.explanations is not None and gain.explanations_error is not None
        doubt = (f"{gain.explanations:.2f} ± {gain.explanations_error:.2f}" if told else MISSING,)
    left = gain.shared.values() if gain.shared else (getattr(gain, name) for name in MODULI)
    shrunk = tuple(f"{100.0 * value:.0f} %" for value in left)
    return (*doubt, *shrunk, f"{cost:g}", f"{gain.score:.2f}", f"{gain.score_per_minute:.3f}")


def _proposals(plan: Plan) -> Table:
    rows = tuple((one.sentence, *_cells(one.gain, one.cost_minutes, plan)) for one in plan.proposals[:MOST])
    return Table(f"What to measure next on {plan.name}: intervals after, of now", ("proposal", *_columns(plan)), rows)


def _sequences(plan: Plan) -> Table:
    rows = tuple(("\n".join(_numbered(one.steps)), *_cells(one.gain, one.cost_minutes, plan)) for one in plan.sequences)
    return Table("The best two and the best three together", ("steps", *_columns(plan)), rows)


def _numbered(steps: tuple[str, ...]) -> list[str]:
    return [f"{number}. {step}" for number, step in enumerate(steps, start=1)]


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
