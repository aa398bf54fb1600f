"""The best two and three together, and in which order they are done."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from bayesplate.board.material import ORTHOTROPIC
from bayesplate.planning.beliefs import Beliefs, Explanation
from bayesplate.planning.gains import Readings, expected_gain
from bayesplate.planning.proposals import Proposal, sequences

NOW = Explanation(
    members=(), words="made", probability=1.0, mean=np.zeros((1, 3)), covariance=np.eye(3)[None],
    noise=np.full((1, 1), 0.1), log_moduli=np.zeros((1, 3)), to_moduli=np.eye(3)[None],
    cells=np.zeros(1, dtype=np.intp),
)  # fmt: skip
BELIEFS = Beliefs(SimpleNamespace(symmetry=ORTHOTROPIC), (NOW,), 0)


def proposal(what, constant, variance):
    """A reading of one of the constants."""
    readings = Readings((np.zeros((1, 1)),), (np.eye(3)[None, [constant]],), (np.full((1, 1), variance),))
    gain = expected_gain(BELIEFS, readings, np.random.default_rng(1))
    return Proposal(what, "", what, 1.0, readings, gain, about=what)


def test_what_goes_on_in_a_session_is_done_before_the_board_is_taken_out():
    """Held anew the board is off by something else, and nothing that was planned for the session is worth the same."""
    listed = [proposal("edges", 0, 0.01), proposal("mass", 1, 0.02), proposal("size", 2, 0.03)]

    two, three = sequences(BELIEFS, listed, None, np.random.default_rng(1))

    assert [one.what for one in two[0]] == ["mass", "edges"]
    assert [one.what for one in three[0]] == ["mass", "size", "edges"]
    assert three[1].E_x == listed[0].gain.E_x
