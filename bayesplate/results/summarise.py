"""From draws and their assessment to the summary of a fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.material import MODULI, RIGIDITIES, moduli_of
from bayesplate.estimates.identifiability import identifiability_remarks
from bayesplate.estimates.leave_one_out import carrying_sentence
from bayesplate.estimates.paper import PaperSystem, paper_system
from bayesplate.estimates.percentile import percentile_estimate
from bayesplate.estimates.undeclared_air import air_sentence
from bayesplate.posterior.assessment import Assessment
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.reweighting import FEWEST_WEIGHTED_DRAWS
from bayesplate.posterior.sampling import Chains
from bayesplate.results.budget import input_remarks, prior_remarks
from bayesplate.results.contract import Elastic, JointMoments, Rigidity, Spread, finite_or_none, rms
from bayesplate.results.modes import assigned_peaks, drop_carrying_modes, mode_rows
from bayesplate.results.summary import (
    FORMAT,
    ErrorFigures,
    LawMeans,
    ModelHeader,
    Percentile,
    PercentileValue,
    PointEstimate,
    SamplerHealth,
    Summary,
    UnconvergedSummary,
)

HIGH_EXACT_ERROR = 0.5
"""Cents by which the exact law may miss full solves before a summary warns."""


def unconverged_summary(
    problem: PosedProblem, chains: Chains, convergence: Convergence, seed: int, versions: Mapping[str, str], sha256: str
) -> UnconvergedSummary:
    """The summary of a run that failed the convergence gate."""
    return UnconvergedSummary(
        format=FORMAT,
        name=problem.board.name,
        seed=seed,
        versions=dict(versions),
        card_sha256=sha256,
        model=model_header(problem),
        converged=False,
        sampler=sampler_health(chains, convergence),
        warnings=(*convergence.reasons, f"suggested steps: {convergence.suggested_steps}", *problem.doubts),
    )


def summarise(
    draws: Draws, assessment: Assessment, seed: int, versions: Mapping[str, str], card_sha256: str
) -> Summary:
    """The summary of a converged fit."""
    problem, inference = draws.problem, draws.inference
    board = problem.board
    system = paper_system(board, problem.estimate, compared=False)
    rows = mode_rows(draws, assessment)
    peaks, spectra = assigned_peaks(draws)
    paper_rigidities, surrogate_errors = system.solve(), assessment.surrogate_errors
    return Summary(
        format=FORMAT,
        name=board.name,
        seed=seed,
        versions=dict(versions),
        card_sha256=card_sha256,
        model=model_header(problem),
        converged=True,
        elastic=Elastic(**{name: Spread.of(values, "Pa") for name, values in draws.moduli.items()}),
        rigidity=Rigidity(**{name: Spread.of(values, "N m") for name, values in draws.rigidities.items()}),
        effects=_effect_spreads(draws),
        noise={setup.name: Spread.of(draws.noise[..., i], "1") for i, setup in enumerate(board.setups)},
        inputs={
            parameter.name: Spread.of(draws.inputs[parameter.name], parameter.unit)
            for parameter in board.uncertain
            if parameter.is_listed and not parameter.is_of_effect
        },
        derived={name: Spread.of(item.values, item.unit) for name, item in draws.derived.items()},
        joint=JointMoments.of(draws),
        least_squares=_point_estimate(
            np.stack(system.moduli(paper_rigidities)), paper_rigidities, system.condition_number
        ),
        weighted_least_squares=_weighted_estimate(problem),
        percentile=_percentile_method(system),
        linear_means=law_means(*assessment.means["linear"]),
        exact_means=law_means(*assessment.means["exact"]),
        modes=rows,
        peaks=peaks,
        spectra=spectra,
        error=ErrorFigures(
            in_sample_rms_cents=float(np.sqrt(np.mean([row.residual_cents**2 for row in rows]))),
            leave_one_out_rms_cents=rms([row.left_out_cents for row in drop_carrying_modes(rows, assessment.carrying)]),
            linearisation_rms_cents=rms(assessment.linear_errors),
            exact_law_worst_cents=assessment.exact_worst,
            surrogate_rms_cents=rms(surrogate_errors),
            surrogate_worst_cents=finite_or_none(np.nanmax(np.abs(surrogate_errors)))
            if surrogate_errors.size
            else None,
        ),
        sampler=replace(
            sampler_health(inference.chains, inference.convergence),
            drawn_from="law" if inference.surrogate is None else "surrogate",
            pareto_k=inference.pareto_k,
        ),
        identifiability=(
            *identifiability_remarks(board, problem.identifiability, carrying_sentence(assessment.carrying)),
            *prior_remarks(draws, problem.prior),
            *input_remarks(draws, board),
            *filter(None, [air_sentence(board, problem.estimate)]),
        ),
        warnings=tuple(fit_warnings(problem, assessment)),
        doubts=fit_doubts(problem, assessment),
        carrying_modes=assessment.carrying,
    )


def model_header(problem: PosedProblem) -> ModelHeader:
    posterior = problem.posterior
    theory, effects = posterior.models[0].system.theory, tuple(problem.board.effects)
    return ModelHeader(theory, posterior.law, effects, posterior.robust, problem.prior.name, problem.board.isotropic)


def sampler_health(chains: Chains, convergence: Convergence) -> SamplerHealth:
    n_ensembles, n_steps, n_walkers, _ = chains.draws.shape
    return SamplerHealth(
        ensembles=n_ensembles,
        walkers=n_walkers,
        steps=n_steps,
        tau_max=finite_or_none(convergence.tau_max),
        rhat_max=finite_or_none(convergence.rhat_max),
        ess_min=finite_or_none(convergence.ess_min),
        acceptance=finite_or_none(convergence.acceptance),
    )


def _effect_spreads(draws: Draws) -> dict[str, dict[str, dict[str, Spread]]]:
    """Parameters of the declared effects, by board or setup, effect and parameter; exact ones have no spread."""
    result: dict[str, dict[str, dict[str, Spread]]] = {}

    def input_values(name: str) -> Floats:
        return draws.inputs[name] if name in draws.inputs else np.array(draws.problem.board.inputs[name].mean)

    for model in draws.problem.posterior.models:
        for effect in model.system.effects:
            owner = result.setdefault(effect.owner.title, {})
            owner[effect.name] = {
                parameter.key: Spread.of(input_values(parameter.name), parameter.unit)
                for parameter in effect.parameters()
            }
    return result


def law_means(means: Mapping[str, float], effective: float) -> LawMeans:
    """Posterior means under a law; None where too few effective draws are left after reweighting to it."""
    is_reliable = effective >= FEWEST_WEIGHTED_DRAWS
    return LawMeans(
        **{name: value if is_reliable else None for name, value in means.items()}, effective_draws=effective
    )


def _weighted_estimate(problem: PosedProblem) -> PointEstimate:
    estimate = problem.estimate
    elastic = np.stack(moduli_of(estimate.values))
    return _point_estimate(elastic, estimate.rigidities, problem.identifiability.condition_number)


def _point_estimate(elastic: Floats, constants: Floats, condition_number: float) -> PointEstimate:
    entries = zip((*MODULI, *RIGIDITIES), (*elastic, *constants), strict=True)
    return PointEstimate(
        **{name: finite_or_none(float(v)) for name, v in entries}, condition_number=finite_or_none(condition_number)
    )


def _percentile_method(system: PaperSystem) -> Percentile | None:
    estimate = percentile_estimate(system)
    if estimate is None:
        return None
    values = {
        name: PercentileValue(
            finite_or_none(estimate.mean[name]), finite_or_none(100.0 * estimate.sd[name] / estimate.mean[name])
        )
        for name in MODULI
    }
    return Percentile(**values, n_subsets=estimate.n_subsets)


def fit_warnings(problem: PosedProblem, assessment: Assessment) -> list[str]:
    """The warnings of a fit, one sentence each."""
    sentences = [*problem.doubts, *problem.board.notes]
    if not problem.estimate.converged:
        sentences.append("the least-squares steps did not settle: two modes near one frequency may swap their labels")
    sentences += assessment.doubts
    if problem.posterior.law == "linear" and not assessment.linear_is_enough:
        sentences.append(
            "the linear law is off by more than a quarter of the noise over the posterior: its constants may be "
            "shifted, use the exact law"
        )
    if assessment.exact_worst > HIGH_EXACT_ERROR:
        sentences.append(
            f"the exact law misses full solves by up to {assessment.exact_worst:.2f} cents at the rim of the posterior"
        )
    return sentences


def fit_doubts(problem: PosedProblem, assessment: Assessment) -> tuple[str, ...]:
    """The warnings that are reasons not to trust the constants.

    A label left open by a veering is no such reason, for the fit weighs both modes.
    """
    of_readings = (doubt for doubt in problem.doubts if doubt not in problem.veerings)
    return (*of_readings, *assessment.doubts)
