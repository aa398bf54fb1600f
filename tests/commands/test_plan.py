"""`bayesplate plan`: files and JSON of a board, what is refused, and how a finished diagnosis is taken up."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import bayesplate
from bayesplate.cli import main
from bayesplate.commands import plan as home
from bayesplate.commands.prepare import prepare
from bayesplate.errors import InputError, NotIdentifiableError

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
FILES = {
    "plan.json",
    "plan.png",
    "plan.svg",
    "plan-bench.png",
    "plan-bench.svg",
    "plan-bench-2.png",
    "plan-bench-2.svg",
}


def run(*arguments):
    return CliRunner().invoke(main, ["plan", *map(str, arguments)])


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """The plan of a board that was not measured."""
    out = tmp_path_factory.mktemp("plan") / "out"
    result = run(UNMEASURED, "--out", out, "--cost", "clamping=20", "--for", "E_y")
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


def test_plates_of_no_material_are_passed_over():
    """The default prior of the moduli, which are independent there, holds some."""
    free = bayesplate.Setup.from_frequencies({}, edges="free")
    board = bayesplate.Board.from_numbers("b", length_x=0.253, length_y=0.114, thickness=3e-3, mass=0.041, setups=free)
    assert bayesplate.plan(board).summary.proposals


def test_the_sheet_says_where_each_mode_will_be_and_is_seen(planned):
    _, found, printed = planned
    (bench,) = [one for one in found["bench"] if one["setup"] == "setup"]

    assert bench["modes"]
    for mode in bench["modes"]:
        assert mode["low_hz"] < mode["hz"] < mode["high_hz"]
        assert 0.05 < mode["seen"] <= 1.0
    assert all(0 <= place[0] <= 580 and 0 <= place[1] <= 217 for place in (bench["sensor_mm"], bench["hammer_mm"]))
    assert found["first"].split(":")[0] in " ".join(printed.split())


def test_files_that_are_there_are_kept_without_force(planned):
    out, _, _ = planned
    before = (out / "plan.json").read_bytes()

    refused = run(UNMEASURED, "--out", out)

    assert refused.exit_code == 3
    assert "plan.json" in refused.output
    assert (out / "plan.json").read_bytes() == before


def test_a_plan_is_no_run_and_fit_says_what_it_lacks(planned):
    out, _, _ = planned
    lacking = CliRunner().invoke(main, ["fit", str(UNMEASURED), "--out", str(out)])

    assert lacking.exit_code == 3
    assert "wanted measured frequencies" in lacking.output


REFUSED = [
    (["--cost", "reading=0"], 3, "costs reading: wanted a positive number of minutes"),
    (["--cost", "reading"], 2, "wanted CLASS=MINUTES"),
    (["--between", "grain_angel"], 3, "did you mean grain_angle?"),
    (["--between", "clamp_rotation"], 3, "between: wanted a board on which clamp_rotation can act, got no edge is"),
    (["--between", "none"], 3, "between: wanted one name of an effect or more, or None, got an empty list"),
    (["--between", "air_loading", "--effects", "fluid_loading"], 3, "between: wanted effects that are not dec"),
    (["--between", "fluid_loading"], 3, "between: wanted the frequencies of a board, by which effects are told apart"),
    (["--for", "explanations"], 3, "goal: wanted the frequencies of a board, by which effects are told apart"),
]


def test_what_cannot_be_asked_is_refused_and_leaves_nothing(tmp_path):
    for arguments, code, said in REFUSED:
        result = run(UNMEASURED, "--out", tmp_path / "out", *arguments)

        assert result.exit_code == code
        assert said in " ".join(result.output.split())
        assert list(tmp_path.iterdir()) == []


def test_a_campaign_does_not_tell_explanations_apart():
    with pytest.raises(InputError, match="plan one of its boards"):
        bayesplate.plan("spruce-half-tops", goal="explanations")
    with pytest.raises(InputError, match=r"between: wanted the frequencies of a board.*got a campaign"):
        bayesplate.plan("spruce-half-tops", between=["fluid_loading"])


class TestTooFewReadings:
    """One mode does not tell three constants."""

    @pytest.fixture
    def board(self):
        held = bayesplate.Setup.from_frequencies({"(1,1)": 125.0}, edges="free")
        sizes = {"length_x": 0.253, "length_y": 0.114, "thickness": 3e-3, "mass": 0.041}
        return bayesplate.Board.from_numbers("one", **sizes, setups=held)

    def test_the_plan_says_that_it_is_from_the_prior(self, board):
        found = bayesplate.plan(board).summary
        assert found.basis == "prior"
        assert found.notes[0].startswith("planned from the prior alone")

    @pytest.mark.parametrize("asked", [{"between": ["fluid_loading"]}, {"goal": "explanations"}])
    def test_effects_are_not_told_apart(self, board, asked):
        with pytest.raises(NotIdentifiableError):
            bayesplate.plan(board, **asked)


class TestFinishedDiagnosis:
    """What a diagnosis of the same card said is not searched for again."""

    @pytest.fixture
    def told(self):
        prepared = prepare(BOARD)
        answers = [
            {"effects": ["membrane_tension"], "probability": 0.4, "words": ""},
            {"effects": ["fluid_loading"], "probability": 0.05, "words": ""},
            {"effects": ["grain_angle"], "probability": 0.03, "words": ""},
        ]
        return {
            "card_sha256": prepared.card.sha256, "declared": [], "verdict": "none needed", "effects": [],
            "answers": answers, "probability_of_none": 0.5,
        }  # fmt: skip

    def finished(self, folder, told):
        (folder / "diagnosis.json").write_text(json.dumps(told))
        return home._finished(folder, prepare(BOARD))

    def test_those_within_a_factor_ten_and_those_that_a_group_lists_survive(self, tmp_path, told):
        found = self.finished(tmp_path, told)
        assert set(found.support) == {("membrane_tension",), ("fluid_loading",)}
        assert found.none == 0.5
        listed = {"verdict": "indistinguishable group", "effects": ["membrane_tension", "grain_angle"]}
        found = self.finished(tmp_path, told | listed)
        assert set(found.support) == {("membrane_tension",), ("fluid_loading",), ("grain_angle",)}

    @pytest.mark.parametrize(
        "other",
        [
            {"card_sha256": "0"},
            {"declared": ["fluid_loading"]},
            {"verdict": "unexplained"},
            {"answers": []},
            {"probability_of_none": float("nan")},
            {"answers": [{"effects": ["fluid_loading"], "probability": 1.5}]},
            {"answers": [{"effects": ["witchcraft"], "probability": 0.5}]},
            {"verdict": "indistinguishable group", "effects": 7},
        ],
        ids=range(8),
    )
    def test_another_card_model_or_verdict_and_one_that_was_altered_are_not_taken_up(self, tmp_path, told, other):
        assert self.finished(tmp_path, told | other) is None

    def test_nor_is_what_cannot_be_read(self, tmp_path):
        for content in ("[]", "[" * 100_000):
            (tmp_path / "diagnosis.json").write_text(content)
            assert home._finished(tmp_path, prepare(BOARD)) is None
        assert home._finished(tmp_path / "nowhere", prepare(BOARD)) is None

    def test_only_they_are_tabulated(self, tmp_path, told, monkeypatch):
        (tmp_path / "diagnosis.json").write_text(json.dumps(told))
        kept = []

        class Seen(Exception):
            """Nothing further is asked."""

        def stop(baseline, tried=None, tell=None):
            kept.append(tried)
            raise Seen

        monkeypatch.setattr(home, "full_search", stop)
        monkeypatch.setattr(home, "baseline_of", lambda _: None)
        monkeypatch.setattr(home.Problem, "posed", SimpleNamespace())
        with pytest.raises(Seen):
            bayesplate.plan(BOARD, out=tmp_path)
        assert kept == [["fluid_loading", "membrane_tension"]]
