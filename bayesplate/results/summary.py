"""summary.json: everything a reader of a fit needs, in SI units, the same bytes for the same seed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.effects import is_effect_parameter
from bayesplate.estimates.identifiability import remarks
from bayesplate.estimates.paper import PaperSystem, paper_system
from bayesplate.estimates.percentile import percentile_estimate
from bayesplate.frequencies.laws import LawName, cents
from bayesplate.frequencies.spectrum import sign_conflicts
from bayesplate.modes.naming import CERTAIN
from bayesplate.plate.material import MODULI, RIGIDITIES, moduli
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.inference import Inference, Problem
from bayesplate.posterior.region import worst_cents
from bayesplate.posterior.sampling import Chains
from bayesplate.results.budget import input_remarks
from bayesplate.results.draws import (
    FEWEST_WEIGHTED_DRAWS,
    Draws,
    finite,
    linear_is_enough,
    linearisation,
    means_under,
    spread,
)
from bayesplate.results.modes import (
    Spectrum,
    mode_entries,
    mode_errors,
    posterior_mean_values,
    spectra,
    unlabelled_entries,
)

FORMAT = 1
_HIGH_EXACT_ERROR = 0.5
_UNITS = {"length_x": "m", "length_y": "m", "thickness": "m", "mass": "kg", "density": "kg/m^3", "poisson_xy": "1"}

Summary = dict[str, Any]


def header(problem: Problem, seed: int, versions: Mapping[str, str], card_sha256: str) -> Summary:
    """What was fitted, before any result."""
    return {
        "format": FORMAT,
        "name": problem.board.name,
        "seed": seed,
        "versions": dict(versions),
        "card_sha256": card_sha256,
        "model": {
            "theory": problem.posterior.models[0].system.theory,
            "law": problem.posterior.law,
            "effects": list(problem.board.effects),
            "robust": problem.posterior.robust,
            "prior": problem.prior.name,
        },
    }


def unconverged_summary(
    problem: Problem, chains: Chains, convergence: Convergence, seed: int, versions: Mapping[str, str], sha256: str
) -> Summary:
    """The summary of a run that failed the gate: its diagnostics, and no constants."""
    return {
        **header(problem, seed, versions, sha256),
        "converged": False,
        "sampler": sampler_health(chains, convergence),
        "warnings": [*convergence.reasons, f"suggested steps: {convergence.suggested_steps}"],
    }


def summarise(
    inference: Inference,
    draws: Draws,
    seed: int,
    versions: Mapping[str, str],
    card_sha256: str,
    linear_errors: NDArray[np.float64] | None = None,
) -> Summary:
    """The summary of a converged fit.

    Parameters
    ----------
    inference : Inference
    draws : Draws
    seed : int
    versions : dict of str
    card_sha256 : str
    linear_errors : (n_some, n_modes) array, cents, optional
        Those of `bayesplate.results.draws.linearisation`, where they are known already.

    Returns
    -------
    dict
        As design and glossary name it: elastic, rigidity, effects, noise, inputs, derived, the point estimates, modes,
        errors, sampler, identifiability, warnings.
    """
    problem = inference.problem
    board = problem.board
    system = paper_system(board, problem.estimate, compared=False)
    errors = mode_errors(inference, draws)
    found = spectra(problem, draws)
    if linear_errors is None:
        linear_errors = linearisation(inference, draws)
    means = {law: _means(inference, draws, law, linear_errors) for law in ("linear", "exact")}
    return {
        **header(problem, seed, versions, card_sha256),
        "converged": True,
        "elastic": {name: spread(values, "Pa") for name, values in draws.moduli.items()},
        "rigidity": {name: spread(values, "N m") for name, values in draws.rigidities.items()},
        "effects": _effects(problem, draws),
        "noise": {setup.name: spread(draws.noise[..., i], "1") for i, setup in enumerate(board.setups)},
        "inputs": {
            name: spread(values, _UNITS.get(name, "m"))
            for name, values in draws.inputs.items()
            if not is_effect_parameter(name)
        },
        "derived": {name: spread(item.values, item.unit) for name, item in draws.derived.items()},
        "least_squares": _paper_least_squares(system),
        "weighted_least_squares": _weighted(problem),
        "percentile": _percentile(system),
        "linear_means": means["linear"],
        "exact_means": means["exact"],
        "modes": mode_entries(inference, draws, errors),
        "unlabelled": unlabelled_entries(problem, found),
        "error": {
            "in_sample_rms_cents": _rms(cents(errors.in_sample)),
            "leave_one_out_rms_cents": _rms(cents(errors.left_out)),
            "linearisation_rms_cents": _rms(linear_errors),
            "exact_law_worst_cents": worst_cents(problem.posterior.models),
            **_surrogate_errors(inference, draws),
        },
        "sampler": sampler_health(inference.chains, inference.convergence),
        "identifiability": [*remarks(board, problem.identifiability), *input_remarks(draws)],
        "warnings": _warnings(inference, draws, found, linear_errors),
    }


def _effects(problem: Problem, draws: Draws) -> Summary:
    """Parameters of the declared effects, by board or setup, effect and parameter; exact ones have no spread."""
    result: Summary = {}
    for setup, model in zip(problem.board.setups, problem.posterior.models, strict=True):
        for effect in model.system.effects:
            owner = result.setdefault(setup.name if effect.scope == "setup" else "board", {})
            owner[effect.name] = {
                parameter.name: spread(_values_of(effect.key(parameter.name), problem, draws), parameter.unit)
                for parameter in effect.parameters()
            }
    return result


def _values_of(key: str, problem: Problem, draws: Draws) -> NDArray[np.float64]:
    exact = np.broadcast_to(problem.board.inputs[key].mean, draws.log_posterior.shape)
    return draws.inputs.get(key, exact)


def sampler_health(chains: Chains, convergence: Convergence) -> Summary:
    """How the sampler fared."""
    n_ensembles, n_steps, n_walkers, _ = chains.draws.shape
    return {
        "ensembles": n_ensembles,
        "walkers": n_walkers,
        "steps": n_steps,
        "tau_max": finite(convergence.tau_max),
        "rhat_max": finite(convergence.rhat_max),
        "ess_min": finite(convergence.ess_min),
        "acceptance": finite(convergence.acceptance),
    }


def _means(inference: Inference, draws: Draws, law: LawName, linear_errors: NDArray[np.float64]) -> Summary:
    """Posterior means under a law; none where the two laws are too far apart for one to stand for the other."""
    means, effective = means_under(inference, draws, law, linear_errors)
    if effective < FEWEST_WEIGHTED_DRAWS:
        return {**dict.fromkeys(means, None), "effective_draws": effective}
    return {**means, "effective_draws": effective}


def _paper_least_squares(system: PaperSystem) -> Summary:
    constants = system.solve()
    elastic = system.moduli(constants)
    return _point(np.stack(elastic), constants, system.condition_number)


def _weighted(problem: Problem) -> Summary:
    estimate = problem.estimate
    values = estimate.values
    D_x, D_y, D_s = estimate.rigidities
    elastic = moduli(D_x, D_y, D_s, values["thickness"], values["poisson_xy"])
    return _point(np.stack(elastic), estimate.rigidities, problem.identifiability.condition_number)


def _point(elastic: NDArray[np.float64], constants: NDArray[np.float64], condition_number: float) -> Summary:
    return {
        **{name: finite(float(v)) for name, v in zip(MODULI, elastic, strict=True)},
        **{name: float(v) for name, v in zip(RIGIDITIES, constants, strict=True)},
        "condition_number": condition_number,
    }


def _percentile(system: PaperSystem) -> Summary | None:
    found = percentile_estimate(system)
    if found is None:
        return None
    return {
        **{
            name: {
                "mean": finite(found.mean[name]),
                "sd_percent": finite(100.0 * found.sd[name] / found.mean[name]),
            }
            for name in MODULI
        },
        "n_subsets": found.n_subsets,
    }


def _warnings(
    inference: Inference, draws: Draws, found: Mapping[str, Spectrum], linear_errors: NDArray[np.float64]
) -> list[str]:
    problem = inference.problem
    sentences = list(problem.board.notes)
    if not problem.estimate.converged:
        sentences.append("the least-squares steps did not settle: two modes near one frequency may swap their labels")
    for setup, model in zip(problem.board.setups, problem.posterior.models, strict=True):
        for label, place in zip(setup.labels, model.places, strict=True):
            if place.correlation < CERTAIN:
                sentences.append(
                    f"setup {setup.name}: the shape of mode {label} fits its label only to {place.correlation:.2f}; "
                    "it may be its neighbour at a veering"
                )
    values = posterior_mean_values(problem, draws)
    for setup in problem.board.setups:
        if setup.hammer is not None:
            sentences += sign_conflicts(setup, *found[setup.name], values)
    if problem.posterior.law == "linear" and not linear_is_enough(inference, draws, linear_errors):
        sentences.append(
            "the linear law is off by more than a quarter of the noise over the posterior: its constants may be "
            "shifted, use the exact law"
        )
    if worst_cents(problem.posterior.models) > _HIGH_EXACT_ERROR:
        sentences.append(
            f"the exact law misses full solves by up to {worst_cents(problem.posterior.models):.2f} cents at the rim "
            "of the posterior"
        )
    return sentences


def _rms(values: NDArray[np.float64] | Sequence[float]) -> float | None:
    finite = np.asarray(values)[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else None


def _surrogate_errors(inference: Inference, draws: Draws) -> Summary:
    """Surrogate less exact law over the posterior, where the walkers walked on one."""
    if inference.surrogate is None:
        return {"surrogate_rms_cents": None, "surrogate_worst_cents": None}
    exact = draws.log_frequency.reshape(len(draws.flat), -1)
    errors = cents(inference.surrogate.log_frequencies(draws.flat) - exact)
    return {"surrogate_rms_cents": _rms(errors), "surrogate_worst_cents": float(np.nanmax(np.abs(errors)))}
