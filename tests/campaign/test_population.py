"""The distribution of boards' constants, against populations with a known truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from bayesplate.board.material import MODULI
from bayesplate.board.prior import PriorCard, load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.campaign.population import BoardConstants, Population, find_population, next_board_prior, require_moduli
from bayesplate.errors import InputError
from bayesplate.posterior.sampling import Chains, SamplerSettings

MEAN = np.log([11e9, 0.95e9, 0.67e9])
SD = np.array([0.12, 0.25, 0.15])
OWN = np.array([0.01, 0.02, 0.015])


def boards_of(rng, n, mean=MEAN, sd=SD, own=OWN):
    """Boards of a population, and what each of them truly is."""
    truths = mean + sd * rng.standard_normal((n, 3))
    return [
        (truth, BoardConstants(f"board {i}", truth + own * rng.standard_normal(3), np.diag(own**2)))
        for i, truth in enumerate(truths)
    ]


def found_of(boards, seed=1):
    return find_population([one for _, one in boards], load_prior("spruce"), SamplerSettings(seed=seed))


@pytest.fixture(scope="module")
def found():
    """The population of forty boards."""
    return found_of(boards_of(np.random.default_rng(1), 40))


def test_the_population_of_many_boards_is_found(found):
    assert found.convergence.passed
    assert np.abs((found.means.mean(axis=0) - MEAN) / (SD / np.sqrt(40))).max() < 4.0
    assert np.abs(np.log(found.sds.mean(axis=0) / SD)).max() < 4.0 / np.sqrt(80)


def test_what_all_boards_are_off_by_alike_does_not_average_out():
    """What is known of the means then has the variance of the common error besides: slopes times its width, squared.

    What scatters on each board for itself is less than a hundredth of it.
    """
    slopes, width, sd = np.array([[0.5], [-0.6], [0.4]]), 0.4, 0.1 * SD
    boards = [replace(one, slopes=slopes) for _, one in boards_of(np.random.default_rng(300), 12, sd=sd)]
    known = find_population(boards, load_prior("spruce"), SamplerSettings(seed=1), width**2 * np.eye(1))
    # The priors of the three means narrow the common error.
    log_sd = np.array([load_prior("spruce").constants[name].log_sd for name in MODULI])
    squared = slopes[:, 0] ** 2
    expected = squared / (1.0 / width**2 + np.sum(squared / log_sd**2))

    assert ((sd**2 + OWN**2) / 12).max() < 0.01 * expected.min()
    assert known.means.var(axis=0) == pytest.approx(expected, rel=0.1)


@pytest.mark.slow
def test_means_and_widths_are_covered_at_the_stated_rate():
    """90 % intervals over 12 small populations, whose truths are drawn from what is believed of them."""
    prior = load_prior("spruce")
    middle = np.log([prior.constants[name].median for name in MODULI])
    width = np.array([prior.constants[name].log_sd for name in MODULI])
    hits = []
    for seed in range(12):
        rng = np.random.default_rng(100 + seed)
        mean, sd = middle + width * rng.standard_normal(3), width * np.abs(rng.standard_normal(3))
        found = found_of(boards_of(rng, 6, mean, sd), seed=seed)
        for draws, truth in [(found.means, mean), (found.sds, sd)]:
            low, high = np.quantile(draws, [0.05, 0.95], axis=0)
            hits += list((low <= truth) & (truth <= high))

    low, high = binom.ppf([0.0005, 0.9995], len(hits), 0.9)
    assert low <= sum(hits) <= high


def test_a_board_given_the_population_is_the_closed_form():
    """Where mean and standard deviation of the population are known, so is what it makes of a board."""
    one = BoardConstants("one", MEAN + 0.1, np.array([[0.04, 0.01, 0.0], [0.01, 0.05, 0.0], [0.0, 0.0, 0.02]]))
    draws = np.tile(np.concatenate([MEAN, np.log(SD)]), (1, 20_000, 1, 1))
    known = Population((one,), Chains(draws, np.zeros(draws.shape[:3]), 0), None)
    precision = np.linalg.inv(one.covariance) + np.diag(SD**-2.0)
    covariance = np.linalg.inv(precision)
    mean = covariance @ (np.linalg.solve(one.covariance, one.mean) + MEAN / SD**2)
    pooled = known.pooled(0, np.random.default_rng(0))

    assert np.abs((pooled.mean(axis=0) - mean) / np.sqrt(np.diagonal(covariance) / 20_000)).max() < 4.0
    assert np.allclose(np.cov(pooled.T), covariance, atol=4.0 * covariance.max() / np.sqrt(20_000))


def test_the_prior_card_says_what_the_next_board_will_be(found):
    card = next_board_prior(found, "half-tops", "forty boards", np.random.default_rng(5))

    assert card.constants["E_x"].median == pytest.approx(np.exp(MEAN[0]), rel=4 * SD[0] / np.sqrt(40))
    assert np.log(card.constants["E_y"].factor) == pytest.approx(SD[1], rel=0.4)
    assert card.stated_constants["E_x"].source == "forty boards"
    truths = np.array([truth for truth, _ in boards_of(np.random.default_rng(6), 300)])
    inside = [
        np.mean(np.abs(truths[:, i] - np.log(card.constants[name].median)) < np.log(card.constants[name].factor))
        for i, name in enumerate(MODULI)
    ]
    assert np.abs(np.array(inside) - 0.683).max() < 0.15


def test_a_prior_of_rigidities_is_refused():
    rigid = {name: Quantity.from_median(10.0, 2.0) for name in ("D_x", "D_y", "D_s")}
    with pytest.raises(InputError, match="which go with the thickness"):
        require_moduli(PriorCard.from_quantities("rigid", rigid, source="made"), "half-tops.toml [population] prior")
