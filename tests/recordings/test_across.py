"""Recordings of one board that differ: each mode once, its error holding the scatter, and strange ones named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from generator.ringing import Blow, Ringing, recorded, ringing, with_noise
from made_recordings import accelerance, likely_below, truth_below, with_complex_noise

from bayesplate.errors import InputError
from bayesplate.recordings.agreement import agreeing_records
from bayesplate.recordings.picking import PickedModes, pick_modes
from bayesplate.recordings.signals import FrequencyResponse, Recording
from bayesplate.recordings.taking import take_spectra

RATE, HIGHEST = 4000.0, 310.0
SURE = 0.98 * HIGHEST
"""Hz below which every planted mode is to be found."""
SIDES = (0.450, 0.190)
HAMMERS = ((0.02, 0.015), (0.13, 0.17), (0.43, 0.10), (0.21, 0.012))
SENSOR = (0.44, 0.18)


def made(e_x: float = 11.2e9, e_y: float = 0.82e9, thickness: float = 3.4e-3, mass: float = 0.0, at=SENSOR) -> Ringing:
    """A board of its own, with a sensor of some mass."""
    plate = ritz.Plate.from_moduli(
        e_x, e_y, 0.70e9, 0.35, rho=410.0, h=thickness, L_x=SIDES[0], L_y=SIDES[1], edges=ritz.ALL_FREE
    )
    return ringing(plate, 12, np.random.default_rng(7).uniform(0.006, 0.010, 12), at, mass)


BOARD = made()
TRUTH = truth_below(SURE, BOARD)


def scaled(board: Ringing, frequency=1.0, damping=1.0) -> Ringing:
    """The same with other frequencies and damping."""
    return replace(board, hertz=board.hertz * frequency, damping=board.damping * damping)


def tapped(rng, board, name, hammer, n_taps=4, damping_sd=0.0) -> Recording:
    """A recording of taps without a force; `damping_sd` is by how much damping scatters from tap to tap (log)."""
    parts = []
    for _ in range(n_taps):
        own = scaled(board, damping=np.exp(damping_sd * rng.standard_normal(12)))
        blow = Blow(0.05 + rng.uniform(0.0, 1e-3), rng.uniform(4e-4, 8e-4), rng.uniform(3.0, 6.0))
        parts.append(recorded(own, hammer, SENSOR, [blow], RATE, 1.5)[1])
    return Recording(name, RATE, with_noise(rng, np.concatenate(parts), 45.0, RATE))


def picked(*recordings: Recording) -> PickedModes:
    """Modes of recordings."""
    return pick_modes(take_spectra([[one] for one in recordings], HIGHEST).spectra, 20.0, HIGHEST)


@pytest.mark.parametrize(("shift", "damping"), [(0.991, 1.0), (1.0, 1.15), (0.96, 1.0)])
def test_two_recordings_that_differ_give_each_mode_once(shift, damping):
    """Laid down anew, or held otherwise: the mean, and half the difference as its error."""
    rng = np.random.default_rng(11)
    other = scaled(BOARD, shift, damping)
    found = picked(tapped(rng, BOARD, "a hit 1.wav", HAMMERS[0]), tapped(rng, other, "b hit 2.wav", HAMMERS[1]))

    truth = np.sqrt(TRUTH * other.damped[: TRUTH.size])
    np.testing.assert_allclose(likely_below(found, SURE)[: truth.size], truth, rtol=4e-4)
    for mode in found.likely[: truth.size]:
        assert mode.sd_hz == pytest.approx(abs(shift - 1.0) / 2.0 * mode.hz, rel=0.25, abs=0.02)
    (remark,) = found.remarks
    assert ("b hit 2.wav" in remark) == (abs(shift - 1.0) > 1e-3)
    assert remark.endswith("are they of one board, held and loaded alike?") == (shift < 0.98)
    assert remark.startswith("the recordings differ in " + ("damping, or by" if shift == 1.0 else "frequency ("))


def test_recordings_that_show_the_same_modes_are_searched_together():
    """0.02 % are far below the width of a mode.

    Two modes one per cent apart look like one at another frequency from place to place; the other modes do not.
    """
    hertz = BOARD.hertz.copy()
    hertz[3] = 1.01 * hertz[2]
    pair = replace(BOARD, hertz=hertz)
    for seed, boards in ((12, [BOARD, scaled(BOARD, 1.0002)]), (13, [pair] * 4)):
        rng = np.random.default_rng(seed)
        files = [[tapped(rng, board, f"{k}.wav", HAMMERS[k])] for k, board in enumerate(boards)]
        assert len(agreeing_records(take_spectra(files, HIGHEST).spectra, 20.0, HIGHEST)) == 1, len(boards)


def test_damping_that_scatters_from_tap_to_tap_costs_no_mode_and_makes_none():
    found = picked(tapped(np.random.default_rng(14), BOARD, "a.wav", HAMMERS[0], damping_sd=0.25))

    np.testing.assert_allclose(likely_below(found, SURE), TRUTH, rtol=5e-4)
    assert found.remarks == (
        "the hits differ in damping, or by less than 0.1 % in frequency: each was searched by itself, and the errors "
        "hold by what a mode scatters",
    )


def test_scatter_within_files_and_among_them_is_kept_apart():
    """Six taps that differ from tap to tap by much, in two files: the error is not that of six independent ones."""
    rng = np.random.default_rng(15)
    files = [
        tapped(rng, scaled(BOARD, shift), name, hammer, n_taps=3, damping_sd=0.3)
        for shift, name, hammer in ((1.0, "a.wav", HAMMERS[0]), (1.006, "b.wav", HAMMERS[1]))
    ]
    found = picked(*files)

    np.testing.assert_allclose(likely_below(found, SURE), TRUTH * 1.003, rtol=1e-3)
    assert np.median([mode.sd_hz / mode.hz for mode in found.likely]) == pytest.approx(0.003, rel=0.25)


def test_a_recording_of_another_board_is_named_and_left_out_where_most_agree():
    rng = np.random.default_rng(16)
    strange = made(e_x=14.5e9, e_y=0.6e9, thickness=3.0e-3)
    files = [tapped(rng, scaled(BOARD, 1.0 + 3e-3 * k), f"{k}.wav", HAMMERS[k], n_taps=2) for k in range(3)]
    other = tapped(rng, strange, "strange.wav", HAMMERS[3], n_taps=2)
    found = picked(*files, other)

    likely, errors = likely_below(found, SURE), np.array([mode.sd_hz for mode in found.likely])[: TRUTH.size]
    np.testing.assert_allclose(likely, TRUTH * 1.003, rtol=3e-3)
    assert (np.abs(likely - TRUTH * 1.003) < 2.0 * errors).all()
    assert found.remarks[0].startswith("strange.wav left out: ")
    assert "strange.wav" not in set(found.spectra.file_names)
    with pytest.raises(InputError, match=r"\.wav: wanted a recording of the same board, got \d of \d modes are those"):
        picked(files[0], other)


def test_responses_of_a_roving_sensor_give_each_mode_once():
    """A sensor of a gram, of 119, lowers each mode otherwise at each place."""
    rng = np.random.default_rng(17)
    places = ((0.02, 0.012), (0.43, 0.18), (0.23, 0.02))
    boards = [made(mass=1e-3, at=place) for place in places]
    hertz = np.arange(0.0, 500.0, 0.4)
    responses = []
    for board, place in zip(boards, places, strict=True):
        values = with_complex_noise(rng, accelerance(hertz, place, board, SENSOR), 2e-4)
        responses.append(FrequencyResponse(f"{place}.csv", hertz, values))
    found = pick_modes(take_spectra([responses], HIGHEST).spectra, 20.0, HIGHEST)

    each = np.array([board.damped for board in boards])[:, : TRUTH.size]
    likely = likely_below(found, SURE)
    assert likely.size == each.shape[1]
    assert (likely > 0.999 * each.min(axis=0)).all()
    assert (likely < 1.001 * each.max(axis=0)).all()
    assert np.ptp(each / each.mean(axis=0), axis=0).max() > 5e-3
