"""Readings without a frequency: of the board's thickness, width, length and mass, and of effects that can be seen.

A sensor is weighed, a taper read with a calliper: an explanation with the effect expects the size that the readings
say, one without it expects none.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.parameter import Parameter
from bayesplate.board.random_field import conditioned, sd_after, thickness_readings, width_readings
from bayesplate.planning.beliefs import Beliefs, KnownBoard
from bayesplate.planning.gains import Readings

MORE = 5
"""Readings of a thing that has no places."""
GRID = ((0.125, 0.375, 0.625, 0.875), (0.2, 0.5, 0.8))
"""Where a field is read once more, as fractions of the sides; a width at the stations of the first."""
FINER = 10.0
"""How many times finer another instrument reads."""
_READABLE = ("length_x", "length_y", "thickness", "mass", "density")
_WEIGHED_TO = 1e-5
"""Standard deviation of a small mass on a laboratory's scale, kg."""
_WEIGHING = "Weigh what is attached to the board"
_CALLIPER = 2e-5
"""Of a reading of the thickness at a place, m."""
_UNEVEN = 0.005
"""Of the thickness at a place about a straight taper, over the thickness: planes and sanders leave as much."""
_PROTRACTOR = 0.5 * np.pi / 180.0


@dataclass(frozen=True)
class Measured:
    """One way to know an input better."""

    parameter: Parameter
    sentence: str  # what to do
    n: int  # readings that it takes
    sd: float  # of the input after it, in its unit

    @property
    def precision(self) -> float:
        """What it adds to the precision of the standard coordinate, whose prior has one."""
        return max((self.parameter.prior.sd / self.sd) ** 2 - 1.0, 0.0)


def measurements(board: Board) -> tuple[Measured, ...]:
    """Every way to know an uncertain input of a board better, none of which is without effect."""
    every = [one for parameter in board.uncertain for one in _of(board, parameter)]
    return tuple(one for one in every if one.precision > 0.0)


def _of(board: Board, parameter: Parameter) -> Iterator[Measured]:
    prior = parameter.prior
    if parameter.effect == "attached_mass" and parameter.is_of_effect:
        yield Measured(parameter, _WEIGHING, 1, _WEIGHED_TO)
    if parameter.name not in _READABLE and not parameter.key.startswith("clamped_"):
        return
    words = {"length_x": "length", "length_y": "width"}.get(parameter.name, parameter.words or parameter.name)
    for sd, n, where in _placed(board, parameter):
        yield Measured(parameter, f"Read the {words} at {n} more places {where}", n, sd)
    if prior.has_profile:
        return
    scatter = statistics.variance(prior.readings) if len(prior.readings) > 1 else 0.0
    if len(prior.readings) > 1:  # as many more that scatter alike; the rounding is not averaged away
        sd = np.sqrt(scatter / (len(prior.readings) + MORE) + prior.resolution**2 / 12.0)
        yield Measured(parameter, f"Read the {words} {MORE} more times", MORE, float(sd))
    elif not prior.readings:
        sentence = f"Measure the {words} once more, as well as it is known now, by other means"
        yield Measured(parameter, sentence, 1, prior.sd / np.sqrt(2.0))
    if prior.resolution > 0.0:
        alone = scatter / MORE + (prior.resolution / FINER) ** 2 / 12.0
        told = f"Read the {words} {MORE} times with an instrument that reads {FINER:g} times finer"
        yield Measured(parameter, told, MORE, float((prior.sd**-2.0 + 1.0 / alone) ** -0.5))


def _placed(board: Board, parameter: Parameter) -> Iterator[tuple[float, int, str]]:
    """Standard deviation of the mean of a field after readings at a grid of places more, and how many they are."""
    prior, length_x, length_y = parameter.prior, board.inputs["length_x"], board.inputs["length_y"]
    if parameter.name == "thickness":
        read = thickness_readings(prior, length_x, length_y)
        places, where = list(product(*GRID)), f"({len(GRID[0])} along the board, {len(GRID[1])} across)"
    elif parameter.name == "length_y":
        read, places, where = width_readings(prior, length_x), [(s, 0.5) for s in GRID[0]], "along the board"
    else:
        return
    if read is not None:
        x, y = np.array(places).T
        yield sd_after(read, x, y) * prior.sd / max(conditioned(read).sd, 1e-300), len(places), where


