"""posterior.nc of a fit: what goes into the archive, and under which names."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.cards import StatedPrior
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.results.archive import write_archive
from bayesplate.results.contract import as_json
from bayesplate.results.summary import Summary


def write_posterior(path: Path, inference: Inference, draws: Draws, summary: Summary, card_text: str) -> None:
    """Write the draws of a fit as an archive that ArviZ opens.

    Parameters
    ----------
    path : Path
    inference : Inference
    draws : Draws
    summary : Summary
        Its header and sampler entries become attributes.
    card_text : str
        The board card as it was read.
    """
    problem, convergence = inference.problem, inference.convergence
    board = problem.board
    setups = [setup.name for setup in board.setups]
    readings = [f"{setup.name} {label}" for setup in board.setups for label in setup.labels]
    write_archive(
        path,
        posterior={**draws.rigidities, **draws.moduli, "noise": draws.noise, **draws.inputs},
        log_likelihood={"frequency": draws.log_likelihood},
        posterior_predictive={"frequency": draws.predictive},
        observed_data={"frequency": np.concatenate([setup.measured for setup in board.setups])},
        sample_stats={
            "lp": draws.log_posterior,
            "tau": convergence.tau,
            "rhat": convergence.rhat,
            "ess": convergence.ess,
        },
        coords={"setup": setups, "reading": readings, "parameter": list(problem.parameters.names)},
        dims={
            "noise": ["setup"],
            "frequency": ["reading"],
            "tau": ["parameter"],
            "rhat": ["parameter"],
            "ess": ["parameter"],
        },
        attributes={
            "card": card_text,
            "prior": problem.prior.name,
            "priors": json.dumps({name: _stated(one) for name, one in problem.prior.stated_constants.items()}),
            "model": json.dumps(as_json(summary.model)),
            "sampler": json.dumps(as_json(summary.sampler)),
            "versions": json.dumps(as_json(summary.versions)),
            "card_sha256": summary.card_sha256,
            "seed": str(summary.seed),
        },
    )


def _stated(prior: StatedPrior) -> dict[str, Any]:
    """What a prior is defined by, and its source."""
    quantity = prior.quantity
    numbers = ("lower", "upper") if quantity.kind == "log-uniform" else ("median", "factor")
    return {"kind": quantity.kind, **{name: getattr(quantity, name) for name in numbers}, "source": prior.source}
