"""Whatever stands in a recording, it is read or refused: no other error, no hang, no file, little memory."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fuzzing import accepted_or_refused, fuzzed, memory_below, stopped_if_it_hangs
from hypothesis import strategies as st
from made_recordings import only, refusal, uff, wav_bytes

import bayesplate
from bayesplate.errors import InputError
from bayesplate.recordings.reading import read_recordings
from bayesplate.recordings.signals import FrequencyResponse, Recording

RATE = 4000
TIMES = np.arange(1400) / RATE
RING = np.exp(-3.0 * TIMES) * np.sin(2.0 * np.pi * 210.0 * TIMES)
MOST_MEMORY = 30e6
"""Bytes: many times what the largest of these files needs, and a thousandth of what some of them claim to hold."""

OPTIONS = st.fixed_dictionaries(
    {
        "rate": st.sampled_from([None, 4000.0, 44100.0]),
        "channels": st.sampled_from(["force,response", "response,force", "response,response", "1", "2"]),
    }
)


SOUND = np.round(16000.0 * np.stack([RING, np.cos(300.0 * TIMES) * RING], axis=1)).astype("<i2").tobytes()
SOUND_WAV = wav_bytes(1, 2, RATE, 4, 16, SOUND, len(SOUND))
SIZES = st.sampled_from([0, 1, 2, 3, 4, 8, 16, 24, 32, 64, 255, 0x7FFFFFFF, 0xFFFFFFFF, len(SOUND)])
WORDS = [b"RIFF", b"RIFX", b"RF64", b"WAVE", b"fmt ", b"data", b"LIST", b"ds64", b"fact", b"\xff" * 8, b"\0" * 8]


@st.composite
def headers(draw: st.DrawFn) -> bytes:
    """A file whose header says anything."""
    small = st.one_of(st.integers(0, 8), st.sampled_from([255, 65534, 65535]))
    tag = draw(st.sampled_from([0, 1, 2, 3, 6, 7, 85, 65534]))
    bits = draw(st.sampled_from([0, 1, 7, 8, 12, 16, 24, 32, 64, 80, 65535]))
    rate = draw(st.sampled_from([0, 1, RATE, 48000, 0x7FFFFFFF, 0xFFFFFFFF]))
    data = draw(st.sampled_from([b"", SOUND[:1], SOUND[:777], SOUND]))
    return wav_bytes(tag, draw(small), rate, draw(small), bits, data, draw(st.one_of(st.just(len(data)), SIZES)))


@st.composite
def spliced(draw: st.DrawFn, sound: bytes, reach: int) -> bytes:
    """A sound file with some bytes taken out and others put in, mostly near its beginning, and cut off somewhere."""
    found = sound
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.integers(0, min(reach, len(found))))
        put = draw(st.one_of(st.sampled_from(WORDS), st.binary(max_size=6)))
        found = found[:at] + put + found[at + draw(st.integers(0, 12)) :]
    return found[: draw(st.one_of(st.just(len(found)), st.integers(0, len(found))))]


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the files lie; module-wide, since examples outlive a test's own folder."""
    BENCH["folder"] = tmp_path_factory.mktemp("fuzz")
    return BENCH["folder"]


BENCH: dict[str, Path] = {}


def read(name: str, data: bytes, options: dict[str, Any]) -> list[Recording | FrequencyResponse]:
    """What a file with these bytes holds, if it is not refused: finite numbers and a rate."""
    path = BENCH["folder"] / name
    path.write_bytes(data)
    found = accepted_or_refused(lambda: read_recordings([path], **options), BENCH["folder"])
    if isinstance(found, InputError):
        return []
    for one in found[0]:
        if isinstance(one, FrequencyResponse):
            assert np.isfinite(one.frequency).all()
            assert np.isfinite(one.values).all()
        else:
            assert 200.0 <= one.rate <= 1e6
            assert np.isfinite(one.response).all()
            assert one.force is None or (np.isfinite(one.force).all() and one.force.size == one.response.size)
    return found[0]


