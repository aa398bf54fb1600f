"""Every fault in the writing of a board card is refused with its place, what was wanted and what was found."""

from __future__ import annotations

import re
from dataclasses import FrozenInstanceError

import pytest

from bayesplate.board.board import Board
from bayesplate.board.setup_keys import edge_letters
from bayesplate.errors import InputError
from bayesplate.labels import Label

LENGTH = "length_x_mm = 253"
MODE = '"(1,0)" = 52'
EDGES = 'edges = { x0 = "clamped", x1 = "free", y0 = "free", y1 = "free" }'
SETUP = "[setup] "
FREQUENCY = '[setup] frequencies_hz."(1,0)"'
UNKNOWN = "an unknown key"
NAME_RULE = "A-Z, a-z, 0-9, '.', '_' or '-', beginning with a letter or digit, at most 80 characters"
GRAMMAR = 'two whole numbers from 0 to 11, written like "(1,0)"'

NUMBERS = [
    ("-3", "a positive number", "-3"),
    ("0", "a positive number", "0"),
    ("nan", "a finite number", "nan"),
    ("true", "a number", "true"),
    ('"52,5"', "a number", '"52,5" (a decimal point and no quotes: 52.5)'),
    ('"1,024"', "a number", '"1,024" (ambiguous: write 1.024 or 1024, whichever is meant)'),
    ('"N/A"', "a number", '"N/A"'),
    ("2024-01-29", "a number", "a date or time"),
    ("1e300", "a number from 1 to 100000 mm", "1e+300"),
    ("0.253", "a number from 1 to 100000 mm", "0.253 (in mm: 1 m is 1000 mm, 1 cm is 10 mm)"),
    ("[]", "at least one of readings", "an empty list"),
    ("{}", "{ mean, sd } or { readings, resolution }", "an empty table"),
    ("{ value = 3 }", "{ mean, sd } or { readings, resolution }", "a table with value"),
]
PARTS = [
    ('[253, "x"]', " 2", "a number", '"x"'),
    ("{ mean = 3 }", ".sd", "a value", "nothing"),
    ("{ mean = 253, sd = 0 }", ".sd", "a positive number", "0 (the number alone if it is exact"),
    ("{ mean = 253, sd = 254 }", ".sd", "a number from 2.53e-07 to 253 mm", "254"),
    ("{ mean = 253, sd = 1, std = 2 }", ".std", "one of mean, sd", UNKNOWN + " (did you mean sd?)"),
    ("{ readings = [253], resolution = -1 }", ".resolution", "a number from 0 to 100000 mm", "-1"),
    ("{ readings = [253], resolutoin = 1 }", ".resolutoin", "one of readings, resolution, at_y_mm", UNKNOWN),
    ("{ readings = [253, 254], at_y_mm = [0] }", ".at_y_mm", "2 places, one per reading", "1"),
    ("{ readings = [253], at_x_mm = [0] }", ".at_x_mm", "one of readings, resolution, at_y_mm", UNKNOWN),
]
REST = [
    ("format = 1", "format = 2", "format", "1", "2 (this version reads card format 1)"),
    ("format = 1", "format = true", "format", "1", "true"),
    ("format = 1\n", "", "format", "1", "nothing"),
    ('name = "my-board"', 'name = "../../x"', "name", NAME_RULE, '"../../x"'),
    ('name = "my-board"', 'name = "CON"', "name", "a name that no operating system reserves for a device", '"CON"'),
    ('name = "my-board"', 'name = "nul.txt"', "name", "a name that no operating system reserves", '"nul.txt"'),
    ('name = "my-board"', f'name = "{"a" * 300}"', "name", NAME_RULE, '"' + "a" * 60 + '..."'),
    ('name = "my-board"', 'name = "other"', "name", '"my-board", the name of the file', '"other"'),
    ('title = "A test board"', "title = 3", "title", "a text in quotes", "3"),
    ('title = "A test board"', 'title = "\\u001b[2J"', "title", "a text without control characters", '"\\x1b[2J"'),
    ('["transverse_shear"]', '["transverse_sheer"]', "effects 1", '"transverse_shear", "fluid_loading"',
     '"transverse_sheer" (did you mean transverse_shear?)'),
    ('["transverse_shear"]', '["grain_angle", "grain_angle"]', "effects", "each name once", '"grain_angle" twice'),
    ('["transverse_shear"]', '"grain_angle"', "effects", "a list of names of effects", '"grain_angle"'),
    ("mass_g = 41.0", "desnity = 473", "[plate] desnity", "one of length_x_mm",
     UNKNOWN + " (did you mean density_kg_m3?)"),
    ("mass_g = 41.0", "", "[plate]", "exactly one of mass_g and density_kg_m3", "neither"),
    ("mass_g = 41.0", "mass_g = 41.0\ndensity_kg_m3 = 473", "[plate]", "exactly one of mass_g and density_kg_m3",
     "both, 41.0 and 473"),
    ("mass_g = 41.0", "density_kg_m3 = 0.47", "[plate] density_kg_m3", "a number from 1 to 30000 kg/m3",
     "0.47 (in kg/m3: 1 g/cm3 is 1000 kg/m3)"),
    (LENGTH + "\n", "", "[plate] length_x_mm", "the length along the grain in mm", "nothing"),
    ("{ mean = 3.0, sd = 0.03 }", "{ readings = [3], at_x_mm = [0] }", "[plate] thickness_mm",
     "at_x_mm and at_y_mm together", "only at_x_mm"),
    ("{ mean = 3.0, sd = 0.03 }", "{ readings = [3], place_sd_mm = 20 }", "[plate] thickness_mm.place_sd_mm",
     "at_x_mm and at_y_mm beside it", "no places"),
    ("{ mean = 3.0, sd = 0.03 }", "{ readings = [3], at_x_mm = [0], at_y_mm = [0], place_sd_mm = -1 }",
     "[plate] thickness_mm.place_sd_mm", "a number from 0 to 1000 mm", "-1"),
    ("poisson_xy = 0.51", "poisson_xy = 1.7", "[material] poisson_xy", "a number from -1.5 to 1.5", "1.7"),
    ("poisson_xy = 0.51", 'prior = "a b"', "[material] prior", NAME_RULE, '"a b"'),
    ("poisson_xy = 0.51", "thickness_mm = 3", "[material] thickness_mm", "one of poisson_xy",
     UNKNOWN + " (it belongs in [plate])"),
    ("[setup.hammer]\nat_mm = [60, 20]", "[setup.hammer]\nat_mm = 60", SETUP + "hammer.at_mm",
     "a place [x, y] in mm", "60"),
    (EDGES, EDGES.replace(', y1 = "free"', ""), SETUP + "edges.y1",
     'a word for each of the four edges x0, x1, y0, y1: "clamped", "supported" or "free"', "nothing"),
    (EDGES, EDGES.replace('"clamped"', '"clampd"'), SETUP + "edges.x0", '"clamped", "supported" or "free"',
     '"clampd" (did you mean clamped?)'),
    (EDGES, EDGES.replace("x0", "left"), SETUP + "edges.left", "one of x0, x1, y0, y1", UNKNOWN),
    (EDGES, 'edges = "free"', SETUP + "edges", "a table",
     '"free" (edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" })'),
    (EDGES, 'edges = "CFSF"', SETUP + "edges", "a table",
     '"CFSF" (edges = { x0 = "clamped", x1 = "supported", y0 = "free", y1 = "free" })'),
    (EDGES, "edges = 4", SETUP + "edges", "a table", "4 (x0 is the edge at x = 0)"),
    ("mass_g = 41.0", 'mass_g = 41.0\nnotes = "x"', "[plate] notes", "one of length_x_mm",
     UNKNOWN + " (it belongs above the first table)"),
    ("{ x0 = 30 }", "{ x1 = 30 }", SETUP + "clamped_mm.x1", "a clamped edge", "a free one"),
    ("{ x0 = 30 }", "30", SETUP + "clamped_mm", "a table of clamped edges, { x0 = 30 }", "30"),
    ("first_label = [1, 0]", "first_label = [1]", SETUP + "first_label", "two whole numbers, [1, 0]", "a list of 1"),
    ("first_label = [1, 0]", "first_label = [1, -1]", SETUP + "first_label 2", "a whole number from 0 to 2", "-1"),
    ("first_label = [1, 0]", "first_label = [1.0, 0]", SETUP + "first_label 1", "a whole number from 0 to 2", "1.0"),
    ("resolution_hz = 1\n", "resolution_hz = 0\n", SETUP + "resolution_hz", "a positive number", "0"),
    ("[448.8, 594.1]", "448.8", SETUP + "unlabelled_hz", "a list of frequencies", "448.8"),
    ("factor = 2 }", "factor = 1 }", SETUP + "noise_percent.factor", "a factor above 1", "1"),
    ("{ median = 0.5, factor = 2 }", "0.5", SETUP + "noise_percent", "{ median = 0.5, factor = 2 }, in percent", "0.5"),
    (MODE, '"(1,0)" = 0.052', FREQUENCY, "a number from 0.1 to 1000000 Hz", "0.052 (in Hz: 1 kHz is 1000 Hz)"),
    (MODE, '"(1,0)" = 0', FREQUENCY, "a positive number",
     "0 (in Hz; the zero-frequency modes of a free board are not listed)"),
    (MODE, '"(1,0)" = { readings = [52], at_x_mm = [1] }', FREQUENCY + ".at_x_mm", "one of readings, resolution",
     UNKNOWN),
    (MODE, MODE + '\n"( 1, 0 )" = 53', SETUP + "frequencies_hz", "the label (1,0) once",
     '"(1,0)" = 52 and "( 1, 0 )" = 53 (repeated measurements are a list: "(1,0)" = [.., ..])'),
    ('"(1,0)" = "+"', '"(1,0)" = "*"', '[setup] signs."(1,0)"', '"+" or "-"', '"*"'),
    ('"(1,0)" = "+"', '"(3,0)" = "+"', '[setup] signs."(3,0)"', "a label among the frequencies_hz", "(3,0)"),
    ('kind = "accelerometer"', 'kind = "acelerometer"', SETUP + "attached 1 kind", '"accelerometer", "exciter"',
     '"acelerometer" (did you mean accelerometer?)'),
    ("at_mm = [200, 20]", "at_mm = [[200, 20], [3]]", SETUP + "attached 1 at_mm 2", "a place [x, y] in mm",
     "a list of 1"),
    ('baffle = "none"', 'baffle = "half"', SETUP + "fluid.baffle", '"none" or "full"', '"half"'),
    ("[[setup.attached]]", "[setup.attached]", SETUP + "attached",
     "tables below [[setup.attached]], in double brackets",
     "a table with kind, mass_g, at_mm"),
    ('name = "cantilever"', 'name = "Board"', SETUP + "name", "another name", '"board"'),
]  # fmt: skip
LABELS = ["10", "(12,0)", "resolution_hz"]


