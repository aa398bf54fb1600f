"""A board's plan, drawn up: from a search, or from the prior where nothing was measured yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.board.board import Board, Values
from bayesplate.board.prior import PriorCard
from bayesplate.diagnosis.decision.readings import wrong_reading
from bayesplate.diagnosis.decision.verdict import Answer, answers
from bayesplate.diagnosis.evidence.predictive import PASSES
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.planning.before import prior_beliefs
from bayesplate.planning.beliefs import Beliefs, believed
from bayesplate.planning.gains import Gain
from bayesplate.planning.proposals import Costs, Proposal, prior_proposals, proposals, sequences
from bayesplate.planning.survivors import survivors
from bayesplate.planning.words import first_line

_LINE = 17
UNEXPLAINED = (
    "no effect that is tried explains the readings, so that nothing is said of telling effects apart: what is planned "
    "here takes the model for right, which it is not"
)


@dataclass(frozen=True, eq=False)
class DrawnUp:
    """What could be measured next on a board, the best first.

    Attributes
    ----------
    beliefs : Beliefs
    values : dict of float
        Rigidities and inputs about which the modes are computed.
    proposals : tuple of Proposal
    together : tuple of (tuple of Proposal, Gain)
        The best two, and the best three; empty if they were not asked for.
    first : str
        The first line; empty where nothing would help.
    notes : tuple of str
    is_from_prior : bool
        Whether the readings, if there are any, were left aside.
    """

    beliefs: Beliefs
    values: Values
    proposals: tuple[Proposal, ...]
    together: tuple[tuple[tuple[Proposal, ...], Gain], ...]
    first: str
    notes: tuple[str, ...] = ()
    is_from_prior: bool = False


def drawn_up(
    found: Found,
    prior: PriorCard,
    seed: int,
    *,
    goal: str | None = None,
    costs: Costs | None = None,
    among: Sequence[Answer] | None = None,
    with_sequences: bool = True,
) -> DrawnUp:
    """The plan of a board that was searched.

    Parameters
    ----------
    found : Found
    prior : PriorCard
    seed : int
        Everything random follows from it.
    goal : str, optional
        See `bayesplate.planning.proposals.score`.
    costs : Costs, optional
    among : sequence of Answer, optional
        Explanations that are to be told apart; by default those that survive.
    with_sequences : bool
        Whether proposals are joined to the best two and three.

    Returns
    -------
    DrawnUp
    """
    rng = np.random.default_rng([seed, _LINE])
    failed = among is None and is_unexplained(found)
    left = (Answer((), 0, found.none),) if failed else survivors(found) if among is None else among
    beliefs = believed(found, left, rng)
    values = found.ground.baseline.values
    listed = proposals(beliefs, values, costs or Costs(), goal, rng, found, prior)
    joined = sequences(beliefs, listed, goal, rng) if with_sequences else ()
    first = wrong_reading(found) if failed else first_of(listed, beliefs, goal)
    return DrawnUp(beliefs, values, listed, joined, first, (UNEXPLAINED,) if failed else ())


def first_of(listed: Sequence[Proposal], beliefs: Beliefs, goal: str | None) -> str:
    """The first line of a plan: the best proposal that would help, in words; empty where none would."""
    lines = (first_line(one.sentence, one.gain, beliefs, goal) for one in listed)
    return next((line for line in lines if line), "")


def is_unexplained(found: Found) -> bool:
    """Whether the readings fail the gate without an effect and with the best that was found."""
    if not found.ground.n_directions or found.p_value(0) >= PASSES:
        return False
    ranked = answers(found)
    return not ranked or found.p_value(ranked[0].index) < PASSES


def begun(board: Board, prior: PriorCard, seed: int, *, goal: str | None = None, costs: Costs | None = None) -> DrawnUp:
    """The plan of a board of which nothing is known but its prior.

    Parameters
    ----------
    board : Board
    prior : PriorCard
    seed, goal, costs
        As of `drawn_up`.
    """
    rng = np.random.default_rng([seed, _LINE])
    beliefs, values = prior_beliefs(board, prior, rng)
    listed = prior_proposals(beliefs, prior, values, costs or Costs(), goal, rng)
    joined = sequences(beliefs, listed, goal, rng)
    return DrawnUp(beliefs, values, listed, joined, first_of(listed, beliefs, goal), is_from_prior=True)
