"""The forms in which the search tries each effect that is not declared: a board with it, and its free parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from bayesplate.effects import EFFECTS, declare
from bayesplate.effects.base import EffectForm, Floats
from bayesplate.plate.board import Board
from bayesplate.plate.parameter import Parameter
from bayesplate.quantities import Quantity


@dataclass(frozen=True)
class Free:
    """A free parameter of an effect.

    Attributes
    ----------
    name, unit : str
        SI.
    prior : Quantity
    keys : tuple of str
        The board's parameters that take its value: one per owner. In the search it has one value for all of them; a
        refit lets each have its own.
    nominal : float
        A representative size.
    null : float
        The value at which the effect is absent.
    """

    name: str
    unit: str
    prior: Quantity
    keys: tuple[str, ...]
    nominal: float
    null: float


@dataclass(frozen=True, eq=False)
class Form:
    """One way in which an effect may be present.

    Attributes
    ----------
    effect : str
    detail : str
        What tells it from the effect's other forms; empty if there are none.
    board : Board
        The board with the effect declared.
    free : tuple of Free
        Parameters that have an uncertainty.
    """

    effect: str
    detail: str
    board: Board
    free: tuple[Free, ...]

    @property
    def title(self) -> str:
        """Effect and detail."""
        return f"{self.effect} ({self.detail})" if self.detail else self.effect


def forms(board: Board) -> dict[str, tuple[Form, ...]]:
    """Every form of every effect that is not declared and can act in a setup of the board.

    Parameters
    ----------
    board : Board

    Returns
    -------
    dict
        Effect name -> its forms, which share the effect's prior probability equally.
    """
    tried = {name: effect.forms(board) for name, effect in EFFECTS.items() if name not in board.effects}
    return {name: tuple(_form(board, name, one) for one in found) for name, found in tried.items() if found}


def _form(board: Board, name: str, form: EffectForm) -> Form:
    declared = declare(replace(board, effects=(*board.effects, name), chosen=(*board.chosen, *form.effects)))
    by_key: dict[str, list[Parameter]] = {}
    for effect in form.effects:
        for parameter in effect.parameters():
            if not parameter.prior.is_exact:
                by_key.setdefault(parameter.key, []).append(parameter)
    return Form(name, form.detail, declared, tuple(_free(key, each) for key, each in by_key.items()))


def _free(key: str, owned: Sequence[Parameter]) -> Free:
    """One value for the parameters that share a key: the first one's prior stands for all."""
    first = owned[0]
    assert first.null is not None
    keys = tuple(dict.fromkeys(parameter.name for parameter in owned))
    return Free(key, first.unit, first.prior, keys, first.nominal, first.null)


def sizes(form: Form, values: Mapping[str, Floats]) -> dict[str, Floats]:
    """Inputs of the board from values of the free parameters."""
    return {key: values[free.name] for free in form.free for key in free.keys}


def with_forms(board: Board, added: Sequence[Form]) -> Board:
    """A board with the effects of some forms declared together."""
    for form in added:
        board = replace(
            board,
            effects=tuple(dict.fromkeys((*board.effects, *form.board.effects))),
            chosen=tuple(dict.fromkeys((*board.chosen, *form.board.chosen))),
        )
    return declare(board)


def with_labels_exchanged(board: Board, first: int, second: int) -> Board:
    """A board on which two readings of one setup have exchanged their labels.

    Parameters
    ----------
    board : Board
    first, second : int
        Indices among the readings of all setups.
    """
    start = 0
    setups = []
    for setup in board.setups:
        readings = list(setup.readings)
        i, j = first - start, second - start
        if 0 <= i < len(readings) and 0 <= j < len(readings):
            one, other = readings[i], readings[j]
            readings[i] = replace(one, label=other.label, beams=other.beams)
            readings[j] = replace(other, label=one.label, beams=one.beams)
        start += len(readings)
        setups.append(replace(setup, readings=tuple(readings)))
    return replace(board, setups=tuple(setups))
