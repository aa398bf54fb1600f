"""Explained in part: each of its limits, on both sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from made_searches import baseline, candidate, decided, found_among, singles

from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis import claim
from bayesplate.diagnosis.claim import named_in_part
from bayesplate.diagnosis.folds import Nested
from bayesplate.diagnosis.search import PASSES, Found

N_MODES = 8
SIZE = Quantity.from_median(1.0, 1.5)
BOUNDED = Quantity.from_mean(0.4, 0.15, "normal", lower=0.0, upper=0.9)


def made(none=1e-6, rival=0.0, rest=0.1, prior=SIZE, planted=1.0) -> Found:
    """An effect that is there, and a rest that it cannot explain; probabilities are set by hand."""
    base = baseline(np.random.default_rng(1), N_MODES)
    directions = 0.1 * np.linalg.qr(np.random.default_rng(2).standard_normal((N_MODES, N_MODES)))[0][:3]
    effects = {n: candidate(base, n, d, prior) for n, d in zip("ab", directions[:2], strict=True)}
    shares = [none, (1.0 - none) * (1.0 - rival), (1.0 - none) * rival]
    other = rest / 0.1 * directions[2]
    residual = planted * directions[0] + other
    residual -= base.slopes @ (base.absorbing @ residual)
    return found_among(base, effects, singles(base, effects, prior=0.2), shares, residual)


def folded(ratio: float) -> Nested:
    before = 0.05 * np.ones((1, N_MODES))
    return Nested(before, ratio * before, np.ones((1, N_MODES), dtype=int))


def told(found: Found, ratio: float = 0.5, others=()) -> tuple[str, ...]:
    return named_in_part(found, decided(found), folded(ratio), others)


def test_what_is_certainly_there_and_not_all_is_named_in_part():
    found = made()
    verdict = decided(found)
    assert (verdict.word, verdict.effects, verdict.index) == ("unexplained", (), 0)
    assert found.p_value(1) < PASSES
    assert told(found) == ("a",)


def test_what_passes_the_gate_is_named_and_not_in_part():
    found = made(rest=0.0)
    assert decided(found).word == "named"
    assert told(found) == ()
    gated = replace(decided(made()), best=decided(found).best)  # were the word unexplained for another reason
    assert found.p_value(1) >= PASSES
    assert named_in_part(found, gated, folded(0.5), ()) == ()


def test_no_effect_is_less_probable_than_one_in_ten_thousand():
    for none, names in [(0.99e-4, ("a",)), (1.01e-4, ())]:
        assert told(made(none=none)) == names


def test_the_nested_left_out_error_falls_by_at_least_a_third():
    for ratio, names in [(0.666, ("a",)), (0.667, ()), (np.nan, ())]:
        assert told(made(), ratio) == names


def test_it_stands_out_by_three_to_one():
    for rival, names in [(0.24, ("a",)), (0.26, ())]:
        assert told(made(rival=rival)) == names


def test_its_name_survives_every_other_assumption():
    for rival, names in [(0.24, ("a",)), (0.26, ())]:
        assert told(made(), others=[("if the noise is 1.5 times larger", made(rival=rival))]) == names


def test_the_usual_variants_are_asked_where_none_are_given(monkeypatch):
    found = made()
    assert named_in_part(found, decided(found), folded(0.5), None) == ("a",)
    monkeypatch.setattr(claim, "variants", lambda found: iter([("with other priors", made(rival=0.26))]))
    assert named_in_part(found, decided(found), folded(0.5), None) == ()


def test_its_size_is_not_at_the_limit_of_its_range():
    for planted, names in [(1.0, ("a",)), (10.0, ())]:
        assert told(made(prior=BOUNDED, planted=planted)) == names


def test_a_verdict_that_is_not_unexplained_has_no_part():
    found = made()
    idle = replace(decided(found), is_needed=False)
    assert named_in_part(found, idle, folded(0.5), ()) == ()
