"""A field given its readings: against plain regression, shrunk where it should, its mean and its places honest."""

from __future__ import annotations

from dataclasses import replace

import made_boards
import numpy as np
import pytest
import ritz

from bayesplate.board.quantity import Quantity
from bayesplate.board.random_field import (
    LENGTH_SCALE,
    THICKNESS_SCALES,
    PlacedReadings,
    Surface,
    condition_field,
    thickness_readings,
    width_readings,
)

AT_X, AT_Y = np.tile(np.linspace(0.0, 1.0, 5), 2), np.repeat([0.0, 1.0], 5)
GRID = tuple(one.ravel() for one in np.meshgrid(np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 7)))
MIDDLE = (np.arange(60) + 0.5) / 60


def read(values, x=AT_X, y=AT_Y, resolution=0.0, place_sd=(0.0, 0.0)):
    return PlacedReadings(tuple(map(float, values)), tuple(x), tuple(y), resolution, place_sd, THICKNESS_SCALES)


def course(found):
    return Surface(found.degrees, tuple(found.shape))


def curved(x, y):
    return 1.0 + 0.08 * (x - 0.5) - 0.05 * (y - 0.5) + 0.03 * ((x - 0.5) ** 2 - 1.0 / 12.0)


def test_many_exact_readings_are_the_field():
    found = condition_field(read(4.7 * curved(*GRID), *GRID))
    there = found.mean * (1.0 + course(found)(MIDDLE[:, None], MIDDLE))
    assert there == pytest.approx(4.7 * curved(MIDDLE[:, None], MIDDLE), rel=2e-3)
    assert found.mean == pytest.approx(4.7, rel=1e-3)
    assert np.sqrt(np.trace(found.covariance)) < 2e-3


def test_no_course_has_a_mean_over_the_board():
    found = condition_field(read([4.7, 4.5, 4.8, 4.8, 4.6, 4.5, 4.5, 4.9, 4.9, 4.7], resolution=0.1))
    points, weights = np.polynomial.legendre.leggauss(12)
    at, weights = 0.5 * (points + 1.0), 0.5 * weights
    values = course(found)(at[:, None], at)
    assert weights @ values @ weights == pytest.approx(0.0, abs=1e-14)
    assert np.sqrt(weights @ values**2 @ weights) == pytest.approx(course(found).size, rel=1e-12)


def test_conditioning_is_that_of_a_gaussian_process():
    """At one amplitude and scatter, against the formula with the process's own covariances of places."""
    import bayesplate.board.random_field as module

    amplitude, scatter = 0.02, 0.006
    rng = np.random.default_rng(1)
    readings = 1.0 + 0.02 * rng.standard_normal(10)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_AMPLITUDES", np.array([amplitude]))
        patch.setattr(module, "_SCATTERS", np.array([scatter]))
        found = condition_field.__wrapped__(read(readings))
    # The covariances of the smooth functions at the places and at the middle of the board, the mean taken out.
    places = (np.append(AT_X, 0.5), np.append(AT_Y, 0.5))
    fine = (np.arange(400) + 0.5) / 400
    one = [np.exp(-0.5 * ((at[:, None] - at) / LENGTH_SCALE) ** 2) for at in places]
    to_fine = [np.exp(-0.5 * ((at[:, None] - fine) / LENGTH_SCALE) ** 2).mean(axis=1) for at in places]
    over = np.exp(-0.5 * ((fine[:, None] - fine) / LENGTH_SCALE) ** 2).mean()
    towards = to_fine[0] * to_fine[1]
    kernel = one[0] * one[1] - towards[:, None] - towards + over**2
    kernel *= amplitude**2 / (1.0 - over**2)
    noise = kernel[:10, :10] + scatter**2 * np.eye(10)
    weights = np.linalg.solve(noise, np.ones(10))
    mean = weights @ readings / weights.sum()
    middle = kernel[10, :10] @ np.linalg.solve(noise, readings - mean)
    assert found.mean == pytest.approx(mean, abs=2e-4)
    assert found.sd == pytest.approx(weights.sum() ** -0.5, rel=0.02)
    assert found.mean * course(found)(np.array(0.5), np.array(0.5)) == pytest.approx(middle, abs=5e-4)
    assert abs(middle) > 1e-3


