"""A plan in sentences: the first line, and gains as people read them."""

from __future__ import annotations

from collections.abc import Mapping

from bayesplate.effects.words import joined
from bayesplate.planning.beliefs import Beliefs
from bayesplate.planning.gains import Gain
from bayesplate.plate.material import MODULI

WORTH = 0.05
"""A gain below this, nats, is no reason to measure: an interval would shrink by less than a twentieth."""
_CLEAR = 2.0
"""Standard errors that a drop of the entropy must stand above zero."""


def is_worth(gain: Gain, score: float) -> bool:
    """Whether a gain is a reason to measure."""
    errors = _CLEAR * float(gain.explanations_error + gain.constants_error)
    return score >= WORTH and score > errors


def first_line(sentence: str, gain: Gain, beliefs: Beliefs, score: float) -> str:
    """What to do next, and what it is expected to give; empty where it would not help."""
    if not is_worth(gain, score):
        return ""
    told = [_of_doubt(gain, beliefs), _of_constants(gain)]
    return f"{sentence}: {joined([one for one in told if one])}."


def _of_doubt(gain: Gain, beliefs: Beliefs) -> str:
    """What becomes of the doubt between explanations."""
    if len(beliefs.explanations) < 2 or gain.explanations < max(WORTH, _CLEAR * gain.explanations_error):
        return ""
    names = joined([one.words for one in beliefs.explanations])
    share = 100.0 * gain.explanations / beliefs.entropy
    return (
        f"the doubt between {names} would fall by {share:.0f} % ({gain.explanations:.2f} ± "
        f"{gain.explanations_error:.2f} of {beliefs.entropy:.2f} nats)"
    )


def _of_constants(gain: Gain) -> str:
    """What becomes of the intervals that shrink at all."""
    told = {name: getattr(gain, name) for name in MODULI if gain.shrinkage(name) >= WORTH}
    if not told:
        return ""
    verb = "interval" if len(told) == 1 else "intervals"
    sizes = joined([f"{value:.2f}" for value in told.values()])
    now = "it is" if len(told) == 1 else "they are"
    return f"the {verb} of {joined(list(told))} would shrink to {sizes} of what {now}"


def shared_line(sentence: str, shared: Mapping[str, float]) -> str:
    """What a reading does to what the boards of a campaign share."""
    told = {name: value for name, value in shared.items() if value < 1.0 - WORTH}
    if not told:
        return ""
    sizes = joined([f"{name} to {value:.2f}" for name, value in told.items()])
    return f"{sentence}: what the boards share would be known better, the interval of {sizes} of what it is."
