"""A board's marginal likelihood must give back the board's own posterior; one that does not is replaced."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from linear_boards import exactly_together, joint_posterior, linear_boards

from bayesplate.campaigns.recovered import misses, with_normal


@dataclass(frozen=True)
class Drawn:
    """A board's own draws."""

    z: np.ndarray
    weights: np.ndarray


@pytest.fixture(scope="module")
def campaign():
    """Linear boards with closed forms, and draws of each one's own posterior."""
    rng = np.random.default_rng(8)
    boards = linear_boards(rng, 4, 2, [0.4, -0.3])
    own = [Drawn(one.draws(rng, 8000)[1], np.full(8000, 1 / 8000)) for one in boards]
    return boards, exactly_together(boards), own


def test_closed_forms_give_back_every_board(campaign):
    _, together, own = campaign

    assert max(misses(together, i, one.z, one.weights) for i, one in enumerate(own)) < 0.15
    assert with_normal(together, own) == (together, ())


def test_a_wrong_one_is_replaced_by_what_the_draws_say(campaign):
    """The negative control: a slope of three standard deviations too much is found, and mended."""
    boards, together, own = campaign
    values = together.at_nodes.copy()
    values[1] += 3.0 * together.space.u(together.space.nodes)[:, 0]
    mended, replaced = with_normal(replace(together, at_nodes=values), own)
    mean, covariance = joint_posterior(boards)
    sd = np.sqrt(np.diagonal(covariance))

    assert replaced == ("board 1",)
    assert np.abs((replace(together, at_nodes=values).moments()[0] - mean) / sd).max() > 0.5
    assert np.abs((mended.moments()[0] - mean) / sd).max() < 0.1
