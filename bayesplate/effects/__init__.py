"""Effects that an ideal plate lacks: one protocol (`base.py`), one file for each effect, and the library of them here.

The list of effects is that of the words a card may use (`bayesplate.board.words.EFFECT_NAMES`); the file of an effect
bears its name. `clamps`, `gradients` and `attached_items` are what several effects have in common, `drives` what an
exciter is made of, `part` which part of the board vibrates, `field_components` the few directions of an uncertain
thickness or width that matter, and `words` the names of effects in sentences. How to add one: CONTRIBUTING.md.
"""

from __future__ import annotations

from importlib import import_module

from bayesplate.board.board import Board
from bayesplate.board.setup import Setup
from bayesplate.board.words import EFFECT_NAMES
from bayesplate.effects.base import Effect
from bayesplate.errors import Fault


def _effect_of(name: str) -> type[Effect]:
    """The effect that the file of that name defines."""
    defined = vars(import_module(f"bayesplate.effects.{name}")).values()
    return next(member for member in defined if isinstance(member, type) and getattr(member, "name", "") == name)


EFFECTS: dict[str, type[Effect]] = {name: _effect_of(name) for name in EFFECT_NAMES}
"""Every effect of the library by name."""

__all__ = ["EFFECTS", "Effect", "declare", "effect_faults", "effects_of", "implied_effects", "notes"]


def effects_of(board: Board, setup: Setup) -> tuple[Effect, ...]:
    """The declared effects as they act in a setup, in the order of the library whatever that of their declaration."""
    effects = []
    for name, effect in EFFECTS.items():
        if name not in board.effects:
            continue
        if any(choice.name == name for choice in board.effect_forms):
            effects += _chosen_form(board, setup, name)
        elif not effect.refusal(board, setup):
            effects.append(effect.of(board, setup))
    return tuple(effects)


def _chosen_form(board: Board, setup: Setup, name: str) -> list[Effect]:
    """The form of an effect that was chosen for a setup, otherwise the form chosen for the board; none or one."""
    forms = {form.owner: form for form in board.effect_forms if form.name == name}
    if setup.owner in forms:
        return [forms[setup.owner]]
    of_board = next((form for form in forms.values() if form.scope == "board"), None)
    acting = None if of_board is None else of_board.in_setup(board, setup)
    return [] if acting is None else [acting]


def implied_effects(board: Board) -> tuple[str, ...]:
    """Effects that the card declares by what it states, where they can act or a setup states them.

    None where the card declares an empty list of effects.
    """
    if not board.has_implied_effects:
        return ()
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if effect.is_implied(board)
        and any(effect.is_wanted(setup) or not effect.refusal(board, setup) for setup in board.setups)
    )


def declare(board: Board) -> Board:
    """A board whose parameters hold those of its declared effects, so that they are known or marginalised."""
    return board.with_parameters(
        parameter for setup in board.setups for effect in effects_of(board, setup) for parameter in effect.parameters()
    )


def notes(board: Board) -> tuple[str, ...]:
    """Sentences of every effect on a board with its declared effects; see `Effect.notes`."""
    return tuple(sentence for effect in EFFECTS.values() for sentence in effect.notes(board))


def effect_faults(board: Board) -> list[Fault]:
    """Declared effects that act in no setup of the board, or not in the setup that states them, with the reasons."""
    faults = []
    file = f"{board.name}.toml"
    for name in board.effects:
        effect = EFFECTS.get(name)
        if effect is None:
            faults.append(Fault(f"{file} effects", f"one of {', '.join(EFFECTS)}", name))
            continue
        reasons = [effect.refusal(board, setup) for setup in board.setups]
        places = [
            f"{file} [setup]" if len(board.setups) == 1 else f'{file} [[setup]] {number} "{setup.name}"'
            for number, setup in enumerate(board.setups, start=1)
        ]
        wanting = [
            Fault(place, f"a setup in which {name} can act", reason)
            for place, reason, setup in zip(places, reasons, board.setups, strict=True)
            if reason and effect.is_wanted(setup)
        ]
        if wanting:
            faults += wanting
        elif all(reasons):
            wanted = f"a board on which {name} can act"
            faults.append(Fault(f"{file} effects", wanted, reasons[0], f"leave {name} out of the effects"))
    return faults
