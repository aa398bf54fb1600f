"""Residues: how strongly a mode responds between the places of the hammer and of the sensor, and with which sign.

The residue of a mode in the mobility between two places is the product of its mass-normalised deflections there. A mode
with a nodal line near either place responds hardly or not at all; where both places move in the same direction, the
residue is positive.
"""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values
from bayesplate.board.setup import Setup
from bayesplate.effects.attached_items import fractions_of
from bayesplate.effects.base import Effect
from bayesplate.plate.solve import Modes

NODAL_LINE = 0.05
"""Residue over the largest that a shape could give, below which a place counts as lying on a nodal line.

It is also the standard error of a computed residue: neighbouring modes of one class mix differently on the real board,
and places were measured with a ruler.
"""
_LEAST_PROBABILITY = 1e-3
"""Smaller probabilities of a sign are set to zero."""

_GRID = np.linspace(0.0, 1.0, 21)


def residues_of(setup: Setup, modes: Modes, values: Values, shaped: Effect | None = None) -> Floats | None:
    """Residue of each mode over the square of its largest deflection, -1 to 1: (n_modes,) array.

    None where the card does not state the hammer's place and that of one accelerometer. `shaped` is the effect that
    gives the plate its outline, where that is not the whole rectangle.
    """
    if setup.hammer is None or setup.sensor is None:
        return None
    hammer, sensor = (deflections(setup, modes, values, place, shaped) for place in (setup.hammer, setup.sensor))
    return hammer * sensor


def deflections(
    setup: Setup, modes: Modes, values: Values, place: tuple[float, float], shaped: Effect | None = None
) -> Floats:
    """Deflection of each mode at a place (m from the board's corner) over its largest: (n_modes,) array, -1 to 1."""
    x, y = fractions_of(setup, place, values)
    if shaped is not None:
        x, y = shaped.to_plate(x, y)
    deflection = modes.displacement(np.array([x]), np.array([y]))[:, 0, 0]
    return np.asarray(deflection / _largest_deflections(modes, shaped))


def _largest_deflections(modes: Modes, shaped: Effect | None) -> Floats:
    """The largest deflection of each mode on the plate: (n_modes,) array."""
    outline = None if shaped is None else shaped.outline()
    if outline is None:
        return np.asarray(np.max(np.abs(modes.displacement(_GRID, _GRID)), axis=(1, 2)))
    low, high = (limit[:, None] for limit in outline(_GRID))
    places = low + (high - low) * _GRID
    return np.asarray(np.max(np.abs(modes.displacement_across(_GRID, places)), axis=(1, 2)))


def detection_share(residues: Floats) -> Floats:
    """Factor on the probability that a mode leaves a peak, by its residue: (n_modes,) array, 0 to 1.

    It is r^2 / (r^2 + s^2) with s = `NODAL_LINE`, averaged over residues r that scatter about the computed one by s,

        1 - sqrt(pi / 2) Re w((r + i s) / (s sqrt 2)),

    w being the Faddeeva function: a third remains where the computed residue is zero.
    """
    from scipy.special import wofz

    argument = (residues / NODAL_LINE + 1j) / np.sqrt(2.0)
    return np.asarray(1.0 - np.sqrt(np.pi / 2.0) * wofz(argument).real)


def sign_probabilities(residues: Floats) -> Floats:
    """Probability that the residue of each mode is positive, and that it is negative: (2, n_modes) array.

    `NODAL_LINE` is the standard error of the computed residue; one half each where no residue is known.
    """
    from scipy.special import ndtr

    positive = ndtr(np.nan_to_num(residues) / NODAL_LINE)
    positive = np.where(
        positive < _LEAST_PROBABILITY, 0.0, np.where(positive > 1.0 - _LEAST_PROBABILITY, 1.0, positive)
    )
    return np.stack([positive, 1.0 - positive])
