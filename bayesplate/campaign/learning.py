"""From boards that were fitted alone to what they teach together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.campaign.boards import N_SOLVED, Member, Sample
from bayesplate.campaign.likelihood import LogDensity, moments
from bayesplate.campaign.together import Together, walk
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.reweighting import FEWEST_WEIGHTED_DRAWS
from bayesplate.posterior.sampling import Chains, Progress, SamplerSettings

ASTRAY = 0.3
"""Standard deviations of the shared parameters by which a board's draws may be off their likelihood."""
_ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Learnt:
    """What the boards of a campaign teach."""

    members: tuple[Member, ...]
    samples: tuple[Sample, ...]  # of each board, where what all boards teach is among them
    together: Together
    chains: Chains  # of the standard coordinates of what is learned: `Together.coordinates`
    convergence: Convergence

    @cached_property
    def astray(self) -> Floats:
        """How far each board's draws under what all teach are off what all teach: (n_boards,) array.

        The two are the same but for the polynomial that stands for the board's likelihood: the largest difference of a
        mean, in standard deviations, less two of its standard errors.
        """
        found = np.empty(len(self.samples))
        for i, drawn in enumerate(self.samples):
            mean, covariance = self.together.under_all(i)
            weights = drawn.weights_under(self.together.log_taught((i,)))
            off = np.abs(moments(drawn.z, weights)[0] - mean) / np.sqrt(np.diagonal(covariance))
            found[i] = off.max() - 2.0 * drawn.effective(weights) ** -0.5
        return found

    def board(self, index: int, rng: np.random.Generator, seed: int) -> tuple[Inference, Draws, float]:
        """A board's posterior under what all boards teach, and how many independent draws it rests on.

        Its draws, weighted by what the other boards say of theirs; where too few are left, it is walked anew.
        """
        together, member = self.together, self.members[index]
        log_reference = together.log_taught((index,))
        drawn = _drawn(member, self.samples[index], log_reference, together.under_all(index), seed)
        weights = drawn.weights_under(log_reference)
        return *member.posterior_of(drawn, weights, rng, seed), drawn.effective(weights)

    def board_left_out(self, index: int, rng: np.random.Generator, seed: int) -> tuple[Inference, Draws]:
        """A board with the shared parameters that the others alone teach, its constants its own; as of `board`.

        Each of its draws goes to a value that the others teach, its own parameters with it as they go with the shared
        ones over all of its draws.
        """
        member, drawn = self.members[index], self.samples[index]
        taught = self.together.taught_draws(rng, N_SOLVED, (index,))
        moved = member.moved(drawn, self.together.log_taught((index,)), taught, rng)
        return member.posterior_of(moved, moved.weights, rng, seed)


def learn(
    members: Sequence[Member], settings: SamplerSettings, progress: Callable[[Progress], None] | None = None
) -> Learnt:
    """Multiply the boards' likelihoods of what they share and sample it.

    A likelihood is first found from a board's own draws, then from the same draws weighted to be halfway to where all
    boards together are: there it matters, and a polynomial of low order follows it the better. A board that has too few
    draws there is walked anew; one that still has too few keeps the likelihood that its own draws gave.
    """
    samples = [member.alone for member in members]
    found = [one.likelihood(drawn, one.log_prior) for one, drawn in zip(members, samples, strict=True)]
    names, pulls = [one.name for one in members], [one.pull for one in members]
    together = Together.of(members[0].shared, names, found, pulls)
    for _ in range(_ROUNDS):
        for i, member in enumerate(members):
            near = _halfway(member, together, i)
            drawn = _drawn(member, samples[i], near, together.under_all(i), settings.seed)
            if drawn.effective(drawn.weights_under(near)) >= FEWEST_WEIGHTED_DRAWS:
                samples[i], found[i] = drawn, member.likelihood(drawn, near)
        together = Together.of(together.shared, names, found, pulls)
    return Learnt(tuple(members), tuple(samples), together, *walk(together, settings, progress))


def _drawn(member: Member, before: Sample, log_reference: LogDensity, aim: tuple[Floats, Floats], seed: int) -> Sample:
    """Draws of a board where the shared parameters have another density: those at hand if they serve, else anew.

    Of the two the one with more draws there: far from what a board likes, a walk on the surrogate of its law may be
    worth less than the few of its own draws.
    """
    effective = before.effective(before.weights_under(log_reference))
    if effective >= FEWEST_WEIGHTED_DRAWS:
        return before
    anew = member.anew(log_reference, before, aim, seed)
    return anew if anew.effective(anew.weights) > effective else before


def _halfway(member: Member, together: Together, board: int) -> LogDensity:
    """ln of a density between the prior and what all boards but one teach of the shared parameters."""
    log_taught = together.log_taught((board,))
    return lambda z: 0.5 * (member.log_prior(z) + log_taught(z))
