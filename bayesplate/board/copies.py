"""What was measured on a board, in a few characters: boards of other names that have the same are one, or a copy."""

from __future__ import annotations

import hashlib

from bayesplate.board.board_card import BoardCard


def readings_sha256(card: BoardCard) -> str:
    """Hash of the sizes, the mass and the frequencies of a card: of numbers alone, however they are written."""
    read = [(one.name, sorted(one.frequencies_hz.items()), one.unlabelled_hz, one.peaks) for one in card.setups]
    return hashlib.sha256(repr((card.plate, read)).encode()).hexdigest()
