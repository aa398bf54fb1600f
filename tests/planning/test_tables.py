"""The first line: said where something would help, and silent where nothing would."""

from __future__ import annotations

from dataclasses import asdict, replace

import pytest

from bayesplate.campaign.tables import shared_words
from bayesplate.planning.gains import GOALS
from bayesplate.planning.plan import ExplanationEntry, Gain, ProposalEntry
from bayesplate.planning.proposals import Costs
from bayesplate.planning.tables import first_line


def explained(words, *effects):
    return ExplanationEntry(effects, words, 0.5)


NOTHING, AIR = explained("no effect"), explained("fluid loading", "fluid_loading")
PAIR = (explained("shear and grain", "shear", "grain"), *(explained(name, name) for name in ("shear", "grain", "air")))


def gain(E_x=1.0, E_y=1.0, G_xy=1.0, doubt=0.0, error=0.0, constants_error=0.0, shared=()):
    return Gain(E_x, E_y, G_xy, 0.0, constants_error, doubt, error, 0.0, dict(shared), 0.0, 0.0)


def line(*gains, goal=None, explanations=(NOTHING, AIR), entropy=0.6):
    """The first line of a plan of proposals; without doubt where there is one explanation."""
    if len(explanations) == 1:
        gains = [replace(one, explanations=None, explanations_error=None) for one in gains]
    named = zip(("Do this", "Do that"), gains, strict=False)
    listed = [ProposalEntry("modes", "", "", sentence, 1.0, (), one) for sentence, one in named]
    return first_line(listed, explanations, entropy, goal)


def line_of_one(*gains, goal=None):
    return line(*gains, goal=goal, explanations=(NOTHING,), entropy=0.0)


def test_doubt_and_intervals_are_told_with_their_numbers():
    one = gain(0.5, 0.8, 0.99, 0.3, 0.01)

    shrink = "intervals of E_x and E_y would shrink to 50 and 80 % of what they are."
    doubt = "the doubt between no effect and fluid loading would fall by 50 %"
    assert line(one) == f"Do this: {doubt} and the {shrink}"
    assert line_of_one(one) == f"Do this: the {shrink}"
    assert line_of_one(gain(E_y=0.88)) == "Do this: the interval of E_y would shrink to 88 % of what it is."


def test_two_effects_that_are_one_explanation_are_told_from_each_alone():
    told = line(gain(doubt=0.5, error=0.01), explanations=PAIR, entropy=1.0)

    assert "between shear and grain together, shear alone, grain alone and air would fall" in told


@pytest.mark.parametrize(
    ("one", "says"),
    [
        (gain(0.9, 0.9, 0.9), True),
        (gain(0.96, 0.96, 0.96), False),  # by less than a twentieth
        (gain(0.96, 0.96, 0.96, doubt=0.04), False),  # nor does the sum of many small gains count
        (gain(doubt=0.06, error=0.01), True),
        (gain(doubt=0.04, error=0.001), False),
        (gain(doubt=0.06, error=0.04), False),  # within two standard errors of nothing
        (gain(0.9, 0.9, 0.9, constants_error=0.06), False),
    ],
)
def test_nothing_is_said_of_what_would_not_help(one, says):
    assert bool(line(one)) is says


def test_what_was_not_asked_for_does_not_help():
    helps = {goal: bool(line(gain(E_y=0.5, doubt=0.04), goal=goal)) for goal in (*GOALS, None)}
    assert helps == {"E_x": False, "E_y": True, "G_xy": False, "constants": True, "explanations": False, None: True}


def test_costs_have_the_classes_that_users_name():
    assert asdict(Costs()) == {"reading": 1.0, "clamping": 10.0, "board": 30.0}
    assert Costs.names() == ("reading", "clamping", "board")


def test_a_campaign_is_told_what_its_boards_share_or_their_constants():
    shared = {"transverse_shear.G_xz / E_x": 0.9, "attached_mass.mass": 0.034, "fluid_loading.density": 0.99}
    told, bare, hardly = (gain(0.5, shared=one) for one in (shared, {}, {"fluid_loading.density": 0.96}))

    shrink = "the intervals of G_xz / E_x and attached mass would shrink to 90 and 3.4 % of what they are."
    of_constants = "Do this: the interval of E_x would shrink to 50 % of what it is."
    assert line_of_one(told) == f"Do this: {shrink}"
    assert line_of_one(bare) == of_constants
    assert line_of_one(told, goal="E_x") == line_of_one(told, goal="constants") == of_constants
    assert line_of_one(hardly) == line_of_one() == line_of_one(told, goal="E_y") == ""
    assert shared_words("fluid_loading.density") == "density of fluid loading"


def test_the_first_line_is_of_the_best_proposal_that_would_help():
    found = line(gain(0.96, 0.96, 0.96, doubt=0.04), gain(E_y=0.88))

    assert found == "Do that: the interval of E_y would shrink to 88 % of what it is."
    assert line() == ""
