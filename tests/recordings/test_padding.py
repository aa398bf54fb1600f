"""Padded frequency responses: told by what they are over time, and picked by the lines that were measured."""

from __future__ import annotations

import numpy as np
import pytest
from made_recordings import accelerance, hits

from bayesplate.recordings.padding import common_padding, padding_of
from bayesplate.recordings.picking import pick_modes
from bayesplate.recordings.signals import FrequencyResponse
from bayesplate.recordings.taking import take

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


@pytest.mark.parametrize("padded", [1, 2, 3, 8])
def test_a_padded_record_is_told_from_a_long_one(padded):
    assert padding_of(response(padded).values) == padded


def test_a_response_without_noise_that_was_never_cut_off_is_not_taken_for_padded():
    hertz = np.arange(10.0, 900.0, 0.25)
    assert padding_of(accelerance(hertz, HAMMER)) == 1


def test_what_one_response_of_several_knows_is_not_left_out():
    padded, long = response(2), response(1)
    long = FrequencyResponse("long", padded.frequency, np.interp(padded.frequency, long.frequency, long.values))
    noise = np.random.default_rng(1).standard_normal((2, long.values.size)) * np.abs(long.values).max() * 1e-3
    long = FrequencyResponse("long", padded.frequency, long.values + noise[0] + 1j * noise[1])

    assert common_padding([padded]) == 2
    assert common_padding([padded, long]) == 1


def test_a_padded_response_gives_the_modes_of_its_record_and_says_what_was_left_out():
    found = []
    for padded in (1, 4):
        heard = take([[response(padded)]], HIGHEST)
        found.append([(mode.hz, mode.sd_hz) for mode in pick_modes(heard.spectra, 20.0, HIGHEST).likely])
        told = "frf.csv: of every 4 lines one was measured and is used, the others are interpolated"
        assert heard.remarks == ((told,) if padded == 4 else ())

    np.testing.assert_allclose(found[0], found[1], rtol=1e-6)


def test_control_by_all_lines_of_a_padded_record_low_modes_are_known_worse(monkeypatch):
    """A decay that was cut off is a simple rational term at the record's own lines, and none between them."""
    own = pick_modes(take([[response(2)]], HIGHEST).spectra, 20.0, HIGHEST).likely
    monkeypatch.setattr("bayesplate.recordings.taking.common_padding", lambda responses: 1)
    every = pick_modes(take([[response(2)]], HIGHEST).spectra, 20.0, HIGHEST).likely

    assert [round(one.hz) for one in own[:2]] == [round(one.hz) for one in every[:2]]
    assert min(b.sd_hz / a.sd_hz for a, b in zip(own[:2], every[:2], strict=True)) > 3.0
