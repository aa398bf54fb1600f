"""What to measure next in a campaign: proposals in their order, and sheets for the modes to look for."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import bayesplate
from bayesplate.board.quantity import Quantity
from bayesplate.campaigns.scatter import expected_width
from bayesplate.planning.campaign import Reading, benches, joint_of, readings
from bayesplate.planning.joint import board_in_joint
from bayesplate.planning.proposals import Costs

SHARED = "attached_mass.mass"


@pytest.fixture(scope="module")
def planned(campaign, tmp_path_factory):
    """A plan of three boards with one sensor, with its files."""
    return bayesplate.plan(campaign, out=tmp_path_factory.mktemp("plan"))


def test_what_narrows_the_shared_parameter_most_comes_first(planned):
    listed = planned.summary.proposals
    scores = [one.gain.score for one in listed]

    assert planned.summary.basis == "campaign"
    assert listed[0].sentence in planned.summary.first
    assert scores == sorted(scores, reverse=True)
    assert scores == pytest.approx([-np.log(one.gain.shared[SHARED]) for one in listed])
    (weighing,) = [one for one in listed if "Weigh" in one.sentence]
    assert weighing is listed[0]  # the sensor itself: a reading of what is shared, and nothing beside it
    assert weighing.gain.E_x > 0.9


def test_two_steps_give_more_than_one_and_three_more_than_two(planned):
    best = planned.summary.proposals[0].gain.score
    scores = [best, *(one.gain.score for one in planned.summary.sequences)]
    costs = [one.cost_minutes for one in planned.summary.sequences]

    assert len(scores) == 3
    assert scores == sorted(scores)
    assert costs == sorted(costs)


@pytest.fixture(scope="module")
def joint(campaign):
    """All boards to first order."""
    boards = [one.prepared.board for one in campaign.problems]
    return joint_of(boards, [one.prior for one in campaign.problems], campaign.shared)


@pytest.fixture(scope="module")
def listed(campaign, joint):
    """What could be read next, for the sake of E_y."""
    return readings(joint, [one.prior for one in campaign.problems], campaign.shared, Costs(), "E_y")


def test_a_board_whose_number_scatters_says_less_of_the_middle(campaign, joint):
    """Its precision and the variance of the scatter, joined as of a sum; not where nothing scatters."""
    problem, alone = campaign.problems[0], joint.boards[0]
    shared = tuple(replace(one, scatter=0.5) for one in campaign.shared)
    scattered = board_in_joint(problem.prepared.board, problem.prior, shared)
    width = expected_width(shared)

    assert scattered.of_shared == pytest.approx(np.linalg.inv(np.linalg.inv(alone.of_shared) + np.diag(width**2)))
    assert scattered.of_shared[0, 0] < 0.9 * alone.of_shared[0, 0]


def test_a_reading_counts_with_the_uncertainty_that_it_was_stated_with(campaign, joint):
    problem = campaign.problems[0]
    (setup,) = problem.prepared.board.setups
    first = setup.readings[0]
    rough = replace(first, frequency=Quantity.from_mean(first.frequency.mean, 0.03 * first.frequency.mean))
    board = replace(problem.prepared.board, setups=(replace(setup, readings=(rough, *setup.readings[1:])),))
    made = board_in_joint(board, problem.prior, campaign.shared)

    assert made.variance(0)[0] - made.variance(0)[1] == pytest.approx(0.03**2, rel=0.01)
    assert joint.boards[0].variance(0)[0] == joint.boards[0].variance(0)[1]


def test_two_ways_to_know_one_size_better_are_not_proposed_together(joint):
    row = np.ones((1, 3))
    more, finer, other = (
        Reading("size", "board-0", "", name, 1.0, (), values, np.ones(1))
        for name, values in (("more", row), ("finer", row.copy()), ("another", 2.0 * row))
    )

    assert more.excludes(finer)
    assert more.excludes(more)
    assert not more.excludes(other)
    assert not replace(more, what="modes").excludes(replace(finer, what="modes"))


def test_modes_to_look_for_have_a_sheet_with_the_sensor_where_it_stands(campaign, joint, listed):
    found = [one.entry for one in benches(joint, listed)]

    assert len(found) == 2
    for bench in found:
        (asked,) = [one for one in listed if one.further and (one.board, one.setup) == (bench.board, bench.setup)]
        assert {mode.label for mode in bench.modes} == set(asked.labels)
        assert all(mode.low_hz < mode.hz < mode.high_hz for mode in bench.modes)
        if asked.what == "edges":
            continue
        board = next(one.prepared.board for one in campaign.problems if one.prepared.board.name == bench.board)
        ((x, y),) = board.setups[0].attached[0].places
        assert bench.sensor_mm == pytest.approx((1e3 * x, 1e3 * y), abs=25)  # the grid of places


def test_boards_that_tell_most_may_be_held_another_way(joint, listed):
    """What it leaves of the shared parameter, by a normal update by hand."""
    other = [one for one in listed if one.what == "edges"]
    order = sorted(joint.boards, key=lambda one: -np.trace(one.of_shared))
    assert {one.board for one in other} == {one.board.name for one in order[:2]}
    for one in other:
        assert one.sentence.startswith(f"Measure board {one.board} ")
        assert one.cost == Costs().clamping + len(one.labels) * Costs().reading
        place = [each.board.name for each in joint.boards].index(one.board)
        law = joint.boards[place].laws[one.further.setup]
        assert law.station.is_new
        assert not joint.boards[place].was_read(one.further.setup).any()
        noise = law.station.setup.noise.median
        assert one.variance == pytest.approx(np.full(len(one.labels), noise**2))
    one = other[0]
    known = np.linalg.inv(joint.covariance) + one.rows.T @ (one.rows / one.variance[:, None])
    before, after = (np.diagonal(joint.wanted @ c @ joint.wanted.T) for c in (joint.covariance, np.linalg.inv(known)))
    of_shared, _, _ = joint.ratios(one.rows, one.variance)
    assert of_shared == pytest.approx(np.sqrt(after / before)[: joint.n_shared])
    assert of_shared[0] < 1.0


def test_the_sheets_are_those_of_the_steps_that_are_proposed_together(campaign, listed, tmp_path, monkeypatch):
    """Where modes are all that could be read, the best three are of three boards; two of them get a sheet."""
    of_modes = tuple(one for one in listed if one.further)
    monkeypatch.setattr("bayesplate.workflow.campaign_plan.readings", lambda *_: of_modes)
    found = bayesplate.plan(campaign, goal="E_y", out=tmp_path / "out")
    asked = found.summary.sequences[-1].steps

    assert len(asked) == 3
    assert len(found.benches) == len(found.summary.bench) == 2
    for bench, step in zip(found.summary.bench, asked, strict=False):
        assert f"of board {bench.board} as well" in step
    assert {"plan-bench.png", "plan-bench-2.svg"} <= {path.name for path in found.files}


def test_the_band_of_a_mode_has_what_is_not_known_of_the_board_and_the_noise(joint, listed):
    """Two times in three, so 0.967 standard deviations either way; of a board that were known, the noise alone."""
    (reading, *_) = [one for one in listed if one.further]
    known = replace(joint)
    known.__dict__["covariance"] = np.zeros_like(joint.covariance)
    widths = []
    for one in (joint, known):
        (bench,) = benches(one, [reading])
        by_label = {mode.label: np.log(mode.high_hz / mode.low_hz) for mode in bench.entry.modes}
        widths.append(np.array([by_label[label] for label in reading.labels]))

    assert widths[1] == pytest.approx(2.0 * 0.9674 * np.sqrt(reading.variance), rel=1e-3)
    of_board = np.einsum("nu,uv,nv->n", reading.rows, joint.covariance, reading.rows)
    assert widths[0] / widths[1] == pytest.approx(np.sqrt(1.0 + of_board / reading.variance))


def test_a_plan_without_modes_to_look_for_has_no_sheet(planned):
    told = json.loads(next(path for path in planned.files if path.name == "plan.json").read_text())

    assert told["basis"] == "campaign"
    assert not any("as well" in step for step in told["sequences"][-1]["steps"])
    assert told["bench"] == []
    assert {path.name for path in planned.files} == {"plan.json", "plan.png", "plan.svg"}
