"""Membrane tension: a board that dries between held edges is stretched like a drumhead."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import ClassVar, Literal

from bayesplate.effects.base import Contribution, Effect, Floats, Scope, Stiffness
from bayesplate.modes.line import Line
from bayesplate.modes.plate import KronSum
from bayesplate.plate.board import Board, Values, density, vibrating_lengths
from bayesplate.plate.parameter import Parameter
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
        return cls(setup.owner, axis)

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[MembraneTension, ...]:
        """Equal tension, and tension along x or along y alone where both could be stretched."""
        if cls.refusal(board, setup):
            return ()
        equal = cls.of(board, setup)
        return (equal,) if equal.axis != "both" else (equal, cls(setup.owner, "x"), cls(setup.owner, "y"))

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        """Refused where no two opposite edges are held."""
        if "free" in setup.ends_x and "free" in setup.ends_y:
            return "no two opposite edges are held, so nothing can stretch the board"
        return ""

    @property
    def detail(self) -> str:
        """The side along which it acts, if not equally along both."""
        return "" if self.axis == "both" else f"along {self.axis}"

    def parameters(self) -> tuple[Parameter, ...]:
        """The tension."""
        return (self.parameter("N", _PRIOR, "N/m", 0.0, _SOURCE, words="tension"),)

    def contributions(self) -> tuple[Contribution, ...]:
        """The squared slope along each side that is stretched, with N over rho h and the square of the side."""

        def weight(values: Values, setup: Setup, side: int) -> Floats:
            areal = density(values) * values["thickness"]
            return self.value(values, "N") / (areal * vibrating_lengths(values, setup)[side] ** 2)

        sides = {"x": (0,), "y": (1,), "both": (0, 1)}[self.axis]
        return tuple(Stiffness(_SQUARED_SLOPES[side], partial(weight, side=side)) for side in sides)


def _along_x(x: Line, y: Line) -> KronSum:
    return ((x.slope, y.mass),)


def _along_y(x: Line, y: Line) -> KronSum:
    return ((x.mass, y.slope),)


_SQUARED_SLOPES = (_along_x, _along_y)
