"""What a summary warns of, from an assessment made by hand: each limit on both of its sides."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from bayesplate.posterior.reweighting import FEWEST_WEIGHTED_DRAWS
from bayesplate.results.summarise import HIGH_EXACT_ERROR, doubts_of, law_means, warnings_of

MEANS = dict.fromkeys(("E_x", "E_y", "G_xy", "D_x", "D_y", "D_s"), 1.5)


def warned(*, law="linear", settled=True, enough=True, exact_worst=0.0, doubts=()):
    problem = SimpleNamespace(
        doubts=(),
        board=SimpleNamespace(notes=("noted",)),
        estimate=SimpleNamespace(converged=settled),
        posterior=SimpleNamespace(law=law),
    )
    return warnings_of(problem, SimpleNamespace(doubts=doubts, linear_is_enough=enough, exact_worst=exact_worst))


def test_a_fit_without_faults_says_what_the_board_notes_alone():
    assert warned() == ["noted"]


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ({"settled": False}, "the least-squares steps did not settle"),
        ({"doubts": ("check its label",)}, "check its label"),
        ({"enough": False}, "the linear law is off by more than a quarter of the noise"),
        ({"exact_worst": 1.01 * HIGH_EXACT_ERROR}, "the exact law misses full solves by up to 0.51 cents"),
    ],
)
def test_each_fault_is_told_once(case, words):
    noted, told = warned(**case)

    assert noted == "noted"
    assert words in told


def test_limits():
    """The exact law has no linear law to be warned of, and half a cent is let through."""
    assert HIGH_EXACT_ERROR == 0.5
    assert warned(law="exact", enough=False) == warned(exact_worst=0.99 * HIGH_EXACT_ERROR) == ["noted"]


def test_what_speaks_against_the_constants_is_a_doubt_and_a_label_that_is_left_open_is_none():
    problem = SimpleNamespace(doubts=("misread?", "near this plate"), veerings=("near this plate",))

    assert doubts_of(problem, SimpleNamespace(doubts=("check its label",))) == ("misread?", "check its label")


def test_means_that_rest_on_too_few_draws_are_not_given():
    assert FEWEST_WEIGHTED_DRAWS == 200
    assert law_means(MEANS, 200.0).E_x == 1.5
    few = law_means(MEANS, 199.0)
    assert [value for _, value in few.items()] == [None] * 6
    assert few.effective_draws == 199.0
