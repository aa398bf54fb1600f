"""Base of the two clamp effects: which edges are clamped, and springs of one stiffness along them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Self

import numpy as np

from bayesplate.board.board import Board, Values, board_density, vibrating_lengths
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Contribution, Effect, Floats, Scope, Stiffness
from bayesplate.plate.terms import EdgeTerm

ClampedEnds = tuple[tuple[bool, bool], tuple[bool, bool]]
"""Whether x0 and x1, y0 and y1 are clamped."""


def clamped_ends(setup: Setup) -> ClampedEnds:
    (x0, x1), (y0, y1) = setup.ends_x, setup.ends_y
    return (x0 == "clamped", x1 == "clamped"), (y0 == "clamped", y1 == "clamped")


@dataclass(frozen=True)
class CompliantClamp(Effect):
    """Springs of one stiffness in place of what all clamped edges of a setup hold."""

    clamped: ClampedEnds = ((False, False), (False, False))

    scope: ClassVar[Scope] = "setup"
    is_of_campaign: ClassVar[bool] = True

    @classmethod
    def of(cls, board: Board, setup: Setup) -> Self:
        return cls(setup.owner, clamped_ends(setup))

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        return "" if any(any(at) for at in clamped_ends(setup)) else "no edge is clamped"

    def in_setup(self, board: Board, setup: Setup) -> Self | None:
        return None if self.refusal(board, setup) else replace(self, owner=setup.owner, clamped=clamped_ends(setup))

    def springs(self, strains: tuple[str, str], stiffest: float, power: int) -> tuple[Contribution, ...]:
        """Springs along the clamped edges of each side, against a strain along x0 and x1, and along y0 and y1.

        A spring of stiffness k has the weight k / (rho h L^power): 3 if it holds the slope, 1 if the deflection. The
        parameter `compliance` is D / (k L^(4 - power)) of the first side that has a clamped edge; k is the same along
        all of them. It is taken as 0 where it is negative: a normal approximation may ask for that. `stiffest` is added
        to it: with too stiff a spring the reduced-order model loses digits.
        """
        first = 0 if any(self.clamped[0]) else 1

        def weight(values: Values, setup: Setup, side: int) -> Floats:
            sides = vibrating_lengths(values, setup)
            compliance = np.maximum(self.value(values, "compliance"), 0.0) + stiffest
            stiffness = values["D_x" if first == 0 else "D_y"] / (compliance * sides[first] ** (4 - power))
            return stiffness / (board_density(values) * values["thickness"] * sides[side] ** power)

        return tuple(
            Stiffness(EdgeTerm(side, at, strain), partial(weight, side=side))
            for side, (at, strain) in enumerate(zip(self.clamped, strains, strict=True))
            if any(at)
        )
