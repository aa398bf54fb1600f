"""Density gradient: the wood is denser at one end of the board than at the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from bayesplate.board.quantity import Quantity
from bayesplate.effects.gradients import GradientAlongX
from bayesplate.plate.fields import TermGroup


@dataclass(frozen=True)
class DensityGradient(GradientAlongX):
    """Density 1 + g (s - 1/2) times its mean, s from 0 to 1 along the whole board; its total mass stays.

    Only the inertia follows: elastic constants that go with density are not part of this effect.
    """

    name: ClassVar[str] = "density_gradient"
    sentence: ClassVar[str] = "The wood is heavier towards one end, so modes that move that end ring lower."
    default: ClassVar[Quantity] = Quantity.from_mean(0.0, 0.05, "normal")
    source: ClassVar[str] = (
        "normal: density varies by a few per cent along one plank; a board is not heavier at a known end"
    )

    groups: ClassVar[tuple[TermGroup, ...]] = ("mass", "rotary")
