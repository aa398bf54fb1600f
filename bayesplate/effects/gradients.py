"""What two effects share: a property of the wood that grows along the board, so that its two ends differ."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

from bayesplate.board.board import Board
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Effect, Scope
from bayesplate.effects.part import WHOLE, Part, vibrating_part


@dataclass(frozen=True)
class GradientAlongX(Effect):
    """A property 1 + g (s - 1/2) times its mean, s from 0 to 1 along the whole board."""

    part: Part = WHOLE  # what vibrates of the board along x

    scope: ClassVar[Scope] = "board"
    default: ClassVar[Quantity]
    source: ClassVar[str]

    @classmethod
    def of(cls, board: Board, setup: Setup) -> Self:
        return cls(part=vibrating_part(board, setup, "x"))

    def in_setup(self, board: Board, setup: Setup) -> Self:
        return replace(self, part=vibrating_part(board, setup, "x"))

    def parameters(self) -> tuple[Parameter, ...]:
        return (self.parameter("gradient", self.default, "1", 0.0, self.source),)

    def keeps_symmetry(self) -> tuple[bool, bool]:
        return False, True
