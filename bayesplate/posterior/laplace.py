"""Location of the posterior before sampling: its mode, a normal approximation, and the exact law for that region."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple, get_args

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.material import RIGIDITIES
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.least_squares import Estimate, log_measured
from bayesplate.estimates.refit import design_matrix, most_likely, normal_misfit
from bayesplate.frequencies.laws import LawName, cents
from bayesplate.frequencies.model import SetupModel, setup_model, with_exact_law, with_other_modes
from bayesplate.frequencies.peaks import needs_assignment
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.reading_errors import reading_sd
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.robust import most_likely_student, student_weights

_BOX_SDS = 3.0
_NARROWEST, _WIDEST = 0.1, 0.6
_N_HELD_OUT = 8
_BOUND_MARGIN = 0.1
_SHARE_OF_NOISE = 0.2
_ROUGH_CENTS = 1.0
"""Accepted error, cents, of the rough law that locates the posterior: small beside the scatter of any reading."""
_MOST_PLACES = 3
_SAME_PLACE = 0.1
"""Difference, in standard errors, of the optima under old and new models at which the models need no further update."""
_MOST_LEVELS = 20
_SAME_LEVEL = 1e-3
"""Change of the logarithm of the noise below which the fit of the inputs is not repeated."""


class LaplaceApproximation(NamedTuple):
    """A normal approximation of the posterior, and models computed at its centre."""

    centre: Floats  # (n_dim,), weighted least squares under the exact law, uncertain inputs fitted within their priors
    covariance: Floats  # (n_dim, n_dim)
    models: tuple[SetupModel, ...]  # with the linear law at the centre and the exact law around it


def laplace_approximation(
    board: Board, estimate: Estimate, robust: bool = False, spread: Floats | None = None
) -> LaplaceApproximation:
    """Locate the posterior of a board.

    The rigidities have the covariance of the weighted fit, widened where the residuals exceed the expected noise as far
    as the noise's prior allows; the noise has the covariance of its prior. Where inputs are uncertain the fit may move
    them, which changes the noise; the models are then computed again at the optimum until they give the same optimum,
    since a rough law, or modes that exchange their names at a veering, may have misled the first fit. Under Student's
    errors an outlying reading has little weight. `spread` is a further covariance of ln D: between several labellings
    of the peaks.
    """
    parameters = Parameters(board)
    medians = np.array([setup.noise.median for setup in board.setups])
    noise, values, start_models = (
        medians * noise_widenings(board, estimate.residuals),
        dict(estimate.values),
        estimate.models,
    )
    if robust:
        rigidities, noise = most_likely_student(board, estimate)
        values |= dict(zip(RIGIDITIES, rigidities, strict=True))
        start_models = tuple(setup_model(model.system, values, model.plate) for model in start_models)
    centre, models, scales = (
        parameters.theta(values, noise),
        with_peak_modes(start_models, values),
        reading_sd(board.setups, noise),
    )
    if robust:
        residuals = log_measured(board) - np.concatenate([m.log_frequencies(values, "linear")[0] for m in models])
        scales = scales / np.sqrt(student_weights(residuals / scales))
    covariance = _covariance(board, models, scales, centre, spread)
    if not parameters.inputs:
        return LaplaceApproximation(centre, covariance, exact_models(board, models, centre, covariance))
    models = exact_models(board, models, centre, covariance, is_rough=True, accepted_cents=_ROUGH_CENTS)
    optimum, scales = _refit(board, models, centre, noise, scales, is_once=robust)
    for k in range(_MOST_PLACES):
        centre, values = optimum, parameters.values_at(optimum)
        # Modes are named only once, at the optimum of the rough law: names would alternate across a veering.
        start_models = tuple(setup_model(model.system, values, model.plate, model if k else None) for model in models)
        models = with_peak_modes(start_models, values)
        covariance = _covariance(board, models, scales, centre, spread)
        models = exact_models(board, models, centre, covariance)
        noise = np.exp(parameters.log_noise(centre[None])[0])
        optimum, scales = _refit(board, models, centre, noise, scales, is_once=robust)
        if np.all(np.abs(optimum - centre) <= _SAME_PLACE * np.sqrt(np.diagonal(covariance))):
            break
    return LaplaceApproximation(centre, covariance, models)


def _refit(
    board: Board, models: Sequence[SetupModel], centre: Floats, noise: Floats, scales: Floats, *, is_once: bool
) -> tuple[Floats, Floats]:
    """Fit rigidities and inputs under the exact law, and the noises to the residuals: theta and scales.

    `is_once` where the scales are those of Student's errors, whose noise is known already.
    """
    parameters, target = Parameters(board), log_measured(board)
    medians = np.array([setup.noise.median for setup in board.setups])
    columns, bounds = parameters.fitted_columns, parameters.fitted_bounds
    predict, centre = predictor(board, models, "exact", centre), centre.copy()
    for _ in range(_MOST_LEVELS):
        start = np.clip(centre[columns], bounds.lower + _BOUND_MARGIN, bounds.upper - _BOUND_MARGIN)
        if not np.isfinite(predict(start[None, :])).all():
            raise NotIdentifiableError(_no_plate_message(board, models, parameters.values_at(centre)))
        centre[columns] = most_likely(predict, normal_misfit(target, scales), start, bounds)
        if is_once:
            break
        previous_noise, noise = noise, medians * noise_widenings(board, target - predict(centre[None, columns])[0])
        scales = reading_sd(board.setups, noise)
        if np.abs(np.log(noise / previous_noise)).max() < _SAME_LEVEL:
            break
    centre[parameters.n_constants : parameters.first_input] = np.log(noise)
    return centre, scales


def _no_plate_message(board: Board, models: Sequence[SetupModel], values: Values) -> str:
    """Message that the least-squares plate is far from the readings, with the worst reading."""
    target = log_measured(board)
    residuals = target - np.concatenate([model.log_frequencies(values, "linear")[0] for model in models])
    worst = int(np.argmax(np.abs(residuals)))
    return (
        f"{board.name}: no plate comes near the readings, least squares misses {board.short_reading_names[worst]} at "
        f"{np.exp(target[worst]):.5g} Hz by {abs(cents(residuals[worst])):.0f} cents: is it a decimal place off, or "
        "another mode?"
    )


def with_peak_modes(models: Iterable[SetupModel], values: Values) -> tuple[SetupModel, ...]:
    """The models, with all modes that peaks may be where a setup has peaks to assign."""
    return tuple(with_other_modes(model, values) if needs_assignment(model.setup) else model for model in models)


def noise_widenings(board: Board, residuals: Floats) -> Floats:
    """Likely noise of each setup over its prior median, at least 1, from (n_modes,) residuals of ln f: (n_setups,).

    Where all noises are w times their medians, a residual r has the variance v = (w median)^2 + its own variance, and
    informs on w by the share s = (w median)^2 / v. With a fraction p of a degree of freedom for each reading, the
    density of ln w is highest where the sum of s (r^2 / v - p) is ln(w) / log_sd^2. A narrow prior keeps the noise at
    its median whatever the residuals; a wide one lets it follow the part of the residuals that rounding and own
    uncertainties do not explain.
    """
    from scipy.optimize import brentq

    squares = residuals**2
    spare = max(squares.size - board.symmetry.n, 1) / squares.size
    medians = np.array([setup.noise.median for setup in board.setups])
    noise = np.repeat(medians, [len(setup.readings) for setup in board.setups])

    def excess(log_w: float) -> float:
        variances = reading_sd(board.setups, medians * np.exp(log_w)) ** 2
        return float(np.sum((noise * np.exp(log_w)) ** 2 / variances * (squares / variances - spare)))

    if excess(0.0) <= 0.0:
        return np.ones(len(board.setups))
    highest = 0.5 * np.log(np.max(squares / noise**2) / spare)

    def likely(log_sd: float) -> float:
        return float(np.exp(brentq(lambda log_w: excess(log_w) - log_w / log_sd**2, 0.0, highest)))

    return np.array([likely(setup.noise.log_sd) for setup in board.setups])


def all_modes_predictor(board: Board, models: Sequence[SetupModel], law: LawName, centre: Floats) -> Predictor:
    """ln f (Hz) of all modes that peaks may be as a function of the fitted columns, noise as in `centre`."""
    parameters = Parameters(board)

    def values(x: Floats) -> Values:
        theta = np.tile(centre, (len(x), 1))
        theta[:, parameters.fitted_columns] = x
        return parameters.values(theta)

    return Predictor(values, models, law, n_constants=parameters.n_constants)


def predictor(board: Board, models: Sequence[SetupModel], law: LawName, centre: Floats) -> Predictor:
    """ln f (Hz) of the labelled modes, as `all_modes_predictor`."""
    return all_modes_predictor(board, models, law, centre).of_labelled()


def _covariance(
    board: Board, models: Sequence[SetupModel], scales: Floats, centre: Floats, spread: Floats | None
) -> Floats:
    """Covariance of all columns: from the weighted fit for the fitted columns, from the prior for the noise."""
    parameters = Parameters(board)
    n, columns = parameters.n_constants, parameters.fitted_columns
    weighted = design_matrix(predictor(board, models, "linear", centre), scales, centre[columns])
    covariance = np.zeros((parameters.n_dim, parameters.n_dim))
    covariance[np.ix_(columns, columns)] = np.linalg.inv(weighted.T @ weighted)
    for i, setup in enumerate(board.setups, start=n):
        covariance[i, i] = setup.noise.log_sd**2
    if spread is not None:
        covariance[:n, :n] += spread
    return covariance


def exact_models(
    board: Board,
    models: Sequence[SetupModel],
    centre: Floats,
    covariance: Floats,
    *,
    is_rough: bool = False,
    accepted_cents: float | None = None,
) -> tuple[SetupModel, ...]:
    """Models with the exact law, trained at the centre and at the corners of a box around it.

    The box spans D_x / D_s, D_y / D_s and, where it is uncertain, nu_xy: frequencies of a bare plate are homogeneous in
    the rigidities, so a common factor needs no training, and side lengths only rescale the same terms; for an isotropic
    board it spans D itself, which does no harm. Parameters of effects, and inputs that their fields follow, add the two
    ends of their own range, each combined with an opposite corner of the box; effects at an unknown place add places
    over the whole board. The law is checked at points of the box with sizes of effects drawn from their normal
    approximation, and further points are solved until the error there is below `accepted_cents`.

    A rough law has two opposite corners, one end for each effect and one check: its error near the centre is small too.
    """
    parameters = Parameters(board)
    n = parameters.n_constants
    ratios = np.eye(n)[:-1] - np.eye(n)[-1] if n > 1 else np.eye(1)
    boxed = list(range(len(ratios)))
    spread = ratios @ covariance[:n, :n] @ ratios.T
    half_widths = np.zeros(parameters.n_dim)
    half_widths[boxed] = np.clip(_BOX_SDS * np.sqrt(np.diagonal(spread)), _NARROWEST, _WIDEST)
    sds = np.sqrt(np.diagonal(covariance))
    followed = {name for model in models for effect in model.system.effects for name in effect.followed_inputs}
    stretched = []
    for i, parameter in enumerate(parameters.uncertain, start=parameters.first_input):
        if parameter.name == "poisson_xy":
            boxed.append(i)
            half_widths[i] = _BOX_SDS
        elif parameter.is_of_effect or parameter.name in followed:
            stretched.append(i)
            half_widths[i] = _BOX_SDS * sds[i]
    corners = np.zeros((2 ** len(boxed), parameters.n_dim))
    corners[:, boxed] = list(product((-1.0, 1.0), repeat=len(boxed)))
    ends = np.zeros((2 * len(stretched), parameters.n_dim))
    for row, i in enumerate(stretched):
        ends[2 * row, [*boxed, i]] = [*corners[row % len(corners), boxed], 1.0]
        ends[2 * row + 1, [*boxed, i]] = [*-corners[row % len(corners), boxed], -1.0]
    half_box = [corners[[0, -1]], ends[::2]]
    reach = _BOX_SDS * sds
    effect_points = _effect_steps(models, parameters, centre, reach) / np.where(half_widths > 0.0, half_widths, 1.0)
    corners = np.concatenate(half_box if is_rough else [*half_box, corners[1:-1], ends[1::2], effect_points])
    n_held_out = 1 if is_rough else _N_HELD_OUT
    rng = np.random.default_rng(0)
    held_out = half_widths * rng.uniform(-1.0, 1.0, (n_held_out, parameters.n_dim))
    # Sizes of effects are often known to a factor only: points far out in all of them at once have no probability.
    held_out[:, stretched] = sds[stretched] * rng.standard_normal((n_held_out, len(stretched)))

    def points(steps: Floats) -> list[Values]:
        values = parameters.values(parameters.within_bounds(centre + steps))
        columns = {name: np.broadcast_to(value, len(steps)) for name, value in values.items()}
        return [{name: column[i] for name, column in columns.items()} for i in range(len(steps))]

    (centre_values,) = points(np.zeros((1, parameters.n_dim)))
    around, checks = points(half_widths * corners), points(held_out)
    tolerance = law_tolerance(board) if accepted_cents is None else accepted_cents
    return tuple(with_exact_law(model, centre_values, around, checks, tolerance) for model in models)


def law_tolerance(board: Board) -> float:
    """Accepted error of an exact law, cents: a fifth of the least scatter of any reading."""
    medians = np.array([setup.noise.median for setup in board.setups])
    return _SHARE_OF_NOISE * float(cents(reading_sd(board.setups, medians).min()))


def _effect_steps(models: Sequence[SetupModel], parameters: Parameters, centre: Floats, reach: Floats) -> Floats:
    """Steps from the centre to further training points that effects need: (n_points, n_dim) array.

    A share of 0 is the lower end of a parameter's range within the bounds of its prior, and 1 the upper end; an exact
    parameter is not moved.
    """
    share_sets = dict.fromkeys(
        tuple(shares.items()) for model in models for effect in model.system.effects for shares in effect.law_points()
    )
    column = {name: i for i, name in enumerate(parameters.inputs, start=parameters.first_input)}
    low, high = parameters.within_bounds(np.stack([centre - reach, centre + reach]))
    steps = np.zeros((len(share_sets), parameters.n_dim))
    for step, shares in zip(steps, share_sets, strict=True):
        for name, share in shares:
            if name in column:
                i = column[name]
                step[i] = low[i] + share * (high[i] - low[i]) - centre[i]
    return steps


def worst_cents(models: Sequence[SetupModel]) -> float:
    """Largest error of the exact laws against full solves that they were not trained on, cents."""
    return max(model.worst_cents for model in models)


def linearisation_errors(board: Board, models: Sequence[SetupModel], theta: Floats) -> Floats:
    """Linear less exact law at each draw, of all modes of the likelihood: (n_draws, n_modes) array, cents."""
    values = Parameters(board).values(theta)
    laws = [[model.mode_log_frequencies(values, law) for model in models] for law in get_args(LawName)]
    errors = [linear - exact for linear, exact in zip(*laws, strict=True)]
    return cents(np.concatenate(errors, axis=1))
