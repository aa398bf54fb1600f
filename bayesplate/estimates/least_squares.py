"""Relative weighted least squares: the constants that bring all frequencies closest in relative terms.

Gauss-Newton on the logarithms of D_x, D_y, D_s with the law made anew at each step, so that the result is the
least-squares estimate of the exact frequencies; the sensitivities come with each solve at no cost.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

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
_CONVERGED_STEP = 1e-7
"""Step of ln D at which the estimate has converged: a frequency is then off by less than 1e-4 cents."""
_SMALL_STEP = 1e-5
"""Step of ln D, a hundredth of a cent: smaller steps that no longer shrink are rounding errors of the eigen-solves."""
_CYCLE_SHARE = 0.05
"""Share of the longest step in between: steps that return this near to an earlier estimate go round for ever."""
_PULL_WEIGHT = 1e-3


@dataclass(frozen=True, eq=False)
class Estimate:
    """A point estimate of the rigidities, and how well the readings determine it."""

    rigidities: Floats  # (3,), N m
    values: Mapping[str, Floats]  # the rigidities and the nominal inputs
    models: tuple[SetupModel, ...]  # one per setup, solved at the estimate, converged or not
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


def with_read_setups(board: Board) -> Board:
    """The board with only its setups that have readings."""
    return replace(board, setups=tuple(setup for setup in board.setups if setup.readings))


def without_reading(board: Board, left_out: int) -> Board:
    """The board without one reading, counted as in `log_measured`."""
    first, setups = 0, []
    for setup in board.setups:
        readings = tuple(reading for i, reading in enumerate(setup.readings, start=first) if i != left_out)
        setups.append(replace(setup, readings=readings))
        first += len(setup.readings)
    return with_read_setups(replace(board, setups=tuple(setups)))


def weighted_least_squares(
    board: Board, most_steps: int = MOST_STEPS, start: Floats | None = None, accepted: float = _CONVERGED_STEP
) -> Estimate:
    """Rigidities that minimise the weighted squares of relative frequency errors over all setups.

    Steps begin at `start` (N m), by default rough rigidities from the readings, and end where ln D is off by less than
    `accepted`. Where they cycle, as at a veering whose names swap back and forth, the best estimate of the cycle is
    returned. A direction that the readings do not determine keeps its starting value.
    """
    inputs, symmetry = board.nominal(), board.symmetry
    nu_xy = inputs["poisson_xy"]
    systems = [system_of(board, setup) for setup in board.setups]
    start_rigidities = starting_rigidities(board) if start is None else start
    log_next = np.log(symmetry.free_of(dict(zip(RIGIDITIES, start_rigidities, strict=True))))
    target, scales = log_measured(board), reading_scales(board)
    is_settled, previous_size = False, np.inf
    estimates: list[Estimate] = []
    last_step: tuple[Floats, Floats] | None = None
    for _ in range(most_steps):
        values = inputs | symmetry.rigidities(np.exp(log_next), nu_xy)
        rigidities = np.array([float(values[name]) for name in RIGIDITIES])
        models = tuple(setup_model(system, values) for system in systems)
        predicted = np.concatenate([m.log_frequencies(values, "linear")[0] for m in models])
        sensitivities = np.concatenate([m.sensitivities(values) for m in models])
        residuals = target - predicted
        estimates.append(Estimate(rigidities, values, models, sensitivities, residuals, scales, is_settled))
        if is_settled:
            break
        if cycle := _find_cycle(estimates):
            return min(cycle, key=lambda estimate: float(np.sum((estimate.residuals / scales) ** 2)))
        slopes = symmetry.along(sensitivities)
        full_step = np.linalg.lstsq(slopes / scales[:, None], residuals / scales, rcond=1e-8)[0]
        step = full_step / (
            _overshoot(last_step, full_step) if last_step and _have_same_places(estimates[-2:]) else 1.0
        )
        step *= min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-300))
        while np.abs(step).max() > _CONVERGED_STEP:
            if _is_material(symmetry.rigidities(np.exp(log_next + step), nu_xy), inputs):
                break
            step *= 0.5
        log_next = log_next + step
        last_step = full_step, step
        size = float(np.abs(step).max())
        is_settled, previous_size = has_settled(size, previous_size, accepted), size
    return estimates[-1]


def _find_cycle(estimates: Sequence[Estimate]) -> Sequence[Estimate]:
    """The last estimates, if the steps between them have returned to where they began; otherwise none."""
    log_rigidities = np.log([estimate.rigidities for estimate in estimates])
    steps = np.abs(np.diff(log_rigidities, axis=0)).max(axis=1)
    for first in range(len(estimates) - 2):
        if np.abs(log_rigidities[-1] - log_rigidities[first]).max() < _CYCLE_SHARE * steps[first:].max():
            return estimates[first + 1 :]
    return ()


def _overshoot(last_step: tuple[Floats, Floats], full_step: Floats) -> float:
    """Factor, at least 1, by which a full step is too long: from the last full step and the step taken in its place.

    Near a veering the slopes turn within a step; where the residuals are large there, steps go to and fro and hardly
    shrink. The secant through the last two steps gives the factor by which they overshoot.
    """
    last_full_step, step = last_step
    return max(1.0, float((last_full_step - full_step) @ step / (step @ step)))


def _have_same_places(estimates: Sequence[Estimate]) -> bool:
    """Whether all labels are at the same places among the modes of both estimates: no names were exchanged."""
    first, second = ([(p.parity, p.rank) for model in estimate.models for p in model.places] for estimate in estimates)
    return first == second


def _is_material(rigidities: Values, inputs: Values) -> bool:
    """Whether nu_xy nu_yx is below 1: beyond it a plate has no frequencies."""
    return bool(inputs["poisson_xy"] ** 2 * rigidities["D_y"] / rigidities["D_x"] < 1.0)


def has_settled(step: float, previous: float, accepted: float = _CONVERGED_STEP) -> bool:
    """Whether steps of ln D end here: the remaining distance is too small, or steps are small and shrink no more.

    Steps shrink by a constant ratio, so that about step^2 / previous remains after a step. Stiff shear strains and
    fields of thickness cost the eigen-solves half their digits, so that steps stay at 1e-6.
    """
    remaining = step * min(1.0, step / previous) if np.isfinite(previous) else step
    return remaining < accepted or previous <= step < _SMALL_STEP


def starting_rigidities(board: Board) -> Floats:
    """Rough rigidities from Rayleigh quotients of beam-function products, which need no constants: (3,) array, N m.

    A weak pull towards a plate that bends alike both ways keeps constants finite that the modes do not determine.
    """
    from scipy.optimize import nnls

    inputs = board.nominal()
    columns = board.symmetry.columns(inputs["poisson_xy"])
    rows = np.concatenate([_rayleigh_rows(setup, inputs) for setup in board.setups]) @ columns
    squared = np.exp(2.0 * (log_measured(board) + np.log(2.0 * np.pi)))
    rigidity = 1.0 / np.mean(rows.sum(axis=1) / squared)
    matrix = np.concatenate([rigidity * rows / squared[:, None], _PULL_WEIGHT * np.eye(board.symmetry.n)])
    observations = np.concatenate([np.ones(squared.size), np.full(board.symmetry.n, _PULL_WEIGHT)])
    constants, _ = nnls(matrix, observations)
    return np.asarray(columns @ (rigidity * np.maximum(constants, 1e-2 * constants.max())))


def _rayleigh_rows(setup: Setup, inputs: Values) -> Floats:
    products = product_coefficients(setup.ends_x, setup.ends_y)
    columns = rigidity_columns(inputs, setup)
    return np.stack([products[:, i, j] for i, j in (reading.beams for reading in setup.readings)]) @ columns
