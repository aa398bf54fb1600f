"""Two causes of opposite signs, each of which alone raises the error: planted by the generator, and found."""

from __future__ import annotations

import numpy as np
import pytest
from generator.boards import plant
from made_searches import decided, visible_of
from validation.trial.cells import SENSORS
from validation.trial.shared import baseline_of_card

from bayesplate.diagnosis.joint import with_joint_pairs
from bayesplate.diagnosis.search import prepare_search, search

PAIR = {"fluid_loading", "membrane_tension"}
TRIED = (*PAIR, "clamp_rotation", "density_gradient")


@pytest.fixture(scope="module")
def ground():
    """A clamped guitar top in air, under tension, noise of 5 cents: one slows all modes, the other speeds them up."""
    planted = plant(np.random.default_rng(0), "clamped-9", tuple(sorted(PAIR)), 2.0, 5.0, sensor=SENSORS["clamped-9"])
    return prepare_search(baseline_of_card(planted), tried=TRIED)


def test_a_pair_is_found_of_which_neither_alone_lowers_the_misfit(ground):
    found = search(ground)
    base = ground.baseline

    def squares(residual):
        return np.sum(((residual - base.slopes @ (base.absorbing @ residual)) / base.scales) ** 2)

    beside = base.residual - visible_of(ground.candidates["fluid_loading"])
    assert squares(beside) > 2.0 * squares(base.residual)  # the error rises with what is there
    evidence = {one.members: value for one, value in zip(ground.hypotheses, found.log_evidence, strict=True)}
    assert all(evidence[(name,)] < evidence[()] for name in PAIR)
    joint = with_joint_pairs(found, ground)
    assert [set(one.members) for one in joint.hypotheses if one.joint] == [PAIR]
    verdict = decided(search(joint))
    assert (verdict.word, set(verdict.effects)) == ("named", PAIR)


def test_a_pair_is_formed_of_what_can_be_seen_not_of_what_does_well_alone(ground):
    seen = {name for name in ground.candidates if ground.candidates[name].trace >= 2.0}
    assert seen >= PAIR
    assert len(seen) < len(ground.candidates)
    pairs = {frozenset(one.members) for one in ground.hypotheses if len(one.members) == 2}
    assert pairs == {frozenset((a, b)) for a in seen for b in seen if a != b}
