"""What to measure next in a campaign: proposals in their order, and sheets for the modes to look for."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import bayesplate
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak
from bayesplate.campaign.scatter import expected_width
from bayesplate.planning.bench import make_benches, reading_bands
from bayesplate.planning.campaign import _add_peaks, _linearise_board, _weigh_readings, campaign_beliefs
from bayesplate.planning.proposals import Costs, Planner
from bayesplate.planning.tables import plan_tables

SHARED = "attached_mass.mass"


@pytest.fixture(scope="module")
def planned(campaign, planner, tmp_path_factory):
    """A plan of three boards with one sensor, with its files."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bayesplate.commands.plan.campaign_beliefs", lambda *_: planner.beliefs)
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
    (table, *_) = (one for one in plan_tables(planned.summary) if "measure next" in one.title)
    assert "the mean over all boards" in table.title
    assert "attached mass" in table.columns
    assert "E_x" not in table.columns


@pytest.fixture(scope="module")
def posed(campaign):
    """Boards, priors and what they share."""
    campaign.pose()
    boards = [one.posed.board for one in campaign.problems]
    return boards, [one.prior for one in campaign.problems], campaign.shared


@pytest.fixture(scope="module")
def planner(posed):
    """All boards to first order, for the sake of E_y."""
    return Planner(campaign_beliefs(*posed), 1, "E_y")


@pytest.fixture(scope="module")
def listed(posed, planner):
    """What could be read next."""
    return planner.rank_proposals(*posed[1:])


def judged(posed, planner, **other):
    """What the first board says where it has other readings or shares something else, its plate as it was solved."""
    known, noise = planner.beliefs.boards[0], planner.beliefs.explanations[0].noise[0, :1]
    given = {"board": known.board, "shared": posed[2], "laws": known.laws[:1]} | other
    return _weigh_readings(given["board"], posed[1][0], given["shared"], known.values, noise, given["laws"])


def test_a_board_whose_number_scatters_says_less_of_the_middle(posed, planner):
    """Its precision and the variance of the scatter, joined as of a sum; not where nothing scatters."""
    alone = planner.beliefs.boards[0].shared_precision
    scattering = tuple(replace(one, scatter=0.5) for one in posed[2])
    scattered = judged(posed, planner, shared=scattering).known_board.shared_precision
    width = expected_width(scattering)

    assert scattered == pytest.approx(np.linalg.inv(np.linalg.inv(alone) + np.diag(width**2)))
    assert scattered[0, 0] < 0.9 * alone[0, 0]


def test_a_reading_counts_with_the_uncertainty_that_it_was_stated_with(posed, planner):
    """In the precision of the board: by hand, a row with its own variance in place of the noise alone."""
    (board, *_), _, shared = posed
    (setup,), law = board.setups, planner.beliefs.boards[0].laws[0]
    first = setup.readings[0]
    rough = replace(first, frequency=Quantity.from_mean(first.frequency.mean, 0.03 * first.frequency.mean))
    read = replace(setup, readings=(rough, *setup.readings[1:]))
    laws = (replace(law, station=replace(law.station, base=read)),)
    known, noise, precision = judged(posed, planner, board=replace(board, setups=(read,)), laws=laws)

    rows = law.slopes[0, : law.station.n_old] @ known.columns
    variance = np.full(len(rows), noise[0] ** 2)
    variance[0] += np.log1p(0.03**2)
    n = board.symmetry.n
    own = np.diag([*np.zeros(n), *np.ones(len(precision) - n - len(shared)), *np.zeros(len(shared))])
    assert precision == pytest.approx(own + rows.T @ (rows / variance[:, None]), rel=1e-3)


def test_peaks_that_stand_by_a_mode_are_taken_for_it(posed):
    """Two labels taken from a board: their peaks tell as much, and none of the two is proposed."""
    (board, *_), (prior, *_), shared = posed
    (setup,) = board.setups
    peaks = tuple(Peak(one.frequency) for one in setup.readings[-2:])
    bare = replace(board, setups=(replace(setup, readings=setup.readings[:-2], peaks=peaks),))
    (law,) = _linearise_board(bare, prior, shared).known_board.laws

    assert law.station.n_old == len(setup.readings)
    assert set(law.station.setup.labels[: law.station.n_old]) == set(setup.labels)
    assert set(law.station.base.labels) == set(setup.labels)


def test_a_peak_between_two_modes_is_one_reading(planner):
    """Two further modes 0.3 % apart with one peak between them: the nearer one has it."""
    law = planner.beliefs.boards[0].laws[0]
    n_old, hertz = law.station.n_old, np.exp(law.solved[0])
    hertz[n_old + 1] = 1.003 * hertz[n_old]
    peak = Peak(Quantity.from_mean(1.001 * hertz[n_old], 0.1))
    near = replace(law, station=replace(law.station, base=replace(law.station.base, peaks=(peak,))),
                   solved=np.log(hertz)[None])  # fmt: skip
    taken = _add_peaks(near).station

    assert taken.n_old == n_old + 1
    assert taken.setup.labels[n_old] == law.station.setup.labels[n_old]


