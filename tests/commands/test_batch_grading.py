"""What boards are graded by, in words: everything that cannot be read is said at once."""

from __future__ import annotations

import pytest

from bayesplate.commands.batch_grading import grading_request
from bayesplate.errors import InputError
from bayesplate.grading.figures import limit_text
from bayesplate.grading.matching import GradingRequest


def test_words_become_a_request_in_si_units():
    request = grading_request("E_x=5, density=3", ["E_x=11:14", "density=:450", "thickness=2.5:"], 20.0)

    assert request.match_percent == {"E_x": 5.0, "density": 3.0}
    assert request.limits == {"E_x": (11e9, 14e9), "density": (None, 450.0), "thickness": (0.0025, None)}
    assert request.rigidity == 20.0
    assert grading_request("7", [], None).match_percent == {"E_x": 7.0, "E_y": 7.0, "G_xy": 7.0}
    assert grading_request(None, [], None) == GradingRequest()
    told = [limit_text(name, limit) for name, limit in request.limits.items()]
    assert told == ["E_x from 11 to 14 GPa", "density up to 450 kg/m^3", "thickness from 2.5 mm"]


PERCENTS = "--match: wanted positive per cents up to 1000, as 10 or E_x=10,E_y=15, of E_x, E_y, G_xy, density, got"
ENDS = "wanted LEAST:GREATEST in GPa, one of them may be left away, got"
RANGE = "wanted positive numbers, the least before the greatest, at least one of them, got"
ONCE = "wanted each quantity once, got E_x again"


def test_everything_that_cannot_be_read_is_said_at_once():
    for match, limits, rigidity, faults in (
        (
            "E_x=0,Ey=5", ["E_z=3:4", "E_x=3", "E_y=:", "G_xy=a:b"], -3.0,
            [f'{PERCENTS} "E_x=0"', f'{PERCENTS} "Ey=5" (did you mean E_y?)', "--limit E_z=3:4: wanted one of E_x",
             f'--limit E_x=3: {ENDS} "3"', f'--limit E_y=:: {ENDS} ":"', f'--limit G_xy=a:b: {ENDS} "a:b"',
             "--rigidity: wanted a positive number of N m, got -3"],
        ),
        (
            "E_x=10,E_x=20", ["E_x=11:", "density=:450", "E_x=:12"], None,
            [f"--match: {ONCE}", f"--limit E_x=:12: {ONCE} (both ends: LEAST:GREATEST)"],
        ),
        (",", [], None, [f'{PERCENTS} ","']),
        ("0", ["E_x=11:11"], None, [f'{PERCENTS} "0"', f'--limit E_x=11:11: {RANGE} "11:11"']),
        (None, ["E_x=0:"], None, [f'--limit E_x=0:: {RANGE} "0:"']),
    ):  # fmt: skip
        with pytest.raises(InputError) as refused:
            grading_request(match, limits, rigidity)
        for said, fault in zip(refused.value.faults, faults, strict=True):
            assert str(said).startswith(fault)
