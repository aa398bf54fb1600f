"""What a diagnosis advises by its verdict: a reading to take again, effects to tell apart, or nothing."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from bayesplate.diagnosis.decision.verdict import Answer, Verdict
from bayesplate.workflow.diagnose import advice, asked_about

FOUND = SimpleNamespace(ground=SimpleNamespace(candidates=("shear", "air", "mass", "grain")))


@pytest.fixture
def ranked(monkeypatch):
    """Four answers, of which a group has those within a factor ten of the best."""

    def of(*supports):
        names = zip(("shear", "air", "mass", "grain"), supports, strict=False)
        answers = tuple(Answer((name,), i, share) for i, (name, share) in enumerate(names, 1))
        monkeypatch.setattr("bayesplate.workflow.diagnose.answers", lambda _: answers)

    return of


def verdict(word, index=0):
    return Verdict(word, (), index, None, "")


def test_alternatives_are_told_apart_and_a_winner_without_rival_from_nobody(ranked):
    ranked(0.6, 0.3, 0.05, 0.01)
    assert asked_about(FOUND, verdict("indistinguishable group", 1)) == ("shear", "air")
    assert asked_about(FOUND, verdict("none needed")) == ("shear", "air", "mass")
    ranked(0.9, 0.01)
    assert asked_about(FOUND, verdict("named", 1)) == ()
    ranked(0.8, 0.1)
    assert asked_about(FOUND, verdict("named", 1)) == ("shear", "air")
    ranked(0.9, 0.01)
    turned = tuple(Answer((name,), i, 0.0) for i, name in ((1, "shear"), (3, "mass")))
    group = replace(verdict("indistinguishable group", 1), stands_for=turned)
    assert asked_about(FOUND, group) == ("shear", "mass")


def test_where_nothing_explains_the_readings_only_a_wrong_one_is_told(ranked, monkeypatch):
    ranked(0.6, 0.3)
    monkeypatch.setattr("bayesplate.workflow.diagnose.wrong_reading", lambda _: "Read (1,1) again.")
    monkeypatch.setattr("bayesplate.workflow.diagnose.recommendation", lambda *_: "Measure more.")
    told = {word: advice(FOUND, verdict(word)) for word in ("unexplained", "none needed", "undetectable")}
    assert told == {
        "unexplained": "Read (1,1) again.", "none needed": "Measure more.", "undetectable": "Measure more.",
    }  # fmt: skip
