"""Repeated readings: a list with decimal commas or outliers is refused, one without scatter gets a resolution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bayesplate.board.values import Complaint
from bayesplate.board.words import show_value

LARGEST_SIZE_RATIO = 2.0
"""Largest ratio of the largest to the smallest reading of one size or mass. A board tapers by less; readings further
apart are a profile and need places."""
LARGEST_PROFILE_RATIO = 5.0
"""The same of readings at different places: a graduated top varies by less, a misplaced point by ten."""

LARGEST_FREQUENCY_RATIO = 1.1
"""The same for one mode's frequency. Frequencies of a free board scatter by 0.3 %; clamping it again moves them by up
to 2.4 % (one standard deviation), so two readings a tenth apart are of two modes."""

CALIPER, FEELER, RULE = 0.05, 0.1, 1.0  # mm
SCALES, FINE_SCALES = 1.0, 0.1  # g
"""Resolutions that are assumed where all readings are equal and the card states none: of a thickness, of a warp, of
lengths, of the board's mass and of the mass of something attached. Equal readings have no scatter, but no instrument is
exact."""

_WHOLE_NUMBER_RATIO = 1.5
_DECIMAL_RATIO = 1.25
"""[2, 3, 2] may be whole millimetres; [2, 8, 2, 7] are further apart than 1.5, and 2.8 and 2.7 nearer than 1.25."""

_LONGEST_DECIMALS = 999


def comma_complaint(items: Sequence[Any], furthest: float) -> Complaint | None:
    """The complaint about [2,8, 2,7]: TOML reads four whole numbers where two decimals were meant.

    None where the whole numbers may be the readings, or the decimals would lie further apart than `furthest`.
    """
    pairs = _decimal_pairs(items)
    if not pairs or spread_ratio(items) <= _WHOLE_NUMBER_RATIO:
        return None
    texts = [f"{whole}.{decimals}" for whole, decimals in pairs]
    if spread_ratio([float(text) for text in texts]) > min(_DECIMAL_RATIO, furthest):
        return None
    remedy = f"a decimal point: {_list_text(texts)}; whole numbers so far apart are not readings of one thing"
    return _pairs_complaint(items, pairs, remedy)


def peak_comma_complaint(items: Sequence[Any]) -> Complaint | None:
    """The same of a list of different peaks, [448,8, 594,1]; a list in ascending order is never refused."""
    pairs = _decimal_pairs(items)
    wholes, decimals = [w for w, _ in pairs], [d for _, d in pairs]
    if not pairs or wholes != sorted(wholes) or max(len(str(d)) for d in decimals) >= len(str(wholes[0])):
        return None
    remedy = f"a decimal point: {_list_text([f'{w}.{d}' for w, d in pairs])}; or the whole numbers in ascending order"
    return _pairs_complaint(items, pairs, remedy)


def scatter_complaint(readings: Sequence[float], furthest: float) -> Complaint | None:
    """The complaint about repeated readings that lie further apart than a factor; None if they do not."""
    if spread_ratio(readings) <= furthest:
        return None
    wanted = f"readings of one thing, the largest at most {furthest:g} times the smallest"
    remedy = "one of them is another thing's, or a decimal has a comma in place of its point"
    return Complaint(wanted, f"{min(readings):g} and {max(readings):g}", remedy)


def are_equal(readings: Sequence[Any]) -> bool:
    """Whether all readings are equal, so that they have no scatter."""
    return all(reading == readings[0] for reading in readings)


def spread_ratio(values: Sequence[float]) -> float:
    """Ratio of the largest to the smallest; infinite where one is not positive."""
    return max(values) / min(values) if min(values) > 0 else float("inf")


def _decimal_pairs(items: Sequence[Any]) -> list[tuple[int, int]]:
    """Whole numbers two by two, the second of each short enough for decimals; empty if they are not."""
    if not items or len(items) % 2 or any(type(item) is not int or not 0 <= item < 10**9 for item in items):
        return []
    pairs = list(zip(items[::2], items[1::2], strict=True))
    return pairs if all(decimals <= _LONGEST_DECIMALS for _, decimals in pairs) else []


def _pairs_complaint(items: Sequence[int], pairs: Sequence[tuple[int, int]], remedy: str) -> Complaint:
    if all(0 < whole <= 999 and decimals > 99 for whole, decimals in pairs):
        remedy += f"; without a separator of thousands: {_list_text([f'{w}{d}' for w, d in pairs])}"
    return Complaint("numbers without commas inside them", _list_text([show_value(item) for item in items]), remedy)


def _list_text(texts: Sequence[str]) -> str:
    return f"[{', '.join(texts[:6])}{', ...' if len(texts) > 6 else ''}]"
