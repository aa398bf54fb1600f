"""A plan in sentences: the first line, and gains as people read them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bayesplate.effects.words import joined
from bayesplate.planning.beliefs import Beliefs
from bayesplate.planning.gains import Gain
from bayesplate.planning.plan import ProposalEntry
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


def shared_words(name: str) -> str:
    """A shared parameter as people read it: "G_xz / E_x" of transverse_shear.G_xz / E_x, "attached mass"."""
    effect, _, key = name.partition(".")
    words = effect.replace("_", " ")
    return key if "/" in key else words if words.endswith(key) else f"{key} of {words}"


def campaign_line(proposals: Sequence[ProposalEntry]) -> str:
    """The first line of a campaign's plan; empty where nothing would help."""
    if not proposals or proposals[0].gain.score < WORTH:
        return ""
    best = proposals[0].gain
    shared = {shared_words(name): value for name, value in best.shared.items()}
    told = shared or {name: getattr(best, name) for name in MODULI}
    shrunk = {name: value for name, value in told.items() if -math.log(value) >= WORTH}
    if not shrunk:
        return f"{proposals[0].sentence}."
    sizes = joined([f"{name} to {value:.2g}" for name, value in shrunk.items()])
    return f"{proposals[0].sentence}: the interval would shrink, of {sizes} of what it is."
