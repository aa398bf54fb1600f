"""Readings in another order than their modes are told, with the likelihood ratio where two may be exchanged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_searches import bare, baseline, ground_of, one_level

from bayesplate.diagnosis.evidence.hypotheses import RELABELLING, Hypothesis, Swap
from bayesplate.diagnosis.evidence.order import order_notes
from bayesplate.diagnosis.evidence.search import search
from bayesplate.diagnosis.shifts.tables import nothing

NOISE = 0.01
CLASSES = [(0, 0), (1, 1), (0, 0), (0, 0), (1, 1), (0, 0)]


def notes_of(raised, setups=1):
    """Notes on a board whose second reading is raised by so much of the distance to the third."""
    base = baseline(np.random.default_rng(1), parities=CLASSES, spacing=0.08, noise=(0.005,) * setups)
    base = replace(base, residual=raised * 0.08 * np.eye(6)[1])
    found = search(ground_of(base, bare(base, one_level(base, NOISE))))
    return order_notes(found), found


@pytest.mark.parametrize(("raised", "told"), [(0.0, 0), (0.99, 0), (1.01, 1), (1.99, 1), (2.01, 2)])
def test_two_readings_in_the_other_order_are_told(raised, told):
    """Of one symmetry class or of two, neighbours or not."""
    notes, _ = notes_of(raised)
    assert len(notes) == told
    for note, other in zip(notes, ("(2,0)", "(3,0)"), strict=False):
        assert note.startswith(
            f"the readings (1,0) and {other} stand in the other order than these modes of the fitted"
        )
        assert note.endswith("): compare their figures again")


def test_the_likelihood_ratio_of_the_exchange_is_told():
    """It is that of the hypothesis that exchanges them."""
    (note,), found = notes_of(1.1)
    ground = found.ground
    swap = Hypothesis((RELABELLING,), 0.1, nothing(6), one_level(ground.baseline, NOISE), Swap(1, 2))
    both = search(ground_of(ground.baseline, ground.hypotheses[0], swap), found.residual)
    gained = both.log_evidence[1] - both.log_evidence[0]
    assert 1.0 < gained < np.log(1e6)
    assert f"(with these labels exchanged the readings are {np.exp(gained):.3g} times likelier)" in note


def test_readings_of_two_setups_have_no_order():
    """The second reading stands above the third, which belongs to the same setup, and above the fourth of another."""
    notes, _ = notes_of(3.5, setups=2)
    assert len(notes) == 1
    assert "(1,0) and (2,0) in setup setup-0" in notes[0]
