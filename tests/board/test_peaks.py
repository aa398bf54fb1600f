"""Peaks without a label, and how far labels and peaks are trusted: what a card says of them, and what it is refused."""

from __future__ import annotations

import re
from typing import Any

import pytest

from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.errors import InputError
from bayesplate.labels import Label

UNLABELLED = "unlabelled_hz = [448.8, 594.1]\n"
TABLES = """
[[setup.peaks]]
hz = { mean = 404.0, sd = 0.2 }
sign = "+"
amplitude = 0.4
damping_percent = 0.5
spurious_probability = 0.2

[[setup.peaks]]
hz = [671, 672]
"""
WHOLE = "[setup.hammer]"
PEAK = "[setup] peaks 1 "
CHANCE = "a number from 1e-09 to 0.999999999"
HINT = " (a probability: 98 % is 0.98)"


def setup_of(text: str) -> Setup:
    return Board.from_text(text, "my-board").setups[0]


def refusals(text: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        Board.from_text(text, "my-board")
    return [str(fault) for fault in caught.value.faults]


def test_peaks_are_those_of_the_list_then_those_of_the_tables(board_text):
    setup = setup_of(board_text + TABLES)
    third, fourth = setup.peaks[2:]

    assert setup.unlabelled == (448.8, 594.1, 404.0, 671.5)
    assert (third.sign, third.amplitude, third.damping, third.spurious) == ("+", 0.4, 0.005, 0.2)
    assert third.frequency == Quantity.from_mean(404.0, 0.2)
    assert (fourth.sign, fourth.amplitude, fourth.damping, fourth.spurious) == ("", None, None, None)


def test_the_uncertainty_of_a_listed_peak_is_kept(spoiled):
    """A list of readings has its standard error, 0.5 Hz, joined with the rounding to 1 Hz; a number stays exact."""
    many = "unlabelled_hz = [448.8, [594, 595], { mean = 640, sd = 2 }, { readings = [700, 702], resolution = 0.1 }]\n"
    setup = setup_of(spoiled(UNLABELLED, many))
    exact, read, vague, finer = (peak.frequency for peak in setup.peaks)

    assert (exact.sd, vague.sd) == (0.0, 2.0)
    assert read.sd == pytest.approx((0.5**2 + 1 / 12) ** 0.5)
    assert finer.sd == pytest.approx((1.0**2 + 0.01 / 12) ** 0.5)
    (peak, _) = setup_of(spoiled(UNLABELLED, "") + TABLES.replace("[671, 672]", "[594, 595]")).peaks[::-1]
    assert peak.frequency == read


def test_peaks_alone_are_a_card(board_text, spoiled):
    start, end = board_text.index("[setup.frequencies_hz]"), board_text.index(WHOLE)
    alone = spoiled(UNLABELLED, "", board_text[:start] + board_text[end:])

    assert setup_of(alone + TABLES).unlabelled == (404.0, 671.5)
    assert refusals(alone) == [
        'my-board.toml [setup] frequencies_hz: wanted measured frequencies, "(1,0)" = 52, got no modes'
    ]
    assert len(refusals(alone + TABLES.replace("404.0", "-404.0"))) == 1  # a bad peak is no lack of one


CONFIDENCES = [
    ("", (1.0, 1.0, 1.0)),
    ("label_confidence = 0.9\n", (0.9, 0.9, 0.9)),
    ('label_confidence = { "( 1,0 )" = 0.5, "(2,0)" = 0.75 }\n', (0.5, 1.0, 0.75)),
]


def test_confidence_in_labels(spoiled):
    for stated, confidence in CONFIDENCES:
        setup = setup_of(spoiled(UNLABELLED, UNLABELLED + stated))

        assert tuple(reading.confidence for reading in setup.readings) == confidence
    setup = setup_of(spoiled(WHOLE, '[setup.label_confidence]\n"(1,1)" = 0.25\n\n' + WHOLE))

    assert [(reading.label, reading.confidence) for reading in setup.readings][1] == (Label(1, 1), 0.25)


def test_missed_and_spurious_peaks(spoiled, board_text):
    keys = "missed_probability = 0.4\nspurious_probability = 0.001\n"
    setup, silent = setup_of(spoiled(UNLABELLED, UNLABELLED + keys)), setup_of(board_text)

    assert (setup.missed, setup.spurious) == (0.4, 0.001)
    assert (silent.missed, silent.spurious) == (0.2, 0.02)


BAD_PEAKS = [
    ("hz = { mean = 404.0, sd = 0.2 }\n", "", PEAK + "hz", "its frequency in Hz", "nothing"),
    ("mean = 404.0", "mean = 0.05", PEAK + "hz.mean", "a number from 0.1 to 1000000 Hz", "0.05 (in Hz: 1 kHz is"),
    ("[671, 672]", "[671, 771]", "[setup] peaks 2 hz", "readings of one thing", "671 and 771"),
    ('sign = "+"', 'sign = "?"', PEAK + "sign", '"+" or "-"', '"?"'),
    ("amplitude = 0.4", "amplitude = 0", PEAK + "amplitude", "a positive number", "0"),
    ("damping_percent = 0.5", "damping_percent = 0", PEAK + "damping_percent", "a positive number",
     "0 (the damping ratio in percent: half the loss factor)"),
    ("damping_percent = 0.5", "damping_percent = 101", PEAK + "damping_percent", "a number from 1e-06 to 100 %",
     "101 (the damping ratio in percent: half the loss factor)"),
    ("spurious_probability = 0.2", "spurious_probability = 2", PEAK + "spurious_probability", CHANCE, "2" + HINT),
    ("damping_percent", "damping", PEAK + "damping",
     "one of hz, sign, amplitude, damping_percent, spurious_probability",
     "an unknown key (did you mean damping_percent?)"),
]  # fmt: skip


def test_a_peak_is_refused(spoiled, board_text):
    for old, new, place, wanted, got in BAD_PEAKS:
        (fault,) = refusals(board_text + spoiled(old, new, TABLES))

        assert fault.startswith(f"my-board.toml {place}: wanted {wanted}")
        assert f", got {got}" in fault


def test_a_table_of_peaks_stands_in_double_brackets(board_text):
    assert refusals(board_text + "[setup.peaks]\nhz = 404\n") == [
        "my-board.toml [setup] peaks: wanted tables below [[setup.peaks]], in double brackets, got a table with hz"
    ]


def test_too_many_peaks(board_text):
    many = "".join(f"[[setup.peaks]]\nhz = {100 + i}\n" for i in range(201))

    assert refusals(board_text + many) == ["my-board.toml [setup] peaks: wanted at most 200 tables, got 201"]


def test_a_table_that_says_the_same_again_is_refused(board_text):
    first = TABLES[: TABLES.rindex("[[setup.peaks]]")]
    remedy = "(repeated readings of one peak are a list: hz = [.., ..])"
    assert refusals(board_text + TABLES + first + first) == [
        f"my-board.toml [setup] peaks {number}: wanted a peak of its own, got peak 1 again {remedy}"
        for number in (3, 4)
    ]
    others = first.replace('"+"', '"-"') + "[[setup.peaks]]\nhz = 448.8\n[[setup.peaks]]\nhz = 52\n"
    assert setup_of(board_text + TABLES + others).unlabelled == (448.8, 594.1, 404.0, 671.5, 404.0, 448.8, 52.0)


CONFIDENCE = "[setup] label_confidence"


BAD_PROBABILITIES = [
    ("label_confidence = 0", CONFIDENCE, "a positive number", "0" + HINT),
    ("label_confidence = 98", CONFIDENCE, "a number from 1e-09 to 1", "98" + HINT),
    ('label_confidence = { "(1,0)" = 1.5 }', CONFIDENCE + '."(1,0)"', "a number from 1e-09 to 1", "1.5" + HINT),
    ('label_confidence = { "(3,0)" = 0.9 }', CONFIDENCE + '."(3,0)"', "a label among the frequencies_hz", "(3,0)"),
    ('label_confidence = { "(a)" = 0.9 }', CONFIDENCE + '."(a)"', "two whole numbers", '"(a)"'),
    ("missed_probability = 0", "[setup] missed_probability", "a positive number", "0" + HINT),
    ("missed_probability = 1", "[setup] missed_probability", CHANCE, "1" + HINT),
    ("spurious_probability = -0.1", "[setup] spurious_probability", "a positive number", "-0.1" + HINT),
    ("spurious_probability = 1.0", "[setup] spurious_probability", CHANCE, "1.0" + HINT),
    ("missing_probability = 0.1", "[setup] missing_probability", "one of name, notes",
     "an unknown key (did you mean missed_probability?)"),
]  # fmt: skip


def test_a_probability_is_refused(spoiled):
    for stated, place, wanted, got in BAD_PROBABILITIES:
        (fault,) = refusals(spoiled(UNLABELLED, UNLABELLED + stated + "\n"))

        assert re.match(re.escape(f"my-board.toml {place}: wanted {wanted}"), fault)
        assert f", got {got}" in fault


def test_all_faults_of_peaks_are_reported_at_once(spoiled, board_text):
    text = spoiled(UNLABELLED, UNLABELLED + "label_confidence = 2\n", board_text + TABLES)
    faults: list[Any] = refusals(spoiled("[671, 672]", "0", spoiled("amplitude = 0.4", "amplitude = -1", text)))

    assert [fault.partition(":")[0].removeprefix("my-board.toml [setup] ") for fault in faults] == [
        "peaks 1 amplitude",
        "peaks 2 hz",
        "label_confidence",
    ]
