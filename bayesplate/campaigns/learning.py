"""From boards that were fitted alone to what they teach together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.campaigns.boards import Member
from bayesplate.campaigns.marginal import Marginal
from bayesplate.campaigns.recovered import with_normal
from bayesplate.campaigns.space import Pull, Space
from bayesplate.campaigns.together import Together, walk
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.sampling import Chains, Progress, SamplerSettings

Floats = NDArray[np.float64]

RIM = 1e-3
"""Probability at the rim of the nodes' box above which it is laid out anew, where the posterior then is."""
_ROUNDS = 3
_N_CHECKS = 12
_LINE = 15


@dataclass(frozen=True, eq=False)
class Learnt:
    """What the boards of a campaign teach.

    Attributes
    ----------
    members : tuple of Member
    marginals : tuple of Marginal
        One per board.
    together : Together
    chains : Chains
        Of the standard coordinates of the shared parameters.
    convergence : Convergence
    checked : (n_boards,) array
        How far what is interpolated between the nodes is from what is computed, at points of the posterior, ln.
    as_normal : tuple of str
        Boards whose likelihood is taken as the normal one of their own draws.
    """

    members: tuple[Member, ...]
    marginals: tuple[Marginal, ...]
    together: Together
    chains: Chains
    convergence: Convergence
    checked: Floats
    as_normal: tuple[str, ...] = ()

    @property
    def rim(self) -> float:
        """The largest probability at the rim of the nodes' box, from all boards or all but one."""
        return _rim(self.together)


def learn(
    members: Sequence[Member], settings: SamplerSettings, progress: Callable[[Progress], None] | None = None
) -> Learnt:
    """Multiply the boards' marginal likelihoods and sample what they share.

    Parameters
    ----------
    members : sequence of Member
    settings : SamplerSettings
    progress : callable, optional

    Returns
    -------
    Learnt
        Its convergence is that of the shared parameters.
    """
    pulls = tuple(member.pull for member in members)
    space = Space.around(pulls)
    for _ in range(_ROUNDS):
        marginals, together, as_normal = _at_nodes(members, pulls, space, settings.seed)
        if _rim(together) < RIM:
            break
        every = [together.moments(without) for without in _leaving(together)]
        space = Space.of_moments(*(list(part) for part in zip(*every, strict=True)))
    chains, convergence = walk(together, settings, progress)
    checked = _checked(members, together, chains, settings.seed)
    checked[[one.name in as_normal for one in members]] = 0.0
    return Learnt(tuple(members), marginals, together, chains, convergence, checked, as_normal)


def _at_nodes(
    members: Sequence[Member], pulls: tuple[Pull, ...], space: Space, seed: int
) -> tuple[tuple[Marginal, ...], Together, tuple[str, ...]]:
    marginals = tuple(member.marginal(space.nodes, _random(seed, i)) for i, member in enumerate(members))
    values = np.stack([one.log_likelihood for one in marginals])
    together = Together(members[0].shared, space, tuple(one.name for one in members), values, pulls)
    return marginals, *with_normal(together, members)


def _checked(members: Sequence[Member], together: Together, chains: Chains, seed: int) -> Floats:
    """Root mean square of interpolated less computed, the constant that random numbers leave taken off: (n_boards,)."""
    rng = np.random.default_rng([seed, _LINE, len(members)])
    z = chains.pooled[rng.choice(len(chains.pooled), _N_CHECKS)]
    interpolated = together.log_likelihoods(together.space.u(z))
    computed = np.stack([one.marginal(z, _random(seed, i)).log_likelihood for i, one in enumerate(members)])
    return np.asarray(np.std(interpolated - computed, axis=1))


def _leaving(together: Together) -> list[tuple[int, ...]]:
    """Nobody left out, then each board."""
    return [(), *((i,) for i in range(len(together.names)))]


def _rim(together: Together) -> float:
    return max(together.rim(without) for without in _leaving(together))


def _random(seed: int, member: int) -> np.random.Generator:
    """A board's random numbers: the same for all nodes and every time."""
    return np.random.default_rng([seed, _LINE, member])
