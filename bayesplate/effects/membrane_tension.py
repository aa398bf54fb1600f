"""Membrane tension: a board that dries between held edges is stretched like a drumhead."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from bayesplate.effects.base import Effect, EffectParameter, Floats, Scope
from bayesplate.modes.line import Line
from bayesplate.modes.plate import Term
from bayesplate.plate.board import Board, Values, density, vibrating_lengths
from bayesplate.plate.setup import Setup
from bayesplate.quantities import Quantity

Axis = Literal["x", "y", "both"]

_PRIOR = Quantity.from_mean(0.0, 500.0, "normal", lower=0.0)
_SOURCE = (
    "half-normal, tension only: fits of clamped boards give 100-400 N/m; drying by one percent would give some "
    "thousands across the grain if neither wood nor frame gave way"
)


@dataclass(frozen=True)
class MembraneTension(Effect):
    """Tension per length in the plane of the board, between opposite held edges.

    Attributes
    ----------
    axis : "x", "y" or "both"
        Along which it acts; "both" is one tension, equal along x and y.
    """

    axis: Axis = "both"

    name: ClassVar[str] = "membrane_tension"
    scope: ClassVar[Scope] = "setup"
    sentence: ClassVar[str] = "Drying has stretched the board between its held edges, so its low modes ring higher."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> MembraneTension:
        """Equal tension along all sides of the setup that are held at both ends."""
        held = "".join(axis for axis, ends in (("x", setup.ends_x), ("y", setup.ends_y)) if "free" not in ends)
        axis: Axis = "x" if held == "x" else "y" if held == "y" else "both"
        return cls(setup.name, axis)

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[MembraneTension, ...]:
        """Equal tension, and tension along x or along y alone where both could be stretched."""
        if cls.refusal(board, setup):
            return ()
        equal = cls.of(board, setup)
        return (equal,) if equal.axis != "both" else (equal, cls(setup.name, "x"), cls(setup.name, "y"))

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        """Refused where no two opposite edges are held."""
        if "free" in setup.ends_x and "free" in setup.ends_y:
            return "no two opposite edges are held, so nothing can stretch the board"
        return ""

    def parameters(self) -> tuple[EffectParameter, ...]:
        """The tension."""
        return (EffectParameter("N", "N/m", _PRIOR, _SOURCE),)

    def stiffness(self, x: Line, y: Line) -> tuple[Term, ...]:
        """The squared slopes along the sides that are stretched."""
        along_x: Term = ((x.slope, y.mass),)
        along_y: Term = ((x.mass, y.slope),)
        return (along_x, along_y) if self.axis == "both" else (along_x,) if self.axis == "x" else (along_y,)

    def stiffness_weights(self, values: Values, setup: Setup) -> tuple[Floats, ...]:
        """N over rho h and the square of the side."""
        areal = density(values) * values["thickness"]
        sides = dict(zip("xy", vibrating_lengths(values, setup), strict=True))
        axes = "xy" if self.axis == "both" else self.axis
        return tuple(self.value(values, "N") / (areal * sides[axis] ** 2) for axis in axes)
