"""What to measure next: as measured it is what the search saw, and further readings only add."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.diagnosis.decision.advice import options, recommendation
from bayesplate.diagnosis.evidence.search import search

ASKED = ("transverse_shear", "clamp_rotation")


@pytest.fixture(scope="module")
def told(finnish):
    return options(search(finnish.ground), ASKED)


def test_as_measured_the_options_begin_with_what_the_search_saw(finnish, told):
    ground = finnish.ground
    assert told[0].sentence == ""
    assert told[0].likeness == pytest.approx(abs(ground.cosine(*ASKED)), abs=0.1)
    assert told[0].visibility == pytest.approx(min(ground.visibility(name) for name in ASKED), rel=0.1)


def test_further_readings_lower_no_visibility(told):
    """Readings more can only leave the constants less to absorb."""
    assert len(told) == 3
    assert all(option.visibility > 0.99 * told[0].visibility for option in told[1:])
    assert max(option.visibility for option in told[1:]) > 1.2 * told[0].visibility


def test_the_recommendation_names_the_effects_and_what_to_measure(finnish):
    found = search(finnish.ground)
    sentence = recommendation(found, ASKED)
    assert sentence.startswith("Measure ")
    assert all(words in sentence for words in ("transverse shear", "clamp rotation"))
    assert "the same modes again" in recommendation(found, ())
    assert np.char.count(sentence, ". ") <= 3
