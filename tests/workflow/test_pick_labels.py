"""Which peaks labels are proposed for, which label of a peak a card states, and how sure it is said to be."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from bayesplate.recordings.contract import LabelChance, PickedRow
from bayesplate.results.words import chances
from bayesplate.workflow.pick_labels import FEWEST_SURE, Labels, proposing

CASES = {
    "both say the same: the confidence is that of sand and residues": (
        {"(3,1)": 0.999, "(2,2)": 0.001}, {"(3,1)": 0.6, "(2,2)": 0.4}, ("(3,1)", 0.6),
    ),
    "sand and residues tell nothing: beyond doubt by its frequency": ({"(3,1)": 0.995}, {}, ("(3,1)", 0.995)),
    "they tell nothing, and its frequency leaves some doubt": ({"(3,1)": 0.98, "(2,2)": 0.02}, {}, None),
    "they prefer another, yet all together leave no doubt": (
        {"(2,2)": 0.999}, {"(3,1)": 0.68, "(2,2)": 0.32}, ("(2,2)", 0.999),
    ),
    "they prefer another, and doubt is left": ({"(5,0)": 0.69, "(3,3)": 0.31}, {"(3,3)": 0.9, "(5,0)": 0.1}, None),
    "they are not sure": ({"(3,1)": 0.9, "(2,2)": 0.1}, {"(3,1)": 0.45, "(2,2)": 0.4}, None),
    "rather no mode": ({"(1,2)": 0.35}, {"(1,2)": 0.73}, None),
    "a mode of no clear name": ({"mode 7": 1.0}, {}, None),
}  # fmt: skip


@pytest.mark.parametrize(("by_all", "by_evidence", "expected"), CASES.values(), ids=CASES)
def test_the_label_stated_is_never_another_than_the_most_probable(by_all, by_evidence, expected):
    assert Labels((by_all,), (by_evidence,), None).stated(0) == expected


def peaks(*spurious):
    """Peaks in the order of frequency, by the probability that each is no mode."""
    return [SimpleNamespace(frequency=50.0 * (i + 1), spurious=one) for i, one in enumerate(spurious)]


def test_labels_are_proposed_for_the_lowest_peaks_that_are_sure():
    """Parts of split peaks and resonances of a support, taken for modes, lead the labels of all others astray."""
    every = peaks(*[0.0, 0.049, 0.05, 0.3] * 12)
    first_and_second_of_four = [0, 1, 4, 5, 8, 9, 12, 13, 16, 17, 20, 21]
    assert proposing(every) == [every[i] for i in first_and_second_of_four]


def test_where_few_peaks_are_sure_all_take_part():
    few = peaks(*[0.0] * (FEWEST_SURE - 1), 0.2, 0.3)
    assert proposing(few) == few
    enough = peaks(*[0.0] * FEWEST_SURE, 0.2)
    assert proposing(enough) == enough[:-1]


ROW = PickedRow(
    hz=184.6, sd_hz=0.2, noise_hz=0.1, scatter_hz=0.0, window_hz=0.18, damping_percent=1.1, damping_sd_percent=0.06,
    sign="-", amplitude=0.13, spurious_probability=0.1, kind="", seen=1.0, alike=0.99,
    labels=(LabelChance("(1,2)", 0.35), LabelChance("(3,0)", 0.04), LabelChance("(0,2)", 0.01)),
    unlabelled_probability=0.6,
)  # fmt: skip


def test_a_peak_that_fits_none_of_the_boards_modes_is_rather_no_mode_of_it():
    """Though it is one by the recordings: a support rings too."""
    assert ROW.is_likely
    assert ROW.mode_probability == pytest.approx(0.9 * 0.4)
    assert chances(ROW.may_be(2)) == "(1,2) 35 %, (3,0) 4 %, none 60 %"
    assert chances(replace(ROW, unlabelled_probability=0.05).may_be(1)) == "(1,2) 35 %"


def test_without_a_card_the_recordings_alone_decide():
    bare = replace(ROW, labels=(), unlabelled_probability=None)
    assert bare.mode_probability == pytest.approx(0.9)
    assert chances(bare.may_be(2)) == "–"
