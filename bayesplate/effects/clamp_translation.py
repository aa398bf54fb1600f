"""Clamp translation: a clamp that gives way across the board, as one with a soft lining does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.effects.base import Contribution, Release
from bayesplate.effects.clamps import CompliantClamp

LEAST_COMPLIANCE = 1e-7
"""Compliance that is left where the parameter is 0: such a clamp is ideal to a tenth of a cent."""

_PRIOR = Quantity.from_mean(0.0, 1e-4, "normal", lower=0.0)
_SOURCE = (
    "half-normal: k_T L^3 / D is 1e6 for a clamp that squeezes wood across the grain and 1e4-2e4 for one lined with "
    "3 mm of rubber of 2-5 MPa, 30 mm wide, on a 3 mm board of 0.2 m"
)


@dataclass(frozen=True)
class ClampTranslation(CompliantClamp):
    """Springs against deflection in place of the deflection that clamped edges hold; all of one stiffness k_T.

    The slope stays held. The parameter is the compliance D / (k_T L^3), 0 for an ideal clamp, with D and L along x
    where an edge across x is clamped, otherwise along y. The other edges' compliance follows from the same k_T.
    """

    name: ClassVar[str] = "clamp_translation"
    sentence: ClassVar[str] = "The clamp gives way across the board, most of all in its higher modes."
    releases: ClassVar[Release] = "value"

    def parameters(self) -> tuple[Parameter, ...]:
        return (self.parameter("compliance", _PRIOR, "1", 0.0, _SOURCE),)

    def contributions(self) -> tuple[Contribution, ...]:
        """The squared deflection along the clamped edges of each side, with k_T over rho h and the side."""
        return self.springs(("w", "w"), LEAST_COMPLIANCE, power=1)
