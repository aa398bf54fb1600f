"""The posterior archive: a netCDF file that ArviZ opens, 0.23 and 1.x alike.

Written with h5netcdf alone: that needs neither ArviZ nor xarray, whose imports take seconds, and nothing enters the
file that was not given, so the same input gives the same bytes (ArviZ would add the time of writing).  Read back with
ArviZ.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Arrays = Mapping[str, NDArray[Any]]

GROUPS = ("posterior", "log_likelihood", "posterior_predictive", "sample_stats", "observed_data")


@dataclass(frozen=True)
class Archive:
    """What an archive holds.

    Attributes
    ----------
    groups : dict of dict of array
        Variables by group and name; sampled ones (n_chains, n_draws, ...).
    coords : dict of array
        Coordinate values by dimension, chain and draw included.
    dims : dict of tuple of str
        Dimensions of every variable by name, without chain and draw.
    attributes : dict of str
        Card, priors, versions, seed and the like.
    """

    groups: dict[str, dict[str, NDArray[Any]]]
    coords: dict[str, NDArray[Any]]
    dims: dict[str, tuple[str, ...]]
    attributes: dict[str, str]


def write_archive(
    path: Path,
    *,
    posterior: Arrays,
    log_likelihood: Arrays,
    posterior_predictive: Arrays,
    observed_data: Arrays,
    sample_stats: Arrays,
    coords: Mapping[str, Sequence[str] | NDArray[Any]],
    dims: Mapping[str, Sequence[str]],
    attributes: Mapping[str, str],
) -> None:
    """Write the archive, completely or not at all.

    Parameters
    ----------
    path : Path
    posterior, log_likelihood, posterior_predictive, sample_stats : mapping of (n_chains, n_draws, ...) arrays
        By variable name.  In `sample_stats` also arrays without the first two axes, such as one number a parameter.
    observed_data : mapping of arrays
        Without chain and draw.
    coords : mapping
        Labels of every dimension besides chain and draw: texts or numbers.
    dims : mapping
        Dimensions of each variable besides chain and draw; absent for one number a draw.
    attributes : mapping of str
        Written at the root of the file.

    Raises
    ------
    ValueError
        If an array does not fit its dimensions.
    """
    import h5netcdf

    path = Path(path)
    given = (posterior, log_likelihood, posterior_predictive, sample_stats, observed_data)
    n_chains, n_draws = next(iter(posterior.values())).shape[:2]
    axes = {"chain": np.arange(n_chains), "draw": np.arange(n_draws)} | {
        name: np.asarray(labels) for name, labels in coords.items()
    }
    partial = path.with_name(path.name + ".partial")
    try:
        with h5netcdf.File(partial, "w") as file:
            for key in sorted(attributes):
                file.attrs[key] = attributes[key]
            for group_name, variables in zip(GROUPS, given, strict=True):
                placed = {
                    name: _place(name, np.asarray(value), dims.get(name, ()), axes, group_name != "observed_data")
                    for name, value in variables.items()
                }
                _write_group(file.create_group(group_name), placed, axes)
        with partial.open("rb") as stream:
            os.fsync(stream.fileno())
        os.replace(partial, path)
    finally:
        with suppress(FileNotFoundError):
            partial.unlink()


def _place(
    name: str, value: NDArray[Any], extra: Sequence[str], axes: Arrays, may_be_sampled: bool
) -> tuple[tuple[str, ...], NDArray[Any]]:
    """Dimensions of a variable, checked against its shape, and its value in a type that netCDF knows."""
    plain = tuple(extra)
    sampled = ("chain", "draw", *plain)
    used = sampled if may_be_sampled and value.ndim == len(sampled) else plain
    unknown = [dim for dim in used if dim not in axes]
    if unknown:
        raise ValueError(f"archive {name}: wanted coords for {', '.join(unknown)}, got none")
    wanted = tuple(len(axes[dim]) for dim in used)
    if value.shape != wanted:
        raise ValueError(f"archive {name}: wanted shape {wanted} for {used}, got {value.shape}")
    return used, value.astype(np.int8) if value.dtype == np.bool_ else value


def _write_group(group: Any, placed: Mapping[str, tuple[tuple[str, ...], NDArray[Any]]], axes: Arrays) -> None:
    """Write one group with the coordinates that its variables use."""
    used = [dim for dim in axes if any(dim in its_dims for its_dims, _ in placed.values())]
    group.dimensions = {dim: len(axes[dim]) for dim in used}
    for name, (its_dims, value) in ({dim: ((dim,), axes[dim]) for dim in used} | dict(placed)).items():
        _write_variable(group, name, its_dims, value)


def _write_variable(group: Any, name: str, its_dims: tuple[str, ...], value: NDArray[Any]) -> None:
    import h5py

    if value.dtype.kind in "UOT":
        group.create_variable(name, its_dims, dtype=h5py.string_dtype(), data=value.astype(object))
    else:
        group.create_variable(name, its_dims, data=value)


def read_archive(path: Path) -> Archive:
    """Read an archive back through ArviZ.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Archive
        Plain arrays; nothing of ArviZ or xarray leaves this module.
    """
    arviz: Any = import_module("arviz")  # typed in 1.x, not in 0.23
    tree = arviz.from_netcdf(str(path), engine="h5netcdf")
    groups: dict[str, dict[str, NDArray[Any]]] = {}
    coords: dict[str, NDArray[Any]] = {}
    dims: dict[str, tuple[str, ...]] = {}
    for group in GROUPS:
        dataset = tree[group]
        groups[group] = {str(name): np.array(array.values) for name, array in dataset.data_vars.items()}
        coords |= {str(name): np.array(array.values) for name, array in dataset.coords.items()}
        dims |= {
            str(name): tuple(str(dim) for dim in array.dims if dim not in ("chain", "draw"))
            for name, array in dataset.data_vars.items()
        }
    attributes = {str(key): str(value) for key, value in tree.attrs.items() if not str(key).startswith("_")}
    if hasattr(tree, "close"):
        tree.close()  # an open file would keep the archive from being written again
    return Archive(groups, coords, dims, attributes)
