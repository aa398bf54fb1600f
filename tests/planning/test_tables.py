"""The first line: said where something would help, and silent where nothing would."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from bayesplate.campaign.tables import shared_words
from bayesplate.planning.gains import GOALS
from bayesplate.planning.plan import ExplanationEntry, Gain, ProposalEntry
from bayesplate.planning.proposals import Costs
from bayesplate.planning.tables import first_line


def explained(words, *effects):
    return ExplanationEntry(effects, words, 0.5)


TWO = SimpleNamespace(explanations=(explained("no effect"), explained("fluid loading", "fluid_loading")), entropy=0.6)
ONE = SimpleNamespace(explanations=TWO.explanations[:1], entropy=0.0)


def gain(constants=(1.0, 1.0, 1.0), explanations=0.0, error=0.0, constants_error=0.0, shared=()):
    return Gain(*constants, 0.0, constants_error, explanations, error, 0.0, dict(shared), 0.0, 0.0)


def without_doubt(one):
    return replace(one, explanations=None, explanations_error=None)


def line(sentence, one, beliefs, goal):
    return line_of([(sentence, one)], beliefs, goal)


def line_of(listed, beliefs, goal=None):
    entries = [ProposalEntry("modes", "", "", sentence, 1.0, (), one) for sentence, one in listed]
    return first_line(entries, beliefs.explanations, beliefs.entropy, goal)


def test_doubt_and_intervals_are_told_with_their_numbers():
    one = gain((0.5, 0.8, 0.99), 0.3, 0.01)

    assert line("Do it", one, TWO, None) == (
        "Do it: the doubt between no effect and fluid loading would fall by 50 % and the "
        "intervals of E_x and E_y would shrink to 50 and 80 % of what they are."
    )
    assert line("Do it", without_doubt(one), ONE, None) == (
        "Do it: the intervals of E_x and E_y would shrink to 50 and 80 % of what they are."
    )


def test_two_effects_that_are_one_explanation_are_told_from_each_alone():
    pair = explained("shear and grain", "shear", "grain")
    alone = [explained(name, name) for name in ("shear", "grain", "air")]
    three = SimpleNamespace(explanations=(pair, *alone), entropy=1.0)

    assert "between shear and grain together, shear alone, grain alone and air would fall" in line(
        "Do it", gain(explanations=0.5, error=0.01), three, None
    )


@pytest.mark.parametrize(
    ("one", "says"),
    [
        (gain((0.9, 0.9, 0.9)), True),
        (gain((0.96, 0.96, 0.96)), False),  # by less than a twentieth
        (gain(explanations=0.06, error=0.01), True),
        (gain(explanations=0.04, error=0.001), False),
        (gain(explanations=0.06, error=0.04), False),  # within two standard errors of nothing
        (gain((0.9, 0.9, 0.9), constants_error=0.06), False),
    ],
)
def test_nothing_is_said_of_what_would_not_help(one, says):
    assert bool(line("Do it", one, TWO, None)) is says


def test_one_interval_that_shrinks_is_told_and_many_small_gains_are_not_told_without_words():
    """By a twentieth is said of each: the mean over the three does not count, and neither does the sum of all."""
    one, small = gain((1.0, 0.88, 1.0)), gain((0.96, 0.96, 0.96), 0.04)

    assert (
        line("Do it", without_doubt(one), ONE, None) == "Do it: the interval of E_y would shrink to 88 % of what it is."
    )
    assert line("Do it", small, TWO, None) == ""


def test_what_was_not_asked_for_does_not_help():
    one = gain((1.0, 0.5, 1.0), 0.04)
    helps = {goal: bool(line("Do it", one, TWO, goal)) for goal in (*GOALS, None)}
    assert helps == {"E_x": False, "E_y": True, "G_xy": False, "constants": True, "explanations": False, None: True}


def test_costs_have_the_classes_that_users_name():
    assert Costs.names() == ("reading", "clamping", "board")
    assert (Costs().reading, Costs().clamping, Costs().board) == (1.0, 10.0, 30.0)


def test_a_campaign_is_told_what_its_boards_share_or_their_constants():
    shared = {"transverse_shear.G_xz / E_x": 0.9, "attached_mass.mass": 0.034, "fluid_loading.density": 0.99}
    told, bare = (without_doubt(gain((0.5, 1.0, 1.0), shared=one)) for one in (shared, {}))
    hardly = without_doubt(gain((0.5, 1.0, 1.0), shared={"fluid_loading.density": 0.96}))

    assert line("Weigh it", told, ONE, None) == (
        "Weigh it: the intervals of G_xz / E_x and attached mass would shrink to 90 and 3.4 % of what they are."
    )
    of_constants = "Weigh it: the interval of E_x would shrink to 50 % of what it is."
    assert line("Weigh it", bare, ONE, None) == of_constants
    assert line("Weigh it", told, ONE, "E_x") == line("Weigh it", told, ONE, "constants") == of_constants
    assert line("Weigh it", hardly, ONE, None) == line_of([], ONE) == ""
    assert line("Weigh it", told, ONE, "E_y") == ""
    assert shared_words("fluid_loading.density") == "density of fluid loading"


def test_the_first_line_is_of_the_best_proposal_that_would_help():
    small, one = gain((0.96, 0.96, 0.96), 0.04), gain((1.0, 0.88, 1.0))

    found = line_of([("Do this", small), ("Do that", one)], TWO)
    assert found == "Do that: the interval of E_y would shrink to 88 % of what it is."
    assert line_of([("Do this", small)], TWO) == line_of([], TWO) == ""
