"""What README and the page on Python show runs and prints as it stands there, in a checkout that was used before."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from runs import files_in, sample_loosely

from bayesplate.commands.printout import show_fit
from bayesplate.terminal import print_tables

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGE, ARVIZ = (
    (ROOT / "docs" / "how_to" / name).read_text(encoding="utf-8")
    for name in ("use_from_python.md", "check_with_arviz.md")
)
LONGEST = 70
"""Lines of the README that are not empty, besides what `make fit` prints: a screen."""
USED = {"results/finnish-spruce-cantilever/summary.json": b"{}", "results/my-board/summary.json": b"{}"}


def run_all(text: str) -> dict[str, Any]:
    """Run the Python of a page as one script."""
    module = ModuleType("page")
    exec("\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL)), vars(module))
    return vars(module)


@pytest.fixture
def used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory in which `make fit` has left its results."""
    for name, content in USED.items():
        (tmp_path / name).parent.mkdir(parents=True)
        (tmp_path / name).write_bytes(content)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_readme_runs_writes_nothing_and_prints_what_a_terminal_of_80_columns_does(used, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    summary = run_all(README)["result"].summary
    (block,) = re.findall(r"```\n(Elastic constants.*?)```", README, re.DOTALL)

    assert capsys.readouterr().out.split() == [str(summary.elastic.E_x.mean), str(summary.elastic.E_x.sd)]
    assert files_in(used) == USED
    print_tables(show_fit(summary))
    assert [line.rstrip() for line in capsys.readouterr().out.splitlines()] == block.splitlines()


def test_the_readme_is_short_and_its_links_lead_somewhere():
    written = re.sub(r"```\nElastic constants.*?```", "", README, flags=re.DOTALL)
    lines = [line for line in written.splitlines() if line.strip() and not line.startswith(("```", "<!--"))]
    links = re.findall(r"\]\(([^)#]+)\)", README)

    assert len(lines) <= LONGEST
    assert len(links) > 5
    assert [link for link in links if not (ROOT / link).exists()] == []
    assert "    make fit " in README
    assert "    make test " in README


def test_the_page_on_arviz_runs(used):
    found = run_all(ARVIZ)

    assert (len(found["setup"].readings), len(found["others"])) == (6, 5)
    assert files_in(used) == USED


def test_the_page_on_python_runs(used, monkeypatch, capsys):
    """With a gate that passes at once: what it shows are names and types."""
    sample_loosely(monkeypatch)
    found = run_all(PAGE)

    assert files_in(used).keys() == {*USED, "constants.png"}
    assert 'name = "my-board"' in capsys.readouterr().out
    assert len(found["fewer"].setups[0].readings) == 4
    assert found["hertz"].shape == (1000, len(found["problem"].labels))
    assert found["result"].problem.prior.name == "my-shop"
