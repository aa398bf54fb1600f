"""The first line: said where something would help, and silent where nothing would."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from bayesplate.planning.drawn_up import first_of
from bayesplate.planning.gains import Gain
from bayesplate.planning.proposals import GOALS, Costs, score
from bayesplate.planning.words import campaign_line, first_line, shared_words


def explained(words, *members):
    return SimpleNamespace(words=words, members=members)


TWO = SimpleNamespace(explanations=(explained("no effect"), explained("fluid loading", "fluid_loading")), entropy=0.6)
ONE = SimpleNamespace(explanations=TWO.explanations[:1], entropy=0.0)


def gain(constants=(1.0, 1.0, 1.0), explanations=0.0, error=0.0, constants_error=0.0):
    return Gain(*constants, explanations, error, constants_error, 0.0)


def test_doubt_and_intervals_are_told_with_their_numbers():
    one = gain((0.5, 0.8, 0.99), 0.3, 0.01)

    assert first_line("Do it", one, TWO, None) == (
        "Do it: the doubt between no effect and fluid loading would fall by 50 % (0.30 ± 0.01 of 0.60 nats) and the "
        "intervals of E_x and E_y would shrink to 0.50 and 0.80 of what they are."
    )
    assert first_line("Do it", one, ONE, None) == (
        "Do it: the intervals of E_x and E_y would shrink to 0.50 and 0.80 of what they are."
    )


def test_two_effects_that_are_one_explanation_are_told_from_each_alone():
    pair = explained("shear and grain", "shear", "grain")
    alone = [explained(name, name) for name in ("shear", "grain", "air")]
    three = SimpleNamespace(explanations=(pair, *alone), entropy=1.0)

    assert "between shear and grain together, shear alone, grain alone and air would fall" in first_line(
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
    assert bool(first_line("Do it", one, TWO, None)) is says


def test_one_interval_that_shrinks_is_told_and_many_small_gains_are_not_told_without_words():
    """By a twentieth is said of each: the mean over the three does not count, and neither does the sum of all."""
    one, small = gain((1.0, 0.88, 1.0)), gain((0.96, 0.96, 0.96), 0.04)

    assert first_line("Do it", one, ONE, None) == "Do it: the interval of E_y would shrink to 0.88 of what it is."
    assert first_line("Do it", small, TWO, None) == ""


def test_what_was_not_asked_for_does_not_help():
    one = gain((1.0, 0.5, 1.0), 0.04)
    helps = {goal: bool(first_line("Do it", one, TWO, goal)) for goal in (*GOALS, None)}
    assert helps == {"E_x": False, "E_y": True, "G_xy": False, "constants": True, "explanations": False, None: True}


def test_a_score_is_what_was_asked_for():
    one = gain((0.5, 0.8, 1.0), 0.3)
    found = {goal: round(score(one, goal), 4) for goal in (*GOALS, None)}

    assert found == {
        "E_x": 0.6931, "E_y": 0.2231, "G_xy": 0.0, "constants": 0.3054, "explanations": 0.3, None: 0.6054,
    }  # fmt: skip


def test_costs_have_the_classes_that_users_name():
    assert Costs.names() == ("reading", "clamping", "board")
    assert (Costs().reading, Costs().clamping, Costs().board) == (1.0, 10.0, 30.0)


def entry(shared):
    gain = SimpleNamespace(shared=shared, E_x=0.5, E_y=1.0, G_xy=1.0)
    return SimpleNamespace(sentence="Weigh it", gain=gain)


def test_a_campaign_is_told_what_its_boards_share_or_their_constants():
    shared = {"transverse_shear.G_xz / E_x": 0.9, "attached_mass.mass": 0.034, "fluid_loading.density": 0.99}

    assert campaign_line([entry(shared)], None) == (
        "Weigh it: the interval would shrink, of G_xz / E_x to 0.9 and attached mass to 0.034 of what it is."
    )
    of_constants = "Weigh it: the interval would shrink, of E_x to 0.5 of what it is."
    assert campaign_line([entry({})], None) == of_constants
    assert campaign_line([entry(shared)], "E_x") == campaign_line([entry(shared)], "constants") == of_constants
    assert campaign_line([entry({"fluid_loading.density": 0.96})], None) == campaign_line([], None) == ""
    assert campaign_line([entry(shared)], "E_y") == ""
    assert shared_words("fluid_loading.density") == "density of fluid loading"


def test_the_first_line_is_of_the_best_proposal_that_would_help():
    small, one = gain((0.96, 0.96, 0.96), 0.04), gain((1.0, 0.88, 1.0))
    listed = [SimpleNamespace(sentence="Do this", gain=small), SimpleNamespace(sentence="Do that", gain=one)]

    assert first_of(listed, TWO, None) == "Do that: the interval of E_y would shrink to 0.88 of what it is."
    assert first_of(listed[:1], TWO, None) == first_of([], TWO, None) == ""
