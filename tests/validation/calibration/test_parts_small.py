"""The parts of the calibration beside the ranks, small: each agrees where all is right and finds out what is wrong."""

from __future__ import annotations

import json
import time
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from validation.calibration import again, bare, campaign_ranks, joint, oracle
from validation.calibration.records import add_to, read_done
from validation.calibration.run import SECTIONS, page, parts
from validation.calibration.study import Study
from validation.calibration.table import is_calibrated, is_caught, rows

N_STEPS = 200


@cache
def chains(mutant=""):
    """The twelve standardised differences after a few hundred steps."""
    return joint.check_one(joint.N_CHAINS, N_STEPS, 1, mutant)


def test_constants_and_readings_drawn_in_turn_keep_their_distribution():
    assert len(chains()["z"]) == 12
    assert joint.agrees(list(chains()["z"].values())), chains()["z"]


def test_chains_are_judged_by_their_moments_and_their_length():
    calm, far = {"ln D_x": 1.0, "ln D_y": -2.0}, {"ln D_x": 5.0, "ln D_y": -2.0}
    whole = {"chains": joint.N_CHAINS, "steps": joint.N_STEPS}
    right = [{**whole, "mutant": "", "z": calm}, *({**whole, "mutant": one, "z": far} for one in joint.MUTANTS)]

    assert joint.judge(right)[1]
    assert not joint.judge([{**right[0], "z": far}, *right[1:]])[1]
    assert not joint.judge([*right[:2], {**right[2], "z": calm}])[1]
    assert not joint.judge(right[:2])[1]
    assert not joint.judge([{**right[0], "steps": joint.N_STEPS - 1}, *right[1:]])[1]


def test_control_errors_drawn_half_as_large_are_found():
    assert not joint.agrees(list(chains("errors drawn half as large")["z"].values()))


@pytest.mark.parametrize(
    ("z", "is_right"),
    [([3.9, *[0.0] * 11], True), ([4.1, *[0.0] * 11], False), ([3.1, -3.1, *[0.0] * 10], False)],
)
def test_all_within_four_and_one_beyond_three(z, is_right):
    assert joint.agrees(z) is is_right


def test_every_row_has_its_own_readings():
    rng = np.random.default_rng(5)
    theta = joint.prior_draws(3, rng)
    hertz = joint.readings(theta, rng)
    base = joint.reference_posterior()
    every = joint.ByRow(base.board, base.prior, base.models, "linear", hertz=hertz)
    found = joint.density(every, np.concatenate([theta, theta]))

    for i, one in enumerate(hertz):
        alone = again.with_readings(base, [one])
        assert found[[i, i + 3]] == pytest.approx(alone(theta[[i]])[0])


def test_draws_agree_with_a_closed_form_and_wrong_ones_do_not():
    record = oracle.check_one(oracle.KINDS[0], 0)

    assert record["differs"] == []
    assert record["ess"] >= 2500.0
    assert all(record["wrong"].values())


def oracle_records(shift=0.0, wrong=1):
    rng = np.random.default_rng(1)
    return [
        {"kind": kind, "set": i, "ess": 3000.0, "differs": [], "z": (shift + rng.normal(size=3)).tolist(),
         "wrong": {"spread 1.15 of itself": wrong}}
        for kind in oracle.KINDS for i in range(oracle.N_SETS)
    ]  # fmt: skip


def test_closed_forms_are_judged_by_fifty_sets_their_means_and_the_wrong_draws():
    right = oracle_records()

    assert oracle.judge(right)[1]
    assert not oracle.judge(right[:-1])[1]  # one too few
    assert not oracle.judge(oracle_records(shift=0.8))[1]
    assert not oracle.judge(oracle_records(wrong=0))[1]
    assert not oracle.judge([{**right[0], "differs": ["mean of parameter 1"]}, *right[1:]])[1]


@pytest.mark.slow
def test_ranks_with_bare_peaks_are_uniform_and_half_of_the_noise_is_found_out():
    records = [bare.simulate_one(i) for i in range(12)]
    assert [one for one in records if "error" in one] == []
    assert sum(one["peaks"] for one in records) > 12 * 3
    of = {name: rows([one["ranks"][name] for one in records]) for name in records[0]["ranks"]}

    assert is_calibrated(of["production"]), of["production"]
    assert is_caught(bare.HALF_NOISE, of[bare.HALF_NOISE])


@pytest.mark.slow
def test_ranks_of_a_campaign_are_uniform_and_boards_that_count_eight_times_are_found_out():
    records = [campaign_ranks.simulate_one(i, times=8) for i in range(10)]
    assert [one for one in records if "error" in one] == []
    of = {name: rows([one["ranks"][name] for one in records]) for name in records[0]["ranks"]}

    assert {"shared", "E_x", "held_out"} <= {row.name for row in of["production"]}
    assert is_calibrated(of["production"]), of["production"]
    assert is_caught(campaign_ranks.TWICE, of[campaign_ranks.TWICE])


