"""The posterior archive: what is written is what ArviZ reads, byte for byte the same each time."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bayesplate.results import archive as archive_module
from bayesplate.results.archive import GROUPS, Archive, read_archive, to_arviz, write_archive

LABELS = ["(1,0)", "(1,1)", "(2,0)"]


def content():
    rng = np.random.default_rng(8)
    sampled = rng.standard_normal
    return {
        "groups": {
            "posterior": {"E_x": sampled((4, 50)), "tension": sampled((4, 50, 2))},
            "log_prior": {"tension": sampled((4, 50))},
            "log_likelihood": {"frequency": sampled((4, 50, 3))},
            "posterior_predictive": {"frequency": sampled((4, 50, 3))},
            "sample_stats": {"lp": sampled((4, 50)), "moved": sampled((4, 50)) > 0, "tau": np.array([20.0, 21.0])},
            "observed_data": {"frequency": np.array([52.0, 98.0, 310.0])},
        },
        "coords": {"mode": LABELS, "edge": np.array(["x0", "y0"]), "parameter": ["E_x", "größe"]},
        "dims": {"frequency": ["mode"], "tension": ["edge"], "tau": ["parameter"]},
        "attributes": {"seed": "1", "card": "length_x_mm = 253  # größe\n" * 4000},
    }


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "posterior.nc"
    write_archive(path, Archive(**content()))
    return path


def test_everything_comes_back(path):
    archive = read_archive(path)
    given = content()
    assert tuple(archive.groups) == GROUPS
    for group in GROUPS:
        assert set(archive.groups[group]) == set(given["groups"][group])
        for name, value in given["groups"][group].items():
            np.testing.assert_array_equal(archive.groups[group][name], value)
    assert archive.attributes == given["attributes"]
    assert archive.coords["mode"].tolist() == LABELS
    assert archive.coords["parameter"].tolist() == ["E_x", "größe"]
    assert archive.coords["draw"].tolist() == list(range(50))
    assert archive.dims["frequency"] == ("mode",)
    assert archive.dims["lp"] == ()


def test_arviz_summarises_it(path):
    import arviz

    summary = arviz.summary(arviz.from_netcdf(str(path)), round_to=8)
    assert list(summary.index) == ["E_x", "tension[x0]", "tension[y0]"]
    assert float(summary["mean"].iloc[0]) == pytest.approx(content()["groups"]["posterior"]["E_x"].mean(), abs=1e-6)


def test_without_a_file_arviz_gets_what_it_reads_from_one(path):
    import arviz

    read, made = arviz.from_netcdf(str(path)), to_arviz(Archive(**content()))
    for group in GROUPS:
        assert set(made[group].data_vars) == set(read[group].data_vars)
        for name, variable in read[group].data_vars.items():
            assert made[group][name].dims == variable.dims
            np.testing.assert_array_equal(made[group][name].values, variable.values)
        for name, labels in read[group].coords.items():
            assert made[group].coords[name].values.tolist() == labels.values.tolist()
    assert {key: value for key, value in read.attrs.items() if key in made.attrs} == dict(made.attrs)


def test_where_arviz_works_with_trees_it_gets_one(monkeypatch):
    """ArviZ 1.x has no InferenceData, and from 1.3 on leads who asks for it to the tree; that holds the same groups."""
    import arviz
    import xarray

    monkeypatch.delitem(vars(arviz), "InferenceData", raising=False)
    monkeypatch.setitem(vars(arviz), "__getattr__", {"InferenceData": xarray.DataTree}.__getitem__)
    tree = to_arviz(Archive(**content()))

    assert isinstance(tree, xarray.DataTree)
    assert set(tree.children) == set(GROUPS)
    assert tree["posterior"]["tension"].dims == ("chain", "draw", "edge")
    assert tree["log_prior"]["tension"].dims == ("chain", "draw")
    assert tree.attrs["seed"] == "1"


def test_the_same_input_gives_the_same_bytes(path, tmp_path):
    again = tmp_path / "elsewhere.nc"
    write_archive(again, Archive(**content()))
    assert hashlib.sha256(again.read_bytes()).digest() == hashlib.sha256(path.read_bytes()).digest()
    changed = content()
    changed["groups"]["posterior"]["E_x"][0, 0] += 1e-12
    write_archive(again, Archive(**changed))
    assert again.read_bytes() != path.read_bytes()


def test_an_archive_that_was_read_can_be_written_again(path):
    read_archive(path)
    write_archive(path, Archive(**content()))
    assert read_archive(path).groups["posterior"]["E_x"].shape == (4, 50)


def test_a_failed_write_leaves_the_old_archive(path):
    before = path.read_bytes()
    changed = content()
    changed["groups"]["observed_data"]["frequency"] = np.zeros(4)
    with pytest.raises(ValueError, match=r"archive frequency: wanted shape \(3,\) for \('mode',\), got \(4,\)"):
        write_archive(path, Archive(**changed))
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_a_variable_with_the_name_of_its_dimension_is_refused(tmp_path):
    """ArviZ would leave its group out."""
    changed = content()
    changed["dims"]["frequency"], changed["coords"]["frequency"] = ["frequency"], changed["coords"].pop("mode")
    with pytest.raises(ValueError, match="archive frequency: wanted a name that none of its dimensions"):
        write_archive(tmp_path / "posterior.nc", Archive(**changed))


def test_a_dimension_without_labels_is_refused(tmp_path):
    changed = content()
    del changed["coords"]["mode"]
    with pytest.raises(ValueError, match="wanted coords for mode"):
        write_archive(tmp_path / "posterior.nc", Archive(**changed))


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit for the size of a file")
def test_a_disk_that_is_full_in_the_middle_of_it_ends_no_process(tmp_path):
    """HDF5, writing to the disk itself, ended it with a segmentation fault after all had been said."""
    program = (
        "import resource, sys, pathlib, numpy as np\n"
        "from bayesplate.errors import UnwritableError\n"
        "from bayesplate.results.archive import Archive, write_archive\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n"
        "groups = {'posterior': {'a': np.random.default_rng(1).normal(size=(4, 30_000))}}\n"
        "try:\n"
        "    write_archive(pathlib.Path(sys.argv[1]), Archive(groups, {}, {}, {}))\n"
        "except UnwritableError:\n"
        "    sys.exit(3)\n"
    )
    root = Path(archive_module.__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", program, str(tmp_path / "a.nc")], check=False, cwd=root)

    assert done.returncode == 3
    assert list(tmp_path.iterdir()) == []


def test_writing_imports_neither_arviz_nor_xarray():
    program = (
        "import sys, tempfile, pathlib, numpy as np\n"
        "from bayesplate.results.archive import Archive, write_archive\n"
        "with tempfile.TemporaryDirectory() as folder:\n"
        "    groups = {'posterior': {'a': np.zeros((2, 3))}}\n"
        "    write_archive(pathlib.Path(folder, 'a.nc'), Archive(groups, {}, {}, {}))\n"
        "assert not {'arviz', 'arviz_base', 'xarray'} & set(sys.modules)\n"
    )
    root = Path(archive_module.__file__).parents[2]
    subprocess.run([sys.executable, "-c", program], check=True, cwd=root)


@pytest.mark.parametrize("name", ["writable", "a-file"], ids=["a cache", "none that can be written"])
def test_arviz_is_loaded_quietly_whatever_its_user_has_for_a_home(tmp_path, name):
    """On its first day 0.23 announces version 1, as a warning, and writes into the cache that it did."""
    (tmp_path / "a-file").touch()
    program = "from bayesplate.libraries import load_arviz\nload_arviz().ess"
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / name)}
    root = Path(archive_module.__file__).parents[2]
    run = [sys.executable, "-W", "error::FutureWarning", "-c", program]

    assert subprocess.run(run, check=False, cwd=root, env=environment).returncode == 0
    assert (tmp_path / "a-file").read_bytes() == b""
