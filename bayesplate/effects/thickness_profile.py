"""Thickness profile: the board is thicker in some places than in others, as read, or as a taper to be found."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations_with_replacement, permutations
from math import comb, prod
from typing import ClassVar

import numpy as np

from bayesplate.board.board import Board, Values
from bayesplate.board.parameter import BOARD_OWNER, Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.random_field import condition_field, thickness_readings
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Effect, Floats, Scope, Variation
from bayesplate.effects.field_components import (
    FieldProfile,
    field_parameters,
    field_profile,
    mountings,
    standard_coordinates,
)
from bayesplate.effects.part import WHOLE_SIDE, VibratingPart, vibrating_part
from bayesplate.plate.fields import Field, TermGroup

DEFAULT_TAPER = Quantity.from_mean(0.0, 0.05, "normal")
_SOURCE = "normal: hand-planed and belt-sanded boards of 3-5 mm differ by 0.1-0.2 mm from end to end, either way"
_FIELD_SOURCE = "normal: what the readings leave open of a smooth thickness, in standard deviations"
_POWERS: dict[TermGroup, int] = {"bending": 3, "shear": 1, "mass": 1, "rotary": 3}
"""How each group of terms goes with the thickness."""
_MOST_FACTORS = 2
"""Components that a term of the expansion of a power multiplies: with three, terms of third order would be there."""


@dataclass(frozen=True)
class ThicknessProfile(Effect):
    """Thickness h p(x, y) in stiffness and mass, p with a mean of one over the board.

    With readings at places p = p0 + sum z_k phi_k is a random field that they condition (`FieldProfile`): p0 is the
    expected profile, each component phi_k has a standard normal parameter z_k, and one more component goes with the
    mean thickness h itself. Powers of p are expanded to second order in the components, so each product of them is a
    term of its own; rotary inertia is small already, a thousandth of the kinetic energy, and follows them as the mass
    does.

    Without readings, p = 1 + alpha_x (s - 1/2) + alpha_y (t - 1/2), s and t from 0 to 1 along the whole sides: a taper
    around the mean thickness. Powers of p are polynomials in both tapers, so each power of s and t is a term of its own
    and the sum is exact.
    """

    part_x: VibratingPart = WHOLE_SIDE
    part_y: VibratingPart = WHOLE_SIDE
    profile: FieldProfile | None = None  # None: free tapers

    name: ClassVar[str] = "thickness_profile"
    scope: ClassVar[Scope] = "board"
    sentence: ClassVar[str] = "The board is not equally thick everywhere, which shifts each mode in its own way."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> ThicknessProfile:
        parts = vibrating_part(board, setup, "x"), vibrating_part(board, setup, "y")
        return cls(BOARD_OWNER, *parts, _thickness_profile(board))

    @classmethod
    def is_implied(cls, board: Board) -> bool:
        """Whether the card's thickness was read at places, and these readings do not rule out that it varies."""
        profile = _thickness_profile(board)
        return profile is not None and not profile.is_uniform

    @classmethod
    def is_known(cls, board: Board) -> bool:
        """Never: the readings determine a field, whose thickness between them is uncertain, and not a size."""
        return False

    @classmethod
    def notes(cls, board: Board) -> tuple[str, ...]:
        if not board.inputs["thickness"].has_profile:
            return ()
        remark = "the thickness was read at several places: its mean is used"
        if cls.name not in board.effects:
            return (f"{remark}, the {cls.name} is not part of this model",)
        profile = _thickness_profile(board)
        return (f"{remark}, their differences support no {cls.name}",) if profile and profile.is_uniform else ()

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[Effect, ...]:
        """No form where the readings say that the board is equally thick everywhere."""
        profile = _thickness_profile(board)
        return () if profile is not None and profile.is_uniform else super().candidates(board, setup)

    def in_setup(self, board: Board, setup: Setup) -> ThicknessProfile:
        part_x, part_y = (vibrating_part(board, setup, axis) for axis in "xy")
        return replace(self, part_x=part_x, part_y=part_y)

    def parameters(self) -> tuple[Parameter, ...]:
        """The components of the field, or the relative growth of the thickness from end to end, along x and along y."""
        if self.profile is None:
            return tuple(
                self.parameter(f"taper_{axis}", DEFAULT_TAPER, "1", 0.0, _SOURCE, f"taper along {axis}")
                for axis in "xy"
            )
        return field_parameters(self, self.profile, _FIELD_SOURCE, "thicker")

    def keeps_symmetry(self) -> tuple[bool, bool]:
        is_uniform = self.profile is not None and self.profile.is_uniform
        return is_uniform, is_uniform

    @property
    def followed_inputs(self) -> tuple[str, ...]:
        return ("thickness",) if self.profile is not None and self.profile.mean_gain is not None else ()

    def variations(self) -> Mapping[TermGroup, tuple[Variation, ...]]:
        """Powers of the expanded field, or of a taper: (c + a u + b v)^n by the multinomial theorem."""
        if self.profile is not None:
            if self.profile.is_uniform:
                return {}
            expanded = {n: self._expand_power(n) for n in set(_POWERS.values())}
            return {group: expanded[n] for group, n in _POWERS.items()} | {"rotary": self._rotary_variations()}
        fields: dict[tuple[int, int], Field | None] = {
            (i, j): partial(_monomial, i=i, j=j) if i + j else None for i, j in _exponents(max(_POWERS.values()))
        }
        return {
            group: tuple(
                Variation(fields[i, j], partial(self._taper_coefficient, n=n, i=i, j=j)) for i, j in _exponents(n)
            )
            for group, n in _POWERS.items()
        }

    def _expand_power(self, n: int) -> tuple[Variation, ...]:
        """p^n to second order in the components: p0^(n - k) with each product of k of them."""
        assert self.profile is not None
        products = [
            chosen
            for k in range(min(n, _MOST_FACTORS) + 1)
            for chosen in combinations_with_replacement(range(len(self.profile.uncertain_changes)), k)
        ]
        keys = tuple(parameter.key for parameter in self.parameters())

        def share(values: Values, chosen: tuple[int, ...], factor: int) -> Floats:
            assert self.profile is not None
            z = standard_coordinates(self.profile, values["thickness"], [self.value(values, key) for key in keys])
            return np.asarray(factor * prod((z[k] for k in chosen), start=np.ones(1)))

        return tuple(
            Variation(
                _ExpandedField(self.part_x, self.part_y, self.profile, n - len(chosen), chosen),
                partial(share, chosen=chosen, factor=comb(n, len(chosen)) * len(set(permutations(chosen)))),
                len(chosen),
            )
            for chosen in products
        )

    def _rotary_variations(self) -> tuple[Variation, ...]:
        """p0^2 (p0 + d): the mass follows the components d, the radius of gyration the expected profile alone.

        To first order p^3 would be negative where d < -p0 / 3, and so would the mass of strains without other mass.
        """
        cube = self._expand_power(_POWERS["rotary"])
        first = (
            replace(variation, weight=_third_of_weight(variation.weight), order=2)
            for variation in cube
            if variation.order == 1
        )
        return (*(replace(variation, order=1) for variation in cube if variation.order == 0), *first)

    def _taper_coefficient(self, values: Values, n: int, i: int, j: int) -> Floats:
        """Coefficient of u^i v^j in the n-th power of the taper, u and v from the middle of the vibrating part."""
        taper_x, taper_y = self.value(values, "taper_x"), self.value(values, "taper_y")
        middle = 1.0 + taper_x * self.part_x.middle + taper_y * self.part_y.middle
        along_x, along_y = taper_x * self.part_x.share, taper_y * self.part_y.share
        return comb(n, i) * comb(n - i, j) * middle ** (n - i - j) * along_x**i * along_y**j


