"""posterior.nc of a campaign: the draws of what its boards share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bayesplate.campaign.learning import Learnt
from bayesplate.campaign.together import values_of
from bayesplate.posterior.inference import MOST_DRAWS_A_CHAIN
from bayesplate.posterior.statistics import thin_walker_major
from bayesplate.results.archive import DRAWN, tree_of


def archive_name(name: str) -> str:
    """The name of a shared number as a variable: "transverse_shear.G_xz over E_x", because netCDF keeps the slash."""
    return name.replace(" / ", " over ")


def shared_tree(learnt: Learnt, attributes: Mapping[str, str]) -> Any:
    """Draws of the shared numbers and their scatters, SI, each board's log likelihood of them, the sampler's health.

    Parameters
    ----------
    attributes : dict of str
        What is said of their origin.

    Returns
    -------
    xarray.DataTree
    """
    chains, convergence, together = learnt.chains, learnt.convergence, learnt.together
    thinned = [
        thin_walker_major(each, chains.burn_in, convergence.tau_max, n_draws_max=MOST_DRAWS_A_CHAIN)
        for each in (chains.draws, chains.log_prob)
    ]
    z, log_posterior = thinned
    likelihood = together.log_likelihoods(z.reshape(-1, z.shape[-1])).T.reshape(*z.shape[:2], -1)
    values = values_of(together.coordinates, z)
    return tree_of(
        {
            "posterior": {archive_name(name): (DRAWN, np.asarray(each)) for name, each in values.items()},
            "log_likelihood": {"board": ((*DRAWN, "name"), likelihood)},
            "sample_stats": {
                "lp": (DRAWN, log_posterior),
                **{name: (("parameter",), getattr(convergence, name)) for name in ("tau", "rhat", "ess")},
            },
        },
        {"name": together.names, "parameter": [archive_name(one.name) for one in together.coordinates]},
        attributes,
    )
