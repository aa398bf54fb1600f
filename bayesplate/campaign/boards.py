"""One board of a campaign: its likelihood of the shared parameters, and its posterior given what all boards teach."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.campaign.conditional import ConditionalPosterior
from bayesplate.campaign.evidence import bridge_sampling
from bayesplate.campaign.likelihood import SharedLikelihood, moments
from bayesplate.campaign.normal_likelihood import NormalLikelihood
from bayesplate.campaign.shared import SharedParameter
from bayesplate.diagnosis.terms import log_sum, normalised_weights
from bayesplate.posterior.draws import Draws, named_draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.reweighting import FEWEST_WEIGHTED_DRAWS
from bayesplate.posterior.sampling import Chains, SamplerSettings, sample
from bayesplate.posterior.starts import LogDensity
from bayesplate.posterior.statistics import effective_draws, effective_share, resample
from bayesplate.posterior.surrogate import LawPoints, Surrogate, n_terms, with_surrogate

N_EXACT_DRAWS = 2048
"""Draws of a walk, or moved to other shared parameters, at which the exact law is evaluated."""
_GOOD_SHARE = 0.9
"""Share of the draws on a surrogate that count under the exact law, from which the surrogate is good enough."""
_MOST_WALKS = 3
"""Largest number of walks on surrogates, each fitted to the law at the draws of the walk before."""
_ORDERS_ON_THE_WAY = {3: 6}
"""Orders of a surrogate between the board's own draws and those under other boards: higher orders extrapolate badly."""
_LINE = 19
_SMALLEST_WEIGHT = 1e-300


@dataclass(frozen=True, eq=False)
class Sample:
    """Draws of a board under a density r(z) L(z) of the shared parameters, L being the board's likelihood of them.

    Attributes
    ----------
    theta : (n, n_dim) array
        All columns of the board.
    z : (n, n_shared) array
        Standard coordinates of the shared parameters.
    log_weights : (n,) array
        ln of the weights under which the draws have this density.
    n_independent : float
        Number of independent draws that they are worth, the weights aside.
    log_reference : callable
        ln r.
    log_evidence : float
        ln of the integral of r(z) L(z).
    log_frequencies : tuple of (n, n_modes) array
        ln f (Hz) of all modes, setup by setup, under the law of the board.
    """

    theta: Floats
    z: Floats
    log_weights: Floats
    n_independent: float
    log_reference: LogDensity
    log_evidence: float
    log_frequencies: tuple[Floats, ...]

    @cached_property
    def weights(self) -> Floats:
        """Weights of the draws: (n,) array that sums to 1."""
        return normalised_weights(self.log_weights)

    @property
    def serves(self) -> bool:
        """Whether enough of the draws count, and nearly all: draws on a bad surrogate may miss a part of the
        posterior."""
        enough = self.effective(self.weights) >= FEWEST_WEIGHTED_DRAWS
        return enough and effective_share(self.weights) >= _GOOD_SHARE

    def weights_under(self, log_reference: LogDensity) -> Floats:
        """Weights under which r is another density: (n,) array that sums to 1."""
        return normalised_weights(
            np.log(np.maximum(self.weights, _SMALLEST_WEIGHT)) + self._log_density_ratio(log_reference)
        )

    def log_evidence_under(self, log_reference: LogDensity) -> float:
        """ln of the integral of r(z) L(z) where r is another density."""
        return self.log_evidence + float(
            log_sum(np.log(np.maximum(self.weights, _SMALLEST_WEIGHT)) + self._log_density_ratio(log_reference))
        )

    def effective(self, weights: Floats) -> float:
        """Number of independent draws of equal weight that are worth as much."""
        return effective_draws(weights) * self.n_independent / len(weights)

    def _log_density_ratio(self, log_reference: LogDensity) -> Floats:
        """ln of another r over this one at the draws: (n,) array."""
        with np.errstate(invalid="ignore"):
            change = log_reference(self.z) - self.log_reference(self.z)
        return np.nan_to_num(change, nan=-np.inf, neginf=-np.inf)


