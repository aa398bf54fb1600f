"""What a picked peak is if it is no mode: a part of another peak, or something broad on which modes stand."""

from __future__ import annotations

import numpy as np

from bayesplate.recordings.picking import whole_peaks
from bayesplate.recordings.plausibility import Verdict, broad_odds


def part(of: int, spurious: float = 0.8) -> Verdict:
    return Verdict(spurious, "part of a peak", of)


MODE = Verdict(0.02, "")


def test_parts_of_a_peak_leave_it_and_a_part_of_a_part_stays():
    """Two modes with something between them that both are confused with: one of the two was a part of that."""
    assert whole_peaks([MODE, part(0), part(1)]) == {1: 0}


def test_what_is_a_mode_rather_than_a_part_does_not_leave():
    assert whole_peaks([MODE, part(0, spurious=0.45), Verdict(0.9, "faint")]) == {}


def test_a_part_of_a_faint_line_leaves_it():
    assert whole_peaks([part(1), Verdict(0.9, "faint")]) == {0: 1}


def test_what_is_four_times_as_broad_as_all_others_is_rather_no_mode():
    damping = np.array([0.006, 0.008, 0.007, 0.005, 0.009, 0.007, 0.008, 0.006, 0.030])
    odds = broad_odds(damping, np.ones(damping.size))

    assert odds[-1] > 1.0
    assert odds[:-1].max() < 0.01


def test_where_damping_differs_from_mode_to_mode_a_broad_one_may_be_a_mode():
    damping = np.exp(np.linspace(np.log(0.003), np.log(0.03), 12))

    assert broad_odds(damping, np.ones(12))[-1] < 0.5


def test_broad_things_do_not_tell_how_the_board_damps_where_they_are_weak():
    damping = np.array([0.006, 0.007, 0.008, 0.03, 0.035, 0.04, 0.03])
    weak = np.array([1.0, 1.0, 1.0, 0.05, 0.05, 0.05, 0.05])

    assert broad_odds(damping, weak)[3:].min() > 1.0
