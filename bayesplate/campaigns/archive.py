"""posterior.nc of a campaign: the draws of what its boards share."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayesplate.campaigns.learning import Learnt
from bayesplate.campaigns.together import values_of
from bayesplate.posterior.inference import MOST_DRAWS_A_CHAIN
from bayesplate.posterior.thinning import thin_walker_major
from bayesplate.results.archive import Archive


def archive_name(name: str) -> str:
    """The name of a shared number as a variable: "transverse_shear.G_xz over E_x", because netCDF keeps the slash."""
    return name.replace(" / ", " over ")


def shared_archive(learnt: Learnt, attributes: Mapping[str, str]) -> Archive:
    """Draws of the shared numbers and their scatters, SI, each board's log likelihood of them, the sampler's health.

    Parameters
    ----------
    learnt : Learnt
    attributes : dict of str
        What is said of their origin.

    Returns
    -------
    Archive
    """
    chains, convergence, together = learnt.chains, learnt.convergence, learnt.together
    thinned = [
        thin_walker_major(each, chains.burn_in, convergence.tau_max, n_draws_max=MOST_DRAWS_A_CHAIN)
        for each in (chains.draws, chains.log_prob)
    ]
    z, log_posterior = thinned
    likelihood = together.log_likelihoods(z.reshape(-1, z.shape[-1])).T.reshape(*z.shape[:2], -1)
    values = values_of(together.coordinates, z)
    return Archive(
        groups={
            "posterior": {archive_name(name): np.asarray(each) for name, each in values.items()},
            "log_likelihood": {"board": likelihood},
            "sample_stats": {
                "lp": log_posterior,
                "tau": convergence.tau,
                "rhat": convergence.rhat,
                "ess": convergence.ess,
            },
        },
        coords={
            "name": list(together.names),
            "parameter": [archive_name(one.name) for one in together.coordinates],
        },
        dims={"board": ["name"], "tau": ["parameter"], "rhat": ["parameter"], "ess": ["parameter"]},
        attributes=attributes,
    )
