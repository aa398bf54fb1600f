"""Clamp rotation: a clamp that lets the board turn a little where it should hold it level."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.effects.base import Contribution, Release
from bayesplate.effects.clamps import CompliantClamp

LEAST_COMPLIANCE = 1e-5
"""Compliance that is left where the parameter is 0: such a clamp is ideal to a twentieth of a cent."""

_PRIOR = Quantity.from_mean(0.0, 0.04, "normal", lower=0.0)
_SOURCE = (
    "half-normal: the board behaves as if it were longer by this fraction at each clamp, and a clamp on wood adds one "
    "to three thicknesses; k_R L / D = 30 is a usual clamp"
)


@dataclass(frozen=True)
class ClampRotation(CompliantClamp):
    """Springs against turning in place of the slope that clamped edges hold; all of one stiffness k_R.

    The parameter is the compliance D / (k_R L), 0 for an ideal clamp, with D and L along x where an edge across x is
    clamped, otherwise along y. The other edges' compliance follows from the same k_R.
    """

    name: ClassVar[str] = "clamp_rotation"
    sentence: ClassVar[str] = "The clamp lets the board turn a little, as if the board were longer than it is."
    releases: ClassVar[Release] = "slope"

    def parameters(self) -> tuple[Parameter, ...]:
        return (self.parameter("compliance", _PRIOR, "1", 0.0, _SOURCE),)

    def contributions(self) -> tuple[Contribution, ...]:
        """The squared turning along the clamped edges of each side, with k_R over rho h and the cube of the side."""
        return self.springs(("turn_x", "turn_y"), LEAST_COMPLIANCE, power=3)
