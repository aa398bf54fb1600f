"""Explained in part: an effect that is certainly there, and is not all that there is."""

from __future__ import annotations

from collections.abc import Iterable

from bayesplate.diagnosis.decision.claim import nested_of
from bayesplate.diagnosis.decision.verdict import Verdict, answers, at_limit, stands_out, turned
from bayesplate.diagnosis.evidence.folds import Nested
from bayesplate.diagnosis.evidence.null_control import NullControl
from bayesplate.diagnosis.evidence.predictive import PASSES
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.evidence.sensitivity import Variant, variants

SURELY = 1e-4
"""What the probability of no effect has to stay below."""
FALLS_TO = 2.0 / 3.0
"""Nested left-out error after over before, at most: it falls by at least a third."""


def named_in_part(
    found: Found,
    verdict: Verdict,
    control: NullControl,
    folded: Nested | None = None,
    others: Iterable[Variant] | None = None,
) -> tuple[str, ...]:
    """Effects that explain readings in part though something else remains; none where that cannot be said.

    The verdict stays what it is, nothing is claimed, and the constants are not to be trusted.

    Parameters
    ----------
    found : Found
    verdict : Verdict
    control : NullControl
        What calls for an effect in a fold.
    folded : Nested, optional
        Of the board's own readings, where it is known already.
    others : iterable of Variant, optional
        The searches that a name has to survive, as of `bayesplate.diagnosis.decision.verdict.decide`.

    Returns
    -------
    tuple of str
        The members of what comes nearest, if it fails the gate and not the limits of its sizes, no effect is less
        probable than `SURELY`, the name survives every other assumption, and the nested left-out error falls to
        `FALLS_TO` or further.
    """
    nearest = verdict.nearest
    if nearest is None or found.none >= SURELY:
        return ()
    if found.p_value(nearest.index) >= PASSES or at_limit(found, nearest.index):
        return ()
    folded = nested_of(found, control, nearest.index) if folded is None else folded
    if folded is None or not folded.ratio[0] <= FALLS_TO:  # not a number where no mode is left to judge by
        return ()
    if not stands_out(nearest, answers(found)) or turned(found, nearest, variants(found) if others is None else others):
        return ()
    return nearest.members
