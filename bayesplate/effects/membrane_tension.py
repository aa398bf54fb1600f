"""Membrane tension: a board that dries between held edges is stretched like a drumhead."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Literal, get_args

from bayesplate.board.board import Board, Values, board_density, vibrating_lengths
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import EdgeConditions, Setup
from bayesplate.effects.base import Contribution, Effect, EffectForm, Floats, Scope, Stiffness
from bayesplate.plate.fields import Outline
from bayesplate.plate.terms import PlateTerm

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
        sides = _held_sides(setup)
        return cls(setup.owner, sides[0] if len(sides) == 1 else "both")

    @classmethod
    def forms(cls, board: Board) -> tuple[EffectForm, ...]:
        """Equal tension, and tension along x or along y alone, in the setups that are held so; each form once."""
        forms: list[EffectForm] = []
        for axis in get_args(Axis):
            in_setups = (cls(setup.owner, axis).in_setup(board, setup) for setup in board.setups)
            effects = tuple(effect for effect in in_setups if effect is not None)
            if effects and all(effects != form.effects for form in forms):
                is_same = len({effect.detail for effect in effects}) == 1
                forms.append(EffectForm(effects[0].detail if is_same else "", effects))
        return tuple(forms)

    def in_setup(self, board: Board, setup: Setup) -> MembraneTension | None:
        """Tension along the same side in another setup, or along all sides that are held there."""
        if self.refusal(board, setup) or (self.axis != "both" and self.axis not in _held_sides(setup)):
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
        return (self.parameter("N", _PRIOR, "N/m", 0.0, _SOURCE, display_name="tension"),)

    def within_outline(self, shaped: Effect) -> MembraneTension:
        return replace(self, edge=shaped.outline())

    def contributions(self) -> tuple[Contribution, ...]:
        """The squared slope along each side that is stretched, with N over rho h and the square of the side."""

        def weight(values: Values, setup: Setup, side: int) -> Floats:
            areal = board_density(values) * values["thickness"]
            return self.value(values, "N") / (areal * vibrating_lengths(values, setup)[side] ** 2)

        sides = {"x": (0,), "y": (1,), "both": (0, 1)}[self.axis]
        slopes = "slope_x", "slope_y"
        return tuple(
            Stiffness(PlateTerm((slopes[side], slopes[side]), self.edge), partial(weight, side=side)) for side in sides
        )


def _held_sides(setup: Setup) -> tuple[Axis, ...]:
    sides: tuple[tuple[Axis, EdgeConditions], ...] = (("x", setup.ends_x), ("y", setup.ends_y))
    return tuple(axis for axis, ends in sides if "free" not in ends)
