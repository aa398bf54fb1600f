"""Lists of readings: decimal commas are refused, honest lists are not, and readings that are alike are not exact."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from stated import changed, frequencies, read

from bayesplate.board.repeated import (
    LARGEST_FREQUENCY_RATIO,
    LARGEST_SIZE_RATIO,
    comma_complaint,
    peak_comma_complaint,
    spread_ratio,
)

FURTHEST = st.sampled_from([LARGEST_SIZE_RATIO, LARGEST_FREQUENCY_RATIO])


@given(FURTHEST, st.integers(3, 3000), st.lists(st.tuples(st.floats(0, 1), st.integers(1, 3)), min_size=1, max_size=8))
@example(LARGEST_SIZE_RATIO, 28, [(0.0, 1), (1.0, 1)])
def test_whatever_was_written_with_commas_is_refused(furthest, tenths, shares):
    """Decimals within a tenth of one another: refused, unless the whole numbers could be the readings themselves."""
    texts = [f"{tenths / 10 * (1 + 0.09 * share):.{digits}f}" for share, digits in shares]
    items = [int(part) for text in texts for part in text.split(".")]
    assume(not any(part.startswith("0") and part != "0" for text in texts for part in text.split(".")))
    decimals = [float(f"{w}.{d}") for w, d in zip(items[::2], items[1::2], strict=True)]
    assume(spread_ratio(decimals) <= 1.1)

    assert (comma_complaint(items, furthest) is None) == (spread_ratio(items) <= 1.5)


@given(FURTHEST, st.integers(1, 3000), st.lists(st.floats(0, 1), min_size=1, max_size=12))
@example(LARGEST_SIZE_RATIO, 2, [0.0, 1.0])
@example(LARGEST_SIZE_RATIO, 250, [0.0, 0.01])
def test_whole_numbers_that_agree_are_never_refused(furthest, smallest, shares):
    assert comma_complaint([math.floor(smallest * (1 + 0.5 * share)) for share in shares], furthest) is None


@given(st.lists(st.integers(1, 3000), min_size=1, max_size=20, unique=True))
def test_peaks_in_ascending_order_are_never_refused(peaks):
    assert peak_comma_complaint(sorted(peaks)) is None


ALIKE = [
    ("{ mean = 3.0, sd = 0.03 }", "[2.8]", 5e-5, lambda board: board.inputs["thickness"]),
    ("{ mean = 3.0, sd = 0.03 }", "{ readings = [2.8, 2.8], resolution = 0.1 }", 1e-4, lambda b: b.inputs["thickness"]),
    ("{ mean = 3.0, sd = 0.03 }", "2.8", 0.0, lambda board: board.inputs["thickness"]),
    ("253", "[253, 253]", 1e-3, lambda board: board.inputs["length_x"]),
    ("114", "[114, 114]", 1e-3, lambda board: board.inputs["length_y"]),
    ("41.0", "[41, 41, 41]", 1e-3, lambda board: board.inputs["mass"]),
    ("mass_g = 41.0", "mass_g = 41.0\nwarp_mm = { cup = [0.8, 0.8] }", 1e-4, lambda board: board.warp["cup"]),
    ("{ x0 = 30 }", "{ x0 = [30, 30] }", 1e-3, lambda board: board.setups[0].clamped["x0"]),
    ("{ mean = 0.6, sd = 0.1 }", "[0.6, 0.6]", 1e-4, lambda board: board.setups[0].attached[0].mass),
    ("[98, 98, 99]", "[98, 98]", 1.0, lambda board: frequencies(board.setups[0])[1, 1]),  # that of its setup
]


def test_readings_that_are_all_alike_are_as_uncertain_as_their_instrument():
    """sd = step / sqrt(12), by default that of a caliper, a rule, scales or a feeler; a plain number stays exact."""
    for old, new, step, of in ALIKE:
        assert of(read(changed(old, new))).sd == pytest.approx(step / math.sqrt(12), rel=1e-12), new
