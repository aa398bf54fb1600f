"""The posterior archive: a netCDF file that ArviZ opens, 0.23 and 1.x alike.

Written with h5netcdf alone: that needs neither ArviZ nor xarray, whose imports take seconds, and nothing enters the
file that was not given, so the same input gives the same bytes (ArviZ would add the time of writing).  Read back with
ArviZ.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.files import write_bytes
from bayesplate.libraries import load_arviz

Arrays = Mapping[str, NDArray[Any]]

GROUPS = ("posterior", "log_prior", "log_likelihood", "posterior_predictive", "sample_stats", "observed_data")
"""In the order of the file; all but the last hold one value per chain and draw, or in sample_stats none."""


@dataclass(frozen=True)
class Archive:
    """What an archive holds, as plain arrays.

    Attributes
    ----------
    groups : dict of dict of array
        Variables by group (`GROUPS`) and name; sampled ones (n_chains, n_draws, ...). In `sample_stats` also arrays
        without the first two axes, such as one number per parameter; in `observed_data` no others.
    coords : dict of array
        Labels of every dimension besides chain and draw: texts or numbers. One that was read has those of chain and
        draw too.
    dims : dict of tuple of str
        Dimensions of a variable by its name, besides chain and draw; absent or empty for one number per draw.
    attributes : dict of str
        Card, priors, versions, seed and the like.
    """

    groups: Mapping[str, Arrays]
    coords: Mapping[str, Sequence[str] | NDArray[Any]]
    dims: Mapping[str, Sequence[str]]
    attributes: Mapping[str, str]

    def placed(self) -> tuple[Arrays, dict[str, dict[str, tuple[tuple[str, ...], NDArray[Any]]]]]:
        """Labels of every dimension, and each variable by group and name with its dimensions.

        Raises
        ------
        ValueError
            If an array does not fit its dimensions.
        """
        n_chains, n_draws = next(iter(self.groups["posterior"].values())).shape[:2]
        axes = {"chain": np.arange(n_chains), "draw": np.arange(n_draws)}
        axes |= {name: np.asarray(labels) for name, labels in self.coords.items()}
        found = {
            group: {
                name: _place(name, np.asarray(value), self._further(group, name), axes, group != "observed_data")
                for name, value in self.groups.get(group, {}).items()
            }
            for group in GROUPS
        }
        return axes, found

    def _further(self, group: str, name: str) -> Sequence[str]:
        """Dimensions besides chain and draw; a factor of the prior is one number per draw, whatever bears its name."""
        return () if group == "log_prior" else self.dims.get(name, ())


def write_archive(path: Path, archive: Archive) -> None:
    """Write an archive, completely or not at all.

    Parameters
    ----------
    path : Path
    archive : Archive

    Raises
    ------
    ValueError
        If an array does not fit its dimensions.
    UnwritableError
        If the disk is full or the place is not ours.
    """
    import h5netcdf

    axes, groups = archive.placed()
    content = BytesIO()  # for HDF5 ends the process at its end where a disk was full
    with h5netcdf.File(content, "w") as file:
        for key in sorted(archive.attributes):
            file.attrs[key] = archive.attributes[key]
        for name, variables in groups.items():
            _write_group(file.create_group(name), variables, axes)
    write_bytes(Path(path), content.getvalue())


def to_arviz(archive: Archive) -> Any:
    """An archive as what ArviZ works with: InferenceData in 0.23, DataTree in 1.x; no file is written.

    Parameters
    ----------
    archive : Archive

    Returns
    -------
    arviz.InferenceData or xarray.DataTree
    """
    xarray: Any = import_module("xarray")
    arviz = load_arviz()
    axes, groups = archive.placed()
    datasets = {}
    for name, variables in groups.items():
        used = {dim: axes[dim] for dim in axes if any(dim in dims for dims, _ in variables.values())}
        datasets[name] = xarray.Dataset(variables, coords=used)
    if "InferenceData" in vars(arviz):  # 1.3 answers to the name with a warning, and has a tree behind it
        return arviz.InferenceData(attrs=dict(archive.attributes), **datasets)
    return xarray.DataTree.from_dict({"/": xarray.Dataset(attrs=dict(archive.attributes)), **datasets})


def _place(
    name: str, value: NDArray[Any], extra: Sequence[str], axes: Arrays, may_be_sampled: bool
) -> tuple[tuple[str, ...], NDArray[Any]]:
    """Dimensions of a variable, checked against its shape, and its value in a type that netCDF knows."""
    plain = tuple(extra)
    sampled = ("chain", "draw", *plain)
    used = sampled if may_be_sampled and value.ndim == len(sampled) else plain
    if name in used:
        raise ValueError(f"archive {name}: wanted a name that none of its dimensions {used} has")
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
    tree = load_arviz().from_netcdf(str(path), engine="h5netcdf")
    groups: dict[str, dict[str, NDArray[Any]]] = {}
    coords: dict[str, NDArray[Any]] = {}
    dims: dict[str, tuple[str, ...]] = {}
    for group in GROUPS:
        dataset = tree[group]
        groups[group] = {str(name): np.array(array.values) for name, array in dataset.data_vars.items()}
        coords |= {str(name): np.array(array.values) for name, array in dataset.coords.items()}
        dims |= (
            {}
            if group == "log_prior"
            else {
                str(name): tuple(str(dim) for dim in array.dims if dim not in ("chain", "draw"))
                for name, array in dataset.data_vars.items()
            }
        )
    attributes = {str(key): str(value) for key, value in tree.attrs.items() if not str(key).startswith("_")}
    if hasattr(tree, "close"):
        tree.close()  # an open file would keep the archive from being written again
    return Archive(groups, coords, dims, attributes)
