"""What a diagnosis advises by its verdict: a reading to take again, the first line of the plan, or nothing."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from bayesplate.commands.diagnose import advice
from bayesplate.diagnosis.verdict import Answer, Verdict


@pytest.fixture
def asked(monkeypatch):
    """Which rivals of the verdict the plan was asked to keep."""
    kept = []
    monkeypatch.setattr("bayesplate.commands.diagnose.wrong_reading", lambda _: "Read (1,1) again.")
    monkeypatch.setattr("bayesplate.commands.diagnose.survivors", lambda _, rivals: kept.append(rivals) or ())
    monkeypatch.setattr("bayesplate.commands.diagnose.believed", lambda *_: None)
    monkeypatch.setattr("bayesplate.commands.diagnose.Planner", lambda *_: SimpleNamespace(ranked=tuple))
    monkeypatch.setattr("bayesplate.commands.diagnose.first_of", lambda *_: "Measure more.")
    return kept


def verdict(word, *stands_for):
    return Verdict(word, (), 0, None, "", stands_for=stands_for)


def test_where_nothing_explains_the_readings_only_a_wrong_one_is_told(asked):
    told = {word: advice(None, verdict(word), None, 1) for word in ("unexplained", "none needed", "undetectable")}
    assert told == {
        "unexplained": "Read (1,1) again.", "none needed": "Measure more.", "undetectable": "Measure more.",
    }  # fmt: skip


def test_alternatives_of_a_verdict_survive_whatever_their_probability(asked):
    advice(None, verdict("indistinguishable group", Answer(("shear",), 1, 0.9), Answer(("mass",), 3, 0.0)), None, 1)
    assert asked == [[("shear",), ("mass",)]]
