"""Probabilities of readings against independent references: densities, rounding intervals, far tails, simulation."""

from __future__ import annotations

import numpy as np
import pytest
import ritz
from made_boards import setup_of
from scipy import integrate, stats

from bayesplate.posterior.likelihood import DEGREES_OF_FREEDOM, Readings
from bayesplate.quantities import Quantity

EPS = np.finfo(float).eps
LAWS = {False: stats.norm, True: stats.t(DEGREES_OF_FREEDOM)}


def readings_of(*frequencies, resolution=0.0, robust=False):
    setup = setup_of(ritz.ALL_FREE, {(1, i): f for i, f in enumerate(frequencies, start=1)}, resolution=resolution)
    return Readings.of(setup, robust)


def interval(low, high, robust):
    """The production probability of ln f between two numbers of standard deviations from the prediction."""
    noise = 1e-3
    ends = np.array([[low], [high]]) * noise
    readings = Readings(np.mean(ends, axis=0), ends[0], ends[1], np.zeros(1), robust)
    return readings.log_likelihood(np.zeros((1, 1)), np.log([noise]))[0, 0]


def log_probability(low, high, robust):
    """Logarithm of the integral of the density, taken relative to the density at the end nearer to the middle."""
    nearest = float(np.clip(0.0, low, high))

    def relative(z):
        difference = (z - nearest) * (z + nearest)
        return (1.0 + difference / (4.0 + nearest**2)) ** -2.5 if robust else np.exp(-0.5 * difference)

    # beyond e^-60 of the density at the near end a normal interval has nothing left
    reach = np.inf if robust else 60.0 / max(abs(nearest), 1.0)
    low, high = max(low, nearest - reach), min(high, nearest + reach)
    value, _ = integrate.quad(relative, low, high, epsabs=0, epsrel=1e-12, limit=400)
    return LAWS[robust].logpdf(nearest) + np.log(value)


INTERVALS = [
    (-1.0, 1.0),
    (-0.3, 2.0),
    (0.5, 0.6),
    (2.0, 3.0),
    (-9.0, -8.0),
    (8.0, 9.0),
    (38.0, 39.0),  # Phi is zero to double precision from here on
    (-60.0, -41.0),
    (300.0, 301.0),
    (-1e4, -0.999e4),
    (-3.0, 50.0),
]


@pytest.mark.parametrize("robust", [False, True], ids=["normal", "student"])
@pytest.mark.parametrize(("low", "high"), INTERVALS)
def test_an_interval_has_the_integral_of_its_density(low, high, robust):
    # the quadrature is good to 1e-12 of the probability; far out ln p is about -z^2 / 2, to the rounding of z
    assert interval(low, high, robust) == pytest.approx(log_probability(low, high, robust), rel=1e-12, abs=1e-11)


@pytest.mark.parametrize("robust", [False, True], ids=["normal", "student"])
def test_an_interval_agrees_with_scipy_where_scipy_does_not_underflow(robust):
    law = LAWS[robust]
    for low in np.linspace(-6, 6, 25):
        p = law.cdf(low + 0.5) - law.cdf(low) if low < 0 else law.sf(low) - law.sf(low + 0.5)
        assert np.exp(interval(low, low + 0.5, robust)) == pytest.approx(p, rel=1e-11)


def test_far_in_the_tail_the_interval_is_still_finite_and_falls_with_distance():
    far = [interval(z, z + 1.0, robust=False) for z in (10.0, 40.0, 1e3, 1e5)]
    assert np.isfinite(far).all()
    assert np.all(np.diff(far) < 0)
    assert stats.norm.sf(40.0) == 0.0  # the plain difference would be -inf: this is the control


