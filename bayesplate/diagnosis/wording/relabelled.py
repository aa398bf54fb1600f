"""Peaks that are another mode once an effect has been added: a sentence."""

from __future__ import annotations

from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.effects.words import joined
from bayesplate.labels import Label


def relabelled_sentence(before: Board, after: Board, words: str) -> str:
    """Which peaks have another label in the model after than in the one before; empty where none has.

    Parameters
    ----------
    before, after : Board
        With the labels that their draws make likely.
    words : str
        What was added.
    """
    first, second = _labels(before), _labels(after)
    changed = []
    for key in sorted(first.keys() | second.keys(), key=lambda each: (each[0], each[1].mean)):
        one, other = first.get(key), second.get(key)
        if one != other:
            where = f" in setup {key[0]}" if len(before.setups) > 1 else ""
            instead = "no likely mode" if other is None else str(other)
            was = "had no likely mode" if one is None else f"was {one}"
            changed.append(f"{key[1].mean:.5g} Hz{where} is {instead} (it {was})")
    return f"With {words} some peaks are other modes: {joined(changed)}." if changed else ""


def _labels(board: Board) -> dict[tuple[str, Quantity], Label]:
    """Labels by setup and frequency of the peak."""
    return {(setup.name, reading.frequency): reading.label for setup in board.setups for reading in setup.readings}
