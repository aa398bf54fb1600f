"""Sensitivity of a search to its assumptions: the same search with other priors, and under the exact law.

The terms are linear in the constants about the fit of the ideal board. Where an effect moves the constants far, or the
law bends within their uncertainty, that is not exact: a draw x of the constants then has the weight

    w(x) = L_exact(x) / L_linear(x),

and the mean weight of the draws corrects the evidence. It is exact in the constants and in the size of each effect; the
shifts of two effects that were not solved together add at the constants of a draw, and uncertain inputs stay linear.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.material import MODULI, moduli
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.draws import TermDraws, draw_terms, joint_sizes_of, sizes_of
from bayesplate.diagnosis.hypotheses import Hypothesis, probabilities
from bayesplate.diagnosis.peaks import log_likelihood_of_labels, log_likelihood_summed, log_mean
from bayesplate.diagnosis.search import SearchResult, run_search
from bayesplate.diagnosis.shifts import REACH, Cells
from bayesplate.diagnosis.terms import normalised_weights

PRIOR_WIDTH_FACTORS = {"halved": 0.5, "doubled": 2.0}
"""Factors of the standard deviation of the priors of all sizes."""
NOISE_FACTORS = {"smaller": 1.0 / 1.5, "larger": 1.5}
"""Factors of the noise prior."""
_N_DRAWS = 128
_LEAST_SHARE = 0.01
"""Probability over the largest one below which a hypothesis gets the correction of that of no effect."""
_OVERSAMPLING = 2
"""Draws for each one that is kept by its weight."""


def variant_searches(result: SearchResult) -> Iterator[tuple[str, SearchResult]]:
    """The searches under other assumptions, in which a named effect has to stand out too, each with its words.

    The widths of the sizes' priors are halved and doubled, the noise prior is moved by 1.5 either way, and the exact
    law is used where it has a plate at some draw. Each search is run when the iterator reaches it.
    """
    for word, factor in PRIOR_WIDTH_FACTORS.items():
        yield f"with the priors of the sizes {word}", vary_priors(result, width=factor)
    for word, factor in NOISE_FACTORS.items():
        yield f"if the noise is 1.5 times {word}", vary_priors(result, noise=factor)
    exact = under_exact_law(result)
    if exact is not None:
        yield "under the exact law", exact


@lru_cache(maxsize=8)  # the verdict, the claim and the result use the same searches
def vary_priors(result: SearchResult, *, width: float = 1.0, noise: float = 1.0) -> SearchResult:
    """The same search, the standard deviation of every size's prior and every noise prior multiplied by a factor.

    The cells reach three of the old standard deviations; sizes beyond them, which a wider prior allows, count as unable
    to explain the readings.
    """
    ground = result.ground
    varied_ground = replace(
        ground, hypotheses=tuple(_vary_hypothesis(result, i, width, noise) for i in range(len(ground.hypotheses)))
    )
    return run_search(varied_ground, result.residual)


def _vary_hypothesis(result: SearchResult, index: int, width: float, noise: float) -> Hypothesis:
    hypothesis = result.ground.hypotheses[index]
    weights = hypothesis.table.weights.copy()
    for member, candidate in enumerate(result.ground.members(index)):
        table, cells = hypothesis.table.member(member)
        weights *= _prior_ratio(table, [[free.prior for free in law.form.free] for law in candidate.laws], width)[cells]
    return replace(
        hypothesis,
        table=replace(hypothesis.table, weights=weights),
        noise=replace(hypothesis.noise, sd=noise * hypothesis.noise.sd),
    )


def _prior_ratio(table: Cells, priors: list[list[Quantity]], factor: float) -> Floats:
    """Weight of the wider prior over that of the old one at each cell: (n_cells,) array.

    As the densities at the middles of the cells, with the total that the wider prior has within reach: a few wide
    cells do not give it by themselves.
    """
    ratio = np.ones(table.n_cells)
    for index, form_priors in enumerate(priors):
        is_of_form = table.form == index
        for i, prior in enumerate(form_priors):
            middles, places = np.unique(table.z[is_of_form, i], return_inverse=True)
            weights, wider = (np.exp(-0.5 * (middles / width) ** 2) for width in (1.0, factor))
            total = _share_within_reach(prior, factor) / _share_within_reach(prior, 1.0)
            ratio[is_of_form] *= (total * wider / wider.sum() * weights.sum() / weights)[places]
    return ratio


def _share_within_reach(prior: Quantity, factor: float) -> float:
    """Share of a prior, `factor` times as wide, that lies within reach of the cells, out of that within its bounds."""
    from scipy.special import ndtr

    low, high = prior.standard_bounds
    within_reach, within_bounds = (
        float(ndtr(top / factor) - ndtr(bottom / factor))
        for bottom, top in ((max(low, -REACH), min(high, REACH)), (low, high))
    )
    return within_reach / within_bounds


@lru_cache(maxsize=2)  # the verdict and the averages use the same search
def under_exact_law(result: SearchResult) -> SearchResult | None:
    """The same search, every evidence corrected to the exact law; None where no draw is a plate under that law."""
    rng = np.random.default_rng(0)
    corrections = np.full(result.probability.size, _correction(result, 0, rng))
    is_probable = result.probability > _LEAST_SHARE * result.probability.max()
    for index in 1 + np.flatnonzero(is_probable[1:]):
        corrections[index] = _correction(result, int(index), rng)
    evidence = result.log_evidence + corrections
    if not np.isfinite(evidence).any():
        return None
    return replace(result, log_evidence=evidence, probability=probabilities(result.ground.hypotheses, evidence))


def draw_exact(result: SearchResult, index: int, rng: np.random.Generator, n_draws: int) -> TermDraws:
    """Draw under one hypothesis and the exact law."""
    draws = draw_terms(result, index, rng, _OVERSAMPLING * n_draws)
    log_weights = log_weights_of(result, index, draws)
    if not np.isfinite(log_weights.max()):  # no draw is a plate under the exact law: only the linear terms are left
        return draws.select(np.arange(0, draws.n_draws, _OVERSAMPLING))  # draws are in the order of their noise
    return draws.select(rng.choice(draws.n_draws, size=n_draws, p=normalised_weights(log_weights)))


def log_weights_of(result: SearchResult, index: int, draws: TermDraws) -> Floats:
    """ln of the likelihood under the exact law over that of the linear terms: (n_draws,) array.

    Where labels are uncertain, the former is summed over all assignments of peaks to modes.
    """
    baseline, exact_log_frequency = (
        result.ground.hypotheses[index].baseline,
        exact_log_frequencies(result, index, draws),
    )
    log_readings = baseline.middle + result.residual_under_labels(index)[0]
    if baseline.possible_modes.is_open:
        return log_likelihood_summed(baseline, exact_log_frequency, draws.noise) - log_likelihood_of_labels(
            baseline, log_readings, draws
        )
    squares = (
        (log_readings - exact_log_frequency[:, baseline.rows]) ** 2
        - (log_readings - draws.predicted[:, baseline.rows]) ** 2
    ) / draws.variance
    return np.nan_to_num(-0.5 * squares.sum(axis=1), nan=-np.inf, neginf=-np.inf)


def exact_log_frequencies(result: SearchResult, index: int, draws: TermDraws) -> Floats:
    """ln f (Hz) of all modes that readings may be, at each draw: (n_draws, n_modes) array."""
    baseline = result.ground.baseline
    n_members = len(result.ground.members(index))
    total = np.zeros((draws.n_draws, baseline.possible_modes.log_frequency.size))
    if n_members != 1:
        total += (1 - n_members) * baseline.possible_modes.predict(draws.log_rigidities)
    for member in range(n_members):
        for _, law, rows, values in sizes_of(result, index, draws, member):
            total[rows] += law.mode_log_frequencies(baseline, draws.log_rigidities[rows], values)
    for law, rows, values in joint_sizes_of(result, index, draws):
        total[rows] = law.mode_log_frequencies(baseline, draws.log_rigidities[rows], values)
    return np.asarray(total + (draws.inputs - baseline.possible_modes.inputs) @ baseline.possible_modes.input_slopes.T)


def _correction(result: SearchResult, index: int, rng: np.random.Generator) -> float:
    draws = draw_terms(result, index, rng, _N_DRAWS)
    log_weights = log_weights_of(result, index, draws)
    if not np.isfinite(log_weights.max()):
        return -np.inf
    baseline = result.ground.hypotheses[index].baseline
    if not baseline.possible_modes.is_open:
        return log_mean(log_weights)
    # The evidence includes the sum over labels already: the correction is the ratio of both sums at the same draws.
    by_terms = log_likelihood_of_labels(baseline, baseline.middle + result.residual_under_labels(index)[0], draws)
    return log_mean(log_weights) - log_mean(log_likelihood_summed(baseline, draws.predicted, draws.noise) - by_terms)


ConstantDraws = Mapping[str, Floats]
"""Draws of rigidities (N m) and moduli (Pa) by name."""


def draw_constants(
    result: SearchResult,
    rng: np.random.Generator,
    n_draws: int,
    hypothesis_indices: Sequence[int] | None = None,
    sampler_draws: Mapping[int, ConstantDraws] | None = None,
) -> ConstantDraws:
    """Draws of the constants by name, (n_draws,) arrays, from the terms of hypotheses, weighted to the exact
    law.

    The hypotheses `hypothesis_indices` have their probability as weight; by default all have that under the exact law.
    Draws of a hypothesis in `sampler_draws` are taken from there.
    """
    weighed_result = (under_exact_law(result) or result) if hypothesis_indices is None else result
    indices = np.arange(len(result.ground.hypotheses)) if hypothesis_indices is None else np.asarray(hypothesis_indices)
    shares = weighed_result.probability[indices] / weighed_result.probability[indices].sum()
    parts: list[ConstantDraws] = []
    for index, n in zip(indices.tolist(), rng.multinomial(n_draws, shares).tolist(), strict=True):
        if n and sampler_draws and index in sampler_draws:
            picked_draws = rng.integers(next(iter(sampler_draws[index].values())).size, size=n)
            parts.append({name: np.ravel(values)[picked_draws] for name, values in sampler_draws[index].items()})
        elif n:
            parts.append(_draw_under(result, index, rng, n))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _draw_under(result: SearchResult, index: int, rng: np.random.Generator, n_draws: int) -> ConstantDraws:
    """Draws of the constants under one hypothesis, whose effects may replace thickness (m) and nu_xy."""
    draws, symmetry = draw_exact(result, index, rng, n_draws), result.ground.baseline.board.symmetry
    inputs = {name: _input(result.ground.baseline, name, draws.inputs) for name in ("thickness", "poisson_xy")}
    for member in range(len(result.ground.members(index))):
        for _, law, rows, values in sizes_of(result, index, draws, member):
            for free in law.form.free:
                if free.replaces in inputs:
                    inputs[free.replaces][rows] = values[free.name]
    D = symmetry.rigidities(np.exp(draws.log_rigidities).T, inputs["poisson_xy"])
    constants = moduli(D["D_x"], D["D_y"], D["D_s"], inputs["thickness"], inputs["poisson_xy"])
    return D | dict(zip(MODULI, constants, strict=True))


def _input(baseline: Baseline, name: str, z: Floats) -> Floats:
    """An input of the board from the standard coordinates of all uncertain inputs: (n,) array from (n, n_inputs)."""
    uncertain = tuple(baseline.board.uncertain_inputs)
    if name not in uncertain:
        return np.full(len(z), float(baseline.values[name]))
    quantity = baseline.board.inputs[name]
    return np.array(quantity.value(np.clip(z[:, uncertain.index(name)], *quantity.standard_bounds)))
