"""Which part of the whole board vibrates: the strip that each side's clamps leave, and what grows along it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board, Values
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Variation

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Part:
    """The vibrating part of one side, by nominal sizes.

    Attributes
    ----------
    start, share : float
        Where it begins and how long it is, as fractions of the whole side.
    """

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
    """The part of a side ("x" or "y") that the clamps of a setup leave."""
    covered = {edge: quantity.mean for edge, quantity in setup.clamped.items()}
    low, high = covered.get(f"{axis}0", 0.0), covered.get(f"{axis}1", 0.0)
    side = board.inputs[f"length_{axis}"].mean
    return Part(low / side, (side - low - high) / side)


def growing_along_x(part: Part, gradient: Callable[[Values], Floats]) -> tuple[Variation, Variation]:
    """A property 1 + g (s - 1/2) times its mean over the whole board, s from 0 to 1 along x.

    Parameters
    ----------
    part : Part
        What vibrates of the side x.
    gradient : callable
        From the values to g, a number or an (n_draws,) array.

    Returns
    -------
    tuple of Variation
        The property as at the middle of the vibrating part, and what grows along x from there.
    """
    return (
        Variation(None, lambda values: 1.0 + gradient(values) * part.middle),
        Variation(_from_middle, lambda values: gradient(values) * part.share),
    )


def _from_middle(x: Floats, y: Floats) -> Floats:
    return x - 0.5 + 0.0 * y
