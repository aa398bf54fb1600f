"""What README and the page on Python show runs and prints as it stands there, in a checkout that was used before."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from runs import files_in

from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.workflow.shown import show_fit

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGE = (ROOT / "docs" / "how_to" / "use_from_python.md").read_text(encoding="utf-8")
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


def test_the_readme_runs_writes_nothing_and_prints_the_tables_of_make_fit(used, capsys):
    found = run_all(README)
    summary = found["result"].summary
    shown = show_fit(summary)
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in README.splitlines() if "│" in line]
    wanted = [list(row) for table in shown.tables for row in table.rows]

    assert capsys.readouterr().out.split() == [str(summary.elastic.E_x.mean), str(summary.elastic.E_x.sd)]
    assert files_in(used) == USED
    assert rows == wanted
    assert all(" ".join(text.split()) in " ".join(README.split()) for text in (*shown.remarks, shown.closing))


def test_the_page_on_python_runs(used, monkeypatch, capsys):
    """With a gate that passes at once: what it shows are names and types."""
    loose = Gate(rhat_max=10.0, tau_count_min=1.0, ess_min=1.0)
    monkeypatch.setattr("bayesplate.workflow.fitting.SamplerSettings", partial(SamplerSettings, gate=loose))
    found = run_all(PAGE)

    assert files_in(used).keys() == {*USED, "constants.png"}
    assert 'name = "my-board"' in capsys.readouterr().out
    assert len(found["fewer"].setups[0].readings) == 4
    assert found["hertz"].shape == (1000, len(found["problem"].labels))
    assert found["result"].problem.prior.name == "my-shop"
