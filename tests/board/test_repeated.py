"""Lists of readings: decimal commas and strays are refused, honest lists are not, and alike readings are not exact."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from stated import frequencies

from bayesplate.board.board import Board
from bayesplate.board.repeated import (
    FURTHEST_FREQUENCIES,
    FURTHEST_SIZES,
    comma_complaint,
    peak_comma_complaint,
    spread,
)
from bayesplate.errors import InputError

THICKNESS = "{ mean = 3.0, sd = 0.03 }"
REPEATED = '"(1,1)" = [98, 98, 99]'
PEAKS = "[448.8, 594.1]"
COMMAS = [
    (THICKNESS, "[2,8, 2,7, 2,9]", "a decimal point: [2.8, 2.7, 2.9]"),
    (THICKNESS, "{ readings = [2,85, 2,75], resolution = 0.05 }", "a decimal point: [2.85, 2.75]"),
    (REPEATED, '"(1,1)" = [34,5, 35,2]', "a decimal point: [34.5, 35.2]"),
    (REPEATED, '"(1,1)" = [1,250, 1,260]', "without a separator of thousands: [1250, 1260]"),
    (PEAKS, "[448,8, 594,1]", "a decimal point: [448.8, 594.1]; or the whole numbers in ascending order"),
]  # fmt: skip
STRAYS = [
    (THICKNESS, "[2.8, 28]", "2.8 and 28"),
    (REPEATED, '"(1,1)" = [98, 109]', "98 and 109"),
    (REPEATED, '"(1,1)" = { readings = [98, 98, 196], resolution = 1 }', "98 and 196"),
    ("mass_g = 41.0", "mass_g = [41.0, 410]", "41 and 410"),
]
HONEST = [
    (THICKNESS, "[2, 3, 2]"),
    (THICKNESS, "[1.5, 3.0]"),
    (THICKNESS, "[3, 3, 3, 4]"),
    (THICKNESS, "{ readings = [2, 5, 3, 6], at_x_mm = [0, 253, 0, 253], at_y_mm = [0, 0, 114, 114] }"),
    ("length_x_mm = 253", "length_x_mm = [250, 251]"),
    (REPEATED, '"(1,1)" = [98, 107]'),
    (PEAKS, "[448, 594]"),
    (PEAKS, "[8, 51, 75, 127]"),
    (PEAKS, "[594, 448]"),
]


def test_decimal_commas_are_refused_with_the_numbers_that_were_meant(spoiled):
    for old, new, remedy in COMMAS:
        with pytest.raises(InputError, match=re.escape(remedy)) as caught:
            Board.from_text(spoiled(old, new), "my-board")
        (fault,) = caught.value.faults
        assert fault.wanted == "numbers without commas inside them"


def test_readings_that_are_not_of_one_thing_are_refused(spoiled):
    for old, new, got in STRAYS:
        with pytest.raises(InputError, match=re.escape(f"the smallest, got {got} (")):
            Board.from_text(spoiled(old, new), "my-board")


def test_honest_lists_are_read(spoiled):
    for old, new in HONEST:
        Board.from_text(spoiled(old, new), "my-board")


FURTHEST = st.sampled_from([FURTHEST_SIZES, FURTHEST_FREQUENCIES])


@given(FURTHEST, st.integers(3, 3000), st.lists(st.tuples(st.floats(0, 1), st.integers(1, 3)), min_size=1, max_size=8))
@example(FURTHEST_SIZES, 28, [(0.0, 1), (1.0, 1)])
def test_whatever_was_written_with_commas_is_refused(furthest, tenths, shares):
    """Decimals within a tenth of one another: refused, unless the whole numbers could be the readings themselves."""
    texts = [f"{tenths / 10 * (1 + 0.09 * share):.{digits}f}" for share, digits in shares]
    items = [int(part) for text in texts for part in text.split(".")]
    assume(not any(part.startswith("0") and part != "0" for text in texts for part in text.split(".")))
    decimals = [float(f"{w}.{d}") for w, d in zip(items[::2], items[1::2], strict=True)]
    assume(spread(decimals) <= 1.1)

    assert (comma_complaint(items, furthest) is None) == (spread(items) <= 1.5)


@given(FURTHEST, st.integers(1, 3000), st.lists(st.floats(0, 1), min_size=1, max_size=12))
@example(FURTHEST_SIZES, 2, [0.0, 1.0])
@example(FURTHEST_SIZES, 250, [0.0, 0.01])
def test_whole_numbers_that_agree_are_never_refused(furthest, smallest, shares):
    assert comma_complaint([math.floor(smallest * (1 + 0.5 * share)) for share in shares], furthest) is None


@given(st.lists(st.integers(1, 3000), min_size=1, max_size=20, unique=True))
def test_peaks_in_ascending_order_are_never_refused(peaks):
    assert peak_comma_complaint(sorted(peaks)) is None


ALIKE = [
    (THICKNESS, "[2.8]", 0.05),
    (THICKNESS, "[2.8, 2.8, 2.8]", 0.05),
    (THICKNESS, "{ readings = [2.8, 2.8], resolution = 0.1 }", 0.1),
    ("length_x_mm = 253", "length_x_mm = [253, 253]", 1.0),
    ("mass_g = 41.0", "mass_g = [41, 41]", 1.0),
    ("clamped_mm = { x0 = 30 }", "clamped_mm = { x0 = [30, 30] }", 1.0),
    ("mass_g = { mean = 0.6, sd = 0.1 }", "mass_g = [0.6, 0.6]", 0.1),
    (REPEATED, '"(1,1)" = [98, 98]', 1.0),  # that of its setup
    (THICKNESS, "2.8", 0.0),
]


def test_readings_that_are_all_alike_are_as_uncertain_as_their_instrument(spoiled):
    """sd = step / sqrt(12), by default that of a caliper, a rule or scales; a plain number stays exact."""
    for old, new, step in ALIKE:
        card = Board.from_text(spoiled(old, new), "my-board")
        inputs, setup = card.inputs, card.setups[0]
        told, unit = {
            THICKNESS: (inputs["thickness"], 1e-3),
            "length_x_mm = 253": (inputs["length_x"], 1e-3),
            "mass_g = 41.0": (inputs["mass"], 1e-3),
            "clamped_mm = { x0 = 30 }": (setup.clamped.get("x0"), 1e-3),
            "mass_g = { mean = 0.6, sd = 0.1 }": (setup.attached[0].mass, 1e-3),
            REPEATED: (frequencies(setup).get((1, 1)), 1.0),
        }[old]

        assert told is not None
        assert told.sd == pytest.approx(unit * step / math.sqrt(12), rel=1e-12)
