"""Which effects of a board are known without a fit, and the board with some of them and without the others.

Each effect says itself whether it is known (`Effect.is_known`) and how it is computed then (`Effect.at_known_size`).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import combinations

from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.effects import EFFECTS, Effect

MOST_TOGETHER = 3
"""Known effects that are computed together, at most."""


def known_effects(board: Board) -> tuple[str, ...]:
    """Effects of known size that can act in a setup of the board, declared or not, in the order of the library."""
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if effect.is_known(board) and (name in board.effects or acting_at_known_size(board, name))
    )


def stated_effects(board: Board) -> tuple[str, ...]:
    """Known effects that the card states or declares: nothing about them is chosen by the readings."""
    return tuple(name for name in known_effects(board) if name in board.effects or EFFECTS[name].is_implied(board))


def every_combination(board: Board) -> list[tuple[str, ...]]:
    """Combinations of up to three known effects, fewer ones first, and of all that the card states."""
    names = known_effects(board)
    found = [one for n in range(min(MOST_TOGETHER, len(names)) + 1) for one in combinations(names, n)]
    stated = stated_effects(board)
    return [*found, *([stated] if len(stated) > MOST_TOGETHER else [])]


def with_combination(board: Board, combination: Sequence[str]) -> Board:
    """A board with some of its known effects and without the others, whether it declares them or not.

    What it declares and states in full stays as it is; every other size is fixed at the median of its prior.
    """
    others = [name for name in known_effects(board) if name in board.effects and name not in combination]
    kept, new = board.without(others), [name for name in combination if name not in board.effects]
    acting = [one for name in new for one in acting_at_known_size(board, name)]
    added = replace(kept, effects=(*kept.effects, *new), chosen=(*kept.chosen, *acting))
    sizes = {one.name: one for effect in acting for one in effect.parameters()}
    sizes |= {one.name: one for one in kept.uncertain if one.effect in combination and one.source}
    return added.with_parameters(replace(size, prior=Quantity.exact(size.prior.median)) for size in sizes.values())


def acting_at_known_size(board: Board, name: str) -> list[Effect]:
    """An effect at its known size in each setup in which it can act."""
    found = (EFFECTS[name].at_known_size(board, setup) for setup in board.setups)
    return [one for one in found if one is not None]


def is_stated_in_full(board: Board, names: Collection[str]) -> bool:
    """Whether the card leaves no size of these declared effects to a prior of the library."""
    return not any(one.source for one in board.uncertain if one.effect in names)


def in_order(names: Collection[str]) -> tuple[str, ...]:
    """Names of effects in the order of the library."""
    return tuple(name for name in EFFECTS if name in names)
