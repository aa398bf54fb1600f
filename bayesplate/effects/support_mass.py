"""Support mass: a frame that hangs soft and is not heavy enough to stand still."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayesplate.effects.base import Effect, EffectParameter, Floats, Scope
from bayesplate.modes.line import Line
from bayesplate.modes.plate import Projection
from bayesplate.plate.board import Board, Values, density, vibrating_lengths
from bayesplate.plate.setup import Setup
from bayesplate.quantities import Quantity

_PRIOR = Quantity.from_median(8.0, 3.0)
_SOURCE = "log-normal: frames of wood or steel for boards of this size weigh 3-25 kg"


@dataclass(frozen=True)
class SupportMass(Effect):
    """A frame of finite mass, shifted as a whole by the forces of its board; it does not turn, and its mount is soft.

    The momentum of frame and board together stays zero, which takes (int rho h w)^2 / (M_f + m) from the mass, M_f the
    frame's and m the vibrating one. Things attached to the board are not counted in this momentum: they weigh grams.
    """

    name: ClassVar[str] = "support_mass"
    scope: ClassVar[Scope] = "setup"
    sentence: ClassVar[str] = "The frame moves against the board, so modes that push on the whole frame ring higher."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> SupportMass:
        """The effect in a setup."""
        return cls(setup.name)

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        """Refused where no two opposite edges are held: such a board would turn its support, not only shift it."""
        if "free" in setup.ends_x and "free" in setup.ends_y:
            return "no two opposite edges are held, so there is no frame that would only shift"
        return ""

    def parameters(self) -> tuple[EffectParameter, ...]:
        """The frame's mass."""
        return (EffectParameter("mass", "kg", _PRIOR, _SOURCE),)

    def projected_masses(self) -> tuple[Projection, ...]:
        """Less the product of the mean deflections."""
        return (_mean_products,)

    def mass_weights(self, values: Values, setup: Setup) -> tuple[Floats, ...]:
        """The share of the vibrating mass in frame and board."""
        length_x, length_y = vibrating_lengths(values, setup)
        vibrating = density(values) * values["thickness"] * length_x * length_y
        return (vibrating / (self.value(values, "mass") + vibrating),)


def _mean_products(x: Line, y: Line, deflections: Floats) -> Floats:
    means = np.einsum("i,kij,j->k", x.integrals, deflections, y.integrals)
    return -np.outer(means, means)
