"""Readings without a frequency: of the board's thickness, width, length and mass, and of effects that can be inspected.

A sensor is weighed, a taper read with a calliper: an explanation with the effect expects the size that the frequencies
give, one without it expects none.
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
from bayesplate.board.random_field import condition_field, sd_after_readings, thickness_readings, width_readings
from bayesplate.planning.beliefs import Beliefs, KnownBoard
from bayesplate.planning.gains import PlannedReadings

N_MORE_READINGS = 5
"""Further readings of a size that is not read at places."""
GRID = ((0.125, 0.375, 0.625, 0.875), (0.2, 0.5, 0.8))
"""Places at which a field is read once more, as fractions of the sides along and across; a width along only."""
FINER_FACTOR = 10.0
"""Resolution of the present instrument over that of a finer one."""
_READABLE_SIZES = ("length_x", "length_y", "thickness", "mass", "density")
_SCALE_SD = 1e-5
"""Standard deviation of a small mass on a laboratory's scale, kg."""
_WEIGHING = "Weigh what is attached to the board"
_CALLIPER_SD = 2e-5
"""Standard deviation of a reading of the thickness at a place, m."""
_UNEVEN_SHARE = 0.005
"""Standard deviation of the thickness about a straight taper, over the thickness: planes and sanders leave as much."""
_PROTRACTOR_SD = 0.5 * np.pi / 180.0


@dataclass(frozen=True)
class SizeMeasurement:
    """A measurement of an input."""

    parameter: Parameter
    sentence: str  # the instruction
    n: int  # number of readings
    sd: float  # of the input after the measurement, in its unit

    @property
    def precision(self) -> float:
        """Precision that it adds to the standard coordinate, whose prior has precision one."""
        return max((self.parameter.prior.sd / self.sd) ** 2 - 1.0, 0.0)


def size_measurements(board: Board) -> tuple[SizeMeasurement, ...]:
    """All measurements that add precision to an uncertain input of a board."""
    measurements = [
        measurement for parameter in board.uncertain for measurement in _parameter_measurements(board, parameter)
    ]
    return tuple(measurement for measurement in measurements if measurement.precision > 0.0)


def _parameter_measurements(board: Board, parameter: Parameter) -> Iterator[SizeMeasurement]:
    prior = parameter.prior
    if parameter.effect == "attached_mass" and parameter.is_of_effect:
        yield SizeMeasurement(parameter, _WEIGHING, 1, _SCALE_SD)
    if parameter.name not in _READABLE_SIZES and not parameter.key.startswith("clamped_"):
        return
    words = {"length_x": "length", "length_y": "width"}.get(parameter.name, parameter.display_name or parameter.name)
    for sd, n, where in _field_measurements(board, parameter):
        yield SizeMeasurement(parameter, f"Read the {words} at {n} more places {where}", n, sd)
    if prior.has_profile:
        return
    scatter = statistics.variance(prior.readings) if len(prior.readings) > 1 else 0.0
    if len(prior.readings) > 1:  # further readings of the same scatter; the rounding is not averaged away
        sd = np.sqrt(scatter / (len(prior.readings) + N_MORE_READINGS) + prior.resolution**2 / 12.0)
        yield SizeMeasurement(parameter, f"Read the {words} {N_MORE_READINGS} more times", N_MORE_READINGS, float(sd))
    elif not prior.readings:
        sentence = f"Measure the {words} once more, as well as it is known now, by other means"
        yield SizeMeasurement(parameter, sentence, 1, prior.sd / np.sqrt(2.0))
    if prior.resolution > 0.0:
        finer_variance = scatter / N_MORE_READINGS + (prior.resolution / FINER_FACTOR) ** 2 / 12.0
        finer_sentence = (
            f"Read the {words} {N_MORE_READINGS} times with an instrument that reads {FINER_FACTOR:g} times finer"
        )
        yield SizeMeasurement(
            parameter, finer_sentence, N_MORE_READINGS, float((prior.sd**-2.0 + 1.0 / finer_variance) ** -0.5)
        )


def _field_measurements(board: Board, parameter: Parameter) -> Iterator[tuple[float, int, str]]:
    """Standard deviation of the mean of a field after more readings at a grid of places, their number, and the grid."""
    prior, length_x, length_y = parameter.prior, board.inputs["length_x"], board.inputs["length_y"]
    if parameter.name == "thickness":
        field = thickness_readings(prior, length_x, length_y)
        places, where = list(product(*GRID)), f"({len(GRID[0])} along the board, {len(GRID[1])} across)"
    elif parameter.name == "length_y":
        field, places, where = width_readings(prior, length_x), [(s, 0.5) for s in GRID[0]], "along the board"
    else:
        return
    if field is not None:
        x, y = np.array(places).T
        yield sd_after_readings(field, x, y) * prior.sd / max(condition_field(field).sd, 1e-300), len(places), where


