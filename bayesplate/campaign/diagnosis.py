"""diagnosis.json of a campaign as types: what the boards lack in common, and what left-out boards say of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.campaign.claim import SharedClaim, TaughtBoard
from bayesplate.campaign.common import CommonResidual, clear_of_zero
from bayesplate.campaign.search import Explanation
from bayesplate.diagnosis.claim import IMPROBABLE
from bayesplate.diagnosis.verdict import CLEARLY
from bayesplate.effects.words import effect_name, effect_names, joined

FORMAT = 1
_MOST_LISTED = 12


@dataclass(frozen=True)
class PooledErrors:
    """Errors over all boards."""

    in_sample_rms_cents: float  # of all labelled modes, each board's constants fitted
    left_out_boards_rms_cents: float  # the same, the shared effect learned from the other boards


@dataclass(frozen=True)
class CampaignDiagnosis:
    """What a diagnosis of a campaign found.

    Attributes
    ----------
    format : int
    name : str
        Of the campaign.
    seed : int
    card_sha256 : str
    verdict : str
        "none needed", "named", "indistinguishable group" or "unexplained".
    claim : bool
        Whether it may be said that the boards share the effects.
    effects : tuple of str
        Named: these are shared. Group: shared by one of the explanations that may be as probable.
    declared : bool
        Whether the card names them, so that nothing was searched for.
    reason : str
    explanations : tuple of Explanation
        The most probable first; none where the card names what is shared.
    probability_of_none : float or None
    conditions : SharedClaim or None
        What the claim rests on; None where nothing is shared.
    left_out_boards : dict of TaughtBoard
    before, after : PooledErrors
        The same where nothing is shared.
    common_residual : dict of CommonResidual
        By label, after what is shared.
    common_residual_before : dict of CommonResidual
    recommendation : str
    notes : tuple of str
    """

    format: int
    name: str
    seed: int
    card_sha256: str
    verdict: str
    claim: bool
    effects: tuple[str, ...]
    declared: bool
    reason: str
    explanations: tuple[Explanation, ...]
    probability_of_none: float | None
    conditions: SharedClaim | None
    left_out_boards: Mapping[str, TaughtBoard]
    before: PooledErrors
    after: PooledErrors
    common_residual: Mapping[str, CommonResidual]
    common_residual_before: Mapping[str, CommonResidual]
    recommendation: str
    notes: tuple[str, ...]

    @property
    def judged(self) -> tuple[str, ...]:
        """Effects that the boards were fitted with together: what the card names, or the most probable ones."""
        return self.explanations[0].effects if self.explanations else self.effects


def named(found: Sequence[Explanation]) -> tuple[str, tuple[str, ...], str]:
    """What a search over a campaign, its most probable explanation first, allows to say: a verdict, effects, the
    reason.

    In a group the effects are the shared ones of any alternative, the most probable first.
    """
    none = next(one.probability for one in found if one.way == "none")
    if none >= IMPROBABLE:
        return "none needed", (), f"that the boards lack nothing has the probability {none:.2g}"
    best = found[0]
    near = [one for one in found if CLEARLY * one.probability > best.probability]
    shared = tuple(dict.fromkeys(effect for one in near if one.way == "shared" for effect in one.effects))
    if best.way != "shared":
        rival = f"; {joined([words_of(one) for one in near[1:]], 'or')} may be as probable" if near[1:] else ""
        what = "of which they share the first" if best.way == "shared and own" else "which the boards do not share"
        return "unexplained", (), f"the most probable is {words_of(best)}, {what}{rival}"
    if len(near) == 1:
        rest = found[1]
        times = best.probability / max(rest.probability, 1e-300)
        shown = f"{times:.0f}" if times < 1000.0 else "more than 1000"
        return "named", shared, f"{words_of(best)} is {shown} times as probable as {words_of(rest)}"
    told = joined([words_of(one) for one in near], "or")
    return "indistinguishable group", shared, f"{told} may be as probable"


def words_of(one: Explanation) -> str:
    """An explanation as people say it."""
    if one.way == "shared and own":
        shared, own = one.effects
        return f"{effect_name(shared)} alike on all boards beside {effect_name(own)} of another size on each"
    effect = effect_names(one.effects)
    return {
        "none": "no effect",
        "shared": f"{effect} alike on all boards",
        "own": f"{effect} of another size on each board",
        "one board": f"{effect} on board {one.board} alone",
    }[one.way]


def claim_sentence(diagnosis: CampaignDiagnosis) -> str:
    """What may be said of the shared effects, and on what it rests."""
    one = diagnosis.conditions
    if one is None:
        return f"Nothing is claimed: {diagnosis.reason}."
    n = len(diagnosis.left_out_boards)
    effects = effect_names(diagnosis.judged)
    scores = (
        f"{one.n_better} of {n} boards that were left out are predicted better by what the others teach, in sum by "
        f"{one.gain:.1f} ± {one.standard_error:.1f} in log score"
    )
    errors = (
        f"error of the left-out boards {diagnosis.before.left_out_boards_rms_cents:.1f} cents before, "
        f"{diagnosis.after.left_out_boards_rms_cents:.1f} after"
    )
    verb = "does" if len(one.refused_by) == 1 else "do"
    refused = f"; {joined(one.refused_by)} {verb} not want it" if one.refused_by else ""
    head = f"The boards share {effects}" if diagnosis.claim else f"It is not claimed that the boards share {effects}"
    return f"{head}: {scores}{refused}; {errors}."


def pooled_rms(boards: Mapping[str, float], counts: Mapping[str, int]) -> float:
    """Root of the mean square over all modes of all boards."""
    total = sum(counts[name] * rms**2 for name, rms in boards.items())
    return float(np.sqrt(total / sum(counts.values())))


def next_step(
    common: Mapping[str, CommonResidual],
    conditions: SharedClaim | None,
    n_boards: int,
    *,
    is_declared: bool,
    verdict: str = "named",
    explanations: Sequence[Explanation] = (),
) -> str:
    """What to do next.

    Ask a board that refuses, declare what boards have each of its own, or look for the cause of what is left over on
    all of them. Where the card names what is shared, nothing else was searched for.
    """
    if conditions is not None and conditions.refused_by:
        boards, is_one = joined(conditions.refused_by), len(conditions.refused_by) == 1
        if len(conditions.refused_by) == n_boards:
            return f"measure {boards} again: they do not agree on what they share"
        they, do = ("it", "does") if is_one else ("they", "do")
        out = "it" if is_one else "them"
        return f"measure {boards} again, or take {out} out of the campaign: {they} {do} not want what the others share"
    best = next((one for one in explanations if one.effects), None)
    if verdict == "unexplained" and best is not None:
        where, own = f"the card of {best.board}" if best.board else "the campaign's card", best.effects[-1]
        each = "" if best.board else ", for each board one of its own"
        return (
            f"declare {effect_name(own)} on {where}, {own} in its effects beside those that it has{each}, and diagnose "
            "again: what the boards share is judged beside it then"
        )
    clear = clear_of_zero(common)
    if clear:
        modes = joined(clear[:_MOST_LISTED])
        searches = " of a card that names nothing shared searches for" if is_declared else ", for one board, says"
        return f"modes {modes} are off alike on all boards: bayesplate diagnose{searches} what moves them so"
    return ""
