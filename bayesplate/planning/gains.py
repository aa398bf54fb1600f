"""What readings are expected to give: shrinkage of the constants' intervals, and of the doubt between explanations.

Within a term everything is linear and normal: what the constants gain does not depend on what will be read, and half
the log determinant of the information gained is exact. Between terms and explanations it does depend on it. There
readings are drawn from what is believed now, and what would be believed after each of them is worked out in closed form
(nested sampling); the mean has a standard error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI
from bayesplate.diagnosis.evidence.terms import log_sum, normalised
from bayesplate.planning.beliefs import Beliefs, Explanation

Floats = NDArray[np.float64]

REFERENCES = (
    "D. V. Lindley: On a measure of the information provided by an experiment. Ann. Math. Stat. 27, 986-1005 (1956), "
    "doi:10.1214/aoms/1177728069. [expected gain of information]",
    "K. J. Ryan: Estimating expected information gains for experimental designs with application to the random "
    "fatigue-limit model. J. Comput. Graph. Stat. 12, 585-603 (2003), doi:10.1198/1061860032012. [nested sampling]",
)
N_DRAWS = 384
_FEWEST_DRAWS = 32
"""Of one explanation, however improbable."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Readings that could be taken, linear in u under each explanation.

    Attributes
    ----------
    shift : tuple of (n_terms, n) array
        One per explanation: what is read where u is zero, less the same number under all.
    slopes : tuple of (n_terms, n, n_u) array
    variance : tuple of (n_terms, n) array
        Of the noise.
    """

    shift: tuple[Floats, ...]
    slopes: tuple[Floats, ...]
    variance: tuple[Floats, ...]

    @property
    def n(self) -> int:
        """Number of readings."""
        return int(self.shift[0].shape[1])

    def some(self, rows: Sequence[int]) -> Readings:
        """Some of them, by their indices."""
        kept = list(rows)
        return Readings(
            tuple(one[:, kept] for one in self.shift),
            tuple(one[:, kept] for one in self.slopes),
            tuple(one[:, kept] for one in self.variance),
        )


def together(every: Sequence[Readings]) -> Readings:
    """Several sets of readings as one."""
    return Readings(
        tuple(np.concatenate(parts, axis=1) for parts in zip(*(one.shift for one in every), strict=True)),
        tuple(np.concatenate(parts, axis=1) for parts in zip(*(one.slopes for one in every), strict=True)),
        tuple(np.concatenate(parts, axis=1) for parts in zip(*(one.variance for one in every), strict=True)),
    )


@dataclass(frozen=True)
class Gain:
    """What readings are expected to give.

    Attributes
    ----------
    E_x, E_y, G_xy : float
        Expected standard deviation of ln of the modulus after, over that before.
    explanations : float
        Expected drop of the entropy of the surviving explanations, nats.
    explanations_error : float
        Its standard error.
    constants_error : float
        Standard error of the mean shrinkage of the three intervals, ln.
    information : float
        Half the log determinant of what the moduli gain where the explanation is known, nats; of an isotropic board
        of what E gains.
    """

    E_x: float
    E_y: float
    G_xy: float
    explanations: float
    explanations_error: float
    constants_error: float
    information: float

    def shrinkage(self, name: str) -> float:
        """ln of the standard deviation of a modulus before over that after."""
        return float(-np.log(getattr(self, name)))

    @property
    def constants(self) -> float:
        """Mean over the three moduli of that."""
        return float(np.mean([self.shrinkage(name) for name in MODULI]))


def expected_gain(beliefs: Beliefs, readings: Readings, rng: np.random.Generator, n_draws: int = N_DRAWS) -> Gain:
    """What some readings are expected to give.

    Parameters
    ----------
    beliefs : Beliefs
    readings : Readings
    rng : numpy.random.Generator
    n_draws : int
        Of what may be read.

    Returns
    -------
    Gain
    """
    updates = [_Update.of(one, readings, k, beliefs.board.symmetry.n) for k, one in enumerate(beliefs.explanations)]
    weights = beliefs.probabilities
    within = sum(p * one.after_variance.mean(axis=0) for p, one in zip(weights, updates, strict=True))
    of_terms = sum(p**2 * _variance_of_mean(one.after_variance) for p, one in zip(weights, updates, strict=True))
    before = _spread(beliefs)
    doubt, between = _simulated(beliefs, updates, rng, n_draws)
    after = within + between.mean
    ratios = np.sqrt(np.minimum(after / before, 1.0))
    error = float(np.mean(0.5 * np.sqrt(of_terms + between.error**2) / after))
    information = sum(p * float(one.information.mean()) for p, one in zip(weights, updates, strict=True))
    E_x, E_y, G_xy = (float(one) for one in ratios)
    dropped = beliefs.entropy - float(doubt.mean[0])
    return Gain(E_x, E_y, G_xy, dropped, float(doubt.error[0]), error, information)


def _variance_of_mean(values: Floats) -> Floats:
    """Squared standard error of the mean over the first axis; zero of a single one."""
    return np.asarray(values.var(axis=0, ddof=1) / len(values) if len(values) > 1 else np.zeros(values.shape[1:]))


def _spread(beliefs: Beliefs) -> Floats:
    """Variance of ln E_x, E_y, G_xy over all explanations now: (3,) array."""
    means = np.concatenate([one.expected for one in beliefs.explanations])
    shares = np.concatenate([np.full(one.n_terms, one.probability / one.n_terms) for one in beliefs.explanations])
    own = [
        one.probability * np.einsum("tmu,tuv,tmv->tm", one.to_moduli, one.covariance, one.to_moduli).mean(axis=0)
        for one in beliefs.explanations
    ]
    middle = shares @ means
    return np.asarray(np.sum(own, axis=0) + shares @ (means - middle) ** 2)


@dataclass(frozen=True, eq=False)
class _Update:
    """What readings do to each term of an explanation.

    Attributes
    ----------
    expected : (n_terms, n) array
        Of the readings.
    factor, whitening : (n_terms, n, n) array
        L with their covariance L L', and its inverse.
    log_size : (n_terms,) array
        ln of the determinant of L.
    pull : (n_terms, 3, n) array
        Takes whitened misses to what ln of the moduli change by.
    moduli : (n_terms, 3) array
    after_variance : (n_terms, 3) array
    information : (n_terms,) array
    """

    expected: Floats
    factor: Floats
    whitening: Floats
    log_size: Floats
    pull: Floats
    moduli: Floats
    after_variance: Floats
    information: Floats

    @classmethod
    def of(cls, one: Explanation, readings: Readings, k: int, n_free: int) -> _Update:
        slopes, variance = readings.slopes[k], readings.variance[k]
        n = variance.shape[1]
        expected = readings.shift[k] + np.einsum("tnu,tu->tn", slopes, one.mean)
        along = slopes @ one.covariance
        covariance = along @ np.swapaxes(slopes, 1, 2)
        covariance[:, np.arange(n), np.arange(n)] += variance
        factor = np.asarray(np.linalg.cholesky(covariance))
        whitening = np.asarray(np.linalg.inv(factor))
        pull: Floats = one.to_moduli @ np.swapaxes(along, 1, 2) @ np.swapaxes(whitening, 1, 2)
        before = one.to_moduli @ one.covariance @ np.swapaxes(one.to_moduli, 1, 2)
        after = before - pull @ np.swapaxes(pull, 1, 2)
        first = (..., slice(n_free), slice(n_free))  # of an isotropic board the other moduli follow from E_x
        information = np.asarray(0.5 * (np.linalg.slogdet(before[first])[1] - np.linalg.slogdet(after[first])[1]))
        log_size = np.asarray(np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1))
        variances = np.asarray(np.diagonal(after, axis1=1, axis2=2))
        return cls(expected, factor, whitening, log_size, pull, one.expected, variances, information)

    def drawn(self, rng: np.random.Generator, n_draws: int) -> Floats:
        """What may be read if the explanation holds: (n_draws, n) array, from its terms in turn."""
        terms = np.arange(n_draws) * len(self.expected) // n_draws
        noise = rng.standard_normal((n_draws, self.expected.shape[1]))
        return np.asarray(self.expected[terms] + np.einsum("dij,dj->di", self.factor[terms], noise))

    def misses(self, read: Floats) -> Floats:
        """Whitened readings less what is expected: (n_terms, n_draws, n) array."""
        return np.asarray((read - self.expected[:, None, :]) @ np.swapaxes(self.whitening, 1, 2))


@dataclass(frozen=True, eq=False)
class _Mean:
    """A mean over simulated readings and its standard error: (n,) arrays."""

    mean: Floats
    error: Floats

    @classmethod
    def of_strata(cls, values: Floats, strata: Sequence[NDArray[np.intp]], weights: Floats) -> _Mean:
        """Of (n_draws, n) values, so many of them drawn under each explanation."""
        means = [values[rows].mean(axis=0) for rows in strata]
        variances = [_variance_of_mean(values[rows]) for rows in strata]
        mean = np.sum([p * one for p, one in zip(weights, means, strict=True)], axis=0)
        return cls(mean, np.sqrt(np.sum([p**2 * one for p, one in zip(weights, variances, strict=True)], axis=0)))


def _simulated(
    beliefs: Beliefs, updates: Sequence[_Update], rng: np.random.Generator, n_draws: int
) -> tuple[_Mean, _Mean]:
    """What is left after readings: the entropy of the explanations, nats, and the moduli's variance between terms."""
    weights = beliefs.probabilities
    counts = [max(round(n_draws * p), _FEWEST_DRAWS) for p in weights]
    read = np.concatenate([one.drawn(rng, n) for one, n in zip(updates, counts, strict=True)])
    logs = _log_joint(beliefs, updates, read)
    means = [one.moduli[:, None, :] + one.misses(read) @ np.swapaxes(one.pull, 1, 2) for one in updates]
    shares, constants = normalised(np.concatenate(logs)), np.concatenate(means)
    middle = np.einsum("tn,tnm->nm", shares, constants)
    between = np.einsum("tn,tnm->nm", shares, constants**2) - middle**2
    strata = np.split(np.arange(len(read)), np.cumsum(counts)[:-1])
    left = entropy(_of_each(logs))[:, None]
    return _Mean.of_strata(left, strata, weights), _Mean.of_strata(between, strata, weights)


def _log_joint(beliefs: Beliefs, updates: Sequence[_Update], read: Floats) -> list[Floats]:
    """ln of weight times density of readings in each term: one (n_terms, n_draws) array per explanation."""
    return [
        float(np.log(p / len(one.expected))) - 0.5 * (one.misses(read) ** 2).sum(axis=2) - one.log_size[:, None]
        for p, one in zip(beliefs.probabilities, updates, strict=True)
    ]


def _of_each(logs: Sequence[Floats]) -> Floats:
    """Probability of each explanation: (n_explanations, n_draws) array."""
    return normalised(np.stack([log_sum(log) for log in logs]))


def entropy(probabilities: Floats) -> Floats:
    """Of explanations, nats: (n_draws,) array from (n_explanations, n_draws)."""
    from scipy.special import entr

    return np.asarray(entr(probabilities).sum(axis=0))


def probabilities_after(beliefs: Beliefs, readings: Readings, read: Floats) -> Floats:
    """Probability of each explanation after some readings: (n_explanations, n_draws) array from (n_draws, n)."""
    updates = [_Update.of(one, readings, k, beliefs.board.symmetry.n) for k, one in enumerate(beliefs.explanations)]
    return _of_each(_log_joint(beliefs, updates, read))
