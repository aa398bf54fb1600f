"""The sentence on peaks that are other modes once an effect has been added."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_boards import setup_of

from bayesplate.board.board import make_board
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.words import relabelled_sentence

FREE = {"x0": "free", "x1": "free", "y0": "free", "y1": "free"}
INPUTS = {"thickness": Quantity.exact(3e-3)}


def board_of(labels, name="free"):
    return make_board("made", INPUTS, (setup_of(FREE, labels, name=name),))


@pytest.mark.parametrize("where", ["", " in setup free"], ids=["one setup", "several"])
def test_only_labels_that_changed_are_told_with_the_setup_where_there_are_several(where):
    before = board_of({(1, 1): 60.0, (3, 0): 199.67, (3, 2): 421.75, (6, 0): 930.0})
    after = board_of({(1, 1): 60.0, (1, 2): 199.67, (0, 3): 421.75, (5, 2): 862.0})
    if where:
        second = board_of({(2, 0): 70.0}, "clamped").setups
        before, after = (replace(one, setups=(*one.setups, *second)) for one in (before, after))
    assert relabelled_sentence(before, before, "transverse shear") == ""
    assert relabelled_sentence(before, after, "transverse shear") == (
        f"With transverse shear some peaks are other modes: 199.67 Hz{where} is (1,2) (it was (3,0)), 421.75 Hz{where} "
        f"is (0,3) (it was (3,2)), 862 Hz{where} is (5,2) (it had no likely mode) and 930 Hz{where} is no likely mode "
        "(it was (6,0))."
    )
