"""Attached mass: an accelerometer, an exciter or a weight that moves with the board."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from bayesplate.effects.attached_items import (
    Fractions,
    Item,
    board_mass,
    forgotten_items,
    item_on_board,
    rotary_inertia,
)
from bayesplate.effects.base import Effect, EffectParameter, Floats, Scope
from bayesplate.modes.line import Line
from bayesplate.modes.plate import KronSum
from bayesplate.plate.board import Board, Values, density, vibrating_lengths
from bayesplate.plate.setup import Setup

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

    A place that nobody knows is no continuous parameter: `candidates` tries a few places instead. Places are fractions
    of the nominal sides.

    Attributes
    ----------
    items : tuple of Item
    """

    items: tuple[Item, ...] = ()

    name: ClassVar[str] = "attached_mass"
    scope: ClassVar[Scope] = "setup"
    refines: ClassVar[float] = 1.4
    sentence: ClassVar[str] = "Something fixed to the board moves with it, so modes that move its place ring lower."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> AttachedMass:
        """The things of known mass; the others too if the card lists the effect, or alone if there are no others."""
        known = [item for item in setup.attached if item.mass is not None]
        items = setup.attached if cls.name in board.effects or not known else known
        return cls(setup.name, tuple(item_on_board(board, setup, item) for item in items))

    @classmethod
    def is_implied(cls, board: Board) -> bool:
        """Whether the card states the mass of an attached thing."""
        return any(cls.is_wanted(setup) for setup in board.setups)

    @classmethod
    def is_wanted(cls, setup: Setup) -> bool:
        """Whether the setup states the mass of an attached thing."""
        return any(item.mass is not None for item in setup.attached)

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[AttachedMass, ...]:
        """Each thing of unknown mass beside those that are known; one thing at a few places if the setup has none."""
        known = tuple(item_on_board(board, setup, item) for item in setup.attached if item.mass is not None)
        unknown = [item_on_board(board, setup, item) for item in setup.attached if item.mass is None]
        if not setup.attached:
            unknown = forgotten_items(board, setup)
        return tuple(cls(setup.name, (*known, item)) for item in unknown)

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        """Refused where the setup does not say what is attached, or where a heavy thing roved."""
        if not setup.attached:
            return "no [[setup.attached]] says what is fixed to the board and where"
        if heaviest_roving(board, setup) > HEAVIEST_ROVING:
            return f"something above {HEAVIEST_ROVING:.0%} of the board roved: give each place a setup of its own"
        return ""

    def parameters(self) -> tuple[EffectParameter, ...]:
        """The mass of each item: `mass`, or `mass_1`, `mass_2` and so on."""
        return tuple(EffectParameter(n, "kg", i.mass, i.source) for n, i in zip(self._names, self.items, strict=True))

    @property
    def _names(self) -> list[str]:
        return ["mass"] if len(self.items) == 1 else [f"mass_{i}" for i in range(1, len(self.items) + 1)]

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """Whether each item's places mirror about the middle."""
        along_x, along_y = (all(_mirrors(item.places, axis) for item in self.items) for axis in (0, 1))
        return along_x, along_y

    def masses(self, x: Line, y: Line) -> tuple[KronSum, ...]:
        """For each item the mean square over its places of the deflection, then of the tilts along x and y."""
        terms: list[KronSum] = []
        for item in self.items:
            at_x, at_y = (np.array(values) for values in zip(*item.places, strict=True))
            moved = x.shapes(at_x), y.shapes(at_y)
            terms.append(_mean_squares(*moved))
            if any(item.radius):
                tilt_x, tilt_y = _tilts(x, at_x, item.radius[0]), _tilts(y, at_y, item.radius[1])
                terms += [_mean_squares(tilt_x, moved[1]), _mean_squares(moved[0], tilt_y)]
        return tuple(terms)

    def mass_weights(self, values: Values, setup: Setup) -> tuple[Floats, ...]:
        """Mass and rotary inertia of each item over the vibrating mass."""
        length_x, length_y = vibrating_lengths(values, setup)
        vibrating = density(values) * values["thickness"] * length_x * length_y
        weights: list[Floats] = []
        for name, item in zip(self._names, self.items, strict=True):
            mass = self.value(values, name)
            weights.append(mass / vibrating)
            if any(item.radius):
                inertia = rotary_inertia(mass)
                weights += [inertia / (vibrating * length_x**2), inertia / (vibrating * length_y**2)]
        return tuple(weights)


def heaviest_roving(board: Board, setup: Setup) -> float:
    """Mass of the heaviest thing that roved in a setup, over the board's; 0 if none did."""
    if not setup.attached:
        return 0.0
    roved = [i.mass.median for i in AttachedMass.of(board, setup).items if len(i.places) > 1]
    return max(roved, default=0.0) / board_mass(board)


def _mirrors(places: Fractions, axis: int) -> bool:
    there = Counter((round(x, 6), round(y, 6)) for x, y in places)
    mirrored = [(1.0 - x, y) if axis == 0 else (x, 1.0 - y) for x, y in places]
    return there == Counter((round(x, 6), round(y, 6)) for x, y in mirrored)


def _tilts(along: Line, at: Floats, radius: float) -> Any:
    """Tilt of a base that touches the board at its rim: (n_places, n_dof) sparse array."""
    low, high = np.maximum(at - radius, 0.0), np.minimum(at + radius, 1.0)
    return (along.shapes(high) - along.shapes(low)).multiply(1.0 / (high - low)[:, None]).tocsr()


def _mean_squares(along_x: Any, along_y: Any) -> KronSum:
    """The mean over places of the product of two rows: (n_places, n_dof_x) and (n_places, n_dof_y) sparse arrays."""
    n = along_x.shape[0]
    rows = [(along_x[[i]], along_y[[i]]) for i in range(n)]
    return tuple((row_x.T @ row_x / n, row_y.T @ row_y) for row_x, row_y in rows)
