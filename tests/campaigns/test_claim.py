"""What is claimed of a shared effect: simulated campaigns with it, without it, and with it on some boards only."""

from __future__ import annotations

import numpy as np
import pytest
from linear_boards import exactly_together, linear_boards

from bayesplate.campaigns.agreement import left_out, refusing
from bayesplate.campaigns.claim import LEAST_GAIN, TaughtBoard, judge
from bayesplate.campaigns.diagnosis import named
from bayesplate.campaigns.search import PRIOR, Explanation, explanations

N_BOARDS = 8


def board(gain, refuses=False):
    return TaughtBoard(gain, 10.0, 8.0, 0.001 if refuses else 0.5, refuses, {})


def claimed(seed, size, without=()):
    """The claim on a campaign of linear boards with one shared number, whose absence is zero."""
    rng = np.random.default_rng(seed)
    boards = linear_boards(rng, N_BOARDS, 1, [size], without=without)
    together = exactly_together(boards)
    refused = refusing(together)
    taught = {}
    for one, each in zip(left_out(together), boards, strict=True):
        alone = float(each.at(np.zeros((1, 1)))[0])
        taught[one.name] = TaughtBoard(one.log_score - alone, 0.0, 0.0, one.p_value, one.name in refused, {})
    return judge(taught).holds


def test_what_all_boards_share_is_claimed():
    assert np.mean([claimed(seed, 1.5) for seed in range(30)]) > 0.8


def test_nothing_is_claimed_where_nothing_is_shared():
    """At most 5 %: of 100 campaigns as many as that allows with a probability of one in a thousand."""
    assert sum(claimed(seed, 0.0) for seed in range(100, 200)) <= 12


@pytest.mark.parametrize("size", [1.5, 4.0])
def test_what_three_of_eight_have_is_not_claimed(size):
    assert np.mean([claimed(seed, size, without=(0, 2, 3, 5, 7)) for seed in range(200, 230)]) <= 0.1


@pytest.mark.parametrize(
    ("boards", "holds"),
    [
        ([2.0, 2.5, 3.0], True),
        ([2.0, 2.5, -9.0], False),  # no more than its scatter
        ([0.5, 0.5, 0.5], False),  # no more than ln 20
        ([9.0, -0.1, -0.1, -0.1], False),  # one board alone
    ],
)
def test_the_conditions(boards, holds):
    found = judge({str(i): board(gain) for i, gain in enumerate(boards)})

    assert found.holds is holds
    assert found.gain == pytest.approx(sum(boards))


def test_a_board_that_refuses_is_heard():
    gains = {str(i): board(3.0 + 0.1 * i) for i in range(5)}

    assert judge(gains).holds
    assert not judge(gains | {"2": board(3.0, refuses=True)}).holds
    assert judge(gains | {"2": board(3.0, refuses=True)}).refused_by == ("2",)
    assert LEAST_GAIN < 15.0


class Cells:
    """A board whose likelihood in each cell of each effect is given."""

    def __init__(self, name, none, **effects):
        self.name, self._none, self._effects = name, none, effects

    def cells(self, effect):
        values = self._effects[effect]
        return {(0.0, float(i)): (-np.log(len(values)), value) for i, value in enumerate(values)}

    def log_evidence(self, effect):
        if not effect:
            return self._none
        return float(np.log(np.mean(np.exp(self._effects[effect]))))


def test_the_evidence_of_one_size_for_all_is_the_sum_over_cells_of_the_product():
    one, other = Cells("one", -1.0, a=[0.0, 2.0], b=[1.0, 1.0]), Cells("other", -2.0, a=[0.5, 1.0], b=[0.0, 0.0])
    found = {(each.way, each.effect, each.board): each for each in explanations([one, other], ["a", "b"])}

    assert found["shared", "a", ""].log_evidence == pytest.approx(np.log(0.5 * np.exp(0.5) + 0.5 * np.exp(3.0)))
    assert found["own", "a", ""].log_evidence == pytest.approx(
        np.log(0.5 + 0.5 * np.exp(2.0)) + np.log(0.5 * np.exp(0.5) + 0.5 * np.exp(1.0))
    )
    assert found["one board", "a", "one"].log_evidence == pytest.approx(np.log(0.5 + 0.5 * np.exp(2.0)) - 2.0)
    assert found["none", "", ""].log_evidence == pytest.approx(-3.0)
    assert sum(each.probability for each in found.values()) == pytest.approx(1.0)
    ratio = found["shared", "b", ""].probability / found["none", "", ""].probability
    assert ratio == pytest.approx(0.5 * PRIOR["shared"] / PRIOR["none"] * np.exp(4.0))


def explanation(way, probability, effect="attached_mass", board=""):
    return Explanation(way, "" if way == "none" else effect, board, 0.0, probability)


@pytest.mark.parametrize(
    ("found", "verdict", "effects"),
    [
        ([("shared", 0.9), ("none", 0.01), ("own", 0.09)], "named", ("attached_mass",)),
        ([("none", 0.9), ("shared", 0.1)], "none needed", ()),
        ([("shared", 0.5), ("own", 0.45), ("none", 0.04)], "indistinguishable group", ("attached_mass",)),
        ([("own", 0.9), ("shared", 0.08), ("none", 0.01)], "unexplained", ()),
    ],
)
def test_what_a_search_allows_to_say(found, verdict, effects):
    said = named([explanation(way, probability) for way, probability in found])

    assert said[:2] == (verdict, effects)
    assert said[2]
