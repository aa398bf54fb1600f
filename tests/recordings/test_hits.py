"""Hits in recordings: found where they were struck, and set aside with the reason where they cannot be used."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_recordings import hits, refusal

from bayesplate.recordings.hits import find_hits
from bayesplate.recordings.picking import pick_modes
from bayesplate.recordings.signals import FrequencyResponse, Recording
from bayesplate.recordings.taking import take_spectra

RATE = 4000.0
HAMMER = (0.03, 0.02)
TIMES = [0.5, 1.9, 3.3, 4.7]


def recording(times, *, has_force=True, seconds=6.0, name="a.wav", **options) -> Recording:
    """A board that is hit at some times."""
    force, heard = hits(np.random.default_rng(1), times, HAMMER, rate=RATE, seconds=seconds, **options)
    return Recording(name, RATE, heard, force if has_force else None)


@pytest.mark.parametrize("has_force", [True, False], ids=["by the force", "by the sound"])
def test_every_hit_is_found_where_it_was_struck(has_force):
    found = find_hits(recording(TIMES, has_force=has_force, decibels=35.0, hum=0.03))

    np.testing.assert_allclose([hit.onset / RATE for hit in found], TIMES, atol=0.003)
    assert {hit.fault for hit in found} == {""}
    assert all(0.0 < (hit.start - hit.onset) / RATE < 0.01 for hit in found)


@pytest.mark.parametrize("has_force", [True, False], ids=["by the force", "by the sound"])
def test_a_bounce_is_a_double_hit_and_the_others_are_used(has_force):
    """Half of the hits are enough, and the rest is told."""
    times = [0.5, 0.56, 1.9, 3.3]
    one = recording(times, has_force=has_force)
    clicks = np.zeros_like(one.response)  # what a microphone hears of the hammer itself
    for at in times:
        first = round(at * RATE)
        clicks[first : first + 8] = np.random.default_rng(first).standard_normal(8) * np.abs(one.response).max()
    clicked = replace(one, response=one.response + clicks)
    taken = take_spectra([[clicked]], 500.0)

    assert [hit.fault[:12] for hit in find_hits(clicked)] == ["a double hit", "a double hit", "", ""]
    assert taken.spectra.n_records == 2
    assert taken.spectra.hits.tolist() == [3, 4]  # by which remarks on the hits that are used name them
    assert [line.partition(", ")[0] for line in taken.remarks] == [
        "a.wav: hit 1 at 0.50 s left out", "a.wav: hit 2 at 0.56 s left out",
    ]  # fmt: skip


@pytest.mark.parametrize("seconds", [0.35, 0.5, 4.0])
def test_how_strongly_a_mode_rings_is_the_same_from_a_decay_that_is_cut_off(seconds):
    """Six modes of one residue and 0.4 % damping: from half a second each is right only with what is cut off."""
    rng, begin = np.random.default_rng(2), round(0.1 * RATE)
    t = np.arange(begin + round(seconds * RATE)) / RATE
    force = np.zeros_like(t)
    force[begin : begin + 3] = 0.5, 1.0, 0.5
    ringing = sum(
        np.cos(2 * np.pi * hz * t) * np.exp(-0.004 * 2 * np.pi * hz * t) for hz in (119, 136, 166, 183, 233, 250)
    )
    heard = np.convolve(force, ringing)[: t.size] / RATE
    noisy = heard + 1e-4 * np.abs(heard).max() * rng.standard_normal(t.size)
    taken = take_spectra([[Recording("a.wav", RATE, noisy, force, "velocity")]], 400.0)
    found = pick_modes(taken.spectra, 20.0, 400.0).mobilities

    strengths = np.array([mode.strength for mode in found])
    assert strengths.size == 6
    assert strengths / strengths.mean() == pytest.approx(np.ones(6), abs=0.02)
    assert max(mode.complexity for mode in found) < 2.0


@pytest.mark.parametrize(("seed", "damping", "is_heard_out"), [(0, 0.02, True), (9, 0.02, True), (1, 0.0002, False)])
def test_a_decay_that_sinks_into_the_hiss_has_fallen_and_one_that_rings_on_has_not(seed, damping, is_heard_out):
    """Hiss of 3 or 0.5 per cent of the loudest sample; modes fall by 89 dB and more, or by 1 to 7 dB."""
    rate, rng = 22_050.0, np.random.default_rng(seed)
    t = np.arange(round(8.2 * rate)) / rate
    heard = np.zeros_like(t)
    for at in np.array([0.1, 2.1, 4.1, 6.1]):
        since = np.maximum(t - at, 0.0)
        for hz in (40.9, 64.5, 104.9, 134.3, 178.9, 208.4, 294.4, 325.3):
            heard += (
                rng.uniform(0.2, 1.0) * np.exp(-2.0 * np.pi * hz * damping * since) * np.sin(2 * np.pi * hz * since)
            )
    heard += (0.03 if is_heard_out else 0.005) * np.abs(heard).max() * rng.standard_normal(t.size)

    found = find_hits(Recording("tap.wav", rate, heard))

    assert [round(hit.onset / rate, 1) for hit in found] == [0.1, 2.1, 4.1, 6.1]
    if is_heard_out:
        assert {hit.fault for hit in found} == {""}
    else:
        assert found[0].fault == "the next hit came before it had fallen by 10 dB"


def test_noise_and_a_tone_alone_hold_no_hit():
    quiet = np.random.default_rng(2).standard_normal(24_000)
    tone = np.sin(np.pi / 4.0 * np.arange(60_000.0)) + 1e-3 * np.random.default_rng(3).standard_normal(60_000)

    assert find_hits(Recording("quiet", RATE, quiet)) == []
    assert find_hits(Recording("quiet", RATE, quiet, quiet[::-1])) == []
    assert find_hits(Recording("tone", 2.0 * RATE, tone)) == []


def with_hiss(softest: float, rate: float = 44_100.0) -> Recording:
    """Four taps of which one is soft, in hiss as a telephone records it, far above what a board rings at."""
    heard = np.zeros(round(7.0 * rate))
    for share, at in zip([1.0, softest, 0.9, 0.8], TIMES, strict=True):
        first = round(at * rate)
        heard[first:] += share * hits(np.random.default_rng(1), [0.0], HAMMER, rate=rate, seconds=7.0 - at)[1]
    hiss = 2e-3 * np.abs(heard).max() * np.random.default_rng(2).standard_normal(heard.size)
    hum = 1e-2 * np.abs(heard).max() * np.sin(2.0 * np.pi * 50.0 * np.arange(heard.size) / rate)
    return Recording("tap.wav", rate, heard + hiss + hum)


def test_a_soft_tap_is_found_in_the_hiss_of_a_wide_band_and_a_softer_one_is_told():
    found = find_hits(with_hiss(0.4))

    np.testing.assert_allclose([hit.onset / 44_100.0 for hit in found], TIMES, atol=0.004)

    softer = take_spectra([[with_hiss(0.08)]], 500.0)

    assert softer.spectra.n_records == 3
    (told,) = softer.remarks
    assert told.startswith("tap.wav: the sound rises again within a ring-down, at 1.90 s: a soft tap or a noise")
    assert take_spectra([[with_hiss(0.4)]], 500.0).remarks == ()


@pytest.mark.parametrize("seed", range(2))
def test_a_ringing_board_is_not_heard_as_a_second_hit(seed):
    """Little noise: as the higher modes fade, what is left beats and rises now and then."""
    times = [0.1 + 1.6 * k for k in range(5)]
    _, heard = hits(np.random.default_rng(seed), times, (0.15, 0.19), (0.52, 0.03), rate=8000.0, seconds=8.0)

    found = find_hits(Recording("tap.wav", 8000.0, heard))

    np.testing.assert_allclose([hit.onset / 8000.0 for hit in found], times, atol=0.004)


def test_files_are_repeats_only_where_both_places_are_known_and_the_same():
    for sensor, n_pairs in (((0.5, 0.2), 1), (None, 2)):
        files = [[replace(recording(TIMES, name=name), hammer=HAMMER, sensor=sensor)] for name in ("a.wav", "b.wav")]
        spectra = take_spectra(files, 500.0).spectra

        assert len(spectra.place_pairs) == len(set(spectra.places)) == n_pairs


def test_what_cannot_be_used_is_refused_with_every_hit_and_every_file():
    quiet = Recording("quiet.wav", RATE, 1e-3 * np.random.default_rng(2).standard_normal(24_000), np.zeros(24_000))
    close = recording([0.5, 0.7, 0.9], name="close.wav", seconds=1.4)
    since = np.arange(round(1.8 * RATE)) / RATE - np.array([0.5, 0.9, 1.3])[:, None]
    bell = np.sum(np.where(since > 0.0, np.exp(-since) * np.sin(1300.0 * since), 0.0), axis=0)  # it rings on for long
    early = Recording("early.wav", RATE, bell, np.sum(np.abs(since) < 5e-4, axis=0, dtype=float))
    slow = Recording("slow.wav", 1000.0, np.zeros(3000), np.zeros(3000))

    message = refusal(take_spectra, [[quiet], [close], [early], [slow]], 500.0)

    for said in (
        "quiet.wav: wanted a hit that stands out of the quiet, got none",
        "close.wav hit 1 at 0.50 s: wanted one hit, and time to ring down, got only 0.2 s until the next hit",
        "early.wav hit 2 at 0.90 s: wanted one hit, and time to ring down, got the next hit came before it had fallen",
        "slow.wav rate: wanted 1250 samples a second or more for modes up to 500 Hz, got 1000",
        "slow.wav rate: wanted 4000 Hz, as quiet.wav, got 1000 Hz",
    ):
        assert said in message


def test_a_force_that_rings_or_is_the_response_is_none_and_told_once_for_each_file():
    one = recording(TIMES, name="right.wav")
    hiss = 1e-3 * np.random.default_rng(4).standard_normal(one.response.size)
    exchanged = replace(one, name="exchanged.wav", force=one.response, response=one.force)
    stereo = replace(one, name="stereo.wav", force=-0.8 * one.response + hiss)

    assert take_spectra([[one]], 500.0).spectra.n_records == 4
    first, second = refusal(take_spectra, [[one], [exchanged], [stereo]], 500.0).split("\n")

    assert first.startswith("exchanged.wav force: wanted a channel with a pulse for each hit, got one that rings on")
    assert second.startswith("stereo.wav force: wanted a channel with a pulse for each hit, got nearly the same as the")
    assert "--channels response,force where they are exchanged, response,response" in first


def test_what_does_not_go_together_is_refused():
    hertz = np.arange(200) * 1.0
    response = FrequencyResponse("a.csv", hertz, np.ones(200) + 0j)
    other = FrequencyResponse("b.csv", 2.0 * hertz, np.ones(200) + 0j)
    heard, deaf = recording(TIMES), recording(TIMES, has_force=False, name="b.wav")

    assert "FILES: wanted recordings or frequency responses, got both" in refusal(
        take_spectra, [[heard], [response]], 500.0
    )
    assert "b.csv frequencies: wanted those of a.csv, got others" in refusal(take_spectra, [[response], [other]], 150.0)
    assert "b.wav: wanted the channels of a.wav, got without a force" in refusal(take_spectra, [[heard], [deaf]], 500.0)
