"""Which part of the whole board vibrates: the strip that each side's clamps leave, its shape and its mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesplate.board.board import Board, Values, board_density, vibrating_lengths
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Floats


@dataclass(frozen=True)
class VibratingPart:
    """The vibrating part of one side, at nominal sizes, as fractions of the whole side."""

    start: float = 0.0
    share: float = 1.0

    @property
    def middle(self) -> float:
        """Distance of its middle from the middle of the whole side, as a fraction of that side."""
        return self.start + 0.5 * self.share - 0.5

    def on_whole(self, fraction: Floats) -> Floats:
        """Fractions of the whole side from fractions of the vibrating one."""
        return self.start + self.share * fraction


WHOLE_SIDE = VibratingPart()


def vibrating_part(board: Board, setup: Setup, axis: str) -> VibratingPart:
    covered = {edge: quantity.mean for edge, quantity in setup.clamped.items()}
    low, high = covered.get(f"{axis}0", 0.0), covered.get(f"{axis}1", 0.0)
    side = board.inputs[f"length_{axis}"].mean
    return VibratingPart(low / side, (side - low - high) / side)


def aspect_ratio_of(values: Values, setup: Setup) -> float:
    """L_x / L_y of the vibrating part."""
    length_x, length_y = vibrating_lengths(values, setup)
    return float(length_x / length_y)


def vibrating_mass(values: Values, setup: Setup) -> Floats:
    """Mass of the vibrating part, kg, as of the whole rectangle: a number or an (n_draws,) array."""
    length_x, length_y = vibrating_lengths(values, setup)
    return np.asarray(board_density(values) * values["thickness"] * length_x * length_y)
