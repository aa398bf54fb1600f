"""What a board's prior foretells of its frequencies, and whether all that were read are in another unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from bayesplate.cards import PriorCard
from bayesplate.errors import Fault
from bayesplate.estimates.least_squares import log_measured, starting_rigidities
from bayesplate.frequencies.prior_bands import prior_draws
from bayesplate.frequencies.terms import term_weights
from bayesplate.modes.naming import product_coefficients
from bayesplate.modes.thin import thin_plate
from bayesplate.plate.board import Board, density

Floats = NDArray[np.float64]

FASTEST = 15_000.0
"""Speed of sound in m/s that stiffness and density may imply: 5,000 in spruce and steel, 13,000 in carbon fibre."""

SLOWEST = 50.0
"""The same from below, in the stiffer direction: foams have some hundreds."""

SUSPECTS = {
    2.0 * np.pi: "in rad/s? in Hz they are that over 2 pi = 6.28",
    1e-3: "in kHz? 1 kHz is 1000 Hz",
    1e-2: "are length_x_mm and length_y_mm in cm? 1 cm is 10 mm",
    1e2: "are length_x_mm and length_y_mm ten times too large?",
    1e-1: "is thickness_mm ten times too large, or are all three lengths in cm?",
    1e1: "is thickness_mm ten times too small, or are all three lengths ten times too large?",
    1e-3**0.5: "are the constants of the prior in MPa? 1 GPa is 1000 MPa",
}
"""Ratio of measured to expected that one mistake of units gives all frequencies, and the question to ask."""

_SLACK = 0.1
"""Relative error of a Rayleigh quotient, of the noise, and of what an effect that is not modelled does, in all."""

_IMPROBABLE, _PROBABLE = 1e-4, 1e-2
_AS_NEAR = 6.0  # a factor 20 of the density
_N_DRAWS = 4000
_COARSE_MESH = 12
_WITHIN = (0.025, 0.975)


@dataclass(frozen=True, eq=False)
class PriorPredictive:
    """What the prior of a board foretells of its readings.

    Attributes
    ----------
    draws : (n_draws, n_readings) array, ln Hz
        Logarithms of the frequencies, setup after setup; readings of one draw share its constants.
    """

    draws: Floats

    @property
    def median(self) -> Floats:
        """Median of ln f of each reading: (n_readings,) array, ln Hz."""
        return np.median(self.draws, axis=0)

    @property
    def spread(self) -> Floats:
        """Standard deviation of ln f of each reading: (n_readings,) array."""
        return self.draws.std(axis=0)

    def distance(self, log_frequencies: Floats) -> float:
        """Squared distance of readings from the middle of the draws, in units of their joint spread.

        About chi-squared with a degree of freedom for each reading where the prior holds.
        """
        covariance = np.atleast_2d(np.cov(self.draws, rowvar=False)) + _SLACK**2 * np.eye(self.draws.shape[1])
        off = log_frequencies - self.draws.mean(axis=0)
        return float(off @ np.linalg.solve(covariance, off))


def prior_predictive(board: Board, prior: PriorCard, rng: np.random.Generator) -> PriorPredictive:
    """Frequencies of a board's labelled modes under its prior, from Rayleigh quotients of beam-function products.

    A few per cent off each frequency, of the bare thin plate; inputs that are uncertain are drawn too.

    Parameters
    ----------
    board : Board
    prior : PriorCard
    rng : numpy.random.Generator

    Returns
    -------
    PriorPredictive
    """
    values = prior_draws(board, prior, rng, _N_DRAWS)
    columns = []
    for setup in board.setups:
        products = product_coefficients(thin_plate(setup.ends_x, setup.ends_y, _COARSE_MESH, _COARSE_MESH))
        weights = term_weights(values, setup).stiffness
        columns += [weights @ products[:, i, j] for i, j in (reading.beams for reading in setup.readings)]
    squared = np.column_stack(columns)
    possible = np.all(np.isfinite(squared) & (squared > 0), axis=1)
    return PriorPredictive(0.5 * np.log(squared[possible]) - np.log(2.0 * np.pi))


def unit_faults(board: Board, prior: PriorCard, rng: np.random.Generator) -> list[Fault]:
    """Whether all readings are off by the one factor that a mistake of units makes, and the question to ask.

    Asked where the readings are out of the prior's reach, or would need a material that carries sound faster or slower
    than any does, and a suspect's factor mends it.

    Parameters
    ----------
    board : Board
    prior : PriorCard
    rng : numpy.random.Generator

    Returns
    -------
    list of Fault
        One or none.
    """
    if not all(setup.readings for setup in board.setups):  # refused later, or still to be measured
        return []
    predicted, measured, speed = prior_predictive(board, prior, rng), log_measured(board), plate_speed(board)
    distances = {f: predicted.distance(measured - np.log(f)) for f in SUSPECTS if SLOWEST < speed / f < FASTEST}
    if not distances or chdtrc(measured.size, min(distances.values())) < _PROBABLE:
        return []
    nearest = min(distances.values())
    questions = "; ".join(text for f, text in SUSPECTS.items() if distances.get(f, np.inf) < nearest + _AS_NEAR)
    place = f"{board.name}.toml frequencies_hz"
    if not SLOWEST < speed < FASTEST:
        wanted = f"frequencies of a material that carries sound at {SLOWEST:g} to {FASTEST:g} m/s"
        return [Fault(place, wanted, f"{speed:.3g} m/s", f"{questions}; or x and y are exchanged")]
    if chdtrc(measured.size, predicted.distance(measured)) > _IMPROBABLE:
        return []
    low, high = np.exp(np.quantile(predicted.draws[:, 0], _WITHIN))
    first = next(reading for setup in board.setups for reading in setup.readings)
    off = np.exp(np.median(measured - predicted.median))
    wanted = f"frequencies that the prior '{prior.name}' foretells, {first.label} at {low:.3g} to {high:.3g} Hz"
    got = f"{first.frequency.mean:.4g} Hz, and all of them about {off:.2g} times the expected"
    return [Fault(place, wanted, got, f"{questions}; or another prior, if no unit is wrong")]


def plate_speed(board: Board) -> float:
    """Speed of sound in the stiffer direction that the readings imply, sqrt(12 D / rho h^3), m/s; a rough one."""
    values = board.nominal()
    D_x, D_y, _ = starting_rigidities(board)
    return float(np.sqrt(12.0 * max(D_x, D_y) / (density(values) * values["thickness"] ** 3)))
