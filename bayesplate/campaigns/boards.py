"""One board of a campaign: what its own fit says of the shared parameters, and its posterior under what all teach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.campaigns.given import GivenShared
from bayesplate.campaigns.marginal import N_DRAWS, Marginal, marginal_likelihood
from bayesplate.campaigns.shared import Shared
from bayesplate.campaigns.space import Pull
from bayesplate.campaigns.together import Together
from bayesplate.posterior.draws import Draws, named_draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.reweighting import FEWEST_WEIGHTED_DRAWS, effective_draws
from bayesplate.posterior.sampling import Chains
from bayesplate.posterior.surrogate import with_surrogate

Floats = NDArray[np.float64]

_N_ANEW = 8000
_FEW_DRAWS = 192
"""At each node under an exact law that has no surrogate: it is a hundred times as dear."""
_WORST_CORRECTION = 0.05
_FAR = 2.5
"""Standard deviations of the board's own draws beyond which the correction of its surrogate goes on level."""


@dataclass(frozen=True, eq=False)
class Member:
    """A board that was fitted alone, the shared effects declared under their own priors.

    Attributes
    ----------
    inference : Inference
    draws : Draws
    shared : tuple of Shared
    """

    inference: Inference
    draws: Draws
    shared: tuple[Shared, ...]

    @property
    def name(self) -> str:
        """Of the board."""
        return self.inference.problem.board.name

    @cached_property
    def given(self) -> GivenShared:
        """Its density given what is shared, by the surrogate of its law where it has one."""
        posterior, surrogate = self.inference.problem.posterior, self.inference.surrogate
        return GivenShared(posterior if surrogate is None else with_surrogate(posterior, surrogate), self.shared)

    @cached_property
    def z(self) -> Floats:
        """Standard coordinates of the shared parameters at its own draws: (n, n_shared) array."""
        return self.given.z_of(self.draws.flat)

    @cached_property
    def log_weights(self) -> Floats:
        """ln of the campaign's prior over the board's own, at its own draws: (n,) array."""
        return self.given.log_reweighting(self.draws.flat)

    @cached_property
    def weights(self) -> Floats:
        """Weights that make its own draws those under the campaign's prior: (n,) array that sums to 1."""
        return _normalised(self.log_weights)

    @property
    def pull(self) -> Pull:
        """What its likelihood of the shared parameters amounts to as a normal one."""
        return Pull.of_draws(self.z, self.weights)

    def marginal(self, nodes: Floats, rng: np.random.Generator) -> Marginal:
        """Its marginal likelihood at nodes of the shared parameters, corrected to the exact law."""
        own = self.draws.flat[:, self.given.own_columns]
        is_cheap = self.inference.surrogate is not None or self.inference.problem.posterior.law == "linear"
        n_draws = N_DRAWS if is_cheap else _FEW_DRAWS
        found = marginal_likelihood(self.given.log_density, own, self.z, nodes, rng, n_draws)
        return replace(found, log_likelihood=found.log_likelihood + self._correction(nodes))

    def _correction(self, nodes: Floats) -> Floats:
        """ln of the exact marginal likelihood over that of the surrogate, at nodes: (n_nodes,) array.

        The mean of exp(-d) over draws of the exact posterior at a node, d the difference of the two log likelihoods,
        is the ratio of the surrogate's to the exact one. It is regressed on the shared parameters.
        """
        if self.inference.surrogate is None:
            return np.zeros(len(nodes))
        exact = self.draws.log_likelihood.sum(axis=-1).ravel()
        less = exact - self.given.posterior.log_likelihood(self.draws.flat).sum(axis=1)
        usual = float(np.median(less))
        middle, sd = self.z.mean(axis=0), self.z.std(axis=0)
        terms = _quadratic((self.z - middle) / sd)
        found = np.linalg.lstsq(terms, np.exp(np.clip(usual - less, -5.0, 5.0)), rcond=None)[0]
        there = _quadratic(np.clip((nodes - middle) / sd, -_FAR, _FAR)) @ found
        return usual - np.log(np.maximum(there, _WORST_CORRECTION))

    def under_all(
        self,
        together: Together,
        marginal: Marginal,
        rng: np.random.Generator,
        seed: int,
        *,
        is_left_out: bool = False,
    ) -> tuple[Inference, Draws, float]:
        """Its posterior under what all boards, or all others, teach of the shared parameters.

        Its own draws, weighted by what the other boards say of theirs; where too few of them are left, or each of its
        setups had a parameter of its own, importance draws about the nodes.

        Parameters
        ----------
        together : Together
        marginal : Marginal
            Its own.
        rng : numpy.random.Generator
        seed : int
            Of the predictive draws.
        is_left_out : bool
            Whether the others alone teach the shared parameters; its constants are its own in any case.

        Returns
        -------
        inference : Inference
        draws : Draws
        effective : float
            How many draws of equal weight the result rests on.
        """
        own = together.names.index(self.name)
        seen = together.log_likelihoods(together.space.u(self.z))
        log_weights = np.delete(seen, own, axis=0).sum(axis=0)
        if is_left_out:
            inside = np.isfinite(log_weights)
            log_weights[inside] -= seen[own, inside]
        weights = _normalised(self.log_weights + log_weights)
        n, effective = len(self.z), effective_draws(weights)
        if effective >= FEWEST_WEIGHTED_DRAWS and self.given.is_one_to_one:
            picked = _resampled(weights, n, rng)
            every = [each.reshape(n, -1)[picked] for each in self.draws.every_log_frequency]
            return *self._of(self.draws.flat[picked], every, effective, seed), effective
        z = together.draws(rng, _N_ANEW, (own,) if is_left_out else ())
        points, log_density = marginal.draw_own(z, rng)
        there = together.log_likelihoods(together.space.u(z))[own]
        weights = _normalised(self.given.log_density(points, z) - log_density - there)
        picked = _resampled(weights, n, rng)
        theta = self.given.theta(points, z)
        distinct = np.unique(picked)
        rows = np.searchsorted(distinct, picked)
        every = [each[rows] for each in self.given.posterior.every_log_frequency(theta[distinct])]
        effective = effective_draws(weights)
        return *self._of(theta[picked], every, effective, seed), effective

    def _of(self, theta: Floats, every: Sequence[Floats], effective: float, seed: int) -> tuple[Inference, Draws]:
        """An inference that has these draws and no others, and the draws by name."""
        n_chains, before = len(self.draws.theta), self.inference.convergence
        as_chains = theta.reshape(n_chains, -1, 1, theta.shape[-1])
        problem = self.inference.problem
        log_prob = problem.posterior.log_prior(theta)
        log_prob += problem.posterior.log_likelihood_of(every, theta).sum(axis=1)
        convergence = replace(
            before,
            tau=np.ones_like(before.tau),
            ess=np.full_like(before.ess, effective),
            tau_max=1.0,
            ess_min=effective,
            n_kept_steps=as_chains.shape[1],
        )
        chains = Chains(as_chains, log_prob.reshape(n_chains, -1, 1), 0)
        inference = Inference(problem, chains, convergence, self.inference.surrogate)
        return inference, named_draws(inference, seed, every)


def _normalised(log_weights: Floats) -> Floats:
    shares = np.exp(log_weights - log_weights.max())
    return np.asarray(shares / shares.sum())


def _resampled(weights: Floats, n: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Indices drawn by weight with the least scatter (systematic), in random order: (n,) array."""
    places = (np.arange(n) + rng.random()) / n
    picked = np.minimum(np.searchsorted(np.cumsum(weights), places), len(weights) - 1)
    return np.asarray(rng.permutation(picked), dtype=np.intp)


def _quadratic(x: Floats) -> Floats:
    """1, x_i and x_i x_j: (n, n_terms) array."""
    first, second = np.triu_indices(x.shape[1])
    return np.column_stack([np.ones(len(x)), x, x[:, first] * x[:, second]])