def read_little(name: str, data: bytes, options: dict[str, Any]) -> None:
    """Bytes that may be a WAV file, or a CSV table."""
    with memory_below(MOST_MEMORY):
        read(name, data, options)


WAVS = st.one_of(st.binary(max_size=120), headers(), spliced(SOUND_WAV, 60), spliced(SOUND_WAV, 6000))
test_wav, test_wav_at_length = fuzzed(read_little, 50, name=st.just("a.wav"), data=WAVS, options=OPTIONS)

NUMBERS = ["0", "1", "-1", "0.5", "1e308", "-1e308", "1e-320", "nan", "inf", "-inf", "1e999", "0x1", "1_0", "١", ""]
NAMES = ["time", "t", "force", "Force", "acceleration", "velocity", "sound", "f_hz", "re", "im", "coherence", "x", ""]
PIECES = [*NUMBERS, *NAMES, ",", ";", "\t", "\n", "\r", "\r\n", "#", '"', "\0", "\x0b", "\x0c", "\x85", "\u2028",
          "\ufeff", "é", "\x1b[31m", "\u202e"]  # fmt: skip


def table(names: list[str], columns: list[np.ndarray], form: str = "{:.6g}") -> str:
    """A CSV table."""
    rows = (",".join(form.format(float(x)) for x in row) for row in zip(*columns, strict=True))
    return "\n".join([",".join(names), *rows, ""])


HERTZ = np.arange(120.0)
SOUND_TABLES = [
    table(["time", "force", "acceleration"], [TIMES, RING, np.cos(300.0 * TIMES) * RING]),
    table(["acceleration"], [RING]),
    table(["f_hz", "re", "im", "coherence"], [HERTZ, HERTZ**2, -HERTZ, np.full(120, 0.9)]),
]


@st.composite
def tables(draw: st.DrawFn) -> bytes:
    """A table with pieces taken out and put in, at its beginning, somewhere, or at its end."""
    text = draw(st.sampled_from(SOUND_TABLES))
    for _ in range(draw(st.integers(1, 3))):
        at = draw(st.one_of(st.integers(0, 60), st.integers(0, len(text)), st.integers(len(text) - 30, len(text))))
        put = "".join(draw(st.lists(st.sampled_from(PIECES), max_size=3)))
        text = text[:at] + put + text[at + draw(st.integers(0, 20)) :]
    return text.encode(draw(st.sampled_from(["utf-8", "utf-8", "utf-8", "utf-16", "latin-1"])), "replace")


TABLES = st.one_of(st.binary(max_size=80), tables())
test_csv, test_csv_at_length = fuzzed(read_little, 50, name=st.just("a.csv"), data=TABLES, options=OPTIONS)


def flac() -> bytes:
    """A short FLAC file."""
    import soundfile

    stream = io.BytesIO()
    soundfile.write(stream, 0.5 * RING, RATE, format="FLAC", subtype="PCM_16")
    return stream.getvalue()


UFF = uff([{"kind": 1, "x": TIMES, "y": RING}])


