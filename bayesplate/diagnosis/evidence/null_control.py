"""The null control: the same search on readings simulated without any effect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.folds import NEEDED, nested
from bayesplate.diagnosis.evidence.hypotheses import log_evidences, probabilities
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.evidence.terms import Terms, normalised

Floats = NDArray[np.float64]

N_SETS = 500
CLAIM_QUANTILE = 0.05


@dataclass(frozen=True, eq=False)
class NullControl:
    """What the search makes of readings that contain nothing.

    Attributes
    ----------
    gain : (n_sets,) array
        Log of the evidence for the best effect over that for none; the prior shares included.
    ratio : (n_sets,) array or None
        Nested leave-one-out rms after over before; None with too few readings.
    flagged : float
        Share of the sets in which no effect had a probability below one tenth.
    """

    gain: Floats
    ratio: Floats | None
    flagged: float

    def percentile_of_gain(self, gain: float) -> float:
        """Share of null sets whose gain is smaller, percent."""
        return 100.0 * float(np.mean(self.gain < gain))

    @property
    def ratio_to_beat(self) -> float | None:
        """The nested ratio that chance selection stays above in 95 of 100 null sets."""
        return None if self.ratio is None else float(np.quantile(self.ratio, CLAIM_QUANTILE))


def gain(log_evidence: Floats, priors: Floats) -> Floats:
    """Log posterior odds of the best effect against none: (n_sets,) array from (n_hypotheses, n_sets)."""
    total = log_evidence + np.log(priors)[:, None]
    if len(total) == 1:
        return np.full(total.shape[1], -np.inf)
    return np.asarray(total[1:].max(axis=0) - total[0])


def null_control(found: Found, rng: np.random.Generator, n_sets: int = N_SETS) -> NullControl:
    """Simulate readings from the fit without an effect and search each of them.

    Noise levels are drawn from their posterior under that fit, inputs from their priors; the constants need no drawing,
    for the search does not see them.

    Parameters
    ----------
    found : Found
    rng : numpy.random.Generator
    n_sets : int

    Returns
    -------
    NullControl
    """
    ground = found.ground
    residuals = simulate_null(found, rng, n_sets)
    evidences = log_evidences(ground.hypotheses, ground.whole, residuals)
    shares = probabilities(ground.hypotheses, evidences)
    folded = nested(ground, residuals)
    return NullControl(
        gain=gain(evidences, np.array([one.prior for one in ground.hypotheses])),
        ratio=None if folded is None else folded.ratio,
        flagged=float(np.mean(shares[0] < NEEDED)),
    )


def simulate_null(found: Found, rng: np.random.Generator, n_sets: int) -> Floats:
    """Residuals of readings without any effect: (n_sets, n_modes) array, ln f."""
    ground, baseline = found.ground, found.ground.baseline
    bare = ground.hypotheses[0]
    terms = Terms(bare.table, ground.whole, bare.noise)
    log_density = terms.log_densities(found.residual[None, :])[:, 0]
    level = rng.choice(len(log_density), size=n_sets, p=normalised(log_density))
    sd = np.sqrt(bare.noise.sd[level][:, baseline.setup_index] ** 2 + baseline.own_variance)
    inputs = rng.standard_normal((n_sets, baseline.input_slopes.shape[1]))
    return np.asarray(sd * rng.standard_normal(sd.shape) + inputs @ baseline.input_slopes.T)