def assert_refused(text: str, place: str, wanted: str, got: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"my-board.toml {place}: wanted {wanted}")) as caught:
        Board.from_text(text, "my-board")
    assert any(str(fault).startswith(f"my-board.toml {place}: wanted {wanted}") and f", got {got}" in str(fault)
               for fault in caught.value.faults)  # fmt: skip


def test_what_is_no_number_in_range_and_parts_of_a_quantity(spoiled):
    for value, wanted, got in NUMBERS:
        assert_refused(spoiled(LENGTH, f"length_x_mm = {value}"), "[plate] length_x_mm", wanted, got)
    for value, inside, wanted, got in PARTS:
        assert_refused(spoiled(LENGTH, f"length_x_mm = {value}"), f"[plate] length_x_mm{inside}", wanted, got)


def test_other_keys(spoiled):
    for old, new, place, wanted, got in REST:
        assert_refused(spoiled(old, new), place, wanted, got)


def test_labels_have_one_grammar(spoiled):
    for label in LABELS:
        key = label if label in ("10", "resolution_hz") else f'"{label}"'
        assert_refused(spoiled(MODE, f'"{label}" = 52'), f"[setup] frequencies_hz.{key}", GRAMMAR, f'"{label}"')
    with pytest.raises(InputError, match=re.escape("(a key of [setup] stands above the table of labels)")):
        Board.from_text(spoiled(MODE, MODE + "\nresolution_hz = 1"), "my-board")


