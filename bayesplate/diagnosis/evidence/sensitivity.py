"""How far the answer hangs on the width of the priors: the same search with every prior widened."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesplate.diagnosis.evidence.hypotheses import hypotheses, log_evidences, probabilities
from bayesplate.diagnosis.evidence.search import Candidate, Found
from bayesplate.diagnosis.shifts.tables import Table
from bayesplate.quantities import Quantity


def inclusion_with_width(found: Found, factor: float) -> dict[str, float]:
    """Inclusion probability of each candidate when the standard deviation of every amplitude prior is multiplied.

    The cells reach three of the old standard deviations; what a wider prior puts beyond them counts as unable to
    explain the readings.

    Parameters
    ----------
    found : Found
    factor : float

    Returns
    -------
    dict of float
        By name; "" is no effect at all.
    """
    ground = found.ground
    fine = {name: _widened(one, one.fine, factor) for name, one in ground.candidates.items()}
    coarse = {name: _widened(one, one.coarse, factor) for name, one in ground.candidates.items()}
    widened = hypotheses(ground.baseline, fine, coarse, ground.paired)
    evidences = log_evidences(widened, ground.whole, found.residual[None, :])
    shares = probabilities(widened, evidences)[:, 0]
    result = {name: float(shares[[name in one.members for one in widened]].sum()) for name in ground.candidates}
    return {"": float(shares[0]), **result}


def _widened(candidate: Candidate, table: Table, factor: float) -> Table:
    weights = table.weights.copy()
    for index, law in enumerate(candidate.laws):
        of_form = table.form == index
        for i, free in enumerate(law.form.free):
            z = table.z[of_form, i]
            wider = np.exp(-0.5 * (z / factor) ** 2) / (factor * _inside(free.prior, factor))
            weights[of_form] *= wider / (np.exp(-0.5 * z**2) / _inside(free.prior, 1.0))
    return replace(table, weights=weights)


def _inside(prior: Quantity, factor: float) -> float:
    """Share of a normal distribution of that standard deviation within the prior's bounds."""
    from scipy.special import ndtr

    low, high = (float(prior.standard(bound)) / factor for bound in (prior.lower, prior.upper))
    return float(ndtr(high) - ndtr(low))
