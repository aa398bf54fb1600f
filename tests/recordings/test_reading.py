"""Files of recordings: what each kind holds, and every fault of every file at once."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from made_recordings import only, refusal, write_table, write_wav
from scipy.io import wavfile

from bayesplate.errors import InputError
from bayesplate.recordings.checks import clipped_samples
from bayesplate.recordings.reading import read_recordings
from bayesplate.recordings.signals import FrequencyResponse

RATE = 8000
TIMES = np.arange(RATE) / RATE
RING = np.exp(-3.0 * TIMES) * np.sin(2.0 * np.pi * 210.0 * TIMES)


def test_every_kind_of_sample_gives_the_same_numbers(tmp_path):
    import soundfile

    values = 0.5 * RING
    stored = {
        "8 bits": (np.round(128.0 * values + 128.0).astype(np.uint8), 2.0**-7),
        "16 bits": (np.round(2.0**15 * values).astype(np.int16), 2.0**-15),
        "32 bits": (np.round(2.0**31 * values).astype(np.int32), 2.0**-31),
        "single precision": (values.astype(np.float32), 2.0**-24),
    }
    for kind, (samples, step) in stored.items():
        wavfile.write(tmp_path / "a.wav", RATE, samples)
        one = only(tmp_path / "a.wav")
        assert one.rate == RATE
        np.testing.assert_allclose(one.response, values, atol=0.51 * step + 1e-15, err_msg=kind)
    soundfile.write(tmp_path / "a.flac", values, RATE, subtype="PCM_24")
    np.testing.assert_allclose(only(tmp_path / "a.flac").response, values, atol=2.0**-22)


def test_two_channels_are_force_and_response_or_what_is_said(tmp_path):
    path = write_wav(tmp_path / "a.wav", RATE, RING, np.cos(TIMES))

    one, other = only(path), only(path, channels="response,force")
    ((first, second),) = read_recordings([path], channels="response,response")

    np.testing.assert_array_equal(one.force, other.response)
    np.testing.assert_array_equal(one.response, second.response)
    assert first.force is None


def test_a_missing_sample_is_noticed_and_rounded_times_are_not(tmp_path):
    """Times of a rate of 48 kHz, rounded to 10 us: steps are 20 or 30; without one sample one of them is 40."""
    times = np.round(np.arange(24_000) / 48000.0, 5)
    signal = RING[np.arange(24_000) % RING.size]
    whole = write_table(tmp_path / "whole.csv", time=times, acceleration=signal)
    gap = write_table(tmp_path / "gap.csv", time=np.delete(times, 12_000), acceleration=np.delete(signal, 12_000))

    assert only(whole).rate == pytest.approx(48000.0, rel=1e-3)
    assert "gap.csv time: wanted evenly spaced samples, got uneven ones" in refusal(only, gap)


def test_a_table_names_its_columns_and_may_hold_the_time(tmp_path):
    first = write_table(tmp_path / "a.csv", time=TIMES, Force=RING, acceleration=np.cos(TIMES))
    second = write_table(tmp_path / "b.csv", force=RING, velocity=np.cos(TIMES))
    second.write_text(f"# a rig\n{second.read_text()}")

    one, other = only(first), only(second, rate=4000.0)

    assert one.rate == pytest.approx(RATE, rel=1e-6)
    np.testing.assert_allclose(one.force, RING, atol=1e-9)
    assert (one.motion, other.motion, other.rate) == ("acceleration", "velocity", 4000.0)


def test_a_comment_may_be_of_another_encoding_and_a_quantity_stands_once(tmp_path):
    path = write_table(tmp_path / "a.csv", sound=RING, time=TIMES)
    path.write_bytes("# für Platte 3, 23 °C\n".encode("latin-1") + path.read_bytes())
    np.testing.assert_allclose(only(path).response, RING, atol=1e-9)

    twice = write_table(tmp_path / "b.csv", t=TIMES, sound=RING, pressure=RING, time=TIMES)
    said = refusal(only, twice)
    assert 'b.csv line 1: wanted each quantity once, got "pressure" again' in said
    assert 'got "time" again' in said


def test_a_frequency_response_is_read_and_its_coherence_is_not_needed(tmp_path):
    hertz = np.arange(200) * 0.5
    path = write_table(tmp_path / "a.csv", f_hz=hertz, re=hertz**2, im=-hertz, coherence=np.full(200, 0.9))
    path.write_text(f"# own estimate\n{path.read_text()}")

    one = only(path)

    assert isinstance(one, FrequencyResponse)
    np.testing.assert_allclose(one.values, hertz**2 - 1j * hertz)


SPOILT = {
    "not finite": np.where(np.arange(RATE) == 100, np.nan, 0.5 * RING),
    "silent": 0.0 * RING,
    "short": 0.5 * RING[:800],
    "clipped": np.clip(0.5 * RING, -0.3, 0.3),
    "quiet": np.round(50.0 * RING) / 2.0**15,
}
"""Signals with one thing wrong."""
FAULTS = {
    "not finite": "not finite.wav: wanted finite numbers, got sample 101 is none",
    "silent": "silent.wav: wanted a sound, got silence (is the right channel connected?)",
    "short": "short.wav: wanted 0.25 s or more, got 0.1 s (let the board ring out)",
    "clipped": "clipped.wav: wanted a signal that is not clipped, got",
    "quiet": "quiet.wav: wanted a signal that is more than rounding, got -56 dB of what the file can hold (too quiet",
}


@pytest.mark.parametrize("channels", ["force,response", "response,response"])
def test_a_file_of_two_channels_without_samples_is_refused(tmp_path, channels):
    """Without a warning, which is an error in tests."""
    wavfile.write(tmp_path / "unheard.wav", RATE, np.zeros((0, 2), np.int16))

    with pytest.raises(InputError, match="wanted samples, got none"):
        read_recordings([tmp_path / "unheard.wav"], channels=channels)


def test_every_fault_of_every_file_is_told_at_once(tmp_path):
    for name, signal in SPOILT.items():
        stored = np.round(2.0**15 * signal).astype(np.int16) if name == "quiet" else signal
        wavfile.write(tmp_path / f"{name}.wav", RATE, stored)
    (tmp_path / "empty.wav").write_bytes(b"")
    (tmp_path / "noise.wav").write_bytes(b"RIFFnonsense")
    (tmp_path / "text.doc").write_text("hit")
    (tmp_path / "memo.m4a").write_bytes(b"\0\0\0\x18ftypM4A ")
    (tmp_path / "taps").mkdir()
    write_wav(tmp_path / "three.wav", RATE, RING, RING, RING)
    (tmp_path / "unnamed.csv").write_text("1,2\n3,4\n")
    (tmp_path / "comma.csv").write_text("force;acceleration\n0,5;0,7\n")
    (tmp_path / "typo.csv").write_text("force,accelleration\n1,2\n")
    (tmp_path / "rate.csv").write_text("acceleration\n" + "0.1\n0.2\n" * 9000)
    (tmp_path / "words.csv").write_text("acceleration\nloud\n")
    (tmp_path / "short.csv").write_text("# a hit\nforce,acceleration\n1,2\n3\n")
    said = [
        *FAULTS.values(),
        "empty.wav: wanted a recording, got an empty file",
        "noise.wav: wanted a WAV file, got",
        'text.doc: wanted a recording: .wav, .csv, .flac, .uff, .unv, .ufb, got ".doc"',
        'memo.m4a: wanted a recording: .wav, .csv, .flac, .uff, .unv, .ufb, got compressed sound, ".m4a" (record as',
        "taps: wanted a recording, got a folder (give the files in it: taps/*.wav)",
        "three.wav channels: wanted one channel, or two: force and response, got 3",
        "unnamed.csv line 1: wanted named columns",
        "comma.csv line 1: wanted commas between columns, got semicolons or tabs",
        "typo.csv line 1: wanted columns among time, time_s, t, force, response, sound, acceleration",
        "rate.csv rate: wanted a column time, or --rate, got neither (--rate 48000)",
        'words.csv line 2: wanted 1 number on each line, got "loud" (mend or cut that line)',
        'short.csv line 4: wanted 2 numbers on each line, got "3" (mend or cut that line)',
        "gone.wav: wanted a recording, got no such file",
    ]
    names = [f"{name}.wav" for name in FAULTS] + [line.partition(":")[0].split()[0] for line in said[len(FAULTS) :]]

    with pytest.raises(InputError) as caught:
        read_recordings([tmp_path / name for name in names])

    message = str(caught.value)
    assert [line for line in said if line not in message] == []
    assert len(caught.value.faults) == len(said)


def test_a_recording_that_is_given_twice_is_refused_with_both_names(tmp_path):
    """The same file, and its samples in a file of another kind; another hit is another recording."""
    path = write_wav(tmp_path / "a.wav", RATE, RING)
    samples = only(path).response
    np.savetxt(tmp_path / "b.csv", samples, "%.17g", header="acceleration", comments="")
    write_wav(tmp_path / "c.wav", RATE, RING[::-1])

    said = refusal(read_recordings, [path, tmp_path / "b.csv", tmp_path / "c.wav"], rate=float(RATE))

    assert said.startswith("a.wav and b.csv: wanted each recording once, got the same samples again")
    assert "\n" not in said


def test_another_rate_than_said_and_two_gigabytes_are_refused(tmp_path):
    """The large file has a hole: it takes no room on the disk, and would take it all in memory."""
    path = write_wav(tmp_path / "a.wav", RATE, RING)

    assert "a.wav rate: wanted 44100 Hz, as --rate says, got 8000 Hz" in refusal(only, path, rate=44100.0)
    with path.open("r+b") as file:
        file.truncate(2_000_000_000)
    assert "a.wav: wanted at most 400 MB, got 2,000 MB" in refusal(only, path)


def test_only_a_wave_that_is_cut_off_is_clipped():
    """One sample at the top, a plateau that is none, and the tip of a slow wave that rounding flattens are not.

    The tip is narrower than one of so many steps for up to a dozen samples.
    """
    assert clipped_samples(np.round(100.0 * RING) / 100.0, np.inf) == 0
    assert clipped_samples(np.array([0.0, 1.0, 0.0, -1.0] * 50), 1.0) == 0
    assert clipped_samples(np.clip(RING, -0.6, 0.6), np.inf) > 20
    slow = np.exp(-3.0 * TIMES) * np.sin(2.0 * np.pi * 45.0 * TIMES)
    for height in (60.0, 32767.0):
        assert clipped_samples(np.round(height * slow) / 2.0**15, 1.0) == 0, height
        assert clipped_samples(np.round(height * np.clip(slow, -0.6, 0.6)) / 2.0**15, 1.0) > 20, height


def test_what_a_loudspeaker_was_given_may_be_at_its_top_and_quiet(tmp_path):
    for name in ("clipped", "quiet"):
        wavfile.write(tmp_path / f"{name}.wav", RATE, np.round(2.0**15 * SPOILT[name]).astype(np.int16))
        assert "turn the gain" in refusal(only, tmp_path / f"{name}.wav"), name
        assert refusal(only, tmp_path / f"{name}.wav", was_played=True) == ""


def test_the_extra_is_named_where_it_is_missing(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyuff", None)

    with pytest.raises(InputError, match=r'wanted pyuff installed.*pip install "bayesplate\[recordings\]"'):
        only(tmp_path / "a.uff", b"    -1")


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_uff_is_read_in_time_and_frequency(tmp_path):
    """Binary data sets, 58b; the library leaves the files open that it writes."""
    import pyuff

    hertz = np.arange(200) * 0.5
    common = {"rsp_node": 1, "rsp_dir": 3, "ref_node": 1, "ref_dir": 3, "binary": 1, "return_full_dict": True}
    common |= {"abscissa_spacing": 1, "ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13}
    sets = {
        "time": pyuff.prepare_58(**common, func_type=1, data=RING, x=TIMES, abscissa_spec_data_type=17),
        "frequency": pyuff.prepare_58(**common, func_type=4, data=hertz + 1j, x=hertz, abscissa_spec_data_type=18),
    }
    for name, content in sets.items():
        texts = {key for key in content if key.startswith("id") or key.endswith(("_name", "_lab"))}
        whole = {key: ("" if key in texts else 0) if value is None else value for key, value in content.items()}
        pyuff.UFF(str(tmp_path / f"{name}.uff")).write_sets(whole, "add")

    heard, response = only(tmp_path / "time.uff"), only(tmp_path / "frequency.uff")

    np.testing.assert_allclose(heard.response, RING, atol=1e-6)
    assert heard.rate == pytest.approx(RATE, rel=1e-5)
    np.testing.assert_allclose(response.values, hertz + 1j, atol=1e-6)
