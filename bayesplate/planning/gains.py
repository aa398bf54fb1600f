"""What readings are expected to give: shrinkage of the constants' intervals, and of the doubt between explanations.

Within a term everything is linear and normal: what the constants gain does not depend on what will be read, and half
the log determinant of the information gained is exact. Between terms and explanations it does depend on it. There
readings are drawn from what is believed now, and what would be believed after each of them is worked out in closed form
(nested sampling); the mean has a standard error.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.material import MODULI
from bayesplate.diagnosis.terms import log_sum, normalised
from bayesplate.planning.beliefs import Belief, Beliefs, entropy
from bayesplate.planning.plan import Gain

REFERENCES = (
    "D. V. Lindley: On a measure of the information provided by an experiment. Ann. Math. Stat. 27, 986-1005 (1956), "
    "doi:10.1214/aoms/1177728069. [expected gain of information]",
    "K. J. Ryan: Estimating expected information gains for experimental designs with application to the random "
    "fatigue-limit model. J. Comput. Graph. Stat. 12, 585-603 (2003), doi:10.1198/1061860032012. [nested sampling]",
)
CONSTANTS, EXPLANATIONS = "constants", "explanations"
GOALS = (*MODULI, CONSTANTS, EXPLANATIONS)
N_DRAWS = 384
_FEWEST_DRAWS = 32
"""Of one explanation, however improbable."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Readings that could be taken, linear in u under each explanation."""

    # one (n_terms, n) array per explanation: what is read where u is zero, less the same number under all
    shift: tuple[Floats, ...]
    slopes: tuple[Floats, ...]  # (n_terms, n, n_u) arrays
    variance: tuple[Floats, ...]  # (n_terms, n) arrays: of the noise

    @classmethod
    def of(cls, every: Iterable[tuple[Floats, Floats, Floats]]) -> Readings:
        """From shift, slopes and variance under each explanation."""
        return cls(*zip(*every, strict=True))

    @property
    def n(self) -> int:
        return int(self.shift[0].shape[1])

    def some(self, rows: Sequence[int]) -> Readings:
        """Some of them, by their indices."""
        parts = (self.shift, self.slopes, self.variance)
        return Readings(*(tuple(one[:, list(rows)] for one in part) for part in parts))


def together(every: Sequence[Readings]) -> Readings:
    """Several sets of readings as one."""
    parts = zip(*((one.shift, one.slopes, one.variance) for one in every), strict=True)
    return Readings(*(tuple(np.concatenate(of_one, axis=1) for of_one in zip(*part, strict=True)) for part in parts))


def expected_gain(
    beliefs: Beliefs,
    readings: Readings,
    rng: np.random.Generator,
    goal: str | None = None,
    minutes: float = 1.0,
    n_draws: int = N_DRAWS,
) -> Gain:
    """What some readings are expected to give.

    The score counts the goal, one of `GOALS`; by default the drop of the explanations' entropy and the mean shrinkage,
    both logarithms, of what the boards share, or of the constants where they share nothing.
    """
    updates = [_Update.of(one, readings, k, beliefs.free) for k, one in enumerate(beliefs.explanations)]
    weights = beliefs.probabilities
    doubt, between = _simulated(beliefs, updates, rng, n_draws)
    shares = np.concatenate([np.full(one.n_terms, one.probability / one.n_terms) for one in beliefs.explanations])
    now = _between(shares[:, None], np.concatenate([one.wanted for one in updates])[:, None])[0]
    before = now + sum(p * one.before.mean(axis=0) for p, one in zip(weights, updates, strict=True))
    within = _Mean.of_strata([one.after for one in updates], weights)
    after = within.mean + between.mean
    log_left = 0.5 * np.log(np.minimum(after / before, 1.0))
    of_shared, of_moduli = np.split(log_left, [len(beliefs.shared)])
    of_moduli = of_moduli.reshape(-1, len(MODULI)).mean(axis=0)
    dropped = beliefs.entropy - float(doubt.mean[0])
    is_in_doubt = len(beliefs.explanations) > 1
    worth = {name: -float(one) for name, one in zip(MODULI, of_moduli, strict=True)}
    worth |= {CONSTANTS: -float(of_moduli.mean()), EXPLANATIONS: dropped}
    narrowed = -float(of_shared.mean()) if beliefs.shared else worth[CONSTANTS]
    score = max(dropped, 0.0) + narrowed if goal is None else worth[goal]
    return Gain(
        **{name: float(np.exp(one)) for name, one in zip(MODULI, of_moduli, strict=True)},
        constants=worth[CONSTANTS],
        constants_error=float((0.5 * np.hypot(within.error, between.error) / after)[len(of_shared) :].mean()),
        explanations=dropped if is_in_doubt else None,
        explanations_error=float(doubt.error[0]) if is_in_doubt else None,
        information=sum(p * float(one.information.mean()) for p, one in zip(weights, updates, strict=True)),
        shared={name: float(np.exp(one)) for name, one in zip(beliefs.shared, of_shared, strict=True)},
        score=score,
        score_per_minute=score / minutes,
    )


def probabilities_after(beliefs: Beliefs, readings: Readings, read: Floats) -> Floats:
    """Probability of each explanation after some readings: (n_explanations, n_draws) array from (n_draws, n)."""
    updates = [_Update.of(one, readings, k, beliefs.free) for k, one in enumerate(beliefs.explanations)]
    return _of_each(_log_joint(beliefs, updates, read))


