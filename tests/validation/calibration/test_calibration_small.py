"""Calibration of the whole inference: a small one by the linear law, and the full one by the exact law, slow."""

from __future__ import annotations

import json

import numpy as np
import pytest
import ritz
from validation.calibration.layouts import EFFECTS, HELD_OUT, LABELS, TWICE
from validation.calibration.mutants import FITTED, TWICE_COUNTED, counted_twice
from validation.calibration.records import read_done
from validation.calibration.run import FEWEST_OF_MUTANT, fitted_mutants, judge, run
from validation.calibration.sbc import N_DRAWS, held_out, identity, quantities, simulate_one
from validation.calibration.table import MUTANTS, family_p_value, is_calibrated, is_caught, rows
from validation.calibration.truths import Design, draw_truth, make_problem

from bayesplate.board.material import RIGIDITIES

SMALL = Design(law="fixed-linear", resolution=0.0, thickness_sd=0.0, n_walkers=12)
N_SMALL, N_HALF, N_FLIPPED = 96, 32, 10
"""The wrong sign is found in few: nearly every rank is at an end. A spread of 0.7 takes all of them."""


@pytest.fixture(scope="module")
def two():
    return [simulate_one(SMALL, i) for i in range(2)]


@pytest.fixture(scope="module")
def small():
    """The same simulations whenever they are made."""
    both = ("noise fixed at half", "sign of the Poisson ratio flipped")
    records = [simulate_one(SMALL, i, both[: (i < N_HALF) + (i < N_FLIPPED)]) for i in range(N_SMALL)]
    assert [record for record in records if "error" in record] == []
    return records


def ranks_of(records, kind):
    return [record["ranks"][kind] for record in records if kind in record["ranks"]]


@pytest.mark.slow
def test_ranks_of_the_truth_are_uniform(small):
    table = rows(ranks_of(small, "production"))
    assert {row.name for row in table} >= {"D_x", "D_y", "D_s", "E_x", "E_y", "G_xy", "noise", "held_out",
                                           "log_likelihood"}  # fmt: skip
    assert is_calibrated(table), table


@pytest.mark.slow
@pytest.mark.parametrize("mutant", [
    "likelihood omitted", "noise fixed at half", "sign of the Poisson ratio flipped", "spread 0.7 of itself"
])  # fmt: skip
def test_a_wrong_posterior_is_caught(small, mutant):
    table = rows(ranks_of(small, mutant))
    assert is_caught(mutant, table), table


@pytest.mark.slow
def test_without_the_likelihood_only_the_likelihood_tells(small):
    """Draws from the prior are calibrated for every parameter: why the log likelihood is ranked."""
    table = {row.name: row for row in rows(ranks_of(small, "likelihood omitted"))}
    told = table.pop("log_likelihood")
    assert told.mean_rank == 1.0
    assert family_p_value(list(table.values())) > 0.01


@pytest.fixture(scope="module")
def with_effect():
    """A simulated free board on something soft, under the exact law, and its truth."""
    design = Design(effect=EFFECTS["free"])
    truth = draw_truth(design, np.random.default_rng(2))
    return design, truth, make_problem(design, truth)


def test_the_size_of_an_effect_and_a_frequency_that_was_not_read_are_ranked(with_effect):
    design, truth, problem = with_effect
    unread = held_out(design, problem)
    found = quantities(problem, truth.theta(problem), unread)
    size = found["support_stiffness.stiffness[free]"][0]

    assert size == pytest.approx(truth.values["support_stiffness.stiffness[free]"])
    plate = ritz.Plate(
        *(truth.values[name] for name in RIGIDITIES), nu_xy=truth.values["poisson_xy"], rho=truth.values["density"],
        h=truth.values["thickness"], L_x=truth.values["length_x"], L_y=truth.values["length_y"], edges=ritz.ALL_FREE,
    )  # fmt: skip
    bare = ritz.simulate(plate, (HELD_OUT["free"],))[HELD_OUT["free"]]
    bounce = size / (truth.values["density"] * truth.values["thickness"]) / (2.0 * np.pi) ** 2
    assert np.exp(2.0 * found["held_out"][0]) == pytest.approx(bare**2 + bounce, rel=2e-3)  # the linear law


