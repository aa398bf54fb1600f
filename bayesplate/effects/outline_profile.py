"""Outline profile: the board is narrower at some stations than at others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import ClassVar

import numpy as np

from bayesplate.board.board import Board, Values, board_density
from bayesplate.board.parameter import BOARD_OWNER, Parameter
from bayesplate.board.random_field import condition_field, width_readings
from bayesplate.board.setup import EdgeConditions, Setup
from bayesplate.effects.base import Effect, Floats, Scope, Variation
from bayesplate.effects.field_components import FieldProfile, field_parameters, field_profile, mountings
from bayesplate.effects.part import WHOLE_SIDE, VibratingPart, vibrating_part
from bayesplate.plate.fields import EdgeStrip, Outline, TermGroup

_SOURCE = "normal: what the readings leave open of a smooth width, in standard deviations"
_GROUPS: tuple[TermGroup, ...] = ("bending", "shear", "mass", "rotary")
_N_POINTS = 400
_STRIP_SDS, _FURTHEST_STEP = 3.0, 2.94
"""Width of the strip of a single component in its steps, and the steps at which a component ends: there the strip still
has a positive weight, beyond a negative one."""
_STRIP_ORDER = 2
"""Order of smallness as which a strip counts: its own second order is left out, and so are products with it."""


@dataclass(frozen=True)
class OutlineProfile(Effect):
    """The energies of the true outline: a width W (w0(s) + sum z_k psi_k(s)), s from 0 to 1 along the whole board.

    The widths read at stations condition a random field (`FieldProfile`): w0 is the expected width, with a mean of one,
    and enters exactly; the uncertain components enter to first order, as the energies of a strip along the edge, which
    gain or lose weight.

    The functions are those of the rectangle as wide as the widest place; what lies outside the outline is all but
    removed. Where both edges along x are free the board is taken to narrow from both alike (readings of a width do not
    say which edge recedes), otherwise from the free one. The mean width is taken to be known apart from the field.
    """

    ends_y: EdgeConditions = ("free", "free")
    part_x: VibratingPart = WHOLE_SIDE
    part_y: VibratingPart = WHOLE_SIDE  # of its mean width
    profile: FieldProfile | None = None  # of the width, along x; None: a rectangle

    name: ClassVar[str] = "outline_profile"
    scope: ClassVar[Scope] = "board"
    sentence: ClassVar[str] = "The board is not equally wide everywhere, so it is not quite a rectangle."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> OutlineProfile:
        profile = _width_profile(board)
        is_rectangle = profile is None or profile.is_uniform
        parts = vibrating_part(board, setup, "x"), vibrating_part(board, setup, "y")
        return cls(BOARD_OWNER, setup.ends_y, *parts, None if is_rectangle else profile)

    @classmethod
    def is_implied(cls, board: Board) -> bool:
        """Whether the card's width was read at stations along the board, and these support that it varies."""
        profile = _width_profile(board)
        return profile is not None and not profile.is_uniform

    @classmethod
    def is_known(cls, board: Board) -> bool:
        """Never: the readings determine a field, whose width between them is uncertain, and not a size."""
        return False

    @classmethod
    def notes(cls, board: Board) -> tuple[str, ...]:
        if not board.inputs["length_y"].has_profile:
            return ()
        remark = "the length_y was read at several places: its mean is used"
        profile = _width_profile(board)
        if profile is None or profile.is_uniform:
            return (f"{remark}, their differences support no {cls.name}",)
        return () if cls.name in board.effects else (f"{remark}, the {cls.name} is not part of this model",)

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[Effect, ...]:
        """No form where the readings say that the board is a rectangle."""
        return super().candidates(board, setup) if cls.is_implied(board) else ()

    def in_setup(self, board: Board, setup: Setup) -> OutlineProfile | None:
        return None if self.refusal(board, setup) else self.of(board, setup)

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        if not board.inputs["length_y"].at_x:
            return "the card gives no widths at stations: length_y_mm = { readings = [..], at_x_mm = [..] }"
        if "free" not in setup.ends_y:
            return "neither y0 nor y1 is free, and a held edge is straight"
        return ""

    def parameters(self) -> tuple[Parameter, ...]:
        return () if self.profile is None else field_parameters(self, self.profile, _SOURCE, "wider")

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """The halves along x differ; across, only if one edge alone recedes."""
        if self.profile is None:
            return True, True
        return False, self.ends_y[0] == self.ends_y[1]

    def outline(self) -> Outline | None:
        return None if self.profile is None else _ProfileOutline(self)

    def adjusted(self, values: Values) -> Values:
        """The widest width for the sides of the rectangle, and the density that the mean width gives to a mass."""
        if self.profile is None:
            return values
        return {**values, "length_y": values["length_y"] * self._widest, "density": board_density(values)}

    def variations(self) -> Mapping[TermGroup, tuple[Variation, ...]]:
        """The uniform plate, and the strips along its edges by which the components move the outline."""
        if self.profile is None or not self.profile.components:
            return {}
        strips = tuple(
            Variation(
                EdgeStrip(_ProfileOutline(self, k), _WideningSign(self, k)), partial(self._share, k=k), _STRIP_ORDER
            )
            for k in range(len(self.profile.components))
        )
        return dict.fromkeys(_GROUPS, (Variation(None), *strips))

    def _share(self, values: Values, k: int) -> Floats:
        """Weight that a component adds to its strip."""
        assert self.profile is not None
        steps = self.value(values, self.parameters()[k].key)
        return np.asarray(np.clip(steps, -_FURTHEST_STEP, _FURTHEST_STEP) / self._strip_steps)

    def direction(self, x: Floats, y: Floats, k: int) -> Floats:
        """1 where a component widens the board, -1 where it narrows it."""
        return np.sign(self._step(self.part_x.on_whole(x), k)) + 0.0 * y

    def to_plate(self, x: float, y: float) -> tuple[float, float]:
        """The corner of x0 and y0 is that of the outline."""
        if self.profile is None:
            return x, y
        (low,), (high,) = self.limits(np.array([x]))
        return x, float(np.clip(self._corner + y * self.part_y.share / self._widest_part, low, high))

    def from_plate(self, x: float, y: float) -> tuple[float, float]:
        if self.profile is None:
            return x, y
        return x, float((y - self._corner) * self._widest_part / self.part_y.share)

    @property
    def _corner(self) -> float:
        """Place of the board's corner of x0 and y0 along y, as a fraction of the widest width."""
        return float(self.limits(np.array([-self.part_x.start / self.part_x.share]))[0][0])

    @property
    def _strip_steps(self) -> float:
        """Width of a strip in steps of its component: so wide that overlapping strips never remove all the weight."""
        assert self.profile is not None
        return _STRIP_SDS * len(self.profile.components)

    @cached_property
    def _widest(self) -> float:
        """Widest place over the mean width."""
        return float(self._widths(np.linspace(0.0, 1.0, _N_POINTS + 1)).max())

    @property
    def _widest_part(self) -> float:
        """Vibrating width at the widest place, over the mean width: the clamps cover the same width everywhere."""
        return self._widest - 1.0 + self.part_y.share

    def limits(self, x: Floats, component: int | None = None) -> tuple[Floats, Floats]:
        """The outline, or the one inside it by the strip of a component."""
        at = self.part_x.on_whole(x)
        strip = 0.0 if component is None else self._strip_steps * np.abs(self._step(at, component))
        missing = (self._widest - np.minimum(self._widths(at), self._widest) + strip) / self._widest_part
        low, high = {
            ("free", True): (0.5 * missing, 1.0 - 0.5 * missing),
            ("free", False): (missing, np.ones_like(missing)),
        }.get((self.ends_y[0], self.ends_y[1] == "free"), (np.zeros_like(missing), 1.0 - missing))
        return low, high

    def _widths(self, at: Floats) -> Floats:
        """Expected widths over their mean."""
        assert self.profile is not None
        return 1.0 + self.profile.expected(at, np.full_like(at, 0.5))

    def _step(self, at: Floats, k: int) -> Floats:
        """Widths over their mean that one step of a component gains."""
        assert self.profile is not None
        return self.profile.components[k](at, np.full_like(at, 0.5))


@dataclass(frozen=True)
class _ProfileOutline:
    """The outline of an effect, or the one inside it by the strip of a component; equal where the effects are."""

    effect: OutlineProfile
    component: int | None = None

    def __call__(self, x: Floats) -> tuple[Floats, Floats]:
        return self.effect.limits(x, self.component)


@dataclass(frozen=True)
class _WideningSign:
    effect: OutlineProfile
    k: int

    def __call__(self, x: Floats, y: Floats) -> Floats:
        return self.effect.direction(x, y, self.k)


def _width_profile(board: Board) -> FieldProfile | None:
    """Profile of the board's width from its readings along x; None where they have no places."""
    width, length = board.inputs["length_y"], board.inputs["length_x"]
    readings = width_readings(width, length)
    return (
        None if readings is None else field_profile(condition_field(readings), mountings(board), 1, mean_is_known=True)
    )