def test_what_rounding_explains_shrinks_to_a_uniform_board():
    """Readings that differ by a quarter of the step to which they are rounded, and the same without rounding."""
    values = [4.7, 4.7, 4.75, 4.75, 4.8] * 2
    coarse, fine = (condition_field(read(values, resolution=r)) for r in (0.4, 0.001))
    assert course(coarse).size < 0.3 * course(fine).size
    alike = condition_field(read([4.7] * 10, resolution=1e-3))
    assert course(alike).size < 1e-6
    assert np.sqrt(np.trace(alike.covariance)) < 5e-4


def test_each_reading_is_rounded_on_its_own():
    """Forty readings of a board that hardly varies: the rounding error of their mean is that of forty, not of one."""
    rng = np.random.default_rng(3)
    x, y = rng.uniform(size=(2, 40))
    found = condition_field(read(np.round(4.7 + 0.02 * rng.standard_normal(40), 1), x, y, resolution=0.1))
    assert 0.1 / np.sqrt(12 * 40) < found.sd < 2.5 * 0.1 / np.sqrt(12 * 40)
    assert found.sd < 0.1 / np.sqrt(12) / 2


def test_doubtful_places_leave_more_open_where_the_field_is_steep():
    readings = 4.7 * (1.0 + 0.2 * (GRID[0] - 0.5))
    level = np.full(readings.size, 4.7)
    for values, factor in ((readings, 2.0), (level, 1.0)):
        exact, doubtful = (
            np.trace(condition_field(read(values, *GRID, resolution=0.01, place_sd=sd)).covariance) ** 0.5
            for sd in ((0.0, 0.0), (0.05, 0.05))
        )
        assert doubtful > factor * exact if factor > 1.0 else doubtful == pytest.approx(exact, rel=1e-3)


def test_a_place_error_counts_by_the_slope():
    """A taper of 20 % along x read at places with an error of 2 % of the side: 0.4 % more scatter."""
    readings = 4.7 * (1.0 + 0.2 * (GRID[0] - 0.5))
    moved = condition_field(read(readings, *GRID, place_sd=(0.02, 0.5)))
    rounded = condition_field(read(readings, *GRID, resolution=4.7 * 0.2 * 0.02 * np.sqrt(12.0)))
    assert moved.sd == pytest.approx(rounded.sd, rel=0.1)


def test_places_are_fractions_of_the_sides_and_one_place_is_no_field():
    long, wide = Quantity.exact(0.58), Quantity.exact(0.2)
    two = Quantity.from_readings([4.7e-3, 4.6e-3], 1e-4, [0.0, 0.5801], [0.1, 0.0], place_sd=0.01)
    found = thickness_readings(two, long, wide)
    assert (found.x, found.y) == ((0.0, 1.0), (0.5, 0.0))
    assert found.place_sd == pytest.approx((0.01 / 0.58, 0.05))
    same = replace(two, at_x=(0.1, 0.1), at_y=(0.1, 0.1))
    assert thickness_readings(same, long, wide) is None
    assert thickness_readings(Quantity.from_readings([4.7e-3, 4.6e-3]), long, wide) is None
    widths = Quantity.from_readings([0.2, 0.19], 1e-3, [0.0, 0.29], place_sd=0.01)
    assert width_readings(widths, long).x == (0.0, 0.5)
    assert width_readings(widths, long).place_sd == pytest.approx((0.01 / 0.58, 0.0))


def test_a_board_takes_the_mean_over_its_area():
    """Five readings at the thick end and one at the thin one: the mean of six is not the board's."""
    x = np.array([0.0, 0.01, 0.02, 0.03, 0.04, 1.0]) * ritz.FREE_SPRUCE.L_x
    thickness = Quantity.from_readings([5e-3] * 5 + [4e-3], 1e-4, x, np.full(6, 0.1))
    board = made_boards.board_of(ritz.FREE_SPRUCE, [], thickness=thickness)
    found = board.inputs["thickness"]
    assert thickness.mean > 4.8e-3
    assert abs(found.mean - 4.5e-3) < 2.0 * found.sd < 1e-3
    assert found.readings == thickness.readings
    exact = replace(thickness, sd=0.0)
    assert made_boards.board_of(ritz.FREE_SPRUCE, [], thickness=exact).inputs["thickness"] == exact
