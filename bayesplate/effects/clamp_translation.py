"""Clamp translation: a clamp that gives way across the board, as one with a soft lining does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from bayesplate.effects.base import EffectParameter, Floats, Release
from bayesplate.effects.clamps import CompliantClamp, spring_weights
from bayesplate.modes.line import Line
from bayesplate.modes.plate import Term
from bayesplate.plate.board import Values
from bayesplate.plate.setup import Setup
from bayesplate.quantities import Quantity

STIFFEST = 1e-7
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

    def parameters(self) -> tuple[EffectParameter, ...]:
        """The compliance D / (k_T L^3)."""
        return (EffectParameter("compliance", "1", _PRIOR, _SOURCE),)

    def stiffness(self, x: Line, y: Line) -> tuple[Term, ...]:
        """The squared deflection along the clamped edges of each side."""
        along_x, along_y = self.clamped
        terms: list[Term] = []
        if any(along_x):
            terms.append(((x.at_ends(along_x, 0), y.mass),))
        if any(along_y):
            terms.append(((x.mass, y.at_ends(along_y, 0)),))
        return tuple(terms)

    def stiffness_weights(self, values: Values, setup: Setup) -> tuple[Floats, ...]:
        """k_T over rho h and the side."""
        return spring_weights(self.clamped, self.value(values, "compliance"), STIFFEST, 1, values, setup)
