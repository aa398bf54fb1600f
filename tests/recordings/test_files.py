"""Files that say little or the wrong thing of themselves: honoured, mended with a remark, or refused by the reason."""

from __future__ import annotations

import re

import numpy as np
import pytest
from made_recordings import SENSOR, accelerance, board, hits, uff, wav_bytes, write_wav
from scipy.io import wavfile

from bayesplate.errors import InputError
from bayesplate.recordings.reading import read_recordings
from bayesplate.recordings.signals import Read, Recording
from bayesplate.recordings.sweeps import Sweep, band_of, impulse_response, read_sweep
from bayesplate.recordings.taking import take

RATE = 6000
FORCE, HEARD = hits(np.random.default_rng(31), [0.2], (0.03, 0.02), rate=float(RATE), seconds=1.8, decibels=60.0)
HERTZ = np.arange(0.0, 400.0, 0.5)
ACCELERANCE = accelerance(HERTZ, (0.03, 0.02))


def read(path, content: bytes | None = None, **options) -> list[Read]:
    """What a file holds."""
    if content is not None:
        path.write_bytes(content)
    (found,) = read_recordings([path], **options)
    return found


TIMES = np.arange(HEARD.size) / RATE
TIME = {"kind": 1, "y": HEARD, "even": False}


@pytest.mark.parametrize("begin", [-0.4, 12.0])
def test_times_of_six_digits_give_the_rate_of_the_whole_span(tmp_path, begin):
    """From 10 s on a step of the digits is not shorter than one of the samples."""
    (one,) = read(tmp_path / "a.uff", uff([TIME | {"x": TIMES / 3.0 + begin}]))

    assert one.rate == pytest.approx(3.0 * RATE, rel=2e-4)


def test_sets_of_other_kinds_are_passed_over(tmp_path):
    """Analysers put a set 1858 behind each 58, which the library does not know."""
    content = uff([TIME | {"x": TIMES}]) + b"    -1\n  1858\n         1         0\nNONE\n    -1\n"
    (one,) = read(tmp_path / "a.uff", content)

    assert one.response.size == HEARD.size