def test_no_modes_at_all(spoiled, board_text):
    start, end = board_text.index("[setup.frequencies_hz]"), board_text.index("[setup.hammer]")
    text = board_text[:start] + board_text[end:]

    assert Board.from_text(text, "my-board").setups[0].readings == ()
    assert_refused(spoiled("unlabelled_hz = [448.8, 594.1]\n", "", text), "[setup] frequencies_hz",
                   'measured frequencies, "(1,0)" = 52', "no modes")  # fmt: skip


def test_too_many_modes(spoiled):
    many = "\n".join(f'"({m},{n})" = {100 + 41 * m + n}' for m in range(3, 10) for n in range(41))
    assert_refused(spoiled(MODE, f"{MODE}\n{many}"), "[setup] frequencies_hz", "at most 200 modes", "290")


def test_all_faults_are_reported_at_once(spoiled):
    text = spoiled(LENGTH, "length_x_mm = -3")
    text = spoiled("first_label = [1, 0]", "first_label = 3", text)
    text = spoiled('"(1,0)" = "+"', '"(9,9)" = "+"', text)
    text = spoiled("mass_g = 41.0", "", text)
    text = spoiled('baffle = "none"', 'bafle = "none"', text)

    with pytest.raises(InputError, match="length_x_mm") as caught:
        Board.from_text(text, "my-board")

    assert sorted(fault.place for fault in caught.value.faults) == [
        "my-board.toml [plate]",
        "my-board.toml [plate] length_x_mm",
        "my-board.toml [setup] first_label",
        "my-board.toml [setup] fluid.bafle",
        'my-board.toml [setup] signs."(9,9)"',
    ]


