"""The constants of a board by each method, and the errors of the exact frequencies at these constants."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values
from bayesplate.board.material import MODULI, RIGIDITIES, moduli_of, rigidities
from bayesplate.estimates.paper import PaperSystem
from bayesplate.estimates.percentile import percentile_estimate
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.assessment import full_frequencies
from bayesplate.posterior.draws import Draws, posterior_mean_values
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.reweighting import weighted_mean
from bayesplate.results.comparison import ForwardPrediction, MethodRow, ModulusEstimate
from bayesplate.results.contract import Elastic, finite_or_none, rms


def point_methods(problem: PosedProblem, system: PaperSystem, expected_sd: Mapping[str, float]) -> list[MethodRow]:
    """The methods without sampling: the paper's least squares, weighted least squares, percentile.

    The percentile method is left out where there are too many modes, or none of its estimates is positive.
    `expected_sd` is the relative standard deviation of the weighted estimate of each modulus.
    """
    nominal, values, paper = problem.board.nominal(), problem.estimate.values, system.solve()
    by_paper = zip(MODULI, system.moduli(paper), strict=True)
    weighted = zip(MODULI, map(float, moduli_of(values)), strict=True)
    methods = [
        _method_row(
            "paper_least_squares",
            problem,
            nominal | dict(zip(RIGIDITIES, paper, strict=True)),
            {name: _modulus_estimate(float(modulus)) for name, modulus in by_paper},
            condition_number=system.condition_number,
        ),
        _method_row(
            "weighted_least_squares",
            problem,
            values,
            {name: _modulus_estimate(modulus, expected_sd[name] * modulus) for name, modulus in weighted},
            condition_number=problem.identifiability.condition_number,
        ),
    ]
    percentile = percentile_estimate(system)
    if percentile is not None and all(np.isfinite(percentile.mean[name]) for name in MODULI):
        E_x, E_y, G_xy = (percentile.mean[name] for name in MODULI)
        constants = rigidities(E_x, E_y, G_xy, nominal["thickness"], nominal["poisson_xy"])
        methods.append(
            _method_row(
                "percentile",
                problem,
                nominal | constants._asdict(),
                {name: _modulus_estimate(percentile.mean[name], percentile.sd[name]) for name in MODULI},
                n_subsets=percentile.n_subsets,
            )
        )
    return methods


def posterior_method(name: str, problem: PosedProblem, draws: Draws, weights: Floats) -> MethodRow:
    """A posterior as a method, from draws with (n_chains * n_draws,) weights that sum to 1."""
    elastic = {}
    for modulus, by_chain in draws.moduli.items():
        values = by_chain.ravel()
        mean = weighted_mean(values, weights)
        sd = float(np.sqrt(weighted_mean((values - mean) ** 2, weights)))
        order = np.argsort(values)
        levels = np.cumsum(weights[order]) - 0.5 * weights[order]
        elastic[modulus] = _modulus_estimate(mean, sd, *np.interp([0.05, 0.95], levels, values[order]).tolist())
    sampled = {**draws.rigidities, **draws.inputs}
    means = {key: np.asarray(weighted_mean(values.ravel(), weights)) for key, values in sampled.items()}
    return _method_row(name, problem, {**posterior_mean_values(draws), **means}, elastic)


def _modulus_estimate(mean: float, sd: float = np.nan, q05: float = np.nan, q95: float = np.nan) -> ModulusEstimate:
    return ModulusEstimate(finite_or_none(mean), finite_or_none(sd), finite_or_none(q05), finite_or_none(q95), "Pa")


def _method_row(
    name: str,
    problem: PosedProblem,
    values: Values,
    elastic: Mapping[str, ModulusEstimate],
    condition_number: float | None = None,
    n_subsets: int | None = None,
) -> MethodRow:
    """A method, and full solves at its constants and inputs; no predictions if the constants are of no plate."""
    readings = [(setup.name, reading) for setup in problem.board.setups for reading in setup.readings]
    measured = np.array([reading.frequency.mean for _, reading in readings])
    is_plate = all(float(values[rigidity]) > 0 for rigidity in RIGIDITIES)
    predicted = full_frequencies(problem, values) if is_plate else np.full(measured.size, np.nan)
    residuals = cents(np.log(measured / predicted))
    return MethodRow(
        name,
        Elastic(**elastic),
        None if condition_number is None else finite_or_none(condition_number),
        n_subsets,
        tuple(
            ForwardPrediction(setup, str(reading.label), finite_or_none(float(hertz)), finite_or_none(float(residual)))
            for (setup, reading), hertz, residual in zip(readings, predicted, residuals, strict=True)
        ),
        rms(residuals) if is_plate else None,
    )
