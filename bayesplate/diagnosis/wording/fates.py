"""What became of each candidate, and why, in words that agree with the numbers beside them."""

from __future__ import annotations

from collections.abc import Sequence

from bayesplate.diagnosis.decision.verdict import Answer, Verdict, answer_words, p_words
from bayesplate.diagnosis.evidence.predictive import PASSES
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.wording.candidates import Fate
from bayesplate.posterior.slips import times

_LIKELY = 0.1
"""Probability from which on an effect that is hardly visible by itself is told as any other."""

Told = tuple[Fate, str | None]
"""What became of a candidate, and the reason; None for what was not rejected."""


def fate_of(found: Found, verdict: Verdict, ranked: Sequence[Answer], name: str, index: int) -> Told:
    """What became of a candidate effect.

    Parameters
    ----------
    found : Found
    verdict : Verdict
    ranked : sequence of Answer
        Best first.
    name : str
    index : int
        Of the hypothesis that it acts alone.
    """
    if name in verdict.effects:
        return "in the verdict", None
    if (
        verdict.is_needed
        and verdict.word == "unexplained"
        and verdict.best is not None
        and name in verdict.best.members
    ):
        return "does not fit", verdict.reason
    if found.ground.is_below_detection_limit(name) and not (verdict.is_needed and found.inclusion(name) >= _LIKELY):
        return "not detectable", "its visible part is below what these readings could show"
    return _without_need(found, verdict) or _misfit(found, index) or _less_probable(found, ranked, name, index)


def fate_of_exchange(
    found: Found, verdict: Verdict, ranked: Sequence[Answer], index: int, *, is_accepted: bool
) -> Told:
    """What became of two labels that may have been exchanged, with the likelihood ratio of the exchange."""
    if is_accepted:
        return "in the verdict", None
    fate, because = _without_need(found, verdict) or _misfit(found, index) or _less_probable(found, ranked, None, index)
    return fate, f"{because}; {ratio_words(found, index)}"


def _without_need(found: Found, verdict: Verdict) -> Told | None:
    if verdict.is_needed:
        return None
    fate: Fate = "not established" if verdict.word == "unexplained" else "not needed"
    return fate, f"{fate}: nothing lacking has a probability of {found.none:.2f}"


def _misfit(found: Found, index: int) -> Told | None:
    """Too large a misfit with the candidate alone."""
    p_value = found.p_value(index)
    if p_value >= PASSES:
        return None
    return "does not fit", f"with it alone the misfit is still too large ({p_words(p_value)})"


def _less_probable(found: Found, ranked: Sequence[Answer], name: str | None, index: int) -> Told:
    """Its best answer beside the best of all."""
    best = ranked[0]
    own = max((one.support for one in ranked if one.index == index or name in one.members), default=0.0)
    mine, others = f"{own:.3f}", f"{best.support:.3f}"
    word = "less probable" if mine != others else "no more probable"
    return "less probable", f"{word} ({mine}) than {answer_words(found, best)} ({others})"


def ratio_words(found: Found, index: int) -> str:
    """How much likelier the readings are under a hypothesis that exchanges two labels than as they are called."""
    gained = float(found.log_evidence[index] - found.log_evidence[0])
    likelier = "likelier" if gained > 0 else "less likely"
    return f"with these labels exchanged the readings are {times(abs(gained))} {likelier}"
