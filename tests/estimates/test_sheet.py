"""The range in which a mode that was not measured is expected."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.estimates.sheet import Precision


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
