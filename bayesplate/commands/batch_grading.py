"""What boards are graded by, from the words of the command line, in the units of people, or from Python."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from bayesplate.board.material import MODULI
from bayesplate.board.values import Complaint, Refusal
from bayesplate.board.words import did_you_mean, quoted
from bayesplate.commands.arguments import is_positive
from bayesplate.errors import Fault, InputError, plain
from bayesplate.grading.figures import FIGURES
from bayesplate.grading.matching import GradingRequest

Limit = tuple[float | None, float | None]

_RANGE = "positive numbers, the least before the greatest, at least one of them"
_MATCHED = tuple(name for name in FIGURES if name[0] in "EG" or name == "density")
_MOST_PERCENT = 1000.0
_PERCENTS = f"positive per cents up to {_MOST_PERCENT:g}, as 10 or E_x=10,E_y=15, of {', '.join(_MATCHED)}"


def grading_request(match: str | None, limit: Sequence[str], rigidity: float | None) -> GradingRequest:
    """A request from "10" or "E_x=10,E_y=15" (per cent), "E_x=10:14" (units of the tables) and D_x (N m)."""
    faults: list[Fault] = []
    percents = {} if match is None else _percents(match, faults)
    limits: dict[str, Limit] = {}
    for text in limit:
        name, _, ends = text.partition("=")
        fault = _limit_fault(name.strip(), ends, limits)
        if fault:
            faults.append(Fault(f"--limit {plain(text)}", *fault))
        else:
            factor = FIGURES[name.strip()].per_unit
            low, high = (_number(end) for end in ends.split(":", 1))
            limits[name.strip()] = (low and low * factor, high and high * factor)
    if rigidity is not None and not is_positive(rigidity):
        faults.append(Fault("--rigidity", "a positive number of N m", f"{rigidity:g}"))
    if faults:
        raise InputError(faults)
    asked = GradingRequest(limits=limits, rigidity=rigidity)
    return asked if match is None else GradingRequest(percents, limits, rigidity)


def _percents(match: str, faults: list[Fault]) -> dict[str, float]:
    """Tolerances by name; one number alone is that of each modulus."""
    parts = [part.strip() for part in match.split(",") if part.strip()]
    if len(parts) == 1 and "=" not in parts[0]:
        if not _is_percent(_number(parts[0])):
            faults.append(Fault("--match", _PERCENTS, quoted(parts[0])))
        return dict.fromkeys(MODULI, _number(parts[0]) or 0.0)
    found: dict[str, float] = {}
    for part in parts:
        name, _, value = (one.strip() for one in part.partition("="))
        if name not in _MATCHED or not _is_percent(_number(value)):
            remedy = did_you_mean(name, _MATCHED) if name not in _MATCHED else ""
            faults.append(Fault("--match", _PERCENTS, quoted(part), remedy))
        elif name in found:
            faults.append(Fault("--match", "each quantity once", f"{name} again"))
        found[name] = _number(value) or 0.0
    return found


def _limit_fault(name: str, ends: str, earlier: Mapping[str, Limit]) -> tuple[str, ...]:
    """What is wrong with a limit: what was wanted, what was got, and what to do."""
    if name not in FIGURES:
        return f"one of {', '.join(FIGURES)}", quoted(name), did_you_mean(name, FIGURES)
    if name in earlier:
        return "each quantity once", f"{name} again", "both ends: LEAST:GREATEST"
    texts = ends.split(":", 1)
    numbers = [_number(text) for text in texts]
    unread = any(text.strip() and number is None for text, number in zip(texts, numbers, strict=True))
    if len(texts) < 2 or unread or not any(text.strip() for text in texts):
        return f"LEAST:GREATEST in {FIGURES[name].unit}, one of them may be left away", quoted(ends)
    return () if _is_range((numbers[0], numbers[1])) else (_RANGE, quoted(ends))


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
    if wrong := [*_complaints(value)]:
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
        elif not _is_percent(percent):
            wanted = f"a positive number of per cent up to {_MOST_PERCENT:g}"
            yield Complaint(wanted, repr(percent), inside=("match_percent", key))
    limits: Mapping[str, Any] = value.limits
    for key, limit in limits.items():
        if key not in FIGURES:
            yield Complaint(f"names of {', '.join(FIGURES)}", quoted(str(key)), inside=("limits",))
        elif not isinstance(limit, tuple) or len(limit) != 2:
            wanted = "a pair (least, greatest), SI, None for no limit"
            yield Complaint(wanted, repr(limit), inside=("limits", key))
        elif not _is_range(limit):
            yield Complaint(_RANGE, repr(limit), inside=("limits", key))
    if value.rigidity is not None and not is_positive(value.rigidity):
        yield Complaint("a positive number of N m, or None", repr(value.rigidity), inside=("rigidity",))


def _is_percent(value: object) -> bool:
    return is_positive(value) and value <= _MOST_PERCENT


def _is_range(limit: tuple[Any, Any]) -> bool:
    """Whether at least one end is there, and those that are there are as they should be."""
    low, high = limit
    given = [one for one in limit if one is not None]
    return bool(given) and all(map(is_positive, given)) and (len(given) < 2 or low < high)
