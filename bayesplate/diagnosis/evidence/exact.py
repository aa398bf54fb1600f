"""The search under the exact law: draws of its normal terms, weighted by what the exact frequencies say of them.

The terms are linear in the constants about the fit of the ideal board. Where an effect moves the constants far, or the
law bends within their uncertainty, that is not exact: a draw x then counts by the weight

    w(x) = L_exact(x) / L_linear(x),

the mean of which over the draws is the evidence's correction. Exact in the constants and in the size of each effect;
of two effects that were not solved together the shifts at a draw's constants add, and uncertain inputs stay linear.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.draws import TermDraws, draw_terms, joint_sizes_of, members_of, sizes_of
from bayesplate.diagnosis.evidence.hypotheses import probabilities
from bayesplate.diagnosis.evidence.peaks import log_mean, log_of_terms, log_summed
from bayesplate.diagnosis.evidence.search import Found

Floats = NDArray[np.float64]

_N_DRAWS = 128
_WORTH = 0.01
"""Probability beside the largest below which an explanation is corrected as no effect is."""
_OVERSAMPLED = 2
"""Draws for each that is kept by its weight."""


@lru_cache(maxsize=2)  # the verdict and the averages ask for the same
def under_exact_law(found: Found) -> Found | None:
    """The same search with every evidence corrected to the exact law.

    Parameters
    ----------
    found : Found

    Returns
    -------
    Found or None
        None where the board without an effect has no exact law, or no draw of any hypothesis is a plate by it.
    """
    if not _has_law(found, 0):
        return None
    rng = np.random.default_rng(0)
    corrections = np.full(found.probability.size, _correction(found, 0, rng))
    worth = found.probability > _WORTH * found.probability.max()
    for index in 1 + np.flatnonzero(worth[1:]):
        if _has_law(found, int(index)):
            corrections[index] = _correction(found, int(index), rng)
    evidence = found.log_evidence + corrections
    if not np.isfinite(evidence).any():
        return None
    return replace(found, log_evidence=evidence, probability=probabilities(found.ground.hypotheses, evidence))


def draw_exact(found: Found, index: int, rng: np.random.Generator, n_draws: int) -> TermDraws:
    """Draw under one hypothesis and the exact law; under its linear terms where there is no exact one."""
    if not _has_law(found, index):
        return draw_terms(found, index, rng, n_draws)
    drawn = draw_terms(found, index, rng, _OVERSAMPLED * n_draws)
    log_weights = log_weights_of(found, drawn)
    if not np.isfinite(log_weights.max()):  # no draw is a plate by the exact law: the linear terms are all there is
        return drawn.at(np.arange(0, drawn.n_draws, _OVERSAMPLED))  # which stand in the order of their noise
    shares = np.exp(log_weights - log_weights.max())
    return drawn.at(rng.choice(drawn.n_draws, size=n_draws, p=shares / shares.sum()))


def log_weights_of(found: Found, drawn: TermDraws) -> Floats:
    """ln of the likelihood under the exact law over that of the linear terms: (n_draws,) array.

    Where readings may be other modes than their labels say, the former is summed over all ways to take them.
    """
    return _log_weights(found, drawn, exact_log_frequencies(found, drawn))


def _log_weights(found: Found, drawn: TermDraws, exact: Floats) -> Floats:
    hypothesis = found.ground.hypotheses[drawn.index]
    own = found.ground.baseline if hypothesis.own is None else hypothesis.own
    seen = own.middle + hypothesis.seen(found.ground.baseline, found.residual[None, :])[0]
    if not own.every.is_open:
        squares = ((seen - exact) ** 2 - (seen - drawn.predicted) ** 2) / drawn.variance
        return np.nan_to_num(-0.5 * squares.sum(axis=1), nan=-np.inf, neginf=-np.inf)
    return log_summed(own, exact, drawn.noise) - log_of_terms(own, seen, drawn)


def exact_log_frequencies(found: Found, drawn: TermDraws) -> Floats:
    """ln f (Hz) of all modes that readings may be, at each draw: (n_draws, n_every) array."""
    every = found.ground.baseline.every
    parts = [_with_effect(found, drawn, member) for member in range(len(members_of(found, drawn.index)))]
    n_bare = 1 - len(parts)
    total = np.asarray(sum(parts) + (n_bare * _bare(found, drawn.log_rigidities) if n_bare else 0.0))
    for law, rows, values in joint_sizes_of(found, drawn):
        total[rows] = law.every_log_frequency(found.ground.baseline, drawn.log_rigidities[rows], values)
    return np.asarray(total + (drawn.inputs - every.inputs) @ every.input_slopes.T)


def _with_effect(found: Found, drawn: TermDraws, member: int) -> Floats:
    """ln f (Hz) with one effect alone at each draw: (n_draws, n_every) array."""
    baseline = found.ground.baseline
    result = np.empty((drawn.n_draws, baseline.every.log_frequency.size))
    for law, rows, values in sizes_of(found, drawn, member):
        result[rows] = law.every_log_frequency(baseline, drawn.log_rigidities[rows], values)
    return result


def _bare(found: Found, log_rigidities: Floats) -> Floats:
    predict = found.ground.baseline.every.predict
    assert predict is not None
    return predict(log_rigidities)


def _correction(found: Found, index: int, rng: np.random.Generator) -> float:
    drawn = draw_terms(found, index, rng, _N_DRAWS)
    log_weights = log_weights_of(found, drawn)
    if not np.isfinite(log_weights.max()):
        return -np.inf
    every = found.ground.baseline.every
    if not every.is_open:
        return log_mean(log_weights)
    own = found.ground.hypotheses[index].own or found.ground.baseline
    seen = own.middle + found.ground.hypotheses[index].seen(found.ground.baseline, found.residual[None, :])[0]
    # The sum over labels is in the evidence already: what the law adds is the ratio of both sums at the same draws.
    return log_mean(log_weights) - log_mean(
        log_summed(own, drawn.predicted, drawn.noise) - log_of_terms(own, seen, drawn)
    )


def _has_law(found: Found, index: int) -> bool:
    """Whether there are exact frequencies of everything that a hypothesis contains."""
    members = members_of(found, index)
    has_laws = all(law.models for one in members for law in one.laws)
    return has_laws and (len(members) == 1 or found.ground.baseline.predict is not None)
