"""Numbers that scatter between boards, against closed forms: linear boards whose own numbers are normal."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from linear_boards import LinearBoard, exactly_together, pull_of, standard_shared
from scipy.integrate import quad
from scipy.stats import norm

from bayesplate.board.quantity import Quantity
from bayesplate.campaign import scatter
from bayesplate.campaign.claim import board_p_value
from bayesplate.campaign.combined import shared_values
from bayesplate.campaign.normal_likelihood import NormalLikelihood
from bayesplate.campaign.scatter import ScatteredLikelihood
from bayesplate.campaign.shared import SharedParameter

SCALE = 0.5
LOG_SD = 0.4


def numbers(n, scale=SCALE):
    """Shared numbers of log-normal prior; the first of them scatters, and the last."""
    prior = Quantity.from_median(1.0, np.exp(LOG_SD))
    return tuple(
        SharedParameter("effect", f"z{i}", prior, "1", scatter=scale if i in (0, n - 1) else 0.0) for i in range(n)
    )


def scattered_boards(rng, n_boards, n_shared, width, z_true=0.3, sd=0.5):
    """Linear boards whose own numbers scatter about the truth, and those numbers."""
    boards, own = [], []
    for _ in range(n_boards):
        design = rng.normal(size=(9, 3)), rng.normal(size=(9, n_shared))
        own.append(z_true + width * rng.normal(size=n_shared))
        readings = design[0] @ rng.normal(size=3) + design[1] @ own[-1] + sd * rng.normal(size=9)
        boards.append(LinearBoard(*design, sd, readings))
    return boards, np.array(own)


def closed_form(board, middles, width):
    """ln of the probability of a board's readings where its numbers are normal about middles: (n,) array."""
    covariance = board.covariance + board.shared @ np.diag(np.square(width)) @ board.shared.T
    left = board.readings - np.atleast_2d(middles) @ board.shared.T
    _, log_det = np.linalg.slogdet(2.0 * np.pi * covariance)
    return -0.5 * (np.einsum("ni,ij,nj->n", left, np.linalg.inv(covariance), left) + log_det)


@pytest.mark.parametrize("moving", [(0, 2), (0, 1, 2)])
def test_a_normal_board_is_integrated_exactly(moving, monkeypatch):
    """Whichever of its numbers scatter; many rows are taken in parts."""
    rng = np.random.default_rng(3)
    (board,), _ = scattered_boards(rng, 1, 3, 0.5)
    shared = tuple(replace(one, scatter=SCALE if i in moving else 0.0) for i, one in enumerate(numbers(3)))
    hyper = np.column_stack([rng.normal(size=(20, 3)), np.abs(rng.normal(size=(20, len(moving))))])
    hyper[0, 3:] = 0.0  # no scatter at all
    whole = ScatteredLikelihood(shared, board, pull_of(board)).at(hyper)
    monkeypatch.setattr(scatter, "_ROWS_AT_ONCE", 7)
    in_parts = ScatteredLikelihood(shared, board, pull_of(board)).at(hyper)

    width = np.zeros((20, 3))
    width[:, moving] = hyper[:, 3:] * SCALE / LOG_SD
    exact = [closed_form(board, row[:3], one)[0] for row, one in zip(hyper, width, strict=True)]
    wider = [closed_form(board, row[:3], 1.05 * one)[0] for row, one in zip(hyper, width, strict=True)]
    assert whole == pytest.approx(np.array(exact), abs=1e-9)
    assert in_parts == pytest.approx(whole, abs=1e-12)
    assert np.abs(whole - np.array(wider))[1:].min() > 1e-6  # control


@dataclass(frozen=True)
class Skewed:
    """A board whose likelihood is not normal."""

    def at(self, z):
        """A Gumbel's logarithm."""
        x = 1.7 * (z[:, 0] - 0.5)
        return -x - np.exp(-x)


def test_a_board_that_is_not_normal_is_integrated_as_by_a_fine_rule():
    z = np.linspace(-3.0, 6.0, 4001)[:, None]
    weights = np.exp(Skewed().at(z))
    weights /= weights.sum()
    mean = weights @ z[:, 0]
    precision = 1.0 / (weights @ (z[:, 0] - mean) ** 2)
    pull = NormalLikelihood(np.array([[precision]]), np.array([precision * mean]))
    scattered = ScatteredLikelihood(numbers(1), Skewed(), pull)
    for middle, u in [(0.0, 0.3), (1.0, 1.0), (-0.5, 2.0)]:
        width = u * SCALE / LOG_SD

        def density(e, middle=middle, width=width):
            return norm.pdf(e) * np.exp(Skewed().at(np.array([[middle + width * e]]))[0])

        exact, _ = quad(density, -9, 9)
        assert scattered.at(np.array([[middle, u]]))[0] == pytest.approx(np.log(exact), abs=0.01)


def by_grid(boards):
    """Mean and sd of one number's middle and of its scatter (ln), and ln of the evidence, by a fine grid."""
    middles, scales = np.linspace(-4.0, 4.0, 321), np.linspace(1e-4, 4.0, 240)
    widths = scales * SCALE / LOG_SD
    log_density = np.sum([[closed_form(one, middles[:, None], [t]) for t in widths] for one in boards], axis=0).T
    log_density += norm.logpdf(middles)[:, None] + (norm.logpdf(scales) + np.log(2.0))[None, :]
    top = log_density.max()
    weights = np.exp(log_density - top)
    total = weights.sum()
    evidence = top + np.log(total * (middles[1] - middles[0]) * (scales[1] - scales[0]))
    of_middle, of_scale = weights.sum(axis=1) / total, weights.sum(axis=0) / total
    found = []
    for x, share in ((middles, of_middle), (scales, of_scale)):
        mean = share @ x
        found += [mean, np.sqrt(share @ (x - mean) ** 2)]
    return np.array(found), evidence, float(of_scale @ scales**2) * (SCALE / LOG_SD) ** 2


