"""The draws of a fit as ArviZ has them: one tree, in memory and as posterior.nc, for ArviZ 0.23 and 1.x alike."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.board.prior import StatedPrior
from bayesplate.files import write_bytes
from bayesplate.libraries import load_arviz
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.results.contract import as_json
from bayesplate.results.summary import Summary

Variables = Mapping[str, tuple[Sequence[str], NDArray[Any]]]
GROUPS = ("posterior", "log_prior", "log_likelihood", "posterior_predictive", "sample_stats", "observed_data")
"""In the order of the file; a group of which nothing is known is empty."""
DRAWN = ("chain", "draw")
"""Dimensions of every draw; chain = ensemble."""


def tree_of(groups: Mapping[str, Variables], labels: Mapping[str, Sequence[str]], attributes: Mapping[str, str]) -> Any:
    """A tree of groups (`GROUPS`) of variables, and labels of each dimension besides chain and draw: xarray.DataTree.

    Nothing is in it that was not given, so that the same draws give the same file.
    """
    xarray: Any = import_module("xarray")
    datasets = {"/": xarray.Dataset(attrs=dict(sorted(attributes.items())))}
    for group in GROUPS:
        dataset = xarray.Dataset(dict(groups.get(group, {})))
        axes: dict[Any, Any] = {name: np.arange(size) for name, size in dataset.sizes.items() if name in DRAWN}
        named = {name: list(each) for name, each in labels.items() if name in dataset.sizes}
        datasets[group] = dataset.assign_coords(axes | named)
    return xarray.DataTree.from_dict(datasets)


def to_arviz(tree: Any) -> Any:
    """A tree as the ArviZ that is installed works with it: InferenceData in 0.23, itself in 1.x; no file is written."""
    arviz = load_arviz()
    if "InferenceData" in vars(arviz):  # 1.3 answers to the name with a warning, and has a tree behind it
        return arviz.InferenceData.from_datatree(tree)
    return tree.copy()


def write_tree(path: Path, tree: Any) -> None:
    """Write a tree as netCDF, completely or not at all."""
    # Not by HDF5 itself, which ends the process at its end where a disk was full.
    write_bytes(Path(path), bytes(tree.to_netcdf(None, engine="h5netcdf")))


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


def posterior_tree(inference: Inference, draws: Draws, attributes: Mapping[str, str]) -> Any:
    """The draws of a fit under the names of the archive: xarray.DataTree.

    Its group log_prior holds one variable per factor of the prior: constants, noise, and inputs if any is uncertain.
    """
    problem = inference.problem
    board = problem.board
    factors = problem.posterior.log_prior_factors(draws.flat)
    all_sure = not any(problem.posterior.peaks)
    likelihood, of_what = ("frequency", "reading") if all_sure else ("readings_and_peaks", "factor")
    drawn = {**draws.rigidities, **draws.moduli, **draws.inputs}
    return tree_of(
        {
            "posterior": {
                **{name: (DRAWN, values) for name, values in drawn.items()},
                "noise": ((*DRAWN, "setup"), draws.noise),
            },
            "log_prior": {name: (DRAWN, values.reshape(draws.log_posterior.shape)) for name, values in factors.items()},
            "log_likelihood": {likelihood: ((*DRAWN, of_what), draws.log_likelihood)},
            "posterior_predictive": {"frequency": ((*DRAWN, "reading"), draws.predictive)},
            "sample_stats": sample_stats(draws.log_posterior, inference.convergence),
            "observed_data": {"frequency": (("reading",), np.concatenate([setup.measured for setup in board.setups]))},
        },
        {
            "setup": [setup.name for setup in board.setups],
            "reading": board.reading_names,
            "factor": problem.posterior.factors,
            "parameter": problem.parameters.names,
        },
        attributes,
    )


def sample_stats(log_posterior: Floats, convergence: Convergence) -> Variables:
    """The log posterior of each draw, and the sampler's health by parameter."""
    health = {name: (("parameter",), getattr(convergence, name)) for name in ("tau", "rhat", "ess")}
    return {"lp": (DRAWN, log_posterior), **health}


def _stated(prior: StatedPrior) -> dict[str, Any]:
    """What a prior is defined by, and its source."""
    quantity = prior.quantity
    numbers = ("lower", "upper") if quantity.kind == "log-uniform" else ("median", "factor")
    return {"kind": quantity.kind, **{name: getattr(quantity, name) for name in numbers}, "source": prior.source}
