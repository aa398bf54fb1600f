"""The trial itself on trial: a few boards, an interrupted run, workers, sums by hand, and records that must fail."""

from __future__ import annotations

import json
import math
import multiprocessing
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from generator.boards import plant
from scipy import stats
from trial.amplitudes import MEANINGS, quantiles
from trial.bars import bars
from trial.cells import CELLS, KINDS, SENSORS, Cell, identity, jobs
from trial.counts import Share, is_covered, listed, mean, median
from trial.judge import baseline_of_card, judge_one, plant_board
from trial.page import in_short, page, write
from trial.run import BASE_SEED, run
from trial.summary import by_class, confusion, summarise

FEW = (Cell("one", "cantilever-6", 2, size=2.0), Cell("null", "cantilever-6", 2))


def without_time(records):
    return [{key: value for key, value in record.items() if key != "seconds"} for record in records]


@pytest.fixture(scope="module")
def few():
    """Four boards judged in this process; others that it forks have its laws."""
    return [judge_one(cell, BASE_SEED, i) for cell in FEW for i in range(cell.n)]


def test_cells_are_those_that_were_asked_for():
    by_kind = {kind: sum(cell.n for cell in CELLS if cell.kind == kind) for kind in ("null", "one", "two", "outside")}
    assert by_kind == {"null": 1400, "one": 4800, "two": 600, "outside": 1200}
    assert len({cell.name for cell in CELLS}) == len(CELLS)
    assert min(cell.n for cell in CELLS) >= 200
    assert sum(cell.n for cell in CELLS if cell.kind == "null" and cell.design == "cantilever-6") >= 600
    assert "outline_profile" not in {name for cell in CELLS for name in cell.of.drawn}


