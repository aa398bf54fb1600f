"""Which explanations survive, and are to be told apart."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from bayesplate.diagnosis.search import Found
from bayesplate.diagnosis.verdict import WITHIN, Answer, answers

MOST = 4
"""Explanations besides that of no effect; each takes a dozen plates to solve."""


def survivors(found: Found, rivals: Collection[tuple[str, ...]] = ()) -> tuple[Answer, ...]:
    """No effect, and the answers of a search within a factor ten of the best of them, the most probable first.

    No effect is left out where it is ten times less probable than the best answer.

    Parameters
    ----------
    found : Found
    rivals : collection of tuple of str
        Answers that survive in any case: alternatives that a verdict lists because another assumption favours them.
    """
    return surviving(found, {one.members: one.support for one in answers(found)}, found.none, rivals)


def surviving(
    found: Found, support: Mapping[tuple[str, ...], float], none: float, rivals: Collection[tuple[str, ...]] = ()
) -> tuple[Answer, ...]:
    """The same by probabilities that are known from a finished diagnosis.

    Parameters
    ----------
    found : Found
        A search that has tried at least these effects.
    support : dict of float
        By the effects of an answer.
    none : float
        Probability of no effect.
    rivals : collection of tuple of str
        See `survivors`.
    """
    ranked = [one for one in answers_of(found, support) if one.support > 0.0]
    near = [one for one in ranked if one.support * WITHIN >= ranked[0].support or one.members in rivals][:MOST]
    kept = list(near)
    if not near or none * WITHIN >= near[0].support:
        kept.append(Answer((), 0, none))
    return tuple(sorted(kept, key=lambda one: -one.support))


def asked(found: Found, effects: Sequence[str]) -> tuple[Answer, ...]:
    """What a user asks about: no effect, each effect alone, and likely pairs of them, by the search's probabilities.

    A pair that is ten times less probable than the best of all is left out.
    """
    listed = [
        Answer(one.members, i, float(found.probability[i]))
        for i, one in enumerate(found.ground.hypotheses)
        if set(one.members) <= set(effects) and one.swap is None
    ]
    highest = max(one.support for one in listed)
    kept = [one for one in listed if len(one.members) < 2 or one.support * WITHIN >= highest]
    return tuple(sorted(kept, key=lambda one: -one.support))


def answers_of(found: Found, support: Mapping[tuple[str, ...], float]) -> tuple[Answer, ...]:
    """Answers of a search with given probabilities, the most probable first; those it does not have are left out."""
    index: dict[tuple[str, ...], int] = {}
    for i, one in enumerate(found.ground.hypotheses):
        if one.members and (one.members not in index or one.swap is None):
            best = index.get(one.members)
            if best is None or found.probability[i] > found.probability[best]:
                index[one.members] = i
    listed = [Answer(members, index[members], share) for members, share in support.items() if members in index]
    return tuple(sorted(listed, key=lambda one: -one.support))
