"""posterior.nc of a fit: what goes into the archive, and under which names."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.board.prior import StatedPrior
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.results.archive import Archive, write_archive
from bayesplate.results.contract import as_json
from bayesplate.results.summary import Summary


def write_posterior(path: Path, inference: Inference, draws: Draws, summary: Summary, card_text: str) -> None:
    """Write the draws of a fit as an archive that ArviZ opens; parameters as of `posterior_archive`."""
    write_archive(path, posterior_archive(inference, draws, attributes_of(inference, summary, card_text)))


def attributes_of(inference: Inference, summary: Summary, card_text: str) -> dict[str, str]:
    """What the archive of a fit says of its origin; the header and the sampler's entries are those of its summary."""
    return {
        "card": card_text,
        "prior": inference.problem.prior.name,
        "priors": json.dumps({name: _stated(one) for name, one in inference.problem.prior.stated_constants.items()}),
        "model": json.dumps(as_json(summary.model)),
        "sampler": json.dumps(as_json(summary.sampler)),
        "versions": json.dumps(as_json(summary.versions)),
        "card_sha256": summary.card_sha256,
        "seed": str(summary.seed),
    }


def posterior_archive(inference: Inference, draws: Draws, attributes: Mapping[str, str]) -> Archive:
    """The draws of a fit under the names of the archive.

    Parameters
    ----------
    inference : Inference
    draws : Draws
    attributes : dict of str
        What is said of their origin.

    Returns
    -------
    Archive
        Its group log_prior holds one variable per factor of the prior: constants, noise, and inputs if any is
        uncertain.
    """
    problem, convergence = inference.problem, inference.convergence
    board = problem.board
    factors = problem.posterior.log_prior_factors(draws.flat)
    all_sure = not any(problem.posterior.peaks)
    return Archive(
        groups={
            "posterior": {**draws.rigidities, **draws.moduli, "noise": draws.noise, **draws.inputs},
            "log_prior": {name: values.reshape(draws.log_posterior.shape) for name, values in factors.items()},
            "log_likelihood": {"frequency" if all_sure else "readings_and_peaks": draws.log_likelihood},
            "posterior_predictive": {"frequency": draws.predictive},
            "sample_stats": {
                "lp": draws.log_posterior,
                "tau": convergence.tau,
                "rhat": convergence.rhat,
                "ess": convergence.ess,
            },
            "observed_data": {"frequency": np.concatenate([setup.measured for setup in board.setups])},
        },
        coords={
            "setup": [setup.name for setup in board.setups],
            "reading": board.reading_names,
            **({} if all_sure else {"factor": problem.posterior.factors}),
            "parameter": list(problem.parameters.names),
        },
        dims={
            "noise": ["setup"],
            "frequency": ["reading"],
            "readings_and_peaks": ["factor"],
            "tau": ["parameter"],
            "rhat": ["parameter"],
            "ess": ["parameter"],
        },
        attributes=attributes,
    )


def _stated(prior: StatedPrior) -> dict[str, Any]:
    """What a prior is defined by, and its source."""
    quantity = prior.quantity
    numbers = ("lower", "upper") if quantity.kind == "log-uniform" else ("median", "factor")
    return {"kind": quantity.kind, **{name: getattr(quantity, name) for name in numbers}, "source": prior.source}
