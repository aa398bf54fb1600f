"""The grading request of a batch: from options of the command line, in the units of its tables, or from Python."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from bayesplate.board.material import MODULI
from bayesplate.board.values import Complaint, Refusal
from bayesplate.board.words import did_you_mean, quote_text
from bayesplate.commands.arguments import is_positive
from bayesplate.errors import Fault, InputError, printable
from bayesplate.grading.figures import FIGURES
from bayesplate.grading.matching import GradingRequest

Limit = tuple[float | None, float | None]

_WANTED_RANGE = "positive numbers, the least before the greatest, at least one of them"
_MATCHED_FIGURES = tuple(name for name in FIGURES if name[0] in "EG" or name == "density")
_LARGEST_PERCENT = 1000.0
_WANTED_PERCENTS = (
    f"positive per cents up to {_LARGEST_PERCENT:g}, as 10 or E_x=10,E_y=15, of {', '.join(_MATCHED_FIGURES)}"
)


def grading_request(match: str | None, limit: Sequence[str], rigidity: float | None) -> GradingRequest:
    """A request from "10" or "E_x=10,E_y=15" (per cent), "E_x=10:14" (units of the tables) and D_x (N m)."""
    faults: list[Fault] = []
    percents = {} if match is None else _percents(match, faults)
    limits: dict[str, Limit] = {}
    for text in limit:
        name, _, ends = text.partition("=")
        fault = _limit_fault(name.strip(), ends, limits)
        if fault:
            faults.append(Fault(f"--limit {printable(text)}", *fault))
        else:
            factor = FIGURES[name.strip()].per_unit
            low, high = (_number(end) for end in ends.split(":", 1))
            limits[name.strip()] = (low and low * factor, high and high * factor)
    if rigidity is not None and not is_positive(rigidity):
        faults.append(Fault("--rigidity", "a positive number of N m", f"{rigidity:g}"))
    if faults:
        raise InputError(faults)
    request = GradingRequest(limits=limits, rigidity=rigidity)
    return request if match is None else GradingRequest(percents, limits, rigidity)


def _percents(match: str, faults: list[Fault]) -> dict[str, float]:
    """Tolerances by name; one number alone is that of each modulus."""
    items = [item.strip() for item in match.split(",") if item.strip()]
    if not items:
        faults.append(Fault("--match", _WANTED_PERCENTS, quote_text(match)))
    if len(items) == 1 and "=" not in items[0]:
        if not _is_percent(_number(items[0])):
            faults.append(Fault("--match", _WANTED_PERCENTS, quote_text(items[0])))
        return dict.fromkeys(MODULI, _number(items[0]) or 0.0)
    percents: dict[str, float] = {}
    for item in items:
        name, _, value = (text.strip() for text in item.partition("="))
        if name not in _MATCHED_FIGURES or not _is_percent(_number(value)):
            remedy = did_you_mean(name, _MATCHED_FIGURES) if name not in _MATCHED_FIGURES else ""
            faults.append(Fault("--match", _WANTED_PERCENTS, quote_text(item), remedy))
        elif name in percents:
            faults.append(Fault("--match", "each quantity once", f"{name} again"))
        percents[name] = _number(value) or 0.0
    return percents


def _limit_fault(name: str, limit_text: str, limits: Mapping[str, Limit]) -> tuple[str, ...]:
    """What is wrong with a limit: what was wanted, what was got, and what to do."""
    if name not in FIGURES:
        return f"one of {', '.join(FIGURES)}", quote_text(name), did_you_mean(name, FIGURES)
    if name in limits:
        return "each quantity once", f"{name} again", "both ends: LEAST:GREATEST"
    texts = limit_text.split(":", 1)
    numbers = [_number(text) for text in texts]
    is_unreadable = any(text.strip() and number is None for text, number in zip(texts, numbers, strict=True))
    if len(texts) < 2 or is_unreadable or not any(text.strip() for text in texts):
        return f"LEAST:GREATEST in {FIGURES[name].unit}, one of them may be left away", quote_text(limit_text)
    return () if _is_range((numbers[0], numbers[1])) else (_WANTED_RANGE, quote_text(limit_text))


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
    if complaints := [*_complaints(value)]:
        raise Refusal(*complaints)
    return value


def _complaints(value: GradingRequest) -> Iterator[Complaint]:
    mappings: tuple[object, ...] = (value.match_percent, value.limits)
    if not all(isinstance(mapping, Mapping) for mapping in mappings):
        got = " and ".join(type(mapping).__name__ for mapping in mappings)
        yield Complaint("dicts by the name of a figure", got, path=("match_percent and limits",))
        return
    for key, percent in value.match_percent.items():
        if key not in _MATCHED_FIGURES:
            yield Complaint(f"names of {', '.join(_MATCHED_FIGURES)}", quote_text(str(key)), path=("match_percent",))
        elif not _is_percent(percent):
            wanted = f"a positive number of per cent up to {_LARGEST_PERCENT:g}"
            yield Complaint(wanted, repr(percent), path=("match_percent", key))
    limits: Mapping[str, Any] = value.limits
    for key, limit in limits.items():
        if key not in FIGURES:
            yield Complaint(f"names of {', '.join(FIGURES)}", quote_text(str(key)), path=("limits",))
        elif not isinstance(limit, tuple) or len(limit) != 2:
            wanted = "a pair (least, greatest), SI, None for no limit"
            yield Complaint(wanted, repr(limit), path=("limits", key))
        elif not _is_range(limit):
            yield Complaint(_WANTED_RANGE, repr(limit), path=("limits", key))
    if value.rigidity is not None and not is_positive(value.rigidity):
        yield Complaint("a positive number of N m, or None", repr(value.rigidity), path=("rigidity",))


def _is_percent(value: object) -> bool:
    return is_positive(value) and value <= _LARGEST_PERCENT


def _is_range(limit: tuple[Any, Any]) -> bool:
    """Whether a limit has an end, its ends are positive, and the lower is below the upper."""
    low, high = limit
    bounds = [bound for bound in limit if bound is not None]
    return bool(bounds) and all(map(is_positive, bounds)) and (len(bounds) < 2 or low < high)
