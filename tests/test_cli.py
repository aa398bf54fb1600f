"""The real command line on input that cannot be used: exit code, every fault in one message, nothing written."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from runs import files_in, read_json

from bayesplate.cli import main

CARD = """\
format = 1
name = "my-board"

[plate]
length_x_mm = 253
length_y_mm = 114
thickness_mm = 3
mass_g = 41

[material]
poisson_xy = 0.4

[setup]
name = "free"
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }

[setup.frequencies_hz]
"(1,1)" = 150
"(2,0)" = 240
"(0,2)" = 330

[[setup.attached]]
kind = "accelerometer"
at_mm = [200, 20]
"""

BAD_CARDS = {
    "unknown key": ([("mass_g = 41", "desnity = 473.9")],
                    ["[plate] desnity: wanted one of length_x_mm", "did you mean density_kg_m3?",
                     "[plate]: wanted exactly one of mass_g and density_kg_m3, got neither"]),
    "negative": ([("thickness_mm = 3", "thickness_mm = -3"), ('"(2,0)" = 240', '"(2,0)" = -240')],
                 ["[plate] thickness_mm: wanted a positive number, got -3",
                  'frequencies_hz."(2,0)": wanted a positive number, got -240']),
    "rigid label": ([('"(1,1)" = 150', '"(0,0)" = 150')],
                    ['frequencies_hz "(0,0)": wanted a mode of a plate with edges x0 free', "at 0 Hz",
                     "(the lowest are (1,1), (2,0), (0,2), (2,1), (1,2))"]),
    "label beyond the model": ([('"(2,0)" = 240', '"(10,0)" = 240'), ('"(0,2)" = 330', '"(1,0)" = 330')],
                               ['frequencies_hz "(10,0)": wanted a mode of a plate', "more than 9 nodal lines",
                                'frequencies_hz "(1,0)": wanted a mode of a plate']),
    "sensor off the plate": ([("at_mm = [200, 20]", "at_mm = [300, 20]"), ("mass_g = 41", "mass_g = 0.041")],
                             ["attached 1 at_mm: wanted a place on the free part of the board, x 0 to 253 mm",
                              "[plate] mass_g: wanted a density from 20 to 25000 kg/m3"]),
    "syntax": ([('"(2,0)" = 240', '"(2,0)" = 240,5')],
               ["my-board.toml line 19: wanted TOML", "(a number has a decimal point, not a comma)"]),
    "a table of other boards": ([('name = "free"', 'name = "free"\npublished_coefficients = "paper-cantilever"'),
                                 ("mass_g = 41", "mass_g = 0.041"), ('"(1,1)" = 150', '"(0,0)" = 150')],
                                ["[setup] published_coefficients: wanted a table for the edges x0 free, x1 free",
                                 "got paper-cantilever, made for x0 clamped, x1 free",
                                 "[setup] published_coefficients: wanted a table of aspect ratio 2.219, got "
                                 "paper-cantilever, made for 1.956",
                                 "[setup] published_coefficients: wanted a table with the labels (2,0), got",
                                 "[plate] mass_g: wanted a density from 20 to 25000 kg/m3",
                                 'frequencies_hz "(0,0)": wanted a mode of a plate']),
    "cards that are not there": ([('name = "free"', 'name = "free"\npublished_coefficients = "./mine.toml"'),
                                  ("poisson_xy = 0.4", 'prior = "spruse"'), ("mass_g = 41", "mass_g = 0.041"),
                                  ('"(1,1)" = 150', '"(0,0)" = 150')],
                                 ["[setup] published_coefficients -> mine.toml: wanted a card, got no such file",
                                  "did you mean spruce?", "[plate] mass_g: wanted a density from 20 to 25000 kg/m3",
                                  'frequencies_hz "(0,0)": wanted a mode of a plate']),
}  # fmt: skip


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(main, arguments)


def spoiled(*changes: tuple[str, str]) -> str:
    text = CARD
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def assert_refused(command: str, card: str, wanted: list[str]) -> None:
    """Exit 3; every wanted passage in one message without traceback; JSON says the same; nothing new is on disk."""
    before = files_in(Path())
    plain = invoke(command, card)
    mirrored = invoke(command, card, "--json")
    error = read_json(mirrored.stdout)["error"]

    assert plain.exit_code == mirrored.exit_code == error["exit_code"] == 3
    assert [passage for passage in wanted if passage not in plain.stderr] == []
    assert "Traceback" not in plain.stderr
    assert plain.stdout == ""
    assert mirrored.stderr == plain.stderr
    assert error["message"] + "\n" == plain.stderr
    assert len(error["faults"]) == len(plain.stderr.splitlines())
    for fault, line in zip(error["faults"], plain.stderr.splitlines(), strict=True):
        assert line.startswith(f"{fault['place']}: wanted {fault['wanted']}, got {fault['got']}")
    assert files_in(Path()) == before
    assert not Path("results").exists()


def test_the_card_is_sound_before_it_is_spoiled():
    """Otherwise a fault of the card itself could stand in for the one that is made."""
    Path("my-board.toml").write_text(CARD, encoding="utf-8")

    assert invoke("check", "my-board.toml").exit_code == 0


def test_a_bad_card_is_refused_with_all_its_faults():
    for changes, wanted in BAD_CARDS.values():
        Path("my-board.toml").write_text(spoiled(*changes), encoding="utf-8")

        assert_refused("check", "my-board.toml", wanted)


def test_a_fit_refuses_what_a_check_refuses():
    changes, wanted = BAD_CARDS["negative"]
    Path("my-board.toml").write_text(spoiled(*changes), encoding="utf-8")

    assert_refused("fit", "my-board.toml", wanted)


def test_what_is_no_card_is_refused(tmp_path):
    Path("my-board.toml").write_bytes(b'format = 1\nname = "caf\xe9"\n')
    Path("folder.toml").mkdir()

    assert_refused("check", "my-board.toml", ["my-board.toml line 2: wanted UTF-8 text, got the byte 0xe9"])
    assert_refused("check", "nowhere.toml", ["nowhere.toml: wanted a card, got no such file", str(tmp_path)])
    assert_refused("check", "folder.toml", ["folder.toml: wanted a regular file, got a directory"])
    assert_refused("fit", "finish-spruce-cantilever", ["did you mean finnish-spruce-cantilever?"])


def test_schema_and_physical_faults_are_told_one_after_the_other():
    """What a fault of writing means cannot be judged: the physical faults come once the card can be read."""
    both = spoiled(("mass_g = 41", "mass_g = 0.041"), ("length_x_mm = 253", "length_x_mm = -1"))
    Path("my-board.toml").write_text(both, encoding="utf-8")
    first = invoke("check", "my-board.toml").stderr
    Path("my-board.toml").write_text(both.replace("= -1", "= 253"), encoding="utf-8")
    second = invoke("check", "my-board.toml").stderr

    assert "length_x_mm" in first
    assert "density" not in first
    assert "wanted a density from 20 to 25000 kg/m3" in second


def test_an_unknown_effect_is_refused():
    Path("my-board.toml").write_text(CARD, encoding="utf-8")
    result = invoke("fit", "my-board.toml", "--effects", "air_loadin")

    assert result.exit_code == 3
    assert "air_loadin" in result.stderr
    assert not Path("results").exists()


def test_an_output_folder_that_cannot_be_one():
    """A file in its place, and a file on the way to it; neither is touched."""
    Path("taken").write_bytes(b"mine")

    for out, got in (("taken", "a file"), ("taken/inside", "Not a directory")):
        result = invoke("fit", "fiemme-spruce-clamped", "--out", out)
        assert result.exit_code == 3
        assert f"--out {out}: wanted a folder" in result.stderr
        assert got in result.stderr
    assert files_in(Path()) == {"taken": b"mine"}


MISTYPED = [
    (["chek", "fiemme-spruce-clamped"], "No such command 'chek'. Did you mean 'check'?"),
    (["zzzz"], "No such command 'zzzz'."),
    (["fit", "fiemme-spruce-clamped", "--linar"], "No such option '--linar'. Did you mean '--linear'?"),
    (["fit", "fiemme-spruce-clamped", "--seed", "-1"], "-1 is not in the range x>=0"),
    (["fit", "fiemme-spruce-clamped", "--seed", "one"], "'one' is not a valid integer"),
    (["fit", "fiemme-spruce-clamped", "--force", "--resume"], "force starts anew and resume continues"),
    (["fit", "fiemme-spruce-clamped", "--linear", "--exact"], "--linear and --exact force different laws"),
    (["check", "fiemme-spruce-clamped", "--effects", "none,fluid_loading"], "--effects none declares nothing"),
    (["fit"], "Missing argument 'CARD'"),
    (["fit", "one", "two"], "unexpected extra argument (two)"),
]


def test_a_mistyped_command_line_is_a_usage_error():
    for arguments, said in MISTYPED:
        result = invoke(*arguments)

        assert result.exit_code == 2
        assert said in result.stderr.replace("No such option: --linar ", "No such option '--linar'. ")
        assert "Traceback" not in result.stderr
        assert files_in(Path()) == {}


def test_what_each_command_does_is_told_in_a_whole_sentence():
    told = CliRunner().invoke(main, ["--help"]).output.partition("Commands:")[2].split("\n")
    lines = [line for line in told if line.strip()]

    assert [line.split()[0] for line in lines] == sorted(main.commands)
    assert all(line.endswith(".") and not line.endswith("...") for line in lines)


def test_debug_shows_the_traceback_and_keeps_the_exit_code():
    plain = invoke("fit", "nowhere.toml")
    debug = invoke("fit", "nowhere.toml", "--debug")

    assert plain.exit_code == debug.exit_code == 3
    assert "Traceback (most recent call last)" in debug.stderr
    assert debug.stderr.endswith(plain.stderr)


def test_an_internal_error_is_one_line_without_debug(monkeypatch):
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("of a test")

    monkeypatch.setattr("bayesplate.commands.problem.prepare", broken)
    plain, debug = invoke("fit", "fiemme-spruce-clamped"), invoke("fit", "fiemme-spruce-clamped", "--debug", "--json")

    assert plain.exit_code == debug.exit_code == 70
    assert plain.stderr == "internal error: ZeroDivisionError: of a test (--debug shows where)\n"
    assert "in broken" in debug.stderr
    assert read_json(debug.stdout)["error"] == {"exit_code": 70, "message": plain.stderr[:-1], "faults": []}


def test_a_terminal_of_no_width_is_none(monkeypatch):
    """As some programs set it that run others."""
    Path("my-board.toml").write_text(CARD, encoding="utf-8")
    told = invoke("check", "my-board.toml").stdout
    monkeypatch.setenv("COLUMNS", "0")

    assert "E_x" in told
    assert invoke("check", "my-board.toml").stdout == told


LONG = "d" * 300
"""A name that no file system takes; a place that may not be looked into ends in the same way."""


PLACES = [
    ("fit", "fiemme-spruce-clamped", "--out", LONG),
    ("fit", "fiemme-spruce-clamped", "--out", LONG, "--resume"),
    ("fit", "spruce-half-tops", "--out", LONG),
    ("compare", "fiemme-spruce-clamped", "--out", LONG),
    ("modes", "fiemme-spruce-clamped", "--out", LONG),
    ("plan", "fiemme-spruce-clamped", "--out", LONG),
    ("batch", LONG),
    ("batch", ".", "--out", LONG),
    ("pick", f"{LONG}.wav"),
    ("new", LONG, "--mass", "41"),
]


def test_a_place_that_cannot_be_looked_at_is_refused():
    for arguments in PLACES:
        Path("my-board.toml").touch()
        result = invoke(*arguments)

        assert result.exit_code == 3, result.output
        assert "internal error" not in result.stderr
        assert [path.name for path in Path.cwd().iterdir()] == ["my-board.toml"]


def test_the_commands_and_exit_codes_of_a_real_process():
    """The same through an interpreter of its own: what click's runner may hide."""
    Path("my-board.toml").write_text(spoiled(*BAD_CARDS["negative"][0]), encoding="utf-8")
    program = [sys.executable, "-m", "bayesplate"]
    done = subprocess.run([*program, "fit", "my-board.toml"], capture_output=True, text=True, check=False)
    shown = subprocess.run([*program, "--version"], capture_output=True, text=True, check=True)

    assert done.returncode == 3
    assert len(done.stderr.splitlines()) == 2
    assert done.stdout == ""
    assert shown.stdout.endswith(f", version {version('bayesplate')}\n")


