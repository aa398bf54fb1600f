"""What a card states, in the units of its keys, from the board that was read."""

from __future__ import annotations

from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.labels import Label


def frequencies(setup: Setup) -> dict[Label, Quantity]:
    """Quantity of every label, Hz."""
    return {reading.label: reading.frequency for reading in setup.readings}


def millimetres(board: Board, *names: str) -> tuple[float, ...]:
    """Means of some of its lengths."""
    return tuple(round(1e3 * board.inputs[name].mean, 9) for name in names)