def column_of(known: KnownBoard, parameter: Parameter) -> Floats:
    """What the columns of u do to the standard coordinate of an uncertain parameter of a board: (n_u,) array."""
    board = known.board
    return np.asarray(known.columns[board.symmetry.n + [one.name for one in board.uncertain].index(parameter.name)])


def input_readings(beliefs: Beliefs, known: KnownBoard, one: Measured) -> Readings:
    """A measurement of an input of a board as one reading of its standard coordinate."""
    along = column_of(known, one.parameter)
    every = []
    for n_terms, n_u in (each.mean.shape for each in beliefs.explanations):
        slopes = np.tile(np.pad(along, (0, n_u - along.size)), (n_terms, 1, 1))
        every.append((np.zeros((n_terms, 1)), slopes, np.full((n_terms, 1), 1.0 / one.precision)))
    return Readings.of(every)


@dataclass(frozen=True)
class Look:
    """How an effect is looked at."""

    sentence: str
    n: int  # readings that it takes
    sd: Callable[[Board], float]  # from the board to the standard deviation of each of the effect's parameters, SI
    can: Callable[[Board], bool]  # whether there is anything to look at on a board


def _has_unweighed(board: Board) -> bool:
    return any(item.mass is None and item.kind != "exciter" for setup in board.setups for item in setup.attached)


def _of_taper(board: Board) -> float:
    """Standard deviation of a taper from readings at the grid of places, by a regression on the place."""
    at_place = np.hypot(_CALLIPER / board.inputs["thickness"].mean, _UNEVEN)
    leverage = len(GRID[1]) * sum((s - 0.5) ** 2 for s in GRID[0])
    return float(at_place / np.sqrt(leverage))


LOOKS: dict[str, Look] = {
    "attached_mass": Look(_WEIGHING, 1, lambda board: _WEIGHED_TO, _has_unweighed),
    "thickness_profile": Look(
        f"Read the thickness at {len(GRID[0]) * len(GRID[1])} places all over the board",
        len(GRID[0]) * len(GRID[1]),
        _of_taper,
        lambda board: not board.inputs["thickness"].has_profile,
    ),
    "grain_angle": Look(
        "Measure the angle of the grain to the long side, to half a degree", 1, lambda board: _PROTRACTOR,
        lambda board: True,
    ),
}  # fmt: skip
"""By effect."""


def look_readings(beliefs: Beliefs, effect: str) -> Readings | None:
    """What looking at an effect would read; None where no explanation has it, or nothing is there to be looked at."""
    look, board = LOOKS[effect], beliefs.boards[0].board
    having = [form for one in beliefs.explanations for form in one.forms if effect in form.effects]
    if not having or not look.can(board):
        return None
    free = [one for one, name in zip(having[0].parameters, having[0].effects, strict=True) if name == effect]
    every = []
    for one in beliefs.explanations:
        value = np.tile([0.0 if p.null is None else p.null for p in free], (one.n_terms, 1))
        along = np.zeros((one.n_terms, len(free), one.mean.shape[1]))
        for form in one.forms:
            columns = [int(c) for c, name in zip(form.columns, form.effects, strict=True) if name == effect]
            for j, (parameter, column) in enumerate(zip(free, columns, strict=False)):
                at, sd = one.mean[form.rows, column], np.sqrt(one.covariance[form.rows, column, column])
                change = (parameter.prior.value(at + sd) - parameter.prior.value(at - sd)) / (2.0 * sd)
                along[form.rows, j, column] = change
                value[form.rows, j] = parameter.prior.value(at) - change * at
        every.append((value, along, np.full((one.n_terms, len(free)), look.sd(board) ** 2)))
    return Readings.of(every)
