"""The comparison with other samplers: the same density, every skip told, a page only of what was measured; no times."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from validation.benchmarks.peers import environments, measures, page, run, statement, trials
from validation.benchmarks.peers.package import COMMANDS
from validation.benchmarks.peers.registry import PEERS

SAME = {"mean": 1.2, "sd": 0.8, "mean_share": 0.01, "sd_share": 0.02}


@pytest.fixture(scope="module")
def problem():
    return statement.posed()


@pytest.fixture(scope="module")
def content(problem):
    return json.loads(json.dumps(statement.stated(problem)))


def result(name, *, cold=2.0, sampling=0.5, ess=4500.0, **others):
    return trials.Result(
        name, "mark", cold=(cold,) * 3, processor=(cold,) * 3, sampling=(sampling,) * 3, ess=(ess,) * 3,
        difference=SAME, **others,
    )  # fmt: skip


def written(results):
    return page.page(results, PEERS, {"python": "3.11"}, "a-board", 4000, 3)


def every_result(**changed):
    """One of the package's two rows and of every peer, some of them changed."""
    found = [result(name) for name in COMMANDS]
    return found + [changed.get(peer.module) or result(peer.name, cold=3.0, sampling=1.0) for peer in PEERS]


def test_the_file_has_the_package_s_log_posterior_but_for_a_constant(problem, content):
    assert statement.deviation(problem, content) < statement.TOLERANCE


@pytest.mark.parametrize(
    "changed", ["thickness_m", "poisson_xy", "readings_hz", "resolution_hz", "squared_per_rigidity"]
)
def test_control_a_file_with_another_number_has_another_log_posterior(problem, content, changed):
    other = {**content, changed: (1.001 * np.array(content[changed])).tolist()}

    assert statement.deviation(problem, other) > 100 * statement.TOLERANCE


def test_a_board_that_the_file_cannot_say_is_refused(problem):
    with pytest.raises(ValueError, match="linear law"):
        statement.stated(problem.under("exact"))


def test_effective_draws_of_chains_and_of_weights():
    rng = np.random.default_rng(2)
    chains = rng.standard_normal((2000, 4, 2))
    slow = np.repeat(chains, 10, axis=0)

    assert measures.effective_draws(chains, None) == pytest.approx([8000, 8000], rel=0.1)
    assert measures.effective_draws(slow, None) == pytest.approx([8000, 8000], rel=0.25)
    assert measures.effective_draws(chains[:, 0], np.r_[np.ones(500), np.zeros(1500)]) == pytest.approx([500, 500])


def test_a_difference_is_in_monte_carlo_errors_and_another_posterior_is_found():
    truth = measures.Truth(np.zeros(2), np.ones(2))
    draws = np.random.default_rng(3).standard_normal((4000, 2))
    same, shifted, wide = (measures.difference(one, None, truth) for one in (draws, draws + 0.2, 1.2 * draws))

    assert max(same.mean, same.sd) < page.AGREES
    assert shifted.mean > page.AGREES
    assert shifted.mean_share == pytest.approx(0.2, abs=0.05)
    assert wide.sd > page.AGREES


def test_a_peer_that_cannot_be_installed_says_why(tmp_path, monkeypatch):
    """Without a network: pip itself is stood in for."""
    failed = subprocess.CompletedProcess([], 1, "", "WARNING: slow\nERROR: No matching distribution found for x==0\n")
    monkeypatch.setattr(environments.venv.EnvBuilder, "create", lambda self, place: None)
    monkeypatch.setattr(environments.subprocess, "run", lambda *arguments, **options: failed)

    with pytest.raises(environments.Unavailable, match="No matching distribution"):
        environments.python_of(PEERS[0], tmp_path)


def made_up(worth, asked):
    """Runs in place of processes: so many effective draws at a size, a second each; what was asked for is noted."""

    def run_peer(peer, python, problem, size, seed, *, again=False):
        asked.append((size, seed))
        draws = np.full((8, 2, 4), worth(size))
        return trials.Run(draws, None, {"start_up": 0.1, "sampling": 1.0, "again": 0.5}, 2.0, 2.0)

    return run_peer


