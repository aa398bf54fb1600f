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


def test_the_wheel_holds_nothing_else_than_the_package_its_cards_and_its_licence(wheel):
    with zipfile.ZipFile(wheel) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    roots = {name.partition("/")[0] for name in content}
    cards = {path.relative_to(ROOT).as_posix() for path in (ROOT / "models").rglob("*.toml")}
    modules = {path.relative_to(ROOT).as_posix() for path in (ROOT / "bayesplate").rglob("*.py")}

    assert len(cards) >= 12
    templates = {f"bayesplate/report/templates/report.{ending}" for ending in ("html", "css")}
    assert {f"bayesplate/{card}" for card in cards} | modules | templates | {"bayesplate/py.typed"} <= set(content)
    assert any(name.endswith("dist-info/licenses/LICENSE") for name in content)
    assert len(roots) == 2
    assert {root.endswith(".dist-info") or root == "bayesplate" for root in roots} == {True}
    assert [name for name in content if name.endswith(EXECUTES_DATA) or "test" in name] == []
    traces = (str(ROOT).encode(), str(Path.home()).encode() + b"/")
    assert [name for name, data in content.items() if any(trace in data for trace in traces)] == []


PROGRAM = """
from bayesplate.board.shelf import shelf_folder
from bayesplate.cli import main
print(shelf_folder("boards"))
main(["check", "acrylic-panel", "--json"])
"""


def test_the_installed_command_checks_a_board_of_its_own_shelf(installed, tmp_path):
    """That of the wheel, not of the checkout that this environment may know too."""
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    program = [sys.executable, "-c", PROGRAM]
    done = subprocess.run(program, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    shelf, _, printed = done.stdout.partition("\n")

    assert Path(shelf) == installed / "bayesplate" / "models" / "boards"
    assert read_json(printed) == as_json(bayesplate.check("acrylic-panel"))
    assert list(tmp_path.iterdir()) == []
    assert list((installed / "bin").glob("bayesplate*")) or list((installed / "Scripts").glob("bayesplate*"))
