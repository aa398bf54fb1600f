"""Ways to read further modes: the board held as it is, held another way, or with a known mass on it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board, Values
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Reading
from bayesplate.board.setup import Ends, Setup, assumed_noise
from bayesplate.effects import effects_of
from bayesplate.effects.attached_items import places_on
from bayesplate.effects.base import Effect
from bayesplate.frequencies.residues import NODAL_LINE, deflections
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.frequencies.system import System
from bayesplate.labels import Label

Floats = NDArray[np.float64]

FURTHER = 8
"""Modes beyond those that were read from which the best are chosen."""
ELSEWHERE = 6
"""Lowest modes that are read where the board is held another way."""
SEARCHED = 24
"""Lowest modes of a way to hold the board among which those that are read are looked for."""
_NEAR_FREE, _NEAR_HELD = 0.94, 0.7
"""Where a known mass stands besides the middle, as fractions of a side whose end is free or held."""


@dataclass(frozen=True, eq=False)
class Station:
    """A way to hold the board, and the modes that can be read there.

    Attributes
    ----------
    setup : Setup
        Its readings: those of `base` first, then what the model expects of the modes that could be read.
    base : Setup
        The setup of the board that goes on, or from which another one takes its sensor and its air.
    n_old : int
        Readings that were taken already; 0 where the board was never held so.
    """

    setup: Setup
    base: Setup
    n_old: int = 0

    @property
    def is_new(self) -> bool:
        """Whether the board was never held so."""
        return self.setup.name != self.base.name

    @property
    def held(self) -> str:
        """How the board is held where it was never held so, in words."""
        return "with all edges free" if self.setup.is_free else "clamped along x0 alone"

    def goes_on(self, board: Board) -> bool:
        """Whether something more can be read in it: of several sessions of one setup, in the last."""
        if self.is_new or self.base.group is None:
            return True
        return self.base.name == [one.name for one in board.setups if one.group == self.base.group][-1]

    @property
    def spots(self) -> tuple[tuple[float, float], ...]:
        """Where a known mass could stand, as fractions of the vibrating sides; nowhere where nothing was read."""
        if not self.n_old:
            return ()
        ends = (_NEAR_FREE if end == "free" else _NEAR_HELD for end in (self.setup.ends_x[1], self.setup.ends_y[1]))
        along, across = ((0.5, end) for end in ends)
        return tuple((s, t) for s in along for t in across)

    def places(self, board: Board) -> tuple[tuple[float, float], ...]:
        """The same on the whole board, m."""
        return places_on(board, self.setup, self.spots)

    def system(self, board: Board) -> System:
        """The setup with the effects of a board that was made for its base."""
        return System(self.setup, effects_of(_carrying(board, self.setup), self.setup))

    def values(self, system: System, values: Values) -> dict[str, Floats]:
        """Values that also hold what the effects of a system take and the board was not asked for.

        What an effect of a setup is in another one is taken to be as large: the same sensor, the same clamp.
        """
        of_base = [_renamed(effect, self) for effect in system.effects]
        by_key = {
            (effect.name, one.key): values[one.name]
            for effect in of_base
            for one in effect.parameters()
            if one.name in values
        }
        missing = {
            one.name: np.asarray(by_key.get((effect.name, one.key), one.prior.median))
            for effect in system.effects
            for one in effect.parameters()
            if one.name not in values
        }
        return {**values, **missing}


def _renamed(effect: Effect, station: Station) -> Effect:
    """An effect under the names that it has in the setup from which a station comes."""
    return replace(effect, owner=station.base.owner) if effect.owner == station.setup.owner else effect


def _carrying(board: Board, setup: Setup) -> Board:
    """A board with its chosen effects also in a setup that they do not know."""
    if any(one.name == setup.name for one in board.setups):
        return board
    new = {
        one.name: acting
        for one in board.chosen
        if one.scope == "setup" and (acting := one.in_setup(board, setup)) is not None
    }
    return replace(board, setups=(*board.setups, setup), chosen=(*board.chosen, *new.values()))


def stations(
    board: Board, values: Values, prior: PriorCard | None = None, *, is_elsewhere: bool = True
) -> tuple[Station, ...]:
    """Every way to hold the board that is looked at: as it was held, free, and as a cantilever.

    Parameters
    ----------
    board : Board
    values : dict of float
        Where the modes are computed.
    prior : PriorCard, optional
        Its noise, where it states one, is that of an edge that was not tried yet.
    is_elsewhere : bool
        Whether ways in which the board was not held are looked at.
    """
    found: list[Station] = []
    for setup in board.setups:
        read = tuple(replace(one, frequency=Quantity.exact(one.frequency.mean), sign="") for one in setup.readings)
        empty = replace(setup, readings=(), peaks=(), published_coefficients=None)
        more = _next_modes(board, Station(empty, setup), values, FURTHER, {one.label for one in read})
        found.append(Station(replace(empty, readings=(*read, *more)), setup, len(read)))
    found += new_stations(board, values, prior) if is_elsewhere else ()
    return tuple(one for one in found if one.setup.readings)


def new_stations(board: Board, values: Values, prior: PriorCard | None = None) -> tuple[Station, ...]:
    """The ways to hold the board in which it was never held: free, and as a cantilever."""
    ways: tuple[tuple[str, Ends], ...] = (("free", ("free", "free")), ("cantilever", ("clamped", "free")))
    found: list[Station] = []
    for name, ends_x in ways:
        other = _elsewhere(board, name, ends_x, prior)
        if other is not None:
            more = _next_modes(board, Station(other, board.setups[0]), values, ELSEWHERE, set())
            found.append(Station(replace(other, readings=more), board.setups[0]))
    return tuple(one for one in found if one.setup.readings)


def _elsewhere(board: Board, name: str, ends_x: Ends, prior: PriorCard | None) -> Setup | None:
    """The board with y0 and y1 free, in a setup of its own; None where it was held so already, or nearly so."""
    is_free = "clamped" not in ends_x
    held = [setup.is_free if is_free else "clamped" in {*setup.ends_x, *setup.ends_y} for setup in board.setups]
    if any(held):
        return None
    taken, first = {setup.name for setup in board.setups}, board.setups[0]
    while name in taken:
        name += "-2"
    noise = assumed_noise((*ends_x, "free", "free"), prior)
    return Setup(name, ends_x, ("free", "free"), (), noise, attached=first.attached, fluid=first.fluid)


def _next_modes(
    board: Board, station: Station, values: Values, n: int, taken: Collection[Label]
) -> tuple[Reading, ...]:
    """The lowest modes with a clear name that were not read, each where the model expects it.

    None on whose nodal line the sensor stands, which stays where it is in a session that goes on.
    """
    system, first = station.system(board), station.setup.first_label
    there = station.values(system, values)
    modes, named = spectrum(system, there, SEARCHED)
    sensor = None if station.is_new else station.base.sensor
    at = (
        np.ones(len(named))
        if sensor is None
        else np.abs(deflections(station.base, modes, there, sensor, system.shaped))
    )
    seen = [one for one, share in zip(named, at, strict=True) if share >= NODAL_LINE]
    new = [one for one in seen if one.label is not None and one.label not in taken]
    return tuple(
        Reading(one.label, (one.label.m - first.m, one.label.n - first.n), Quantity.exact(one.frequency))
        for one in new[:n]
        if one.label is not None
    )
