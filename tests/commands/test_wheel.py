"""The wheel holds what a user needs and nothing else, and works far from the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest
from runs import read_json

import bayesplate
from bayesplate.results.contract import as_json

ROOT = Path(bayesplate.__file__).resolve().parents[1]
EXECUTES_DATA = (".pkl", ".pickle", ".joblib", ".dill", ".npy", ".npz", ".pyc", ".so", ".pyd")

pytestmark = pytest.mark.skipif(
    not (ROOT / "pyproject.toml").exists(), reason="needs the checkout that a wheel is built from"
)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from the checkout; pip fetches the build backend unless it is there."""
    folder = tmp_path_factory.mktemp("wheel")
    here = ["--no-build-isolation"] if find_spec("hatchling") else []
    pip("wheel", str(ROOT), "--no-deps", "--wheel-dir", str(folder), *here)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder into which the wheel is installed, its dependencies being those of this environment."""
    target = tmp_path_factory.mktemp("installed")
    pip("install", "--no-deps", "--target", str(target), str(wheel))
    return target


def pip(*arguments: str) -> None:
    done = subprocess.run([sys.executable, "-m", "pip", *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def elsewhere(installed: Path, folder: Path, *arguments: str) -> str:
    """Run Python in another folder, with the installed package before any other."""
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_wheel_holds_the_package_its_cards_and_its_licence(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    cards = {path.relative_to(ROOT).as_posix() for path in (ROOT / "models").rglob("*.toml")}
    modules = {path.relative_to(ROOT).as_posix() for path in (ROOT / "bayesplate").rglob("*.py")}

    assert len(cards) >= 12
    templates = {f"bayesplate/report/templates/report.{ending}" for ending in ("html", "css")}
    assert {f"bayesplate/{card}" for card in cards} | modules | templates | {"bayesplate/py.typed"} <= names
    assert any(name.endswith("dist-info/licenses/LICENSE") for name in names)


def test_the_wheel_holds_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as archive:
        roots = {name.partition("/")[0] for name in archive.namelist()}
        content = {name: archive.read(name) for name in archive.namelist()}

    assert len(roots) == 2
    assert {root.endswith(".dist-info") or root == "bayesplate" for root in roots} == {True}
    assert [name for name in content if name.endswith(EXECUTES_DATA) or "test" in name] == []
    traces = (str(ROOT).encode(), str(Path.home()).encode() + b"/")
    assert [name for name, data in content.items() if any(trace in data for trace in traces)] == []


def test_the_installed_command_checks_a_board_of_its_own_shelf(installed, tmp_path):
    """That of the wheel, not of the checkout that this environment may know too."""
    program = "from bayesplate.board.shelf import shelf_folder; print(shelf_folder('boards'))"
    shelf = elsewhere(installed, tmp_path, "-c", program).strip()
    printed = elsewhere(installed, tmp_path, "-m", "bayesplate", "check", "finnish-spruce-cantilever", "--json")

    assert Path(shelf) == installed / "bayesplate" / "models" / "boards"
    assert read_json(printed) == as_json(bayesplate.check("finnish-spruce-cantilever"))
    assert list(tmp_path.iterdir()) == []
    assert list((installed / "bin").glob("bayesplate*")) or list((installed / "Scripts").glob("bayesplate*"))
