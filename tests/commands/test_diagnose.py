"""`diagnose` from card to files: the contract of diagnosis.json, the two fits, and folders that are there already."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import runs
from carried_boards import CARRIES, LABEL, five_modes
from click.testing import CliRunner
from runs import read_json

from bayesplate.cli import main
from bayesplate.commands.check import check
from bayesplate.commands.diagnose import _refit_finalists, advice
from bayesplate.commands.diagnose import diagnose as run_diagnose
from bayesplate.diagnosis.joint import full_search
from bayesplate.diagnosis.verdict import Explanation, Verdict

WITH_SHEAR = "paper-cantilever-fe"
CALM = "fiemme-spruce-clamped"
WORDS = {"none needed", "named", "indistinguishable group", "unexplained", "undetectable"}
MODULI = {"E_x", "E_y", "G_xy"}
FIT = {"summary.json", "posterior.nc"}
TRIED = ("transverse_shear", "clamp_rotation")


def diagnose(folder: Path, *arguments: str) -> runs.Run:
    result = CliRunner().invoke(main, ["diagnose", *arguments, "--out", str(folder)])
    return runs.Run(result.exit_code, result.stdout, result.stderr, folder)


def quickly(patch: pytest.MonkeyPatch, *, page: bool = False) -> None:
    """Two candidates, and a sampler whose first judgement passes; a page only where it is asked for."""
    runs.sample_loosely(patch)
    patch.setattr("bayesplate.commands.diagnose.full_search", partial(full_search, effects=TRIED))
    if not page:
        patch.setattr("bayesplate.commands.fitting.FitResult.write_page", lambda *_: None)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    quickly(monkeypatch)


@pytest.fixture(scope="module")
def with_shear(tmp_path_factory: pytest.TempPathFactory) -> runs.Run:
    """A board whose readings name shear, among two candidates."""
    with pytest.MonkeyPatch.context() as patch:
        quickly(patch)
        return diagnose(tmp_path_factory.mktemp("named") / "out", WITH_SHEAR, "--json")


@pytest.fixture(scope="module")
def calm(tmp_path_factory: pytest.TempPathFactory) -> runs.Run:
    """A board that needs nothing, among two candidates."""
    with pytest.MonkeyPatch.context() as patch:
        quickly(patch)
        folder = tmp_path_factory.mktemp("calm")
        return diagnose(folder / "out", clamped_card(folder))


def clamped_card(folder: Path, *labels: str) -> str:
    """The clamped board without its exciter, whose known effects take their time, and with a few labels if told."""
    path = Path(runs.__file__).parents[1] / f"models/boards/{CALM}.toml"
    lines = path.read_text(encoding="utf-8").partition("\n[[setup.attached]]")[0].splitlines()
    kept = [line for line in lines if not (labels and line.startswith('"(')) or line.split('"')[1] in labels]
    card = folder / f"{CALM}.toml"
    card.write_text("\n".join(kept) + "\n", encoding="utf-8")
    return str(card)


def told(run: runs.Run):
    return read_json((run.folder / "diagnosis.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("which", ["with_shear", "calm"])
def test_diagnosis_json_is_consistent(which, request):
    run = request.getfixturevalue(which)
    assert run.exit_code == 0, run.stderr
    found = told(run)
    assert found["verdict"] in WORDS
    assert {one["name"] for one in found["candidates"]} >= set(TRIED)
    for one in found["candidates"]:
        assert 0.0 <= one["inclusion_probability"] <= 1.0
        assert (one["rejected_because"] is None) == (one["name"] in found["effects"])
    shear, air = "transverse_shear", "fluid_loading"
    assert [one["effects"] for one in found["known"]] == [[], [shear], [air], [shear, air]]
    assert all(set(one["change_percent"]) == MODULI and one["without"] == [] for one in found["known"])
    assert 0.0 <= found["gain_null_percentile"] <= 100.0
    # simulated boards are made to choose where an effect is added, and nowhere else
    is_added = found["verdict"] in ("named", "indistinguishable group")
    assert is_added == (which == "with_shear")
    assert (found["null_control"]["nested_ratio_to_beat"] is not None) == is_added
    assert found["recommendation"] == "" or found["recommendation"].endswith(".")


def test_what_an_effect_explains_is_no_doubt_any_more(with_shear):
    """The plate without shear misses its readings by far, and the fit before says so; with shear it does not."""
    before, after = (
        read_json((with_shear.folder / name).read_text()) for name in ("before/summary.json", "summary.json")
    )
    (scatter,) = (one for one in before["warnings"] if "scatter about the fitted plate" in one)
    assert scatter not in after["warnings"]
    assert told(with_shear)["notes"] == []


def test_a_diagnosis_says_what_undeclared_air_would_do_to_the_constants(calm):
    """A board in a room carries air along, and with shear beside it the readings may hide both."""
    assert "no air is declared" in " ".join(calm.stdout.split())


def test_known_effects_are_computed_before_anything_is_fitted_again(with_shear, calm, monkeypatch):
    """Falls and rises are in the file and in what is printed; the board as it stands is the one that `check` shows."""
    monkeypatch.setattr("bayesplate.commands.check.signatures", lambda _: [])  # which take their time
    stands, shear, air, both = told(with_shear)["known"]
    assert stands["in_sample_rms_cents"] == pytest.approx(check(WITH_SHEAR).in_sample_rms_cents, abs=0.01)
    assert shear["leave_one_out_rms_cents"] < 0.5 * stands["leave_one_out_rms_cents"] < air["leave_one_out_rms_cents"]
    assert shear["in_sample_rms_cents"] < both["in_sample_rms_cents"] < air["in_sample_rms_cents"]
    printed = " ".join(calm.stdout.split())
    assert "transverse shear lowers the leave-one-out error from" in printed
    assert "fluid loading raises it from" in printed
    assert "Where the error rises, something that acts the other way is lacking" in printed


def test_what_is_printed_as_json_is_what_is_written(with_shear):
    assert read_json(with_shear.stdout) == told(with_shear)


def test_after_a_refit_the_summary_is_of_the_refitted_model_and_before_holds_the_first(with_shear):
    found = told(with_shear)
    assert found["effects"] == ["transverse_shear"]
    assert FIT | {"diagnosis.json"} == {name for name in with_shear.files if not name.startswith("before/")}
    assert {f"before/{name}" for name in FIT} == {name for name in with_shear.files if name.startswith("before/")}
    first = read_json((with_shear.folder / "before" / "summary.json").read_text(encoding="utf-8"))
    after = with_shear.summary
    assert first["model"]["effects"] == []
    assert after["model"]["effects"] == ["transverse_shear"]
    moduli = after["effects"]["board"]["transverse_shear"]
    assert {name: entry["unit"] for name, entry in moduli.items()} == {"G_xz": "Pa", "G_yz": "Pa"}
    assert (first["model"]["theory"], after["model"]["theory"]) == ("thin", "shear-flexible")
    for side, summary in (("before", first), ("after", after)):
        assert found[side]["in_sample_rms_cents"] == summary["error"]["in_sample_rms_cents"]
        for name in MODULI:
            assert found["elastic_shift"][name][side] == summary["elastic"][name]["mean"]
    assert after["error"]["in_sample_rms_cents"] < 0.5 * first["error"]["in_sample_rms_cents"]


def test_without_a_refit_there_is_no_before_and_nothing_changes(calm):
    found = told(calm)
    assert found["effects"] == []
    assert set(calm.files) == FIT | {"diagnosis.json"}
    assert found["before"] == found["after"]
    assert all(one["shift_in_sd"] == 0 for one in found["elastic_shift"].values())
    assert found["claim"] is False
    assert f"Verdict: {found['verdict']}." in calm.stdout
    assert found["verdict"] in ("none needed", "undetectable")


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(tmp_path, quick, with_shear):
    again = diagnose(tmp_path / "again", WITH_SHEAR, "--quiet")
    other = diagnose(tmp_path / "other", WITH_SHEAR, "--quiet", "--seed", "2")
    assert again.stdout == ""
    assert again.files == with_shear.files
    assert other.files["summary.json"] != with_shear.files["summary.json"]


def test_three_modes_are_fitted_and_leave_nothing_to_judge_by(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        quickly(patch, page=True)
        run = diagnose(tmp_path / "out", clamped_card(tmp_path, "(1,0)", "(0,2)", "(1,1)"))
    assert run.exit_code == 0, run.stderr
    found = told(run)
    assert set(run.files) >= FIT | {"diagnosis.json", "report.html", "before-after.csv"}
    assert len(run.summary["modes"]) == 3
    assert (found["verdict"], found["effects"], found["refitted"], found["claim"]) == ("undetectable", [], [], False)
    assert "three modes" in found["reason"]
    assert "leave nothing to judge by" in " ".join(run.stdout.split())
    missing = {name for name, value in found["before"].items() if value is None}
    assert missing == {"leave_one_out_rms_cents", "nested_leave_one_out_rms_cents", "log_score"}
    assert found["before"] == found["after"]
    assert found["gain_null_percentile"] is None
    assert found["p_value"] == {"before": None, "after": None}
    assert [one["below_detection_limit"] for one in found["candidates"][:2]] == [True, True]
    assert found["recommendation"].startswith("Measure ")


@pytest.mark.slow
@pytest.mark.parametrize("place", ["full_search", "diagnosis_of"])
def test_an_interrupted_diagnosis_resumes_to_the_same_bytes(tmp_path, quick, monkeypatch, with_shear, place):
    """Stopped after the first fit, and after both; what is computed between the two is of the resumed run."""

    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(f"bayesplate.commands.diagnose.{place}", stop)
        patch.setattr("bayesplate.commands.diagnose.known_fits", lambda *_: ())
        stopped = diagnose(tmp_path / "out", WITH_SHEAR)
    assert stopped.exit_code == 130
    assert "--resume continues" in stopped.stderr
    assert not (FIT | {"diagnosis.json"}) & set(stopped.files)
    assert any(name.startswith("checkpoint/before/") for name in stopped.files)

    assert diagnose(tmp_path / "out", WITH_SHEAR, "--resume", "--seed", "2").exit_code == 6
    resumed = diagnose(tmp_path / "out", WITH_SHEAR, "--resume", "--quiet")
    assert resumed.exit_code == 0, resumed.stderr
    assert resumed.files == with_shear.files


def test_a_mode_that_alone_carries_a_constant_counts_in_no_error_of_a_diagnosis(tmp_path, quick):
    found = run_diagnose(str(five_modes(tmp_path)), n_null=50)

    told = found.to_json()
    (one,) = told["carrying_modes"]
    assert (one["label"], one["carries"]) == (LABEL, CARRIES)
    left_out = {row.label: row.left_out_cents for row in found.before.summary.modes}
    others = np.array([value for label, value in left_out.items() if label != LABEL])
    rms = float(np.sqrt(np.mean(others**2)))
    assert told["before"]["leave_one_out_rms_cents"] == pytest.approx(rms)
    assert abs(left_out[LABEL]) > 3.0 * rms  # it would show
    for row in told["known"]:
        assert row["leave_one_out_rms_cents"] < 1.5 * rms


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[list[tuple[str, ...]]]:
    """Which rivals of the verdict the plan was asked to keep."""
    kept: list[list[tuple[str, ...]]] = []
    home = "bayesplate.commands.diagnose"
    monkeypatch.setattr(f"{home}.wrong_reading", lambda _: "Read (1,1) again.")
    monkeypatch.setattr(f"{home}.surviving_explanations", lambda _, rivals: kept.append(rivals) or ())
    monkeypatch.setattr(f"{home}.search_beliefs", lambda *_: None)
    monkeypatch.setattr(f"{home}.Planner", lambda *_: SimpleNamespace(rank_proposals=tuple))
    monkeypatch.setattr(f"{home}.plan_first_line", lambda *_: "Measure more.")
    return kept


def test_a_wrong_reading_is_told_where_nothing_explains_the_readings_and_else_the_first_line_of_the_plan(asked):
    """Alternatives of a verdict survive whatever their probability."""
    rivals = Explanation(("shear",), 1, 0.9), Explanation(("mass",), 3, 0.0)
    for word, stands_for, told in (
        ("unexplained", (), "Read (1,1) again."),
        ("none needed", (), "Measure more."),
        ("undetectable", (), "Measure more."),
        ("indistinguishable group", rivals, "Measure more."),
    ):
        assert advice(None, Verdict(word, (), 0, None, "", explanations=stands_for), None, 1) == told
    assert asked == [[], [], [("shear",), ("mass",)]]


@pytest.mark.parametrize(
    ("rms_cents", "slip_remarks", "is_kept"),
    [(20.0, ("exchanged",), True), (20.1, ("exchanged",), False), (20.1, (), True)],
)
def test_a_refit_whose_readings_look_wrong_must_not_miss_them_by_more_than_before(
    monkeypatch, rms_cents, slip_remarks, is_kept
):
    """Labels may look wrong under an effect, and an error may rise by chance: both together leave the refit out."""

    def fit_of(error, remarks=()):
        summary = SimpleNamespace(error=SimpleNamespace(in_sample_rms_cents=error))
        problem = SimpleNamespace(slip_remarks=remarks)
        return SimpleNamespace(summary=summary, inference=SimpleNamespace(problem=problem))

    refit = fit_of(rms_cents, slip_remarks)
    for name in ("with_board", "refit_board"):
        monkeypatch.setattr(f"bayesplate.commands.diagnose.{name}", lambda *_: None)
    monkeypatch.setattr("bayesplate.commands.diagnose.explanation_words", lambda *_: "warp")
    run = SimpleNamespace(fit=lambda *_: refit)
    finalists = [Explanation(("warp",), 3, 0.9)]
    fits, failures = _refit_finalists(None, fit_of(20.0), run, None, finalists)
    assert fits == ({3: refit} if is_kept else {})
    assert [failure.split(":")[0] for failure in failures] == [
        "the fit with warp misses the readings by 20.1 cents, that without by 20.0"
    ] * (not is_kept)
