"""Attached mass: an accelerometer, an exciter or a weight that moves with the board."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from bayesplate.board.attached import AttachedItem
from bayesplate.board.board import Board, Values, nominal_mass, vibrating_lengths
from bayesplate.board.parameter import Parameter
from bayesplate.board.setup import Setup
from bayesplate.effects.attached_items import (
    PlacedItem,
    Places,
    are_mirrored,
    forgotten_items,
    fractions_on,
    item_on_board,
    items_on_board,
    places_on,
    radius_on,
    rotary_inertia,
)
from bayesplate.effects.base import Contribution, Effect, EffectForm, Floats, Mass, Scope
from bayesplate.effects.part import vibrating_mass
from bayesplate.plate.terms import PointMotion, PointTerm

HEAVIEST_ROVING = 0.02
"""Share of the board's mass up to which a roving item is computed; see `AttachedMass`."""
ROUGH_ROVING = 0.002
"""Share up to which it errs by less than a cent, even where two modes lie close together."""


@dataclass(frozen=True)
class AttachedMass(Effect):
    """Point masses with the rotary inertia of a compact solid (5000 kg/m3, a cylinder as high as wide).

    The solid tilts as the board does across its base: the slope at a point would have no limit on finer meshes.
    The mesh is finer than that of a bare board: with 3.4 percent on a clamped board a mode errs by half a cent, with
    the bare board's by 1.2. At a tenth of the board's mass and above it shows all the same: 50 g on 300 g err by up to
    3 cents, on a shear-flexible board by up to 10.

    A roving item is the mean of its mass terms over its places, which is the mean of the frequencies to first order in
    the mass: 1.7 percent of a cantilever err by up to 2.2 cents, 3.4 percent of a clamped board by 14, growing with the
    square; where two modes lie close, 0.6 percent err by 3.5. A roving item above 2 percent is refused.

    An unknown place is no continuous parameter: `forms` tries a few places instead. Places are fractions of the nominal
    sides. An exciter is no point mass: its magnet hangs on a spring.
    """

    items: tuple[PlacedItem, ...] = ()

    name: ClassVar[str] = "attached_mass"
    scope: ClassVar[Scope] = "setup"
    is_of_campaign: ClassVar[bool] = True
    refines: ClassVar[float] = 1.4
    sentence: ClassVar[str] = "Something fixed to the board moves with it, so modes that move its place ring lower."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> AttachedMass:
        """All items where the effect is declared or no mass is known; otherwise the items of known mass."""
        placed_items = [item for item in _attached_items(setup) if item.places]
        known_items = [item for item in placed_items if item.mass is not None]
        items = placed_items if cls.name in board.effects or not known_items else known_items
        return cls(setup.owner, tuple(item_on_board(board, setup, item) for item in items))

    @classmethod
    def is_wanted(cls, setup: Setup) -> bool:
        return any(item.mass is not None for item in _attached_items(setup))

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[AttachedMass, ...]:
        """Each item of unknown mass beside those of known mass, at each likely place where its own is not known."""
        if not _attached_items(setup) or heaviest_roving(board, setup) > HEAVIEST_ROVING:
            return ()
        known_items = tuple(
            item_on_board(board, setup, item) for item in _attached_items(setup) if item.mass is not None
        )
        unknown_items = [
            placed
            for item in _attached_items(setup)
            if item.mass is None
            for placed in items_on_board(board, setup, item)
        ]
        return tuple(cls(setup.owner, (*known_items, item)) for item in unknown_items)

    @classmethod
    def forms(cls, board: Board) -> tuple[EffectForm, ...]:
        """Each item of unknown mass; where nothing is attached, a forgotten item at each of a few places."""
        if any(map(_attached_items, board.setups)):
            attached_forms = super().forms(board)
            is_placed = all(item.places for setup in board.setups for item in _attached_items(setup))
            return (
                attached_forms
                if is_placed
                else tuple(replace(form, detail=_place_detail(board, form.effects[0])) for form in attached_forms)
            )
        trials = [[cls(setup.owner, (item,)) for item in forgotten_items(board, setup)] for setup in board.setups]
        forms = []
        for effect in max(trials, key=len):
            effects = tuple(effect.in_setup(board, setup) for setup in board.setups)
            forms.append(EffectForm(_place_detail(board, effect), effects))
        return tuple(forms)

    def in_setup(self, board: Board, setup: Setup) -> AttachedMass:
        items = tuple(
            replace(item, places=fractions_on(board, setup, places), radius=radius_on(board, setup, item.base))
            for item, places in zip(self.items, self._places_on(board), strict=True)
        )
        return replace(self, owner=setup.owner, items=items)

    def within_outline(self, shaped: Effect) -> AttachedMass:
        return replace(self, items=tuple(_item_within(item, shaped) for item in self.items))

    def _places_on(self, board: Board) -> list[Places]:
        setup = board.setup(self.owner.name)
        return [places_on(board, setup, item.places) for item in self.items]

    @classmethod
    def notes(cls, board: Board) -> tuple[str, ...]:
        if cls.name not in board.effects:
            return ()
        without_mass = [
            f"the {item.kind} in setup '{setup.name}' has no mass on the card: "
            + (
                "it is fitted, from the prior of such items; mass_g states it"
                if item.places
                else "without a place it is no part of this model; at_mm states one"
            )
            for setup in board.setups
            for item in _attached_items(setup)
            if item.mass is None
        ]
        return tuple(without_mass) + tuple(
            f"what roved in setup '{setup.name}' weighs {100.0 * share:.1f} % of the board: the mean over its places "
            f"is right to first order in the mass only and may err by some cents; a setup for each place is exact"
            for setup in board.setups
            if (share := heaviest_roving(board, setup)) > ROUGH_ROVING
        )

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        if not any(item.places for item in _attached_items(setup)):
            return "no [[setup.attached]] says what is fixed to the board and where"
        if heaviest_roving(board, setup) > HEAVIEST_ROVING:
            return f"something above {HEAVIEST_ROVING:.0%} of the board roved: give each place a setup of its own"
        return ""

    def parameters(self) -> tuple[Parameter, ...]:
        """The mass of each item: `mass`, or `mass_1`, `mass_2` and so on."""
        return tuple(
            self.parameter(key, item.mass, "kg", 0.0, item.source)
            for key, item in zip(self._keys, self.items, strict=True)
        )

    @property
    def _keys(self) -> list[str]:
        return ["mass"] if len(self.items) == 1 else [f"mass_{i}" for i in range(1, len(self.items) + 1)]

    def keeps_symmetry(self) -> tuple[bool, bool]:
        along_x, along_y = (all(are_mirrored(item.places, axis) for item in self.items) for axis in (0, 1))
        return along_x, along_y

    def contributions(self) -> tuple[Contribution, ...]:
        """For each item its mass, at the mean square deflection of its places, and its inertia, at their tilts."""
        return tuple(
            contribution
            for key, item in zip(self._keys, self.items, strict=True)
            for contribution in self._item_contributions(key, item)
        )

    def _item_contributions(self, key: str, item: PlacedItem) -> Iterator[Contribution]:
        def mass(values: Values, setup: Setup) -> Floats:
            return self.value(values, key) / vibrating_mass(values, setup)

        def inertia(values: Values, setup: Setup, axis: int) -> Floats:
            side = vibrating_lengths(values, setup)[axis]
            return rotary_inertia(self.value(values, key)) / (vibrating_mass(values, setup) * side**2)

        yield Mass(_mean_squares([PointMotion(((1.0, x, y),)) for x, y in item.places]), mass)
        if any(item.radius):
            for axis in (0, 1):
                yield Mass(_mean_squares(_tilts(item, axis)), partial(inertia, axis=axis))