@dataclass(frozen=True, eq=False)
class FittedBoard:
    """A board that was fitted alone, the shared effects declared under their own priors."""

    draws: Draws
    shared: tuple[SharedParameter, ...]

    @property
    def inference(self) -> Inference:
        """The fit of the board alone."""
        return self.draws.inference

    @property
    def name(self) -> str:
        """Name of the board."""
        return self.inference.problem.board.name

    @cached_property
    def conditional(self) -> ConditionalPosterior:
        """The board's density, given the shared parameters."""
        return ConditionalPosterior(self.inference.problem.posterior, self.shared)

    def surrogate_conditional(self, surrogate: Surrogate | None) -> ConditionalPosterior:
        """The same density by a surrogate of the board's law, where there is one."""
        if surrogate is None:
            return self.conditional
        return replace(self.conditional, posterior=with_surrogate(self.conditional.posterior, surrogate))

    def log_prior(self, z: Floats) -> Floats:
        """ln of the campaign's prior of the shared parameters: (n,) array."""
        return np.asarray(
            sum((parameter.prior.log_prior(z[:, i]) for i, parameter in enumerate(self.shared)), np.zeros(len(z)))
        )

    @cached_property
    def own_sample(self) -> Sample:
        """Draws of the board's own posterior, under the campaign's prior of the shared parameters.

        They are the draws of its fit. A board in whose fit each setup had a parameter of its own is sampled anew with
        one parameter for all setups.
        """
        flat, convergence = self.draws.flat, self.inference.convergence
        log_frequencies = tuple(
            log_frequency.reshape(len(flat), -1) for log_frequency in self.draws.mode_log_frequencies
        )
        n_independent = min(float(convergence.ess_min), float(len(flat)))
        z, log_weights = self.conditional.z_of(flat), self.conditional.log_reweighting(flat)
        if not self.conditional.is_one_to_one:
            fitted_sample = Sample(flat, z, log_weights, n_independent, self.log_prior, np.nan, log_frequencies)
            return self.sample_anew(self.log_prior, fitted_sample, moments(z, fitted_sample.weights), 0)
        log_evidence = self._log_evidence(self.log_prior, flat, z, normalised_weights(log_weights), 0)
        return Sample(flat, z, log_weights, n_independent, self.log_prior, log_evidence, log_frequencies)

    @property
    def normal_likelihood(self) -> NormalLikelihood:
        """The board's likelihood of the shared parameters, as a normal one."""
        return NormalLikelihood.of_draws(
            self.own_sample.z, self.own_sample.weights, [parameter.prior for parameter in self.shared]
        )

    def likelihood(self, sample: Sample, log_reference: LogDensity) -> SharedLikelihood:
        """The board's likelihood of the shared parameters, from a sample weighted to another density r.

        Draws of a new walk lie away from the board's own, where the polynomial fitted to them is only extrapolated;
        what this board teaches the others rests on its own draws. So both samples are used, half and half: they are
        draws of L times the mean of both densities r, each over its evidence.
        """
        weights = sample.weights_under(log_reference)
        n_effective, log_evidence = sample.effective(weights), sample.log_evidence_under(log_reference)
        own_sample = self.own_sample
        if sample is own_sample:
            return SharedLikelihood.from_draws(sample.z, weights, n_effective, log_reference, log_evidence)

        def log_mixture(z: Floats) -> Floats:
            return np.logaddexp(self.log_prior(z) - own_sample.log_evidence, log_reference(z) - log_evidence) - np.log(
                2.0
            )

        z, both_weights = np.concatenate([own_sample.z, sample.z]), 0.5 * np.concatenate([own_sample.weights, weights])
        n_both = 4.0 / (1.0 / own_sample.effective(own_sample.weights) + 1.0 / n_effective)
        return SharedLikelihood.from_draws(z, both_weights, n_both, log_mixture, 0.0)

    def sample_anew(self, log_reference: LogDensity, before: Sample, aim: tuple[Floats, Floats], seed: int) -> Sample:
        """Sample the board under another density of the shared parameters, and weight the draws by the exact law.

        The surrogate of the board's own fit is poor away from it: while too few draws count by their weights, a new
        surrogate is fitted to the law at the draws, and the walk is repeated on it. The sample `before` is returned
        where no draw is possible under the exact law.

        Parameters
        ----------
        log_reference : callable
            ln r.
        before : Sample
            Gives the regression of the board's own parameters on the shared ones, for the start of the walkers.
        aim : (n_shared,) and (n_shared, n_shared) arrays
            Approximate mean and covariance of the shared parameters.
        """
        own_columns, surrogate = self.conditional.own_columns, self.inference.surrogate
        start = _moved_moments(np.column_stack([before.theta[:, own_columns], before.z]), before.weights, aim)
        samples: list[Sample] = []
        solved_points: list[LawPoints] = []
        for _ in range(1 if surrogate is None else _MOST_WALKS):
            new_sample, points = self._walk(surrogate, log_reference, start, seed)
            solved_points.append(points)
            all_points = LawPoints(*(np.concatenate(parts) for parts in zip(*solved_points, strict=True)))
            if np.isfinite(new_sample.log_weights).any():
                samples.append(new_sample)
            if surrogate is None or (samples and samples[-1].serves):
                break
            if np.isfinite(all_points.log_density).sum() < n_terms(surrogate.columns.size, {}):
                break
            surrogate = Surrogate.fitted(all_points, surrogate.columns, _ORDERS_ON_THE_WAY)
        if not samples:
            return before
        best = max(samples, key=lambda candidate: candidate.effective(candidate.weights))
        log_evidence = self._log_evidence(log_reference, best.theta, best.z, best.weights, seed)
        return replace(best, log_evidence=log_evidence)

    def _walk(
        self, surrogate: Surrogate | None, log_reference: LogDensity, start: tuple[Floats, Floats], seed: int
    ) -> tuple[Sample, LawPoints]:
        """Draws of a walk on a surrogate, weighted by the exact law, and the values of the law at the draws.

        Without a surrogate the walk is on the law itself, and all weights are one.
        """
        conditional, n_own = self.surrogate_conditional(surrogate), self.conditional.own_columns.size
        log_joint = _log_joint_density(conditional, log_reference)

        def log_within(x: Floats) -> Floats:
            if surrogate is None:
                return np.zeros(len(x))
            return surrogate.log_within(self.conditional.theta(x[:, :n_own], x[:, n_own:]))

        names = [f"parameter {i}" for i in range(start[0].size)]
        chains, convergence = sample(lambda x: log_joint(x) + log_within(x), *start, SamplerSettings(seed), names=names)
        pooled_draws, log_prob = chains.pooled, chains.log_prob[:, chains.burn_in :].ravel()
        picked_draws = np.random.default_rng([seed, _LINE]).choice(len(pooled_draws), N_EXACT_DRAWS)
        x = pooled_draws[picked_draws]
        theta, z = self.conditional.theta(x[:, :n_own], x[:, n_own:]), x[:, n_own:]
        log_frequencies = tuple(self.conditional.posterior.mode_log_frequencies(theta))
        log_likelihood = self.conditional.posterior.log_likelihood_of(log_frequencies, theta).sum(axis=1)
        log_weights = log_likelihood - conditional.posterior.log_likelihood(theta).sum(axis=1) - log_within(x)
        log_weights = np.nan_to_num(log_weights, nan=-np.inf, neginf=-np.inf)
        n_independent = min(float(convergence.ess_min), float(N_EXACT_DRAWS))
        new_sample = Sample(theta, z, log_weights, n_independent, log_reference, np.nan, log_frequencies)
        return new_sample, LawPoints(
            theta, np.concatenate(log_frequencies, axis=1), log_prob[picked_draws] + log_weights
        )

    def moved(self, sample: Sample, log_density: LogDensity, z: Floats, rng: np.random.Generator) -> Sample:
        """Draws of a sample moved to other shared parameters, the board's own ones moved by linear regression.

        A draw has no weight where the model lacks a mode that was read.

        Parameters
        ----------
        log_density : callable
            ln of the density of the other shared parameters.
        z : (n, n_shared) array
            Their standard coordinates.
        """
        own_columns = self.conditional.own_columns
        _, covariance = moments(np.column_stack([sample.theta[:, own_columns], sample.z]), sample.weights)
        slopes = _regression_slopes(covariance, z.shape[1])[: own_columns.size]
        picked_draws = rng.permutation(resample(sample.weights, len(z), rng))
        theta = self.conditional.theta(
            sample.theta[picked_draws][:, own_columns] + (z - sample.z[picked_draws]) @ slopes.T, z
        )
        posterior = self.conditional.posterior
        log_frequencies = tuple(posterior.mode_log_frequencies(theta))
        is_possible = np.isfinite(posterior.log_likelihood_of(log_frequencies, theta)).all(axis=1)
        log_weights = np.where(is_possible, 0.0, -np.inf)
        return Sample(theta, z, log_weights, sample.effective(sample.weights), log_density, np.nan, log_frequencies)

    def _log_evidence(self, log_reference: LogDensity, theta: Floats, z: Floats, weights: Floats, seed: int) -> float:
        """ln of the integral of r(z) L(z), from weighted draws of that density."""
        rng = np.random.default_rng([seed, _LINE, 1])
        picked_draws = rng.permutation(resample(weights, len(z), rng))
        draws = np.column_stack([theta[:, self.conditional.own_columns], z])[picked_draws]
        return bridge_sampling(_log_joint_density(self.conditional, log_reference), draws, rng)

    def posterior_of(self, sample: Sample, weights: Floats, rng: np.random.Generator, seed: int) -> Draws:
        """The weighted draws of a sample as those of an inference."""
        picked_draws = rng.permutation(resample(weights, len(self.draws.flat), rng))
        theta, log_frequencies = (
            sample.theta[picked_draws],
            [log_frequency[picked_draws] for log_frequency in sample.log_frequencies],
        )
        old_convergence, problem, n_effective = (
            self.inference.convergence,
            self.inference.problem,
            sample.effective(weights),
        )
        log_prob = problem.posterior.log_prior(theta)
        log_prob += problem.posterior.log_likelihood_of(log_frequencies, theta).sum(axis=1)
        chain_theta = theta.reshape(self.draws.theta.shape)
        convergence = replace(
            old_convergence,
            tau=np.ones_like(old_convergence.tau),
            ess=np.full_like(old_convergence.ess, n_effective),
            tau_max=1.0,
            ess_min=n_effective,
            n_kept_steps=chain_theta.shape[1],
        )
        chain_log_prob = log_prob.reshape(chain_theta.shape[:2])
        chains = Chains(chain_theta[:, :, None], chain_log_prob[:, :, None], 0)
        inference = Inference(
            problem, chains, convergence, chain_theta, chain_log_prob, tuple(log_frequencies), self.inference.surrogate
        )
        return named_draws(inference, seed)


