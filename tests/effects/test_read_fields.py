"""Constants of boards whose thickness was read at places and rounded: intervals hold the truth as often as stated."""

from __future__ import annotations

from dataclasses import dataclass, replace

import made_boards
import numpy as np
import pytest
from generator.known_boards import FREE
from generator.naming import frequencies
from made_boards import FREE_LABELS, NARROW
from scipy.stats import binom

import bayesplate.frequencies.system
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, moduli
from bayesplate.board.quantity import Quantity
from bayesplate.effects import declare, effects_of
from bayesplate.estimates.least_squares import log_measured, starting_rigidities
from bayesplate.estimates.refit import design, refit
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.reading_errors import reading_sd
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.parameters import Parameters

NOISE = 0.002
RESOLUTION = 1e-4
SCATTER = 2e-5
"""Of a thickness that is read, m."""
AT_X, AT_Y = np.tile(np.linspace(0.0, 1.0, 5), 2), np.repeat([0.0, 1.0], 5)
TAPERS, CURVATURES = (0.04, 0.03), (0.01, 0.01)
"""Standard deviations from end to end, and from the middle to the ends, along x and y."""
_POLYNOMIALS = (13, 11)
_N_SOLVES = 3
_STEP = 1e-4


@dataclass(frozen=True)
class Curved:
    """A thickness over its mean: a taper and a parabola along each side."""

    tapers: tuple[float, float]
    curvatures: tuple[float, float]

    def __call__(self, s, t):
        along = zip((s, t), self.tapers, self.curvatures, strict=True)
        return 1.0 + sum(a * (u - 0.5) + b * (4.0 * (u - 0.5) ** 2 - 1.0 / 3.0) for u, a, b in along)


def drawn_board(rng: np.random.Generator) -> Board:
    """A free board of the constants of `FREE`, read at ten places to a tenth of a millimetre."""
    field = Curved(tuple(rng.normal(0.0, TAPERS)), tuple(rng.normal(0.0, CURVATURES)))
    planted = replace(FREE, thickness=(lambda x, y: field(x / FREE.L_x, y / FREE.L_y),))
    hertz = frequencies(planted, (), FREE_LABELS, _POLYNOMIALS)[0]
    noisy = made_boards.with_noise(hertz, NOISE, rng)
    setup = made_boards.setup_of(FREE.edges, noisy, noise=Quantity.from_median(NOISE, NARROW))
    read = FREE.h * field(AT_X, AT_Y) + SCATTER * rng.standard_normal(AT_X.size)
    read = np.round(read / RESOLUTION) * RESOLUTION
    thickness = Quantity.from_readings(read, RESOLUTION, AT_X * FREE.L_x, AT_Y * FREE.L_y)
    mass = Quantity.exact(FREE.rho * FREE.h * FREE.L_x * FREE.L_y)
    board = made_boards.board_of(FREE, [setup], thickness=thickness, mass=mass)
    return declare(replace(board, effects=("thickness_profile",)))


def taken_for_exact(board: Board) -> Board:
    """The same board where what is expected of its thickness is taken for the truth."""
    (effect,) = effects_of(board, board.setups[0])
    known = replace(effect, profile=replace(effect.profile, components=(), with_mean=None))
    thickness = replace(board.inputs["thickness"], sd=0.0)
    return without_effects(board, chosen=(known,), thickness=thickness)


def without_effects(board: Board, thickness: Quantity | None = None, **changes) -> Board:
    parameters = tuple(one for one in board.parameters if not one.is_of_effect)
    bare = replace(board, parameters=parameters, **changes)
    return bare if thickness is None else bare.with_priors({"thickness": thickness})


def quick_errors(board: Board) -> np.ndarray:
    """Errors of ln E_x, ln E_y, ln G_xy over their standard deviations, by linear theory about the best fit: (3,)."""
    parameters = Parameters(board)
    columns = parameters.fitted_columns
    values = board.nominal() | dict(zip(("D_x", "D_y", "D_s"), starting_rigidities(board), strict=True))
    centre = parameters.theta(values, np.array([NOISE]))
    systems = [system_of(board, setup) for setup in board.setups]
    scales = reading_sd(board.setups, [NOISE])
    for _ in range(_N_SOLVES):
        values = {name: np.ravel(value)[0] for name, value in parameters.values(centre[None, :]).items()}
        predict = predictor(board, [setup_model(system, values) for system in systems], "linear", centre)
        centre[columns] = refit(predict, log_measured(board), scales, centre[columns])
    weighted = design(predict, scales, centre[columns])
    covariance = np.linalg.inv(weighted.T @ weighted)
    steps = np.zeros((2 * columns.size, parameters.n_dim)) + centre
    steps[np.arange(columns.size), columns] += _STEP
    steps[columns.size + np.arange(columns.size), columns] -= _STEP
    found = log_moduli(parameters, steps)
    slopes = (found[:, : columns.size] - found[:, columns.size :]) / (2.0 * _STEP)
    sd = np.sqrt(np.einsum("mi,ij,mj->m", slopes, covariance, slopes))
    truth = np.log([getattr(FREE, name) for name in MODULI])
    return (log_moduli(parameters, centre[None, :])[:, 0] - truth) / sd


def log_moduli(parameters: Parameters, theta: np.ndarray) -> np.ndarray:
    """(3, n_draws) array."""
    values = parameters.values(theta)
    found = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
    return np.log(np.broadcast_arrays(*found))


NINETY = 1.6449
"""Standard deviations on either side that hold 90 % of a normal distribution."""
MISSED = 0.005
"""Probability with which a rate that is right falls below its bound, or above."""


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Eight elements a side: these modes to a few hundredths of a per cent, which is little beside the noise."""
    monkeypatch.setattr(bayesplate.frequencies.system, "mesh", lambda *_: (8, 8))


def held(seeds, kind=lambda board: board):
    """How many of the boards' 90 % intervals hold the truth: (3,) array, E_x, E_y, G_xy."""
    errors = [quick_errors(kind(drawn_board(np.random.default_rng(seed)))) for seed in seeds]
    return np.sum(np.abs(errors) < NINETY, axis=0)


def test_intervals_hold_the_truth_at_the_stated_rate():
    n = 12
    counts = held(range(1000, 1000 + n))
    lowest, highest = binom.ppf([MISSED, 1.0 - MISSED], n, 0.9)
    assert np.all(counts >= lowest)
    assert np.all(counts <= highest)


def test_readings_that_are_taken_for_exact_do_not():
    """Control: the course that they make probable, taken for the truth."""
    n = 8
    assert np.all(held(range(1000, 1000 + n), taken_for_exact) < binom.ppf(MISSED, n, 0.9))
