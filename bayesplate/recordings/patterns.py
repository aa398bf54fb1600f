"""Evidence of residues between known places for labels: their signs and sizes against those of computed mode shapes."""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.recordings.plausibility import weighted_median

SHAPE_ERROR = 0.05
"""Error of a computed residue over the largest that the shape gives: modes mix, and places are read off by hand."""
_GAIN_SD = 0.3
"""Standard deviation of the logarithm of the gain from one mode to the next."""
_LEAST_EVIDENCE = -8.0
"""Limit of ln of the evidence for or against a label: places may be written down wrongly."""
_N_GAINS = 41


def residue_evidence(
    measured: Floats, measured_sd: Floats, predicted: Floats, largest: Floats, probability: Floats
) -> tuple[Floats, float]:
    """ln of the evidence of the residues for each label of each peak, (n_peaks, n_modes), and for the same polarity.

    Measured, (n_peaks, n_places), are residues of the mobility in the units of the recordings; predicted, (n_modes,
    n_places) in 1/kg, those of the computed modes, and `largest` the largest that each shape gives between any two
    places. The common gain comes from `probability`, (n_peaks, n_modes), of each mode by its frequency. The evidence
    is zero on the average over the modes that a peak may be. With a single pair of places, sizes count and signs do
    not: the odds of the polarity are then 1.
    """
    if measured.shape[1] == 1:
        log_likelihood = _log_likelihood(np.abs(measured), measured_sd, np.abs(predicted), largest, probability)
        return _relative_evidence(log_likelihood, probability), 0.0
    same, opposite = (
        _log_likelihood(sign * measured, measured_sd, predicted, largest, probability) for sign in (1.0, -1.0)
    )
    log_polarity = float(np.sum(_sum_over_modes(same, probability) - _sum_over_modes(opposite, probability)))
    return _relative_evidence(same if log_polarity >= 0.0 else opposite, probability), log_polarity


def sign_odds(signs: Floats, predicted: Floats, largest: Floats, probability: Floats) -> float:
    """ln of the odds that force and response have the same polarity, from the signs between two places.

    The signs are +1 or -1, 0 if not known: (n_peaks,); the other parameters are those of `residue_evidence`.
    """
    from scipy.special import ndtr

    positive = np.clip(ndtr(predicted / (SHAPE_ERROR * largest)), 0.02, 0.98)
    mode_share = probability.sum(axis=1)
    plus = probability @ positive + 0.5 * (1.0 - mode_share)
    same, opposite = np.where(signs > 0, plus, 1.0 - plus), np.where(signs > 0, 1.0 - plus, plus)
    return float(np.sum(np.where(signs == 0, 0.0, np.log(same / opposite))))


def _log_likelihood(
    measured: Floats, measured_sd: Floats, predicted: Floats, largest: Floats, probability: Floats
) -> Floats:
    """ln of the density of each peak's residues under each mode, over all gains: (n_peaks, n_modes) array."""
    from scipy.special import logsumexp

    sizes, shapes = np.linalg.norm(measured, axis=1), np.linalg.norm(predicted, axis=1)
    ratio = np.log(np.maximum(sizes[:, None], 1e-300) / np.maximum(shapes, SHAPE_ERROR * largest))
    weights = probability * np.minimum(shapes / largest, 1.0)
    centre = weighted_median(ratio.ravel(), weights.ravel() + 1e-9)
    z = np.linspace(-2.5, 2.5, _N_GAINS)
    gains = np.exp(centre + _GAIN_SD * z)
    misfit = measured[:, None, None, :] - gains[:, None] * predicted[None, :, None, :]
    sd = np.hypot(measured_sd[:, None, None, :], SHAPE_ERROR * gains[:, None] * largest[None, :, None, None])
    log_density = np.sum(-0.5 * (misfit / sd) ** 2 - np.log(sd), axis=3) - 0.5 * z**2
    return np.asarray(logsumexp(log_density, axis=2))


def _sum_over_modes(log_likelihood: Floats, probability: Floats) -> Floats:
    from scipy.special import logsumexp

    return np.asarray(
        logsumexp(
            np.maximum(log_likelihood, log_likelihood.max(axis=1, keepdims=True) + _LEAST_EVIDENCE),
            axis=1,
            b=probability + 1e-6,
        )
    )


def _relative_evidence(log_likelihood: Floats, probability: Floats) -> Floats:
    """Log likelihoods less their average over the modes that a peak may be."""
    mean = _sum_over_modes(log_likelihood, probability) - np.log(np.sum(probability + 1e-6, axis=1))
    return np.clip(log_likelihood - mean[:, None], _LEAST_EVIDENCE, -_LEAST_EVIDENCE)
