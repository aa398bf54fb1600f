"""What a card leaves to be assumed is told once, and a card that says it all is not remarked on."""

from __future__ import annotations

from bayesplate.board.board import Board
from bayesplate.board.checks import remarks
from bayesplate.commands.prepare import prepare

THICKNESS = "{ mean = 3.0, sd = 0.03 }"
NOISE = "{ median = 0.5, factor = 2 }"
CALIPER = "write thickness_mm = { mean = 2.8, sd = 0.05 }, or its readings"
THICK = "more than a tenth: transverse shear matters"


TOLD = [
    (THICKNESS, "2.8", ("transverse_shear",), [CALIPER]),
    (THICKNESS, "{ readings = [2.8], resolution = 0 }", ("transverse_shear",), [CALIPER]),
    (THICKNESS, "[2.8]", (), ["were taken as rounded, thickness to 0.05 mm;"]),
    (THICKNESS, "{ readings = [2.8, 2.8] }", (), ["were taken as rounded, thickness to 0.05 mm;"]),
    (THICKNESS, "[2.8, 2.9]", (), []),
    ("mass_g = 41.0", "mass_g = [41, 41]", (), ["were taken as rounded, mass to 1 g;"]),
    (THICKNESS, "{ mean = 11.5, sd = 0.1 }", (), ["the thickness is 1/9.9 of the shorter side", THICK]),
    (THICKNESS, "{ mean = 11.5, sd = 0.1 }", ("transverse_shear",), []),
    (THICKNESS, "{ mean = 11.3, sd = 0.1 }", (), []),
    ("clamped_mm = { x0 = 30 }", "clamped_mm = { x0 = 224 }", (), [THICK]),
    (NOISE, "{ median = 21, factor = 2 }", (), ["setup 'cantilever': a noise of 21 % leaves"]),
    (NOISE, "{ median = 19.9, factor = 2 }", (), []),
    ("{ mean = 310, sd = 2 }", "{ mean = 310, sd = 63 }", (), ["say next to nothing: (2,0)"]),
    ("{ mean = 310, sd = 2 }", "{ mean = 310, sd = 61 }", (), []),
    ("resolution_hz = 1\n", "resolution_hz = 10\n", (), ["rounded to multiples of 10 Hz, and 52 of (1,0)", "are none"]),
    ("resolution_hz = 1\n", "resolution_hz = 0.73\n", (), []),
    ("[448.8, 594.1]", "[448.8, 52]", (), ["the peak without a label at 52 Hz is where (1,0) is"]),
]


def test_what_is_assumed_or_doubtful_is_told(spoiled):
    for old, new, effects, said in TOLD:
        found = remarks(Board.from_text(spoiled(old, new), "my-board"), effects)

        assert len(found) == bool(said)
        for passage in said:
            assert passage in found[0]


def test_the_remarks_reach_the_notes_of_a_prepared_board(board_file, spoiled):
    board_file.write_text(spoiled(THICKNESS, "2.8"), encoding="utf-8")

    assert [note for note in prepare(board_file).board.notes if CALIPER in note] != []
