"""Where sensor and hammer go, on shapes whose nodal lines are known."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.planning.bench import choose_places

GRID = np.linspace(0.0, 1.0, 25)


def shape(m, n):
    """A supported plate: sin(m pi x) sin(n pi y)."""
    return np.outer(np.sin(m * np.pi * GRID), np.sin(n * np.pi * GRID))


def test_one_mode_is_sensed_at_its_antinode_and_struck_at_another():
    found = choose_places(shape(2, 1)[None], GRID)

    assert found.sensor[0] in (pytest.approx(0.25), pytest.approx(0.75))
    assert found.sensor[1] == pytest.approx(0.5)
    assert abs(found.hammer[0] - found.sensor[0]) == pytest.approx(0.5)
    assert found.seen == (pytest.approx(1.0),)


def test_no_nodal_line_runs_through_sensor_or_hammer():
    shapes = np.stack([shape(1, 1), shape(2, 1), shape(1, 2), shape(2, 2), shape(3, 1)])

    found = choose_places(shapes, GRID)

    assert min(found.seen) > 0.2
    for x, y in (found.sensor, found.hammer):
        assert min(abs(x - node) for node in (1 / 3, 1 / 2, 2 / 3)) > 0.04
        assert abs(y - 0.5) > 0.04


def test_a_sensor_that_stands_on_a_nodal_line_is_told():
    found = choose_places(np.stack([shape(1, 1), shape(4, 1)]), GRID, sensor=(0.5, 0.5))

    assert found.sensor == (pytest.approx(0.5), pytest.approx(0.5))
    assert found.seen[0] > 0.6  # the hammer goes where it helps those that can be seen
    assert found.seen[1] == pytest.approx(0.0, abs=1e-12)


def test_nothing_is_placed_on_a_known_mass():
    """Where the hammer would strike, and every tap."""
    shapes = np.stack([shape(1, 1), shape(2, 1)])
    free = choose_places(shapes, GRID)
    beside = choose_places(shapes, GRID, mass=free.hammer)
    for place in (beside.sensor, beside.hammer, *beside.taps):
        assert max(abs(a - b) for a, b in zip(place, free.hammer, strict=True)) >= 0.1


def test_a_sensor_that_is_fixed_stays_where_it_is_off_the_grid_and_at_the_edge():
    for place in ((0.31, 0.47), (0.012, 0.5)):
        found = choose_places(np.stack([shape(1, 1), shape(2, 1)]), GRID, sensor=place)
        (x, y), (hammer_x, hammer_y) = place, found.hammer

        assert found.sensor == place
        for m, seen in zip((1, 2), found.seen, strict=True):
            of_hammer = np.sin(m * np.pi * hammer_x) * np.sin(np.pi * hammer_y)
            assert seen == pytest.approx(abs(np.sin(m * np.pi * x) * np.sin(np.pi * y) * of_hammer), abs=1e-3)


def test_taps_tell_all_figures_apart():
    shapes = np.stack([shape(1, 1), shape(2, 1), shape(1, 2)])

    found = choose_places(shapes, GRID)

    at = [[np.sin(m * np.pi * x) * np.sin(n * np.pi * y) for m, n in ((1, 1), (2, 1), (1, 2))] for x, y in found.taps]
    assert len(found.taps) == 3
    assert np.linalg.cond(at) < 5.0
