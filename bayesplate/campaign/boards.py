"""One board of a campaign: what its own fit says of the shared parameters, and its posterior under what all teach."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.campaign.evidence import bridge_sampling
from bayesplate.campaign.given import GivenShared
from bayesplate.campaign.likelihood import LogDensity, SharedLikelihood, moments
from bayesplate.campaign.pulls import Pull
from bayesplate.campaign.shared import Shared
from bayesplate.diagnosis.terms import log_sum, normalised
from bayesplate.posterior.draws import Draws, named_draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.reweighting import FEWEST_WEIGHTED_DRAWS
from bayesplate.posterior.sampling import Chains, SamplerSettings, sample
from bayesplate.posterior.statistics import effective_draws, effective_share, resampled
from bayesplate.posterior.surrogate import Solved, Surrogate, n_terms, with_surrogate

N_SOLVED = 2048
"""Draws of a walk, or taken to other shared parameters, at which the law itself is evaluated."""
_GOOD_SHARE = 0.9
"""Of the draws of a surrogate that count under the law, from which on it is taught no further."""
_MOST_WALKS = 3
"""On surrogates, each fitted to the law where the one before led."""
_ALONG_BENT = {3: 6}
"""Orders of a surrogate fitted on the way to where others lead a board: higher ones are wild beyond its points."""
_LINE = 19
_NOTHING = 1e-300


@dataclass(frozen=True, eq=False)
class Sample:
    """Draws of a board under a density r(z) L(z) of the shared parameters, L being the board's likelihood of them.

    Attributes
    ----------
    theta : (n, n_dim) array
        All columns of the board.
    z : (n, n_shared) array
        Standard coordinates of what is shared.
    log_weights : (n,) array
        That make the draws those of this density.
    n_independent : float
        How many independent draws they are worth, the weights aside.
    log_reference : callable
        ln r.
    log_evidence : float
        ln of the integral of r(z) L(z).
    every : tuple of (n, n_every) array
        ln f (Hz) of all modes, setup by setup, under the law of the board.
    """

    theta: Floats
    z: Floats
    log_weights: Floats
    n_independent: float
    log_reference: LogDensity
    log_evidence: float
    every: tuple[Floats, ...]

    @cached_property
    def weights(self) -> Floats:
        """Of the draws: (n,) array that sums to 1."""
        return normalised(self.log_weights)

    @property
    def serves(self) -> bool:
        """Whether enough draws count, and nearly all of them: a surrogate that is far off lacks a part of the law."""
        enough = self.effective(self.weights) >= FEWEST_WEIGHTED_DRAWS
        return enough and effective_share(self.weights) >= _GOOD_SHARE

    def weights_under(self, log_reference: LogDensity) -> Floats:
        """Weights under which r is another density: (n,) array that sums to 1."""
        return normalised(np.log(np.maximum(self.weights, _NOTHING)) + self._change(log_reference))

    def log_evidence_under(self, log_reference: LogDensity) -> float:
        """ln of the integral of r(z) L(z) where r is another density."""
        return self.log_evidence + float(
            log_sum(np.log(np.maximum(self.weights, _NOTHING)) + self._change(log_reference))
        )

    def effective(self, weights: Floats) -> float:
        """How many independent draws of equal weight are worth as much."""
        return effective_draws(weights) * self.n_independent / len(weights)

    def _change(self, log_reference: LogDensity) -> Floats:
        """ln of another r over this one at the draws: (n,) array."""
        with np.errstate(invalid="ignore"):
            change = log_reference(self.z) - self.log_reference(self.z)
        return np.nan_to_num(change, nan=-np.inf, neginf=-np.inf)


@dataclass(frozen=True, eq=False)
class Member:
    """A board that was fitted alone, the shared effects declared under their own priors."""

    inference: Inference
    draws: Draws
    shared: tuple[Shared, ...]

    @property
    def name(self) -> str:
        """Of the board."""
        return self.inference.problem.board.name

    @cached_property
    def given(self) -> GivenShared:
        """Its density given what is shared."""
        return GivenShared(self.inference.problem.posterior, self.shared)

    def quick(self, surrogate: Surrogate | None) -> GivenShared:
        """The same by a surrogate of its law, where it has one."""
        if surrogate is None:
            return self.given
        return replace(self.given, posterior=with_surrogate(self.given.posterior, surrogate))

    def log_prior(self, z: Floats) -> Floats:
        """ln of the campaign's prior of the shared parameters: (n,) array."""
        return np.asarray(sum((one.prior.log_prior(z[:, i]) for i, one in enumerate(self.shared)), np.zeros(len(z))))

    @cached_property
    def alone(self) -> Sample:
        """Draws of its own posterior, under the campaign's prior of what is shared.

        They are those of its fit; a board each setup of which had a parameter of its own there is walked anew with
        one for all.
        """
        flat, convergence = self.draws.flat, self.inference.convergence
        every = tuple(each.reshape(len(flat), -1) for each in self.draws.every_log_frequency)
        n_independent = min(float(convergence.ess_min), float(len(flat)))
        z, log_weights = self.given.z_of(flat), self.given.log_reweighting(flat)
        if not self.given.is_one_to_one:
            fitted = Sample(flat, z, log_weights, n_independent, self.log_prior, np.nan, every)
            return self.anew(self.log_prior, fitted, moments(z, fitted.weights), 0)
        log_evidence = self._log_evidence(self.log_prior, flat, z, normalised(log_weights), 0)
        return Sample(flat, z, log_weights, n_independent, self.log_prior, log_evidence, every)

    @property
    def pull(self) -> Pull:
        """What its likelihood of the shared parameters amounts to as a normal one."""
        return Pull.of_draws(self.alone.z, self.alone.weights, [one.prior for one in self.shared])

    def likelihood(self, drawn: Sample, log_reference: LogDensity) -> SharedLikelihood:
        """Its likelihood of the shared parameters, from a sample that is weighted to be where r is another density.

        Draws that were walked anew lie away from the board's own, where the polynomial that follows them is only
        extrapolated; what this board teaches the others rests on its own. So both go into it, half and half: they are
        draws of L times the mean of both densities r, each over its evidence.
        """
        weights = drawn.weights_under(log_reference)
        n_effective, log_evidence = drawn.effective(weights), drawn.log_evidence_under(log_reference)
        own = self.alone
        if drawn is own:
            return SharedLikelihood.found(drawn.z, weights, n_effective, log_reference, log_evidence)

        def log_either(z: Floats) -> Floats:
            return np.logaddexp(self.log_prior(z) - own.log_evidence, log_reference(z) - log_evidence) - np.log(2.0)

        z, both = np.concatenate([own.z, drawn.z]), 0.5 * np.concatenate([own.weights, weights])
        of_both = 4.0 / (1.0 / own.effective(own.weights) + 1.0 / n_effective)
        return SharedLikelihood.found(z, both, of_both, log_either, 0.0)

    def anew(self, log_reference: LogDensity, before: Sample, aim: tuple[Floats, Floats], seed: int) -> Sample:
        """Walk where the shared parameters have another density, and weight the draws by the law itself.

        The surrogate of the board's own fit knows little of where others lead it: while too few draws are left by the
        weights, one is fitted to the law at the draws, and walked on. Where no draw has a density by the law the sample
        from before is all there is.

        Parameters
        ----------
        log_reference : callable
            ln r.
        before : Sample
            From which the walkers learn how the board's own parameters go with the shared ones.
        aim : (n_shared,) and (n_shared, n_shared) arrays
            Mean and covariance of the shared parameters, nearly.
        """
        own, surrogate = self.given.own_columns, self.inference.surrogate
        start = _moved(np.column_stack([before.theta[:, own], before.z]), before.weights, aim)
        found: list[Sample] = []
        solved: list[Solved] = []
        for _ in range(1 if surrogate is None else _MOST_WALKS):
            drawn, points = self._walked(surrogate, log_reference, start, seed)
            solved.append(points)
            every = Solved(*(np.concatenate(parts) for parts in zip(*solved, strict=True)))
            if np.isfinite(drawn.log_weights).any():
                found.append(drawn)
            if surrogate is None or (found and found[-1].serves):
                break
            if np.isfinite(every.log_density).sum() < n_terms(surrogate.columns.size, {}):
                break
            surrogate = Surrogate.fitted(every, surrogate.columns, _ALONG_BENT)
        if not found:
            return before
        best = max(found, key=lambda one: one.effective(one.weights))
        log_evidence = self._log_evidence(log_reference, best.theta, best.z, best.weights, seed)
        return replace(best, log_evidence=log_evidence)

    def _walked(
        self, surrogate: Surrogate | None, log_reference: LogDensity, start: tuple[Floats, Floats], seed: int
    ) -> tuple[Sample, Solved]:
        """Draws of a walk on a surrogate, weighted by the law, and what the law gives at them.

        Without a surrogate the walk is on the law itself, and all weights are one.
        """
        quick, n_own = self.quick(surrogate), self.given.own_columns.size
        joint = _joint(quick, log_reference)

        def log_within(x: Floats) -> Floats:
            if surrogate is None:
                return np.zeros(len(x))
            return surrogate.log_within(self.given.theta(x[:, :n_own], x[:, n_own:]))

        names = [f"parameter {i}" for i in range(start[0].size)]
        chains, convergence = sample(lambda x: joint(x) + log_within(x), *start, SamplerSettings(seed), names=names)
        pooled, log_prob = chains.pooled, chains.log_prob[:, chains.burn_in :].ravel()
        picked = np.random.default_rng([seed, _LINE]).choice(len(pooled), N_SOLVED)
        x = pooled[picked]
        theta, z = self.given.theta(x[:, :n_own], x[:, n_own:]), x[:, n_own:]
        every = tuple(self.given.posterior.every_log_frequency(theta))
        exact = self.given.posterior.log_likelihood_of(every, theta).sum(axis=1)
        log_weights = exact - quick.posterior.log_likelihood(theta).sum(axis=1) - log_within(x)
        log_weights = np.nan_to_num(log_weights, nan=-np.inf, neginf=-np.inf)
        n_independent = min(float(convergence.ess_min), float(N_SOLVED))
        drawn = Sample(theta, z, log_weights, n_independent, log_reference, np.nan, every)
        return drawn, Solved(theta, np.concatenate(every, axis=1), log_prob[picked] + log_weights)

    def moved(self, drawn: Sample, log_density: LogDensity, z: Floats, rng: np.random.Generator) -> Sample:
        """Draws of a sample taken to other shared parameters, its own parameters going along linearly.

        Those that end where the model lacks a mode that was read have no weight.

        Parameters
        ----------
        log_density : callable
            ln of the density that the others are drawn from.
        z : (n, n_shared) array
            Standard coordinates to go to.
        """
        own = self.given.own_columns
        _, covariance = moments(np.column_stack([drawn.theta[:, own], drawn.z]), drawn.weights)
        slopes = _slopes(covariance, z.shape[1])[: own.size]
        picked = rng.permutation(resampled(drawn.weights, len(z), rng))
        theta = self.given.theta(drawn.theta[picked][:, own] + (z - drawn.z[picked]) @ slopes.T, z)
        posterior = self.given.posterior
        every = tuple(posterior.every_log_frequency(theta))
        is_possible = np.isfinite(posterior.log_likelihood_of(every, theta)).all(axis=1)
        log_weights = np.where(is_possible, 0.0, -np.inf)
        return Sample(theta, z, log_weights, drawn.effective(drawn.weights), log_density, np.nan, every)

    def _log_evidence(self, log_reference: LogDensity, theta: Floats, z: Floats, weights: Floats, seed: int) -> float:
        """ln of the integral of r(z) L(z), from weighted draws of that density."""
        rng = np.random.default_rng([seed, _LINE, 1])
        picked = rng.permutation(resampled(weights, len(z), rng))
        draws = np.column_stack([theta[:, self.given.own_columns], z])[picked]
        return bridge_sampling(_joint(self.given, log_reference), draws, rng)

    def posterior_of(
        self, drawn: Sample, weights: Floats, rng: np.random.Generator, seed: int
    ) -> tuple[Inference, Draws]:
        """An inference that has the weighted draws of a sample and no others, and the draws by name."""
        picked = rng.permutation(resampled(weights, len(self.draws.flat), rng))
        theta, every = drawn.theta[picked], [each[picked] for each in drawn.every]
        before, problem, effective = self.inference.convergence, self.inference.problem, drawn.effective(weights)
        log_prob = problem.posterior.log_prior(theta)
        log_prob += problem.posterior.log_likelihood_of(every, theta).sum(axis=1)
        as_chains = theta.reshape(self.draws.theta.shape)
        convergence = replace(
            before,
            tau=np.ones_like(before.tau),
            ess=np.full_like(before.ess, effective),
            tau_max=1.0,
            ess_min=effective,
            n_kept_steps=as_chains.shape[1],
        )
        by_chain = log_prob.reshape(as_chains.shape[:2])
        chains = Chains(as_chains[:, :, None], by_chain[:, :, None], 0)
        inference = Inference(problem, chains, convergence, as_chains, by_chain, tuple(every), self.inference.surrogate)
        return inference, named_draws(inference, seed)


def _joint(given: GivenShared, log_reference: LogDensity) -> LogDensity:
    """ln of the density of the own and the shared parameters, side by side, where the latter have the density r."""
    n_own = given.own_columns.size

    def log_density(x: Floats) -> Floats:
        total = np.array(log_reference(x[:, n_own:]), dtype=np.float64)
        inside = np.isfinite(total)
        total[inside] += given.log_density(x[inside, :n_own], x[inside, n_own:])
        return total

    return log_density


def _slopes(covariance: Floats, n_last: int) -> Floats:
    """What every column does with the last ones, linearly: (n_columns, n_last) array."""
    return np.asarray(covariance[:, -n_last:] @ np.linalg.inv(covariance[-n_last:, -n_last:]))


def _moved(x: Floats, weights: Floats, aim: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Mean and covariance of draws whose last columns are brought to others, all being normal."""
    mean, covariance = moments(x, weights)
    shared, slopes = slice(x.shape[1] - aim[0].size, None), _slopes(covariance, aim[0].size)
    change = aim[1] - covariance[shared, shared]
    return mean + slopes @ (aim[0] - mean[shared]), covariance + slopes @ change @ slopes.T
