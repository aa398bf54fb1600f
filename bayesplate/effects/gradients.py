"""A property of the wood that grows along the board, so that its two ends differ: the base of two effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from bayesplate.board.board import Board
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Effect, Floats, Scope, Variation
from bayesplate.effects.part import WHOLE_SIDE, VibratingPart, vibrating_part
from bayesplate.plate.fields import TermGroup


@dataclass(frozen=True)
class GradientAlongX(Effect):
    """A property 1 + g (s - 1/2) times its mean, s from 0 to 1 along the whole board."""

    part: VibratingPart = WHOLE_SIDE  # the vibrating part along x

    scope: ClassVar[Scope] = "board"
    default: ClassVar[Quantity]
    source: ClassVar[str]
    groups: ClassVar[tuple[TermGroup, ...]]  # of terms that the property is a factor of

    @classmethod
    def of(cls, board: Board, setup: Setup) -> Self:
        return cls(part=vibrating_part(board, setup, "x"))

    def in_setup(self, board: Board, setup: Setup) -> Self:
        return replace(self, part=vibrating_part(board, setup, "x"))

    def parameters(self) -> tuple[Parameter, ...]:
        return (self.parameter("gradient", self.default, "1", 0.0, self.source),)

    def keeps_symmetry(self) -> tuple[bool, bool]:
        return False, True

    def variations(self) -> Mapping[TermGroup, tuple[Variation, ...]]:
        """The property as at the middle of the vibrating part, and what grows along x from there."""
        at_middle = Variation(None, lambda values: 1.0 + self.value(values, "gradient") * self.part.middle)
        growing = Variation(_from_middle, lambda values: self.value(values, "gradient") * self.part.share)
        return dict.fromkeys(self.groups, (at_middle, growing))


def _from_middle(x: Floats, y: Floats) -> Floats:
    return x - 0.5 + 0.0 * y
