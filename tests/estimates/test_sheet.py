"""What stands on a sheet beside the modes: combined modes by hand, and the range of a mode that was not measured."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.estimates.sheet import Precision, SheetMode, _combined_modes, combination_weights, combined_shapes

CLAMPED = np.array(
    [
        [236, 1214, 146.9], [237.5, 8589, 552.3], [1790, 1652, 534.9],
        [1792, 10180, 2051], [242, 31910, 1196], [1799, 35250, 4469],
    ]
)  # fmt: skip
"""The paper's table of the clamped plate."""


def test_three_decoupled_modes_are_their_own_combination():
    """A board with two beam modes and one twisting mode, as the classic methods need: by hand, each over its own."""
    np.testing.assert_allclose(combination_weights(np.diag([2.0, 4.0, 5.0])), np.diag([0.5, 0.25, 0.2]), atol=1e-15)


def test_combination_decouples_the_constants():
    """Combined psi of any plate are its rigidities, and none answers to another one."""
    np.testing.assert_allclose(combination_weights(CLAMPED) @ CLAMPED, np.eye(3), atol=1e-10)


def test_two_readings_of_one_mode_share_its_weight():
    doubled = np.array([[2.0, 0, 0], [2.0, 0, 0], [0, 4.0, 0], [0, 0, 5.0]])

    np.testing.assert_allclose(combination_weights(doubled)[0], [0.25, 0.25, 0, 0], atol=1e-15)


def test_shapes_are_mixed_with_unit_norm_and_one_sign():
    """Neither the scale nor the sign with which a solver returns a shape matters."""
    grid = np.linspace(0, 1, 21)
    shapes = np.stack(
        [np.outer(np.cos(m * np.pi * grid), np.cos(n * np.pi * grid)) for m, n in ((1, 0), (0, 1), (1, 1))]
    )

    plain = combined_shapes(np.diag([2.0, 4.0, 5.0]), shapes)
    other = combined_shapes(np.diag([2.0, 4.0, 5.0]), shapes * np.array([-3.0, 0.1, 7.0])[:, None, None])

    np.testing.assert_allclose(plain, other, atol=1e-12)
    np.testing.assert_allclose(np.sqrt(np.sum(plain**2, axis=(1, 2))), [0.5, 0.25, 0.2])
    assert np.all(plain[:, -1, -1] > 0)


@pytest.mark.parametrize("rows", [slice(0, 2), [0, 0, 0, 1]], ids=["two modes", "one mode again"])
def test_modes_that_do_not_tell_the_constants_apart_are_refused(rows):
    with pytest.raises(ValueError, match="wanted modes that tell three constants apart"):
        combination_weights(CLAMPED[rows])


def test_the_range_foretells_readings_that_were_left_out():
    """Simulated at first order: of readings from known constants, two thirds fall within the band, to 3 sd of 4000."""
    rng = np.random.default_rng(1)
    root = rng.normal(size=(3, 3)) * 0.02
    precision, shares = Precision(root @ root.T, {"bench": 0.01}), np.array([0.5, 0.3, 0.2])
    log_constants = rng.normal(size=(4000, 3)) @ root.T
    readings = 100 * np.exp(0.5 * log_constants @ shares + 0.01 * rng.normal(size=4000))
    low, high = precision.band(100.0, shares, "bench")

    share = np.mean((readings > low) & (readings < high))
    assert share == pytest.approx(2 / 3, abs=3 * np.sqrt(2 / 9 / 4000))
    narrow_low, narrow_high = Precision(0 * root, {"bench": 0.01}).band(100.0, shares, "bench")
    assert np.mean((readings > narrow_low) & (readings < narrow_high)) < 2 / 3 - 3 * np.sqrt(2 / 9 / 4000)


def test_modes_that_hardly_tell_the_constants_apart_have_no_combined_modes():
    """The shares of (0,0), (1,1), (2,2) of a supported plate are the same, but for the error of the mesh."""
    one = np.array([4.0, 1.0, 2.0])
    alike = np.array([one, 16.0 * one * (1.0 + 1e-6 * np.arange(3)), 81.0 * one])
    apart = np.array([[4.0, 1.0, 2.0], [60.0, 1.0, 8.0], [4.0, 16.0, 8.0]])

    def combined(coefficients):
        shape = np.ones((3, 3))
        rows = zip(("(0,0)", "(1,0)", "(0,1)"), coefficients, strict=True)
        modes = (SheetMode(name, 100.0, 100.0, None, np.zeros(4), row, shape) for name, row in rows)
        return _combined_modes(tuple(modes))

    assert combined(alike) == ()
    assert len(combined(apart)) == 3
