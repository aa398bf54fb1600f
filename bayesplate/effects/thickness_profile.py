"""Thickness profile: the board is thicker in some places than in others, as measured, or as a taper to be found."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import comb
from typing import ClassVar

from bayesplate.effects.base import Effect, Floats, Scope, Variation
from bayesplate.effects.part import WHOLE, Part, vibrating_part
from bayesplate.effects.stations import Stations
from bayesplate.modes.fields import Field, Group
from bayesplate.plate.board import Board, Values, density
from bayesplate.plate.parameter import BOARD, Parameter
from bayesplate.plate.setup import Setup
from bayesplate.quantities import Quantity

DEFAULT_TAPER = Quantity.from_mean(0.0, 0.05, "normal")
_SOURCE = "normal: hand-planed and belt-sanded boards of 3-5 mm differ by 0.1-0.2 mm from end to end, either way"
_POWERS: dict[Group, int] = {"bending": 3, "shear": 1, "mass": 1, "rotary": 3}
"""How each group of terms goes with the thickness."""


@dataclass(frozen=True)
class ThicknessProfile(Effect):
    """Thickness h p(x, y) in stiffness and mass.

    With readings at places p is known, and there is no parameter: p goes through the readings (`Stations`) and is
    relative to their mean, which is the h of the constants. A board whose mass is given keeps it.

    Without, p = 1 + alpha_x (s - 1/2) + alpha_y (t - 1/2), s and t from 0 to 1 along the whole sides: a taper around
    the mean thickness. Powers of p are polynomials in both tapers, so each power of s and t is a term of its own and
    the sum is exact.

    Attributes
    ----------
    part_x, part_y : Part
        What vibrates of the board.
    stations : Stations or None
        Readings relative to their mean, at fractions of the whole sides; None: free tapers.
    """

    part_x: Part = WHOLE
    part_y: Part = WHOLE
    stations: Stations | None = None

    name: ClassVar[str] = "thickness_profile"
    scope: ClassVar[Scope] = "board"
    sentence: ClassVar[str] = "The board is not equally thick everywhere, which shifts each mode in its own way."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> ThicknessProfile:
        """The effect with the board's readings where they have places."""
        parts = vibrating_part(board, setup, "x"), vibrating_part(board, setup, "y")
        if not cls.is_implied(board):
            return cls(BOARD, *parts)
        thickness, length_x, length_y = (board.inputs[n] for n in ("thickness", "length_x", "length_y"))
        return cls(
            BOARD,
            *parts,
            Stations(
                tuple(at / length_x.mean for at in thickness.at_x),
                tuple(at / length_y.mean for at in thickness.at_y),
                tuple(reading / thickness.mean for reading in thickness.readings),
            ),
        )

    @classmethod
    def is_implied(cls, board: Board) -> bool:
        """Whether the card's thickness was read at places."""
        thickness = board.inputs["thickness"]
        return bool(thickness.at_x and thickness.at_y)

    @classmethod
    def notes(cls, board: Board) -> tuple[str, ...]:
        """That readings of the thickness at places serve for their mean alone where the effect is not declared."""
        if cls.name in board.effects or not board.inputs["thickness"].has_profile:
            return ()
        told = "the thickness was read at several places: its mean is used"
        return (f"{told}, the {cls.name} is not part of this model",)

    def in_setup(self, board: Board, setup: Setup) -> ThicknessProfile:
        """The same profile on the part of the board that vibrates in another setup."""
        part_x, part_y = (vibrating_part(board, setup, axis) for axis in "xy")
        return replace(self, part_x=part_x, part_y=part_y)

    def parameters(self) -> tuple[Parameter, ...]:
        """None with readings, otherwise the relative growth of the thickness from end to end, along x and along y."""
        if self.stations is not None:
            return ()
        return tuple(
            self.parameter(f"taper_{axis}", DEFAULT_TAPER, "1", 0.0, _SOURCE, f"taper along {axis}") for axis in "xy"
        )

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """Neither half mirrors the other, save across a board that was read along one row only."""
        return False, self.stations is not None and not self.stations.varies_along_y

    def adjusted(self, values: Values) -> Values:
        """The density that leaves a given mass as it is."""
        if self.stations is None or "mass" not in values:
            return values
        return {**values, "density": density(values) / self.stations.mean}

    def variations(self) -> Mapping[Group, tuple[Variation, ...]]:
        """Powers of the known profile, or of a taper: (c + a u + b v)^n by the multinomial theorem."""
        if self.stations is not None:
            known = {power: (Variation(partial(self._known, power=power)),) for power in (1, 3)}
            return {group: known[power] for group, power in _POWERS.items()}
        fields: dict[tuple[int, int], Field | None] = {
            (i, j): partial(_monomial, i=i, j=j) if i + j else None for i, j in _exponents(max(_POWERS.values()))
        }
        return {
            group: tuple(Variation(fields[i, j], partial(self._coefficient, n=n, i=i, j=j)) for i, j in _exponents(n))
            for group, n in _POWERS.items()
        }

    def _coefficient(self, values: Values, n: int, i: int, j: int) -> Floats:
        """Of u^i v^j in the n-th power of the taper, u and v from the middle of the vibrating part."""
        taper_x, taper_y = self.value(values, "taper_x"), self.value(values, "taper_y")
        middle = 1.0 + taper_x * self.part_x.middle + taper_y * self.part_y.middle
        along_x, along_y = taper_x * self.part_x.share, taper_y * self.part_y.share
        return comb(n, i) * comb(n - i, j) * middle ** (n - i - j) * along_x**i * along_y**j

    def _known(self, x: Floats, y: Floats, power: int) -> Floats:
        assert self.stations is not None
        return self.stations(self.part_x.on_whole(x), self.part_y.on_whole(y)) ** power


def _exponents(degree: int) -> tuple[tuple[int, int], ...]:
    """Exponents of x and y up to a degree, lowest first."""
    return tuple((total - j, j) for total in range(degree + 1) for j in range(total + 1))


def _monomial(x: Floats, y: Floats, i: int, j: int) -> Floats:
    return (x - 0.5) ** i * (y - 0.5) ** j
