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

CLASSES = [(0, 0), (1, 1), (0, 0), (0, 0), (1, 1), (0, 0)]


def notes_of(raised, swap=None, setups=1):
    """Notes on a board whose second reading is raised by so much of the distance to the third."""
    base = baseline(np.random.default_rng(1), parities=CLASSES, spacing=0.08, noise=(0.005,) * setups)
    ranked = [replace(p, rank=[q.parity for q in base.places[:i]].count(p.parity)) for i, p in enumerate(base.places)]
    base = replace(base, places=tuple(ranked), residual=raised * 0.08 * np.eye(6)[1])
    noise = one_level(base)
    swaps = [Hypothesis((RELABELLING,), 0.1, nothing(6), noise, Swap(*swap))] if swap else []
    found = search(ground_of(base, bare(base, noise), *swaps))
    return order_notes(found), found


@pytest.mark.parametrize(("raised", "told"), [(0.0, 0), (0.99, 0), (1.01, 1), (2.5, 2)])
def test_two_readings_in_the_other_order_are_told(raised, told):
    notes, _ = notes_of(raised)
    assert len(notes) == told
    if told:
        assert notes[0] == (
            "the readings (1,0) and (2,0) stand in the other order than these modes of the fitted plate: compare their "
            "figures again"
        )


def test_the_likelihood_ratio_of_the_exchange_is_told():
    (note,), found = notes_of(1.5, swap=(1, 2))
    ratio = np.exp(found.log_evidence[1] - found.log_evidence[0])
    assert ratio > 1.0
    words = "more than a million" if ratio > 1e6 else f"{ratio:.3g}"
    assert f"(with these labels exchanged the readings are {words} times likelier)" in note


def test_readings_of_two_setups_have_no_order():
    """The second reading stands above the third, which belongs to the same setup, and above the fourth of another."""
    notes, _ = notes_of(3.5, setups=2)
    assert len(notes) == 1
    assert "(1,0) and (2,0) in setup setup-0" in notes[0]
