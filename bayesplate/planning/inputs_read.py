"""Readings of the board itself: thickness, width, length and mass once more, at more places, or on a finer scale."""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.random_field import conditioned, sd_after, thickness_readings, width_readings
from bayesplate.planning.beliefs import Beliefs
from bayesplate.planning.gains import Readings

Floats = NDArray[np.float64]

MORE = 5
"""Readings of a thing that has no places."""
GRID = ((0.125, 0.375, 0.625, 0.875), (0.2, 0.5, 0.8))
"""Where a field is read once more, as fractions of the sides; a width at the stations of the first."""
FINER = 10.0
"""How many times finer another instrument reads."""
_READABLE = ("length_x", "length_y", "thickness", "mass", "density")
WEIGHED_TO = 1e-5
"""Standard deviation of a small mass on a laboratory's scale, kg."""


@dataclass(frozen=True)
class Measured:
    """One way to know an input better.

    Attributes
    ----------
    parameter : Parameter
    sentence : str
        What to do.
    n : int
        Readings that it takes.
    sd : float
        Standard deviation of the input after it, in its unit.
    """

    parameter: Parameter
    sentence: str
    n: int
    sd: float

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
        yield Measured(parameter, "Weigh what is attached to the board", 1, WEIGHED_TO)
    if parameter.name not in _READABLE and not parameter.key.startswith("clamped_"):
        return
    words = _words(parameter)
    for sd, n, where in _placed(board, parameter):
        yield Measured(parameter, f"Read the {words} at {n} more places {where}", n, sd)
    if prior.has_profile:
        return
    if len(prior.readings) > 1:
        yield Measured(parameter, f"Read the {words} {MORE} more times", MORE, _sd_of_more(prior, prior.resolution))
    elif not prior.readings:
        sentence = f"Measure the {words} once more, as well as it is known now, by other means"
        yield Measured(parameter, sentence, 1, prior.sd / np.sqrt(2.0))
    if prior.resolution > 0.0:
        finer = prior.resolution / FINER
        sd = _fresh(prior, finer)
        told = f"Read the {words} {MORE} times with an instrument that reads {FINER:g} times finer"
        yield Measured(parameter, told, MORE, sd)


def _words(parameter: Parameter) -> str:
    return {"length_x": "length", "length_y": "width"}.get(parameter.name, parameter.words or parameter.name)


def _sd_of_more(prior: Quantity, resolution: float) -> float:
    """Standard error of as many readings more that scatter alike; the rounding is not averaged away."""
    variance = statistics.variance(prior.readings)
    return float(np.sqrt(variance / (len(prior.readings) + MORE) + resolution**2 / 12.0))


def _fresh(prior: Quantity, resolution: float) -> float:
    """The same of a finer instrument alone, joined with what is known now."""
    variance = statistics.variance(prior.readings) if len(prior.readings) > 1 else 0.0
    alone = variance / MORE + resolution**2 / 12.0
    return float((prior.sd**-2.0 + 1.0 / alone) ** -0.5)


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


def input_readings(beliefs: Beliefs, one: Measured) -> Readings:
    """A measurement of an input as one reading of its standard coordinate."""
    column = beliefs.board.symmetry.n + [p.name for p in beliefs.board.uncertain].index(one.parameter.name)
    shift, slopes, variance = [], [], []
    for explanation in beliefs.explanations:
        n_terms, n_u = explanation.mean.shape
        row = np.zeros((n_terms, 1, n_u))
        row[:, 0, column] = 1.0
        shift.append(np.zeros((n_terms, 1)))
        slopes.append(row)
        variance.append(np.full((n_terms, 1), 1.0 / one.precision))
    return Readings(tuple(shift), tuple(slopes), tuple(variance))