def test_an_interrupted_run_has_part_of_every_cell():
    order = jobs(CELLS)
    assert len(order) == len(set(order)) == sum(cell.n for cell in CELLS)
    half = order[: len(order) // 2]
    for cell in CELLS:
        assert sum(one is cell for one, _ in half) == pytest.approx(0.5 * cell.n, abs=1)
    assert {cell: sum(one is cell for one, _ in jobs(CELLS, 3)) for cell in CELLS} == dict.fromkeys(CELLS, 3)


@pytest.mark.parametrize("design", SENSORS)
def test_a_card_does_not_tell_what_is_planted(design):
    """With and without a planted mass the cards differ in the readings alone; the planted mass sits at the sensor."""
    stated = {"kind": f'"{KINDS[design]}"'}
    cards, places = [], []
    for effects in ((), ("attached_mass",)):
        board = plant(np.random.default_rng(3), design, effects, sensor=SENSORS[design])
        cards.append([line for line in board.card_text(stated).splitlines() if not line.startswith('"(')])
        places.append(board.truth.effects.get("attached_mass", {}).get("places"))
    assert cards[0] == cards[1]
    assert places == [None, (SENSORS[design],)]
    assert f"kind = {stated['kind']}" in cards[0]
    assert not any(line.startswith("mass_g") for line in cards[0])


def test_the_stated_noise_is_the_true_one():
    cell = Cell("null", "cantilever-6", 1, 17.0, noise_factor=1.05)
    (setup,) = baseline_of_card(plant_board(np.random.default_rng(1), cell, ())).board.setups
    assert setup.noise.median == pytest.approx(2.0 ** (17.0 / 1200.0) - 1.0, rel=1e-5)
    assert setup.noise.log_sd == pytest.approx(math.log(1.05))


def test_a_record_tells_everything(few):
    for record in few:
        assert "error" not in record
        assert 0.0 <= record["none"] <= 1.0
        assert set(record["gate"]) == {"bare", "best"}
        assert frozenset(record["best"]) == frozenset(record["set"][0][0])
        for intervals in record["constants"].values():
            for one in intervals.values():
                assert one["q05"] < one["q95"]
        for name in record["constants"]:
            true, one = record["truth"]["constants"][name], record["constants"][name]["averaged"]
            assert one["holds"] == (one["q05"] <= true <= one["q95"])


def test_a_board_depends_neither_on_the_workers_nor_on_the_order(few, tmp_path):
    again = run(FEW[::-1], tmp_path / "other.jsonl", workers=2, quiet=True)
    order = {cell.name: place for place, cell in enumerate(FEW)}
    assert without_time(sorted(again, key=lambda r: (order[r["cell"]], r["index"]))) == without_time(few)
    other_seed = judge_one(FEW[0], BASE_SEED + 1, 0)
    assert other_seed["truth"]["constants"] != few[0]["truth"]["constants"]


def test_a_killed_run_goes_on_to_the_same_records(few, tmp_path):
    """A process group is killed as soon as it has written a board."""
    out = tmp_path / "killed.jsonl"
    process = multiprocessing.get_context("fork").Process(target=_in_a_group, args=(out,))
    process.start()
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline and not (out.exists() and len(out.read_text().splitlines()) >= 2):
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.join()
    n_done = sum(line.endswith("\n") for line in out.read_text().splitlines(keepends=True)) - 1
    assert 1 <= n_done <= 4
    with out.open("a") as file:
        file.write('{"cell": "one cant')  # killed while it wrote the next
    assert without_time(run(FEW, out, workers=1, quiet=True)) == without_time(few)
    assert len(out.read_text().splitlines()) == 1 + len(few)


def _in_a_group(out):
    os.setpgrp()
    run(FEW, out, workers=1, quiet=True)


def test_records_of_other_code_are_gone_on_with_only_if_they_come_out_the_same(few, tmp_path):
    out = tmp_path / "trial.jsonl"
    head = json.dumps(identity(FEW, BASE_SEED) | {"code": "another"})
    out.write_text("\n".join([head, *map(json.dumps, few)]) + "\n")
    assert run(FEW, out, quiet=True) == few

    inclusion = few[-1]["inclusion"] | {"air_loading": few[-1]["inclusion"]["air_loading"] + 0.01}
    out.write_text("\n".join([head, json.dumps(few[-1] | {"inclusion": inclusion})]) + "\n")
    with pytest.raises(SystemExit, match="comes out otherwise since the code has changed"):
        run(FEW, out, quiet=True)
    assert len(run(FEW, out, only_read=True)) == 1


def test_a_file_of_another_trial_is_refused(tmp_path):
    out = tmp_path / "trial.jsonl"
    out.write_text(json.dumps(identity(FEW, BASE_SEED + 1)) + "\n")
    with pytest.raises(SystemExit, match="made with another design"):
        run(FEW, out, quiet=True)


@pytest.mark.parametrize(("count", "n"), [(0, 600), (3, 200), (200, 200), (17, 40)])
def test_bounds_are_those_of_clopper_and_pearson(count, n):
    exact = stats.binomtest(count, n).proportion_ci(0.95, "exact")
    assert (Share(count, n).low, Share(count, n).high) == pytest.approx((exact.low, exact.high))


def test_a_bound_of_two_percent_needs_183_boards_without_one_event():
    assert Share(0, 183).high < 0.02 < Share(0, 182).high


def test_medians_have_bounds_that_hold_them():
    """95 % at least of samples of 30; and not all, or the bounds would be of no use."""
    rng = np.random.default_rng(5)
    held = [one.low <= 0.0 <= one.high for one in (median(rng.standard_normal(30)) for _ in range(1000))]
    assert 0.95 - 4 * math.sqrt(0.95 * 0.05 / 1000) <= np.mean(held) <= 0.99
    assert mean([1.0, 2.0, 3.0]).value == 2.0


def test_quantiles_of_a_histogram():
    assert quantiles(np.array([0.0, 1.0, 3.0]), np.array([0.5, 0.5]), (0.25, 0.5, 0.75)) == pytest.approx([0.5, 1, 2])


def test_compliances_by_hand():
    """25 N m on a spring of 2500 N along 0.2 m: 0.05; the nominal one of the designs likewise from its definition."""
    assert MEANINGS["clamp_rotation"][1]({"stiffness": 2500.0}, 25.0, 0.2) == pytest.approx(0.05)
    assert MEANINGS["clamp_translation"][1]({"stiffness": 2.5e7}, 25.0, 0.2) == pytest.approx(1.25e-4)


def made(cell, index, planted, word, effects=(), near=(), best=None, holds=(True, True, True), averaged=None):
    """A record made by hand; intervals without tracing never hold."""
    by_way = {"without": (False, False, False), "after": holds, "averaged": averaged or holds}
    constants = {
        name: {way: {"q05": 1.0, "q95": 2.0, "holds": held[i]} for way, held in by_way.items()}
        for i, name in enumerate(("E_x", "E_y", "G_xy"))
    }
    return {
        "cell": cell.name,
        "index": index,
        "truth": {"effects": sorted(planted)},
        "word": word,
        "effects": list(effects),
        "best": list(best if best is not None else effects[:1]),
        "set": [[[name], 0.5] for name in near],
        "none": 0.01,
        "gate": {"bare": 0.01, "best": 0.5},
        "amplitudes": {},
        "constants": constants,
        "seconds": 1.0,
    }


ONE = Cell("one", "cantilever-6", 5, size=2.0)
NULL = Cell("null", "cantilever-6", 4)


@pytest.fixture
def by_hand():
    """Five boards with one effect, four without."""
    group = "indistinguishable group"
    return [
        made(ONE, 0, ["air"], "named", ["air"], ["air", "mass"]),
        made(ONE, 1, ["air"], "named", ["mass"], ["mass"], holds=(True, False, False)),
        made(ONE, 2, ["mass"], group, ["air", "mass", "clamp"], ["air", "mass", "clamp"]),
        made(ONE, 3, ["mass"], group, ["air", "clamp"], ["air", "clamp"]),
        made(ONE, 4, ["mass"], "none needed", best=["mass"], near=["mass"], holds=(False,) * 3, averaged=(True,) * 3),
        made(NULL, 0, [], "none needed"),
        made(NULL, 1, [], "undetectable"),
        made(NULL, 2, [], "unexplained"),
        made(NULL, 3, [], "named", ["air"], ["air"]),
    ]


def test_sums_by_hand(by_hand):
    summary = summarise(by_hand, 1, (ONE, NULL))
    one, null = summary["cells"][ONE.name], summary["cells"][NULL.name]
    found = {bar["quantity"]: bar for bar in summary["bars"]}

    assert one["top_1"]["count"] == 2  # boards 0 and 4: the verdict does not matter
    assert (one["right_name"]["count"], one["wrong_name"]["count"], one["named"]["count"]) == (1, 1, 2)
    assert (one["wrong_of_named"]["count"], one["wrong_of_named"]["n"]) == (1, 2)
    assert (one["covered"]["count"], one["covered"]["n"]) == (2, 4)  # boards 0 and 2 of the four with a set
    assert one["set_size"]["value"] == pytest.approx((2 + 1 + 3 + 2) / 4)
    assert one["constants"]["after"]["E_x"]["count"] == 4
    assert one["constants"]["after"]["all"]["value"] == pytest.approx((3 + 1 + 3 + 3 + 0) / 15)
    assert one["constants"]["without"]["all"]["value"] == 0.0
    assert (null["named"]["count"], null["flagged"]["count"]) == (1, 2)
    assert found["null, cantilever-6: flagged at all"]["share"] == 0.5
    assert by_class(by_hand[:5])["air"]["after"] == pytest.approx((1 + 1 / 3) / 2)
    assert by_class(by_hand[:5])["mass"]["after"] == pytest.approx(2 / 3)
    title = "constants after tracing, cantilever-6, 2x: 90 % intervals"
    assert found[title]["share"] == pytest.approx((2 / 3 + 1) / 2)  # averaged over hypotheses, then over classes
    assert "alone 66.7 %" in found[title]["note"]


def test_confusion_by_hand(by_hand):
    rows = confusion(by_hand[:5])
    assert list(rows) == ["air", "mass"]
    assert (rows["air"]["named right"], rows["air"]["named wrong"], rows["air"]["wrong_names"]) == (1, 1, {"mass": 1})
    assert [rows["mass"][key] for key in ("group with it", "group without it", "none needed")] == [1, 1, 1]
    assert rows["mass"]["best"] == {"air": 2, "mass": 1}
    assert not is_covered(by_hand[4])
    assert listed(by_hand[4]) == frozenset()


def test_boards_without_an_answer_are_listed(by_hand, tmp_path):
    failed = {"cell": ONE.name, "index": 9, "truth": {"effects": ["air"]}, "error": "InputError: no", "seconds": 1.0}
    summary = write([*by_hand, failed], 1, tmp_path, (ONE, NULL))
    assert summary["boards"] == {"judged": 9, "failed": 1, "wanted": 9}
    assert json.loads((tmp_path / "trial.json").read_text()) == summary
    text = (tmp_path / "trial.md").read_text()
    assert "InputError: no" in text
    assert "**missed**" in text
    assert text == "\n".join(page(summary)) + "\n"


def test_shuffled_truth_misses_the_bars():
    """Records that would meet every bar of their cell do not any more if the truths are dealt out anew."""
    cell = Cell("one", "cantilever-6", 300, size=2.0)
    classes = cell.of.drawn
    right = [
        made(cell, i, [name], "named", [name], [name], holds=[i % 10 > 0] * 3)
        for i, name in enumerate(classes[i % len(classes)] for i in range(cell.n))
    ]
    rng = np.random.default_rng(0)
    shuffled = [one | {"truth": right[i]["truth"]} for one, i in zip(right, rng.permutation(len(right)), strict=True)]
    about_truth = ("unique and wrong", "in the set given", "top-1")
    for records, met in ((right, True), (shuffled, False)):
        found = [bar for bar in bars((cell,), {cell.name: records}) if any(t in bar["quantity"] for t in about_truth)]
        assert len(found) == 4  # the best answer twice: of the classes that were planned, and of all
        assert [bar["met"] for bar in found] == [met] * 4


def test_the_readme_says_in_short_what_the_trial_found():
    """The paragraph is that of the published summary, to the word."""
    root = Path(__file__).parents[2]
    summary = json.loads((root / "docs" / "validation" / "trial.json").read_text(encoding="utf-8"))
    shown = (root / "README.md").read_text(encoding="utf-8")
    inside = shown.partition("<!-- trial -->")[2].partition("<!-- /trial -->")[0]
    assert inside.strip() == (root / "docs" / "validation" / "trial-short.md").read_text(encoding="utf-8").strip()
    assert inside.strip() == in_short(summary)