@dataclass(frozen=True, eq=False)
class _Mean:
    """A mean over several strata and its standard error: (n,) arrays."""

    mean: Floats
    error: Floats

    @classmethod
    def of_strata(cls, values: Sequence[Floats], weights: Floats) -> _Mean:
        """From one (n_draws, n) array per stratum; a single draw has no error."""
        mean = sum(p * one.mean(axis=0) for p, one in zip(weights, values, strict=True))
        many = ((p, one) for p, one in zip(weights, values, strict=True) if len(one) > 1)
        variance = sum(p**2 * one.var(axis=0, ddof=1) / len(one) for p, one in many)
        return cls(np.asarray(mean), np.sqrt(np.broadcast_to(variance, np.shape(mean))))


@dataclass(frozen=True, eq=False)
class _Update:
    """What readings do to each term of an explanation."""

    expected: Floats  # (n_terms, n) array: of the readings
    # factor, whitening: (n_terms, n, n) array: L with their covariance L L', and its inverse
    factor: Floats
    whitening: Floats
    log_size: Floats  # (n_terms,) array: ln of the determinant of L
    pull: Floats  # (n_terms, n_wanted, n) array: takes whitened misses to what the wanted numbers change by
    # wanted, before, after: (n_terms, n_wanted) array: their means, and their variances before and after
    wanted: Floats
    before: Floats
    after: Floats
    information: Floats

    @classmethod
    def of(cls, one: Belief, readings: Readings, k: int, free: Sequence[int]) -> _Update:
        slopes, variance = readings.slopes[k], readings.variance[k]
        expected = readings.shift[k] + np.einsum("tnu,tu->tn", slopes, one.mean)
        along = slopes @ one.covariance
        covariance = along @ np.swapaxes(slopes, 1, 2) + variance[:, :, None] * np.eye(readings.n)
        factor = np.asarray(np.linalg.cholesky(covariance))
        whitening = np.asarray(np.linalg.inv(factor))
        pull: Floats = one.wanted @ np.swapaxes(along, 1, 2) @ np.swapaxes(whitening, 1, 2)
        before = one.wanted @ one.covariance @ np.swapaxes(one.wanted, 1, 2)
        after = before - pull @ np.swapaxes(pull, 1, 2)
        rows, columns = np.ix_(free, free)
        information = np.asarray(
            0.5 * (np.linalg.slogdet(before[:, rows, columns])[1] - np.linalg.slogdet(after[:, rows, columns])[1])
        )
        sizes, then, later = (np.diagonal(each, axis1=1, axis2=2) for each in (factor, before, after))
        log_size = np.log(sizes).sum(axis=1)
        return cls(expected, factor, whitening, log_size, pull, one.expected, then, later, information)

    def drawn(self, rng: np.random.Generator, n_draws: int) -> Floats:
        """What may be read if the explanation holds: (n_draws, n) array, from its terms in turn."""
        terms = np.arange(n_draws) * len(self.expected) // n_draws
        noise = rng.standard_normal((n_draws, self.expected.shape[1]))
        return np.asarray(self.expected[terms] + np.einsum("dij,dj->di", self.factor[terms], noise))

    def misses(self, read: Floats) -> Floats:
        """Whitened readings less what is expected: (n_terms, n_draws, n) array."""
        return np.asarray((read - self.expected[:, None, :]) @ np.swapaxes(self.whitening, 1, 2))


def _simulated(
    beliefs: Beliefs, updates: Sequence[_Update], rng: np.random.Generator, n_draws: int
) -> tuple[_Mean, _Mean]:
    """What is left after readings: the entropy of the explanations, nats, and the variance between terms."""
    weights = beliefs.probabilities
    counts = [max(round(n_draws * p), _FEWEST_DRAWS) for p in weights]
    read = np.concatenate([one.drawn(rng, n) for one, n in zip(updates, counts, strict=True)])
    logs = _log_joint(beliefs, updates, read)
    means = [one.wanted[:, None, :] + one.misses(read) @ np.swapaxes(one.pull, 1, 2) for one in updates]
    between = _between(normalised(np.concatenate(logs)), np.concatenate(means))
    ends = np.cumsum(counts)[:-1]
    doubt, apart = (np.split(each, ends) for each in (entropy(_of_each(logs))[:, None], between))
    return _Mean.of_strata(doubt, weights), _Mean.of_strata(apart, weights)


def _between(shares: Floats, means: Floats) -> Floats:
    """Variance between terms: (n_draws, n) array from (n_terms, n_draws) and (n_terms, n_draws, n)."""
    middle = np.einsum("td,tdn->dn", shares, means)
    return np.asarray(np.einsum("td,tdn->dn", shares, (means - middle) ** 2))


def _log_joint(beliefs: Beliefs, updates: Sequence[_Update], read: Floats) -> list[Floats]:
    """ln of weight times density of readings in each term: one (n_terms, n_draws) array per explanation."""
    return [
        float(np.log(p / len(one.expected))) - 0.5 * (one.misses(read) ** 2).sum(axis=2) - one.log_size[:, None]
        for p, one in zip(beliefs.probabilities, updates, strict=True)
    ]


def _of_each(logs: Sequence[Floats]) -> Floats:
    """Probability of each explanation: (n_explanations, n_draws) array."""
    return normalised(np.stack([log_sum(log) for log in logs]))