def _third_of_weight(weight: Callable[[Values], Floats] | None) -> Callable[[Values], Floats]:
    assert weight is not None
    return lambda values: weight(values) / _POWERS["rotary"]


@dataclass(frozen=True)
class _ExpandedField:
    """A power of the expected profile, times some of its components: one field of an expanded power."""

    part_x: VibratingPart
    part_y: VibratingPart
    profile: FieldProfile
    power: int
    chosen: tuple[int, ...]

    def __call__(self, x: Floats, y: Floats) -> Floats:
        at = self.part_x.on_whole(x), self.part_y.on_whole(y)
        factors = [self.profile.uncertain_changes[k](*at) for k in self.chosen]
        return prod(factors, start=(1.0 + self.profile.expected(*at)) ** self.power)


def _thickness_profile(board: Board) -> FieldProfile | None:
    """Profile of the board's thickness from its readings; None where they have no places."""
    thickness, length_x, length_y = (board.inputs[name] for name in ("thickness", "length_x", "length_y"))
    readings = thickness_readings(thickness, length_x, length_y)
    if readings is None:
        return None
    return field_profile(condition_field(readings), mountings(board), max(_POWERS.values()), thickness.is_exact)


def _exponents(degree: int) -> tuple[tuple[int, int], ...]:
    """Exponents of x and y up to a degree, lowest first."""
    return tuple((total - j, j) for total in range(degree + 1) for j in range(total + 1))


def _monomial(x: Floats, y: Floats, i: int, j: int) -> Floats:
    return (x - 0.5) ** i * (y - 0.5) ** j
