"""The real command line on input that cannot be used: exit code, every fault in one message, nothing written."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from runs import files_in, read_json

from bayesplate.cli import main
from bayesplate.commands.prepare import prepare
from bayesplate.errors import InputError
from bayesplate.frequencies.system import system_of

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
FREE = 'edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }'
CANTILEVER = (FREE, FREE.replace("free", "clamped", 1))
CLAMPED = (FREE, FREE.replace("free", "clamped"))
CLAMPED_LABEL = ('"(1,1)" = 150', '"(0,0)" = 900')
RIGID_LABEL = ('"(1,1)" = 150', '"(0,0)" = 150')
LIGHT = ("mass_g = 41", "mass_g = 0.041")
PLACE = "at_mm = [200, 20]"
NO_ITEM = (f'[[setup.attached]]\nkind = "accelerometer"\n{PLACE}\n', "")
WIDTHS = ("length_y_mm = 114", "length_y_mm = { readings = [114, 110], at_x_mm = [0, 253] }")
SECOND = """
[[setup]]
name = "roved"
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }
[setup.frequencies_hz]
"(1,1)" = 150
[[setup.attached]]
kind = "accelerometer"
mass_g = 3
at_mm = [[200, 20], [20, 20]]
"""


def declaring(*effects: str) -> tuple[str, str]:
    """A card's list of effects."""
    return 'name = "my-board"', 'name = "my-board"\neffects = [' + ", ".join(f'"{effect}"' for effect in effects) + "]"


def cannot_act(effect: str, reason: str) -> str:
    """The one line about an effect that can act nowhere on the board."""
    end = f"got {reason} (leave {effect} out of the effects)"
    return f"my-board.toml effects: wanted a board on which {effect} can act, {end}"


NO_CLAMP = cannot_act("clamp_rotation", "no edge is clamped")
NO_FRAME = cannot_act("support_mass", "no two opposite edges are held, so there is no frame that would only shift")
ROVED = "something above 2% of the board roved: give each place a setup of its own"
DENSITY = "[plate] mass_g: wanted a density from 20 to 25000 kg/m3"
RIGID = 'frequencies_hz "(0,0)": wanted a mode of a plate with edges x0 free'

