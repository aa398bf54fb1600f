"""Which part of the whole board vibrates: the strip that each side's clamps leave, its shape and its mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesplate.board.board import Board, Values, density, vibrating_lengths
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Floats


@dataclass(frozen=True)
class Part:
    """The vibrating part of one side, by nominal sizes, as fractions of the whole side."""

    start: float = 0.0
    share: float = 1.0

    @property
    def middle(self) -> float:
        """Its middle, as a fraction of the whole side, counted from the middle of that."""
        return self.start + 0.5 * self.share - 0.5

    def on_whole(self, fraction: Floats) -> Floats:
        """Fractions of the whole side from fractions of the vibrating one."""
        return self.start + self.share * fraction


WHOLE = Part()


def vibrating_part(board: Board, setup: Setup, axis: str) -> Part:
    covered = {edge: quantity.mean for edge, quantity in setup.clamped.items()}
    low, high = covered.get(f"{axis}0", 0.0), covered.get(f"{axis}1", 0.0)
    side = board.inputs[f"length_{axis}"].mean
    return Part(low / side, (side - low - high) / side)


def aspect_ratio_of(values: Values, setup: Setup) -> float:
    """L_x / L_y of the vibrating part."""
    length_x, length_y = vibrating_lengths(values, setup)
    return float(length_x / length_y)


def vibrating_mass(values: Values, setup: Setup) -> Floats:
    """Mass of the vibrating part, kg, as of the whole rectangle: a number or an (n_draws,) array."""
    length_x, length_y = vibrating_lengths(values, setup)
    return np.asarray(density(values) * values["thickness"] * length_x * length_y)
