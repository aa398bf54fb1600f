"""The posterior archive: what is written is what ArviZ reads, byte for byte the same each time."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bayesplate.results import archive as archive_module
from bayesplate.results.archive import GROUPS, read_archive, write_archive

LABELS = ["(1,0)", "(1,1)", "(2,0)"]


def content():
    rng = np.random.default_rng(8)
    sampled = rng.standard_normal
    return {
        "posterior": {"E_x": sampled((4, 50)), "tension": sampled((4, 50, 2))},
        "log_likelihood": {"frequency": sampled((4, 50, 3))},
        "posterior_predictive": {"frequency": sampled((4, 50, 3))},
        "observed_data": {"frequency": np.array([52.0, 98.0, 310.0])},
        "sample_stats": {"lp": sampled((4, 50)), "moved": sampled((4, 50)) > 0, "tau": np.array([20.0, 21.0])},
        "coords": {"mode": LABELS, "edge": np.array(["x0", "y0"]), "parameter": ["E_x", "größe"]},
        "dims": {"frequency": ["mode"], "tension": ["edge"], "tau": ["parameter"]},
        "attributes": {"seed": "1", "card": "length_x_mm = 253  # größe\n" * 4000},
    }


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "posterior.nc"
    write_archive(path, **content())
    return path


def test_everything_comes_back(path):
    archive = read_archive(path)
    given = content()
    assert tuple(archive.groups) == GROUPS
    for group in GROUPS:
        assert set(archive.groups[group]) == set(given[group])
        for name, value in given[group].items():
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
    assert float(summary["mean"].iloc[0]) == pytest.approx(content()["posterior"]["E_x"].mean(), abs=1e-6)


def test_the_same_input_gives_the_same_bytes(path, tmp_path):
    again = tmp_path / "elsewhere.nc"
    write_archive(again, **content())
    assert hashlib.sha256(again.read_bytes()).digest() == hashlib.sha256(path.read_bytes()).digest()
    changed = content()
    changed["posterior"]["E_x"][0, 0] += 1e-12
    write_archive(again, **changed)
    assert again.read_bytes() != path.read_bytes()


def test_an_archive_that_was_read_can_be_written_again(path):
    read_archive(path)
    write_archive(path, **content())
    assert read_archive(path).groups["posterior"]["E_x"].shape == (4, 50)


def test_a_failed_write_leaves_the_old_archive(path):
    before = path.read_bytes()
    changed = content()
    changed["observed_data"]["frequency"] = np.zeros(4)
    with pytest.raises(ValueError, match=r"archive frequency: wanted shape \(3,\) for \('mode',\), got \(4,\)"):
        write_archive(path, **changed)
    assert path.read_bytes() == before
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_a_dimension_without_labels_is_refused(tmp_path):
    changed = content()
    del changed["coords"]["mode"]
    with pytest.raises(ValueError, match="wanted coords for mode"):
        write_archive(tmp_path / "posterior.nc", **changed)


def test_writing_imports_neither_arviz_nor_xarray():
    program = (
        "import sys, tempfile, pathlib, numpy as np\n"
        "from bayesplate.results.archive import write_archive\n"
        "with tempfile.TemporaryDirectory() as folder:\n"
        "    write_archive(pathlib.Path(folder, 'a.nc'), posterior={'a': np.zeros((2, 3))}, log_likelihood={},\n"
        "        posterior_predictive={}, observed_data={}, sample_stats={}, coords={}, dims={}, attributes={})\n"
        "assert not {'arviz', 'arviz_base', 'xarray'} & set(sys.modules)\n"
    )
    root = Path(archive_module.__file__).parents[2]
    subprocess.run([sys.executable, "-c", program], check=True, cwd=root)
