"""Fits that the tests of commands share: each is sampled once a session."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
import runs

import bayesplate
from bayesplate.board.shelf import shelf_folder
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.sampling import SamplerSettings

CLOSED_GATE = Gate(tau_count_min=1e9)
STOPPED_AFTER = 200
"""Two chunks, no more than the shortest run that the real gate lets through."""


@pytest.fixture(scope="session")
def fiemme(tmp_path_factory: pytest.TempPathFactory) -> bayesplate.FitResult:
    """The paper's clamped board, seed 1, through the library: the linear law serves."""
    return bayesplate.fit("fiemme-spruce-clamped", out=tmp_path_factory.mktemp("fiemme") / "out")


@pytest.fixture(scope="session")
def fiemme_files(fiemme: bayesplate.FitResult) -> dict[str, bytes]:
    """What that fit wrote."""
    assert fiemme.folder is not None
    return runs.files_in(fiemme.folder)


@pytest.fixture(scope="session")
def finnish(tmp_path_factory: pytest.TempPathFactory) -> runs.Run:
    """The paper's cantilever board through the command line: the exact law is needed."""
    return runs.fit(tmp_path_factory.mktemp("finnish") / "out", "finnish-spruce-cantilever", "--no-report")


@pytest.fixture(scope="session")
def free(tmp_path_factory: pytest.TempPathFactory) -> runs.Run:
    """A free board with nine labelled and seven unlabelled peaks, taken to be uniform, printed as JSON."""
    return runs.fit(
        tmp_path_factory.mktemp("free") / "out", "spruce-free-2R", "--effects", "none", "--json", "--no-report"
    )


@pytest.fixture
def quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sampler whose first judgement passes."""
    runs.sample_loosely(monkeypatch)


@pytest.fixture
def quick_fit(tmp_path: Path, quickly: None) -> Callable[..., runs.Run]:
    """`bayesplate fit` with a gate that passes at once, and without a report."""

    def run(*arguments: str) -> runs.Run:
        return runs.fit(tmp_path / "out", *arguments, "--no-report")

    return run


@pytest.fixture(scope="session")
def stopped_once(tmp_path_factory: pytest.TempPathFactory) -> runs.Run:
    """The clamped board, stopped after two chunks by a gate that lets nothing through: an unfinished run."""
    with pytest.MonkeyPatch.context() as patched:
        settings = partial(SamplerSettings, max_steps=STOPPED_AFTER, gate=CLOSED_GATE)
        patched.setattr("bayesplate.commands.fitting.SamplerSettings", settings)
        return runs.fit(tmp_path_factory.mktemp("stopped") / "out", "fiemme-spruce-clamped", "--json", "--no-report")


@pytest.fixture
def stopped(stopped_once: runs.Run, tmp_path: Path) -> runs.Run:
    """The unfinished run in a folder that may be changed."""
    return replace(stopped_once, folder=shutil.copytree(stopped_once.folder, tmp_path / "out"))


@pytest.fixture
def own_card(tmp_path: Path) -> Path:
    """The card of the clamped board as a file of the user's own."""
    shipped = shelf_folder("boards") / "fiemme-spruce-clamped.toml"
    return Path(shutil.copy(shipped, tmp_path))
