"""The prior predictive p-value: could this residual be noise, of the size that the noise prior allows?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.hypotheses import Hypothesis
from bayesplate.diagnosis.evidence.terms import Fold, Terms
from bayesplate.diagnosis.shifts.baseline import Baseline

Floats = NDArray[np.float64]

PASSES = 0.05
_LEAST, _MOST = 1000, 20_000
"""Simulated sets of readings: make the standard error of a p-value of 0.05 a seventh, or a thirtieth, of it."""
_MOST_TERMS = 2_000_000
"""Normal densities up to which more sets are simulated than the least."""


def predictive_p_value(hypothesis: Hypothesis, fold: Fold, residuals: Floats) -> Floats:
    """Prior predictive probability of readings that a hypothesis expects as little as these.

    The share of readings simulated under the hypothesis whose marginal density is no larger: noise and sizes are drawn
    from their priors and integrated over in the density, so that a size that the prior hardly allows counts as misfit,
    and neither noise nor size can follow the residual. Uniform if the hypothesis is true, whatever the number of setups
    and however different their noise.

    Parameters
    ----------
    hypothesis : Hypothesis
    fold : Fold
    residuals : (n_sets, n_modes) array

    Returns
    -------
    (n_sets,) array
        At least 1 / 1001, and 1 / 20,001 where nothing is lacking.

    References
    ----------
    Box, Sampling and Bayes' inference in scientific modelling and robustness, J. R. Stat. Soc. A 143, 383 (1980).
    """
    terms = hypothesis.terms(fold)
    observed = terms.log_evidence(hypothesis.seen(fold.baseline, residuals))
    expected = _expected(terms)
    return np.asarray((1.0 + np.searchsorted(expected, observed, side="right")) / (1.0 + expected.size))


def _expected(terms: Terms) -> Floats:
    """ln of the marginal density of readings simulated under a hypothesis, in ascending order: (n_sets,) array."""
    rng = np.random.default_rng(0)
    n_batches = int(np.clip(_MOST_TERMS // terms.log_weights.size, _LEAST, _MOST)) // _LEAST
    return np.sort(np.concatenate([terms.log_evidence(_simulated(terms, rng, _LEAST)) for _ in range(n_batches)]))


def _simulated(terms: Terms, rng: np.random.Generator, n_sets: int) -> Floats:
    """Residuals with an effect whose size is drawn from its prior: (n_sets, n_modes) array, ln f."""
    table = terms.table
    cells = rng.choice(table.n_cells, n_sets, p=table.weights / table.weights.sum())
    along = rng.standard_normal((n_sets, table.slopes.shape[2]))
    effect = table.shift[cells] + np.einsum("nip,np->ni", table.slopes[cells], along)
    return effect + noise_of_board(terms.fold.baseline, rng, n_sets)


def noise_of_board(baseline: Baseline, rng: np.random.Generator, n_sets: int) -> Floats:
    """Residuals of readings without any effect: (n_sets, n_modes) array, ln f.

    Noise levels and inputs are drawn from their priors; the constants need no drawing, for the search does not see
    them.
    """
    noise = [setup.noise.value(rng.standard_normal(n_sets)) for setup in baseline.board.setups]
    sd = np.sqrt(np.stack(noise, axis=1)[:, baseline.setup_index] ** 2 + baseline.own_variance)
    inputs = rng.standard_normal((n_sets, baseline.input_slopes.shape[1]))
    return np.asarray(sd * rng.standard_normal(sd.shape) + inputs @ baseline.input_slopes.T)
