"""Support stiffness: foam, sand or bands under the whole board that push back where it moves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bayesplate.board.board import Board, Values, board_density
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Contribution, Effect, Floats, Scope, Stiffness
from bayesplate.plate.fields import Outline
from bayesplate.plate.terms import PlateTerm

_PRIOR = Quantity.from_mean(0.0, 2e4, "normal", lower=0.0)
_SOURCE = "half-normal: a board of 1-2 kg/m2 bounces at 5 Hz on soft bands (2e3 N/m3), at 15-25 Hz on foam (2e4)"


@dataclass(frozen=True)
class SupportStiffness(Effect):
    """A uniform elastic foundation: it adds k / (rho h) to omega^2 of every mode of a thin plate.

    A free board's rigid motions then bounce at that frequency, below all others; they stay left out.
    """

    edge: Outline | None = None  # where the plate ends; None: the whole rectangle
    stiffness: Quantity = _PRIOR  # N/m^3

    name: ClassVar[str] = "support_stiffness"
    scope: ClassVar[Scope] = "setup"
    is_of_campaign: ClassVar[bool] = True
    sentence: ClassVar[str] = "What the board lies on pushes back, so its lowest modes ring higher."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> SupportStiffness:
        """The effect under the whole board, as stiff as the frequency implies at which the board bounces, if stated."""
        return cls(setup.owner, stiffness=_PRIOR if setup.bounce is None else stiffness_of(board, setup.bounce))

    @classmethod
    def is_wanted(cls, setup: Setup) -> bool:
        return setup.bounce is not None

    def in_setup(self, board: Board, setup: Setup) -> Effect | None:
        return self.of(board, setup) if self.is_wanted(setup) else super().in_setup(board, setup)

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        if not setup.is_free:
            return "an edge is held, so the board does not lie or hang on anything else"
        return ""

    def parameters(self) -> tuple[Parameter, ...]:
        source = _SOURCE if self.stiffness is _PRIOR else ""
        return (self.parameter("stiffness", self.stiffness, "N/m^3", 0.0, source),)

    def within_outline(self, shaped: Effect) -> SupportStiffness:
        return replace(self, edge=shaped.outline())

    def contributions(self) -> tuple[Contribution, ...]:
        def weight(values: Values, setup: Setup) -> Floats:
            return self.value(values, "stiffness") / (board_density(values) * values["thickness"])

        return (Stiffness(PlateTerm(("w", "w"), self.edge), weight),)


def stiffness_of(board: Board, bounce: Quantity) -> Quantity:
    """Stiffness per area, N/m^3, of a support on which the board bounces at a frequency, Hz: rho h (2 pi f)^2."""
    nominal = board.nominal()
    scale = float(board_density(nominal) * nominal["thickness"]) * (2.0 * np.pi) ** 2
    if bounce.is_exact:
        return Quantity.exact(scale * bounce.mean**2)
    return Quantity.from_median(scale * bounce.median**2, bounce.factor**2)
