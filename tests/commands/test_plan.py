"""`bayesplate plan`: files and JSON of a board, what is refused, and how a finished diagnosis is taken up."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import bayesplate
from bayesplate.cli import main
from bayesplate.commands import plan as home
from bayesplate.commands.prepare import prepare
from bayesplate.errors import NotIdentifiableError

UNMEASURED = Path(__file__).parents[2] / "docs" / "cards" / "half-top-unmeasured.toml"
BOARD = "fiemme-spruce-clamped"
KEYS = [
    "format", "name", "title", "seed", "card_sha256", "basis", "goal", "costs", "explanations", "entropy", "first",
    "proposals", "sequences", "bench", "notes",
]  # fmt: skip
GAIN = [
    "E_x", "E_y", "G_xy", "constants", "constants_error", "explanations", "explanations_error", "information", "shared",
    "score", "score_per_minute",
]  # fmt: skip
FILES = {"plan.json", *(f"plan{of}.{end}" for of in ("", "-bench", "-bench-2") for end in ("png", "svg"))}


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """The plan of a board that was not measured."""
    out = tmp_path_factory.mktemp("plan") / "out"
    asked = ["plan", str(UNMEASURED), "--out", str(out), "--cost", "clamping=20", "--for", "E_y"]
    result = CliRunner().invoke(main, asked)
    assert result.exit_code == 0, result.output
    return out, json.loads((out / "plan.json").read_text()), result.stdout


def test_a_board_without_frequencies_is_planned_from_its_prior(planned):
    out, found, _ = planned

    assert {path.name for path in out.iterdir()} == FILES
    assert list(found) == KEYS
    assert (found["basis"], found["goal"]) == ("prior", "E_y")
    assert found["costs"] == {"reading": 1.0, "clamping": 20.0, "board": 30.0}
    first = found["proposals"][0]
    assert list(first["gain"]) == GAIN
    assert first["what"] == "modes"
    assert first["cost_minutes"] == 20.0 + len(first["modes"])
    assert "(0,2)" in first["modes"]  # without a mode that bends across the grain nothing tells E_y
    assert first["gain"]["E_y"] < 0.2
    assert first["gain"]["explanations"] is None
    scores = [one["gain"]["score"] for one in found["proposals"]]
    assert scores == sorted(scores, reverse=True)
    steps = [one["steps"] for one in found["sequences"]]
    assert [len(one) for one in steps] == [2, 3][: len(steps)]
    assert steps[0][0] == first["sentence"]
    assert found["sequences"][0]["gain"]["score"] >= scores[0]


def test_the_sheet_says_where_each_mode_will_be_and_is_seen(planned):
    _, found, printed = planned
    (bench,) = [one for one in found["bench"] if one["setup"] == "setup"]

    assert bench["modes"]
    for mode in bench["modes"]:
        assert mode["low_hz"] < mode["hz"] < mode["high_hz"]
        assert 0.05 < mode["seen"] <= 1.0
    assert all(0 <= place[0] <= 580 and 0 <= place[1] <= 217 for place in (bench["sensor_mm"], bench["hammer_mm"]))
    assert found["first"].split(":")[0] in " ".join(printed.split())


def test_no_sheet_of_an_earlier_plan_is_left(planned, monkeypatch):
    """A plan for which the board is held one way has no second sheet."""
    out, files = planned[0], [planned[0] / name for name in home._file_names()]
    monkeypatch.setattr("bayesplate.report.planning.gains_picture", lambda _: SimpleNamespace(figure="drawn"))
    monkeypatch.setattr("bayesplate.report.planning.bench_sheet", lambda _: "drawn")
    monkeypatch.setattr("bayesplate.report.saving.save_figure", lambda figure, path: path.write_text(figure))
    earlier = {path: path.read_bytes() for path in files}
    try:
        written = home._write({}, ["one"], out, files)
        assert {path.name for path in written} == FILES - {"plan-bench-2.png", "plan-bench-2.svg"}
        assert set(out.iterdir()) == {*written}
    finally:
        for path, content in earlier.items():
            path.write_bytes(content)


def free_board(hertz):
    """A board of some readings, under the default prior, whose moduli are independent: a part is no material's."""
    setup = bayesplate.Setup.from_frequencies(hertz, edges="free")
    sizes = {"length_x": 0.253, "length_y": 0.114, "thickness": 3e-3, "mass": 0.041}
    return bayesplate.Board.from_numbers("one", **sizes, setups=setup)


