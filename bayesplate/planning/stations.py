"""Ways to read modes: the board held as it was, with all edges free, or as a cantilever."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
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
    """A way to hold the board, and the modes that can be read there."""

    setup: Setup  # its readings: those of `base` first, then what the model expects of the modes that could be read
    base: Setup  # the setup of the board that goes on, or from which another one takes its sensor and its air
    n_old: int = 0  # readings that were taken already; 0 where the board was never held so

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
        """The spots on the whole board, m."""
        return places_on(board, self.setup, self.spots)

    def system(self, board: Board) -> System:
        """The setup with the effects of a board that was made for its base."""
        if all(one.name != self.setup.name for one in board.setups):
            acting = (one.in_setup(board, self.setup) for one in board.chosen if one.scope == "setup")
            new = {one.name: one for one in acting if one is not None}
            board = replace(board, setups=(*board.setups, self.setup), chosen=(*board.chosen, *new.values()))
        return System(self.setup, effects_of(board, self.setup))

    def values(self, system: System, values: Values) -> dict[str, Floats]:
        """Values that also hold what the effects of a system take and the board was not asked for.

        What an effect of a setup is in another one is taken to be as large: the same sensor, the same clamp.
        """
        by_key = {
            (effect.name, one.key): values[one.name]
            for effect in map(self._in_base, system.effects)
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

    def _in_base(self, effect: Effect) -> Effect:
        """An effect under the names that it has in the base."""
        return replace(effect, owner=self.base.owner) if effect.owner == self.setup.owner else effect


def old_stations(board: Board, values: Values) -> Iterator[Station]:
    """The ways in which the board was held, each with the modes that were not read, computed at these values (SI)."""
    for setup in board.setups:
        read = tuple(replace(one, frequency=Quantity.exact(one.frequency.mean), sign="") for one in setup.readings)
        empty = replace(setup, readings=(), peaks=(), published_coefficients=None)
        more = _next_modes(board, Station(empty, setup), values, FURTHER, {one.label for one in read})
        if read or more:
            yield Station(replace(empty, readings=(*read, *more)), setup, len(read))


def new_stations(board: Board, values: Values, prior: PriorCard | None = None) -> Iterator[Station]:
    """The ways in which the board was never held, free and as a cantilever, with the modes at these values (SI).

    The noise that a prior states, if it does, is that of an edge that was not tried yet.
    """
    ways: tuple[tuple[str, Ends], ...] = (("free", ("free", "free")), ("cantilever", ("clamped", "free")))
    taken, first = {setup.name for setup in board.setups}, board.setups[0]
    for name, ends_x in ways:
        is_free = "clamped" not in ends_x
        if any(one.is_free if is_free else "clamped" in {*one.ends_x, *one.ends_y} for one in board.setups):
            continue
        while name in taken:
            name += "-2"
        noise = assumed_noise((*ends_x, "free", "free"), prior)
        empty = Setup(name, ends_x, ("free", "free"), (), noise, attached=first.attached, fluid=first.fluid)
        readings = _next_modes(board, Station(empty, first), values, ELSEWHERE, set())
        if readings:
            yield Station(replace(empty, readings=readings), first)


def _next_modes(
    board: Board, station: Station, values: Values, n: int, taken: Collection[Label]
) -> tuple[Reading, ...]:
    """The lowest modes with a clear name that were not read, each where the model expects it.

    None on whose nodal line the sensor stands, which stays where it is in a session that goes on.
    """
    system, first = station.system(board), station.setup.first_label
    there = station.values(system, values)
    modes, named = spectrum(system, there, SEARCHED)
    seen = np.ones(len(named))
    if not station.is_new and station.base.sensor is not None:
        seen = np.abs(deflections(station.base, modes, there, station.base.sensor, system.shaped))
    new = (
        (one.label, one.frequency)
        for one, share in zip(named, seen, strict=True)
        if share >= NODAL_LINE and one.label is not None and one.label not in taken
    )
    return tuple(
        Reading(label, (label.m - first.m, label.n - first.n), Quantity.exact(hertz)) for label, hertz in [*new][:n]
    )
