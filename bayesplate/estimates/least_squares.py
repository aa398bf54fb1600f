"""Relative weighted least squares: the constants that bring all frequencies closest in relative terms.

Gauss-Newton on the logarithms of D_x, D_y, D_s with the law made anew at each step, so that the result is the
least-squares estimate of the exact frequencies; the sensitivities come with each solve for nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.material import RIGIDITIES
from bayesplate.board.setup import Setup
from bayesplate.frequencies.model import SetupModel, setup_model
from bayesplate.frequencies.reading_errors import reading_sd
from bayesplate.frequencies.system import system_of
from bayesplate.frequencies.terms import rigidity_columns
from bayesplate.plate.beams import product_coefficients

MOST_STEPS = 40
_LONGEST_STEP = 0.7
_CONVERGED = 1e-7
"""Of ln D: a frequency is then off by less than a ten-thousandth of a cent."""
_SMALL = 1e-5
"""A hundredth of a cent; steps below it that no longer shrink are rounding errors of the eigen-solves."""
_BACK = 0.05
"""Of the longest step in between: steps that come back as near to where they were before go round for ever."""
_PULL = 1e-3


@dataclass(frozen=True, eq=False)
class Estimate:
    """A point estimate of the rigidities, and how well the readings determine it."""

    rigidities: Floats  # (3,), N m
    values: Mapping[str, Floats]  # the rigidities and the nominal inputs
    models: tuple[SetupModel, ...]  # one a setup, solved at the estimate, settled or not
    # (n_modes, 3) d ln f / d ln D, setup after setup; see `Symmetry.along` for an isotropic board
    sensitivities: Floats
    residuals: Floats  # (n_modes,): ln measured - ln predicted
    scales: Floats  # (n_modes,): of `reading_scales`
    converged: bool


def reading_scales(board: Board) -> Floats:
    """Relative uncertainty of each reading at the median noise of its setup, rounding included: (n_modes,) array."""
    return reading_sd(board.setups, [setup.noise.median for setup in board.setups])


def log_measured(board: Board) -> Floats:
    """ln of the measured frequencies (Hz), setup after setup: (n_modes,) array."""
    return np.log(np.concatenate([setup.measured for setup in board.setups]))


def weighted_least_squares(
    board: Board, most_steps: int = MOST_STEPS, start: Floats | None = None, accepted: float = _CONVERGED
) -> Estimate:
    """Rigidities that minimise the weighted squares of relative frequency errors over all setups.

    Steps begin at `start` (N m), by default rough rigidities from the readings, and end where ln D is off by less than
    `accepted`. Where they go round, as at a veering whose names swap back and forth, the best of the round is the
    estimate. A direction that the readings do not determine keeps its starting value.
    """
    inputs, symmetry = board.nominal(), board.symmetry
    nu_xy = inputs["poisson_xy"]
    systems = [system_of(board, setup) for setup in board.setups]
    begin = starting_rigidities(board) if start is None else start
    log_next = np.log(symmetry.free_of(dict(zip(RIGIDITIES, begin, strict=True))))
    target, scales = log_measured(board), reading_scales(board)
    settled, previous = False, np.inf
    tried: list[Estimate] = []
    before: tuple[Floats, Floats] | None = None
    for _ in range(most_steps):
        values = inputs | symmetry.rigidities(np.exp(log_next), nu_xy)
        rigidities = np.array([float(values[name]) for name in RIGIDITIES])
        models = tuple(setup_model(system, values) for system in systems)
        predicted = np.concatenate([m.log_frequencies(values, "linear")[0] for m in models])
        sensitivities = np.concatenate([m.sensitivities(values) for m in models])
        residuals = target - predicted
        tried.append(Estimate(rigidities, values, models, sensitivities, residuals, scales, settled))
        if settled:
            break
        if of_round := _round(tried):
            return min(of_round, key=lambda one: float(np.sum((one.residuals / scales) ** 2)))
        slopes = symmetry.along(sensitivities)
        wanted = np.linalg.lstsq(slopes / scales[:, None], residuals / scales, rcond=1e-8)[0]
        step = wanted / (_overshoot(before, wanted) if before and _are_at_same_places(tried[-2:]) else 1.0)
        step *= min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-300))
        while np.abs(step).max() > _CONVERGED:
            if _is_material(symmetry.rigidities(np.exp(log_next + step), nu_xy), inputs):
                break
            step *= 0.5
        log_next = log_next + step
        before = wanted, step
        size = float(np.abs(step).max())
        settled, previous = has_settled(size, previous, accepted), size
    return tried[-1]


def _round(tried: Sequence[Estimate]) -> Sequence[Estimate]:
    """The last estimates, if the steps between them have come back to where they began; otherwise none."""
    log_rigidities = np.log([one.rigidities for one in tried])
    steps = np.abs(np.diff(log_rigidities, axis=0)).max(axis=1)
    for first in range(len(tried) - 2):
        if np.abs(log_rigidities[-1] - log_rigidities[first]).max() < _BACK * steps[first:].max():
            return tried[first + 1 :]
    return ()


def _overshoot(before: tuple[Floats, Floats], wanted: Floats) -> float:
    """Factor, at least 1, by which a step is too long, from what the last one left of what was wanted.

    Near a veering the slopes turn within a step; where the residuals are large there, steps go to and fro and hardly
    shrink. The secant through the last two of them tells by how much they overshoot.
    """
    wanted_before, taken = before
    return max(1.0, float((wanted_before - wanted) @ taken / (taken @ taken)))


def _are_at_same_places(two: Sequence[Estimate]) -> bool:
    """Whether all labels are at the same places among the modes of both estimates: no names were exchanged."""
    first, second = ([(p.parity, p.rank) for model in one.models for p in model.places] for one in two)
    return first == second


def _is_material(rigidities: Values, inputs: Values) -> bool:
    """Whether nu_xy nu_yx is below 1: beyond it a plate has no frequencies."""
    return bool(inputs["poisson_xy"] ** 2 * rigidities["D_y"] / rigidities["D_x"] < 1.0)


def has_settled(step: float, previous: float, accepted: float = _CONVERGED) -> bool:
    """Whether steps of ln D end here: what they leave is too small to count, or they are small and shrink no more.

    They shrink evenly, so that after one of them there remains about as much of it as there was of the one before.
    Stiff shear strains and fields of thickness cost the eigen-solves half their digits, so that steps stay at 1e-6.
    """
    remaining = step * min(1.0, step / previous) if np.isfinite(previous) else step
    return remaining < accepted or previous <= step < _SMALL


def starting_rigidities(board: Board) -> Floats:
    """Rough rigidities from Rayleigh quotients of beam-function products, which need no constants: (3,) array, N m.

    A weak pull towards a plate that bends alike both ways keeps within reach what the modes do not tell.
    """
    from scipy.optimize import nnls

    inputs = board.nominal()
    columns = board.symmetry.columns(inputs["poisson_xy"])
    rows = np.concatenate([_rayleigh_rows(setup, inputs) for setup in board.setups]) @ columns
    squared = np.exp(2.0 * (log_measured(board) + np.log(2.0 * np.pi)))
    alike = 1.0 / np.mean(rows.sum(axis=1) / squared)
    weighted = np.concatenate([alike * rows / squared[:, None], _PULL * np.eye(board.symmetry.n)])
    wanted = np.concatenate([np.ones(squared.size), np.full(board.symmetry.n, _PULL)])
    constants, _ = nnls(weighted, wanted)
    return np.asarray(columns @ (alike * np.maximum(constants, 1e-2 * constants.max())))


def _rayleigh_rows(setup: Setup, inputs: Values) -> Floats:
    products = product_coefficients(setup.ends_x, setup.ends_y)
    columns = rigidity_columns(inputs, setup)
    return np.stack([products[:, i, j] for i, j in (reading.beams for reading in setup.readings)]) @ columns
