"""A quantity has the moments it was given, and its standard coordinate is a proper standard normal."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from bayesplate.board.quantity import Quantity
from bayesplate.errors import InputError

LOG_NORMAL = Quantity.from_mean(3.0, 0.6)
NORMAL = Quantity.from_mean(0.4, 0.08, "normal")
LOG_UNIFORM = Quantity.from_range(1e8, 1e10)
MEDIAN = Quantity.from_median(0.5, 2.0)


def integral(integrand, low, high, points=None):
    return float(quad(integrand, low, high, epsabs=1e-13, epsrel=1e-12, limit=200, points=points)[0])


@pytest.mark.parametrize("quantity", [LOG_NORMAL, NORMAL, MEDIAN], ids=["log-normal", "normal", "median"])
def test_moments_by_quadrature(quantity):
    def moment(power):
        return integral(lambda z: float(quantity.value(z)) ** power * math.exp(float(quantity.log_prior(z))), -12, 12)

    assert moment(0) == pytest.approx(1, rel=1e-9)
    assert moment(1) == pytest.approx(quantity.mean, rel=1e-9)
    assert math.sqrt(moment(2) - moment(1) ** 2) == pytest.approx(quantity.sd, rel=1e-7)


@pytest.mark.parametrize("density", [Quantity.from_median(11e9, 1.35), LOG_UNIFORM], ids=["log-normal", "log-uniform"])
def test_densities_of_the_logarithm_are_normalised_and_sampled(density):
    middle = math.log(density.median)
    low, high = middle - 9 * density.log_sd, middle + 9 * density.log_sd
    edges = [math.log(1e8), math.log(1e10)] if density.kind == "log-uniform" else None

    def moment(power, centre):
        return integral(lambda x: (x - centre) ** power * math.exp(density.log_density_of_log(x)), low, high, edges)

    assert moment(0, 0.0) == pytest.approx(1, rel=1e-7)
    assert moment(1, middle) == pytest.approx(0, abs=1e-7)
    assert math.sqrt(moment(2, middle)) == pytest.approx(density.log_sd, rel=1e-6)
    n = 40_000
    draws = np.log(density.sample(np.random.default_rng(1), n))
    assert abs(draws.mean() - middle) < 4 * density.log_sd / math.sqrt(n)
    assert abs(draws.std() / density.log_sd - 1) < 4 / math.sqrt(2 * n)


def test_standard_is_the_inverse_of_value():
    for quantity in [LOG_NORMAL, NORMAL]:
        z = np.linspace(-6, 6, 25).reshape(5, 5)

        np.testing.assert_allclose(quantity.standard(quantity.value(z)), z, atol=1e-12)
        assert float(quantity.value(0.0)) == pytest.approx(quantity.median, rel=1e-15)


def test_nothing_lies_beyond_what_a_quantity_can_be():
    assert np.isneginf(LOG_NORMAL.standard([0.0, -1.0])).all()
    assert float(LOG_NORMAL.value(-40.0)) > 0
    assert np.isneginf(LOG_UNIFORM.log_density([0.99e8, 1.01e10])).all()


def test_exact_has_one_value():
    seven = Quantity.exact(7)

    assert seven.is_exact
    assert seven.value(np.array([-1.0, 0.0, 30.0])).tolist() == [7, 7, 7]
    assert (seven.standard(7.0), seven.log_sd, seven.median) == (0, 0, 7)


def test_readings_at_different_places_are_rounded_each_on_its_own():
    readings = [3.0, 3.1, 2.9, 3.2]
    apart = Quantity.from_readings(readings, resolution=0.1, at_x=[0, 1, 2, 3], place_sd=5)
    together = Quantity.from_readings(readings, resolution=0.1, at_x=[1, 1, 1, 1], at_y=[2, 2, 2, 2])

    assert apart.sd**2 == pytest.approx(np.var(readings, ddof=1) / 4 + 0.01 / 12 / 4)
    assert together.sd**2 == pytest.approx(np.var(readings, ddof=1) / 4 + 0.01 / 12)
    assert together.mean == pytest.approx(3.05)
    assert apart.has_profile
    assert not Quantity.from_readings(readings, resolution=0.1).has_profile


def test_rounding_is_not_averaged_away_and_equal_readings_without_it_are_exact():
    many = Quantity.from_readings([256.0] * 1000, resolution=2)

    assert many.sd == pytest.approx(2 / math.sqrt(12), rel=1e-12)
    assert Quantity.from_readings([256.0], resolution=2).sd == many.sd
    assert Quantity.from_readings([0.1, 0.1, 0.1]).is_exact


def test_median_and_factor():
    noise = Quantity.from_median(0.3, 1.65)

    assert noise.median == pytest.approx(0.3, rel=1e-14)
    assert noise.log_sd == pytest.approx(math.log(1.65), rel=1e-13)
    assert float(noise.value(1.0)) == pytest.approx(0.3 * 1.65, rel=1e-13)


def test_a_range_has_the_moments_of_a_uniform_logarithm():
    """However narrow it is: its standard deviation is that of a uniform density then."""
    for width in [1e-9, 1e-4, 1.9e-3, 2.1e-3, 3.0]:
        one = Quantity.from_range(2.0, 2.0 * (1.0 + width))
        logs = np.log1p(width) * (np.arange(100_000) + 0.5) / 100_000
        assert one.mean == pytest.approx(2.0 + 2.0 * np.expm1(logs).mean(), rel=1e-9)
        assert one.sd == pytest.approx(2.0 * np.expm1(logs).std(), rel=1e-6)


TRUNCATED = [
    ("normal", 0.35, 0.5),
    ("normal", 1.5, math.inf),
    ("normal", -math.inf, -1.0),
    ("log-normal", 0.35, 0.5),
    ("log-normal", 1.5, math.inf),
    ("log-normal", 0.05, 0.1),  # far in the lower tail
]


def test_a_truncated_density_is_normalised():
    for kind, lower, upper in TRUNCATED:
        quantity = Quantity.from_mean(0.4, 0.08, kind, lower, upper)
        low, high = float(quantity.standard(lower)), float(quantity.standard(upper))
        start, stop = max(low, min(high, 0.0) - 12), min(high, max(low, 0.0) + 12)
        total = integral(lambda z, one=quantity: math.exp(one.log_prior(z)), start, stop)

        assert total == pytest.approx(1, rel=1e-8), (kind, lower)
        outside = [z for z in (low - 0.01, high + 0.01) if math.isfinite(z)]
        assert outside
        assert np.all(np.isneginf(quantity.log_prior(outside)))


def test_truncation_far_out_in_a_tail():
    for sign in [-1.0, 1.0]:
        bounds = sorted((sign * 40.0, sign * math.inf))
        tail = Quantity(0.0, 1.0, "normal", *bounds)

        # beyond t the normal density is exponential with rate t + 1/t, to second order in 1/t
        assert float(np.exp(tail.log_prior(sign * 40.0))) == pytest.approx(40 + 1 / 40, rel=1e-5)


def test_quantiles_far_out_in_a_tail_are_alike_on_both_sides():
    for bound in [2.0, 9.0, 30.0]:
        probability = np.array([0.0, 0.05, 0.5, 0.95, 1.0])
        above = Quantity.from_mean(0.0, 1.0, "normal", lower=bound, upper=bound + 5.0)
        below = Quantity.from_mean(0.0, 1.0, "normal", lower=-bound - 5.0, upper=-bound)
        found = above.quantile(probability)

        assert found == pytest.approx(-below.quantile(probability[::-1]), rel=1e-12)
        assert found[[0, -1]] == pytest.approx([bound, bound + 5.0], rel=1e-6)
        assert np.all(np.diff(found) > 0)
    for outside in (-0.1, 1.1, np.nan):
        with pytest.raises(InputError, match="probability: wanted numbers from 0 to 1"):
            above.quantile([0.5, outside])


def test_another_unit_changes_all_but_the_places_and_keeps_the_density():
    millimetres = Quantity.from_readings([2.9, 3.1], 0.1, at_x=[0, 100], at_y=[5, 5], place_sd=5)
    metres = millimetres.scaled(1e-3)
    bounded = Quantity.from_mean(3.0, 0.5, lower=2.5, upper=4.0)
    z = np.linspace(-3, 3, 13)

    assert (metres.mean, metres.sd) == pytest.approx((3e-3, millimetres.sd * 1e-3))
    assert metres.readings == pytest.approx((2.9e-3, 3.1e-3))
    assert metres.resolution == pytest.approx(1e-4)
    assert metres.log_sd == pytest.approx(millimetres.log_sd)
    assert (metres.at_x, metres.at_y, metres.place_sd) == ((0, 100), (5, 5), 5)
    assert metres.scaled(1.0, 1e-3).at_x == pytest.approx((0, 0.1))
    assert metres.scaled(1.0, 1e-3).place_sd == pytest.approx(0.005)
    np.testing.assert_allclose(bounded.scaled(1e-3).log_prior(z), bounded.log_prior(z), rtol=1e-12)


MASKED = np.ma.masked_greater([1.0, 2.0], 1.5)
NO_QUANTITIES = [
    (lambda: Quantity(math.nan), "mean: wanted a finite number, got nan"),
    (lambda: Quantity(-1.0, 1.0), "mean: wanted a positive number for a log-normal quantity, got -1"),
    (lambda: Quantity(1.0, 1.0, "normal", 2.0, 2.0), "bounds: wanted lower < upper, got 2.0 and 2.0"),
    (lambda: Quantity.from_readings([]), "readings: wanted at least one, got none"),
    (lambda: Quantity.from_readings([1.0, 2.0], at_x=[0.0]), "places: wanted one per reading"),
    (lambda: Quantity.from_median(1.0, 1.0), "wanted median > 0 and factor > 1"),
    (lambda: Quantity.from_median("1", 2.0), "median: wanted a number, got '1'"),
    (lambda: Quantity.from_mean(None, 1.0), "mean: wanted a number, got None"),
    (lambda: Quantity.from_mean(1.0, 1.0, "uniform"), "kind: wanted normal, log-normal, log-uniform, got 'uniform"),
    (lambda: Quantity.from_range(2.0, 1.0), "bounds: wanted 0 < lower < upper, got 2.0 and 1.0"),
    (lambda: Quantity.from_readings([1.0, 2.0], resolution=-1), "resolution: wanted a finite number, zero or pos"),
    (lambda: Quantity.from_readings([1.0, math.inf]), "readings: wanted finite numbers"),
    (lambda: Quantity.from_readings("12"), "readings: wanted a list or an array of numbers, got '12'"),
    (lambda: Quantity("a"), "mean: wanted a number, got 'a'"),
    (lambda: Quantity(1.0, readings=(None,)), "readings: wanted a number, got None"),
    (lambda: Quantity.from_readings([1.0, 2.0], at_x=3), "at_x: wanted a list or an array of numbers, got 3"),
    (lambda: Quantity.from_readings(MASKED), "readings: wanted a list or an array of numbers, got masked_array"),
    (lambda: Quantity.of(MASKED), "quantity: wanted a number, an array of readings or a Quantity, got masked_array"),
    (lambda: Quantity.exact([1.0]), r"value: wanted a number, got \[1.0\]"),
    (lambda: Quantity.of([[1.0], [1.0, 2.0]]), "quantity: wanted a number, an array of readings or a Quantity"),
    (lambda: Quantity.exact(1.0).scaled(0), "factor: wanted a positive number, got 0"),
    (lambda: NORMAL.log_sd, "log_sd: wanted the quantity of a positive thing"),
]


def test_what_makes_no_quantity_and_what_none_can_do_is_refused():
    for make, message in NO_QUANTITIES:
        with pytest.raises(ValueError, match=message) as refused:
            make()
        assert isinstance(refused.value, InputError) == (not message.startswith(("factor", "log_sd")))