def test_modes_to_look_for_have_a_sheet_with_the_sensor_where_it_stands(posed, planner, listed):
    found = [one.entry for one in make_benches(planner.beliefs, listed)]

    assert len(found) == 2
    for bench in found:
        (asked,) = [one.entry for one in listed if (one.entry.board, one.entry.setup) == (bench.board, bench.setup)
                    and one.entry.what in ("modes", "edges")]  # fmt: skip
        assert {mode.label for mode in bench.modes} == set(asked.modes)
        (law,) = [law for one in planner.beliefs.boards for law in one.laws
                  if (one.board.name, law.station.setup.name) == (bench.board, bench.setup)]  # fmt: skip
        at_estimate = dict(zip(map(str, law.station.setup.labels), np.exp(law.solved[0]), strict=True))
        assert [mode.hz for mode in bench.modes] == pytest.approx([at_estimate[mode.label] for mode in bench.modes])
        assert all(mode.low_hz < mode.hz < mode.high_hz for mode in bench.modes)
        if asked.what == "edges":
            continue
        ((x, y),) = next(one for one in posed[0] if one.name == bench.board).setups[0].attached[0].places
        assert bench.sensor_mm == pytest.approx((1e3 * x, 1e3 * y), abs=0.5)  # whole mm


def test_boards_that_tell_most_may_be_held_another_way(planner, listed):
    """What it leaves of the shared parameter, by a normal update by hand."""
    other = [one for one in listed if one.entry.what == "edges"]
    beliefs = planner.beliefs
    order = sorted(beliefs.boards, key=lambda one: -np.trace(one.shared_precision))
    assert {one.entry.board for one in other} == {one.board.name for one in order[:2]}
    for one in other:
        assert one.entry.sentence.startswith(f"Measure board {one.entry.board} ")
        assert one.entry.cost_minutes == Costs().clamping + len(one.entry.modes) * Costs().reading
        assert one.station_readings.law.station.is_new
        assert one.station_readings.repeats is None
        noise = one.station_readings.law.station.setup.noise.median
        assert one.readings.variance[0][0] == pytest.approx(np.full(len(one.entry.modes), noise**2))
    one, (now,) = other[0], beliefs.explanations
    rows, variance = one.readings.slopes[0][0], one.readings.variance[0][0]
    known = np.linalg.inv(now.covariance[0]) + rows.T @ (rows / variance[:, None])
    wanted = now.target_slopes[0]
    before, after = (np.diagonal(wanted @ c @ wanted.T) for c in (now.covariance[0], np.linalg.inv(known)))
    of_shared = list(one.entry.gain.shared.values())
    assert of_shared == pytest.approx(np.sqrt(after / before)[: len(of_shared)])
    assert of_shared[0] < 1.0


def test_the_sheets_are_those_of_the_steps_that_are_proposed_together(campaign, planner, listed, tmp_path, monkeypatch):
    """Where modes are all that could be read, the best three are of three boards; two of them get a sheet."""
    monkeypatch.setattr("bayesplate.commands.plan.campaign_beliefs", lambda *_: planner.beliefs)
    of_modes = tuple(one for one in listed if one.entry.what in ("modes", "edges"))
    monkeypatch.setattr(Planner, "rank_proposals", lambda *_: of_modes)
    found = bayesplate.plan(campaign, goal="E_y", out=tmp_path / "out")
    asked = found.summary.sequences[-1].steps

    tables = plan_tables(found.summary)
    assert all(name in tables[0].columns for name in ("E_x", "E_y", "G_xy"))  # of the goal, not of what is shared
    assert all(f"At the bench, board {bench.board}, " in one.title
               for bench, one in zip(found.summary.bench, tables[-2:], strict=True))  # fmt: skip
    assert len(asked) == 3
    assert len(found.benches) == len(found.summary.bench) == 2
    for bench, step in zip(found.summary.bench, asked, strict=False):
        assert f"of board {bench.board} as well" in step
    assert {"plan-bench.png", "plan-bench-2.svg"} <= {path.name for path in found.files}


def test_the_band_of_a_mode_has_what_is_not_known_of_the_board_and_the_noise(planner, listed):
    """Two times in three, so 0.967 standard deviations either way; of a board that were known, the noise alone."""
    reading = next(one for one in listed if one.entry.what == "modes").readings
    (now,) = planner.beliefs.explanations
    known = replace(planner.beliefs, explanations=(replace(now, covariance=np.zeros_like(now.covariance)),))
    of_both, of_noise = (np.diff(reading_bands(one, reading)[:, [0, 2]])[:, 0] for one in (planner.beliefs, known))

    rows, variance = reading.slopes[0][0], reading.variance[0][0]
    assert of_noise == pytest.approx(2.0 * 0.9674 * np.sqrt(variance), rel=1e-3)
    of_board = np.einsum("nu,uv,nv->n", rows, now.covariance[0], rows)
    assert of_both / of_noise == pytest.approx(np.sqrt(1.0 + of_board / variance))


def test_a_plan_without_modes_to_look_for_has_no_sheet(planned):
    told = json.loads(next(path for path in planned.files if path.name == "plan.json").read_text())

    assert told["basis"] == "campaign"
    assert not any("as well" in step for step in told["sequences"][-1]["steps"])
    assert told["bench"] == []
    assert {path.name for path in planned.files} == {"plan.json", "plan.png", "plan.svg"}