BAD_CARDS = {
    "unknown key": ([("mass_g = 41", "desnity = 473.9")],
                    ["[plate] desnity: wanted one of length_x_mm", "did you mean density_kg_m3?",
                     "[plate]: wanted exactly one of mass_g and density_kg_m3, got neither"]),
    "negative": ([("thickness_mm = 3", "thickness_mm = -3"), ('"(2,0)" = 240', '"(2,0)" = -240')],
                 ["[plate] thickness_mm: wanted a positive number, got -3",
                  'frequencies_hz."(2,0)": wanted a positive number, got -240']),
    "rigid label": ([RIGID_LABEL], [RIGID, "at 0 Hz", "(the lowest are (1,1), (2,0), (0,2), (2,1), (1,2))"]),
    "label beyond the model": ([('"(2,0)" = 240', '"(10,0)" = 240'), ('"(0,2)" = 330', '"(1,0)" = 330')],
                               ['frequencies_hz "(10,0)": wanted a mode of a plate', "more than 9 nodal lines",
                                'frequencies_hz "(1,0)": wanted a mode of a plate']),
    "sensor off the plate": ([(PLACE, "at_mm = [300, 20]"), LIGHT],
                             ["attached 1 at_mm: wanted a place on the free part of the board, x 0 to 253 mm",
                              DENSITY]),
    "syntax": ([('"(2,0)" = 240', '"(2,0)" = 240,5')],
               ["my-board.toml line 19: wanted TOML", "(a number has a decimal point, not a comma)"]),
    "physical beside schema": ([LIGHT, ("length_x_mm = 253", "length_x_mm = -1")],  # which alone can be judged
                               ["[plate] length_x_mm: wanted a positive number"]),
    "a table of other boards": ([('name = "free"', 'name = "free"\npublished_coefficients = "paper-cantilever"'),
                                 LIGHT, RIGID_LABEL],
                                ["[setup] published_coefficients: wanted a table for the edges x0 free, x1 free",
                                 "got paper-cantilever, made for x0 clamped, x1 free",
                                 "[setup] published_coefficients: wanted a table of aspect ratio 2.219, got "
                                 "paper-cantilever, made for 1.956",
                                 "[setup] published_coefficients: wanted a table with the labels (2,0), got",
                                 DENSITY, RIGID]),
    "cards that are not there": ([('name = "free"', 'name = "free"\npublished_coefficients = "./mine.toml"'),
                                  ("poisson_xy = 0.4", 'prior = "spruse"'), LIGHT, RIGID_LABEL],
                                 ["[setup] published_coefficients -> mine.toml: wanted a card, got no such file",
                                  "did you mean spruce?", DENSITY, RIGID]),
    "a clamp that turns on a free board": ([declaring("clamp_rotation")], [NO_CLAMP]),
    "a frame around a cantilever": ([declaring("support_mass"), CANTILEVER], [NO_FRAME]),
    "foam under a clamped board": (
        [declaring("support_stiffness"), CLAMPED, CLAMPED_LABEL],
        [cannot_act("support_stiffness", "an edge is held, so the board does not lie or hang on anything else")],
    ),
    "an outline between clamps": (
        [declaring("outline_profile"), WIDTHS, CLAMPED, CLAMPED_LABEL],
        [cannot_act("outline_profile", "neither y0 nor y1 is free, and a held edge is straight")],
    ),
    "a Poisson ratio that is free already": (
        [declaring("poisson_ratio"), ("poisson_xy = 0.4", "poisson_xy = { mean = 0.4, sd = 0.1 }")],
        [cannot_act("poisson_ratio", "poisson_xy is already uncertain (0.4 ± 0.1) and so part of every fit")],
    ),
    "nothing attached": (
        [declaring("attached_mass"), NO_ITEM],
        [cannot_act("attached_mass", "no [[setup.attached]] says what is fixed to the board and where")],
    ),
    "a sensor of unknown mass that roved over a light board": (
        [declaring("attached_mass"), (PLACE, "at_mm = [[200, 20], [20, 20]]")], [cannot_act("attached_mass", ROVED)],
    ),
    "one of two setups cannot be computed, though the effect can act in the other": (
        [("[setup]\n", "[[setup]]\n"), (PLACE + "\n", f"{PLACE}\nmass_g = 0.3\n{SECOND}")],
        [f'my-board.toml [[setup]] 2 "roved": wanted a setup in which attached_mass can act, got {ROVED}'],
    ),
    "all at once": (
        [declaring("clamp_rotation", "membrane_tension", "grain_angle", "outline_profile"),
         (PLACE, "at_mm = [300, 20]\nmass_g = 50")],
        ["my-board.toml [setup] attached 1 at_mm: wanted a place on the free part of the board, x 0 to 253 mm, "
         "y 0 to 114 mm, got [300, 20] (from the corner of x0 and y0 of the whole board)",
         "my-board.toml [setup] attached 1 mass_g: wanted less than the board's own 41 g, got 50 g",
         NO_CLAMP,
         cannot_act("membrane_tension", "no two opposite edges are held, so nothing can stretch the board"),
         cannot_act("outline_profile", "the card gives no widths at stations: "
                    "length_y_mm = { readings = [..], at_x_mm = [..] }")],
    ),
}  # fmt: skip

