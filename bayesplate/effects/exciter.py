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
from bayesplate.board.setup import EdgeConditions, Setup
from bayesplate.effects.attached_items import are_mirrored, fractions_on, places_on
from bayesplate.effects.base import Contribution, Effect, Floats, Mass, Scope, Stiffness
from bayesplate.effects.drives import (
    Drive,
    PlaceRange,
    drive_of,
    has_stated_mass,
    place_range,
    place_shares,
    places_at_station,
    with_known_coil,
)
from bayesplate.effects.part import vibrating_mass
from bayesplate.plate.terms import PointMotion, PointTerm

_PLACE_SOURCE = "nearly uniform over the board, mirror places once"
_LEAST_MAGNET_SHARE = 0.05
"""Least share of the exciter's mass that is the magnet's, however heavy a draw makes the coil."""
_LOWEST_RESONANCE = 1e-3
"""Lowest resonance, Hz: on no spring at all the magnet still has a frequency of its own, far below every mode."""
_EXTRA_NODES = 4.0
_LEAST_ORDER = 2
_GAUSS_POINTS = 0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)


@dataclass(frozen=True)
class Exciter(Effect):
    """Voice-coil exciters: k (w(p) - z)^2 in stiffness, m_coil w(p)^2 + m_magnet z^2 in mass, z the magnet's rise.

    Above the resonance of the magnet on its suspension the magnet stands still and the suspension is a spring to the
    ground, which raises low modes; below it the magnet is a mass. The magnet's own motion is one more mode. A magnet
    that is held is no coordinate.

    An exciter that roved is one plate for each place (`stations`), and what is read is the mean of the frequencies. An
    exciter whose place is not stated has its place as two parameters: the squared deflection there is a polynomial
    between a few places, so that the place is a weight like any other. Where both ends of a side are alike, mirror
    places count once.
    """

    drives: tuple[Drive, ...] = ()
    ends_x: EdgeConditions = ("free", "free")
    ends_y: EdgeConditions = ("free", "free")
    # highest of the beam functions that are read along x and y
    orders: tuple[int, int] = (_LEAST_ORDER, _LEAST_ORDER)

    name: ClassVar[str] = "exciter"
    scope: ClassVar[Scope] = "setup"
    is_of_campaign: ClassVar[bool] = True
    refines: ClassVar[float] = 1.4
    sentence: ClassVar[str] = (
        "An exciter's magnet stands still on its spring, which holds the board and raises its lowest modes."
    )

    @classmethod
    def of(cls, board: Board, setup: Setup) -> Exciter:
        drives = tuple(drive_of(board, setup, item) for item in setup.attached if item.kind == cls.name)
        return cls(setup.owner, drives, setup.ends_x, setup.ends_y, _highest_orders(setup))

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        if not any(item.kind == cls.name for item in setup.attached):
            return 'no [[setup.attached]] of kind = "exciter" says that one was fixed to the board'
        swing = _highest_swing(board, setup, cls.of(board, setup).drives) if setup.is_free else 0.0
        if swing > min(setup.measured, default=np.inf):
            return (
                f"a free board swings on the spring of its held magnet at {swing:.3g} Hz, above its lowest mode, and "
                "the three lowest motions of a free board are taken for those without bending"
            )
        return ""

    @classmethod
    def is_wanted(cls, setup: Setup) -> bool:
        """Whether the setup states what moves of an exciter: the whole, or the coil alone where the magnet is held."""
        return any(item.kind == cls.name and has_stated_mass(item) for item in setup.attached)

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[Exciter, ...]:
        """The setup's exciters, with the usual coil: a search need not try others."""
        if cls.refusal(board, setup):
            return ()
        exciters = cls.of(board, setup)
        return (replace(exciters, drives=tuple(with_known_coil(drive) for drive in exciters.drives)),)

    def in_setup(self, board: Board, setup: Setup) -> Exciter | None:
        """The exciters at their places on the board as another setup holds it; None where it has no exciter."""
        if self.refusal(board, setup):
            return None
        origin = board.setup(self.owner.name)
        drives = tuple(
            replace(drive, places=fractions_on(board, setup, places_on(board, origin, drive.places)))
            for drive in self.drives
        )
        return Exciter(setup.owner, drives, setup.ends_x, setup.ends_y, _highest_orders(setup))

    @classmethod
    def at_known_size(cls, board: Board, setup: Setup) -> Exciter | None:
        """The setup's exciters; an unknown place becomes the four places of Gauss's rule over the board."""
        if cls.refusal(board, setup):
            return None
        exciters = cls.of(board, setup)
        along_x, along_y = (
            [low + share * (high - low) for share in _GAUSS_POINTS] for low, high in exciters._side_ranges
        )
        gauss_places = tuple((float(x), float(y)) for x in along_x for y in along_y)
        n = len(gauss_places)  # two exciters do not stand on one of them
        return replace(
            exciters,
            drives=tuple(
                replace(drive, places=drive.places or gauss_places[k % n :] + gauss_places[: k % n])
                for k, drive in enumerate(exciters.drives)
            ),
        )

    def within_outline(self, shaped: Effect) -> Exciter:
        drives = (
            replace(drive, places=tuple(shaped.to_plate(*place) for place in drive.places)) for drive in self.drives
        )
        return replace(self, drives=tuple(drives))

    def stations(self) -> tuple[Exciter, ...]:
        n_places = max((len(drive.places) for drive in self.drives), default=0)
        if n_places < 2:
            return (self,)
        return tuple(
            replace(
                self, drives=tuple(replace(drive, places=places_at_station(drive.places, k)) for drive in self.drives)
            )
            for k in range(n_places)
        )

    def parameters(self) -> tuple[Parameter, ...]:
        """Mass, coil and suspension (or resonance) of each exciter, and its place where it is not stated."""
        return tuple(parameter for i in range(len(self.drives)) for parameter in self._parameters_of(i))

    def _parameters_of(self, i: int) -> tuple[Parameter, ...]:
        drive = self.drives[i]
        parameters = [self._parameter(i, "coil", drive.coil, "kg", 0.0, "mass of the coil")]
        if drive.is_resonance or not drive.is_held:
            parameters.append(self._parameter(i, "mass", drive.mass, "kg", drive.mass[0].median, "mass"))
        key, unit = ("resonance", "Hz") if drive.is_resonance else ("suspension", "N/m")
        parameters.append(self._parameter(i, key, drive.suspension, unit, 0.0, key))
        if not drive.places:
            for axis, (low, high) in zip("xy", self._side_ranges, strict=True):
                middle, words = 0.5 * (low + high), f"place along {axis}"
                prior = Quantity.from_mean(middle, 2.0 * (high - low), "normal", lower=low, upper=high)
                place = self._parameter(i, f"place_{axis}", (prior, _PLACE_SOURCE), "1", middle, words)
                parameters.append(replace(place, typical_value=middle))
        return tuple(parameters)

    def _parameter(
        self,
        i: int,
        key: str,
        prior_and_source: tuple[Quantity, str],
        unit: str,
        neutral_value: float,
        display_name: str,
    ) -> Parameter:
        prior, source = prior_and_source
        return self.parameter(self._key(i, key), prior, unit, neutral_value, source, display_name)

    def _key(self, i: int, key: str) -> str:
        return key if len(self.drives) == 1 else f"{key}_{i + 1}"

    @property
    def _side_ranges(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Ranges along both sides where an exciter may be, mirror places once."""
        return (place_range(self.ends_x), place_range(self.ends_y))

    def _place_ranges(self, drive: Drive) -> tuple[PlaceRange, PlaceRange]:
        if drive.places:
            x, y = drive.places[0]
            return PlaceRange(x, x), PlaceRange(y, y)
        return tuple(  # type: ignore[return-value]
            PlaceRange(low, high, int(np.ceil(np.pi * (order + 1) * (high - low) + _EXTRA_NODES)))
            for (low, high), order in zip(self._side_ranges, self.orders, strict=True)
        )

    def law_points(self) -> tuple[Mapping[str, float], ...]:
        """Places all over the range of an exciter, on its stiffest spring, which changes the plate's shapes most there.

        The ends of the range alone would leave out the shapes of its middle, and a usual spring most of those of a
        stiff one.
        """
        return tuple(
            {
                self.name_of(self._key(i, "place_x")): x,
                self.name_of(self._key(i, "place_y")): y,
                self.name_of(self._key(i, "resonance" if drive.is_resonance else "suspension")): 1.0,
            }
            for i, drive in enumerate(self.drives)
            if not drive.places
            for x, y in product(*(place_shares(*limits) for limits in self._side_ranges))
        )

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """The halves differ: even in the middle of the board, the magnet's mode belongs to one class alone."""
        return False, False

    def is_own_mirror(self) -> tuple[bool, bool]:
        along_x, along_y = (
            all(drive.places and are_mirrored(drive.places, axis) for drive in self.drives) for axis in (0, 1)
        )
        return along_x, along_y

    def contributions(self) -> tuple[Contribution, ...]:
        """For each exciter its suspension between coil and magnet, and their masses."""
        coordinates = np.cumsum([0, *(not drive.is_held for drive in self.drives)]).tolist()
        return tuple(
            contribution for i in range(len(self.drives)) for contribution in self._contributions_of(i, coordinates[i])
        )

    def _contributions_of(self, i: int, coordinate: int) -> tuple[Contribution, ...]:
        """The magnet's coordinate is its rise times the root of its share in the vibrating mass.

        So the magnet keeps a frequency of its own, and stays in the problem where its spring or its mass vanishes.
        """
        drive = self.drives[i]
        ranges = self._place_ranges(drive)

        node_motions = [PointMotion(((1.0, x, y),)) for x in ranges[0].nodes.tolist() for y in ranges[1].nodes.tolist()]
        magnet_rises = PointMotion(coordinate=coordinate)
        squares = tuple(PointTerm(((1.0, motion, motion),)) for motion in node_motions)
        couplings = tuple(PointTerm(((2.0, magnet_rises, motion),)) for motion in node_motions)
        magnet_square = PointTerm(((1.0, magnet_rises, magnet_rises),))
        springs = squares if drive.is_held else (*squares, *couplings, magnet_square)
        inertias = squares if drive.is_held else (*squares, magnet_square)

        def stiffness(values: Values, setup: Setup) -> Floats:
            mass, shares = vibrating_mass(values, setup), self._node_shares(i, ranges, values)
            magnet = self._magnet_mass(i, values)
            pulsation = self._angular_resonance(i, values, magnet)
            spring = (magnet * pulsation**2 / mass)[..., None] * shares
            if drive.is_held:
                return spring
            pull = -(np.sqrt(magnet / mass) * pulsation**2)[..., None] * shares
            return _join_columns(spring, pull, (pulsation**2)[..., None])

        def inertia(values: Values, setup: Setup) -> Floats:
            mass, shares = vibrating_mass(values, setup), self._node_shares(i, ranges, values)
            coil = (self.value(values, self._key(i, "coil")) / mass)[..., None] * shares
            return coil if drive.is_held else _join_columns(coil, np.ones(1))

        return Stiffness(springs, stiffness), Mass(inertias, inertia)

    def _magnet_mass(self, i: int, values: Values) -> Floats:
        if self.drives[i].is_held and not self.drives[i].is_resonance:
            return np.ones(1)
        mass = self.value(values, self._key(i, "mass"))
        return np.maximum(mass - self.value(values, self._key(i, "coil")), _LEAST_MAGNET_SHARE * mass)

    def _angular_resonance(self, i: int, values: Values, magnet: Floats) -> Floats:
        """Angular frequency of the magnet on its suspension, 1/s."""
        least = 2.0 * np.pi * _LOWEST_RESONANCE
        if self.drives[i].is_resonance:
            return np.maximum(2.0 * np.pi * self.value(values, self._key(i, "resonance")), least)
        return np.maximum(np.sqrt(self.value(values, self._key(i, "suspension")) / magnet), least)

    def _node_shares(self, i: int, ranges: Sequence[PlaceRange], values: Values) -> Floats:
        """Share of each node in the squared deflection at the exciter's place: (..., n_x * n_y) array."""
        shares = []
        for axis, side in zip("xy", ranges, strict=True):
            at = side.low if self.drives[i].places else self.value(values, self._key(i, f"place_{axis}"))
            shares.append(side.shares(np.asarray(at)))
        products = shares[0][..., :, None] * shares[1][..., None, :]
        return np.asarray(products.reshape(*products.shape[:-2], -1))


def _highest_swing(board: Board, setup: Setup, drives: Sequence[Drive]) -> float:
    """Highest frequency, Hz, at which a rigid free board swings on the springs of held magnets, each by itself.

    A place that is not stated counts as one between the middle and a corner.
    """
    swings = [0.0]
    for drive in drives:
        if drive.is_held:
            s, t = drive.places[0] if drive.places else (0.25, 0.25)
            spring = drive.suspension[0].median
            if drive.is_resonance:
                spring = (drive.mass[0].median - drive.coil[0].median) * (2.0 * np.pi * spring) ** 2
            lever = 1.0 + 12.0 * ((s - 0.5) ** 2 + (t - 0.5) ** 2)
            swings.append(float(np.sqrt(spring * lever / vibrating_mass(board.nominal(), setup)) / (2.0 * np.pi)))
    return max(swings)


def _highest_orders(setup: Setup) -> tuple[int, int]:
    """Highest orders of the beam functions among the readings."""
    beams = [reading.beams for reading in setup.readings]
    highest = [max((orders[axis] for orders in beams), default=0) for axis in (0, 1)]
    return max(highest[0], _LEAST_ORDER), max(highest[1], _LEAST_ORDER)


def _join_columns(*columns: Floats) -> Floats:
    """Weights of several terms side by side, of one draw where all are of one."""
    n_draws = max((column.shape[0] for column in columns if column.ndim > 1), default=0)
    wide = [np.broadcast_to(column, (n_draws, column.shape[-1])) for column in columns] if n_draws else list(columns)
    return np.concatenate(wide, axis=-1)
