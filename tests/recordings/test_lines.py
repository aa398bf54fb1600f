"""Lines that are not the board: a steady tone, hum and rumble take no mode with them and refuse no tap; noise gates."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from made_recordings import board, hits, likely_below, truth_below

from bayesplate.errors import InputError
from bayesplate.recordings.picking import PickedModes, pick_modes
from bayesplate.recordings.signals import Recording
from bayesplate.recordings.taking import take_spectra

RATE, SECONDS, HIGHEST = 8000.0, 7.5, 300.0
SURE = 0.98 * HIGHEST
"""Hz below which the planted modes are to be found."""
TIMES = [0.5, 1.9, 3.3, 4.7, 6.1]
AT = np.arange(round(SECONDS * RATE)) / RATE


@lru_cache(maxsize=2)
def taps(decibels: float = 45.0) -> np.ndarray:
    """Five taps, their greatest value 1, the noise so many dB below them."""
    rng, places = np.random.default_rng(21), ((0.03, 0.02), (0.52, 0.03))
    heard = hits(rng, TIMES, *places, rate=RATE, seconds=SECONDS, decibels=decibels)[1]
    return heard / np.abs(heard).max()


def tone(hertz: float, share: float) -> np.ndarray:
    """A steady tone of a share of the greatest value of the taps."""
    return share * np.sin(2.0 * np.pi * hertz * AT + hertz)


def picked(added: np.ndarray, decibels: float = 45.0) -> PickedModes:
    """Modes of the taps with something added, from all five of them."""
    taken = take_spectra([[Recording("tap.wav", RATE, taps(decibels) + added)]], HIGHEST)
    assert (taken.spectra.n_records, taken.remarks) == (5, ())
    return pick_modes(taken.spectra, 20.0, HIGHEST)


LINES = {
    "hum with harmonics": (sum(tone(60.01 * k, 0.04 / k) for k in (1, 2, 3, 4)), 45.0, "hum"),
    "a tone on a mode": (tone(float(board().damped[2]) + 0.3, 0.03), 45.0, "a steady line"),
    "a faint tone": (tone(87.3, 0.003), 45.0, "a steady line"),
    "a faint tone in little noise": (tone(87.3, 0.003), 75.0, "a steady line"),
    "loud tones everywhere": (
        sum(tone(hertz, 0.5) for hertz in (66.1, 93.7, 111.3, 137.9, 163.2)),
        45.0,
        "a steady line",
    ),
    "rumble": (tone(1.0, 2.0) + tone(9.0, 0.3), 45.0, ""),
    "an offset": (np.ones(AT.size), 45.0, ""),
    "two whistles": (tone(1000.3, 0.1) + tone(2400.0, 0.1), 45.0, ""),
}
"""What is added to the taps, the noise in dB, and what a line of it in the band is named."""


@pytest.mark.parametrize("name", LINES)
def test_a_steady_tone_takes_no_mode_with_it_and_is_named_and_what_lies_beyond_the_band_makes_none(name):
    added, decibels, kind = LINES[name]
    found = picked(added, decibels)

    np.testing.assert_allclose(likely_below(found, SURE), truth_below(SURE), rtol=5e-4)
    if kind:
        assert max(mode.amplitude for mode in found.likely if mode.hz < SURE) == 1.0
        assert kind in {mode.kind for mode in found.peaks if not mode.is_likely}


def gated(heard: np.ndarray, threshold: float, fade: float) -> np.ndarray:
    """What a noise gate leaves: it shuts, within some time, where the level stays below a threshold for 50 ms."""
    loud = np.flatnonzero(np.abs(heard) > threshold)
    since = AT - AT[loud[np.maximum(np.searchsorted(loud, np.arange(AT.size), side="right") - 1, 0)]]
    return heard * np.clip(1.0 - (since - 0.05) / fade, 0.0, 1.0)


@pytest.mark.parametrize(("threshold", "fade"), [(0.008, 0.05), (0.02, 0.02)])
def test_what_a_noise_gate_cuts_off_is_not_used_and_it_is_named(threshold, fade):
    taken = take_spectra([[Recording("gate.wav", RATE, gated(taps(), threshold, fade))]], HIGHEST)
    found = pick_modes(taken.spectra, 20.0, HIGHEST)

    np.testing.assert_allclose(likely_below(found, SURE), truth_below(SURE), rtol=2e-3)
    (told,) = taken.remarks
    assert told.startswith("gate.wav: the sound breaks off ")
    assert "a noise gate" in told


def test_a_gate_that_leaves_too_little_is_named_in_the_refusal():
    heard = np.where((AT - 0.5) % 1.4 < 0.15, taps(), 0.0)

    with pytest.raises(InputError, match=r"time to ring down, .*digital silence between: switch off the noise gate"):
        take_spectra([[Recording("gate.wav", RATE, heard)]], HIGHEST)


def test_rounding_to_nothing_is_no_gate():
    """A soft recording of 16 bits whose end is smaller than the last of them."""
    heard = np.round(200.0 * taps()) / 2.0**15

    assert take_spectra([[Recording("soft.wav", RATE, heard)]], HIGHEST).remarks == ()