BOARD = "fiemme-spruce-clamped"
LONG = "d" * 300
"""A name that no file system takes; a place that may not be looked into ends in the same way."""
THERE = "already there (--force replaces them, --out takes another place)"
NOTES = "--out notes: wanted a new folder, or one of an earlier run, got other files: notes.txt (--out takes another"
USED = "--out used: wanted a new folder, got one that exists (--force replaces its results, --resume continues"
UNTOLD = "wanted the frequencies of a board, by which effects are told apart"
NO_CHECKPOINT = "wanted the checkpoint of an interrupted run, got"
MASS = "wanted a mass in g, or mass and standard deviation, with decimal points, got"
TABLE = "wanted a folder of cards, or a table (.csv or .parquet), got"
BARE = CARD.partition("\n[setup.frequencies_hz]")[0]
FILES = {
    "my-board.toml": CARD,
    "bare.toml": BARE.replace("my-board", "bare"),
    "peak.toml": BARE.replace("my-board", "peak") + "unlabelled_hz = [860.0]\n",
    "two.toml": CARD.replace("my-board", "two").replace('"(0,2)" = 330\n', ""),
    "taken": "mine",
    **{f"used/{name}": "mine" for name in ("summary.json", "compare.json", "modes.svg", "plan.json", "setup.toml")},
    f"results/{BOARD}/summary.json": "mine",
    "notes/notes.txt": "mine",
    "started/checkpoint/linear/lock": "",
    "empty.wav": "",
    "hit.txt": "hit",
    "empty/notes.txt": "mine",
    "tops.csv": "name\nx\n",
    "tops.TSV": "name\nx\n",
    "of-a-plate.toml": "[plate]\nmass_g = 3\n[setup]\n",
    "of-a-slip.toml": "[setup]\nunlabeled_hz = [3]\n",
    "of-another.toml": '[setup]\nname = "clamped"\n',
    "of-no-sign.toml": "[setup]\nunlabelled_hz = [-3]\n",
}
"""What is in the folder, beside which nothing may appear."""
REFUSED = [
    ("chek my-board.toml", 2, "No such command 'chek'. Did you mean 'check'?"),
    ("zzzz", 2, "No such command 'zzzz'."),
    (f"fit {BOARD} --linar", 2, "No such option '--linar'. Did you mean '--linear'?"),
    (f"fit {BOARD} --seed -1", 2, "-1 is not in the range x>=0"),
    (f"fit {BOARD} --seed one", 2, "'one' is not a valid integer"),
    (f"fit {BOARD} --force --resume", 2, "force starts anew and resume continues"),
    (f"diagnose {BOARD} --force --resume", 2, "force starts anew and resume continues"),
    (f"fit {BOARD} --linear --exact", 2, "--linear and --exact force different laws"),
    (f"check {BOARD} --effects none,fluid_loading", 2, "--effects none declares nothing"),
    (f"check {BOARD} --effects ,", 2, '--effects: wanted names, or "none", got nothing'),
    (f"check {BOARD} --effects=", 2, '--effects: wanted names, or "none", got nothing'),
    ("fit", 2, "Missing argument 'CARD'"),
    ("fit one two", 2, "unexpected extra argument (two)"),
    ("plan bare.toml --cost reading", 2, "wanted CLASS=MINUTES"),
    ("plan bare.toml --cost reading=1 --cost reading=2", 2, "reading is given twice"),
    ("new --json", 2, "--json and --quiet ask no question: give PATH"),
    ("new --quiet", 2, "--json and --quiet ask no question: give PATH"),
    ("new mine --frequency 35", 2, "write a label and its frequency"),
    ("compare spruce-free-2R --coefficients printed", 2, "'printed' is not one of"),
    *((f"pick hit.wav --sensor-mass {mass}", 2, f"{MASS} '{mass}'") for mass in ("0,6", "0,6,0,1", "nan", "-1", "a")),
    ("pick hit.wav --hammer nan,2", 3, "hammer 1: wanted a place (x, y) in m, got (nan, 0.002)"),
    ("check nowhere.toml", 3, "nowhere.toml: wanted a card, got no such file"),
    ("check empty.toml", 3, "empty.toml: wanted a regular file, got a directory"),
    ("check latin.toml", 3, "latin.toml line 2: wanted UTF-8 text, got the byte 0xe9"),
    ("fit finish-spruce-cantilever", 3, "did you mean finnish-spruce-cantilever?"),
    ("fit my-board.toml --effects air_loadin", 3, "air_loadin"),
    ("fit my-board.toml --effects support_mass,clamp_rotation", 3, f"{NO_FRAME}\n{NO_CLAMP}\n"),
    ("diagnose no-such-board", 3, '"no-such-board": wanted the name of a board card'),
    ("fit bare.toml", 3, "wanted measured frequencies"),
    (f"fit {BOARD} --out taken", 3, "--out taken: wanted a folder, got a file"),
    (f"fit {BOARD} --out taken/inside", 3, "--out taken/inside: wanted a folder, got Not a directory"),
    (f"fit {BOARD} --out {LONG}", 3, "File name too long"),
    (f"compare {BOARD} --out {LONG}", 3, "File name too long"),
    (f"modes {BOARD} --out {LONG}", 3, "File name too long"),
    (f"plan bare.toml --out {LONG}", 3, "File name too long"),
    (f"batch {LONG}", 3, TABLE),
    (f"batch . --out {LONG}", 3, "File name too long"),
    (f"pick {LONG}.wav", 3, "File name too long"),
    (f"new {LONG} --mass 41", 3, "at most 80 characters"),
    (f"fit {BOARD} --out used", 3, USED),
    (f"fit {BOARD}", 3, f"--out results/{BOARD}: wanted a new folder"),
    (f"fit {BOARD} --out notes", 3, NOTES),
    (f"fit {BOARD} --out notes --force", 3, NOTES),
    ("batch . --out notes --force", 3, NOTES),
    (f"diagnose {BOARD} --out used", 3, USED),
    ("batch . --out used", 3, USED),
    (f"compare {BOARD} --out used", 3, f"compare.json {THERE}"),
    (f"modes {BOARD} --out used", 3, f"modes.svg {THERE}"),
    ("plan bare.toml --out used", 3, f"plan.json {THERE}"),
    ("pick hit.wav --out used", 3, f"setup.toml {THERE}"),
    ("new my-board", 3, "my-board.toml: wanted a new file, got one that exists"),
    ("new my-board.toml --mass 40", 3, "my-board.toml: wanted a new file, got one that exists"),
    ("new Böden", 3, "wanted A-Z, a-z, 0-9"),
    ("new mine --thickness 2,8 --length-x=-3 --edges round", 3,
     'thickness: wanted a number, got "2,8" (a decimal point and no quotes: 2.8)',
     "[plate] length_x_mm: wanted a positive number, got -3", 'edges: wanted "free", "cantilever"'),
    ("new mine --frequency (0,0)=35", 3, "a motion without bending, at 0 Hz"),
    ("new mine --frequency 10=35", 3, "wanted two whole numbers"),
    ("new mine --prior spruse", 3, "did you mean spruce?"),
    ("compare spruce-free-2R --coefficients published", 3,
     "published_coefficients: wanted the name of a table, got nothing"),
    ("plan bare.toml --cost reading=0", 3, "costs reading: wanted a positive number of minutes"),
    ("plan bare.toml --between grain_angel", 3, "did you mean grain_angle?"),
    ("plan bare.toml --between clamp_rotation", 3,
     "between: wanted a board on which clamp_rotation can act, got no edge is"),
    ("plan bare.toml --between none", 3, "between: wanted one name of an effect or more, or None, got an empty list"),
    ("plan bare.toml --between air_loading --effects fluid_loading", 3,
     "between: wanted effects that are not declared"),
    ("plan bare.toml --between fluid_loading", 3, f"between: {UNTOLD}"),
    ("plan bare.toml --for explanations", 3, f"goal: {UNTOLD}"),
    ("pick empty.wav hit.txt", 3, "empty.wav: wanted a recording, got an empty file", "hit.txt: wanted a recording"),
    ("check my-board.toml --setup of-a-plate.toml", 3,
     "of-a-plate.toml plate: wanted nothing but [setup], got another key"),
    ("check my-board.toml --setup of-a-slip.toml", 3, "of-a-slip.toml [setup] unlabeled_hz: wanted one of"),
    ("check my-board.toml --setup of-another.toml", 3,
     "of-another.toml [setup] name: wanted the name of a setup of my-board.toml"),
    ("check my-board.toml --setup of-no-sign.toml", 3,
     "my-board.toml with of-no-sign.toml [setup] unlabelled_hz 1: wanted"),
    ("check of-no-sign.toml", 3, "(it completes a card: CARD --setup of-no-sign.toml)"),
    ("batch empty", 3, "wanted a folder with board cards (NAME.toml), got none in it"),
    ("batch nowhere", 3, f"{TABLE} nothing there"),
    ("batch nowhere.csv --template my-board.toml", 3, f"{TABLE} nothing there (looked in"),
    ("batch tops.TSV --template my-board.toml", 3, f"{TABLE} another file (save the table as CSV"),
    ("batch tops.csv", 3, "--template: wanted a card for the table"),
    ("batch . --template my-board.toml", 3, "--template: wanted a table of boards beside it, got a folder"),
    ("check peak.toml", 4,
     "setup 'free' has no labelled mode, and its 1 peak is none with certainty; give at least one label"),
    ("check two.toml", 4, "2 labelled modes for three constants D_x, D_y, D_s: at least 1 more needed"),
    ("diagnose two.toml", 4, "2 labelled modes for three constants"),
    (f"fit {BOARD} --out used --resume", 6, f"{NO_CHECKPOINT} a finished run (--force runs it anew)"),
    (f"fit {BOARD} --out notes --resume", 6, f"{NO_CHECKPOINT} nothing to resume"),
    (f"diagnose {BOARD} --out notes --resume", 6, f"{NO_CHECKPOINT} nothing to resume"),
    (f"diagnose {BOARD} --out started --resume", 6, "got none to resume (--force runs it anew)"),
    ("batch . --out notes --resume", 6, "wanted the boards.jsonl of an earlier run, got none (--force runs it anew)"),
]  # fmt: skip
"""A command line, its exit code, and passages of what is said."""


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What effects would do to a board is left out of a check: it takes its time, and nothing here looks at it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("bayesplate.commands.check.signatures", lambda _: [])


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(main, arguments)