def test_a_board_whose_one_mode_does_not_tell_three_constants_is_planned_from_its_prior():
    board = free_board({"(1,1)": 125.0})
    found = bayesplate.plan(board).summary

    assert found.proposals
    assert found.basis == "prior"
    assert found.notes[0].startswith("planned from the prior alone")
    for asked in ({"between": ["fluid_loading"]}, {"goal": "explanations"}):
        with pytest.raises(NotIdentifiableError):
            bayesplate.plan(board, **asked)


def test_a_setup_not_measured_yet_takes_nothing_from_the_readings_of_another():
    board = free_board({"(1,1)": 125.0, "(2,0)": 240.0, "(0,2)": 350.0, "(2,1)": 400.0})
    bench = bayesplate.Setup.from_frequencies({}, edges="clamped", name="bench")
    assert bayesplate.plan(replace(board, setups=(*board.setups, bench))).summary.basis == "readings"


@pytest.fixture(scope="module")
def prepared():
    return prepare(BOARD)


@pytest.fixture
def told(prepared):
    """A diagnosis that is done: three effects may be what the board lacks, or none."""
    probabilities = {"membrane_tension": 0.4, "fluid_loading": 0.05, "grain_angle": 0.03}
    explanations = [{"effects": [name], "probability": one, "words": ""} for name, one in probabilities.items()]
    return {
        "card_sha256": prepared.card.sha256, "declared": [], "verdict": "none needed", "effects": [],
        "explanations": explanations, "probability_of_none": 0.5,
    }  # fmt: skip


@pytest.fixture
def taken_up(tmp_path, prepared):
    """What a plan takes of a text in the place of a diagnosis."""

    def take(text):
        (tmp_path / "diagnosis.json").write_text(text)
        return home._read_diagnosis(tmp_path, prepared)

    return take


def test_answers_within_a_factor_ten_and_those_that_a_group_lists_survive_a_diagnosis(taken_up, told):
    found = taken_up(json.dumps(told))
    assert set(found.support) == {("membrane_tension",), ("fluid_loading",)}
    assert found.none == 0.5
    listed = {"verdict": "indistinguishable group", "effects": ["membrane_tension", "grain_angle"]}
    found = taken_up(json.dumps(told | listed))
    assert set(found.support) == {("membrane_tension",), ("fluid_loading",), ("grain_angle",)}


def test_a_diagnosis_of_another_card_model_or_verdict_and_one_that_was_altered_is_not_taken_up(
    taken_up, told, prepared, tmp_path
):
    assert home._read_diagnosis(tmp_path, prepared) is None
    for other in (
        {"card_sha256": "0"},
        {"declared": ["fluid_loading"]},
        {"verdict": "unexplained"},
        {"explanations": []},
        {"probability_of_none": float("nan")},
        {"explanations": [{"effects": ["fluid_loading"], "probability": 1.5}]},
        {"explanations": [{"effects": ["witchcraft"], "probability": 0.5}]},
        {"verdict": "indistinguishable group", "effects": 7},
    ):
        assert taken_up(json.dumps(told | other)) is None, other
    for unreadable in ("[]", "[" * 100_000):
        assert taken_up(unreadable) is None


def test_only_the_answers_that_survive_a_diagnosis_are_tabulated(tmp_path, told, monkeypatch):
    (tmp_path / "diagnosis.json").write_text(json.dumps(told))
    kept = []

    class Seen(Exception):
        """Nothing further is asked."""

    def stop(baseline, effects=None, tell=None):
        kept.append(effects)
        raise Seen

    monkeypatch.setattr(home, "full_search", stop)
    monkeypatch.setattr(home, "baseline_of", lambda _: None)
    monkeypatch.setattr(home.Problem, "posed", SimpleNamespace())
    with pytest.raises(Seen):
        bayesplate.plan(BOARD, out=tmp_path)
    assert kept == [["fluid_loading", "membrane_tension"]]
