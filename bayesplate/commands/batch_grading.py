"""What boards are graded by, from the words of the command line, in the units of people."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from bayesplate.board.material import MODULI
from bayesplate.board.values import Complaint, Refusal
from bayesplate.board.words import did_you_mean, quoted
from bayesplate.commands.arguments import is_positive
from bayesplate.errors import Fault, InputError, plain
from bayesplate.grading.figures import FIGURES, MOST
from bayesplate.grading.matching import GradingRequest

_RANGE = "positive numbers, the least before the greatest, at least one of them"
_MATCHED = tuple(name for name in FIGURES if name[0] in "EG" or name == "density")
_MOST_PERCENT = 1000.0
_PERCENTS = f"positive per cents up to {_MOST_PERCENT:g}, as 10 or E_x=10,E_y=15, of {', '.join(_MATCHED)}"


def grading_request(match: str | None, limit: Sequence[str], rigidity: float | None) -> GradingRequest:
    """Read what boards are graded by.

    Parameters
    ----------
    match : str or None
        Tolerances in per cent: "10", or "E_x=10,E_y=15,G_xy=15".
    limit : sequence of str
        "E_x=10:14", either end may be left away; in the unit that the tables show.
    rigidity : float or None
        D_x, N m.

    Raises
    ------
    InputError
        With everything that cannot be read.
    """
    faults: list[Fault] = []
    percent = _matched(match, faults)
    found: dict[str, tuple[float | None, float | None]] = {}
    for one in limit:
        name, _, ends = one.partition("=")
        key = name.strip()
        if key in found:
            faults.append(
                Fault(f"--limit {plain(one)}", "each quantity once", f"{key} again", "both ends: LEAST:GREATEST")
            )
            continue
        read = _limit(key, ends, one, faults)
        if read is not None:
            found[key] = read
    if rigidity is not None and not (math.isfinite(rigidity) and rigidity > 0.0):
        faults.append(Fault("--rigidity", "a positive number of N m", f"{rigidity:g}"))
    if faults:
        raise InputError(faults)
    request = GradingRequest(limits=found, rigidity=rigidity)
    return request if percent is None else GradingRequest(percent, found, rigidity)


def _matched(match: str | None, faults: list[Fault]) -> dict[str, float] | None:
    if match is None:
        return None
    parts = [part.strip() for part in match.split(",") if part.strip()]
    if len(parts) == 1 and "=" not in parts[0]:
        percent = _percent(parts[0])
        if percent is None:
            faults.append(Fault("--match", _PERCENTS, quoted(parts[0])))
        return None if percent is None else dict.fromkeys(MODULI, percent)
    found: dict[str, float] = {}
    for part in parts:
        name, _, value = (one.strip() for one in part.partition("="))
        percent = _percent(value)
        if name not in _MATCHED or percent is None:
            remedy = did_you_mean(name, _MATCHED) if name not in _MATCHED else ""
            faults.append(Fault("--match", _PERCENTS, quoted(part), remedy))
        elif name in found:
            faults.append(Fault("--match", "each quantity once", f"{name} again"))
        else:
            found[name] = percent
    return found


def _percent(text: str) -> float | None:
    percent = _number(text)
    return percent if percent is not None and 0.0 < percent <= _MOST_PERCENT else None


def _limit(name: str, ends: str, told: str, faults: list[Fault]) -> tuple[float | None, float | None] | None:
    """The ends of one limit, SI."""
    place = f"--limit {plain(told)}"
    if name not in FIGURES:
        faults.append(Fault(place, f"one of {', '.join(FIGURES)}", quoted(name), did_you_mean(name, FIGURES)))
        return None
    low_text, colon, high_text = ends.partition(":")
    low, high = _number(low_text), _number(high_text)
    is_read = all(one is not None or not text.strip() for one, text in ((low, low_text), (high, high_text)))
    if not colon or not is_read or (low is None and high is None):
        faults.append(
            Fault(place, f"LEAST:GREATEST in {FIGURES[name].unit}, one of them may be left away", quoted(ends))
        )
        return None
    if not _is_range((low, high)):
        faults.append(Fault(place, _RANGE, quoted(ends)))
        return None
    factor = FIGURES[name].per_unit
    return (None if low is None else low * factor, None if high is None else high * factor)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def read_grading(value: object) -> object:
    """A request made in Python, or None."""
    if value is None:
        return None
    if not isinstance(value, GradingRequest):
        raise Refusal(Complaint("a GradingRequest or None", type(value).__name__))
    wrong = [*_complaints(value)]
    if wrong:
        raise Refusal(*wrong)
    return value


def _complaints(value: GradingRequest) -> Iterator[Complaint]:
    both: tuple[object, ...] = (value.match_percent, value.limits)
    if not all(isinstance(one, Mapping) for one in both):
        got = " and ".join(type(one).__name__ for one in both)
        yield Complaint("dicts by the name of a figure", got, inside=("match_percent and limits",))
        return
    for key, percent in value.match_percent.items():
        if key not in _MATCHED:
            yield Complaint(f"names of {', '.join(_MATCHED)}", quoted(str(key)), inside=("match_percent",))
        elif not is_positive(percent):
            yield Complaint("a positive number of per cent", repr(percent), inside=("match_percent", key))
    limits: Mapping[str, Any] = value.limits
    for key, limit in limits.items():
        if key not in FIGURES:
            yield Complaint(f"names of {', '.join(FIGURES)}", quoted(str(key)), inside=("limits",))
        elif not isinstance(limit, tuple) or len(limit) != 2:
            wanted = "a pair (least, greatest), SI, None for no limit"
            yield Complaint(wanted, repr(limit), inside=("limits", key))
        elif not _is_range(limit):
            yield Complaint(_RANGE, repr(limit), inside=("limits", key))
    if len(value.limits) > MOST:
        yield Complaint(f"at most {MOST}", str(len(value.limits)), inside=("limits",))
    if value.rigidity is not None and not is_positive(value.rigidity):
        yield Complaint("a positive number of N m, or None", repr(value.rigidity), inside=("rigidity",))


def _is_range(limit: tuple[Any, Any]) -> bool:
    """Whether at least one end is there, and those that are there are as they should be."""
    low, high = limit
    given = [one for one in limit if one is not None]
    return bool(given) and all(map(is_positive, given)) and (len(given) < 2 or low < high)
