"""Explained in part: each of its limits, on both sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_searches import baseline, candidate, decided, found_among, singles

from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis import claim
from bayesplate.diagnosis.claim import effects_named_in_part
from bayesplate.diagnosis.folds import NestedErrors
from bayesplate.diagnosis.search import LEAST_P_VALUE, SearchResult

N_MODES = 8
SIZE = Quantity.from_median(1.0, 1.5)
BOUNDED = Quantity.from_mean(0.4, 0.15, "normal", lower=0.0, upper=0.9)


def made(none=1e-6, rival=0.0, rest=0.1, prior=SIZE, planted=1.0) -> SearchResult:
    """An effect that is there, and a rest that it cannot explain; probabilities are set by hand."""
    base = baseline(np.random.default_rng(1), N_MODES)
    directions = 0.1 * np.linalg.qr(np.random.default_rng(2).standard_normal((N_MODES, N_MODES)))[0][:3]
    effects = {n: candidate(base, n, d, prior) for n, d in zip("ab", directions[:2], strict=True)}
    shares = [none, (1.0 - none) * (1.0 - rival), (1.0 - none) * rival]
    other = rest / 0.1 * directions[2]
    residual = planted * directions[0] + other
    residual -= base.slopes @ (base.absorption @ residual)
    return found_among(base, effects, singles(base, effects, prior=0.2), shares, residual)


def folded(ratio: float) -> NestedErrors:
    before = 0.05 * np.ones((1, N_MODES))
    return NestedErrors(before, ratio * before, np.ones((1, N_MODES), dtype=int))


LIMITS = [
    ({}, 0.5, None, True),  # certainly there, and not all
    ({"none": 0.99e-4}, 0.5, None, True),  # no effect is less probable than one in ten thousand
    ({"none": 1.01e-4}, 0.5, None, False),
    ({}, 0.666, None, True),  # the nested leave-one-out error falls by a third
    ({}, 0.667, None, False),
    ({}, np.nan, None, False),
    ({"rival": 0.24}, 0.5, None, True),  # it stands out by three to one
    ({"rival": 0.26}, 0.5, None, False),
    ({}, 0.5, 0.24, True),  # and does so with another noise
    ({}, 0.5, 0.26, False),
    ({"prior": BOUNDED}, 0.5, None, True),  # its size is not at the limit of its range
    ({"prior": BOUNDED, "planted": 10.0}, 0.5, None, False),
]
"""Of a search: what it is made with, the nested ratio, and how probable a rival is under another assumption."""


@pytest.mark.parametrize(("changed", "ratio", "rival_elsewhere", "is_named"), LIMITS)
def test_each_limit_of_what_is_named_in_part(changed, ratio, rival_elsewhere, is_named):
    found = made(**changed)
    verdict = decided(found)
    assert (verdict.word, verdict.effects, verdict.index) == ("unexplained", (), 0)
    others = [] if rival_elsewhere is None else [("with another noise", made(rival=rival_elsewhere))]
    assert effects_named_in_part(found, verdict, folded(ratio), others) == (("a",) if is_named else ())


def test_what_passes_the_gate_is_named_and_not_in_part():
    found = made(rest=0.0)
    assert decided(found).word == "named"
    gated = replace(decided(made()), best=decided(found).best)  # were the word unexplained for another reason
    assert found.p_value(1) >= LEAST_P_VALUE
    for verdict in (decided(found), gated):
        assert effects_named_in_part(found, verdict, folded(0.5), ()) == ()


def test_the_usual_variants_are_asked_where_none_are_given(monkeypatch):
    found = made()
    assert effects_named_in_part(found, decided(found), folded(0.5), None) == ("a",)
    monkeypatch.setattr(claim, "variant_searches", lambda found: iter([("with other priors", made(rival=0.26))]))
    assert effects_named_in_part(found, decided(found), folded(0.5), None) == ()


def test_a_verdict_that_is_not_unexplained_has_no_part():
    found = made()
    idle = replace(decided(found), is_needed=False)
    assert effects_named_in_part(found, idle, folded(0.5), ()) == ()