def _log_joint_density(conditional: ConditionalPosterior, log_reference: LogDensity) -> LogDensity:
    """ln of the joint density of a board's own parameters and the shared ones, side by side, these with density r."""
    n_own = conditional.own_columns.size

    def log_density(x: Floats) -> Floats:
        total = np.array(log_reference(x[:, n_own:]), dtype=np.float64)
        inside = np.isfinite(total)
        total[inside] += conditional.log_density(x[inside, :n_own], x[inside, n_own:])
        return total

    return log_density


def _regression_slopes(covariance: Floats, n_last: int) -> Floats:
    """Slopes of the linear regression of every column on the last ones: (n_columns, n_last) array."""
    return np.asarray(covariance[:, -n_last:] @ np.linalg.inv(covariance[-n_last:, -n_last:]))


def _moved_moments(x: Floats, weights: Floats, aim: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Mean and covariance of normal draws after their last columns get the mean and covariance of `aim`."""
    mean, covariance = moments(x, weights)
    shared_columns, slopes = slice(x.shape[1] - aim[0].size, None), _regression_slopes(covariance, aim[0].size)
    change = aim[1] - covariance[shared_columns, shared_columns]
    return mean + slopes @ (aim[0] - mean[shared_columns]), covariance + slopes @ change @ slopes.T
