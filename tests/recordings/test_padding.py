"""Padded frequency responses: told by what they are over time, and picked by the lines that were measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from made_recordings import accelerance, hits, with_complex_noise

from bayesplate.recordings.padding import common_padding, padding_factor
from bayesplate.recordings.picking import pick_modes
from bayesplate.recordings.signals import FrequencyResponse
from bayesplate.recordings.taking import take_spectra

RATE, HAMMER, HIGHEST = 4000.0, (0.02, 0.02), 420.0
N_SAMPLES, N_HITS, AFTER_PULSE = 4000, 5, 100


def response(padded: int) -> FrequencyResponse:
    """H1 of five hits, from records of one second and as many lines as `padded` of them would have."""
    rng = np.random.default_rng(3)
    cross, power = 0.0, 0.0
    for _ in range(N_HITS):
        force, heard = hits(rng, [0.0], HAMMER, rate=RATE, decibels=45.0)
        force[AFTER_PULSE:] = 0.0
        y, f = (np.fft.rfft(signal[:N_SAMPLES], padded * N_SAMPLES) for signal in (heard, force))
        cross, power = cross + f.conj() * y, power + np.abs(f) ** 2
    hertz = np.arange(cross.size) / padded * RATE / N_SAMPLES
    kept = (hertz >= 10.0) & (hertz <= 900.0)
    return FrequencyResponse("frf.csv", hertz[kept], (cross / power)[kept])


def test_a_padded_record_is_told_from_a_long_one():
    """And from a response without noise that was never cut off."""
    assert [padding_factor(response(padded).values) for padded in (1, 2, 3, 8)] == [1, 2, 3, 8]
    assert padding_factor(accelerance(np.arange(10.0, 900.0, 0.25), HAMMER)) == 1


def test_what_one_response_of_several_knows_is_not_left_out():
    padded, long = response(2), response(1)
    long = FrequencyResponse("long", padded.frequency, np.interp(padded.frequency, long.frequency, long.values))
    long = replace(long, values=with_complex_noise(np.random.default_rng(1), long.values, 1e-3))

    assert common_padding([padded]) == 2
    assert common_padding([padded, long]) == 1


def picked_of(padded: int) -> tuple[np.ndarray, tuple[str, ...]]:
    """Frequency and its error of the likely modes of a response, and what was told of it."""
    heard = take_spectra([[response(padded)]], HIGHEST)
    likely = pick_modes(heard.spectra, 20.0, HIGHEST).likely
    return np.array([(mode.hz, mode.sd_hz) for mode in likely]), heard.remarks


def test_a_padded_response_gives_the_modes_of_its_record_and_says_what_was_left_out(monkeypatch):
    """The control: by all lines of a padded record low modes are known worse.

    A decay that was cut off is a simple rational term at the record's own lines, and none between them.
    """
    own, padded = picked_of(1), picked_of(2)
    monkeypatch.setattr("bayesplate.recordings.taking.common_padding", lambda responses: 1)
    every, _ = picked_of(2)

    np.testing.assert_allclose(own[0], padded[0], rtol=1e-6)
    assert own[1] == ()
    assert padded[1] == ("frf.csv: of every 2 lines one was measured and is used, the others are interpolated",)
    np.testing.assert_allclose(every[:2, 0], own[0][:2, 0], rtol=0.01)
    assert (every[:2, 1] > 3.0 * own[0][:2, 1]).all()
