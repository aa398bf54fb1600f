"""Expected gain of readings: shrinkage of the constants' intervals, and of the entropy of the explanations.

Within a term everything is linear and normal: the gain of the constants does not depend on the values that will be
read, and half the log determinant of the information gained is exact. Between terms and explanations the gain does
depend on these values. There readings are drawn from the present beliefs, and the beliefs after each of them follow in
closed form (nested sampling); the mean has a standard error.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.material import MODULI
from bayesplate.diagnosis.terms import log_sum, normalised_weights
from bayesplate.planning.beliefs import Beliefs, ExplanationTerms, entropy
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
"""Least draws of one explanation, however improbable."""


@dataclass(frozen=True, eq=False)
class PlannedReadings:
    """Readings that could be taken, linear in u under each explanation."""

    # one (n_terms, n) array per explanation: the expected readings where u is zero, up to a number common to all
    shift: tuple[Floats, ...]
    slopes: tuple[Floats, ...]  # (n_terms, n, n_u) arrays
    variance: tuple[Floats, ...]  # (n_terms, n) arrays: of the noise

    @classmethod
    def of(cls, by_explanation: Iterable[tuple[Floats, Floats, Floats]]) -> PlannedReadings:
        """From shift, slopes and variance under each explanation."""
        return cls(*zip(*by_explanation, strict=True))

    @property
    def n(self) -> int:
        return int(self.shift[0].shape[1])

    def select(self, rows: Sequence[int]) -> PlannedReadings:
        """The readings with some indices."""
        fields = (self.shift, self.slopes, self.variance)
        return PlannedReadings(*(tuple(values[:, list(rows)] for values in arrays) for arrays in fields))


def join_readings(reading_sets: Sequence[PlannedReadings]) -> PlannedReadings:
    """Several sets of readings as one."""
    fields = zip(*((readings.shift, readings.slopes, readings.variance) for readings in reading_sets), strict=True)
    return PlannedReadings(
        *(tuple(np.concatenate(arrays, axis=1) for arrays in zip(*sets, strict=True)) for sets in fields)
    )


def expected_gain(
    beliefs: Beliefs,
    readings: PlannedReadings,
    rng: np.random.Generator,
    goal: str | None = None,
    minutes: float = 1.0,
    n_draws: int = N_DRAWS,
) -> Gain:
    """The expected gain of some readings.

    The score counts the goal, one of `GOALS`. By default it is the drop of the explanations' entropy plus the mean
    logarithmic shrinkage of the shared parameters of the boards, or of the constants where they share none.
    """
    updates = [
        _Update.of(explanation, readings, k, beliefs.counted_targets)
        for k, explanation in enumerate(beliefs.explanations)
    ]
    weights = beliefs.probabilities
    doubt, between_terms = _simulate_readings(beliefs, updates, rng, n_draws)
    shares = np.concatenate(
        [np.full(terms.n_terms, terms.probability / terms.n_terms) for terms in beliefs.explanations]
    )
    variance_now = _variance_between_terms(
        shares[:, None], np.concatenate([update.target_means for update in updates])[:, None]
    )[0]
    variance_before = variance_now + sum(
        p * update.before.mean(axis=0) for p, update in zip(weights, updates, strict=True)
    )
    within_terms = _StratifiedMean.of_strata([update.after for update in updates], weights)
    variance_after = within_terms.mean + between_terms.mean
    log_ratios = 0.5 * np.log(np.minimum(variance_after / variance_before, 1.0))
    shared_logs, moduli_logs = np.split(log_ratios, [len(beliefs.shared)])
    moduli_logs = moduli_logs.reshape(-1, len(MODULI)).mean(axis=0)
    entropy_drop = beliefs.entropy - float(doubt.mean[0])
    is_in_doubt = len(beliefs.explanations) > 1
    worth = {name: -float(log_ratio) for name, log_ratio in zip(MODULI, moduli_logs, strict=True)}
    worth |= {CONSTANTS: -float(moduli_logs.mean()), EXPLANATIONS: entropy_drop}
    shrinkage = -float(shared_logs.mean()) if beliefs.shared else worth[CONSTANTS]
    score = max(entropy_drop, 0.0) + shrinkage if goal is None else worth[goal]
    return Gain(
        **{name: float(np.exp(log_ratio)) for name, log_ratio in zip(MODULI, moduli_logs, strict=True)},
        constants=worth[CONSTANTS],
        constants_error=float(
            (0.5 * np.hypot(within_terms.error, between_terms.error) / variance_after)[len(shared_logs) :].mean()
        ),
        explanations=entropy_drop if is_in_doubt else None,
        explanations_error=float(doubt.error[0]) if is_in_doubt else None,
        information=sum(p * float(update.information.mean()) for p, update in zip(weights, updates, strict=True)),
        shared={name: float(np.exp(log_ratio)) for name, log_ratio in zip(beliefs.shared, shared_logs, strict=True)},
        score=score,
        score_per_minute=score / minutes,
    )


def probabilities_after(beliefs: Beliefs, readings: PlannedReadings, values: Floats) -> Floats:
    """Probability of each explanation after some readings: (n_explanations, n_draws) array from (n_draws, n)."""
    updates = [
        _Update.of(explanation, readings, k, beliefs.counted_targets)
        for k, explanation in enumerate(beliefs.explanations)
    ]
    return _explanation_probabilities(_log_joint(beliefs, updates, values))


@dataclass(frozen=True, eq=False)
class _StratifiedMean:
    """A mean over several strata and its standard error: (n,) arrays."""

    mean: Floats
    error: Floats

    @classmethod
    def of_strata(cls, values: Sequence[Floats], weights: Floats) -> _StratifiedMean:
        """From one (n_draws, n) array per stratum; a single draw has no error."""
        mean = sum(p * draws.mean(axis=0) for p, draws in zip(weights, values, strict=True))
        pairs = ((p, draws) for p, draws in zip(weights, values, strict=True) if len(draws) > 1)
        variance = sum(p**2 * draws.var(axis=0, ddof=1) / len(draws) for p, draws in pairs)
        return cls(np.asarray(mean), np.sqrt(np.broadcast_to(variance, np.shape(mean))))


@dataclass(frozen=True, eq=False)
class _Update:
    """The change of each term of an explanation by readings."""

    expected: Floats  # (n_terms, n) array: of the readings
    # factor, whitening: (n_terms, n, n) array: L with their covariance L L', and its inverse
    factor: Floats
    whitening: Floats
    log_size: Floats  # (n_terms,) array: ln of the determinant of L
    regression: Floats  # (n_terms, n_targets, n) array: from whitened misses to changes of the target quantities
    # target_means, before, after: (n_terms, n_targets) array: means of the target quantities, their variances before
    # and after
    target_means: Floats
    before: Floats
    after: Floats
    information: Floats

    @classmethod
    def of(
        cls, explanation: ExplanationTerms, readings: PlannedReadings, k: int, counted_targets: Sequence[int]
    ) -> _Update:
        slopes, variance = readings.slopes[k], readings.variance[k]
        expected = readings.shift[k] + np.einsum("tnu,tu->tn", slopes, explanation.mean)
        cross_covariance = slopes @ explanation.covariance
        covariance = cross_covariance @ np.swapaxes(slopes, 1, 2) + variance[:, :, None] * np.eye(readings.n)
        factor = np.asarray(np.linalg.cholesky(covariance))
        whitening = np.asarray(np.linalg.inv(factor))
        regression: Floats = (
            explanation.target_slopes @ np.swapaxes(cross_covariance, 1, 2) @ np.swapaxes(whitening, 1, 2)
        )
        before = explanation.target_slopes @ explanation.covariance @ np.swapaxes(explanation.target_slopes, 1, 2)
        after = before - regression @ np.swapaxes(regression, 1, 2)
        rows, columns = np.ix_(counted_targets, counted_targets)
        information = np.asarray(
            0.5 * (np.linalg.slogdet(before[:, rows, columns])[1] - np.linalg.slogdet(after[:, rows, columns])[1])
        )
        sizes, var_before, var_after = (np.diagonal(matrix, axis1=1, axis2=2) for matrix in (factor, before, after))
        log_size = np.log(sizes).sum(axis=1)
        return cls(
            expected, factor, whitening, log_size, regression, explanation.expected, var_before, var_after, information
        )

    def draw_readings(self, rng: np.random.Generator, n_draws: int) -> Floats:
        """Draws of the readings if the explanation holds: (n_draws, n) array, from its terms in turn."""
        terms = np.arange(n_draws) * len(self.expected) // n_draws
        noise = rng.standard_normal((n_draws, self.expected.shape[1]))
        return np.asarray(self.expected[terms] + np.einsum("dij,dj->di", self.factor[terms], noise))

    def misses(self, observed: Floats) -> Floats:
        """Whitened readings less the expected ones: (n_terms, n_draws, n) array."""
        return np.asarray((observed - self.expected[:, None, :]) @ np.swapaxes(self.whitening, 1, 2))


def _simulate_readings(
    beliefs: Beliefs, updates: Sequence[_Update], rng: np.random.Generator, n_draws: int
) -> tuple[_StratifiedMean, _StratifiedMean]:
    """Means after simulated readings: entropy of the explanations, nats, and variance between terms."""
    weights = beliefs.probabilities
    counts = [max(round(n_draws * p), _FEWEST_DRAWS) for p in weights]
    observed = np.concatenate([update.draw_readings(rng, n) for update, n in zip(updates, counts, strict=True)])
    logs = _log_joint(beliefs, updates, observed)
    means = [
        update.target_means[:, None, :] + update.misses(observed) @ np.swapaxes(update.regression, 1, 2)
        for update in updates
    ]
    between = _variance_between_terms(normalised_weights(np.concatenate(logs)), np.concatenate(means))
    ends = np.cumsum(counts)[:-1]
    doubt, spread = (np.split(values, ends) for values in (entropy(_explanation_probabilities(logs))[:, None], between))
    return _StratifiedMean.of_strata(doubt, weights), _StratifiedMean.of_strata(spread, weights)


def _variance_between_terms(shares: Floats, means: Floats) -> Floats:
    """Variance between terms: (n_draws, n) array from (n_terms, n_draws) and (n_terms, n_draws, n)."""
    middle = np.einsum("td,tdn->dn", shares, means)
    return np.asarray(np.einsum("td,tdn->dn", shares, (means - middle) ** 2))


def _log_joint(beliefs: Beliefs, updates: Sequence[_Update], observed: Floats) -> list[Floats]:
    """ln of weight times density of readings in each term: one (n_terms, n_draws) array per explanation."""
    return [
        float(np.log(p / len(update.expected)))
        - 0.5 * (update.misses(observed) ** 2).sum(axis=2)
        - update.log_size[:, None]
        for p, update in zip(beliefs.probabilities, updates, strict=True)
    ]


def _explanation_probabilities(logs: Sequence[Floats]) -> Floats:
    """Probability of each explanation: (n_explanations, n_draws) array."""
    return normalised_weights(np.stack([log_sum(log) for log in logs]))
