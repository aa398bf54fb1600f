"""The draws of a fit as one ArviZ tree, in memory and as posterior.nc, for ArviZ 0.23 and 1.x alike."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.board.prior import PriorCard, StatedPrior
from bayesplate.files import write_bytes
from bayesplate.libraries import load_arviz
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.draws import Draws
from bayesplate.results.contract import as_json
from bayesplate.results.summary import Summary

Variables = Mapping[str, tuple[Sequence[str], NDArray[Any]]]
GROUPS = ("posterior", "log_prior", "log_likelihood", "posterior_predictive", "sample_stats", "observed_data")
"""Groups of the archive in the order of the file; a group without variables is empty."""
DRAW_DIMENSIONS = ("chain", "draw")
"""Dimensions of every variable that is drawn; chain = ensemble."""


def build_tree(
    groups: Mapping[str, Variables], labels: Mapping[str, Sequence[str]], attributes: Mapping[str, str]
) -> Any:
    """A tree of groups (`GROUPS`) of variables, with labels of each dimension besides chain and draw: xarray.DataTree.

    It holds nothing else, no date for instance, so that the same draws give the same file.
    """
    xarray: Any = import_module("xarray")
    datasets = {"/": xarray.Dataset(attrs=dict(sorted(attributes.items())))}
    for group in GROUPS:
        dataset = xarray.Dataset(dict(groups.get(group, {})))
        axes: dict[Any, Any] = {
            name: np.arange(size) for name, size in dataset.sizes.items() if name in DRAW_DIMENSIONS
        }
        coordinates = {name: list(entries) for name, entries in labels.items() if name in dataset.sizes}
        datasets[group] = dataset.assign_coords(axes | coordinates)
    return xarray.DataTree.from_dict(datasets)


def to_arviz(tree: Any) -> Any:
    """A tree for the installed ArviZ: as InferenceData in 0.23, as it is in 1.x; no file is written."""
    arviz = load_arviz()
    if "InferenceData" in vars(arviz):  # 1.3 answers to the name with a warning, and has a tree behind it
        return arviz.InferenceData.from_datatree(tree)
    return tree.copy()


def write_tree(path: Path, tree: Any) -> None:
    """Write a tree as netCDF, completely or not at all."""
    # not by HDF5 itself, which aborts the process at exit if the disk was full
    write_bytes(Path(path), bytes(tree.to_netcdf(None, engine="h5netcdf")))


def archive_attributes(prior: PriorCard, summary: Summary, card_text: str) -> dict[str, str]:
    """Origin of a fit as attributes of its archive; the model and the sampler's entries are those of its summary."""
    return {
        "card": card_text,
        "prior": prior.name,
        "priors": json.dumps({name: _prior_content(stated) for name, stated in prior.stated_constants.items()}),
        "model": json.dumps(as_json(summary.model)),
        "sampler": json.dumps(as_json(summary.sampler)),
        "versions": json.dumps(as_json(summary.versions)),
        "card_sha256": summary.card_sha256,
        "seed": str(summary.seed),
    }


def posterior_tree(draws: Draws, attributes: Mapping[str, str]) -> Any:
    """The draws of a fit by the names of the archive: xarray.DataTree.

    Its group log_prior holds one variable per factor of the prior: constants, noise, and inputs if any is uncertain.
    """
    problem = draws.problem
    board = problem.board
    factors = problem.posterior.log_prior_factors(draws.flat)
    all_sure = not any(problem.posterior.peaks)
    likelihood, dimension = ("frequency", "reading") if all_sure else ("readings_and_peaks", "factor")
    variables = {**draws.rigidities, **draws.moduli, **draws.inputs}
    return build_tree(
        {
            "posterior": {
                **{name: (DRAW_DIMENSIONS, values) for name, values in variables.items()},
                "noise": ((*DRAW_DIMENSIONS, "setup"), draws.noise),
            },
            "log_prior": {
                name: (DRAW_DIMENSIONS, values.reshape(draws.log_posterior.shape)) for name, values in factors.items()
            },
            "log_likelihood": {likelihood: ((*DRAW_DIMENSIONS, dimension), draws.log_likelihood)},
            "posterior_predictive": {"frequency": ((*DRAW_DIMENSIONS, "reading"), draws.predictive)},
            "sample_stats": sample_stats(draws.log_posterior, draws.inference.convergence),
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
    return {"lp": (DRAW_DIMENSIONS, log_posterior), **health}


def _prior_content(prior: StatedPrior) -> dict[str, Any]:
    """The numbers that define a prior, and its source."""
    quantity = prior.quantity
    numbers = ("lower", "upper") if quantity.kind == "log-uniform" else ("median", "factor")
    return {"kind": quantity.kind, **{name: getattr(quantity, name) for name in numbers}, "source": prior.source}
