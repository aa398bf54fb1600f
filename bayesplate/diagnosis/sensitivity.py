"""How far the answer hangs on what was assumed: the same search with other priors, and under the exact law.

The terms are linear in the constants about the fit of the ideal board. Where an effect moves the constants far, or the
law bends within their uncertainty, that is not exact: a draw x of them then counts by the weight

    w(x) = L_exact(x) / L_linear(x),

the mean of which over the draws is the evidence's correction. Exact in the constants and in the size of each effect;
of two effects that were not solved together the shifts at a draw's constants add, and uncertain inputs stay linear.
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
from bayesplate.diagnosis.peaks import log_mean, log_of_terms, log_summed
from bayesplate.diagnosis.search import SearchResult, search
from bayesplate.diagnosis.shifts import Cells
from bayesplate.diagnosis.terms import normalised

WIDTHS = {"halved": 0.5, "doubled": 2.0}
"""Factors of the standard deviation of the priors of all sizes."""
NOISES = {"smaller": 1.0 / 1.5, "larger": 1.5}
"""Factors of the noise prior."""
_N_DRAWS = 128
_WORTH = 0.01
"""Probability beside the largest below which an explanation is corrected as no effect is."""
_OVERSAMPLED = 2
"""Draws for each that is kept by its weight."""


def variants(found: SearchResult) -> Iterator[tuple[str, SearchResult]]:
    """The searches that a name has to survive, each made when it is asked for, and which it is in words.

    With the width of the sizes' priors halved and doubled, the noise prior moved by 1.5 either way, and under the exact
    law where some draw is a plate by it.
    """
    for word, factor in WIDTHS.items():
        yield f"with the priors of the sizes {word}", varied(found, width=factor)
    for word, factor in NOISES.items():
        yield f"if the noise is 1.5 times {word}", varied(found, noise=factor)
    exact = under_exact_law(found)
    if exact is not None:
        yield "under the exact law", exact


@lru_cache(maxsize=8)  # the verdict, the claim and the result ask for the same
def varied(found: SearchResult, *, width: float = 1.0, noise: float = 1.0) -> SearchResult:
    """The same search, the standard deviation of every size's prior and every noise prior multiplied by a factor.

    The cells reach three of the old standard deviations; what a wider prior puts beyond them counts as unable to
    explain the readings.
    """
    ground = found.ground
    changed = replace(ground, hypotheses=tuple(_changed(found, i, width, noise) for i in range(len(ground.hypotheses))))
    return search(changed, found.residual)


def _changed(found: SearchResult, index: int, width: float, noise: float) -> Hypothesis:
    one = found.ground.hypotheses[index]
    weights = one.table.weights.copy()
    for which, candidate in enumerate(found.ground.members(index)):
        table, cells = one.table.member(which)
        weights *= _widening(table, [[free.prior for free in law.form.free] for law in candidate.laws], width)[cells]
    return replace(one, table=replace(one.table, weights=weights), noise=replace(one.noise, sd=noise * one.noise.sd))


def _widening(table: Cells, priors: list[list[Quantity]], factor: float) -> Floats:
    """Density of the wider prior over that of the old one at each cell: (n_cells,) array."""
    result = np.ones(table.n_cells)
    for index, of_form in enumerate(priors):
        own = table.form == index
        for i, prior in enumerate(of_form):
            z = table.z[own, i]
            wider = np.exp(-0.5 * (z / factor) ** 2) / (factor * _inside(prior, factor))
            result[own] *= wider / (np.exp(-0.5 * z**2) / _inside(prior, 1.0))
    return result


def _inside(prior: Quantity, factor: float) -> float:
    """Share of a normal distribution of that standard deviation within the prior's bounds."""
    from scipy.special import ndtr

    low, high = (bound / factor for bound in prior.standard_bounds)
    return float(ndtr(high) - ndtr(low))


@lru_cache(maxsize=2)  # the verdict and the averages ask for the same
def under_exact_law(found: SearchResult) -> SearchResult | None:
    """The same search, every evidence corrected to the exact law; None where no draw is a plate by it."""
    rng = np.random.default_rng(0)
    corrections = np.full(found.probability.size, _correction(found, 0, rng))
    worth = found.probability > _WORTH * found.probability.max()
    for index in 1 + np.flatnonzero(worth[1:]):
        corrections[index] = _correction(found, int(index), rng)
    evidence = found.log_evidence + corrections
    if not np.isfinite(evidence).any():
        return None
    return replace(found, log_evidence=evidence, probability=probabilities(found.ground.hypotheses, evidence))


def draw_exact(found: SearchResult, index: int, rng: np.random.Generator, n_draws: int) -> TermDraws:
    """Draw under one hypothesis and the exact law."""
    drawn = draw_terms(found, index, rng, _OVERSAMPLED * n_draws)
    log_weights = log_weights_of(found, index, drawn)
    if not np.isfinite(log_weights.max()):  # no draw is a plate by the exact law: the linear terms are all there is
        return drawn.at(np.arange(0, drawn.n_draws, _OVERSAMPLED))  # which stand in the order of their noise
    return drawn.at(rng.choice(drawn.n_draws, size=n_draws, p=normalised(log_weights)))


