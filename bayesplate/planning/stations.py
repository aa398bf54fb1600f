"""Stations: ways to hold the board and read its modes, as it was held, with all edges free, or as a cantilever."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Reading
from bayesplate.board.setup import EdgeConditions, Setup, assumed_noise
from bayesplate.effects import effects_of
from bayesplate.effects.attached_items import places_on
from bayesplate.effects.base import Effect
from bayesplate.frequencies.residues import NODAL_LINE, deflections
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.frequencies.system import System
from bayesplate.labels import Label

N_FURTHER_MODES = 8
"""Unread modes from which the best are chosen."""
N_NEW_MODES = 6
"""Lowest modes that are read where the board is held another way."""
N_SEARCHED_MODES = 24
"""Lowest computed modes of a station, among which the modes with clear names are found."""
_NEAR_FREE, _NEAR_HELD = 0.94, 0.7
"""Places of a known mass besides the middle, as fractions of a side whose end is free or held."""


@dataclass(frozen=True, eq=False)
class Station:
    """A way to hold the board, and the modes that can be read there."""

    setup: Setup  # its readings: those of `base` first, then the unread modes at the frequencies of the model
    base: Setup  # the setup of the board that goes on, or from which a new one takes its sensor and its air
    n_old: int = 0  # readings that were taken already; 0 where the board was never held so

    @property
    def is_new(self) -> bool:
        """Whether the board was never held so."""
        return self.setup.name != self.base.name

    @property
    def mounting_words(self) -> str:
        """How the board is held where it was never held so, in words."""
        return "with all edges free" if self.setup.is_free else "clamped along x0 alone"

    def takes_readings(self, board: Board) -> bool:
        """Whether more can be read in this station: of several sessions of one setup, in the last only."""
        if self.is_new or self.base.group is None:
            return True
        return self.base.name == [setup.name for setup in board.setups if setup.group == self.base.group][-1]

    @property
    def spots(self) -> tuple[tuple[float, float], ...]:
        """Places for a known mass, as fractions of the vibrating sides; none where no mode was read."""
        if not self.n_old:
            return ()
        ends = (_NEAR_FREE if end == "free" else _NEAR_HELD for end in (self.setup.ends_x[1], self.setup.ends_y[1]))
        along, across = ((0.5, end) for end in ends)
        return tuple((s, t) for s in along for t in across)

    def places(self, board: Board) -> tuple[tuple[float, float], ...]:
        """The spots on the whole board, m."""
        return places_on(board, self.setup, self.spots)

    def system(self, board: Board) -> System:
        """The setup with the effects of a board, which were declared for its base."""
        if all(setup.name != self.setup.name for setup in board.setups):
            acting = (effect.in_setup(board, self.setup) for effect in board.effect_forms if effect.scope == "setup")
            new = {effect.name: effect for effect in acting if effect is not None}
            board = replace(
                board, setups=(*board.setups, self.setup), effect_forms=(*board.effect_forms, *new.values())
            )
        return System(self.setup, effects_of(board, self.setup))

    def values(self, system: System, values: Values) -> dict[str, Floats]:
        """Values completed by the parameters of a system's effects that the board does not have.

        An effect of a setup is taken to be as large in another one: the same sensor, the same clamp.
        """
        by_key = {
            (effect.name, parameter.key): values[parameter.name]
            for effect in map(self._effect_in_base, system.effects)
            for parameter in effect.parameters()
            if parameter.name in values
        }
        missing = {
            parameter.name: np.asarray(by_key.get((effect.name, parameter.key), parameter.prior.median))
            for effect in system.effects
            for parameter in effect.parameters()
            if parameter.name not in values
        }
        return {**values, **missing}

    def _effect_in_base(self, effect: Effect) -> Effect:
        """The effect with the names of its parameters in the base."""
        return replace(effect, owner=self.base.owner) if effect.owner == self.setup.owner else effect


def old_stations(board: Board, values: Values) -> Iterator[Station]:
    """Stations of the setups in which the board was held, each with its unread modes computed at these values (SI)."""
    for setup in board.setups:
        readings = tuple(
            replace(reading, frequency=Quantity.exact(reading.frequency.mean), sign="") for reading in setup.readings
        )
        empty = replace(setup, readings=(), peaks=(), published_coefficients=None)
        further = _next_modes(
            board, Station(empty, setup), values, N_FURTHER_MODES, {reading.label for reading in readings}
        )
        if readings or further:
            yield Station(replace(empty, readings=(*readings, *further)), setup, len(readings))


def new_stations(board: Board, values: Values, prior: PriorCard | None = None) -> Iterator[Station]:
    """Stations in which the board was never held, free and as a cantilever, with the modes at these values (SI).

    The noise of such a station is that of the prior, if it states one.
    """
    ways: tuple[tuple[str, EdgeConditions], ...] = (("free", ("free", "free")), ("cantilever", ("clamped", "free")))
    names, first = {setup.name for setup in board.setups}, board.setups[0]
    for name, ends_x in ways:
        is_free = "clamped" not in ends_x
        if any(setup.is_free if is_free else "clamped" in {*setup.ends_x, *setup.ends_y} for setup in board.setups):
            continue
        while name in names:
            name += "-2"
        noise = assumed_noise((*ends_x, "free", "free"), prior)
        empty = Setup(name, ends_x, ("free", "free"), (), noise, attached=first.attached, fluid=first.fluid)
        readings = _next_modes(board, Station(empty, first), values, N_NEW_MODES, set())
        if readings:
            yield Station(replace(empty, readings=readings), first)


def _next_modes(
    board: Board, station: Station, values: Values, n: int, taken: Collection[Label]
) -> tuple[Reading, ...]:
    """The lowest unread modes with a clear name, at the frequencies of the model.

    In a session that goes on the sensor stays where it is, and modes on whose nodal line it stands are left out.
    """
    system, first = station.system(board), station.setup.first_label
    station_values = station.values(system, values)
    modes, named = spectrum(system, station_values, N_SEARCHED_MODES)
    deflection_shares = np.ones(len(named))
    if not station.is_new and station.base.sensor is not None:
        deflection_shares = np.abs(deflections(station.base, modes, station_values, station.base.sensor, system.shaped))
    new_modes = (
        (mode.label, mode.frequency)
        for mode, share in zip(named, deflection_shares, strict=True)
        if share >= NODAL_LINE and mode.label is not None and mode.label not in taken
    )
    return tuple(
        Reading(label, (label.m - first.m, label.n - first.n), Quantity.exact(hertz))
        for label, hertz in [*new_modes][:n]
    )
