"""Limits that must hold: a test asserts one with what it measured, and notes both where a page of them is asked for.

One list serves the test and the page (`make limits`): the limit that is asserted is the one that is printed.
"""

from __future__ import annotations

import json
import os

NOTES = "BAYESPLATE_LIMITS"
"""Environment variable that names the file for the notes, a line of JSON each; without it nothing is noted."""


def meets(check, quantity, value, *, at_most=None, at_least=None, unit=""):
    """Assert that a measured value lies within its limit, and note it.

    Parameters
    ----------
    check : str
        Key of a row of `calibration.limit_rows.ROWS`.
    quantity : str
        What was measured, with what distinguishes it from the same under other conditions.
    value : float
    at_most, at_least : float, optional
        The limit.
    unit : str
        "%" shows shares in hundredths.

    Raises
    ------
    AssertionError
        Where the value lies outside the limit, or is not a number.
    """
    is_met = (at_most is None or value <= at_most) and (at_least is None or value >= at_least)
    path = os.environ.get(NOTES)
    if path:
        note = {"check": check, "quantity": quantity, "value": float(value), "limit": [at_least, at_most], "unit": unit}
        with open(path, "a", encoding="utf-8") as file:  # one short line a write: workers do not mix theirs
            file.write(json.dumps(note | {"met": bool(is_met)}) + "\n")
    wanted = " and ".join(
        f"{word} {limit:g}" for word, limit in (("at least", at_least), ("at most", at_most)) if limit is not None
    )
    assert wanted, "a limit has a bound"
    assert is_met, f"{check}, {quantity}: wanted {wanted} {unit}, got {value:g}"