def log_weights_of(found: SearchResult, index: int, drawn: TermDraws) -> Floats:
    """ln of the likelihood under the exact law over that of the linear terms: (n_draws,) array.

    Where readings may be other modes than their labels say, the former is summed over all ways to take them.
    """
    own, exact = found.ground.hypotheses[index].own, exact_log_frequencies(found, index, drawn)
    seen = own.middle + found.seen(index)[0]
    if own.every.is_open:
        return log_summed(own, exact, drawn.noise) - log_of_terms(own, seen, drawn)
    squares = ((seen - exact[:, own.rows]) ** 2 - (seen - drawn.predicted[:, own.rows]) ** 2) / drawn.variance
    return np.nan_to_num(-0.5 * squares.sum(axis=1), nan=-np.inf, neginf=-np.inf)


def exact_log_frequencies(found: SearchResult, index: int, drawn: TermDraws) -> Floats:
    """ln f (Hz) of all modes that readings may be, at each draw: (n_draws, n_every) array."""
    baseline = found.ground.baseline
    n_members = len(found.ground.members(index))
    total = np.zeros((drawn.n_draws, baseline.every.log_frequency.size))
    if n_members != 1:
        total += (1 - n_members) * baseline.every.predict(drawn.log_rigidities)
    for which in range(n_members):
        for _, law, rows, values in sizes_of(found, index, drawn, which):
            total[rows] += law.every_log_frequency(baseline, drawn.log_rigidities[rows], values)
    for law, rows, values in joint_sizes_of(found, index, drawn):
        total[rows] = law.every_log_frequency(baseline, drawn.log_rigidities[rows], values)
    return np.asarray(total + (drawn.inputs - baseline.every.inputs) @ baseline.every.input_slopes.T)


def _correction(found: SearchResult, index: int, rng: np.random.Generator) -> float:
    drawn = draw_terms(found, index, rng, _N_DRAWS)
    log_weights = log_weights_of(found, index, drawn)
    if not np.isfinite(log_weights.max()):
        return -np.inf
    own = found.ground.hypotheses[index].own
    if not own.every.is_open:
        return log_mean(log_weights)
    # The sum over labels is in the evidence already: what the law adds is the ratio of both sums at the same draws.
    by_terms = log_of_terms(own, own.middle + found.seen(index)[0], drawn)
    return log_mean(log_weights) - log_mean(log_summed(own, drawn.predicted, drawn.noise) - by_terms)


Constants = Mapping[str, Floats]
"""Draws of rigidities (N m) and moduli (Pa) by name."""


def draw_constants(
    found: SearchResult,
    rng: np.random.Generator,
    n_draws: int,
    among: Sequence[int] | None = None,
    sampled: Mapping[int, Constants] | None = None,
) -> Constants:
    """Draws of the constants and inputs by name, (n_draws,) arrays, from the terms of hypotheses, weighted to the exact
    law.

    Over the hypotheses `among` by their probability, by default over all by that under the exact law; of hypotheses
    that were `sampled` from those draws.
    """
    weighed = (under_exact_law(found) or found) if among is None else found
    indices = np.arange(len(found.ground.hypotheses)) if among is None else np.asarray(among)
    shares = weighed.probability[indices] / weighed.probability[indices].sum()
    parts: list[Constants] = []
    for index, n in zip(indices.tolist(), rng.multinomial(n_draws, shares).tolist(), strict=True):
        if n and sampled and index in sampled:
            picked = rng.integers(next(iter(sampled[index].values())).size, size=n)
            parts.append({name: np.ravel(values)[picked] for name, values in sampled[index].items()})
        elif n:
            parts.append(_drawn(found, index, rng, n))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _drawn(found: SearchResult, index: int, rng: np.random.Generator, n_draws: int) -> Constants:
    """The same under one hypothesis, whose effects may replace thickness (m) and nu_xy by their own."""
    drawn, symmetry = draw_exact(found, index, rng, n_draws), found.ground.baseline.board.symmetry
    inputs = {name: _input(found.ground.baseline, name, drawn.inputs) for name in ("thickness", "poisson_xy")}
    for which in range(len(found.ground.members(index))):
        for _, law, rows, values in sizes_of(found, index, drawn, which):
            for free in law.form.free:
                if free.replaces in inputs:
                    inputs[free.replaces][rows] = values[free.name]
    D = symmetry.rigidities(np.exp(drawn.log_rigidities).T, inputs["poisson_xy"])
    constants = moduli(D["D_x"], D["D_y"], D["D_s"], inputs["thickness"], inputs["poisson_xy"])
    return D | dict(zip(MODULI, constants, strict=True))


def _input(baseline: Baseline, name: str, z: Floats) -> Floats:
    """An input of the board from the standard coordinates of all uncertain ones: (n,) array from (n, n_inputs)."""
    uncertain = tuple(baseline.board.uncertain_inputs)
    if name not in uncertain:
        return np.full(len(z), float(baseline.values[name]))
    quantity = baseline.board.inputs[name]
    return np.array(quantity.value(np.clip(z[:, uncertain.index(name)], *quantity.standard_bounds)))
