"""Files that say little or the wrong thing of themselves: honoured, mended with a remark, or refused by the reason."""

from __future__ import annotations

import numpy as np
import pytest
from made_recordings import (
    SENSOR,
    accelerance,
    board,
    hits,
    only,
    refusal,
    uff,
    wav_bytes,
    with_complex_noise,
    write_table,
    write_wav,
)
from scipy.io import wavfile

from bayesplate.recordings.reading import read_recordings
from bayesplate.recordings.signals import Recording
from bayesplate.recordings.sweeps import Sweep, impulse_response, read_sweep, require_sweep, sweep_band
from bayesplate.recordings.taking import take_spectra

RATE = 6000
FORCE, HEARD = hits(np.random.default_rng(31), [0.2], (0.03, 0.02), rate=float(RATE), seconds=1.8, decibels=60.0)
TIMES = np.arange(HEARD.size) / RATE
GAP = np.delete(np.arange(HEARD.size), 3000)
TIME = {"kind": 1, "x": TIMES, "y": HEARD, "even": False}
HERTZ = np.arange(0.0, 400.0, 0.5)
ACCELERANCE = accelerance(HERTZ, (0.03, 0.02))
RESPONSE = {"kind": 4, "x": HERTZ, "y": ACCELERANCE}


def test_times_of_six_digits_give_the_rate_of_the_whole_span(tmp_path):
    """From 10 s on a step of the digits is not shorter than one of the samples."""
    for begin in (-0.4, 12.0):
        one = only(tmp_path / "a.uff", uff([TIME | {"x": TIMES / 3.0 + begin}]))
        assert one.rate == pytest.approx(3.0 * RATE, rel=2e-4), begin


REFUSED = [
    (RESPONSE | {"unit": "rpm"}, 'wanted an abscissa in hz, khz, rad/s, rad/sec, got "rpm"'),
    (RESPONSE | {"top": 3}, "wanted a force or displacement, velocity, acceleration, pressure, got kind of data 3"),
    (RESPONSE | {"x": HERTZ[:50], "y": ACCELERANCE[:50]}, "a.uff set 1 frequencies: wanted a hundred evenly spaced"),
    (RESPONSE | {"top": 0, "top_unit": "rpm"}, "a.uff set 1: wanted a unit among n, kn, lbf, m/s2"),
    (RESPONSE | {"under": 12}, "wanted a motion over a force, got acceleration over acceleration"),
    (RESPONSE | {"top": 13}, "wanted a motion over a force, got a force over a force"),
    (RESPONSE | {"y": np.abs(ACCELERANCE)}, "wanted a response with its phase, got one that answers before"),
    (TIME | {"x": TIMES[GAP], "y": HEARD[GAP]}, "a.uff set 1 time: wanted evenly spaced samples, got uneven ones"),
]


