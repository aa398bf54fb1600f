"""Density gradient: the wood is denser at one end of the board than at the other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from bayesplate.effects.base import Effect, Scope, Variation
from bayesplate.effects.part import WHOLE, Part, growing_along_x, vibrating_part
from bayesplate.modes.fields import Group
from bayesplate.plate.board import Board
from bayesplate.plate.parameter import Parameter
from bayesplate.plate.setup import Setup
from bayesplate.quantities import Quantity

DEFAULT_GRADIENT = Quantity.from_mean(0.0, 0.05, "normal")
_SOURCE = "normal: density varies by a few per cent along one plank; a board is not heavier at a known end"


@dataclass(frozen=True)
class DensityGradient(Effect):
    """Density 1 + g (s - 1/2) times its mean, s from 0 to 1 along the whole board; its total mass stays.

    Only the inertia follows: elastic constants that go with density are not part of this effect.

    Attributes
    ----------
    part : Part
        What vibrates of the board along x.
    """

    part: Part = WHOLE

    name: ClassVar[str] = "density_gradient"
    scope: ClassVar[Scope] = "board"
    sentence: ClassVar[str] = "The wood is heavier towards one end, so modes that move that end ring lower."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> DensityGradient:
        """The effect on the part of the board that vibrates."""
        return cls(part=vibrating_part(board, setup, "x"))

    def in_setup(self, board: Board, setup: Setup) -> DensityGradient:
        """The same gradient on the part of the board that vibrates in another setup."""
        return replace(self, part=vibrating_part(board, setup, "x"))

    def parameters(self) -> tuple[Parameter, ...]:
        """Relative growth of the density from x = 0 to the other end."""
        return (self.parameter("gradient", DEFAULT_GRADIENT, "1", 0.0, _SOURCE),)

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """The two ends along x differ."""
        return False, True

    def variations(self) -> Mapping[Group, tuple[Variation, ...]]:
        """Inertia that grows along x."""
        inertia = growing_along_x(self.part, lambda values: self.value(values, "gradient"))
        return dict.fromkeys(("mass", "rotary"), inertia)
