"""The forms in which the search tries each effect that is not declared: a board with it, and its free parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bayesplate.board.board import Board
from bayesplate.board.parameter import Parameter
from bayesplate.effects import EFFECTS, declare
from bayesplate.effects.base import EffectForm


@dataclass(frozen=True, eq=False)
class Form:
    """One form in which an effect may be present."""

    effect: str
    detail: str  # what tells it from the effect's other forms; empty if there are none
    board: Board  # the board with the effect declared
    free: tuple[Parameter, ...]  # parameters that have an uncertainty, one per owner: two setups' masses are two

    @property
    def title(self) -> str:
        return f"{self.effect} ({self.detail})" if self.detail else self.effect


def forms(board: Board) -> dict[str, tuple[Form, ...]]:
    """Forms of each effect that is not declared and can act, by effect; they share its prior probability equally."""
    forms_by_effect = {name: effect.forms(board) for name, effect in EFFECTS.items() if name not in board.effects}
    return {
        name: tuple(_form(board, name, form) for form in effect_forms)
        for name, effect_forms in forms_by_effect.items()
        if effect_forms
    }


def _form(board: Board, name: str, form: EffectForm) -> Form:
    declared_board = declare(
        replace(board, effects=(*board.effects, name), effect_forms=(*board.effect_forms, *form.effects))
    )
    parameters = {parameter.name: parameter for effect in form.effects for parameter in effect.parameters()}
    return Form(
        name,
        form.detail,
        declared_board,
        tuple(parameter for parameter in parameters.values() if not parameter.prior.is_exact),
    )


def with_forms(board: Board, added_forms: Sequence[Form]) -> Board:
    """A board with the effects of some forms declared together."""
    for form in added_forms:
        board = replace(
            board,
            effects=tuple(dict.fromkeys((*board.effects, *form.board.effects))),
            effect_forms=tuple(dict.fromkeys((*board.effect_forms, *form.board.effect_forms))),
        )
    return declare(board)


def with_labels_exchanged(board: Board, first: int, second: int) -> Board:
    """A board on which two readings of one setup, by their indices among all, have exchanged their labels."""
    start = 0
    setups = []
    for setup in board.setups:
        readings = list(setup.readings)
        i, j = first - start, second - start
        if 0 <= i < len(readings) and 0 <= j < len(readings):
            first_reading, second_reading = readings[i], readings[j]
            readings[i] = replace(first_reading, label=second_reading.label, beams=second_reading.beams)
            readings[j] = replace(second_reading, label=first_reading.label, beams=first_reading.beams)
        start += len(readings)
        setups.append(replace(setup, readings=tuple(readings)))
    return replace(board, setups=tuple(setups))