@pytest.mark.parametrize("worth", [lambda size: 0.5 * size, lambda size: 50.0 * size], ids=["too few", "too many"])
def test_a_peer_is_measured_with_every_seed_at_a_size_that_trials_have_found(worth, monkeypatch):
    asked = []
    monkeypatch.setattr(trials, "run_peer", made_up(worth, asked))
    monkeypatch.setattr(measures, "effective_draws", lambda draws, weights: draws[0, 0])
    monkeypatch.setattr(trials, "pooled_difference", lambda runs, truth: SAME)
    peer = replace(PEERS[0], size=2000, largest=50_000, is_compiled=False)

    found = trials.measured(peer, None, None, None, 4000, [1, 2, 3], "mark")

    assert not found.missing
    assert 4000.0 <= min(found.ess) <= trials.TOO_MUCH * 4000.0
    assert [one for one in asked if one[1] < 100] == [(found.size, seed) for seed in (1, 2, 3)]
    assert found.cold_time == 2.0
    assert found.warm == ()


@pytest.mark.parametrize(("worth", "told"), [
    (lambda size: 10.0, "10 effective draws at a size of 3000, the largest tried"),
    (lambda size: np.nan, "walkers that never join the others at a size of 3000, the largest tried"),
])  # fmt: skip
def test_a_peer_that_does_not_get_there_says_how_far_it_came(worth, told, monkeypatch):
    monkeypatch.setattr(trials, "run_peer", made_up(worth, []))
    monkeypatch.setattr(measures, "effective_draws", lambda draws, weights: draws[0, 0])

    found = trials.measured(replace(PEERS[0], size=1000, largest=3000), None, None, None, 4000, [1], "mark")

    assert found.missing == told
    assert found.cold == ()


def test_the_page_tells_what_was_skipped_and_why():
    skipped = trials.Result(PEERS[3].name, "mark", missing="pip: no wheel for this machine")
    text = written(every_result(**{PEERS[3].module: skipped}))

    assert f"- {PEERS[3].name}: not measured; pip: no wheel for this machine." in text
    assert f"| {PEERS[3].name} |" not in text


def test_the_page_says_who_is_ahead_and_whose_posterior_is_another():
    nuts = next(peer for peer in PEERS if peer.module == "with_blackjax")
    smcpy = next(peer for peer in PEERS if peer.module == "with_smcpy")
    quick = result(nuts.name, cold=8.0, sampling=6.0, warm=(0.1,) * 3)
    off = replace(result(smcpy.name, cold=1.0), difference={**SAME, "sd": 12.0, "sd_share": 0.25})
    text = written(every_result(with_blackjax=quick, with_smcpy=off))

    assert f"Ahead of the package from a cold process: {smcpy.name}." in text
    assert f"that are compiled, once they are: {nuts.name}." in text
    assert "that compile nothing: none." in text
    assert (
        f"- {smcpy.name}: a mean differs by 0.01 posterior standard deviations, a standard deviation by 25 %." in text
    )
    assert "| 5.9 |" in text  # what compilation took
    assert f"| {nuts.name} | 8 | 4 | 45,000 | 5 |" in text


def test_one_row_each_and_every_way_of_running_is_described():
    text = written(every_result())

    assert sum(row.startswith("| ") for row in text.splitlines()) == 1 + len(COMMANDS) + len(PEERS)
    assert all(f"- {peer.name}: {peer.aside}." in text for peer in PEERS)
    assert len({peer.name for peer in PEERS}) == len(PEERS)


def test_there_is_no_page_of_half_a_comparison():
    marks = {peer.name: run.fingerprint_of("s", repr(peer)) for peer in PEERS} | dict.fromkeys(COMMANDS, "own")
    there = {name: trials.Result(name, mark, missing="why") for name, mark in marks.items()}

    assert len(run.whole(there, "s", "own")) == len(there)
    assert run.whole(there, "other settings", "own") is None
    assert run.whole({name: one for name, one in there.items() if name != PEERS[0].name}, "s", "own") is None


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_every_peer_has_a_module_and_fixed_versions(peer):
    assert (trials.TESTS / "validation" / "benchmarks" / "peers" / f"{peer.module}.py").exists()
    assert all(one.count("==") == 1 and "/" not in one for one in peer.requirements)
    assert peer.size <= peer.largest