def _attached_items(setup: Setup) -> tuple[AttachedItem, ...]:
    """The items that move with the board as a whole: all but exciters."""
    return tuple(item for item in setup.attached if item.kind != "exciter")


def _place_detail(board: Board, effect: Effect) -> str:
    """The place of the last of the items, in words."""
    assert isinstance(effect, AttachedMass)
    x, y = effect._places_on(board)[-1][0]
    return f"at {1e3 * x:.0f}, {1e3 * y:.0f} mm"


def heaviest_roving(board: Board, setup: Setup) -> float:
    """Mass of the heaviest item that roved in a setup, over the board's; 0 if none did."""
    if not _attached_items(setup):
        return 0.0
    masses = [item.mass.median for item in AttachedMass.of(board, setup).items if len(item.places) > 1]
    return max(masses, default=0.0) / nominal_mass(board)


def _item_within(item: PlacedItem, shaped: Effect) -> PlacedItem:
    outline = shaped.outline()
    assert outline is not None
    places = tuple(shaped.to_plate(*place) for place in item.places)
    low, high = outline(np.array([x for x, _ in places]))
    return replace(item, places=places, reach=tuple(zip(low.tolist(), high.tolist(), strict=True)))


def _tilts(item: PlacedItem, axis: int) -> list[PointMotion]:
    """Tilt along x (0) or y (1) of a base that touches the board at its rim, at each place."""
    tilts = []
    for k, place in enumerate(item.places):
        first, last = item.reach[k] if axis == 1 and item.reach else (0.0, 1.0)
        ends = max(place[axis] - item.radius[axis], first), min(place[axis] + item.radius[axis], last)
        slope = 1.0 / (ends[1] - ends[0])
        low, high = ((end, place[1]) if axis == 0 else (place[0], end) for end in ends)
        tilts.append(PointMotion(((-slope, *low), (slope, *high))))
    return tilts


def _mean_squares(motions: Sequence[PointMotion]) -> PointTerm:
    return PointTerm(tuple((1.0 / len(motions), motion, motion) for motion in motions))
