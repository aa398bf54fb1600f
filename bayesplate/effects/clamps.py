"""What the two clamp effects share: which edges are clamped, and what springs of one stiffness weigh along them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from bayesplate.effects.base import Effect, Floats, Scope
from bayesplate.plate.board import Board, Values, density, vibrating_lengths
from bayesplate.plate.setup import Setup

ClampedEnds = tuple[tuple[bool, bool], tuple[bool, bool]]
"""Whether x0 and x1, y0 and y1 are clamped."""


def clamped_ends(setup: Setup) -> ClampedEnds:
    """The clamped edges of a setup."""
    (x0, x1), (y0, y1) = setup.ends_x, setup.ends_y
    return (x0 == "clamped", x1 == "clamped"), (y0 == "clamped", y1 == "clamped")


@dataclass(frozen=True)
class CompliantClamp(Effect):
    """Springs of one stiffness in place of what all clamped edges of a setup hold.

    Attributes
    ----------
    clamped : ClampedEnds
    """

    clamped: ClampedEnds = ((False, False), (False, False))

    scope: ClassVar[Scope] = "setup"

    @classmethod
    def of(cls, board: Board, setup: Setup) -> Self:
        """The effect on all clamped edges of the setup."""
        return cls(setup.name, clamped_ends(setup))

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        """Refused where no edge is clamped."""
        return "" if any(any(at) for at in clamped_ends(setup)) else "no edge is clamped"


def spring_weights(
    clamped: ClampedEnds, compliance: Floats, stiffest: float, power: int, values: Values, setup: Setup
) -> tuple[Floats, ...]:
    """Weight of springs along the clamped edges of each side that has any, s^-2.

    Parameters
    ----------
    clamped : ClampedEnds
    compliance : array, no unit
        D / (k L^(4 - power)) of the first side that has a clamped edge; k is the same along all of them. Taken as 0
        where it is negative: a normal approximation of the posterior may ask for that.
    stiffest : float
        Added to the compliance: with too stiff a spring the reduced-order model loses digits.
    power : int
        A spring of stiffness k has the weight k / (rho h L^power): 3 if it holds the slope, 1 if the deflection.
    values : dict of array
    setup : Setup

    Returns
    -------
    tuple of array
    """
    sides = vibrating_lengths(values, setup)
    first = 0 if any(clamped[0]) else 1
    rigidity = values["D_x" if first == 0 else "D_y"]
    stiffness = rigidity / ((np.maximum(compliance, 0.0) + stiffest) * sides[first] ** (4 - power))
    areal = density(values) * values["thickness"]
    return tuple(stiffness / (areal * side**power) for side, at in zip(sides, clamped, strict=True) if any(at))
