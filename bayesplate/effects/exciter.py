"""Exciter: a coil that is glued to the board, and a magnet that hangs on it by a soft spring."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import ClassVar

import numpy as np

from bayesplate.board.board import Board, Values
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Ends, Setup
from bayesplate.effects.attached_items import fractions_on, places_on
from bayesplate.effects.base import Contribution, Effect, Floats, Mass, Scope, Stiffness
from bayesplate.effects.drives import Drive, Spot, all_over, at_station, drive_of, is_stated, range_of, with_known_coil
from bayesplate.effects.part import vibrating_mass
from bayesplate.plate.terms import Amount, AtPlaces

_ANYWHERE = "nearly uniform over the board, mirror places once"
_LEAST_MAGNET = 0.05
"""Share of the whole that is left to the magnet, however heavy a draw makes the coil."""
_STANDS_STILL = 1e-3
"""Lowest resonance, Hz: on no spring at all the magnet still has a frequency of its own, far below every mode."""
_ACROSS = 4.0
_FEWEST_ORDER = 2
_QUADRATURE = 0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)


@dataclass(frozen=True)
class Exciter(Effect):
    """Voice-coil exciters: k (w(p) - z)^2 in stiffness, m_coil w(p)^2 + m_magnet z^2 in mass, z the magnet's rise.

    Above the resonance of the magnet on its suspension the magnet stands still and the suspension is a spring to the
    ground, which raises low modes; below it the magnet is a mass. The magnet's own motion is one more mode. A magnet
    that is held is no coordinate.

    An exciter that roved is one plate for each place (`stations`), and what is read is the mean of the frequencies. One
    of which nobody says where it is has its place as two parameters: the squared deflection there is a polynomial
    between a few places, so that the place is a weight like any other. Where both ends of a side are alike, mirror
    places are one.
    """

    drives: tuple[Drive, ...] = ()
    ends_x: Ends = ("free", "free")
    ends_y: Ends = ("free", "free")
    # highest of the beam functions that are read along x and y
    orders: tuple[int, int] = (_FEWEST_ORDER, _FEWEST_ORDER)

    name: ClassVar[str] = "exciter"
    scope: ClassVar[Scope] = "setup"
    is_of_campaign: ClassVar[bool] = True
    refines: ClassVar[float] = 1.4
    sentence: ClassVar[str] = (
        "An exciter's magnet stands still on its spring, which holds the board and raises its lowest modes."
    )
    references: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def of(cls, board: Board, setup: Setup) -> Exciter:
        drives = tuple(drive_of(board, setup, item) for item in setup.attached if item.kind == cls.name)
        return cls(setup.owner, drives, setup.ends_x, setup.ends_y, _orders(setup))

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        if any(item.kind == cls.name for item in setup.attached):
            return ""
        return 'no [[setup.attached]] of kind = "exciter" says that one was fixed to the board'

    @classmethod
    def is_implied(cls, board: Board) -> bool:
        return any(cls.is_wanted(setup) for setup in board.setups)

    @classmethod
    def is_wanted(cls, setup: Setup) -> bool:
        """Whether the setup states what moves of an exciter: the whole, or the coil alone where the magnet is held."""
        return any(item.kind == cls.name and is_stated(item) for item in setup.attached)

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[Exciter, ...]:
        """The setup's exciters, with the usual coil: a search need not try others."""
        if cls.refusal(board, setup):
            return ()
        whole = cls.of(board, setup)
        return (replace(whole, drives=tuple(with_known_coil(drive) for drive in whole.drives)),)

    def in_setup(self, board: Board, setup: Setup) -> Exciter | None:
        """The exciters at their places of the board, held another way; none where none is fixed to it."""
        if self.refusal(board, setup):
            return None
        own = board.setup(self.owner.name)
        drives = tuple(
            replace(drive, places=fractions_on(board, setup, places_on(board, own, drive.places)))
            for drive in self.drives
        )
        return Exciter(setup.owner, drives, setup.ends_x, setup.ends_y, _orders(setup))

    @classmethod
    def at_known_size(cls, board: Board, setup: Setup) -> Exciter | None:
        """The setup's exciters; places that nobody knows are four, those of Gauss's rule over the board."""
        if cls.refusal(board, setup):
            return None
        whole = cls.of(board, setup)
        along_x, along_y = ([low + share * (high - low) for share in _QUADRATURE] for low, high in whole._ranges)
        four = tuple((float(x), float(y)) for x in along_x for y in along_y)
        return replace(whole, drives=tuple(replace(drive, places=drive.places or four) for drive in whole.drives))

    def within(self, shaped: Effect) -> Exciter:
        drives = (replace(one, places=tuple(shaped.placed(*each) for each in one.places)) for one in self.drives)
        return replace(self, drives=tuple(drives))

    def stations(self) -> tuple[Exciter, ...]:
        n_places = max((len(drive.places) for drive in self.drives), default=0)
        if n_places < 2:
            return (self,)
        return tuple(
            replace(self, drives=tuple(replace(one, places=at_station(one.places, k)) for one in self.drives))
            for k in range(n_places)
        )

    def parameters(self) -> tuple[Parameter, ...]:
        """Mass, coil and suspension (or resonance) of each exciter, and its place where nobody knows it."""
        return tuple(parameter for i in range(len(self.drives)) for parameter in self._parameters_of(i))

    def _parameters_of(self, i: int) -> tuple[Parameter, ...]:
        drive = self.drives[i]
        found = [self._parameter(i, "coil", drive.coil, "kg", 0.0, "mass of the coil")]
        if drive.is_resonance or not drive.is_held:
            found.append(self._parameter(i, "mass", drive.mass, "kg", drive.mass[0].median, "mass"))
        key, unit = ("resonance", "Hz") if drive.is_resonance else ("suspension", "N/m")
        found.append(self._parameter(i, key, drive.suspension, unit, 0.0, key))
        if not drive.places:
            for axis, (low, high) in zip("xy", self._ranges, strict=True):
                middle, words = 0.5 * (low + high), f"place along {axis}"
                prior = Quantity.from_mean(middle, 2.0 * (high - low), "normal", lower=low, upper=high)
                place = self._parameter(i, f"place_{axis}", (prior, _ANYWHERE), "1", middle, words)
                found.append(replace(place, usual=middle))
        return tuple(found)

    def _parameter(
        self, i: int, key: str, stated: tuple[Quantity, str], unit: str, null: float, words: str
    ) -> Parameter:
        prior, source = stated
        return self.parameter(self._key(i, key), prior, unit, null, source, words)

    def _key(self, i: int, key: str) -> str:
        return key if len(self.drives) == 1 else f"{key}_{i + 1}"

    @property
    def _ranges(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ranges along both sides where an exciter may be, mirror places once."""
        return (range_of(self.ends_x), range_of(self.ends_y))

    def _spots(self, drive: Drive) -> tuple[Spot, Spot]:
        if drive.places:
            x, y = drive.places[0]
            return Spot(x, x), Spot(y, y)
        return tuple(  # type: ignore[return-value]
            Spot(low, high, int(np.ceil(np.pi * (order + 1) * (high - low) + _ACROSS)))
            for (low, high), order in zip(self._ranges, self.orders, strict=True)
        )

    def also_at(self) -> tuple[Mapping[str, float], ...]:
        """Places all over where it may be, on its stiffest spring: a plate gives way there alone, as at no other place.

        Ends of the place alone would leave out what the middle does, and a usual spring most of what a stiff one does.
        """
        return tuple(
            {
                self.name_of(self._key(i, "place_x")): x,
                self.name_of(self._key(i, "place_y")): y,
                self.name_of(self._key(i, "resonance" if drive.is_resonance else "suspension")): 1.0,
            }
            for i, drive in enumerate(self.drives)
            if not drive.places
            for x, y in product(*(all_over(*each) for each in self._ranges))
        )

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """The halves differ: even in the middle of the board, the magnet's mode belongs to one class alone."""
        return False, False

    def contributions(self) -> tuple[Contribution, ...]:
        """For each exciter its suspension between coil and magnet, and their masses."""
        coordinates = np.cumsum([0, *(not drive.is_held for drive in self.drives)]).tolist()
        return tuple(
            contribution for i in range(len(self.drives)) for contribution in self._contributions_of(i, coordinates[i])
        )

    def _contributions_of(self, i: int, coordinate: int) -> tuple[Contribution, ...]:
        """The magnet's coordinate is its rise times the root of its share in the vibrating mass.

        So it keeps a frequency of its own, and does not vanish from the problem where the spring or the magnet does.
        """
        drive = self.drives[i]
        spots = self._spots(drive)

        at_nodes = [Amount(((1.0, x, y),)) for x in spots[0].nodes.tolist() for y in spots[1].nodes.tolist()]
        magnet_rises = Amount(beside=coordinate)
        squares = tuple(AtPlaces(((1.0, one, one),)) for one in at_nodes)
        between = tuple(AtPlaces(((2.0, magnet_rises, one),)) for one in at_nodes)
        of_magnet = AtPlaces(((1.0, magnet_rises, magnet_rises),))
        springs = squares if drive.is_held else (*squares, *between, of_magnet)
        inertias = squares if drive.is_held else (*squares, of_magnet)

        def stiffness(values: Values, setup: Setup) -> Floats:
            whole, shares = vibrating_mass(values, setup), self._shares(i, spots, values)
            magnet = self._magnet(i, values)
            pulsation = self._pulsation(i, values, magnet)
            spring = (magnet * pulsation**2 / whole)[..., None] * shares
            if drive.is_held:
                return spring
            pull = -(np.sqrt(magnet / whole) * pulsation**2)[..., None] * shares
            return _joined(spring, pull, (pulsation**2)[..., None])

        def inertia(values: Values, setup: Setup) -> Floats:
            whole, shares = vibrating_mass(values, setup), self._shares(i, spots, values)
            coil = (self.value(values, self._key(i, "coil")) / whole)[..., None] * shares
            return coil if drive.is_held else _joined(coil, np.ones(1))

        return Stiffness(springs, stiffness), Mass(inertias, inertia)

    def _magnet(self, i: int, values: Values) -> Floats:
        if self.drives[i].is_held and not self.drives[i].is_resonance:
            return np.ones(1)
        mass = self.value(values, self._key(i, "mass"))
        return np.maximum(mass - self.value(values, self._key(i, "coil")), _LEAST_MAGNET * mass)

    def _pulsation(self, i: int, values: Values, magnet: Floats) -> Floats:
        """Angular frequency of the magnet on its suspension, 1/s."""
        least = 2.0 * np.pi * _STANDS_STILL
        if self.drives[i].is_resonance:
            return np.maximum(2.0 * np.pi * self.value(values, self._key(i, "resonance")), least)
        return np.maximum(np.sqrt(self.value(values, self._key(i, "suspension")) / magnet), least)

    def _shares(self, i: int, spots: Sequence[Spot], values: Values) -> Floats:
        """What the squared deflection at each node has of that at the exciter's place: (..., n_x * n_y) array."""
        along = []
        for axis, spot in zip("xy", spots, strict=True):
            at = spot.low if self.drives[i].places else self.value(values, self._key(i, f"place_{axis}"))
            along.append(spot.shares(np.asarray(at)))
        each = along[0][..., :, None] * along[1][..., None, :]
        return np.asarray(each.reshape(*each.shape[:-2], -1))


def _orders(setup: Setup) -> tuple[int, int]:
    """Highest orders of the beam functions among the readings."""
    beams = [reading.beams for reading in setup.readings]
    highest = [max((one[axis] for one in beams), default=0) for axis in (0, 1)]
    return max(highest[0], _FEWEST_ORDER), max(highest[1], _FEWEST_ORDER)


def _joined(*parts: Floats) -> Floats:
    """Columns of several terms side by side, one draw where all have one."""
    n_draws = max((one.shape[0] for one in parts if one.ndim > 1), default=0)
    wide = [np.broadcast_to(one, (n_draws, one.shape[-1])) for one in parts] if n_draws else list(parts)
    return np.concatenate(wide, axis=-1)
