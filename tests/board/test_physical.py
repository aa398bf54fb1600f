"""A card that follows the format but describes what cannot be is refused with the reason."""

from __future__ import annotations

from bayesplate.board.board import Board
from bayesplate.board.checks import physical_faults
from bayesplate.errors import Fault

ON_BOARD = "a place on the free part of the board, x 30 to 253 mm, y 0 to 114 mm"
CORNER = "from the corner of x0 and y0 of the whole board"

CASES = [
    ("at_mm = [200, 20]", "at_mm = [260, 20]", "[setup] attached 1 at_mm", ON_BOARD, "[260, 20]", CORNER),
    ("at_mm = [200, 20]", "at_mm = [[200, 20], [20, 20]]", "[setup] attached 1 at_mm 2", ON_BOARD, "[20, 20]", CORNER),
    ("at_mm = [60, 20]", "at_mm = [60, -1]", "[setup] hammer.at_mm", ON_BOARD, "[60, -1]", CORNER),
    ("{ mean = 0.6, sd = 0.1 }", "41", "[setup] attached 1 mass_g", "less than the board's own 41 g", "41 g", ""),
    ("first_label = [1, 0]", "first_label = [2, 0]", '[setup] frequencies_hz."(1,0)"',
     "labels not below first_label, (2,0)",
     "(1,0)", "first_label = [1, 0]?"),
    ("{ x0 = 30 }", "{ x0 = 253 }", "[setup] clamped_mm", "clamps that leave a part of the 253 mm along x free",
     "253 mm clamped at x0, free only up to 253 mm", ""),
    ("resolution_hz = 1\n", "resolution_hz = 50\n", "[setup] resolution_hz",
     "a rounding finer than the spacing of (1,0) and (1,1), 46.3333 Hz", "50 Hz", "these labels cannot be told apart"),
    ("mass_g = 41.0", "mass_g = 0.041", "[plate] mass_g", "a density from 20 to 25000 kg/m3", "0.474 kg/m3",
     "0.041 kg is 41 g"),
    ("mass_g = 41.0", "mass_g = 1.45", "[plate] mass_g", "a density from 20 to 25000 kg/m3", "16.8 kg/m3",
     "1.45 oz is 41.11 g"),
    ("mass_g = 41.0", "density_kg_m3 = 4.7", "[plate] density_kg_m3", "a density from 20 to 25000 kg/m3", "4.7 kg/m3",
     "mass in g, density in kg/m3, lengths in mm"),
    ("{ mean = 3.0, sd = 0.03 }", "60", "[plate] thickness_mm", "at most half the shorter side, 57 mm", "60 mm",
     "no plate is so thick; 60 thousandths of an inch would be 1.52 mm"),
    ("length_x_mm = 253\nlength_y_mm = 114", "length_x_mm = 9.96\nlength_y_mm = 4.49", "[plate] mass_g",
     "a density from 20 to 25000 kg/m3", "3.06e+05 kg/m3", "sides of 9.96 and 4.49 inches would be 253 and 114 mm"),
    ("length_x_mm = 253\nlength_y_mm = 114", "length_x_mm = 9.96\nlength_y_mm = 4.49", "[plate] thickness_mm",
     "at most half the shorter side, 2.245 mm", "3 mm",
     "no plate is so thick; sides of 9.96 and 4.49 inches would be 253 and 114 mm"),
    ("{ mean = 3.0, sd = 0.03 }", "{ readings = [3, 3], at_x_mm = [0, 254], at_y_mm = [0, 0] }",
     "[plate] thickness_mm.at_x_mm 2", "a place on the board, 0 to 253 mm", "254 mm", ""),
    ("length_y_mm = 114", "length_y_mm = { readings = [114, 113], at_x_mm = [-1, 9] }", "[plate] length_y_mm.at_x_mm 1",
     "a place on the board, 0 to 253 mm", "-1 mm", ""),
]  # fmt: skip


def faults_of(text: str) -> list[Fault]:
    return physical_faults(Board.from_text(text, "my-board"))


def test_a_sound_card_has_none(board_text):
    assert faults_of(board_text) == []


def test_one_fault(spoiled):
    for old, new, place, wanted, got, remedy in CASES:
        expected = Fault(f"my-board.toml {place}", wanted, got, remedy)

        assert expected in faults_of(spoiled(old, new))


def test_all_faults_at_once(spoiled):
    text = spoiled("at_mm = [200, 20]", "at_mm = [260, 20]")
    text = spoiled("mass_g = 41.0", "mass_g = 0.041", text)
    text = spoiled("first_label = [1, 0]", "first_label = [2, 0]", text)

    places = [fault.place for fault in faults_of(text)]

    assert places == [
        "my-board.toml [plate] mass_g",
        'my-board.toml [setup] frequencies_hz."(1,0)"',
        'my-board.toml [setup] frequencies_hz."(1,1)"',
        "my-board.toml [setup] attached 1 at_mm",
        "my-board.toml [setup] attached 1 mass_g",
    ]
