"""The tree of draws: what is written is what ArviZ reads, byte for byte the same each time."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from bayesplate.results.archive import DRAW_DIMENSIONS, GROUPS, build_tree, to_arviz, write_tree

LABELS = ["(1,0)", "(1,1)", "(2,0)"]


def content():
    rng = np.random.default_rng(8)
    sampled = rng.standard_normal
    return {
        "groups": {
            "posterior": {
                "E_x": (DRAW_DIMENSIONS, sampled((4, 50))),
                "tension": ((*DRAW_DIMENSIONS, "edge"), sampled((4, 50, 2))),
            },
            "log_prior": {"tension": (DRAW_DIMENSIONS, sampled((4, 50)))},
            "log_likelihood": {"frequency": ((*DRAW_DIMENSIONS, "mode"), sampled((4, 50, 3)))},
            "sample_stats": {"lp": (DRAW_DIMENSIONS, sampled((4, 50))), "tau": (["parameter"], np.array([20.0, 21.0]))},
            "observed_data": {"frequency": (["mode"], np.array([52.0, 98.0, 310.0]))},
        },
        "labels": {"mode": LABELS, "edge": ["x0", "y0"], "parameter": ["E_x", "größe"]},
        "attributes": {"seed": "1", "card": "length_x_mm = 253  # größe\n" * 4000},
    }


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "posterior.nc"
    write_tree(path, build_tree(**content()))
    return path


def test_arviz_reads_from_the_file_what_it_gets_without_one(path):
    import arviz

    given = content()
    for found in (arviz.from_netcdf(str(path), engine="h5netcdf"), to_arviz(build_tree(**given))):
        for group, variables in given["groups"].items():
            assert set(found[group].data_vars) == set(variables)
            for name, (dims, values) in variables.items():
                assert found[group][name].dims == tuple(dims)
                np.testing.assert_array_equal(found[group][name].values, values)
                for dim in dims:
                    wanted = given["labels"].get(dim) or list(range(values.shape[dims.index(dim)]))
                    assert found[group].coords[dim].values.tolist() == wanted
        assert {key: found.attrs[key] for key in given["attributes"]} == given["attributes"]


def test_where_arviz_works_with_trees_it_gets_one(monkeypatch):
    """ArviZ 1.x has no InferenceData, and from 1.3 on leads who asks for it to the tree."""
    import arviz
    import xarray

    monkeypatch.delitem(vars(arviz), "InferenceData", raising=False)
    monkeypatch.setitem(vars(arviz), "__getattr__", {"InferenceData": xarray.DataTree}.__getitem__)
    tree = to_arviz(build_tree(**content()))

    assert isinstance(tree, xarray.DataTree)
    assert tuple(tree.children) == GROUPS
    assert tree["posterior"]["tension"].dims == ("chain", "draw", "edge")


def test_the_same_draws_give_the_same_bytes(path, tmp_path):
    again = tmp_path / "elsewhere.nc"
    write_tree(again, build_tree(**content()))
    assert again.read_bytes() == path.read_bytes()
    changed = content()
    changed["groups"]["posterior"]["E_x"][1][0, 0] += 1e-12
    write_tree(again, build_tree(**changed))
    assert again.read_bytes() != path.read_bytes()


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit for the size of a file")
def test_a_cache_and_a_disk_that_cannot_be_written_end_no_process(tmp_path):
    """Of ArviZ, which on its first day in 0.23 announces version 1 and writes into its cache that it did; and of HDF5.

    HDF5, writing to the full disk itself, ended the process with a segmentation fault after all had been said.
    """
    program = (
        "import resource, sys, pathlib, numpy as np\n"
        "from bayesplate.errors import UnwritableError\n"
        "from bayesplate.libraries import load_arviz\n"
        "from bayesplate.results.archive import DRAW_DIMENSIONS, build_tree, write_tree\n"
        "load_arviz().ess\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n"
        "values = np.random.default_rng(1).normal(size=(4, 30_000))\n"
        "tree = build_tree({'posterior': {'a': (DRAW_DIMENSIONS, values)}}, {}, {})\n"
        "try:\n"
        "    write_tree(pathlib.Path(sys.argv[1]), tree)\n"
        "except UnwritableError:\n"
        "    sys.exit(3)\n"
    )
    cache = tmp_path / "a-file"
    cache.touch()
    run = [sys.executable, "-W", "error::FutureWarning", "-c", program, str(tmp_path / "a.nc")]

    assert subprocess.run(run, check=False, env={**os.environ, "XDG_CACHE_HOME": str(cache)}).returncode == 3
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a-file", b"")]
