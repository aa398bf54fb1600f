"""The search as a whole: what it holds to be probable is true as often as it says."""

from __future__ import annotations

import numpy as np

from bayesplate.diagnosis.hypotheses import log_evidences, probabilities

N_SETS = 1500
N_BINS = 10
ALLOWED = 4.0
"""Standard errors; some thirty are looked at."""


def simulated_sets(ground, rng, n_sets):
    """Which hypothesis was drawn, and readings under it: cell, place in the cell, inputs, noise and constants drawn."""
    base = ground.baseline
    priors = np.array([one.prior for one in ground.hypotheses])
    drawn = rng.choice(len(priors), size=n_sets, p=priors / priors.sum())
    readings = np.empty((n_sets, base.n_modes))
    for index in np.unique(drawn):
        one = ground.hypotheses[index]
        sets = np.flatnonzero(drawn == index)
        cell = rng.choice(one.table.n_cells, size=sets.size, p=one.table.weights)
        place = rng.standard_normal((sets.size, one.table.slopes.shape[2]))
        level = rng.choice(one.noise.weights.size, size=sets.size, p=one.noise.weights)
        variance = one.noise.sd[level][:, base.setup_index] ** 2 + base.own_variance
        inputs = rng.standard_normal((sets.size, base.input_slopes.shape[1])) @ base.input_slopes.T
        shift = one.table.shift[cell] + np.einsum("nip,np->ni", one.table.slopes[cell], place)
        constants = 0.3 * rng.standard_normal((sets.size, 3)) @ base.slopes.T
        noise = np.sqrt(variance) * rng.standard_normal(variance.shape)
        readings[sets] = one.seen(base, shift + inputs + constants + noise)
    return drawn, readings


def misses(found, drawn):
    """Frequency less mean probability, in standard errors: of each hypothesis, and of "none" in bins of its own."""
    truth = np.arange(len(found))[:, None] == drawn
    spread = np.sqrt((found * (1.0 - found)).sum(axis=1))
    of_each = (truth - found).sum(axis=1) / spread
    edges = np.quantile(found[0], np.linspace(0, 1, N_BINS + 1)[1:-1])
    binned = np.digitize(found[0], edges)
    gap, variance = truth[0] - found[0], found[0] * (1.0 - found[0])
    of_bins = [gap[binned == i].sum() / np.sqrt(variance[binned == i].sum()) for i in range(N_BINS)]
    best = found.max(axis=0)
    right = found.argmax(axis=0) == drawn
    of_best = (right - best).sum() / np.sqrt((best * (1.0 - best)).sum())
    return np.array([*of_each, *of_bins, of_best])


def found_in(ground, readings):
    return probabilities(ground.hypotheses, log_evidences(ground.hypotheses, ground.baseline, readings))


def test_probabilities_are_frequencies(finnish_few):
    ground = finnish_few.ground
    drawn, readings = simulated_sets(ground, np.random.default_rng(1), N_SETS)
    assert np.abs(misses(found_in(ground, readings), drawn)).max() < ALLOWED
