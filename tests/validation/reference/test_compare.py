"""The comparison notices what moved, and nothing else: on made-up results, nothing is computed."""

from __future__ import annotations

from copy import deepcopy

import pytest
from validation.reference.differences import differences, times

PLATES = {"made": {"made_on": "a", "as stated": {"(1,1)": 129.0, "(2,0)": 281.0, "? 3": 308.0}}}
BOARDS = {
    "made": {
        "made_on": "a",
        "fit": {"constants": {"E_x": {"mean": 1e10, "sd": 2e8, "draws": 4e4}}, "cpu_s": 2.0},
        "diagnose": {
            "verdict": "named",
            "claim": True,
            "effects": ["transverse_shear"],
            "probability_of_none": 0.01,
            "after": {"leave_one_out_rms_cents": 10.0},
        },
    }
}
# A mean may move by 0.1 sd and 3 standard errors of two sets of 40,000 draws, together 0.121 sd or 2.4e7.


def _names_of(part, stored, computed):
    return [one.what for one in differences(part, stored, computed)]


@pytest.mark.parametrize(("factor", "found"), [(1.00005, []), (1.00007, ["as stated (2,0)"])])
def test_a_frequency_may_move_by_a_tenth_of_a_cent(factor, found):
    """A factor of 1.0000578 is 0.1 cent."""
    moved = deepcopy(PLATES)
    moved["made"]["as stated"]["(2,0)"] *= factor
    assert _names_of("plates", PLATES, moved) == found


@pytest.mark.parametrize(("cents", "found"), [(0.05, 0), (-0.65, 0), (0.15, 1), (-0.75, 1)])
def test_a_finer_mesh_is_no_difference(cents, found):
    """A mesh half again as fine lowers the mode by 0.3 cent: down to 0.6 cent, and a tenth, it may lie."""
    moved = deepcopy(PLATES)
    moved["made"]["as stated"]["(2,0)"] *= 2.0 ** (cents / 1200.0)
    assert len(differences("plates", PLATES, moved, {"made": {"cents": {"(2,0)": -0.3}}})) == found


def test_a_mode_that_lost_its_label_keeps_its_frequency():
    """The label of a mode near a veering may be told or not; a lost mode is noticed."""
    moved = deepcopy(PLATES)
    moved["made"]["as stated"] = {"(1,1)": 129.0, "(2,0)": 281.0, "(0,2)": 308.0}
    assert _names_of("plates", PLATES, moved) == []
    del moved["made"]["as stated"]["(0,2)"]
    assert _names_of("plates", PLATES, moved) == ["as stated"]


@pytest.mark.parametrize(
    ("path", "value", "found"),
    [
        (("fit", "constants", "E_x", "mean"), 1.0023e10, []),
        (("fit", "constants", "E_x", "mean"), 1.0025e10, ["fit constants E_x"]),
        (("fit", "constants", "E_x", "sd"), 2.3e8, ["fit constants E_x sd"]),
        (("fit", "cpu_s"), 20.0, []),
        (("diagnose", "verdict"), "unexplained", ["diagnose verdict"]),
        (("diagnose", "claim"), False, ["diagnose claim"]),
        (("diagnose", "effects"), ["warp"], ["diagnose effects"]),
        (("diagnose", "probability_of_none"), 0.012, []),
        (("diagnose", "probability_of_none"), 0.02, ["diagnose probability_of_none"]),
        (("diagnose", "after", "leave_one_out_rms_cents"), 10.4, []),
        (("diagnose", "after", "leave_one_out_rms_cents"), 10.6, ["diagnose after leave_one_out_rms_cents"]),
        (("diagnose", "after", "leave_one_out_rms_cents"), None, ["diagnose after leave_one_out_rms_cents"]),
    ],
)
def test_what_a_board_gives(path, value, found):
    """Each number and word by its own tolerance."""
    moved = deepcopy(BOARDS)
    *way, last = path
    at = moved["made"]
    for key in way:
        at = at[key]
    at[last] = value
    assert _names_of("boards", BOARDS, moved) == found


def test_times_stand_apart():
    """Commands with a time on both sides."""
    assert times(BOARDS, BOARDS) == {"made fit": (2.0, 2.0)}
