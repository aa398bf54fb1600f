"""The prior predictive p-value: could this residual be noise, of the size that the noise prior allows?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.hypotheses import Hypothesis
from bayesplate.diagnosis.evidence.terms import Fold

Floats = NDArray[np.float64]

PASSES = 0.05


def predictive_p_value(hypothesis: Hypothesis, fold: Fold, residuals: Floats) -> Floats:
    """Prior-predictive probability of a misfit at least as large as that of the best size of a hypothesis.

    P(chi^2 with n - 3 degrees of freedom > T), averaged over the noise prior, where T is the smallest weighted sum of
    squares over the sizes of the effect, each size's own departure from the middle of its prior included: what the
    effect's prior does not allow counts as misfit. With a noise level that is free to follow the residual every
    residual would pass.

    Parameters
    ----------
    hypothesis : Hypothesis
    fold : Fold
    residuals : (n_sets, n_modes) array

    Returns
    -------
    (n_sets,) array
    """
    from scipy.special import chdtrc

    terms = hypothesis.terms(fold)
    blind = terms.fold.blind
    seen = hypothesis.seen(fold.baseline, residuals) @ blind.T
    spread = np.einsum("di,kip->kdp", blind, hypothesis.table.slopes)
    cells = hypothesis.table.weights > 0
    penalty = -2.0 * np.log(hypothesis.table.weights[cells] / hypothesis.table.weights.max())
    result = np.zeros(len(residuals))
    for weight, covariance in zip(hypothesis.noise.weights, terms.noise_covariance, strict=True):
        whole = np.linalg.inv(covariance + spread[cells] @ np.swapaxes(spread[cells], 1, 2))
        gaps = seen[:, None, :] - terms.middles[cells][None]
        squares = np.einsum("nkd,kde,nke->nk", gaps, whole, gaps) + penalty
        result += weight * chdtrc(seen.shape[1], squares.min(axis=1))
    return result
