"""The trial itself on trial: its cells, a few boards, what they share, an interrupted run, workers, bounds by hand."""

from __future__ import annotations

import json
import math
import multiprocessing
import os
import signal
import time

import numpy as np
import pytest
from generator.boards import plant
from scipy import stats
from validation.trial.cells import CELLS, KINDS, NOISES, SENSORS, Cell, identity, jobs
from validation.trial.counts import Share, mean, median
from validation.trial.judge import judge_one, plant_board
from validation.trial.run import BASE_SEED, run
from validation.trial.shared import baseline_of_card, control_of
from validation.trial.summary import CONDITIONS

from bayesplate.diagnosis.null_control import null_control

FEW = (Cell("one", "cantilever-6", 1, size=2.0), Cell("null", "cantilever-6", 1))


N_FEW_SETS = 20
"""Null simulations of a setting here: enough to rank against, and to compare one run with another."""


@pytest.fixture(autouse=True, scope="module")
def few_sets():
    """Fewer null simulations than in the trial, which leaves their number to the package, in forked processes too."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("validation.trial.shared.null_control", lambda ground, rng: null_control(ground, rng, N_FEW_SETS))
        yield
    control_of.cache_clear()


def without_time(records):
    return [{key: value for key, value in record.items() if key != "seconds"} for record in records]


@pytest.fixture(scope="module")
def few():
    """Two boards judged in this process; others that it forks have its laws."""
    return [judge_one(cell, BASE_SEED, i) for cell in FEW for i in range(cell.n)]


def test_an_interrupted_run_has_part_of_every_cell():
    order = jobs(CELLS)
    assert len(order) == len(set(order)) == sum(cell.n for cell in CELLS)
    half = order[: len(order) // 2]
    for cell in CELLS:
        assert sum(one is cell for one, _ in half) == pytest.approx(0.5 * cell.n, abs=1)
    assert {cell: sum(one is cell for one, _ in jobs(CELLS, 3)) for cell in CELLS} == dict.fromkeys(CELLS, 3)


@pytest.mark.parametrize("design", SENSORS)
def test_a_card_does_not_tell_what_is_planted(design):
    """With and without a planted mass or exciter cards differ in the readings alone; it sits where the card says."""
    stated = {"kind": f'"{KINDS[design]}"'}
    attached = "exciter" if KINDS[design] == "exciter" else "attached_mass"
    cards, places = [], []
    for effects in ((), (attached,)):
        board = plant(np.random.default_rng(3), design, effects, sensor=SENSORS[design])
        cards.append([line for line in board.card_text(stated).splitlines() if not line.startswith('"(')])
        places.append(board.truth.effects.get(attached, {}).get("places"))
    assert cards[0] == cards[1]
    assert places == [None, (SENSORS[design],)]
    assert f"kind = {stated['kind']}" in cards[0]
    assert not any(line.startswith("mass_g") for line in cards[0])


def test_the_stated_noise_is_the_true_one():
    for noise, factor, resolution in (("median", 1.65, 0.0), ("drawn", 1.65, 0.0), ("known", 1.05, 0.0),
                                      ("rounded", 1.65, 1.0)):  # fmt: skip
        cell = Cell("null", "cantilever-6", 1, 17.0, noise=noise)
        planted = plant_board(np.random.default_rng(1), cell, ())
        (setup,) = baseline_of_card(planted).board.setups
        assert setup.noise.median == pytest.approx(2.0 ** (17.0 / 1200.0) - 1.0, rel=1e-5)
        assert setup.noise.log_sd == pytest.approx(math.log(factor))
        assert setup.resolution == resolution
        assert all(hz == round(hz) for hz in setup.measured) == bool(resolution)
        assert bool(planted.truth.drawn_noise) == (noise == "drawn")


def test_the_shared_law_is_that_of_the_board():
    """At the fit of another board of the design, the ideal plate's frequencies to a hundredth of a cent.

    That is a five-hundredth of the noise; on a board whose constants are a tenth larger they are others.
    """
    planted = plant_board(np.random.default_rng(2), Cell("null", "cantilever-6", 1), ())
    baseline = baseline_of_card(planted)
    predicted = baseline.possible_modes.predict(baseline.log_rigidities[None, :])[0]
    assert 1200.0 / math.log(2.0) * (predicted - baseline.log_frequency) == pytest.approx(np.zeros(6), abs=1e-2)
    larger = baseline.possible_modes.predict(baseline.log_rigidities[None, :] + math.log(1.1))[0]
    assert larger - predicted == pytest.approx(np.full(6, 0.5 * math.log(1.1)))  # f goes with the root of D


@pytest.mark.slow
def test_null_simulations_are_shared_by_boards_of_a_setting():
    """Kinds of boards and of effects do not matter, what the card says of the noise does."""
    cell = Cell("null", "cantilever-6", 1)
    assert Cell("one", "cantilever-6", 3, size=2.0).setting == Cell("null", "cantilever-6", 1, noise="drawn").setting
    others = {Cell("null", "cantilever-6", 1, noise=noise).setting for noise in NOISES}
    assert len(others | {Cell("null", "cantilever-6", 1, 2.0).setting, Cell("null", "free-12", 1).setting}) == 5
    assert control_of(cell.setting) is control_of(Cell("null", "cantilever-6", 9).setting)
    assert control_of(cell.setting).log_odds.shape == (N_FEW_SETS,)
    assert cell.setting.rng().random() == cell.setting.rng().random()
    assert len({one.rng().random() for one in others}) == 3


def test_a_record_tells_everything(few):
    for record in few:
        assert "error" not in record
        assert 0.0 <= record["none"] <= 1.0
        assert set(record["gate"]) == {"bare", "best"}
        assert set(record["conditions"]) == (set(CONDITIONS) if record["effects"] else set())
        assert record["claim"] == (bool(record["effects"]) and all(record["conditions"].values()))
        assert 0.0 <= record["gain_percentile"] <= 100.0
        assert record["needed"] or not record["effects"]
        assert record["support"] == record["set"][0][1]
        assert frozenset(record["best"]) == frozenset(record["set"][0][0])
        for intervals in record["constants"].values():
            for one in intervals.values():
                assert one["q05"] < one["q95"]
        for name in record["constants"]:
            true, one = record["truth"]["constants"][name], record["constants"][name]["averaged"]
            assert one["holds"] == (one["q05"] <= true <= one["q95"])


@pytest.mark.slow
def test_a_board_depends_neither_on_the_workers_nor_on_the_order(few, tmp_path):
    again = run(FEW[::-1], tmp_path / "other.jsonl", workers=2, quiet=True)
    order = {cell.name: place for place, cell in enumerate(FEW)}
    assert without_time(sorted(again, key=lambda r: (order[r["cell"]], r["index"]))) == without_time(few)
    other_seed = judge_one(FEW[0], BASE_SEED + 1, 0)
    assert other_seed["truth"]["constants"] != few[0]["truth"]["constants"]


@pytest.mark.slow
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
    assert 1 <= n_done <= len(few)
    with out.open("a") as file:
        file.write('{"cell": "one cant')  # killed while it wrote the next
    assert without_time(run(FEW, out, workers=1, quiet=True)) == without_time(few)
    assert len(out.read_text().splitlines()) == 1 + len(few)


def _in_a_group(out):
    os.setpgrp()
    run(FEW, out, workers=1, quiet=True)


@pytest.mark.slow
def test_records_of_other_code_are_gone_on_with_only_if_they_come_out_the_same(few, tmp_path):
    out = tmp_path / "trial.jsonl"
    head = json.dumps(identity(FEW, BASE_SEED) | {"code": "another"})
    out.write_text("\n".join([head, *map(json.dumps, few)]) + "\n")
    assert run(FEW, out, quiet=True) == few

    inclusion = few[-1]["inclusion"] | {"fluid_loading": few[-1]["inclusion"]["fluid_loading"] + 0.01}
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


def test_medians_have_bounds_that_hold_them():
    """95 % at least of samples of 30; and not all, or the bounds would be of no use."""
    rng = np.random.default_rng(5)
    held = [one.low <= 0.0 <= one.high for one in (median(rng.standard_normal(30)) for _ in range(1000))]
    assert 0.95 - 4 * math.sqrt(0.95 * 0.05 / 1000) <= np.mean(held) <= 0.99
    assert mean([1.0, 2.0, 3.0]).value == 2.0
