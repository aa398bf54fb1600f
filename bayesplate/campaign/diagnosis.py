"""diagnosis.json of a campaign as types: the effects that the boards share, and the errors of boards left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.campaign.claim import SharedClaim, TaughtBoard
from bayesplate.campaign.common import CommonResidual, modes_clear_of_zero
from bayesplate.campaign.search import CampaignExplanation
from bayesplate.diagnosis.claim import IMPROBABLE_BELOW
from bayesplate.diagnosis.verdict import CLEAR_FACTOR
from bayesplate.effects.words import effect_name, effect_names, join_words

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
        Named: these are shared. Group: shared by one of the explanations within a factor 3 of the best.
    declared : bool
        Whether the card names them, so that nothing was searched for.
    reason : str
    explanations : tuple of CampaignExplanation
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
    explanations: tuple[CampaignExplanation, ...]
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


def campaign_verdict(explanations: Sequence[CampaignExplanation]) -> tuple[str, tuple[str, ...], str]:
    """The verdict of a campaign from its explanations, the most probable first: the word, the effects, the reason.

    In a group the effects are the shared ones of any alternative, the most probable first.
    """
    none = next(explanation.probability for explanation in explanations if explanation.way == "none")
    if none >= IMPROBABLE_BELOW:
        return "none needed", (), f"that the boards lack nothing has the probability {none:.2g}"
    best = explanations[0]
    contenders = [
        explanation for explanation in explanations if CLEAR_FACTOR * explanation.probability > best.probability
    ]
    shared = tuple(
        dict.fromkeys(
            effect for explanation in contenders if explanation.way == "shared" for effect in explanation.effects
        )
    )
    if best.way != "shared":
        rival = (
            f"; {join_words([sharing_words(explanation) for explanation in contenders[1:]])} "
            f"{'come' if contenders[2:] else 'comes'} within a factor 3 of it"
            if contenders[1:]
            else ""
        )
        what = "of which they share the first" if best.way == "shared and own" else "which the boards do not share"
        return "unexplained", (), f"the most probable is {sharing_words(best)}, {what}{rival}"
    if len(contenders) == 1:
        runner_up = explanations[1]
        times = best.probability / max(runner_up.probability, 1e-300)
        factor = f"{times:.0f}" if times < 1000.0 else "more than 1000"
        return "named", shared, f"{sharing_words(best)} is {factor} times as probable as {sharing_words(runner_up)}"
    words = join_words([sharing_words(explanation) for explanation in contenders[1:]])
    come = "come" if contenders[2:] else "comes"
    return "indistinguishable group", shared, f"{words} {come} within a factor 3 of {sharing_words(best)}"


def sharing_words(explanation: CampaignExplanation) -> str:
    """An explanation of a campaign in words."""
    if explanation.way == "shared and own":
        shared, own = explanation.effects
        return f"{effect_name(shared)} alike on all boards beside {effect_name(own)} of another size on each"
    effect = effect_names(explanation.effects)
    return {
        "none": "no effect",
        "shared": f"{effect} alike on all boards",
        "own": f"{effect} of another size on each board",
        "one board": f"{effect} on board {explanation.board} alone",
    }[explanation.way]


def campaign_claim_sentence(diagnosis: CampaignDiagnosis) -> str:
    """Whether the boards share the effects, with the scores and errors of the boards left out."""
    claim = diagnosis.conditions
    if claim is None:
        return f"Nothing is claimed: {diagnosis.reason}."
    n = len(diagnosis.left_out_boards)
    effects = effect_names(diagnosis.judged)
    scores = (
        f"{claim.n_better} of {n} boards that were left out are predicted better by what the others teach, in sum by "
        f"{claim.gain:.1f} ± {claim.standard_error:.1f} in log score"
    )
    errors = (
        f"error of the left-out boards {diagnosis.before.left_out_boards_rms_cents:.1f} cents before, "
        f"{diagnosis.after.left_out_boards_rms_cents:.1f} after"
    )
    verb = "disagrees" if len(claim.refused_by) == 1 else "disagree"
    refused = f"; {join_words(claim.refused_by)} {verb} with the others" if claim.refused_by else ""
    head = f"The boards share {effects}" if diagnosis.claim else f"It is not claimed that the boards share {effects}"
    return f"{head}: {scores}{refused}; {errors}."


def pooled_rms(boards: Mapping[str, float], counts: Mapping[str, int]) -> float:
    """Root mean square over all modes of all boards."""
    total = sum(counts[name] * rms**2 for name, rms in boards.items())
    return float(np.sqrt(total / sum(counts.values())))


def next_step(
    common: Mapping[str, CommonResidual],
    conditions: SharedClaim | None,
    n_boards: int,
    *,
    is_declared: bool,
    verdict: str = "named",
    explanations: Sequence[CampaignExplanation] = (),
) -> str:
    """The recommendation: what to do next.

    Measure a board again that disagrees, declare an effect of which each board has its own size, or search for the
    cause of residuals that all boards have in common. Where the card names the shared effects, there was no search.
    """
    if conditions is not None and conditions.refused_by:
        boards, is_one = join_words(conditions.refused_by), len(conditions.refused_by) == 1
        if len(conditions.refused_by) == n_boards:
            return f"measure {boards} again: they do not agree on what they share"
        them, they_disagree = ("it", "it disagrees") if is_one else ("them", "they disagree")
        return f"measure {boards} again, or take {them} out of the campaign: {they_disagree} with the others"
    best = next((explanation for explanation in explanations if explanation.effects), None)
    if verdict == "unexplained" and best is not None:
        card, effect = f"the card of {best.board}" if best.board else "the campaign's card", best.effects[-1]
        sizes = "" if best.board else ", for each board one of its own"
        return (
            f"declare {effect_name(effect)} on {card}, {effect} in its effects beside those that it has{sizes}, and "
            "diagnose again: what the boards share is judged beside it then"
        )
    clear_modes = modes_clear_of_zero(common)
    if clear_modes:
        modes = join_words(clear_modes[:_MOST_LISTED])
        searches = " of a card that names nothing shared searches for" if is_declared else ", for one board, says"
        return f"modes {modes} are off alike on all boards: bayesplate diagnose{searches} what moves them so"
    return ""
