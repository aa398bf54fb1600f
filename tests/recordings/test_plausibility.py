"""What a picked peak is if it is no mode: a part of another peak, or something broad on which modes stand."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.recordings import picking
from bayesplate.recordings.modes_found import Mode
from bayesplate.recordings.picking import parts_of_peaks
from bayesplate.recordings.plausibility import JudgedMode, ModeVerdict, broad_odds, mode_verdicts
from bayesplate.recordings.spectra import Spectra
from bayesplate.recordings.strength import ModeMobility


def part(of: int, spurious: float = 0.8) -> ModeVerdict:
    return ModeVerdict(spurious, "part of a peak", of)


MODE = ModeVerdict(0.02, "")


def mode(frequency: float, damping: float = 0.007) -> Mode:
    noise, none = np.full(2, 0.01), np.zeros(2)
    one = np.ones(1, dtype=complex)
    return Mode(frequency, damping * frequency, noise, none, none, one, np.ones(1), 0.0, 1.0)


def answer(strength: float = 1.0) -> ModeMobility:
    return ModeMobility(np.full(1, strength, dtype=complex), np.full(1, 0.01), 1.0)


def test_parts_of_a_peak_leave_it_and_a_part_of_a_part_and_what_is_rather_a_mode_stay():
    """Two modes with something between them that both are confused with: one of the two was a part of that."""
    assert parts_of_peaks([MODE, part(0), part(1)]) == {1: 0}
    assert parts_of_peaks([MODE, part(0, spurious=0.45), ModeVerdict(0.9, "faint")]) == {}
    assert parts_of_peaks([part(1), ModeVerdict(0.9, "faint")]) == {0: 1}


def test_what_is_four_times_as_broad_as_all_others_is_rather_no_mode():
    """Broad things do not tell how the board damps where they are weak."""
    damping = np.array([0.006, 0.008, 0.007, 0.005, 0.009, 0.007, 0.008, 0.006, 0.030])
    odds = broad_odds(damping, np.ones(damping.size))
    assert odds[-1] > 1.0
    assert odds[:-1].max() < 0.01

    damping = np.array([0.006, 0.007, 0.008, 0.03, 0.035, 0.04, 0.03])
    weak = np.array([1.0, 1.0, 1.0, 0.05, 0.05, 0.05, 0.05])
    assert broad_odds(damping, weak)[3:].min() > 1.0


HERTZ = np.arange(20.0, 1000.0, 0.5)
ONES = np.ones((HERTZ.size, 1), dtype=complex)
FIRST = np.zeros(1, dtype=np.intp)
SPECTRA = Spectra(HERTZ, ONES, ONES, ("frf",), FIRST, FIRST, FIRST, ((None, None),), "acceleration", 2.0)


def test_a_weak_mode_is_a_part_of_a_peak_nearby_and_of_nothing_broad():
    modes = [*(mode(100.0 * i) for i in range(1, 9)), mode(950.0, damping=0.035)]
    answered = [answer()] * len(modes)
    alone = mode_verdicts(SPECTRA, modes, answered)
    beside_a_peak = mode_verdicts(SPECTRA, [*modes, mode(810.0)], [*answered, answer(0.05)])
    beside_the_ground = mode_verdicts(SPECTRA, [*modes, mode(910.0)], [*answered, answer(0.05)])

    assert max(one.spurious for one in alone[:-1]) < 0.1
    assert (alone[-1].kind, alone[-1].spurious > 0.5) == ("something broad", True)
    assert beside_a_peak[-1].kind == "part of 800.0 Hz"
    assert beside_the_ground[-2].kind == "something broad"
    assert (beside_the_ground[-1].part_of, beside_the_ground[-1].spurious < 0.5) == (-1, True)


def test_beside_loud_lines_that_do_not_decay_no_mode_is_faint_and_they_are_named():
    modes = [*(mode(100.0 * i) for i in range(1, 6)), *(mode(hertz, damping=1e-6) for hertz in (83.1, 130.7, 220.3))]
    found = mode_verdicts(SPECTRA, modes, [*[answer()] * 5, *[answer(300.0)] * 3])

    assert max(one.spurious for one in found[:5]) < 0.1
    assert {one.kind for one in found[5:]} == {"a steady line"}


def test_modes_beside_a_part_are_those_of_a_fit_without_it_and_others_stay(monkeypatch):
    """Two modes and a part beside them, others far off; fitted again each has moved, one is gone and one has come.

    A mode is averaged with what was nearest to it before: the part may have had its place, and the mode have been what
    was left.
    """
    before = [mode(375.0), mode(401.94), mode(402.79), mode(404.65), mode(430.0)]
    again = [mode(401.73), mode(404.22), mode(407.56), mode(431.0)]
    words = {404.65: part(2)}

    def judged(_, modes):
        return [JudgedMode(one, answer(), words.get(one.frequency, MODE), one) for one in modes]

    monkeypatch.setattr(picking, "judge_modes", judged)
    monkeypatch.setattr(picking, "fit_modes", lambda *_: again)
    kept, (left_out,) = picking._fit_without_parts(None, before, [], (20.0, 1000.0))

    assert [peak.mode.frequency for peak in kept] == [375.0, 401.73, 404.22, 430.0]
    assert (left_out.mode.frequency, left_out.verdict.kind) == (404.65, f"part of {kept[2].pole[0]:.1f} Hz")
    assert (kept[2].other_fit.frequency, kept[2].doubt) == (404.65, 0.8)


def test_damping_is_averaged_as_the_frequency_is_and_its_error_holds_both_fits():
    as_whole, beside_part = mode(400.0, damping=0.005), mode(401.0, damping=0.007)

    one = picking._picked_row(JudgedMode(as_whole, answer(), MODE, beside_part, doubt=0.8), 1.0)

    decay, other = as_whole.decay, beside_part.decay
    assert one.hz == pytest.approx(400.2)
    assert one.damping_percent == pytest.approx(100.0 * (0.8 * decay + 0.2 * other) / 400.2)
    assert one.damping_sd_percent == pytest.approx(100.0 * np.hypot(0.01, 0.4 * (other - decay)) / 400.2)
