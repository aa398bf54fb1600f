"""What one way of computing costs beside another, measured in one run: ratios hold on a slow machine too."""

from __future__ import annotations

import pytest
from validation.benchmarks import timing

pytestmark = pytest.mark.slow

BATCH = 4096
BOARD = "finnish-spruce-cantilever"


@pytest.fixture(scope="module")
def problem():
    return timing.posed(BOARD, "exact")


def test_the_linear_law_is_much_cheaper_than_the_exact_one(problem):
    """Six ratios of sums beside eigenvalues of two matrices of a dozen rows."""
    linear, exact = (timing.law(problem, name, BATCH) for name in ("linear", "exact"))

    assert exact > 20 * linear


def test_the_likelihood_keeps_most_of_the_linear_law_s_advantage(problem):
    """Noise and rounding cost the same under both laws, more than the linear law itself."""
    linear = timing.likelihood(problem.under("linear"), BATCH)
    exact = timing.likelihood(problem, BATCH)

    assert exact > 5 * linear


def test_the_exact_law_is_much_cheaper_than_a_solve_of_the_whole_plate(problem):
    assert timing.full_solve(problem) > 100 * timing.law(problem, "exact", BATCH) / BATCH


def test_many_draws_at_once_are_cheaper_than_few(problem):
    """The sampler asks for 16 at once: there a fixed cost a call dominates, which the size of a batch divides."""
    few, many = (timing.likelihood(problem.under("linear"), batch) / batch for batch in (16, BATCH))

    assert few > 3 * many


@pytest.mark.parametrize(("board", "law", "least"), [("fiemme-spruce-clamped", "linear", 10), (BOARD, None, 5)])
def test_effective_draws_come_many_times_faster_than_from_plain_emcee(board, law, least):
    """In the same process on the same density. Dozens are measured: noise of the machine does not decide."""
    posed = timing.posed(board, law)

    assert timing.our_sampling(posed, seed=1) > least * timing.plain_emcee(posed, seed=1)
