"""Options of `fit`, and cards of the user's own: laws, noise, and places."""

from __future__ import annotations

from pathlib import Path

import pytest

import bayesplate
from bayesplate.board.shelf import shelf_folder
from bayesplate.commands.prepare import default_folder


@pytest.mark.parametrize(
    ("board", "options", "law", "robust"),
    [
        ("finnish-spruce-cantilever", ("--linear",), "linear", False),
        ("fiemme-spruce-clamped", ("--exact", "--robust"), "exact", True),
    ],
)
def test_a_forced_law_and_robust_noise_reach_the_summary(quick_fit, board, options, law, robust):
    run = quick_fit(board, *options, "--quiet")
    summary = run.summary

    assert (run.exit_code, run.stdout, run.stderr) == (0, "", "")
    assert summary["model"]["law"] == law
    assert summary["model"]["robust"] is robust
    assert summary[f"{law}_means"]["E_x"] == pytest.approx(summary["elastic"]["E_x"]["mean"], rel=1e-12)
    is_warned = any("the linear law is off by more than a quarter of the noise" in w for w in summary["warnings"])
    assert is_warned == (law == "linear")


def test_robust_noise_sets_one_wrong_reading_apart(finnish, tmp_path):
    """(2,1) an octave high: the constants and every error but its own are those of the board as it was read."""
    text = (shelf_folder("boards") / "finnish-spruce-cantilever.toml").read_text(encoding="utf-8")
    card = tmp_path / "octave.toml"
    card.write_text(text.replace('"(2,1)" = 398', '"(2,1)" = 796').replace(f'"{finnish.summary["name"]}"', '"octave"'))
    found, plain = bayesplate.fit(card, robust=True).summary, finnish.summary

    assert "(2,1) at 796 Hz" in found.warnings[0]
    assert "an octave, or another mode?" in found.warnings[0]
    for name, one in plain["elastic"].items():
        assert abs(found.elastic[name].mean - one["mean"]) < 2.0 * one["sd"]
    for row, before in zip(found.modes, plain["modes"], strict=True):
        octave = 1200.0 * (row.label == "(2,1)")
        assert abs(row.residual_cents - octave - before["residual_cents"]) < 40.0  # two sd of its own noise, 1.2 %
        assert abs(row.left_out_cents - octave - before["left_out_cents"]) < 80.0  # and a leverage of up to one half


def test_a_card_is_fitted_by_path_and_no_place_of_the_machine_is_told(quick_fit, own_card):
    """Neither home, nor working folder, nor card, nor package: only the folder that the user named is printed."""
    run = quick_fit(str(own_card))
    folders = (own_card.parent, Path.home(), Path.cwd(), Path(bayesplate.__file__).parent)
    places = [str(folder).encode() for folder in folders]

    assert run.exit_code == 0
    assert str(run.folder) in run.stdout
    for content in (*run.files.values(), run.stdout.replace(str(run.folder), "").encode()):
        assert [place for place in places if place in content] == []


def test_a_folder_is_named_after_the_card_without_its_ending():
    assert default_folder("cards/my.board.toml") == Path("results", "my.board")
    assert default_folder("./half-top.txt") == Path("results", "half-top")