def parameter_column(known_board: KnownBoard, parameter: Parameter) -> Floats:
    """Derivatives of the standard coordinate of a board's uncertain parameter by the columns of u: (n_u,) array."""
    board = known_board.board
    return np.asarray(known_board.columns[board.symmetry.n + [p.name for p in board.uncertain].index(parameter.name)])


def input_readings(beliefs: Beliefs, known_board: KnownBoard, measurement: SizeMeasurement) -> PlannedReadings:
    """A measurement of an input of a board as one reading of its standard coordinate."""
    column = parameter_column(known_board, measurement.parameter)
    by_explanation = []
    for n_terms, n_u in (explanation.mean.shape for explanation in beliefs.explanations):
        slopes = np.tile(np.pad(column, (0, n_u - column.size)), (n_terms, 1, 1))
        by_explanation.append((np.zeros((n_terms, 1)), slopes, np.full((n_terms, 1), 1.0 / measurement.precision)))
    return PlannedReadings.of(by_explanation)


@dataclass(frozen=True)
class EffectInspection:
    """An inspection of an effect without reading a frequency."""

    sentence: str
    n: int  # number of readings
    sd: Callable[[Board], float]  # from the board to the standard deviation of each of the effect's parameters, SI
    is_possible: Callable[[Board], bool]  # whether the effect can be inspected on a board


def _has_unweighed_item(board: Board) -> bool:
    return any(item.mass is None and item.kind != "exciter" for setup in board.setups for item in setup.attached)


def _taper_sd(board: Board) -> float:
    """Standard deviation of a taper from readings at the grid of places, by linear regression."""
    at_place = np.hypot(_CALLIPER_SD / board.inputs["thickness"].mean, _UNEVEN_SHARE)
    leverage = len(GRID[1]) * sum((s - 0.5) ** 2 for s in GRID[0])
    return float(at_place / np.sqrt(leverage))


INSPECTIONS: dict[str, EffectInspection] = {
    "attached_mass": EffectInspection(_WEIGHING, 1, lambda board: _SCALE_SD, _has_unweighed_item),
    "thickness_profile": EffectInspection(
        f"Read the thickness at {len(GRID[0]) * len(GRID[1])} places all over the board",
        len(GRID[0]) * len(GRID[1]),
        _taper_sd,
        lambda board: not board.inputs["thickness"].has_profile,
    ),
    "grain_angle": EffectInspection(
        "Measure the angle of the grain to the long side, to half a degree", 1, lambda board: _PROTRACTOR_SD,
        lambda board: True,
    ),
}  # fmt: skip
"""The inspection of each effect that can be inspected."""


def inspection_readings(beliefs: Beliefs, effect: str) -> PlannedReadings | None:
    """Readings by an inspection of an effect; None where no explanation has it, or where it cannot be inspected."""
    inspection, board = INSPECTIONS[effect], beliefs.boards[0].board
    forms = [form for explanation in beliefs.explanations for form in explanation.forms if effect in form.effects]
    if not forms or not inspection.is_possible(board):
        return None
    free = [parameter for parameter, name in zip(forms[0].parameters, forms[0].effects, strict=True) if name == effect]
    by_explanation = []
    for terms in beliefs.explanations:
        value = np.tile([0.0 if p.neutral_value is None else p.neutral_value for p in free], (terms.n_terms, 1))
        slopes = np.zeros((terms.n_terms, len(free), terms.mean.shape[1]))
        for form in terms.forms:
            columns = [int(c) for c, name in zip(form.columns, form.effects, strict=True) if name == effect]
            for j, (parameter, column) in enumerate(zip(free, columns, strict=False)):
                mean, sd = terms.mean[form.rows, column], np.sqrt(terms.covariance[form.rows, column, column])
                change = (parameter.prior.value(mean + sd) - parameter.prior.value(mean - sd)) / (2.0 * sd)
                slopes[form.rows, j, column] = change
                value[form.rows, j] = parameter.prior.value(mean) - change * mean
        by_explanation.append((value, slopes, np.full((terms.n_terms, len(free)), inspection.sd(board) ** 2)))
    return PlannedReadings.of(by_explanation)
