"""A summary repeats its own fit to the byte, and where something differs all of it is told before any work."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import runs
from click.testing import CliRunner
from runs import read_json

import bayesplate
from bayesplate.cli import main
from bayesplate.errors import InputError
from bayesplate.results.versions import versions
from bayesplate.workflow import repeat as home
from bayesplate.workflow.repeat import default_repeat_folder, repeat

BOARD = "fiemme-spruce-clamped"


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """A fit by the linear law that was asked for, seed 5, its readings' noise Student's."""
    folder = tmp_path_factory.mktemp("first") / "out"
    return runs.fit(folder, BOARD, "--seed", "5", "--linear", "--robust", "--no-report")


def edited(fitted, tmp_path, change):
    """Its summary with something changed, in a file of its own."""
    summary = fitted.summary
    change(summary)
    path = tmp_path / "summary.json"
    path.write_text(json.dumps(summary), encoding="utf-8")
    return path


def test_a_summary_alone_repeats_its_fit_to_the_byte(fitted, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("summary.json").write_bytes(fitted.files["summary.json"])
    result = CliRunner().invoke(main, ["fit", "--repeat", "summary.json", "--no-report"])

    assert result.exit_code == 0, result.stderr
    assert "repeated: summary.json is the same to the byte; written to results/fiemme-spruce-clamped-repeated" in (
        result.stdout.replace("\\", "/")
    )
    assert runs.files_in(tmp_path / "results" / f"{BOARD}-repeated") == fitted.files


def test_what_differs_afterwards_is_named(fitted, tmp_path):
    def shift(summary):
        summary["elastic"]["E_x"]["mean"] *= 1.0 + 1e-15

    done = repeat(edited(fitted, tmp_path, shift))
    assert done.differs == ("elastic",)
    assert "summary.json differs in elastic" in done.sentence


def test_everything_that_differs_is_told_at_once_and_nothing_is_written(fitted, tmp_path):
    def change(summary):
        summary["versions"]["numpy"] = "0.1"
        summary["versions"]["emcee"] = "0.2"
        summary["request"]["card"] += "# a note\n"
        summary["request"]["named"]["prior weakly-informative"] = "0" * 64

    path = edited(fitted, tmp_path, change)
    run = runs.fit(tmp_path / "out", "--repeat", str(path))

    assert run.exit_code == 3
    assert f"versions numpy: wanted 0.1, got {versions()['numpy']} (install these versions)" in run.stderr
    assert "versions emcee: wanted 0.2" in run.stderr
    assert f"card_sha256 card: wanted {fitted.summary['card_sha256']}" in run.stderr
    assert "request named prior weakly-informative: wanted 0000" in run.stderr
    assert not run.folder.exists()


def test_a_shipped_prior_that_was_given_in_place_of_the_cards_is_taken_again(fitted, tmp_path):
    given = bayesplate.Problem.from_card(BOARD, prior="spruce")
    path = edited(fitted, tmp_path, lambda summary: summary["request"].update(named=given.prepared.named.digests))
    found = home._problem(home._read(path), path, None)

    assert found.prior == given.prior
    assert found.board.inputs == given.board.inputs


def test_a_card_that_is_named_too_must_be_the_same(fitted, tmp_path):
    path = tmp_path / f"{BOARD}.toml"
    path.write_text(fitted.summary["request"]["card"] + "# a note\n", encoding="utf-8")
    run = runs.fit(tmp_path / "out", str(path), "--repeat", str(fitted.folder / "summary.json"))

    assert run.exit_code == 3
    assert run.stderr.count("\n") == 1
    assert f"card_sha256 card: wanted {fitted.summary['card_sha256']}, got " in run.stderr


@pytest.mark.parametrize("with_card", [False, True])
def test_a_summary_cannot_name_a_folder_outside(fitted, tmp_path, monkeypatch, with_card):
    monkeypatch.chdir(tmp_path)
    path = edited(fitted, tmp_path, lambda summary: summary.update(name="../../outside"))
    given = [BOARD] if with_card else []
    result = CliRunner().invoke(main, ["fit", *given, "--repeat", str(path)])

    assert result.exit_code == 3
    assert set(runs.files_in(tmp_path)) == {"summary.json"}
    assert not (tmp_path.parent / "outside-repeated").exists()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("no json", "wanted the summary.json of a fit, got no JSON"),
        ("[1]", "wanted the summary.json of a fit, got JSON of something else"),
        ('{"card_sha256": "0", "format": 1}', "request: wanted what the fit was asked for, got none"),
        ('{"card_sha256": "0", "format": 1, "boards": {}}', "wanted a fit of one board, got one of a campaign"),
        ('{"card_sha256": "0", "format": 2, "request": {"card": 1}}', "format: wanted 1, got 2"),
    ],
)
def test_a_file_that_is_no_summary_is_refused(tmp_path, content, words):
    path = tmp_path / "summary.json"
    path.write_text(content, encoding="utf-8")

    with pytest.raises(InputError, match=r"summary\.json") as caught:
        default_repeat_folder(path)
    assert words in str(caught.value)
    with pytest.raises(InputError, match="no such file"):
        repeat(tmp_path / "none.json")


@pytest.mark.parametrize("option", [["--seed", "1"], ["--linear"], ["--effects", "none"], ["--robust"]])
def test_what_the_summary_states_may_not_be_given(fitted, tmp_path, option):
    run = runs.fit(tmp_path / "out", "--repeat", str(fitted.folder / "summary.json"), *option)

    assert run.exit_code == 2
    assert f"--repeat takes {option[0]} from the summary" in run.stderr


def test_a_fit_without_a_card_is_a_fault_of_usage(tmp_path):
    run = runs.fit(tmp_path / "out")

    assert run.exit_code == 2
    assert "Missing argument 'CARD'" in run.stderr


def test_a_setup_that_took_the_place_of_the_card_s_is_in_the_text(tmp_path, fitted):
    """Its readings are part of the card's text, and of its digest: nothing else has to be kept."""
    fragment = tmp_path / "setup.toml"
    fragment.write_text('[setup.frequencies_hz]\n"(0,0)" = 53\n', encoding="utf-8")
    problem = bayesplate.Problem.from_card(BOARD, setup=fragment)

    assert "= 53" in problem.prepared.card_text
    assert problem.prepared.card.sha256 != fitted.summary["card_sha256"]
    assert read_json(fitted.files["summary.json"].decode())["request"]["law"] == "linear"
