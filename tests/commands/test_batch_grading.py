"""What boards are graded by, in words: everything that cannot be read is said at once."""

from __future__ import annotations

import re

import pytest

import bayesplate
from bayesplate.commands.batch_grading import grading_request
from bayesplate.errors import InputError
from bayesplate.grading.figures import limit_told
from bayesplate.grading.matching import GradingRequest


def test_words_become_a_request_in_si_units():
    request = grading_request("E_x=5, density=3", ["E_x=11:14", "density=:450", "thickness=2.5:"], 20.0)

    assert request.match_percent == {"E_x": 5.0, "density": 3.0}
    assert request.limits == {"E_x": (11e9, 14e9), "density": (None, 450.0), "thickness": (0.0025, None)}
    assert request.rigidity == 20.0
    assert grading_request("7", [], None).match_percent == {"E_x": 7.0, "E_y": 7.0, "G_xy": 7.0}
    assert grading_request(None, [], None) == GradingRequest()
    told = [limit_told(name, limit) for name, limit in request.limits.items()]
    assert told == ["E_x from 11 to 14 GPa", "density up to 450 kg/m^3", "thickness from 2.5 mm"]


def test_everything_that_cannot_be_read_is_said_at_once():
    with pytest.raises(InputError) as refused:
        grading_request("E_x=0,Ey=5", ["E_z=3:4", "E_x=3", "E_y=:", "G_xy=a:b"], -3.0)

    said = str(refused.value)
    assert len(refused.value.faults) == 7
    assert "did you mean E_y?" in said
    assert '--limit E_x=3: wanted LEAST:GREATEST in GPa, one of them may be left away, got "3"' in said
    assert "--rigidity: wanted a positive number of N m, got -3" in said


def test_what_is_said_twice_is_refused_and_no_tolerance_is_nothing():
    with pytest.raises(InputError) as refused:
        grading_request("E_x=10,E_x=20", ["E_x=11:", "density=:450", "E_x=:12"], None)

    assert [str(fault) for fault in refused.value.faults] == [
        "--match: wanted each quantity once, got E_x again",
        "--limit E_x=:12: wanted each quantity once, got E_x again (both ends: LEAST:GREATEST)",
    ]
    with pytest.raises(InputError, match=r'^--match: wanted positive per cents up to 1000, .*, got "0"$'):
        grading_request("0", [], None)


RANGE = "positive numbers, the least before the greatest, at least one of them"


@pytest.mark.parametrize("ends", ["11:11", "0:"])
def test_limits_that_no_board_meets_are_refused_as_they_were_written(ends):
    with pytest.raises(InputError) as refused:
        grading_request(None, [f"E_x={ends}"], None)

    assert f'--limit E_x={ends}: wanted {RANGE}, got "{ends}"' in str(refused.value)


BAD = [
    (GradingRequest(match_percent=3), "dicts by the name of a figure, got int and dict"),
    (GradingRequest(match_percent={"E_z": 1.0}), "grading match_percent: wanted names of E_x, E_y, G_xy, density"),
    (GradingRequest(match_percent={"E_x": -1.0}), "grading match_percent E_x: wanted a positive number"),
    (GradingRequest(limits={"E_x": (None, None)}), f"grading limits E_x: wanted {RANGE}, got (None, None)"),
    (GradingRequest(limits={"E_x": 3.0}), "grading limits E_x: wanted a pair"),
    (GradingRequest(limits={"speed": (1.0, 2.0)}), "grading limits: wanted names of E_x"),
    (GradingRequest(rigidity=float("nan")), "grading rigidity: wanted a positive number of N m"),
]


def test_a_request_that_cannot_be_used_is_refused():
    for request, said in BAD:
        with pytest.raises(InputError, match=re.escape(said)):
            bayesplate.batch("boards", "out", grading=request)