def write(*changes: tuple[str, str]) -> None:
    """my-board.toml with some changes."""
    text = CARD
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    Path("my-board.toml").write_text(text, encoding="utf-8")


def test_a_command_line_that_cannot_be_used_is_refused_before_any_work(monkeypatch):
    def never(*_: object, **__: object) -> None:
        raise AssertionError("sampled")

    for module in ("compare", "fitting"):
        monkeypatch.setattr(f"bayesplate.commands.{module}.infer", never)
    for name, text in FILES.items():
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text(text, encoding="utf-8")
    Path("latin.toml").write_bytes(b'format = 1\nname = "caf\xe9"\n')
    Path("empty.toml").mkdir()
    before = files_in(Path())

    for line, code, *passages in REFUSED:
        result = invoke(*shlex.split(line))
        said = result.stderr.replace("No such option: --linar ", "No such option '--linar'. ")  # of an older click

        assert (line, result.exit_code) == (line, code), result.output
        assert [passage for passage in passages if passage not in said] == [], (line, said)
        assert result.stdout == "", line
        assert [word for word in ("Traceback", "internal error") if word in said] == [], line
        assert files_in(Path()) == before, line


def test_a_bad_card_is_refused_with_all_its_faults_and_nothing_is_written():
    """Exit 3 whatever the command; one line without traceback for each fault; JSON says the same."""
    write()
    assert invoke("check", "my-board.toml").exit_code == 0  # or a fault of the card itself could stand in for the one
    for case, (changes, wanted) in BAD_CARDS.items():
        write(*changes)
        plain, mirrored = invoke("fit", "my-board.toml"), invoke("check", "my-board.toml", "--json")
        error = read_json(mirrored.stdout)["error"]
        lines = plain.stderr.splitlines()

        assert plain.exit_code == mirrored.exit_code == error["exit_code"] == 3, case
        assert [passage for passage in wanted if passage not in plain.stderr] == [], case
        assert [line for line in lines if not any(passage in line for passage in wanted)] == [], case
        assert plain.stdout == "", case
        assert mirrored.stderr == plain.stderr == error["message"] + "\n", case
        for fault, line in zip(error["faults"], lines, strict=True):
            assert line.startswith(f"{fault['place']}: wanted {fault['wanted']}, got {fault['got']}"), case
        assert [path.name for path in Path().iterdir()] == ["my-board.toml"], case


