"""Picked modes of a board that was hit: where they were planted, with their signs, and hum is no mode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_recordings import SENSOR, accelerance, board, hits, likely_below, truth_below, with_complex_noise
from scipy.signal import fftconvolve

from bayesplate.recordings.picking import PickedModes, pick_modes
from bayesplate.recordings.signals import FrequencyResponse, Recording
from bayesplate.recordings.spectra import response_spectra
from bayesplate.recordings.sweeps import Sweep, impulse_response, read_sweep
from bayesplate.recordings.taking import TakenSpectra, take_impulses, take_spectra
from bayesplate.report.recordings import averaged_responses

RATE = 4000.0
HAMMERS = ((0.02, 0.02), (0.15, 0.19), (0.29, 0.03))
LOWEST, HIGHEST = 20.0, 420.0


@pytest.fixture(scope="module")
def heard() -> TakenSpectra:
    """Three places, three hits each, with hum."""
    rng = np.random.default_rng(8)
    files = []
    for place, hammer in enumerate(HAMMERS):
        for hit in range(3):
            force, response = hits(rng, [0.02], hammer, rate=RATE, decibels=45.0, hum=0.01)
            files.append([Recording(f"{place}-{hit}", RATE, response, force, hammer=hammer, sensor=SENSOR)])
    return take_spectra(files, HIGHEST)


@pytest.fixture(scope="module")
def picked(heard) -> PickedModes:
    """Its modes below 420 Hz."""
    return pick_modes(heard.spectra, LOWEST, HIGHEST)


def test_the_planted_modes_are_found_and_nothing_else_and_hum_is_set_aside_by_its_name(picked):
    truth = truth_below(400.0)
    likely = [mode for mode in picked.likely if mode.hz < 400.0]
    found = likely_below(picked, 400.0)

    np.testing.assert_allclose(found, truth, rtol=2e-3)
    np.testing.assert_allclose(
        [0.01 * mode.damping_percent for mode in likely], board().damping[: truth.size], rtol=0.15
    )
    assert np.abs((found - truth) / [mode.sd_hz for mode in likely]).max() < 4.0
    (hum,) = (mode for mode in picked.peaks if abs(mode.hz - 50.0) < 0.1)
    assert hum.spurious_probability > 0.9
    assert hum.kind in ("hum", "not alike from hit to hit")


def test_modes_beyond_the_asked_band_do_not_spoil_those_near_its_ends(heard):
    """From 280 to 420 Hz there are modes at 266 and 432, a pair one width apart and a mode at the upper end."""
    found = pick_modes(heard.spectra, 280.0, HIGHEST).peaks
    truth = truth_below(HIGHEST)

    np.testing.assert_allclose([mode.hz for mode in found], truth[truth > 280.0], atol=0.02)
    assert max(mode.sd_hz for mode in found) < 0.03


def test_residues_between_the_places_have_the_signs_and_sizes_of_the_shapes(picked):
    """The generator's own residues; modes that hardly answer at a place tell nothing of their sign."""
    every = np.stack([board().residues(hammer, SENSOR) for hammer in HAMMERS], axis=1)
    answered = zip(picked.likely, picked.likely_mobilities, strict=True)
    for mode, mobility in ((peak, np.real(one.mobility)) for peak, one in answered if peak.hz < 400.0):
        own = every[int(np.argmin(np.abs(board().damped - mode.hz)))]
        loud = np.abs(own) > 0.2 * np.abs(own).max()
        assert (np.sign(mobility[loud]) == np.sign(own[loud])).all()
        ratio = mobility[loud] / own[loud]
        assert np.ptp(ratio) < 0.3 * ratio.mean()


def test_the_averaged_response_is_the_board_and_its_coherence_falls_in_the_noise(heard):
    """H1 near resonances against the modal sum; the coherence of three hits is near one there."""
    one = averaged_responses(heard.spectra)[0]
    truth = board().damped[1:8]
    at = [int(np.argmin(np.abs(one.frequency - hertz))) for hertz in truth]

    assert np.min(one.coherence[at]) > 0.98
    residues = np.abs(board().residues(HAMMERS[0], SENSOR)[1:8])
    peaks = residues / (2.0 * board().damping[1:8])  # accelerance at a lone resonance, 1/kg
    assert np.corrcoef(np.log(one.level[at]), np.log(peaks))[0, 1] > 0.95


def test_taps_without_a_force_give_the_same_frequencies(heard, picked):
    deaf = pick_modes(replace(heard.spectra, force=None), LOWEST, HIGHEST)
    with_force = {round(mode.hz, 1) for mode in picked.likely}
    without = {round(mode.hz, 1) for mode in deaf.likely}

    assert len(with_force & without) >= len(with_force) - 1


def test_a_frequency_response_is_picked_as_it_is():
    """A modal sum with noise: no time signal was ever there."""
    rng = np.random.default_rng(4)
    hertz = np.arange(0.0, 520.0, 0.5)
    response = FrequencyResponse("frf", hertz, with_complex_noise(rng, accelerance(hertz, HAMMERS[0]), 1e-3))
    found = pick_modes(response_spectra([response], HIGHEST), LOWEST, HIGHEST).likely

    assert len(found) >= 5
    assert max(np.abs(board().damped / mode.hz - 1.0).min() for mode in found) < 2e-3


@pytest.mark.parametrize(("first", "last"), [(120.0, 420.0), (20.0, 283.0), (239.0, 389.0)])
def test_a_frequency_response_may_begin_and_end_anywhere_in_the_band(first, last):
    """Of some windows a line or two was measured, which tells no mode."""
    hertz = np.arange(first, last + 0.5)
    values = with_complex_noise(np.random.default_rng(4), accelerance(hertz, HAMMERS[0]), 1e-3)
    response = FrequencyResponse("frf", hertz, values)
    found = pick_modes(response_spectra([response], HIGHEST), LOWEST, HIGHEST).likely

    assert found
    assert all(first <= mode.hz <= last for mode in found)
    assert max(np.abs(board().damped / mode.hz - 1.0).min() for mode in found) < 2e-3


def test_a_sweep_gives_the_frequencies_of_the_board_by_its_parameters_as_by_itself():
    """The response to a sweep, by convolution with the modal impulse response; harmonics of the loudspeaker added."""
    rate, sweep = 2000.0, Sweep(20.0, 800.0, 3.0)
    times = np.arange(round(2.0 * rate)) / rate
    omega = 2.0 * np.pi * board().damped
    decay = 2.0 * np.pi * board().hertz * board().damping
    waves = np.exp(-decay[:, None] * times) * np.sin(omega[:, None] * times) * omega[:, None]
    impulse = board().residues(HAMMERS[0], SENSOR) @ waves / rate
    played = sweep.signal(rate)
    np.testing.assert_array_equal(read_sweep("20,800,3").signal(rate), played)
    response = fftconvolve(played + 0.05 * played**2, impulse)
    response = response + 1e-3 * np.abs(response).max() * np.random.default_rng(3).standard_normal(response.size)
    heard = Recording("sweep", rate, response)

    found = pick_modes(take_impulses([impulse_response(heard, played, 300.0)], 300.0).spectra, LOWEST, 300.0).likely

    assert len(found) >= 6
    for mode in found:
        assert np.abs(board().damped / mode.hz - 1.0).min() < max(1e-3, 4.0 * mode.sd_hz / mode.hz)
