"""The posterior of the shared parameters from boards that were fitted alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.campaign.boards import N_EXACT_DRAWS, FittedBoard, Sample
from bayesplate.campaign.combined import CombinedBoards, sample_shared
from bayesplate.campaign.likelihood import moments
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.reweighting import FEWEST_WEIGHTED_DRAWS
from bayesplate.posterior.sampling import Chains, Progress, SamplerSettings
from bayesplate.posterior.starts import LogDensity

LARGEST_OFFSET = 0.3
"""Standard deviations of the shared parameters by which a board's draws may be off their likelihood."""
_ROUNDS = 3


@dataclass(frozen=True, eq=False)
class SharedPosterior:
    """The posterior of the shared parameters of a campaign, and of each of its boards."""

    members: tuple[FittedBoard, ...]
    samples: tuple[Sample, ...]  # one per board, with draws where the posterior from all boards is
    combined: CombinedBoards
    chains: Chains  # of the standard coordinates `CombinedBoards.coordinates`
    convergence: Convergence

    @cached_property
    def offsets(self) -> Floats:
        """Distance of each board's draws from the shared posterior, in standard deviations: (n_boards,) array.

        The largest difference between the means of the shared parameters over the board's draws and over the shared
        posterior, less two of its standard errors. It is zero but for the error of the polynomial that stands for the
        board's likelihood.
        """
        offsets = np.empty(len(self.samples))
        for i, sample in enumerate(self.samples):
            mean, covariance = self.combined.moments_from_all(i)
            weights = sample.weights_under(self.combined.log_density_from_others((i,)))
            offset = np.abs(moments(sample.z, weights)[0] - mean) / np.sqrt(np.diagonal(covariance))
            offsets[i] = offset.max() - 2.0 * sample.effective(weights) ** -0.5
        return offsets

    def board(self, index: int, rng: np.random.Generator, seed: int) -> tuple[Draws, float]:
        """A board's posterior given all boards, and the number of independent draws on which it rests.

        The board's draws are weighted by the density of the shared parameters that the other boards teach; where too
        few draws count, the board is sampled anew.
        """
        combined, member = self.combined, self.members[index]
        log_reference = combined.log_density_from_others((index,))
        sample = _sample_under(member, self.samples[index], log_reference, combined.moments_from_all(index), seed)
        weights = sample.weights_under(log_reference)
        return member.posterior_of(sample, weights, rng, seed), sample.effective(weights)

    def board_left_out(self, index: int, rng: np.random.Generator, seed: int) -> Draws:
        """A board's posterior with the shared parameters that the others teach, and constants by its own readings.

        Each of its draws is moved to shared parameters that the others teach, and its own parameters by their linear
        regression on the shared ones.
        """
        member, sample = self.members[index], self.samples[index]
        taught_z = self.combined.draws_from_others(rng, N_EXACT_DRAWS, (index,))
        moved_sample = member.moved(sample, self.combined.log_density_from_others((index,)), taught_z, rng)
        return member.posterior_of(moved_sample, moved_sample.weights, rng, seed)


def learn_shared(
    members: Sequence[FittedBoard], settings: SamplerSettings, progress: Callable[[Progress], None] | None = None
) -> SharedPosterior:
    """Multiply the boards' likelihoods of the shared parameters and sample their posterior.

    A likelihood is first fitted to a board's own draws, then to draws weighted to a density halfway between the prior
    and what the other boards teach: it matters there, and a polynomial of low order fits it better. A board with too
    few draws there is sampled anew; one that still has too few keeps its likelihood from before.
    """
    samples = [member.own_sample for member in members]
    likelihoods = [member.likelihood(sample, member.log_prior) for member, sample in zip(members, samples, strict=True)]
    names, normal_likelihoods = [member.name for member in members], [member.normal_likelihood for member in members]
    combined = CombinedBoards.of(members[0].shared, names, likelihoods, normal_likelihoods)
    for _ in range(_ROUNDS):
        for i, member in enumerate(members):
            log_halfway = _log_halfway(member, combined, i)
            sample = _sample_under(member, samples[i], log_halfway, combined.moments_from_all(i), settings.seed)
            if sample.effective(sample.weights_under(log_halfway)) >= FEWEST_WEIGHTED_DRAWS:
                samples[i], likelihoods[i] = sample, member.likelihood(sample, log_halfway)
        combined = CombinedBoards.of(combined.shared, names, likelihoods, normal_likelihoods)
    return SharedPosterior(tuple(members), tuple(samples), combined, *sample_shared(combined, settings, progress))


def _sample_under(
    member: FittedBoard, sample: Sample, log_reference: LogDensity, aim: tuple[Floats, Floats], seed: int
) -> Sample:
    """A sample of a board under another density of the shared parameters: the one at hand if enough draws count there.

    Otherwise the better of this and a new sample: far from the board's own posterior a walk on the surrogate of its law
    may be worth less than the few of its own draws.
    """
    n_effective = sample.effective(sample.weights_under(log_reference))
    if n_effective >= FEWEST_WEIGHTED_DRAWS:
        return sample
    new_sample = member.sample_anew(log_reference, sample, aim, seed)
    return new_sample if new_sample.effective(new_sample.weights) > n_effective else sample


def _log_halfway(member: FittedBoard, combined: CombinedBoards, board: int) -> LogDensity:
    """ln of a density of the shared parameters halfway between the prior and what all boards but one teach."""
    log_density = combined.log_density_from_others((board,))
    return lambda z: 0.5 * (member.log_prior(z) + log_density(z))
