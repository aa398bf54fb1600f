"""What the documentation may say: commands and options that exist, cards that load, no output typed by hand."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path

import click
import pytest

from bayesplate.cli import main
from bayesplate.commands.prepare import prepare
from bayesplate.errors import InputError

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    path for path in (ROOT / "docs").rglob("*.md") if not {"_build", "_generated"} & set(path.relative_to(ROOT).parts)
)
CARDS = sorted((ROOT / "docs" / "cards").glob("*.toml"))
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))

COMMAND = re.compile(r"(?:\$ |`|\{command\} |^    )(?:bayesplate )([a-z]+)", re.MULTILINE)
RUN = re.compile(r"\{command\} ([a-z]+)")
OPTION = re.compile(r"`?(--[a-z][a-z-]*)")
DRAWN = set("┏┃┡│└━")


def known_options() -> set[str]:
    """Every option of every command."""
    of_all = (command.get_params(click.Context(command)) for command in main.commands.values())
    return {word for parameters in of_all for one in parameters for word in one.opts}


def faults_of(text: str) -> list[str]:
    """What a page says that is not so."""
    commands = [*COMMAND.findall(text), *RUN.findall(text)]
    found = [f"no command {name}" for name in commands if name not in main.commands]
    known = known_options() | {word for parameter in main.params for word in parameter.opts} | {"--help"}
    found += [f"no option {name}" for name in OPTION.findall(text) if name not in known]
    if DRAWN & set(text):
        found.append("output typed by hand")
    return found


def test_pages_say_only_what_is():
    assert len(PAGES) > 10
    found = {page.relative_to(ROOT).as_posix(): faults_of(page.read_text(encoding="utf-8")) for page in PAGES}
    assert {page: faults for page, faults in found.items() if faults} == {}


def test_what_is_not_so_is_found():
    """The negative control."""
    for text, fault in {
        "$ bayesplate fitt my-board.toml": "no command fitt",
        "```{command} chek my-board.toml": "no command chek",
        "try `--resumee`": "no option --resumee",
        "│ E_x │ 13.3 │": "output typed by hand",
    }.items():
        assert faults_of(text) == [fault]


def test_a_card_of_the_documentation_loads_unless_its_name_says_otherwise():
    assert len(CARDS) > 3
    for card in CARDS:
        if card.stem.endswith("with-faults"):
            with pytest.raises(InputError, match="did you mean thickness_mm") as refused:
                prepare(card)
            assert len(refused.value.faults) == 5
        else:
            assert prepare(card, may_lack_frequencies=True).board.name == card.stem


def test_an_example_can_be_shown_in_the_gallery_and_is_tested():
    """A title in one line, how to run it, and a test of its own."""
    assert {path.stem for path in EXAMPLES} >= {"posterior_analysis", "percentile_comparison", "uncertainty_report"}
    for example in EXAMPLES:
        docstring = ast.get_docstring(ast.parse(example.read_text(encoding="utf-8"))) or ""

        assert docstring.splitlines()[1] == "", example.name
        assert f"\n\n    python examples/{example.name}" in docstring
        assert (ROOT / "tests" / "examples" / f"test_{example.name}").exists(), example.name


def test_every_page_of_results_has_a_day_and_a_tree():
    results = ROOT / "docs" / "validation"
    measured = json.loads((results / "measured.json").read_text(encoding="utf-8"))

    assert {name.partition(", ")[0] for name in measured} == {page.stem for page in results.glob("*.md")} - {
        "trial-short"
    }
    assert all(re.fullmatch(r"\d{4}-\d\d-\d\d", one["date"]) and one["tree"] for one in measured.values())


def test_every_page_of_results_is_listed_with_its_command():
    library = ast.parse((ROOT / "docs" / "_ext" / "computations" / "library.py").read_text(encoding="utf-8"))
    assigned = {node.targets[0].id: node.value for node in library.body if isinstance(node, ast.Assign)}
    listed = {stem: command for stem, command, _ in ast.literal_eval(assigned["CHECKS"])}
    targets = (ROOT / "Makefile").read_text(encoding="utf-8")

    assert set(listed) == {page.stem for page in (ROOT / "docs" / "validation").glob("*.md")}
    for command in listed.values():
        assert not command.startswith("make ") or f"\n{command.removeprefix('make ')}: " in targets, command