def test_a_data_set_that_cannot_be_honoured_is_refused(tmp_path):
    path = tmp_path / "a.uff"
    for one, said in REFUSED:
        assert said in refusal(lambda one=one: take_spectra([[only(path, uff([one]))]], 400.0))
    content = uff([TIME])
    cut_off = refusal(only, path, content[: len(content) // 2])
    assert cut_off.startswith("a.uff: wanted data sets ")
    assert "got no set that is whole (was it cut" in cut_off


def test_a_response_is_of_the_unit_and_the_kind_that_its_header_states(tmp_path):
    for unit, factor in (("", 1.0), ("rad/s", 2.0 * np.pi)):
        one = only(tmp_path / "a.uff", uff([RESPONSE | {"x": HERTZ * factor, "unit": unit}]))
        np.testing.assert_allclose(one.frequency, HERTZ, rtol=1e-5, err_msg=unit)
    mass = RESPONSE | {"x": HERTZ[1:], "y": 1.0 / ACCELERANCE[1:], "top": 13, "under": 11}
    turned = only(tmp_path / "a.uff", uff([mass]))

    np.testing.assert_allclose(turned.values, ACCELERANCE[1:], rtol=1e-6)
    assert turned.motion == "velocity"
    assert turned.remarks == ("a.uff set 1: a force over velocity, turned over",)


def test_a_force_is_told_by_its_kind_or_its_unit(tmp_path):
    for top in ({"top": 13}, {"top": 9}, {"top": 0, "top_unit": "N"}):
        sets = [{"kind": 1, "x": TIMES, "y": FORCE} | top, {"kind": 1, "x": TIMES, "y": HEARD, "top": 11}]
        one = only(tmp_path / "a.ufb", uff(sets))

        np.testing.assert_allclose(one.force, FORCE, rtol=1e-9, err_msg=str(top))
        assert one.motion == "velocity"


def test_the_unit_of_an_ordinate_of_unknown_kind_tells_its_quantity(tmp_path):
    """Volts, and no unit, tell none: it is as said."""
    for unit, motion in (("um", "displacement"), ("(m/s)/N", "velocity"), ("V", "pressure"), ("", "pressure")):
        one = only(tmp_path / "a.uff", uff([RESPONSE | {"top": 0, "top_unit": unit}]), motion="pressure")
        assert one.motion == motion, unit


@pytest.mark.parametrize("order", ["frfr", "rfrf", "frr", "rrf"])
def test_a_force_is_that_of_the_responses_beside_it_whichever_comes_first(order, tmp_path):
    """The second force, and what it answers, are half as loud; a file's only force is that of all."""
    halves = (FORCE, HEARD), (FORCE / 2.0, HEARD / 2.0)
    sets = []
    for k, kind in enumerate(order):
        force, heard = halves[order[:k].count(kind)]
        top = {"f": {"y": force, "top": 13}, "r": {"y": heard, "top": 11}}[kind]
        sets.append({"kind": 1, "x": TIMES} | top)
    (tmp_path / "a.uff").write_bytes(uff(sets))
    ((first, second),) = read_recordings([tmp_path / "a.uff"])

    np.testing.assert_allclose(first.force, FORCE, rtol=1e-9)
    np.testing.assert_allclose(second.force, FORCE / (2.0 if order.count("f") == 2 else 1.0), rtol=1e-9)
    np.testing.assert_allclose(second.response, HEARD / 2.0, rtol=1e-9)


def test_a_rate_that_the_file_contradicts_is_refused(tmp_path):
    said = refusal(lambda: only(tmp_path / "a.uff", uff([TIME]), rate=44100.0))
    assert said.startswith("a.uff set 1 rate: wanted 44100 Hz, as --rate says, got 6000")


def test_of_the_sets_of_a_file_unknown_and_silent_ones_and_copies_are_left_out(tmp_path):
    """Analysers put a set 1858 behind each 58, which the library does not know."""
    sets = uff([RESPONSE | {"y": y} for y in (ACCELERANCE, 0.0 * ACCELERANCE, ACCELERANCE)])
    one = only(tmp_path / "a.uff", sets + b"    -1\n  1858\n         1         0\nNONE\n    -1\n")

    assert one.name == "a.uff set 1"
    assert one.remarks == (
        "a.uff set 2 is silent and left out", "a.uff set 3 holds the same as a.uff set 1 and is left out",
    )  # fmt: skip


NO_PHASE = {
    "magnitude": np.abs(ACCELERANCE) + 0j,
    "decibels and degrees": 20.0 * np.log10(np.abs(ACCELERANCE) + 1e-6) + 1j * np.degrees(np.angle(ACCELERANCE)),
    "the other sign": ACCELERANCE.conj(),
}


def test_a_response_follows_its_force_whatever_its_motion_and_polarity_or_is_refused(tmp_path):
    """Lines from 20 Hz on, with noise, of any motion and polarity are the negative control."""
    for name, values in NO_PHASE.items():
        path = write_table(tmp_path / f"{name}.csv", f_hz=HERTZ, re=values.real, im=values.imag)
        said = f"{name}.csv: wanted a response with its phase, got one that answers before"
        assert said in refusal(take_spectra, [[only(path)]], 400.0)
    for motion in (-1.0, 1j):
        values = with_complex_noise(np.random.default_rng(1), motion * ACCELERANCE, 3e-3)[40:]
        path = write_table(tmp_path / "a.csv", f_hz=HERTZ[40:], re=values.real, im=values.imag)
        assert take_spectra([[only(path)]], 400.0).remarks == (), motion


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


def test_a_header_that_lies_is_read_as_far_as_it_goes_with_a_remark_and_a_right_one_without(tmp_path):
    for name, (content, n_samples) in LYING.items():
        one = only(tmp_path / "a.wav", content)

        assert one.response.size == n_samples, name
        stored = 0.8 * HEARD[:n_samples] / np.abs(HEARD).max()
        np.testing.assert_allclose(one.response, stored, atol=2.0**-15, err_msg=name)
        (told,) = one.remarks
        assert told.startswith("a.wav: its header states "), name
    for more in (b"", b"LIST" + (4).to_bytes(4, "little") + b"INFO"):
        one = only(tmp_path / "a.wav", wav(HEARD) + more)
        assert (one.response.size, one.remarks) == (HEARD.size, ()), more


STEREO = [
    ("force,response", HEARD, -0.3 * HEARD, "both channels hold the same sound, and one is used"),
    ("response,response", HEARD, 0.0 * HEARD, "channel 2 is silent and left out"),
    ("force,response", 0.0 * HEARD, HEARD, "channel 1 is silent and left out"),
    ("force,response", HEARD, 4e-4 * HEARD[::-1], "channel 2 is silent and left out"),
]


def test_of_a_stereo_file_with_one_sound_that_is_taken(tmp_path):
    """A copy is softer, with the other sign; crosstalk into a channel to which nothing is connected is silence."""
    for channels, first, second, said in STEREO:
        columns = np.stack([first, second], axis=1) / np.abs(HEARD).max()
        wavfile.write(tmp_path / "a.wav", RATE, np.round(2.0**30 * columns).astype(np.int32))
        one = only(tmp_path / "a.wav", channels=channels)

        assert one.remarks == (f"a.wav: {said}",)
        assert one.force is None
        assert abs(np.corrcoef(one.response, HEARD)[0, 1]) > 0.9999


def test_a_channel_of_noise_beside_a_response_is_left_out(tmp_path):
    """An input to which nothing is connected."""
    noise = 2e-3 * np.random.default_rng(4).standard_normal(HEARD.size) * np.abs(HEARD).max()
    columns = np.stack([HEARD, noise], axis=1)
    wavfile.write(tmp_path / "a b.wav", RATE, np.round(2.0**14 * columns / np.abs(HEARD).max()).astype(np.int16))

    taken = take_spectra(read_recordings([tmp_path / "a b.wav"], channels="response,response"), 400.0)

    assert taken.spectra.n_records == 1
    assert taken.remarks == ("a b.wav channel 2 left out: no hit stands out of its noise (is it connected?)",)


def test_a_number_takes_one_channel_of_many(tmp_path):
    path = write_wav(tmp_path / "a.wav", RATE, FORCE, HEARD[::-1], HEARD)

    assert np.corrcoef(only(path, channels="3").response, HEARD)[0, 1] > 0.9999
    said = "a.wav channels: wanted channel 4, as --channels says, got 3 channels"
    assert said in refusal(only, path, channels="4")


def test_a_force_in_the_place_of_a_response_is_set_aside_or_refused_where_nothing_else_is():
    """As measured, and nothing but its pulse."""
    heard = Recording("heard", float(RATE), HEARD)
    for signal in (FORCE, np.where(np.abs(FORCE) > 0.05 * np.abs(FORCE).max(), FORCE, 0.0)):
        struck = Recording("force", float(RATE), signal)
        taken = take_spectra([[struck], [heard]], 400.0)

        assert taken.spectra.file_names == ("heard",)
        assert taken.remarks == ("force left out: it is silent after its pulse: is it the force?",)
        said = "force: wanted a response, which rings, got it is silent after its pulse"
        assert said in refusal(take_spectra, [[struck]], 400.0)


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


def test_a_sweep_that_was_not_played_is_refused():
    """Other frequencies, another time, and a linear sweep; the sweep itself is the control."""
    played = SWEPT.signal(3000.0)
    heard = swept(played)
    impulse_response(heard, played, 700.0)
    times = np.arange(played.size) / 3000.0
    linear = np.sin(2.0 * np.pi * (25.0 * times + 0.5 * 875.0 / 3.0 * times**2))
    cases = [(swept(linear), played)]
    for other in ({"first": 40.0}, {"last": 1400.0}, {"duration": 6.0}):
        cases.append((heard, SWEPT._replace(**other).signal(3000.0)))

    said = "s.wav: wanted the response to this sweep, got no impulse when it is turned back"
    assert [said in refusal(impulse_response, *case, 700.0) for case in cases] == [True] * 4


def test_only_what_was_played_is_taken_for_the_sweep():
    """Faded, silence around it, and turned down by 6 dB an octave; not what a board made of it, nor a tap or hiss."""
    played, rng = SWEPT.signal(3000.0), np.random.default_rng(1)
    fade = np.minimum(1.0, np.arange(played.size) / 600.0)
    quiet = 1e-3 * rng.standard_normal(4000)
    for sweep in (played, played * fade * fade[::-1], np.concatenate([quiet, played, quiet]), np.cumsum(played)):
        require_sweep(Recording("s.wav", 3000.0, sweep))

    for other in (swept(played).response, swept(played, 0.0).response):
        assert "its level goes up and down by " in refusal(require_sweep, Recording("s.wav", 3000.0, other))
    for other in (swept(np.eye(1, 9000, 900)[0]).response, rng.standard_normal(9000), played[::-1], played[:1500]):
        assert "its frequency does not rise" in refusal(require_sweep, Recording("s.wav", 3000.0, other))


def test_a_sweep_that_hardly_raises_high_modes_is_known_in_noise():
    """A sensor of displacement: the low modes alone are loud, and highest together only after they set in."""
    sweep = Sweep(45.0, 1400.0, 3.0).signal(3000.0)
    displacement = np.cumsum(swept(sweep, 0.0).response)
    for noise in (1e-3, 0.05):
        level = noise * np.abs(displacement).max()
        heard = displacement + level * np.random.default_rng(7).standard_normal(displacement.size)

        response, hit = impulse_response(Recording("s.wav", 3000.0, heard), sweep, 300.0)

        assert np.sum(response.response[: hit.onset] ** 2) < 0.1 * np.sum(response.response**2), noise


def test_nothing_is_looked_for_where_a_sweep_did_not_go():
    first, last = sweep_band(Sweep(45.0, 600.0, 3.0).signal(3000.0), 3000.0)

    assert 42.0 < first < 48.0
    assert 560.0 < last < 600.0


def test_a_sweep_that_fits_into_no_memory_is_refused():
    said = "sweep: wanted two rising frequencies in Hz and a time in s, up to 600, got"
    assert said in refusal(read_sweep, "20,2000,1e9")
