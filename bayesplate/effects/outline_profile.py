"""Outline profile: the board is narrower at some stations than at others."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from bayesplate.effects.base import Effect, Floats, Scope
from bayesplate.effects.part import WHOLE, Part, vibrating_part
from bayesplate.effects.stations import Stations
from bayesplate.modes.fields import Outline
from bayesplate.plate.board import Board, Values, density
from bayesplate.plate.parameter import BOARD, Parameter
from bayesplate.plate.setup import Ends, Setup

_MEAN_POINTS = 2000


@dataclass(frozen=True)
class OutlineProfile(Effect):
    """The energies of the true outline, linear between the stations at which the width was read; no parameter.

    The functions are those of the rectangle as wide as the widest place; what lies outside the outline is all but
    removed. Where both edges along x are free the board is taken to narrow from both alike (readings of a width do not
    say which edge recedes), otherwise from the free one. A board whose mass is given keeps it.

    Attributes
    ----------
    ends_y : tuple of str
        Conditions at y0 and y1.
    part_x : Part
        What vibrates of the board along x.
    stations : Stations or None
        Widths relative to their mean, at fractions of the whole length.
    """

    ends_y: Ends = ("free", "free")
    part_x: Part = WHOLE
    stations: Stations | None = None

    name: ClassVar[str] = "outline_profile"
    scope: ClassVar[Scope] = "board"
    sentence: ClassVar[str] = "The board is not equally wide everywhere, so it is not quite a rectangle."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> OutlineProfile:
        """The effect with the board's readings of its width."""
        width, length = board.inputs["length_y"], board.inputs["length_x"]
        stations = Stations(
            tuple(at / length.mean for at in width.at_x),
            (0.0,) * len(width.at_x),
            tuple(reading / width.mean for reading in width.readings),
        )
        return cls(BOARD, setup.ends_y, vibrating_part(board, setup, "x"), stations)

    @classmethod
    def is_implied(cls, board: Board) -> bool:
        """Whether the card's width was read at stations along the board."""
        return bool(board.inputs["length_y"].at_x)

    @classmethod
    def notes(cls, board: Board) -> tuple[str, ...]:
        """That readings of the width at stations serve for their mean alone where the effect is not declared."""
        if cls.name in board.effects or not board.inputs["length_y"].has_profile:
            return ()
        return (f"the length_y was read at several places: its mean is used, the {cls.name} is not part of this model",)

    def in_setup(self, board: Board, setup: Setup) -> OutlineProfile | None:
        """The same outline in another setup."""
        return None if self.refusal(board, setup) else self.of(board, setup)

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        """It needs readings with places, and an edge that is free to recede."""
        if not cls.is_implied(board):
            return "the card gives no widths at stations: length_y_mm = { readings = [..], at_x_mm = [..] }"
        if "free" not in setup.ends_y:
            return "neither y0 nor y1 is free, and a held edge is straight"
        return ""

    def parameters(self) -> tuple[Parameter, ...]:
        """None: the readings say it all."""
        return ()

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """The halves along x differ; across, only if one edge alone recedes."""
        return False, self.ends_y[0] == self.ends_y[1]

    def outline(self) -> Outline | None:
        """Where the plate begins and ends along y."""
        return self._limits

    def adjusted(self, values: Values) -> Values:
        """The widest width for the sides of the rectangle, and the density that leaves a given mass as it is."""
        mean, widest = self._mean_and_widest
        corrected = {"density": density(values) / mean} if "mass" in values else {}
        return {**values, "length_y": values["length_y"] * widest, **corrected}

    @cached_property
    def _mean_and_widest(self) -> tuple[float, float]:
        width = self._widths(np.linspace(0.0, 1.0, _MEAN_POINTS + 1))
        return float(width.mean()), float(width.max())

    def _limits(self, x: Floats) -> tuple[Floats, Floats]:
        widest = self._mean_and_widest[1]
        missing = 1.0 - np.minimum(self._widths(self.part_x.on_whole(x)) / widest, 1.0)
        low, high = {
            ("free", True): (0.5 * missing, 1.0 - 0.5 * missing),
            ("free", False): (missing, np.ones_like(missing)),
        }.get((self.ends_y[0], self.ends_y[1] == "free"), (np.zeros_like(missing), 1.0 - missing))
        return low, high

    def _widths(self, at: Floats) -> Floats:
        assert self.stations is not None
        return self.stations(at, np.zeros_like(at))