def test_declared_effects_replaced_what_the_card_states_no_longer_counts():
    write(*BAD_CARDS["one of two setups cannot be computed, though the effect can act in the other"][0])

    assert prepare("my-board.toml", []).board.effects == ()


def test_the_possible_is_not_refused():
    """Control: the same declarations where they can act are part of the model."""
    possible = {
        "clamp_rotation": [CANTILEVER],
        "membrane_tension": [CLAMPED, CLAMPED_LABEL],
        "attached_mass": [],
        "outline_profile": [WIDTHS],
    }
    for effect, changes in possible.items():
        write(declaring(effect), *changes)
        board = prepare("my-board.toml").board

        assert board.effects == (effect,)
        assert [one.name for one in system_of(board, board.setups[0]).effects] == [effect]


def test_what_roved_is_said_to_be_rough():
    """From 0.2 % of the board of 41 g on, 0.082 g; above 2 % it is refused."""
    for mass, is_rough in ((0.081, False), (0.083, True), (0.81, True)):
        write((PLACE, f"at_mm = [[200, 20], [20, 20]]\nmass_g = {mass}"))
        said = [note for note in prepare("my-board.toml").board.notes if "roved" in note]

        assert len(said) == is_rough, mass
        assert not is_rough or f"weighs {100.0 * mass / 41.0:.1f} % of the board" in said[0]
    write((PLACE, "at_mm = [[200, 20], [20, 20]]\nmass_g = 0.83"))
    with pytest.raises(InputError, match="above 2% of the board roved"):
        prepare("my-board.toml")


