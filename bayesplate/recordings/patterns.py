"""What residues between known places say of labels: their signs and sizes against those of the shapes of modes."""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.recordings.plausibility import weighted_median

SHAPE_ERROR = 0.05
"""By how much a computed residue may be off, over the largest that the shape gives: modes mix, places are read off."""
_GAIN_SD = 0.3
"""Of the logarithm of the gain from one mode to the next."""
_LEAST = -8.0
"""ln of the evidence against a label, at most: places may be written down wrongly."""
_N_GAINS = 41


def residue_evidence(
    measured: Floats, measured_sd: Floats, predicted: Floats, largest: Floats, likely: Floats
) -> tuple[Floats, float]:
    """ln of how much the residues speak for each label of each peak, (n_peaks, n_modes), and for the same polarity.

    Measured, (n_peaks, n_places), are residues of the mobility in the units of the recordings; predicted, (n_modes,
    n_places) in 1/kg, those of the computed modes, and `largest` what each shape gives between any two places. From
    `likely`, (n_peaks, n_modes) probabilities by the frequencies, comes the common gain. The evidence is zero on the
    average over the modes that a peak may be. Between two places only, sizes count and signs do not: the odds of the
    polarity are then 1.
    """
    if measured.shape[1] == 1:
        each = _log_likelihood(np.abs(measured), measured_sd, np.abs(predicted), largest, likely)
        return _relative(each, likely), 0.0
    same, opposite = (_log_likelihood(sign * measured, measured_sd, predicted, largest, likely) for sign in (1.0, -1.0))
    log_polarity = float(np.sum(_summed(same, likely) - _summed(opposite, likely)))
    return _relative(same if log_polarity >= 0.0 else opposite, likely), log_polarity


def sign_odds(signs: Floats, predicted: Floats, largest: Floats, likely: Floats) -> float:
    """ln of the odds that force and response have the same polarity, from the signs between two places.

    The signs are +1 or -1, 0 if not known: (n_peaks,); the others as of `residue_evidence`.
    """
    from scipy.special import ndtr

    positive = np.clip(ndtr(predicted / (SHAPE_ERROR * largest)), 0.02, 0.98)
    seen = likely.sum(axis=1)
    plus = likely @ positive + 0.5 * (1.0 - seen)
    same, opposite = np.where(signs > 0, plus, 1.0 - plus), np.where(signs > 0, 1.0 - plus, plus)
    return float(np.sum(np.where(signs == 0, 0.0, np.log(same / opposite))))


def _log_likelihood(
    measured: Floats, measured_sd: Floats, predicted: Floats, largest: Floats, likely: Floats
) -> Floats:
    """ln of the density of each peak's residues under each mode, the gain open: (n_peaks, n_modes) array."""
    from scipy.special import logsumexp

    sizes, shapes = np.linalg.norm(measured, axis=1), np.linalg.norm(predicted, axis=1)
    ratio = np.log(np.maximum(sizes[:, None], 1e-300) / np.maximum(shapes, SHAPE_ERROR * largest))
    weights = likely * np.minimum(shapes / largest, 1.0)
    centre = weighted_median(ratio.ravel(), weights.ravel() + 1e-9)
    z = np.linspace(-2.5, 2.5, _N_GAINS)
    gains = np.exp(centre + _GAIN_SD * z)
    off = measured[:, None, None, :] - gains[:, None] * predicted[None, :, None, :]
    sd = np.hypot(measured_sd[:, None, None, :], SHAPE_ERROR * gains[:, None] * largest[None, :, None, None])
    each = np.sum(-0.5 * (off / sd) ** 2 - np.log(sd), axis=3) - 0.5 * z**2
    return np.asarray(logsumexp(each, axis=2))


def _summed(each: Floats, likely: Floats) -> Floats:
    from scipy.special import logsumexp

    return np.asarray(logsumexp(np.maximum(each, each.max(axis=1, keepdims=True) + _LEAST), axis=1, b=likely + 1e-6))


def _relative(each: Floats, likely: Floats) -> Floats:
    """Log likelihoods less the average of the modes that a peak may be."""
    mean = _summed(each, likely) - np.log(np.sum(likely + 1e-6, axis=1))
    return np.clip(each - mean[:, None], _LEAST, -_LEAST)
