"""Membrane tension: a board that dries between held edges is stretched like a drumhead."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Literal, get_args

from bayesplate.board.board import Board, Values, density, vibrating_lengths
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Ends, Setup
from bayesplate.effects.base import Contribution, Effect, EffectForm, Floats, Scope, Stiffness
from bayesplate.plate.fields import Outline
from bayesplate.plate.terms import OverPlate

Axis = Literal["both", "x", "y"]

_PRIOR = Quantity.from_mean(0.0, 500.0, "normal", lower=0.0)
_SOURCE = (
    "half-normal, tension only: fits of clamped boards give 100-400 N/m; drying by one percent would give some "
    "thousands across the grain if neither wood nor frame gave way"
)


@dataclass(frozen=True)
class MembraneTension(Effect):
    """Tension per length in the plane of the board, between opposite held edges."""

    axis: Axis = "both"  # along which it acts; "both" is one tension, equal along x and y
    edge: Outline | None = None  # where the plate ends; None: the whole rectangle

    name: ClassVar[str] = "membrane_tension"
    scope: ClassVar[Scope] = "setup"
    sentence: ClassVar[str] = "Drying has stretched the board between its held edges, so its low modes ring higher."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> MembraneTension:
        """Equal tension along all sides of the setup that are held at both ends."""
        held = _held(setup)
        return cls(setup.owner, held[0] if len(held) == 1 else "both")

    @classmethod
    def forms(cls, board: Board) -> tuple[EffectForm, ...]:
        """Equal tension, and tension along x or along y alone, in the setups that are held so; none of them twice."""
        found: list[EffectForm] = []
        for axis in get_args(Axis):
            acting = (cls(setup.owner, axis).in_setup(board, setup) for setup in board.setups)
            effects = tuple(one for one in acting if one is not None)
            if effects and all(effects != one.effects for one in found):
                is_same = len({one.detail for one in effects}) == 1
                found.append(EffectForm(effects[0].detail if is_same else "", effects))
        return tuple(found)

    def in_setup(self, board: Board, setup: Setup) -> MembraneTension | None:
        """Tension along the same side of another setup, or along all that is held there."""
        if self.refusal(board, setup) or (self.axis != "both" and self.axis not in _held(setup)):
            return None
        return self.of(board, setup) if self.axis == "both" else replace(self, owner=setup.owner)

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        if "free" in setup.ends_x and "free" in setup.ends_y:
            return "no two opposite edges are held, so nothing can stretch the board"
        return ""

    @property
    def detail(self) -> str:
        return "" if self.axis == "both" else f"along {self.axis}"

    def parameters(self) -> tuple[Parameter, ...]:
        return (self.parameter("N", _PRIOR, "N/m", 0.0, _SOURCE, words="tension"),)

    def within(self, shaped: Effect) -> MembraneTension:
        return replace(self, edge=shaped.outline())

    def contributions(self) -> tuple[Contribution, ...]:
        """The squared slope along each side that is stretched, with N over rho h and the square of the side."""

        def weight(values: Values, setup: Setup, side: int) -> Floats:
            areal = density(values) * values["thickness"]
            return self.value(values, "N") / (areal * vibrating_lengths(values, setup)[side] ** 2)

        sides = {"x": (0,), "y": (1,), "both": (0, 1)}[self.axis]
        slopes = "slope_x", "slope_y"
        return tuple(
            Stiffness(OverPlate((slopes[side], slopes[side]), self.edge), partial(weight, side=side)) for side in sides
        )


def _held(setup: Setup) -> tuple[Axis, ...]:
    sides: tuple[tuple[Axis, Ends], ...] = (("x", setup.ends_x), ("y", setup.ends_y))
    return tuple(axis for axis, ends in sides if "free" not in ends)
