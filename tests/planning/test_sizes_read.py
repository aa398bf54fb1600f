"""What more readings of the board leave of an input, worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_boards import setup_of

from bayesplate.board.board import make_board
from bayesplate.board.quantity import Quantity
from bayesplate.board.random_field import THICKNESS_SCALES, PlacedReadings, Surface, condition_field, sd_after_readings
from bayesplate.planning.sizes_read import GRID, N_MORE_READINGS, size_measurements

FREE = dict.fromkeys(("x0", "x1", "y0", "y1"), "free")


def board(**inputs):
    setup = setup_of(FREE, {(1, 1): 50.0, (2, 0): 70.0, (0, 2): 150.0})
    stated = {"length_x": 0.58, "length_y": 0.217, "thickness": 4.7e-3, "mass": 0.257, "poisson_xy": 0.4}
    quantities = {name: Quantity.exact(value) for name, value in stated.items()} | inputs
    return make_board("made", quantities, (setup,))


def sd_of(found, words):
    return next(one.sd for one in found if words in one.sentence)


def test_more_readings_narrow_the_scatter_and_leave_the_rounding():
    readings = (4.7e-3, 4.5e-3, 4.8e-3, 4.6e-3)
    found = size_measurements(board(thickness=Quantity.from_readings(readings, resolution=1e-4)))

    scatter = np.var(readings, ddof=1)
    assert sd_of(found, "5 more times") == pytest.approx(np.sqrt(scatter / (4 + N_MORE_READINGS) + 1e-8 / 12))
    alone = scatter / N_MORE_READINGS + 1e-10 / 12
    now = scatter / 4 + 1e-8 / 12
    assert sd_of(found, "10 times finer") == pytest.approx((1 / now + 1 / alone) ** -0.5)
    assert {one.n for one in found} == {N_MORE_READINGS}
    assert all(one.precision > 0 for one in found)


def test_a_stated_uncertainty_is_halved_in_variance_by_one_more_measurement():
    found = size_measurements(board(mass=Quantity.from_mean(0.257, 0.003)))

    assert [(one.n, one.parameter.name) for one in found] == [(1, "mass")]
    assert found[0].sd == pytest.approx(0.003 / np.sqrt(2))
    assert found[0].precision == pytest.approx(1.0)


def test_what_is_exact_and_what_cannot_be_read_is_not_proposed():
    assert size_measurements(board()) == ()
    assert size_measurements(board(poisson_xy=Quantity.from_mean(0.4, 0.08, "normal"))) == ()


def test_more_places_narrow_the_mean_of_a_field():
    x = (0.0, 0.145, 0.29, 0.435, 0.58) * 2
    y = (0.0,) * 5 + (0.217,) * 5
    readings = (4.7e-3, 4.5e-3, 4.8e-3, 4.8e-3, 4.6e-3, 4.5e-3, 4.5e-3, 4.9e-3, 4.9e-3, 4.7e-3)
    thickness = Quantity.from_readings(readings, resolution=1e-4, at_x=x, at_y=y, place_sd=0.02)
    one = board(thickness=thickness)
    found = [each for each in size_measurements(one) if "more places" in each.sentence]

    assert [each.n for each in found] == [12]
    assert found[0].sd < 0.8 * one.inputs["thickness"].sd


def test_more_places_narrow_the_mean_as_much_as_readings_that_scatter_like_those_at_hand():
    """Fields drawn from what the readings leave are read at the further places; all alike would promise more."""
    x, y = np.array((0.0, 0.25, 0.5, 0.75, 1.0) * 2), np.array((0.0,) * 5 + (1.0,) * 5)
    values = (4.7e-3, 4.5e-3, 4.8e-3, 4.8e-3, 4.6e-3, 4.5e-3, 4.5e-3, 4.9e-3, 4.9e-3, 4.7e-3)
    read = PlacedReadings(values, tuple(x), tuple(y), 1e-4, (0.0, 0.0), THICKNESS_SCALES)
    new_x, new_y = (one.ravel() for one in np.meshgrid(*GRID, indexing="ij"))
    known, rng = condition_field(read), np.random.default_rng(2)
    scatter = np.std(values, ddof=1) / known.mean

    def after(seen):
        every = (np.concatenate(pair) for pair in ((values, seen), (x, new_x), (y, new_y)))
        return condition_field(replace(read, **dict(zip(("values", "x", "y"), map(tuple, every), strict=True)))).sd

    variances = []
    for shape in rng.multivariate_normal(known.shape, known.covariance, 24):
        field = known.mean * (1.0 + Surface(known.degrees, tuple(shape))(new_x, new_y))
        rest = np.sqrt(max(scatter**2 - float(shape @ shape), 0.0)) * known.mean
        seen = field + rest * rng.standard_normal(new_x.size)
        variances.append(after(np.round(seen, 4)) ** 2)
    error = np.std(variances) / np.sqrt(len(variances))
    expected = sd_after_readings(read, new_x, new_y) ** 2

    assert abs(np.mean(variances) - expected) < 3.0 * error
    assert after(np.full(new_x.size, known.mean)) ** 2 < expected - 6.0 * error
