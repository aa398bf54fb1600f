"""Density gradient: the wood is denser at one end of the board than at the other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from bayesplate.effects.base import Effect, EffectParameter, Floats, Scope
from bayesplate.effects.part import WHOLE, Part, vibrating_part
from bayesplate.modes.fields import Field, Group
from bayesplate.plate.board import Board, Values
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

    def parameters(self) -> tuple[EffectParameter, ...]:
        """Relative growth of the density from x = 0 to the other end."""
        return (EffectParameter("gradient", "1", DEFAULT_GRADIENT, _SOURCE),)

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """The two ends along x differ."""
        return False, True

    def fields(self) -> Mapping[Group, tuple[Field | None, ...]]:
        """Inertia as it is, and growing along x from the middle of the vibrating part."""
        return dict.fromkeys(("mass", "rotary"), (None, _along_x))

    def field_weights(self, values: Values) -> Mapping[Group, tuple[Floats, ...]]:
        """Density at the middle of the vibrating part, and its growth over that part, both relative to the mean."""
        gradient = self.value(values, "gradient")
        return dict.fromkeys(("mass", "rotary"), (1.0 + gradient * self.part.middle, gradient * self.part.share))


def _along_x(x: Floats, y: Floats) -> Floats:
    return x - 0.5 + 0.0 * y