def test_a_flood_of_faults_is_cut(spoiled):
    flood = "\n".join(f"key{number} = 1" for number in range(500))

    with pytest.raises(InputError, match="450 more faults, not listed") as caught:
        Board.from_text(spoiled("[setup.fluid]", f"[setup.air]\n{flood}"), "my-board")

    assert len(caught.value.faults) == 51


FREE = (
    '[[setup]]\nname = "free"\nedges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }\nunlabelled_hz = [51.5]\n'
)
HEAD = 'format = 1\nname = "my-board"\n[plate]\nlength_x_mm = 253\nlength_y_mm = 114\nthickness_mm = 3\nmass_g = 41\n'


SECOND = [
    (FREE, '[[setup]] 2 "free" name', "a name of its own", '"free" again'),
    (FREE.replace('"free"\n', '"FREE"\n', 1), '[[setup]] 2 "FREE" name', "a name of its own", '"FREE" again'),
    (FREE.replace('name = "free"\n', ""), "[[setup]] 2 name", "a name, because there are several setups",
     "nothing"),
    (FREE.replace('x0 = "free"', 'x0 = "lose"').replace('"free"\n', '"b"\n', 1), '[[setup]] 2 "b" edges.x0',
     '"clamped", "supported" or "free"', '"lose"'),
]  # fmt: skip


def test_several_setups():
    for second, place, wanted, got in SECOND:
        assert_refused(HEAD + FREE + second, place, wanted, got)


SECTIONS = [
    (HEAD, "setup", "a [setup] table, or several [[setup]]", "nothing"),
    ("setup = 3\n" + HEAD, "setup", "a list of [[setup]] tables", "3"),
    ("setup = []\n" + HEAD, "setup", "at least one of [[setup]] tables", "an empty list"),
    (HEAD + FREE * 21, "setup", "at most 20 [[setup]] tables", "21"),
    ("plate = 3\n" + FREE, "plate", "a table", "3"),
    (FREE, "plate", "a [plate] table", "nothing"),
]


def test_missing_sections():
    for text, place, wanted, got in SECTIONS:
        assert_refused(text, place, wanted, got)


def test_a_sound_card_is_read(board_text):
    card = Board.from_text(board_text, "my-board")
    setup = card.setup("cantilever")

    assert (card.inputs["thickness"].mean, card.inputs["thickness"].sd) == pytest.approx((3.0e-3, 0.03e-3))
    assert card.inputs["length_x"].is_exact
    assert card.effects == ("transverse_shear",)
    assert edge_letters(setup.edges) == "CFFF"
    assert setup.clamped["x0"].mean == 0.03
    assert setup.labels == (Label(1, 0), Label(1, 1), Label(2, 0))
    assert setup.readings[1].frequency.readings == (98, 98, 99)
    assert [reading.sign for reading in setup.readings] == ["+", "", ""]
    assert setup.noise.median == pytest.approx(0.005)
    assert setup.attached[0].places == ((0.2, 0.02),)
    assert len(card.sha256) == 64


def test_defaults(spoiled):
    def poisson(card: Board) -> tuple[float, float, str, bool]:
        ratio = card.parameter("poisson_xy")
        return ratio.prior.mean, ratio.prior.sd, ratio.prior.kind, ratio.is_assumed

    bare = Board.from_text(HEAD + FREE.replace('name = "free"\n', ""), "my-board")
    stated = Board.from_text(spoiled("poisson_xy = 0.51", "poisson_xy = { mean = 0.4, sd = 0.08 }"), "my-board")

    assert poisson(bare) == (0.4, 0.08, "normal", True)
    assert poisson(stated) == (0.4, 0.08, "normal", False)
    assert bare.prior == "weakly-informative"
    assert bare.setups[0].name == "setup"
    assert bare.setups[0].first_label == (0, 0)
    assert bare.effects == ()


def test_spaces_in_labels_and_a_list_of_one_setup_change_nothing(spoiled, board_text):
    plain = Board.from_text(board_text, "my-board")
    for same in (spoiled(MODE + "\n", '" ( 1 , 0 ) " = 52\n'), board_text.replace("[setup]", "[[setup]]")):
        assert Board.from_text(same, "my-board").setups == plain.setups
    with pytest.raises(FrozenInstanceError):
        plain.name = "other"
