"""A plan in sentences: the first line, and gains as people read them."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bayesplate.board.material import MODULI
from bayesplate.effects.words import joined
from bayesplate.planning.beliefs import Beliefs, Explanation
from bayesplate.planning.gains import Gain
from bayesplate.planning.plan import ProposalEntry
from bayesplate.planning.proposals import CONSTANTS, EXPLANATIONS

WORTH = 0.05
"""A gain below this, nats, is no reason to measure: an interval would shrink by less than a twentieth."""
_CLEAR = 2.0
"""Standard errors that a gain must stand above zero."""


def first_line(sentence: str, gain: Gain, beliefs: Beliefs, goal: str | None) -> str:
    """What to do next, and what it is expected to give; empty where it would not help with what was asked for."""
    doubt, constants = _of_doubt(gain, beliefs), _of_constants(gain)
    by_goal = {None: doubt or constants, EXPLANATIONS: doubt, CONSTANTS: constants}
    helps = by_goal[goal] if goal in by_goal else goal in _shrunk(gain)
    return f"{sentence}: {joined([one for one in (doubt, constants) if one])}." if helps else ""


def _of_doubt(gain: Gain, beliefs: Beliefs) -> str:
    """What becomes of the doubt between explanations."""
    if len(beliefs.explanations) < 2 or gain.explanations < max(WORTH, _CLEAR * gain.explanations_error):
        return ""
    names = _names(beliefs.explanations)
    share = 100.0 * gain.explanations / beliefs.entropy
    return (
        f"the doubt between {names} would fall by {share:.0f} % ({gain.explanations:.2f} ± "
        f"{gain.explanations_error:.2f} of {beliefs.entropy:.2f} nats)"
    )


def _names(explanations: Sequence[Explanation]) -> str:
    """Explanations in words; where one is two effects, it is told which of them are meant to be alone."""
    paired = {name for one in explanations if len(one.members) > 1 for name in one.members}
    ways = ["together" if len(one.members) > 1 else "alone" if paired & {*one.members} else "" for one in explanations]
    return joined([f"{one.words} {way}".rstrip() for one, way in zip(explanations, ways, strict=True)])


def _of_constants(gain: Gain) -> str:
    """What becomes of the intervals that shrink at all."""
    told = _shrunk(gain)
    if not told:
        return ""
    verb = "interval" if len(told) == 1 else "intervals"
    sizes = joined([f"{value:.2f}" for value in told.values()])
    now = "it is" if len(told) == 1 else "they are"
    return f"the {verb} of {joined(list(told))} would shrink to {sizes} of what {now}"


def _shrunk(gain: Gain) -> dict[str, float]:
    """What is left of each interval that shrinks by as much as is worth telling, and for sure."""
    least = max(WORTH, _CLEAR * gain.constants_error)
    return {name: getattr(gain, name) for name in MODULI if gain.shrinkage(name) >= least}


def shared_words(name: str) -> str:
    """A shared parameter as people read it: "G_xz / E_x" of transverse_shear.G_xz / E_x, "attached mass"."""
    effect, _, key = name.partition(".")
    words = effect.replace("_", " ")
    return key if "/" in key else words if words.endswith(key) else f"{key} of {words}"


def campaign_line(proposals: Sequence[ProposalEntry], goal: str | None) -> str:
    """The first line of a campaign's plan; empty where nothing would help with what was asked for."""
    if not proposals:
        return ""
    best = proposals[0].gain
    told = {shared_words(name): value for name, value in best.shared.items()} if goal is None else {}
    told = told or {name: getattr(best, name) for name in ([goal] if goal in MODULI else MODULI)}
    shrunk = {name: value for name, value in told.items() if -math.log(value) >= WORTH}
    if not shrunk:
        return ""
    sizes = joined([f"{name} to {value:.2g}" for name, value in shrunk.items()])
    return f"{proposals[0].sentence}: the interval would shrink, of {sizes} of what it is."
