"""Constants of boards whose thickness was read at places and rounded: intervals hold the truth as often as stated."""

from __future__ import annotations

import numpy as np
import pytest
from read_fields import drawn_board, quick_errors, taken_for_exact
from scipy.stats import binom

import bayesplate.frequencies.system

NINETY = 1.6449
"""Standard deviations on either side that hold 90 % of a normal distribution."""
MISSED = 0.005
"""Probability with which a rate that is right falls below its bound, or above."""


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Eight elements a side: these modes to a few hundredths of a per cent, which is little beside the noise."""
    monkeypatch.setattr(bayesplate.frequencies.system, "mesh", lambda *_: (8, 8))


def held(seeds, kind=lambda board: board):
    """How many of the boards' 90 % intervals hold the truth: (3,) array, E_x, E_y, G_xy."""
    errors = [quick_errors(kind(drawn_board(np.random.default_rng(seed)))) for seed in seeds]
    return np.sum(np.abs(errors) < NINETY, axis=0)


@pytest.mark.parametrize("n", [12, pytest.param(60, marks=pytest.mark.slow)])
def test_intervals_hold_the_truth_at_the_stated_rate(n):
    counts = held(range(1000, 1000 + n))
    lowest, highest = binom.ppf([MISSED, 1.0 - MISSED], n, 0.9)
    assert np.all(counts >= lowest)
    assert np.all(counts <= highest)


@pytest.mark.parametrize("n", [8, pytest.param(30, marks=pytest.mark.slow)])
def test_readings_that_are_taken_for_exact_do_not(n):
    """Control: the course that they make probable, taken for the truth."""
    assert np.all(held(range(1000, 1000 + n), taken_for_exact) < binom.ppf(MISSED, n, 0.9))