def test_middle_and_scatter_are_those_of_a_fine_grid():
    """Tolerances: four errors of a mean of as many points as the sums rest on."""
    boards, _ = scattered_boards(np.random.default_rng(8), 5, 1, 0.6)
    together = exactly_together(boards, numbers(1))
    for without in [(), (2,)]:
        kept = [one for i, one in enumerate(boards) if i not in without]
        grid, evidence, square = by_grid(kept)
        mean, covariance = together.moments(without)
        found = np.array([mean[0], np.sqrt(covariance[0, 0]), mean[1], np.sqrt(covariance[1, 1])])
        error = 4.0 * np.repeat(grid[1::2], 2) / np.sqrt(together.fewest_points)
        assert (np.abs(found - grid) < error).all()
        assert together.log_evidence(without) == pytest.approx(evidence, abs=4.0 / np.sqrt(together.fewest_points))
        taught_mean, taught = together.moments_from_others(without)
        assert abs(taught_mean[0] - grid[0]) < 2.0 * error[0] * np.sqrt(1.0 + square / grid[1] ** 2)
        assert taught[0, 0] == pytest.approx(grid[1] ** 2 + square, rel=4.0 * np.sqrt(2.0 / together.fewest_points))
    assert not np.allclose(by_grid(boards[:3])[0], by_grid(boards)[0], atol=error.max())  # the grid tells boards apart


def test_what_is_taught_has_a_density_with_its_moments():
    """Within a tenth of an sd, two errors of a mean of 500 points: the fewest that it may rest on."""
    boards, _ = scattered_boards(np.random.default_rng(9), 6, 2, 0.6)
    one, other = numbers(2)
    together = exactly_together(boards, (one, replace(other, scatter=0.0)))
    z = np.random.default_rng(0).uniform(-6.0, 6.0, (40_000, 2))
    weights = np.exp(together.log_density_from_others((1,))(z))
    weights /= weights.sum()
    mean, covariance = together.moments_from_others((1,))
    found = weights @ z
    spread = (weights[:, None] * (z - found)).T @ (z - found)
    sd = np.sqrt(np.diagonal(covariance))

    assert (np.abs(found - mean) < 0.1 * sd).all()
    assert np.sqrt(np.diagonal(spread)) == pytest.approx(sd, rel=0.1)
    assert together.moments((1,))[1][0, 0] < 0.8 * covariance[0, 0]  # wider than the middle is known


def test_what_is_taught_keeps_the_bounds_of_a_number_that_does_not_scatter():
    """Close to a bound as everywhere: shares of the draws, within two errors of those of 500 points."""
    scattering, other = numbers(2)
    bounded = replace(other, scatter=0.0, prior=Quantity.from_mean(0.0, 1.0, "normal", lower=0.0))
    boards, _ = scattered_boards(np.random.default_rng(2), 4, 2, 0.5, z_true=0.05, sd=2.0)
    together = exactly_together(boards, (scattering, bounded))
    log_taught, rng = together.log_density_from_others(), np.random.default_rng(1)
    z = np.column_stack([rng.uniform(-6.0, 6.0, 40_000), rng.uniform(-1.0, 4.0, 40_000)])
    log_density = log_taught(z)
    inside = np.flatnonzero(z[:, 1] >= 0.0)
    density = np.exp(log_density[inside])
    draws = together.draws_from_others(rng, 20_000)[:, 1]

    assert (log_density[z[:, 1] < 0.0] == -np.inf).all()
    assert (log_taught(np.array([[50.0, 1.0], [1.0, 50.0]])) == -np.inf).all()  # no draw is as far out
    for end in (0.2, 0.5, 1.0):
        share = density[z[inside, 1] < end].sum() / density.sum()
        assert share == pytest.approx((draws < end).mean(), rel=0.15)


@pytest.mark.slow
@pytest.mark.usefixtures("_few_points")
def test_p_values_are_uniform_where_boards_scatter_and_not_where_that_is_left_out():
    """Scatter drawn from its prior: the p-value of a board against the others."""
    shared, same = numbers(1), numbers(1, scale=0.0)
    values, without = [], []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        width = abs(rng.normal()) * SCALE / LOG_SD
        boards, _ = scattered_boards(rng, 5, 1, width, z_true=rng.normal(), sd=0.1)
        for found, numbers_of in ((values, shared), (without, same)):
            whole = exactly_together(boards, numbers_of)
            found.append([board_p_value(whole, i) for i in range(5)])
    n = 60  # boards of one campaign are compared with each other
    error = 4.0 * np.sqrt(0.1 * 0.9 / n)

    assert abs((np.array(values) < 0.1).mean() - 0.1) < error
    assert (np.array(without) < 0.1).mean() > 0.1 + 2.0 * error


def test_values_have_names_and_the_scatter_its_own():
    (number,) = numbers(1)
    boards, _ = scattered_boards(np.random.default_rng(3), 3, 1, 0.5)
    coordinates = exactly_together(boards, (number,)).coordinates
    values = shared_values(coordinates, np.array([[0.0, 1.0]]))

    assert values == {"effect.z0": pytest.approx([1.0]), "effect.z0 scatter": pytest.approx([SCALE])}
    assert exactly_together(boards, (replace(number, scatter=0.0),)).coordinates == (replace(number, scatter=0.0),)
    assert len(exactly_together(boards, standard_shared(1)).coordinates) == 1
