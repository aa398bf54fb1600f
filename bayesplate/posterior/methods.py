"""The constants of a board by each method, and the errors of the exact frequencies at these constants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values
from bayesplate.board.material import MODULI, RIGIDITIES, moduli_of, rigidities
from bayesplate.estimates.least_squares import log_measured
from bayesplate.estimates.paper import PaperSystem
from bayesplate.estimates.percentile import percentile_estimate
from bayesplate.frequencies.model import full_log_frequencies
from bayesplate.posterior.draws import Draws, posterior_mean_values
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.reweighting import weighted_mean


@dataclass(frozen=True, eq=False)
class Method:
    """Constants of a board by one method, Pa."""

    name: str
    mean: Mapping[str, float]  # E_x, E_y, G_xy; nan where the method finds no plate
    misses: Floats  # (n_modes,), ln predicted - ln measured by full solves; nan if the constants are of no plate
    sd: Mapping[str, float] = field(default_factory=dict)  # empty where the method gives none
    interval: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # middle 90 % of a posterior, or empty
    condition_number: float | None = None  # of least squares
    n_subsets: int | None = None  # of the percentile method


def point_methods(problem: PosedProblem, system: PaperSystem, expected_sd: Mapping[str, float]) -> list[Method]:
    """The methods without sampling: the paper's least squares, weighted least squares, percentile.

    The percentile method is left out where there are too many modes, or none of its estimates is positive.
    `expected_sd` is the relative standard deviation of the weighted estimate of each modulus.
    """
    nominal, estimate, paper = problem.board.nominal(), problem.estimate, system.solve()
    weighted = _by_modulus(moduli_of(estimate.values))
    methods = [
        Method(
            "paper_least_squares",
            _by_modulus(system.moduli(paper)),
            prediction_misses(problem, nominal | dict(zip(RIGIDITIES, paper, strict=True))),
            condition_number=system.condition_number,
        ),
        Method(
            "weighted_least_squares",
            weighted,
            prediction_misses(problem, estimate.values),
            sd={name: expected_sd[name] * value for name, value in weighted.items()},
            condition_number=problem.identifiability.condition_number,
        ),
    ]
    percentile = percentile_estimate(system)
    if percentile is not None and all(np.isfinite(percentile.mean[name]) for name in MODULI):
        E_x, E_y, G_xy = (percentile.mean[name] for name in MODULI)
        constants = rigidities(E_x, E_y, G_xy, nominal["thickness"], nominal["poisson_xy"])
        methods.append(
            Method(
                "percentile",
                percentile.mean,
                prediction_misses(problem, nominal | constants._asdict()),
                sd=percentile.sd,
                n_subsets=percentile.n_subsets,
            )
        )
    return methods


def posterior_method(name: str, problem: PosedProblem, draws: Draws, weights: Floats) -> Method:
    """A posterior as a method, from draws with (n_chains * n_draws,) weights that sum to 1."""
    mean, sd, interval = {}, {}, {}
    for modulus, by_chain in draws.moduli.items():
        values = by_chain.ravel()
        mean[modulus] = weighted_mean(values, weights)
        sd[modulus] = float(np.sqrt(weighted_mean((values - mean[modulus]) ** 2, weights)))
        order = np.argsort(values)
        levels = np.cumsum(weights[order]) - 0.5 * weights[order]
        low, high = np.interp([0.05, 0.95], levels, values[order])
        interval[modulus] = (float(low), float(high))
    sampled = {**draws.rigidities, **draws.inputs}
    means = {key: np.asarray(weighted_mean(values.ravel(), weights)) for key, values in sampled.items()}
    at_means = prediction_misses(problem, {**posterior_mean_values(draws), **means})
    return Method(name, mean, at_means, sd=sd, interval=interval)


def prediction_misses(problem: PosedProblem, values: Values) -> Floats:
    """ln predicted - ln measured of each reading, by full solves: (n_modes,); nan if the constants are of no plate."""
    if not all(float(values[name]) > 0 for name in RIGIDITIES):
        return np.full(log_measured(problem.board).size, np.nan)
    predicted = [full_log_frequencies(model, values) for model in problem.posterior.models]
    return np.asarray(np.concatenate(predicted) - log_measured(problem.board))


def _by_modulus(constants: tuple[Floats, ...]) -> dict[str, float]:
    return {name: float(value) for name, value in zip(MODULI, constants, strict=True)}
