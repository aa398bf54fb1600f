"""Whether a board's marginal likelihood gives back the board's own posterior; if not, a normal one stands for it.

The importance draws at the nodes rest on a surrogate of the board's law, which may err where a board has many
parameters and labels in doubt. The board's own draws rest on the law itself. Times the prior, the marginal likelihood
must have their mean and standard deviation within the nodes' box; otherwise it is replaced by the normal likelihood
that these draws amount to, and that is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.campaigns.boards import Member
from bayesplate.campaigns.together import Together

Floats = NDArray[np.float64]

_FAR_OFF = 0.3
"""Standard deviations of a mean, or logarithm of the ratio of two standard deviations, that are no chance."""
_FEWEST_INSIDE = 0.2
"""Share of a board's own draws within the box below which nothing can be compared."""


def misses(together: Together, board: int, z: Floats, weights: Floats) -> float:
    """How far the marginal likelihood of a board is from the board's own draws.

    Parameters
    ----------
    together : Together
    board : int
    z : (n, n_shared) array
        Standard coordinates at the board's own draws.
    weights : (n,) array
        That make them draws under the campaign's prior; sum to 1.

    Returns
    -------
    float
        The largest difference of a mean, in standard deviations of the draws, or of the logarithm of a standard
        deviation; 0 where too few draws are within the box.
    """
    inside = together.space.is_inside(together.space.u(z))
    if weights[inside].sum() < _FEWEST_INSIDE:
        return 0.0
    own_mean, own_sd = _moments(z[inside], weights[inside] / weights[inside].sum())
    others = tuple(i for i in range(len(together.names)) if i != board)
    mean, sd = _moments(together.space.z(together.space.fine), together.weights(others))
    return float(max(np.abs((mean - own_mean) / own_sd).max(), np.abs(np.log(sd / own_sd)).max()))


def with_normal(together: Together, members: Sequence[Member]) -> tuple[Together, tuple[str, ...]]:
    """The boards together, normal likelihoods in place of those that do not give back their board's draws.

    Returns
    -------
    together : Together
    replaced : tuple of str
        Names of these boards.
    """
    off = [i for i, one in enumerate(members) if misses(together, i, one.z, one.weights) > _FAR_OFF]
    if not off:
        return together, ()
    values = together.at_nodes.copy()
    for i in off:
        pull = together.pulls[i]
        nodes = together.space.nodes
        values[i] = nodes @ pull.lean - 0.5 * np.einsum("ni,ij,nj->n", nodes, pull.precision, nodes)
    normal = replace(together, at_nodes=values.copy())
    for i in off:  # at the level that the board's readings have
        others = tuple(j for j in range(len(members)) if j != i)
        values[i] += together.log_evidence(others) - normal.log_evidence(others)
    return replace(together, at_nodes=values), tuple(together.names[i] for i in off)


def _moments(z: Floats, weights: Floats) -> tuple[Floats, Floats]:
    mean = weights @ z
    return mean, np.sqrt(weights @ (z - mean) ** 2)