def test_what_each_command_does_is_told_in_a_whole_sentence():
    told = invoke("--help").output.partition("Commands:")[2].split("\n")
    lines = [line for line in told if line.strip()]

    assert [line.split()[0] for line in lines] == sorted(main.commands)
    assert all(line.endswith(".") and not line.endswith("...") for line in lines)
    assert invoke("--version").stdout.endswith(f", version {version('bayesplate')}\n")


def test_debug_shows_where_and_an_internal_error_is_one_line_without_it(monkeypatch):
    plain, debug = invoke("fit", "nowhere.toml"), invoke("fit", "nowhere.toml", "--debug")

    assert plain.exit_code == debug.exit_code == 3
    assert "Traceback (most recent call last)" in debug.stderr
    assert debug.stderr.endswith(plain.stderr)

    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("of a test")

    monkeypatch.setattr("bayesplate.commands.problem.prepare", broken)
    plain, debug = invoke("fit", BOARD), invoke("fit", BOARD, "--debug", "--json")

    assert plain.exit_code == debug.exit_code == 70
    assert plain.stderr == "internal error: ZeroDivisionError: of a test (--debug shows where)\n"
    assert "in broken" in debug.stderr
    assert read_json(debug.stdout)["error"] == {"exit_code": 70, "message": plain.stderr[:-1], "faults": []}


def test_a_terminal_of_no_width_is_none(monkeypatch):
    """As some programs set it that run others."""
    write()
    told = invoke("check", "my-board.toml").stdout
    monkeypatch.setenv("COLUMNS", "0")

    assert "E_x" in told
    assert invoke("check", "my-board.toml").stdout == told


def test_a_reader_that_stops_early_is_no_error():
    """`bayesplate cite ... | head -1`: the pipe is closed before anything is printed."""
    read, written = os.pipe()
    os.close(read)
    program = [sys.executable, "-m", "bayesplate", "cite", BOARD]
    with os.fdopen(written, "w") as closed:
        done = subprocess.run(program, stdout=closed, stderr=subprocess.PIPE, text=True, check=False)

    assert (done.stderr, done.returncode) == ("", 0)


WORK = """
from bayesplate.errors import InputError
from bayesplate.posterior.sampling import Progress
from bayesplate.terminal import exit_on_error, print_text, progress_line
with exit_on_error(as_json=False, debug=True):
    with progress_line(is_shown=True) as tell:
        for stage in "first", "second":
            tell(Progress(0, 0, stage=stage, done=0.5))
    print_text("done")
    raise InputError("refused")
"""
needs_a_full_device = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")


@needs_a_full_device
def test_a_run_goes_on_where_its_progress_cannot_be_told():
    """A full disk, a lost terminal or `bayesplate diagnose ... 2>&1 | head` is no reason to stop."""
    with Path("/dev/full").open("w") as full:
        program = [sys.executable, "-c", WORK]
        done = subprocess.run(program, stdout=subprocess.PIPE, stderr=full, text=True, check=False)

    assert (done.stdout, done.returncode) == ("done\n", 3)


@needs_a_full_device
def test_an_output_that_cannot_be_written_is_one_line():
    program = [sys.executable, "-m", "bayesplate", "cite", BOARD]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(program, stdout=full, stderr=subprocess.PIPE, text=True, check=False)

    assert done.returncode == 3
    assert done.stderr == "standard output: wanted a place that can be written, got No space left on device\n"
