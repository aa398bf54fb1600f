"""When a warm-up is over, and when draws become a further one."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.posterior.checkpoint import Chunk
from bayesplate.posterior.sampling import SamplerSettings, sample
from bayesplate.posterior.warm_up import FEWEST, MOST, TAUGHT, WarmUp

SHAPE = (2, 25, 8)
"""Ensembles, steps, walkers."""
AGAIN = 16


def chunks(means, tau=1.0, seed=0):
    """Chunks of one parameter with an autocorrelation time and mean log densities."""
    rng = np.random.default_rng(seed)
    keep = (tau - 1.0) / (tau + 1.0)
    n_steps = SHAPE[1] * len(means)
    noise = rng.standard_normal((SHAPE[0], n_steps, SHAPE[2]))
    draws = np.empty_like(noise)
    draws[:, 0] = noise[:, 0]
    for step in range(1, n_steps):
        draws[:, step] = keep * draws[:, step - 1] + np.sqrt(1.0 - keep**2) * noise[:, step]
    parts = np.split(draws[..., None], len(means), axis=1)
    nothing = np.empty((*SHAPE, 0))
    return [Chunk(part, np.full(SHAPE, float(mean)), nothing) for part, mean in zip(parts, means, strict=True)]


def followed(made):
    """Step by step, as a run goes: where the warm-up ends after each chunk."""
    warm_up = WarmUp()
    return [(warm_up.follow(made[:n]), warm_up.first, warm_up.end) for n in range(1, len(made) + 1)], warm_up


def taught_after(ends):
    """Numbers of chunks after which something was learnt."""
    return [n for n, (taught, _, _) in enumerate(ends, start=1) if taught]


def test_it_lasts_until_the_density_no_longer_rises():
    ends, warm_up = followed(chunks([0.0] * 9))
    assert [first for _, first, _ in ends] == [None] * (FEWEST - 1) + [FEWEST] * 4
    assert [taught for taught, _, _ in ends] == [False] * (FEWEST - 1) + [True] + [False] * 3
    ends, warm_up = followed(chunks([2.0 * min(i, 9) for i in range(15)]))
    assert warm_up.first == 12  # the last two of three chunks are level
    made = chunks([3.0 * i for i in range(MOST + 4)])
    assert followed(made)[1].first == MOST
    assert followed(made)[1].lesson(made) == made[MOST - TAUGHT : MOST]


@pytest.mark.parametrize(("tau", "is_again"), [(4.0, False), (80.0, True)])
def test_draws_that_hang_together_become_a_further_warm_up(tau, is_again):
    made = chunks([0.0] * (FEWEST + AGAIN + 4), tau)
    ends, warm_up = followed(made)
    assert warm_up.first == FEWEST
    assert warm_up.end == (FEWEST + AGAIN if is_again else FEWEST)
    assert ends[FEWEST + AGAIN - 1][0] == is_again
    if is_again:
        assert warm_up.lesson(made) == made[FEWEST : FEWEST + AGAIN]


def test_they_are_judged_at_doubled_intervals():
    made = chunks([0.0] * (FEWEST + 7 * AGAIN + 1), 200.0)
    ends, _ = followed(made)
    assert taught_after(ends) == [FEWEST, FEWEST + AGAIN, FEWEST + 3 * AGAIN, FEWEST + 7 * AGAIN]


def test_draws_that_are_long_enough_for_their_time_are_kept():
    """Twice as many draws may depend on each other over twice as many steps."""
    ends, _ = followed(chunks([0.0] * (FEWEST + 3 * AGAIN + 1), 28.0))
    assert taught_after(ends) == [FEWEST, FEWEST + AGAIN]
    ends, _ = followed(chunks([0.0] * (FEWEST + 3 * AGAIN + 1), 60.0))
    assert taught_after(ends) == [FEWEST, FEWEST + AGAIN, FEWEST + 3 * AGAIN]


def test_a_run_that_is_resumed_has_the_same():
    made = chunks([0.0] * (FEWEST + 2 * AGAIN), 80.0)
    _, one = followed(made)
    other = WarmUp()
    other.follow(made)
    assert (other.first, other.end) == (one.first, one.end)
    assert other.lesson(made) == one.lesson(made)


def test_a_narrow_peak_within_a_wide_one_is_sampled():
    """One that holds a third of the probability in a thousandth of the volume: learnt anew, its share comes out."""
    narrow, share = 0.1, 1.0 / 3.0

    def log_posterior(x):
        wide = -0.5 * np.sum(x**2, axis=1) - 1.5 * np.log(2.0 * np.pi) + np.log(1.0 - share)
        peak = -0.5 * np.sum(((x - 0.5) / narrow) ** 2, axis=1) - 1.5 * np.log(2.0 * np.pi * narrow**2) + np.log(share)
        return np.logaddexp(wide, peak)

    chains, convergence = sample(log_posterior, np.zeros(3), np.eye(3), SamplerSettings(seed=3, max_steps=6000))
    inside = np.sum((chains.pooled - 0.5) ** 2, axis=1) < (4.0 * narrow) ** 2
    wide = np.random.default_rng(0).standard_normal((200_000, 3))
    expected = share + (1.0 - share) * np.mean(np.sum((wide - 0.5) ** 2, axis=1) < (4.0 * narrow) ** 2)
    error = np.sqrt(expected * (1.0 - expected) * convergence.tau_max / inside.size)
    assert convergence.passed
    assert abs(inside.mean() - expected) < 4.0 * error
