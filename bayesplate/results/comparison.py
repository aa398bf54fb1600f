"""Every method's constants side by side, and the forward check: what the exact law predicts at each of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.coefficients import CoefficientRows
from bayesplate.estimates.least_squares import log_measured
from bayesplate.estimates.paper import PaperSystem
from bayesplate.estimates.percentile import percentile_estimate
from bayesplate.frequencies.full import full_log_frequencies
from bayesplate.frequencies.laws import cents
from bayesplate.plate.board import Values
from bayesplate.plate.material import MODULI, RIGIDITIES, moduli, rigidities
from bayesplate.posterior.inference import Inference, Problem
from bayesplate.results.draws import Draws, finite, weighted_mean
from bayesplate.results.modes import mode_errors, posterior_mean_values

Entries = dict[str, Any]
_SAME_CENTS = 0.5


@dataclass(frozen=True, eq=False)
class Method:
    """What one method says of a board.

    Attributes
    ----------
    name : str
    elastic : dict of dict
        For each of E_x, E_y, G_xy: mean, and sd where the method gives one; the posterior also q05 and q95. Pa.
    values : dict of float
        Constants and inputs at which its frequencies are predicted.
    details : dict
        What else it tells.
    """

    name: str
    elastic: Mapping[str, Mapping[str, float | None]]
    values: Values
    details: Mapping[str, Any] = field(default_factory=dict)


def point_methods(problem: Problem, system: PaperSystem, expected_sd: Mapping[str, float]) -> list[Method]:
    """The methods without sampling: the paper's least squares, weighted least squares, percentile.

    Parameters
    ----------
    problem : Problem
    system : PaperSystem
    expected_sd : dict of float
        Relative standard deviation of the weighted estimate of each modulus.

    Returns
    -------
    list of Method
        Without the percentile method where there are too many modes, or none of its estimates is positive.
    """
    nominal = problem.board.nominal()
    paper = system.solve()
    estimate = problem.estimate
    D_x, D_y, D_s = estimate.rigidities
    weighted = moduli(D_x, D_y, D_s, estimate.values["thickness"], estimate.values["poisson_xy"])
    methods = [
        Method(
            "paper_least_squares",
            {name: {"mean": finite(float(v))} for name, v in zip(MODULI, system.moduli(paper), strict=True)},
            {**nominal, **_named(paper)},
            {"condition_number": system.condition_number},
        ),
        Method(
            "weighted_least_squares",
            {
                name: {"mean": float(v), "sd": expected_sd[name] * float(v)}
                for name, v in zip(MODULI, weighted, strict=True)
            },
            estimate.values,
            {"condition_number": problem.identifiability.condition_number},
        ),
    ]
    percentile = percentile_estimate(system)
    if percentile is not None and all(np.isfinite(percentile.mean[name]) for name in MODULI):
        h, nu_xy = nominal["thickness"], nominal["poisson_xy"]
        E_x, E_y, G_xy = (percentile.mean[name] for name in MODULI)
        constants = np.array(rigidities(E_x, E_y, G_xy, h, nu_xy))
        methods.append(
            Method(
                "percentile",
                {name: {"mean": percentile.mean[name], "sd": finite(percentile.sd[name])} for name in MODULI},
                {**nominal, **_named(constants)},
                {"n_subsets": percentile.n_subsets},
            )
        )
    return methods


def posterior_method(name: str, problem: Problem, draws: Draws, weights: NDArray[np.float64]) -> Method:
    """A posterior as a method, from weighted draws.

    Parameters
    ----------
    name : str
    problem : Problem
    draws : Draws
    weights : (n_chains * n_draws,) array
        Sum to 1.
    """
    elastic = {modulus: _weighted_spread(values.ravel(), weights) for modulus, values in draws.moduli.items()}
    sampled = {**draws.rigidities, **draws.inputs}
    means = {key: np.asarray(weighted_mean(values.ravel(), weights)) for key, values in sampled.items()}
    return Method(name, elastic, {**posterior_mean_values(problem, draws), **means})


def theory_entry(
    problem: Problem, system: PaperSystem, methods: list[Method], inference: Inference, draws: Draws
) -> Entries:
    """What one theory of the plate makes of a board: all methods, and the error of the most likely constants.

    The error is that of `summary.json`: the most likely constants under the exact law, in sample and fitted again with
    each mode left out.
    """
    errors = mode_errors(inference, draws)
    board = problem.board
    rows = [(setup.name, reading) for setup in board.setups for reading in setup.readings]
    return {
        "theory": problem.posterior.models[0].system.theory,
        "effects": list(board.effects),
        "inputs": {name: float(q.mean) for name, q in board.inputs.items() if "." in name},
        "coefficients": [
            {"setup": setup.name, **provenance(origin)}
            for setup, origin in zip(board.setups, system.origins, strict=True)
        ],
        "methods": [_method_entry(problem, method) for method in methods],
        "modes": [
            {
                "setup": setup,
                "label": str(reading.label),
                "measured_hz": reading.frequency.mean,
                "residual_cents": float(cents(errors.in_sample[i])),
                "left_out_cents": finite(float(cents(errors.left_out[i]))),
            }
            for i, (setup, reading) in enumerate(rows)
        ],
        "error": {
            "in_sample_rms_cents": _rms(cents(errors.in_sample)),
            "leave_one_out_rms_cents": _rms(cents(errors.left_out)),
        },
    }


def provenance(origin: CoefficientRows) -> Entries:
    """Where coefficients come from, as it stands in compare.json."""
    return {
        "source": origin.source,
        "theory": origin.theory,
        "aspect_ratio": origin.aspect_ratio,
        "sentence": origin.sentence,
        "r_squared": {str(label): r for label, r in origin.r_squared.items()},
    }


def verdict(thin: Mapping[str, Any], sheared: Mapping[str, Any]) -> Entries:
    """Which theory predicts the left-out modes better, in numbers and in one sentence."""
    key = "leave_one_out_rms_cents"
    before, after = thin["error"][key], sheared["error"][key]
    if before is None or after is None:
        return {"better": None, "sentence": "Too few modes to leave one out: the two theories cannot be told apart."}
    if abs(after - before) < _SAME_CENTS:
        better, word = None, "changes nothing"
    else:
        better, word = ("shear-flexible", "makes it better") if after < before else ("thin", "makes it worse")
    sentence = f"Transverse shear {word}: {before:.1f} -> {after:.1f} cents for modes left out of the fit"
    in_sample = (thin["error"]["in_sample_rms_cents"], sheared["error"]["in_sample_rms_cents"])
    return {"better": better, "sentence": f"{sentence}, {in_sample[0]:.1f} -> {in_sample[1]:.1f} for those in it."}


def _method_entry(problem: Problem, method: Method) -> Entries:
    misses = _forward(problem, method.values)
    labels = [str(reading.label) for setup in problem.board.setups for reading in setup.readings]
    setups = [setup.name for setup in problem.board.setups for _ in setup.readings]
    measured = np.exp(log_measured(problem.board))
    return {
        "name": method.name,
        "elastic": {name: {**entry, "unit": "Pa"} for name, entry in method.elastic.items()},
        **method.details,
        "forward": [
            {
                "setup": setup,
                "label": label,
                "predicted_hz": finite(float(hertz * np.exp(miss))),
                "cents": finite(float(cents(miss))),
            }
            for setup, label, hertz, miss in zip(setups, labels, measured, misses, strict=True)
        ],
        "forward_rms_cents": _rms(cents(misses)),
    }


def _forward(problem: Problem, values: Values) -> NDArray[np.float64]:
    """ln predicted - ln measured of all readings, by full solves; not a number where the constants are no plate's."""
    if not all(float(values[name]) > 0 for name in RIGIDITIES):
        return np.full(log_measured(problem.board).size, np.nan)
    predicted = [full_log_frequencies(model, values) for model in problem.posterior.models]
    return np.asarray(np.concatenate(predicted) - log_measured(problem.board))


def _weighted_spread(values: NDArray[np.float64], weights: NDArray[np.float64]) -> dict[str, float | None]:
    mean = weighted_mean(values, weights)
    order = np.argsort(values)
    places = np.cumsum(weights[order]) - 0.5 * weights[order]
    low, high = np.interp([0.05, 0.95], places, values[order])
    sd = float(np.sqrt(weighted_mean((values - mean) ** 2, weights)))
    return {"mean": mean, "sd": sd, "q05": float(low), "q95": float(high)}


def _named(constants: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    return {name: np.asarray(value) for name, value in zip(RIGIDITIES, constants, strict=True)}


def _rms(values: NDArray[np.float64]) -> float | None:
    return float(np.sqrt(np.mean(values**2))) if np.isfinite(values).all() else None