def read_other_file(ending: str, cut: int, put: list[tuple[int, bytes]], options: dict[str, Any]) -> None:
    """Bytes that may be a file that a library of the extra reads."""
    found = flac() if ending == ".flac" else UFF
    for at, piece in put:
        found = found[:at] + piece + found[at + len(piece) :]
    read(f"a{ending}", found[: len(found) * cut // 100], options)


PUT = st.lists(st.tuples(st.integers(0, 700), st.binary(min_size=1, max_size=6)), max_size=3)
test_extras, test_extras_at_length = fuzzed(
    read_other_file,
    25,
    ending=st.sampled_from([".flac", ".uff", ".unv"]),
    cut=st.sampled_from([0, 1, 10, 50, 90, 100, 100, 100]),
    put=PUT,
    options=OPTIONS,
)


def test_what_is_spoilt_here_was_sound():
    """The negative control: without a change each file is read."""
    for ending, content in [("wav", SOUND_WAV), ("flac", flac()), ("uff", UFF)]:
        assert len(read(f"a.{ending}", content, {})) == 1, ending
    for content in SOUND_TABLES:
        assert len(read("a.csv", content.encode(), {"rate": float(RATE)})) == 1, content[:20]


LINES = "".join(f"{i},1,1\n" for i in range(200))
FOUND = {
    "escapes.csv": (b"\x1b[31mred\n1\n", r'got "\x1b[31mred"'),
    "a column twice.csv": (b"force,acceleration,force\n1,2,3\n", 'wanted each quantity once, got "force" again'),
    "no end.csv": (f"f_hz,re,im\n{LINES}inf,1,1\n".encode(), "a hundred evenly spaced lines or more"),
    "infinite.csv": (f"f_hz,re,im\n{LINES}200,inf,1\n".encode(), "wanted finite numbers, got line 201 is none"),
    "huge.csv": (b"acceleration\n" + b"1e300\n-1e300\n" * 999, "wanted numbers up to 1e+100, got larger ones"),
    "two times.uff": (UFF.replace(b"  2.50000e-04", b"  0.00000e+00"), "wanted times in s that rise"),
}
"""What was once another error, or a warning of a library, or was taken for something else."""


def test_what_was_found_is_refused_with_its_reason(tmp_path):
    for name, (content, said) in FOUND.items():
        assert said in refusal(only, tmp_path / name, content, rate=float(RATE)), name


CLICK = np.eye(1, 3000, 5)[0]
RAMP = np.arange(3000.0)
HUGE_CLICK = 1e99 * np.eye(1, 3000, 1500)[0] + 1e-3 * np.sin(np.arange(3000.0))
ODD = {
    "a click": {"acceleration": CLICK},
    "a ramp": {"acceleration": RAMP},
    "noise of the last digit": {"acceleration": np.ones(3000) + 1e-12 * np.random.default_rng(1).standard_normal(3000)},
    "a huge click": {"acceleration": HUGE_CLICK},
    "a breath": {"acceleration": 1e-90 * np.sin(np.arange(3000.0))},
    "a ramp after a click": {"acceleration": RAMP, "force": CLICK},
    "a huge click after a click": {"acceleration": HUGE_CLICK, "force": CLICK},
}
"""Recordings that are read and hold no board."""


@pytest.mark.parametrize("name", ODD)
def test_what_is_no_board_is_picked_or_refused(tmp_path, name):
    """With a force and without: modes, none, or a reason."""
    columns = ODD[name]
    (tmp_path / "a.csv").write_text(table([*columns], [*columns.values()], "{!r}"))

    accepted_or_refused(lambda: bayesplate.pick([tmp_path / "a.csv"], rate=2000.0, highest=300.0), tmp_path)


def test_a_response_with_next_to_no_lines_in_the_band_is_refused(tmp_path):
    for step, got in ((0.001, "got 0"), (100.0, "got 3")):
        hertz = np.arange(1600) * step
        values = 1.0 / (60.0**2 - hertz**2 + 2j * hertz)
        (tmp_path / "a.csv").write_text(table(["f_hz", "re", "im"], [hertz, values.real, values.imag]))
        said = refusal(bayesplate.pick, [tmp_path / "a.csv"], lowest=20.0, highest=310.0)
        assert f"a.csv between 20 and 310 Hz: wanted 5 lines or more, {got}" in said


def test_a_line_that_only_python_ends_is_no_line(tmp_path):
    """Lines are counted as the reader of the numbers counts them."""
    numbers = "".join(f"{x:.6g}\n" for x in RING)
    content = f"# a rig\x0cof ours\u2028here\nacceleration\n{numbers}".encode()

    assert only(tmp_path / "a.csv", content, rate=float(RATE)).response.size == RING.size


def wait_for_ever() -> None:
    """What a reader must not do."""
    while True:
        pass


def test_a_hang_and_much_memory_would_be_noticed():
    """The negative control."""
    with pytest.raises(AssertionError, match="no end"), stopped_if_it_hangs(0.05):
        wait_for_ever()
    with pytest.raises(AssertionError, match="MB"), memory_below(MOST_MEMORY):
        np.empty(int(2 * MOST_MEMORY), np.uint8)