def test_a_mode_counted_twice_adds_its_likelihood_once_more(with_effect):
    design, truth, problem = with_effect
    theta = truth.theta(problem)
    once = problem.posterior.log_likelihood(theta)
    added = counted_twice(problem, design.edges).posterior(theta) - problem.posterior(theta)

    assert added == pytest.approx(once[:, LABELS["free"].index(TWICE["free"])], rel=1e-9)


def test_a_simulation_is_the_same_whenever_it_is_made(two):
    again = simulate_one(SMALL, 1)
    assert again["ranks"] == two[1]["ranks"]
    assert again["ranks"] != two[0]["ranks"]


def test_an_interrupted_run_goes_on(two, tmp_path):
    out = tmp_path / "ranks.jsonl"
    lines = [json.dumps(identity(SMALL)), *(json.dumps(record) for record in two)]
    out.write_text("\n".join(lines[:-1]) + "\n" + lines[-1][:40])  # killed while it wrote the last one
    records = run(SMALL, 1, 0, 1, out, quiet=True)
    assert records == two[:-1]  # nothing was left to do
    assert len(out.read_text().splitlines()) == 2
    _, well = judge(records)
    assert not well  # too few simulations of the mutants to say that they would be caught


def test_each_mutant_is_fitted_as_often_as_it_takes():
    assert fitted_mutants(0, 1000) == FITTED
    assert fitted_mutants(FEWEST_OF_MUTANT, 1000) == (TWICE_COUNTED,)
    most = MUTANTS[TWICE_COUNTED]
    assert fitted_mutants(most - 1, 1000) == (TWICE_COUNTED,)
    assert fitted_mutants(most, 1000) == ()
    assert fitted_mutants(10, 10) == ()
    assert max(MUTANTS[name] for name in FITTED if name != TWICE_COUNTED) <= FEWEST_OF_MUTANT


def test_a_simulation_without_its_mutants_is_made_again(tmp_path):
    """The one that has those that are asked for is left as it is."""
    out = tmp_path / "ranks.jsonl"
    first = run(SMALL, 1, 0, 1, out, quiet=True)
    again = run(SMALL, 1, 1, 1, out, quiet=True)
    assert set(again[0]["ranks"]) - set(first[0]["ranks"]) | set(again[0]["refused"]) == set(FITTED)
    assert again[0]["ranks"]["production"] == first[0]["ranks"]["production"]
    before = out.read_text()
    assert run(SMALL, 1, 1, 1, out, quiet=True) == again
    assert out.read_text() == before


def test_a_file_of_another_design_is_refused(tmp_path):
    out = tmp_path / "ranks.jsonl"
    read_done(out, identity(SMALL))
    with pytest.raises(SystemExit, match="made with another design"):
        read_done(out, identity(Design()))


def test_simulations_without_draws_are_not_passed_over():
    ranks = {"D_x": 50, "log_likelihood": 50}
    rng = np.random.default_rng(0)
    good = [
        {
            "simulation": i,
            "ranks": {
                "production": {name: int(rng.integers(N_DRAWS + 1)) for name in ranks},
                **dict.fromkeys(MUTANTS, ranks),
            },
            "seconds": 1.0,
            "law": "exact",
            "attempts": 1,
            "relabelled": False,
        }
        for i in range(1000)
    ]
    assert judge(good)[1]
    assert not judge(good[: max(MUTANTS.values()) - 1])[1]  # one too few to say that the subtlest mutant is caught
    paragraphs, well = judge([*good, {"simulation": 1000, "error": "NotConvergedError: too short"}])
    assert not well
    assert "1 simulations gave no draws" in paragraphs[0]


@pytest.mark.slow
@pytest.mark.parametrize("design", [
    Design(effect="support_stiffness"), Design(generator="ritz", law="auto")
], ids=["exact", "another solver"])  # fmt: skip
def test_the_full_calibration(design, tmp_path):
    """As `python tests/validation/calibration/run.py`, but 200 simulations: a mode counted twice takes more."""
    wanted = {name: fewest for name, fewest in MUTANTS.items() if fewest <= 200}
    paragraphs, well = judge(run(design, 200, 50, 2, tmp_path / "ranks.jsonl", quiet=True), wanted)
    assert well, "\n".join(paragraphs)
