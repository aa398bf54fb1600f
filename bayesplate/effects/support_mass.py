"""Support mass: a frame that hangs soft and is not heavy enough to stand still."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from bayesplate.board.board import Board, Values
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Contribution, Effect, Floats, Mass, Scope
from bayesplate.effects.part import vibrating_mass
from bayesplate.plate.fields import Outline
from bayesplate.plate.terms import Deflections, ProjectedTerms

_PRIOR = Quantity.from_median(8.0, 3.0)
_SOURCE = "log-normal: frames of wood or steel for boards of this size weigh 3-25 kg"
_N_POINTS = 400


@dataclass(frozen=True)
class SupportMass(Effect):
    """A frame of finite mass, shifted as a whole by the forces of its board; it does not turn, and its mount is soft.

    The momentum of frame and board together stays zero, which takes (int rho h w)^2 / (M_f + m) from the mass, M_f the
    frame's and m the vibrating one. Things attached to the board are not counted in this momentum: they weigh grams.
    """

    edge: Outline | None = None  # where the plate ends; None: the whole rectangle
    share: float = 1.0  # of the rectangle that the plate is

    name: ClassVar[str] = "support_mass"
    scope: ClassVar[Scope] = "setup"
    is_of_campaign: ClassVar[bool] = True
    sentence: ClassVar[str] = "The frame moves against the board, so modes that push on the whole frame ring higher."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> SupportMass:
        return cls(setup.owner)

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        """Refused where no two opposite edges are held: such a board would turn its support, not only shift it."""
        if "free" in setup.ends_x and "free" in setup.ends_y:
            return "no two opposite edges are held, so there is no frame that would only shift"
        return ""

    def parameters(self) -> tuple[Parameter, ...]:
        """The frame's mass; one of a thousand tons stands still."""
        return (self.parameter("mass", _PRIOR, "kg", 1e6, _SOURCE),)

    def within_outline(self, shaped: Effect) -> SupportMass:
        edge = shaped.outline()
        assert edge is not None
        low, high = edge((np.arange(_N_POINTS) + 0.5) / _N_POINTS)
        return replace(self, edge=edge, share=float(np.mean(high - low)))

    def contributions(self) -> tuple[Contribution, ...]:
        """Less the product of the mean deflections, with the share of the vibrating mass in frame and board.

        The board's mass counts as uniform here.
        """

        def weight(values: Values, setup: Setup) -> Floats:
            vibrating = vibrating_mass(values, setup)
            return vibrating / (self.value(values, "mass") + self.share * vibrating)

        return (Mass(ProjectedTerms(partial(_mean_products, outline=self.edge)), weight),)


def _mean_products(deflections: Deflections, outline: Outline | None) -> Floats:
    means = deflections.integrals(outline)
    return -np.outer(means, means)
