"""Residues: how strongly a mode shows between the place of the hammer and that of the sensor, and with which sign.

The residue of a mode in the mobility between two places is the product of its mass-normalised deflections there. A mode
with a nodal line near either place shows hardly or not at all; where both move the same way the residue is positive.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.solve import Modes
from bayesplate.plate.board import Values, vibrating_lengths
from bayesplate.plate.setup import Setup

NODAL_LINE = 0.05
"""Residue over the largest that a shape could give, below which a place counts as lying on a nodal line."""

_GRID = np.linspace(0.0, 1.0, 21)


def residues_of(setup: Setup, modes: Modes, values: Values) -> NDArray[np.float64] | None:
    """Residue of each mode over the square of its largest deflection: (n_modes,) array, -1 to 1.

    Parameters
    ----------
    setup : Setup
    modes : Modes
    values : dict of float
        The board's sizes.

    Returns
    -------
    array or None
        None where the card does not state the hammer's place and that of one accelerometer.
    """
    sensors = [item for item in setup.attached if item.kind == "accelerometer" and len(item.places) == 1]
    if setup.hammer is None or len(sensors) != 1:
        return None
    hammer, sensor = (_fraction(setup, place, values) for place in (setup.hammer, sensors[0].places[0]))
    at = [modes.displacement(np.array([x]), np.array([y]))[:, 0, 0] for x, y in (hammer, sensor)]
    return np.asarray(at[0] * at[1] / np.max(np.abs(modes.displacement(_GRID, _GRID)), axis=(1, 2)) ** 2)


def _fraction(setup: Setup, place: tuple[float, float], values: Values) -> tuple[float, float]:
    """A place on the board (m from its corner) as fractions of the vibrating sides."""
    fractions = []
    for axis, position, side in zip("xy", place, vibrating_lengths(values, setup), strict=True):
        covered = values[setup.input_name(f"{axis}0")] if f"{axis}0" in setup.clamped else 0.0
        fractions.append(float(np.clip((position - covered) / side, 0.0, 1.0)))
    return fractions[0], fractions[1]
