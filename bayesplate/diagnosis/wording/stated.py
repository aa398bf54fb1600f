"""What may be claimed of effects that the card states, in words."""

from __future__ import annotations

from collections.abc import Sequence

from bayesplate.diagnosis.decision.stated import LEAST_FALL, StatedClaim
from bayesplate.effects.words import effect_names


def stated_sentences(claims: Sequence[StatedClaim]) -> list[str]:
    """A sentence on each: what is predicted, the error without and with the effects, and whether it is reduced."""
    return [_sentence(one) for one in claims]


def _sentence(one: StatedClaim) -> str:
    who = f"{effect_names(one.effects)}, as stated and not chosen by the readings,"
    verb = "takes" if len(one.effects) == 1 else "take"
    if one.predicts:
        what = f"the error of setup '{one.predicts}', predicted by the constants of the first setup alone,"
    else:
        what = "the left-out error"
    told = (
        f"{who[0].upper()}{who[1:]} {verb} {what} from {one.before_rms_cents:.1f} to {one.after_rms_cents:.1f} cents; "
        f"the log score changes by {one.log_score_gain:+.1f} ± {one.standard_error:.1f} over {one.n_modes} modes"
    )
    if one.holds:
        return f"{told}: error reduced."
    needs = f"that asks for a fall by {LEAST_FALL:.0%} and a score that rises by more than two standard errors"
    return f"{told}. That an error is reduced is not claimed: {needs}."