def test_a_reader_that_stops_early_is_no_error():
    """`bayesplate cite ... | head -1`: the pipe is closed before anything is printed."""
    program = [sys.executable, "-m", "bayesplate", "cite", "fiemme-spruce-clamped"]
    with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        said = process.stderr.read()
        assert process.wait(timeout=60) == 0
    assert said == ""


WORK = """
from bayesplate.errors import InputError
from bayesplate.posterior.sampling import Progress
from bayesplate.terminal import progress_line, reporting, say
with reporting(as_json=False, debug=True):
    with progress_line(shown=True) as tell:
        for stage in "first", "second":
            tell(Progress(0, 0, stage=stage, done=0.5))
    say("done")
    raise InputError("refused")
"""


@pytest.mark.parametrize("is_full", [False, True])
def test_a_run_goes_on_where_its_progress_cannot_be_told(is_full):
    """`bayesplate diagnose ... 2>&1 | head`, a full disk or a lost terminal is no reason to stop."""
    if is_full and not Path("/dev/full").exists():
        pytest.skip("needs a device that is always full")
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "w") as closed, Path("/dev/full" if is_full else os.devnull).open("w") as full:
        program, stderr = [sys.executable, "-c", WORK], full if is_full else closed
        done = subprocess.run(program, stdout=subprocess.PIPE, stderr=stderr, text=True, check=False)

    assert (done.stdout, done.returncode) == ("done\n", 3)