N_AT_CLAMPED = 3


@pytest.fixture(scope="module")
def at_clamped():
    return [again.simulate_again("fiemme-spruce-clamped", i, "linear") for i in range(N_AT_CLAMPED)]


def test_ranks_at_a_board_are_of_readings_that_it_might_have_given(at_clamped):
    assert [one for one in at_clamped if "error" in one] == []
    ranks = np.array([list(one["ranks"]["production"].values()) for one in at_clamped])
    assert ranks.shape[1] == 8
    mean = ranks.mean() / again.N_DRAWS
    assert abs(mean - 0.5) < 4 * np.sqrt(1.0 / 12.0 / N_AT_CLAMPED)  # as if the quantities were one
    problem, pool = again.at_board("fiemme-spruce-clamped", "linear")
    posterior = problem.posterior
    same = again.with_readings(posterior, [setup.measured for setup in posterior.board.setups])
    both = again.OfBoth(posterior.board, posterior.prior, posterior.models, posterior.law, second=same)
    twice = posterior(pool[:5]) + posterior.log_likelihood(pool[:5]).sum(axis=1)
    assert both(pool[:5]) == pytest.approx(twice)


def ranks_at_boards(n, spread):
    """Ranks of a normal truth among normal draws of that spread, as records."""
    rng = np.random.default_rng(2)
    records = []
    for board in again.BOARDS:
        for i in range(n):
            truth, draws = rng.normal(size=2), rng.normal(size=(99, 2))
            ranks = {
                kind: {name: int(np.sum(size * draws[:, k] < truth[k])) for k, name in enumerate(("D_x", "D_y"))}
                for kind, size in (("production", spread), (again.MUTANT, 0.7 * spread))
            }
            records.append({"board": board, "simulation": i, "ranks": ranks})
    return records


def test_boards_are_judged_by_their_bands():
    assert again.judge(ranks_at_boards(200, 1.0))[1]
    assert not again.judge(ranks_at_boards(200, 0.7))[1]
    assert not again.judge(ranks_at_boards(199, 1.0))[1]
    assert not again.judge([*ranks_at_boards(200, 1.0), {"board": again.BOARDS[0], "simulation": 200, "error": "x"}])[1]


def doubled(kind, number):
    return {"kind": kind, "set": number, "value": 2 * number}


def test_a_part_goes_on_where_it_stopped(tmp_path):
    jobs = [({"kind": "a", "set": i}, ("a", i)) for i in range(3)]
    part = Study(doubled, {"part": "made"}, jobs, lambda records: ([], True))
    out = tmp_path / "made.jsonl"
    out.write_text("\n".join([json.dumps({"part": "made"}), json.dumps(doubled("a", 1) | {"kept": True}), ""]))

    records = part.run(out, 1, quiet=True)
    assert [record["value"] for record in records] == [0, 2, 4]
    assert records[1]["kept"]
    assert part.done(out) == records
    assert part.done(tmp_path / "other.jsonl") == []
    assert not (tmp_path / "other.jsonl").exists()
    assert len(out.read_text().splitlines()) == 4


def test_the_page_tells_of_a_part_that_was_not_run():
    text = page({"oracle": ["noise known, 50 data sets: agree"]})

    assert text.count("Not run with this version.") == len(SECTIONS) - 1
    assert page({}, text) == text  # of what is not run again the page keeps what it said
    again_run = page({"oracle": ["else"], "joint": ["more"]}, text)
    assert "agree" not in again_run
    assert again_run.count("Not run with this version.") == len(SECTIONS) - 2
    assert "noise known, 50 data sets: agree" in text
    assert text.index("## Closed forms") < text.index("noise known") < text.index("## At the paper's boards")
    assert set(parts(1, 1, 1, 1)) == set(SECTIONS) - {"ranks"}


def fails_first(folder, number):
    """A simulation that another process can import: the first one fails, each other leaves a file."""
    if number == 0:
        raise KeyError(number)
    time.sleep(0.02)
    (Path(folder) / str(number)).touch()
    return {"simulation": number}


def test_a_simulation_that_fails_ends_the_run_and_no_other_is_begun(tmp_path):
    out = tmp_path / "records.jsonl"
    read_done(out, {})
    (tmp_path / "done").mkdir()
    with pytest.raises(KeyError):
        add_to(out, fails_first, [(str(tmp_path / "done"), number) for number in range(100)], 1, quiet=True)
    assert len(list((tmp_path / "done").iterdir())) < 50  # those that were handed on; all 99 if the run went on
