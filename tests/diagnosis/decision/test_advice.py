"""What to measure next: as measured it is what the search saw, and further readings only add."""

from __future__ import annotations

import pytest

from bayesplate.diagnosis.decision.advice import Option, options, recommendation
from bayesplate.diagnosis.evidence.search import search

ASKED = ("transverse_shear", "clamp_rotation")


@pytest.fixture(scope="module")
def told(finnish_few):
    return options(search(finnish_few.ground), ASKED)


def test_as_measured_the_options_begin_with_what_the_search_saw(finnish_few, told):
    ground = finnish_few.ground
    assert told[0].sentence == ""
    assert told[0].likeness == pytest.approx(abs(ground.cosine(*ASKED)), abs=0.1)
    assert told[0].seen == pytest.approx([ground.visibility(name) for name in ASKED], rel=0.1)


def test_further_readings_lower_no_visibility(told):
    """Readings more can only leave the constants less to absorb."""
    assert len(told) == 3
    assert all(option.visibility > 0.99 * told[0].visibility for option in told[1:])
    assert max(option.visibility for option in told[1:]) > 1.2 * told[0].visibility


def option(likeness, *seen, sentence="Measure more"):
    return Option(sentence, likeness, seen)


@pytest.mark.parametrize(
    ("now", "then", "words"),
    [
        # alike now, told apart then
        (option(0.99, 2.0, 3.0), option(0.2, 2.0, 3.0), "would fall from 0.99 to 0.20."),
        (option(0.60, 2.0, 3.0), option(0.54, 2.0, 3.0), "would fall from 0.60 to 0.54."),
        # hardly less alike, or still alike
        (option(0.60, 2.0, 3.0), option(0.56, 2.0, 3.0), ""),
        (option(0.999, 2.0, 3.0), option(0.951, 2.0, 3.0), ""),
        # one is hidden, and stays so, or comes into sight
        (option(0.99, 0.1, 3.0), option(0.2, 0.3, 3.0), ""),
        (option(0.99, 0.4, 3.0), option(0.2, 1.0, 3.0), "a would then show, with 1.0 times the smallest trace that can "
         "be seen (0.4 times now)."),
        (option(0.99, 0.4, 0.2), option(0.2, 1.5, 2.5), "a and b would then show, with 1.5 and 2.5 times the smallest "
         "trace that can be seen (0.4 and 0.2 times now)."),
        (option(0.99, 0.4, 0.2), option(0.2, 1.5, 0.9), ": a would then show, with 1.5 times"),
    ],
)  # fmt: skip
def test_advice_is_given_only_where_it_helps(monkeypatch, now, then, words):
    monkeypatch.setattr("bayesplate.diagnosis.decision.advice.options", lambda *_: (now, then))
    told = recommendation(None, ("a", "b"))
    assert words in told if words else told == ""


def test_of_several_ways_the_one_that_shows_most_is_recommended(monkeypatch):
    now, one, two = option(0.5, 0.1, 0.2), option(0.5, 5.0, 0.5, sentence="One"), option(0.5, 1.1, 1.2, sentence="Two")
    monkeypatch.setattr("bayesplate.diagnosis.decision.advice.options", lambda *_: (now, one, two))
    assert recommendation(None, ("a", "b")).startswith("Two: a and b would then show")
    two, one = option(0.5, 1.1, 1.2, 0.1, sentence="Two"), option(0.5, 1.5, 0.5, 0.5, sentence="One")
    now = option(0.5, 0.1, 0.2, 0.1)
    monkeypatch.setattr("bayesplate.diagnosis.decision.advice.options", lambda *_: (now, one, two))
    assert recommendation(None, ("a", "b", "c")).startswith("Two: a and b would then show")
    monkeypatch.setattr("bayesplate.diagnosis.decision.advice.options", lambda *_: (now,))
    assert recommendation(None, ("a", "b")) == recommendation(None, ()) == ""


def test_the_recommendation_names_the_effects_and_what_to_measure(finnish_few, told, monkeypatch):
    monkeypatch.setattr("bayesplate.diagnosis.decision.advice.options", lambda *_: told)
    sentence = recommendation(search(finnish_few.ground), ASKED)
    assert sentence.startswith("Measure ")
    assert "clamp rotation would then show" in sentence
