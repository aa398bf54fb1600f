"""The best two and three together, and in which order they are done."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from bayesplate.board.material import ORTHOTROPIC
from bayesplate.planning.beliefs import Beliefs, ExplanationTerms
from bayesplate.planning.gains import PlannedReadings
from bayesplate.planning.plan import ProposalEntry
from bayesplate.planning.proposals import Planner, Proposal

NOW = ExplanationTerms(
    members=(), words="made", probability=1.0, mean=np.zeros((1, 3)), covariance=np.eye(3)[None],
    noise=np.full((1, 1), 0.1), middle=np.zeros((1, 3)), target_slopes=np.eye(3)[None],
)  # fmt: skip
PLANNER = Planner(Beliefs((SimpleNamespace(board=SimpleNamespace(symmetry=ORTHOTROPIC)),), (NOW,)), 1)


def proposal(what, constant, variance):
    """A reading of one of the constants."""
    readings = PlannedReadings((np.zeros((1, 1)),), (np.eye(3)[None, [constant]],), (np.full((1, 1), variance),))
    return Proposal(ProposalEntry(what, "", "", what, 1.0, (), PLANNER.gain(readings)), readings, what)


def test_what_goes_on_in_a_session_is_done_before_the_board_is_taken_out():
    """Held anew the board is off by something else, and nothing that was planned for the session is worth the same."""
    listed = [proposal("edges", 0, 0.01), proposal("mass", 1, 0.02), proposal("size", 2, 0.03)]

    (_, two), (_, three) = PLANNER.sequences(listed)

    assert two.steps == ("mass", "edges")
    assert three.steps == ("mass", "size", "edges")
    assert (two.cost_minutes, three.cost_minutes) == (2.0, 3.0)
    assert three.gain.E_x == listed[0].entry.gain.E_x


def test_two_ways_to_know_one_thing_better_are_not_proposed_together():
    """Each is counted from what is known now."""
    more, other = proposal("size", 0, 0.01), proposal("modes", 1, 0.02)
    finer = replace(more, entry=replace(more.entry, sentence="finer"))

    ((steps, _),) = PLANNER.sequences([more, finer, other])

    assert steps == (more, other)
