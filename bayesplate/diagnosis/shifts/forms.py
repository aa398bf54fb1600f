"""The forms in which the search tries each effect that is not declared: a board with it, and its free parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

from bayesplate.effects import EFFECTS, declare, effects_of
from bayesplate.effects.base import Effect, Floats
from bayesplate.plate.board import Board, vibrating_lengths
from bayesplate.plate.setup import AttachedItem, Setup
from bayesplate.quantities import Quantity

MASS = "attached_mass"


@dataclass(frozen=True)
class Free:
    """A free parameter of an effect.

    Attributes
    ----------
    name, unit : str
        SI.
    prior : Quantity
    keys : tuple of str
        The board's inputs that take its value: one a setup in which the effect acts. In the search it has one value in
        all setups; a refit lets each setup have its own.
    nominal : float
        A representative size.
    """

    name: str
    unit: str
    prior: Quantity
    keys: tuple[str, ...]
    nominal: float


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
    result = {}
    for name in EFFECTS:
        if name in board.effects and name != MASS:
            continue
        found = tuple(_forms_of(board, name))
        if found:
            result[name] = found
    return result


def _forms_of(board: Board, name: str) -> Iterator[Form]:
    if name == MASS and not any(setup.attached for setup in board.setups):
        yield from _forgotten(board)
        return
    if name in board.effects:
        return
    tried = {s.name: EFFECTS[name].candidates(board, s) for s in board.setups if not EFFECTS[name].refusal(board, s)}
    acting = {setup: found for setup, found in tried.items() if found}
    if not acting:
        return
    for together in zip_longest(*acting.values()):
        chosen = tuple(
            effect or EFFECTS[name].candidates(board, setup)[0]
            for effect, setup in zip(together, (s for s in board.setups if s.name in acting), strict=True)
        )
        declared = replace(board, effects=(*board.effects, name), chosen=(*board.chosen, *chosen))
        yield _form(name, _detail(chosen[0]), declared, board.setups)


def _forgotten(board: Board) -> Iterator[Form]:
    """One small thing that nobody mentioned, at one of a few places, the same in all setups."""
    lists = [EFFECTS[MASS].candidates(board, setup) for setup in board.setups]
    most = max(range(len(lists)), key=lambda i: len(lists[i]))
    setup = board.setups[most]
    nominal = board.nominal()
    sides = [float(side) for side in vibrating_lengths(nominal, setup)]
    covered = [float(nominal[setup.input_name(e)]) if e in setup.clamped else 0.0 for e in ("x0", "y0")]
    for effect in lists[most]:
        (item,) = effect.items  # type: ignore[attr-defined]
        (fractions,) = item.places
        x, y = (c + f * side for c, f, side in zip(covered, fractions, sides, strict=True))
        thing = AttachedItem("weight", ((x, y),), item.mass)
        declared = replace(
            board,
            effects=(*board.effects, MASS),
            setups=tuple(replace(s, attached=(thing,)) for s in board.setups),
        )
        yield _form(MASS, f"at {1e3 * x:.0f}, {1e3 * y:.0f} mm", declared, declared.setups)


def _detail(effect: Effect) -> str:
    axis = getattr(effect, "axis", "")
    return f"along {axis}" if axis in ("x", "y") else ""


def _form(name: str, detail: str, board: Board, setups: tuple[Setup, ...]) -> Form:
    board = declare(board)
    found: dict[str, Free] = {}
    for setup in setups:
        for effect in effects_of(board, setup):
            if effect.name != name:
                continue
            for parameter in effect.parameters():
                if parameter.prior.is_exact:
                    continue
                key = effect.key(parameter.name)
                earlier = found.get(parameter.name)
                keys = (key,) if earlier is None else tuple(dict.fromkeys((*earlier.keys, key)))
                found[parameter.name] = Free(
                    parameter.name, parameter.unit, parameter.prior, keys, float(parameter.nominal)
                )
    return Form(name, detail, board, tuple(found.values()))


def sizes(form: Form, values: Mapping[str, Floats]) -> dict[str, Floats]:
    """Inputs of the board from values of the free parameters."""
    return {key: values[free.name] for free in form.free for key in free.keys}


def with_forms(board: Board, added: Sequence[Form]) -> Board:
    """A board with the effects of some forms declared together."""
    for form in added:
        attached = {setup.name: setup.attached for setup in form.board.setups}
        board = replace(
            board,
            effects=tuple(dict.fromkeys((*board.effects, *form.board.effects))),
            chosen=tuple(dict.fromkeys((*board.chosen, *form.board.chosen))),
            setups=tuple(replace(setup, attached=attached[setup.name] or setup.attached) for setup in board.setups),
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
