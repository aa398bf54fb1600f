"""The sampler against known posteriors, its random numbers, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import halfnorm
from statistics_checks import differences_from_normal

from bayesplate.errors import BayesplateError, InputError, NotConvergedError, NotIdentifiableError
from bayesplate.posterior import ensembles, sampling
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.sampling import SamplerSettings, is_hopeless, sample

MEAN = np.array([3.0, -1.0, 0.0, 10.0])
SD = np.array([1.0, 0.01, 30.0, 2.0])
CORRELATION = np.array([[1, 0.9, 0, 0.2], [0.9, 1, 0, 0], [0, 0, 1, -0.5], [0.2, 0, -0.5, 1]])
COVARIANCE = CORRELATION * np.outer(SD, SD)
PRECISION = np.linalg.inv(COVARIANCE)


def log_normal_density(theta):
    away = theta - MEAN
    return -0.5 * np.einsum("ij,jk,ik->i", away, PRECISION, away)


def standardised(theta):
    return (theta - MEAN) / SD


def straightened(theta):
    """Standard normal, where theta is of the curved density."""
    straight = theta.copy()
    straight[:, 1] -= 0.5 * (theta[:, 0] ** 2 - 1)
    return straight


def curved(theta):
    return -0.5 * np.sum(straightened(theta) ** 2, axis=1)


def half_normal(theta):
    return np.where((theta > 0).all(axis=1), -0.5 * np.sum(theta**2, axis=1), -np.inf)


def deviates(theta):
    """Standard normal, where theta is half-normal; below zero they are none."""
    return ndtri(halfnorm.cdf(theta))


KNOWN = {
    "correlated, of unlike units": (log_normal_density, MEAN, COVARIANCE, standardised),
    "curved": (curved, np.zeros(3), np.eye(3), straightened),
    "bounded": (half_normal, np.zeros(3), np.eye(3), deviates),
}
"""Log density, centre and covariance of the starts, and what of the draws is standard normal."""


@pytest.mark.parametrize("name", KNOWN)
def test_a_known_posterior_is_recovered_and_a_wider_one_is_told_apart(name):
    log_density, centre, covariance, normal = KNOWN[name]
    settings = SamplerSettings(seed=11, gate=Gate(ess_min=2500))
    chains, convergence = sample(log_density, centre, covariance, settings)
    assert convergence.passed, convergence.reasons
    assert convergence.ess_min >= 2500

    found, n_dim = normal(chains.pooled), centre.size
    assert differences_from_normal(found, convergence.ess, np.zeros(n_dim), np.ones(n_dim)) == []
    wider = differences_from_normal(1.15 * found, convergence.ess, np.zeros(n_dim), np.ones(n_dim))
    assert sum("standard deviation" in difference for difference in wider) == n_dim


def short(seed=1, max_steps=100, **changes):
    return SamplerSettings(seed=seed, chunk_steps=50, max_steps=max_steps, **changes)


def test_a_run_four_times_as_long_as_the_gate_wants_ends_though_it_does_not_pass():
    """Better proposals than any sampler makes are asked for; what can be reached passes at the first look."""
    wanted = {share: SamplerSettings(seed=3, max_steps=4000, gate=Gate(acceptance_min=share)) for share in (0.99, 0.15)}
    (never, refused), (soon, passed) = (sample(log_normal_density, MEAN, COVARIANCE, one) for one in wanted.values())
    assert not refused.passed
    assert passed.passed
    assert soon.draws.shape[1] < never.draws.shape[1] <= 2000


def test_a_run_that_lacks_effective_draws_alone_goes_on():
    """Few walkers, of which many draws are asked for: twelve times the autocorrelation times that the gate wants."""
    gate = Gate(tau_count_min=25.0, ess_min=4000.0)
    settings = SamplerSettings(seed=3, n_ensembles=2, n_walkers=8, gate=gate)
    _, convergence = sample(log_normal_density, MEAN, COVARIANCE, settings)
    assert convergence.passed, convergence.reasons
    assert convergence.n_taus > 4.0 * gate.tau_count_min


def test_a_run_goes_on_while_single_walkers_hardly_move():
    """More steps may free them, where a small acceptance of all stays small: here none moves as often as is wanted."""
    gate = Gate(tau_count_min=25.0, walker_acceptance_min=0.99)
    settings = SamplerSettings(seed=3, n_ensembles=2, n_walkers=8, max_steps=1500, gate=gate)
    chains, convergence = sample(log_normal_density, MEAN, COVARIANCE, settings)
    assert not convergence.passed
    assert convergence.n_taus > 4.0 * gate.tau_count_min
    assert convergence.ess_min > 4.0 * gate.ess_min
    assert chains.draws.shape[1] == 1500


@pytest.mark.parametrize(("n_taus", "is_over"), [(2.49, True), (2.51, False), (0.0, False)])
def test_sampling_ends_where_twice_the_steps_would_not_suffice(n_taus, is_over):
    """2000 of 20,000 steps with a twentieth of the 50 autocorrelation times: twice as many would hold those 50.

    Where a walker has not moved yet the length is 0, and nobody knows.
    """
    assert is_hopeless(n_taus, 2000, SamplerSettings(seed=1)) is is_over


def test_a_density_that_no_step_crosses_ends_the_sampling_early():
    """A washboard, on which one proposal in two hundred is accepted."""

    def washboard(theta):
        return np.sum(8.0 * np.cos(60.0 * theta) - 0.5 * theta**2, axis=1)

    settings = SamplerSettings(seed=2, n_ensembles=2, n_walkers=8, max_steps=5000)
    chains, convergence = sample(washboard, np.zeros(4), np.eye(4), settings)
    assert not convergence.passed
    assert convergence.tau_max > 2 * settings.max_steps / settings.gate.tau_count_min
    assert chains.draws.shape[1] < settings.max_steps


def test_too_few_steps_do_not_pass_and_say_how_many_are_needed():
    chains, convergence = sample(log_normal_density, MEAN, COVARIANCE, short())
    assert not convergence.passed
    assert f"{convergence.suggested_steps} steps after burn-in would do" in " ".join(convergence.reasons)
    assert convergence.suggested_steps > convergence.n_kept_steps
    assert chains.draws.shape == (4, 100, 32, 4)
    assert chains.after_burn_in.shape == (4, 50, 32, 4)


def test_separate_peaks_do_not_pass():
    def two_peaks(theta):
        apart = np.logaddexp(-0.5 * ((theta[:, 0] - 1) / 1e-4) ** 2, -0.5 * ((theta[:, 0] + 1) / 1e-4) ** 2)
        return apart - 0.5 * np.sum(theta[:, 1:] ** 2, axis=1)

    settings = SamplerSettings(seed=2, chunk_steps=500, max_steps=1500)
    _, convergence = sample(two_peaks, np.zeros(3), np.eye(3), settings, names=("D_x", "D_y", "D_s"))
    assert not convergence.passed
    assert "D_x" in " ".join(convergence.reasons)


def two_unequal_peaks(theta):
    """Around the estimate a tenth of the probability; the rest eight standard deviations off, half as wide."""
    far = (theta - 8.0 * np.eye(6)[0]) / 0.5
    logs = -0.5 * np.sum(theta**2, axis=1), -0.5 * np.sum(far**2, axis=1) - 6.0 * np.log(0.5)
    return np.logaddexp(np.log(0.1) + logs[0], np.log(0.9) + logs[1])


def test_a_peak_that_few_walkers_reach_at_first_gets_its_share():
    """Proposals fitted before the walkers have reached it miss it; a walk from their later draws does not."""
    settings = SamplerSettings(seed=3, n_ensembles=2)
    steps = []
    chains, convergence = sample(
        two_unequal_peaks, np.zeros(6), np.eye(6), settings, progress=lambda told: steps.append(told.n_steps)
    )
    assert convergence.passed, convergence.reasons
    assert np.all(np.diff(steps) >= 0)
    assert chains.draws.shape[1] < steps[-1]  # not the first walk
    share = np.mean(chains.pooled[:, 0] > 4.0)
    assert abs(share - 0.9) < 4.0 * np.sqrt(0.9 * 0.1 / convergence.ess[0])


def test_all_walks_together_make_the_most_steps_at_most(monkeypatch):
    monkeypatch.setattr(sampling, "_FIRST_WALKS", (100, 200))
    settings = short(max_steps=450, gate=Gate(ess_min=1e9))
    told = []
    chains, convergence = sample(log_normal_density, MEAN, COVARIANCE, settings, progress=told.append)
    assert not convergence.passed
    assert chains.draws.shape[1] == 450 - 100 - 200
    assert [one.n_steps for one in told] == [50, 150, 200, 250, 350, 400]  # none at the end of a walk
    assert {one.max_steps for one in told} == {450}


def test_a_part_of_the_posterior_that_few_starts_reach_is_left_again():
    """A second peak forty standard deviations off, with a millionth of the probability: no walker stays there."""

    def two(theta):
        far = theta - np.array([40.0, 0.0, 0.0])
        return np.logaddexp(-0.5 * np.sum(theta**2, axis=1), -14.0 - 0.5 * np.sum(far**2, axis=1))

    _, convergence = sample(two, np.zeros(3), np.diag([100.0, 1.0, 1.0]), SamplerSettings(seed=1))
    assert convergence.passed, convergence.reasons


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others():
    first, again, other = (sample(log_normal_density, MEAN, COVARIANCE, short(seed))[0] for seed in (1, 1, 2))
    assert first.draws.tobytes() == again.draws.tobytes()
    assert first.log_prob.tobytes() == again.log_prob.tobytes()
    assert not np.any(first.draws[:, 0] == other.draws[:, 0])


def test_two_ensembles_differ_even_from_one_start(monkeypatch):
    walked = ensembles.pilot

    def same_ends(*arguments):
        found = walked(*arguments)
        return replace(
            found, points=np.repeat(found.points[::4], 4, axis=0), log_prob=np.repeat(found.log_prob[::4], 4)
        )

    monkeypatch.setattr(ensembles, "pilot", same_ends)
    chains, _ = sample(log_normal_density, MEAN, COVARIANCE, short())
    for other in (1, 2, 3):
        assert not np.array_equal(chains.draws[0, -1], chains.draws[other, -1])


def test_the_global_random_state_is_neither_used_nor_changed():
    kept = np.random.get_state()  # noqa: NPY002 the point of the test
    try:
        draws = []
        for seed in (1, 2):
            np.random.seed(seed)  # noqa: NPY002
            before = np.random.get_state()  # noqa: NPY002
            draws.append(sample(log_normal_density, MEAN, COVARIANCE, short())[0].draws)
            after = np.random.get_state()  # noqa: NPY002
            assert np.array_equal(before[1], after[1])
            assert before[2:] == after[2:]
        assert np.array_equal(*draws)
    finally:
        np.random.set_state(kept)  # noqa: NPY002


def where_large(value):
    return lambda theta: np.where(theta[:, 0] > 3.5, value, log_normal_density(theta))


def in_the_end():
    """A log density that is none from its 200th call on."""
    calls = []

    def log_density(theta):
        calls.append(len(theta))
        return np.full(len(theta), np.nan) if len(calls) > 200 else log_normal_density(theta)

    return log_density


NAMES = ("D_x", "D_y", "D_s", "noise")
NO_DENSITIES = {
    "not a number": (where_large(np.nan), NAMES, BayesplateError, r"got nan at D_x = .*, D_y = .*report"),
    "infinite": (where_large(np.inf), NAMES, BayesplateError, r"got inf at D_x = .*, D_y = .*report"),
    "after the start": (in_the_end(), (), BayesplateError, "got nan at parameter 1"),
    "of another shape": (lambda theta: theta, (), BayesplateError, r"wanted shape \(128,\), got \(128, 4\)"),
    "zero everywhere": (
        lambda theta: np.full(len(theta), -np.inf),
        (),
        NotConvergedError,
        "got 0 in 1000 tries",
    ),
}


@pytest.mark.parametrize("case", NO_DENSITIES)
def test_what_is_no_log_density_is_refused_with_its_point(case, capsys):
    log_density, names, kind, message = NO_DENSITIES[case]

    with pytest.raises(kind, match=message) as caught:
        sample(log_density, MEAN, COVARIANCE, short(), names=names)
    assert caught.value.exit_code == (5 if kind is NotConvergedError else 70)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("covariance", [np.ones((4, 4)), np.diag([1, 1, 1, 0.0]), np.full((4, 4), np.nan)])
def test_a_singular_covariance_is_not_identifiable(covariance):
    with pytest.raises(NotIdentifiableError, match="positive definite"):
        sample(log_normal_density, MEAN, covariance, short())


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"n_walkers": 6}, "n_walkers: wanted an even number of at least 8, got 6"),
        ({"n_walkers": 33}, "n_walkers: wanted an even number"),
        ({"n_ensembles": 1}, "n_ensembles: wanted at least 2"),
        ({"seed": -1}, "seed: wanted a number that is not negative"),
        ({"chunk_steps": 0}, "chunk_steps"),
    ],
)
def test_unusable_settings_are_refused(changes, place):
    with pytest.raises(InputError, match=place):
        sample(log_normal_density, MEAN, COVARIANCE, SamplerSettings(**{"seed": 1} | changes))


def test_progress_counts_every_chunk():
    told = []
    settings = short(max_steps=250, gate=Gate(ess_min=1e6))
    sample(log_normal_density, MEAN, COVARIANCE, settings, progress=told.append)
    assert [progress.n_steps for progress in told] == [50, 100, 150, 200]
    assert told[0].n_taus is None
    assert told[-1].n_taus > 0.0