def test_a_file_that_was_cut_off_in_its_only_set_says_so(tmp_path):
    content = uff([TIME | {"x": TIMES}])

    with pytest.raises(InputError, match=r"a\.uff: wanted data sets .*, got no set that is whole \(was it cut"):
        read(tmp_path / "a.uff", content[: len(content) // 2])


def test_times_with_a_gap_are_refused(tmp_path):
    kept = np.delete(np.arange(HEARD.size), 3000)

    with pytest.raises(InputError, match=r"a\.uff set 1 time: wanted evenly spaced samples, got uneven ones"):
        read(tmp_path / "a.uff", uff([TIME | {"x": TIMES[kept], "y": HEARD[kept]}]))


@pytest.mark.parametrize(("unit", "factor"), [("", 1.0), ("rad/s", 2.0 * np.pi)])
def test_frequencies_are_in_the_unit_of_the_header(tmp_path, unit, factor):
    (one,) = read(tmp_path / "a.uff", uff([{"kind": 4, "x": HERTZ * factor, "y": ACCELERANCE, "unit": unit}]))

    np.testing.assert_allclose(one.frequency, HERTZ, rtol=1e-5)


REFUSED = [
    ({"unit": "rpm"}, 'wanted an abscissa in hz, khz, rad/s, rad/sec, got "rpm"'),
    ({"top": 3}, "wanted a force or displacement, velocity, acceleration, pressure, got kind of data 3"),
    ({"under": 12}, "wanted a motion over a force, got acceleration over acceleration"),
    ({"top": 13}, "wanted a motion over a force, got a force over a force"),
    ({"y": np.abs(ACCELERANCE)}, "wanted a response with its phase, got one"),
]


def test_a_header_that_cannot_be_honoured_is_refused(tmp_path):
    for changed, said in REFUSED:
        with pytest.raises(InputError, match=re.escape(said)):
            take([read(tmp_path / "a.uff", uff([{"kind": 4, "x": HERTZ, "y": ACCELERANCE} | changed]))], 400.0)


def test_a_force_over_a_motion_is_turned_over(tmp_path):
    mass = {"kind": 4, "x": HERTZ[1:], "y": 1.0 / ACCELERANCE[1:], "top": 13, "under": 12}
    (one,) = read(tmp_path / "a.uff", uff([mass]))

    np.testing.assert_allclose(one.values, ACCELERANCE[1:], rtol=1e-6)
    assert (one.motion, one.remarks) == ("acceleration", ("a.uff set 1: a force over acceleration, turned over",))


def test_a_force_is_told_by_its_kind_or_its_unit(tmp_path):
    for top in ({"top": 13}, {"top": 9}, {"top": 0, "top_unit": "N"}):
        sets = [{"kind": 1, "x": TIMES, "y": FORCE} | top, {"kind": 1, "x": TIMES, "y": HEARD, "top": 11}]
        (one,) = read(tmp_path / "a.ufb", uff(sets))

        np.testing.assert_allclose(one.force, FORCE, rtol=1e-9)
        assert one.motion == "velocity"


NO_PHASE = {
    "magnitude": (np.abs, lambda y: 0.0 * y.real),
    "decibels and degrees": (lambda y: 20.0 * np.log10(np.abs(y) + 1e-6), lambda y: np.degrees(np.angle(y))),
    "the other sign": (np.real, lambda y: -y.imag),
}


@pytest.mark.parametrize("name", NO_PHASE)
def test_a_response_that_does_not_follow_its_force_is_refused(tmp_path, name):
    real, imaginary = NO_PHASE[name]
    rows = np.column_stack([HERTZ, real(ACCELERANCE), imaginary(ACCELERANCE)])
    np.savetxt(tmp_path / "a.csv", rows, "%.9g", ",", header="f_hz,re,im", comments="")

    with pytest.raises(InputError, match=r"a\.csv: wanted a response with its phase, got one that answers before"):
        take([read(tmp_path / "a.csv")], 400.0)


@pytest.mark.parametrize("motion", [-1.0, 1j])
def test_a_response_of_any_motion_and_polarity_follows_its_force(tmp_path, motion):
    """The negative control, lines from 20 Hz on, with noise."""
    noise = 3e-3 * np.random.default_rng(1).standard_normal((2, HERTZ.size)) * np.abs(ACCELERANCE).max()
    values = motion * ACCELERANCE + noise[0] + 1j * noise[1]
    rows = np.column_stack([HERTZ, values.real, values.imag])[40:]
    np.savetxt(tmp_path / "a.csv", rows, "%.9g", ",", header="f_hz,re,im", comments="")

    assert take([read(tmp_path / "a.csv")], 400.0).remarks == ()


def wav(signal: np.ndarray, bits: int = 16) -> bytes:
    """A WAV file of one channel by hand: 44 bytes, then the samples."""
    samples = np.round(0.8 * signal / np.abs(signal).max() * 2.0 ** (bits - 1)).astype("<i4").view(np.uint8)
    data = samples.reshape(-1, 4)[:, : bits // 8].tobytes()
    return wav_bytes(1, 1, RATE, bits // 8, bits, data, len(data))


def sized(content: bytes, n_bytes: int) -> bytes:
    """The same with another number of bytes of samples in its header."""
    return content[:40] + n_bytes.to_bytes(4, "little") + content[44:]


N_BYTES = 2 * HEARD.size
LYING = {
    "none stated, sizes of the whole neither": (b"RIFF" + bytes(4) + sized(wav(HEARD), 0)[8:], HEARD.size),
    "twice as many stated": (sized(wav(HEARD), 2 * N_BYTES), HEARD.size),
    "the most that can be stated": (sized(wav(HEARD), 0xFFFFFFFF), HEARD.size),
    "a byte too many": (sized(wav(HEARD) + b"\1", N_BYTES + 1), HEARD.size),
    "cut within a sample of 24 bits": (wav(HEARD, 24)[: 44 + 3 * 9000 + 2], 9000),
}


@pytest.mark.parametrize("name", LYING)
def test_a_header_that_lies_is_read_as_far_as_it_goes_with_a_remark(tmp_path, name):
    content, n_samples = LYING[name]
    (one,) = read(tmp_path / "a.wav", content)

    assert one.response.size == n_samples
    np.testing.assert_allclose(one.response, 0.8 * HEARD[:n_samples] / np.abs(HEARD).max(), atol=2.0**-15)
    (told,) = one.remarks
    assert told.startswith("a.wav: its header states ")


def test_a_header_that_is_right_is_no_cause_for_a_remark(tmp_path):
    for more in (b"", b"LIST" + (4).to_bytes(4, "little") + b"INFO"):
        (one,) = read(tmp_path / "a.wav", wav(HEARD) + more)
        assert (one.response.size, one.remarks) == (HEARD.size, ())


STEREO = {
    "softer in one, with the other sign": (HEARD, -0.3 * HEARD, "both channels hold the same sound, and one is used"),
    "left alone": (HEARD, 0.0 * HEARD, "channel 2 is silent and left out"),
    "right alone": (0.0 * HEARD, HEARD, "channel 1 is silent and left out"),
}


@pytest.mark.parametrize(
    ("name", "channels"), [*zip(STEREO, ["force,response", "response,response", "force,response"], strict=True)]
)
def test_of_a_stereo_file_with_one_sound_that_is_taken(tmp_path, name, channels):
    first, second, said = STEREO[name]
    columns = np.stack([first, second], axis=1) / np.abs(HEARD).max()
    wavfile.write(tmp_path / "a.wav", RATE, np.round(2.0**14 * columns).astype(np.int16))
    (one,) = read(tmp_path / "a.wav", channels=channels)

    assert one.force is None
    assert abs(np.corrcoef(one.response, HEARD)[0, 1]) > 0.9999
    assert one.remarks == (f"a.wav: {said}",)


def test_a_number_takes_one_channel_of_many(tmp_path):
    path = write_wav(tmp_path / "a.wav", RATE, FORCE, HEARD[::-1], HEARD)
    (one,) = read(path, channels="3")

    assert np.corrcoef(one.response, HEARD)[0, 1] > 0.9999
    with pytest.raises(InputError, match=r"a\.wav channels: wanted channel 4, as --channels says, got 3 channels"):
        read(path, channels="4")


def windowed() -> np.ndarray:
    """A force that is nothing but its pulse."""
    return np.where(np.abs(FORCE) > 0.05 * np.abs(FORCE).max(), FORCE, 0.0)


@pytest.mark.parametrize("force", [windowed(), FORCE], ids=["windowed", "as measured"])
def test_a_force_in_the_place_of_a_response_is_set_aside_or_refused_where_nothing_else_is(force):
    struck, heard = Recording("force", float(RATE), force), Recording("heard", float(RATE), HEARD)
    taken = take([[struck], [heard]], 400.0)

    assert taken.spectra.names == ("heard hit 1",)
    assert taken.remarks == ("force left out: it is silent after its pulse: is it the force?",)
    with pytest.raises(InputError, match="force: wanted a response, which rings, got it is silent after its pulse"):
        take([[struck]], 400.0)


def test_compressed_sound_is_refused_by_its_name(tmp_path):
    (tmp_path / "memo.m4a").write_bytes(b"\0\0\0\x18ftypM4A ")

    with pytest.raises(InputError, match=r'memo\.m4a: wanted a recording: .*got compressed sound, "\.m4a" \(record as'):
        read(tmp_path / "memo.m4a")


SWEPT = Sweep(25.0, 900.0, 3.0)


def swept(signal: np.ndarray, noise: float = 1e-3) -> Recording:
    """What a board answers to a signal, with noise over the largest value."""
    rate = 3000.0
    times = np.arange(round(1.5 * rate)) / rate
    poles = 2.0 * np.pi * (-board().hertz * board().damping + 1j * board().damped)
    impulse = board().residues((0.15, 0.19), SENSOR) @ np.imag(np.exp(poles[:, None] * times))
    heard = np.convolve(signal, impulse)
    return Recording(
        "s.wav", rate, heard + noise * np.abs(heard).max() * np.random.default_rng(2).standard_normal(heard.size)
    )


def test_a_sweep_that_was_not_played_is_refused_as_parameters_and_as_a_file():
    heard, other = swept(SWEPT.signal(3000.0)), SWEPT._replace(first=40.0)
    impulse_response(heard, SWEPT.signal(3000.0), 700.0)

    for one in (other, SWEPT._replace(last=1400.0), SWEPT._replace(duration=6.0)):
        with pytest.raises(InputError, match=r"s\.wav: wanted the response to this sweep, got no impulse when it is"):
            impulse_response(heard, one.signal(3000.0), 700.0)


@pytest.mark.parametrize("noise", [1e-3, 0.05])
def test_a_sweep_that_hardly_raises_high_modes_is_known_in_noise(noise):
    """A sensor of displacement: the low modes alone are loud, and highest together only after they set in."""
    sweep = Sweep(45.0, 1400.0, 3.0).signal(3000.0)
    displacement = np.cumsum(swept(sweep, 0.0).response)
    level = noise * np.abs(displacement).max()
    heard = displacement + level * np.random.default_rng(7).standard_normal(displacement.size)

    response, hit = impulse_response(Recording("s.wav", 3000.0, heard), sweep, 300.0)

    assert np.sum(response.response[: hit.onset] ** 2) < 0.1 * np.sum(response.response**2)


def test_nothing_is_looked_for_where_a_sweep_did_not_go():
    first, last = band_of(Sweep(45.0, 600.0, 3.0).signal(3000.0), 3000.0)

    assert 42.0 < first < 48.0
    assert 560.0 < last < 600.0


def test_a_sweep_that_fits_into_no_memory_is_refused():
    with pytest.raises(InputError, match="sweep: wanted two rising frequencies in Hz and a time in s, up to 600, got"):
        read_sweep("20,2000,1e9")


def test_a_linear_sweep_is_no_exponential_one():
    times = np.arange(round(3.0 * 3000.0)) / 3000.0
    linear = np.sin(2.0 * np.pi * (25.0 * times + 0.5 * 875.0 / 3.0 * times**2))

    with pytest.raises(InputError, match="got no impulse when it is turned back"):
        impulse_response(swept(linear), SWEPT.signal(3000.0), 700.0)


def test_a_channel_of_noise_beside_a_response_is_left_out(tmp_path):
    """An input to which nothing is connected."""
    noise = 2e-3 * np.random.default_rng(4).standard_normal(HEARD.size) * np.abs(HEARD).max()
    columns = np.stack([HEARD, noise], axis=1)
    wavfile.write(tmp_path / "a b.wav", RATE, np.round(2.0**14 * columns / np.abs(HEARD).max()).astype(np.int16))

    taken = take([read(tmp_path / "a b.wav", channels="response,response")], 400.0)

    assert len(taken.spectra.names) == 1
    assert taken.remarks == ("a b.wav channel 2 left out: no hit stands out of its noise (is it connected?)",)


def test_crosstalk_into_a_channel_to_which_nothing_is_connected_is_silence(tmp_path):
    columns = np.stack([HEARD, 4e-4 * HEARD[::-1]], axis=1) / np.abs(HEARD).max()
    wavfile.write(tmp_path / "a.wav", RATE, np.round(2.0**30 * columns).astype(np.int32))
    (one,) = read(tmp_path / "a.wav")

    assert one.remarks == ("a.wav: channel 2 is silent and left out",)


def test_of_the_sets_of_a_file_silent_ones_and_copies_are_left_out(tmp_path):
    sets = [{"kind": 4, "x": HERTZ, "y": y} for y in (ACCELERANCE, 0.0 * ACCELERANCE, ACCELERANCE)]
    (one,) = read(tmp_path / "a.uff", uff(sets))

    assert one.name == "a.uff set 1"
    assert one.remarks == (
        "a.uff set 2 is silent and left out", "a.uff set 3 holds the same as a.uff set 1 and is left out",
    )  # fmt: skip
