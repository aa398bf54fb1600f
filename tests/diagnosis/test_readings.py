"""A reading that is simply wrong is named with its numbers; one that may be another, or none, is not."""

from __future__ import annotations

import numpy as np
import pytest
from made_searches import NOISE, bare, baseline, ground_of, with_modes, with_residual

from bayesplate.diagnosis.readings import suspect_readings, wrong_reading
from bayesplate.diagnosis.search import SearchResult, run_search
from bayesplate.diagnosis.terms import noise_grid


def found_of(residual, n_modes=8, noise=(NOISE,)) -> SearchResult:
    base = baseline(np.random.default_rng(1), n_modes, noise=noise)
    base = with_residual(base, residual)
    return run_search(ground_of(base, bare(base, noise_grid(base.board))))


@pytest.mark.parametrize(("mode", "size", "side"), [(0, 0.2, "above"), (5, -0.2, "below")])
def test_the_reading_that_is_wrong_is_named(mode, size, side):
    found = found_of(0.3 * NOISE * np.random.default_rng(2).standard_normal(8) + size * np.eye(8)[mode])
    label, hertz = found.ground.baseline.board.setups[0].labels[mode], 60.0 * np.exp(0.3 * mode)
    (told,) = suspect_readings(found)
    assert told.offset == pytest.approx(size, rel=0.2)
    assert wrong_reading(found) == (
        f"Read {label} again: without it the other readings agree with the model (p = {told.p_value:.3f}). It was read "
        f"as {hertz:.6g} Hz, {1200 / np.log(2) * abs(told.offset):.0f} cents {side} the "
        f"{hertz * np.exp(-told.offset):.4g} Hz that the other modes let expect."
    )


def test_two_wrong_readings_are_not_one():
    found = found_of(0.2 * (np.eye(8)[1] - np.eye(8)[4]))
    assert suspect_readings(found) == ()
    assert wrong_reading(found) == ""


def test_where_several_readings_may_be_the_wrong_one_none_is_named():
    """Two rows alike: the constants cannot tell which of the two is off."""
    base = baseline(np.random.default_rng(1), 6)
    slopes = base.slopes.copy()
    slopes[:2], slopes[2:] = np.eye(3)[0], np.eye(3)[[1, 1, 2, 2]]
    base = with_residual(with_modes(base, slopes=0.5 * slopes), 0.2 * np.eye(6)[0])
    found = run_search(ground_of(base, bare(base, noise_grid(base.board))))
    told = suspect_readings(found)
    assert {one.index for one in told} == {0, 1}
    assert told[0].log_weight - told[1].log_weight < np.log(3.0)
    assert wrong_reading(found) == ""


def test_of_two_the_one_that_is_clearly_less_expected_is_named():
    found = found_of(0.045 * np.eye(6)[3], n_modes=6)
    assert [one.index for one in suspect_readings(found)] == [3, 0]
    assert wrong_reading(found).startswith("Read (3,0) again")


def test_no_reading_is_wrong_where_all_agree():
    found = found_of(0.04 * np.eye(6)[0], n_modes=6)
    assert found.p_value(0) > 0.05
    assert suspect_readings(found) == ()


def test_the_setup_is_named_where_there_are_several():
    found = found_of(0.2 * np.eye(8)[5], noise=(NOISE, NOISE))
    assert wrong_reading(found).startswith("Read (5,0) in setup setup-1 again")


def test_five_readings_can_tell_and_four_cannot():
    assert wrong_reading(found_of(0.2 * np.eye(5)[2], n_modes=5)).startswith("Read (2,0) again")
    assert suspect_readings(found_of(0.2 * np.eye(4)[0], n_modes=4)) == ()