@pytest.mark.parametrize("robust", [False, True], ids=["normal", "student"])
@pytest.mark.parametrize("width", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("z", [0.0, 1.3, -2.7, 12.0])
def test_a_narrow_interval_is_density_times_width(z, width, robust):
    expected = LAWS[robust].logpdf(z) + np.log(width)
    # the next term of the series is width^2 / 24 p''/p, and |p''/p| <= z^2 + 5/4 in both laws; the difference of two
    # logarithms of that size, relative to the width, loses some eps / width
    tolerance = width**2 / 24 * (z**2 + 1.25) + 10 * EPS * max(1.0, abs(expected)) / width
    assert interval(z - width / 2, z + width / 2, robust) == pytest.approx(expected, rel=0, abs=tolerance)
    assert interval(z - width, z + width, robust) - expected == pytest.approx(np.log(2), abs=1e-2)


@pytest.mark.parametrize("robust", [False, True], ids=["normal", "student"])
def test_the_probabilities_of_all_whole_hertz_sum_to_one(robust):
    hertz = np.arange(1.0, 400.0)
    readings = readings_of(*hertz[:1], resolution=1.0, robust=robust)
    assert readings.log_low[0] == pytest.approx(np.log(0.5))
    total = 0.0
    for f in hertz:
        one = readings_of(f, resolution=1.0, robust=robust)
        total += float(np.exp(one.log_likelihood(np.log([[52.3]]), np.log([0.01]))[0, 0]))
    outside = LAWS[robust].sf(np.log(399.5 / 52.3) / 0.01) + LAWS[robust].cdf(np.log(0.5 / 52.3) / 0.01)
    assert total == pytest.approx(1.0 - outside, abs=1e-10)


@pytest.mark.parametrize("robust", [False, True], ids=["normal", "student"])
def test_the_density_of_an_unrounded_reading_integrates_to_one(robust):
    noise, own = 0.004, 0.003

    def density(log_f):
        one = Readings(np.array([log_f]), np.array([log_f]), np.array([log_f]), np.array([own]), robust)
        return float(np.exp(one.log_likelihood(np.zeros((1, 1)), np.log([noise]))[0, 0]))

    halves = [integrate.quad(density, *ends, epsabs=1e-10, limit=300)[0] for ends in ((-np.inf, 0.0), (0.0, np.inf))]
    assert sum(halves) == pytest.approx(1.0, abs=1e-7)


def test_the_reading_s_own_uncertainty_is_joined_with_the_noise():
    noise, own, away = 0.003, 0.004, 0.01
    readings = readings_of(Quantity.from_mean(100.0, 100.0 * own), 100.0)
    found = readings.log_likelihood(np.full((1, 2), np.log(100.0) - away), np.log([noise]))[0]
    assert found[0] == pytest.approx(stats.norm.logpdf(away, scale=0.005), rel=1e-12)
    assert found[1] == pytest.approx(stats.norm.logpdf(away, scale=0.003), rel=1e-12)


def test_a_reading_with_an_uncertainty_of_its_own_is_not_rounded_on_top():
    readings = readings_of(Quantity.from_mean(100.0, 0.4), 100.0, resolution=1.0)
    assert readings.log_high[0] == readings.log_low[0] == readings.log_frequency[0]
    assert np.exp([readings.log_low[1], readings.log_high[1]]) == pytest.approx([99.5, 100.5])


@pytest.mark.parametrize("robust", [False, True], ids=["normal", "student"])
@pytest.mark.parametrize("resolution", [0.0, 1.0])
def test_no_prediction_has_no_probability(resolution, robust):
    readings = readings_of(100.0, 150.0, resolution=resolution, robust=robust)
    predicted = np.log([[100.0, np.nan], [100.0, 150.0]])
    found = readings.log_likelihood(predicted, np.log([0.01, 0.01]))
    assert found[0, 1] == -np.inf
    assert np.isfinite(found[[0, 1, 1], [0, 0, 1]]).all()


@pytest.mark.parametrize("robust", [False, True], ids=["normal", "student"])
def test_simulated_readings_follow_the_density(robust):
    n, noise, own = 20_000, 0.003, 0.004
    readings = readings_of(Quantity.from_mean(100.0, 100.0 * own), robust=robust)
    rng = np.random.default_rng(20)
    draws = readings.simulate(np.full((n, 1), np.log(90.0)), np.full(n, np.log(noise)), rng)[:, 0]
    standard = (draws - np.log(90.0)) / 0.005
    # false alarm once in 1000 seeds; the other law, and the noise alone as scale, must be told apart
    assert stats.kstest(standard, LAWS[robust].cdf).pvalue > 1e-3
    assert stats.kstest(standard, LAWS[not robust].cdf).pvalue < 1e-6
    assert stats.kstest(standard * 5 / 3, LAWS[robust].cdf).pvalue < 1e-6


def test_each_draw_has_its_own_noise():
    readings = readings_of(100.0)
    noises = np.array([0.002, 0.02])
    found = readings.log_likelihood(np.full((2, 1), np.log(101.0)), np.log(noises))[:, 0]
    assert found == pytest.approx(stats.norm.logpdf(np.log(100.0 / 101.0), scale=noises), rel=1e-12)
