"""What differs between two sets of results, by the tolerances of the reference."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

Json = Mapping[str, Any]

FREQUENCY_CENTS = 0.1
"""A full solve against a full solve: a fiftieth of the smallest noise of a reading (0.3 % is 5 cents)."""
MESH = 2.0
"""The limit of ever finer meshes over what one half again as fine does: 1.8 where errors fall with the square."""
MEAN_SDS, SD_SHARE = 0.1, 0.1
"""A mean by posterior standard deviations, and a standard deviation by itself: what nobody would act upon."""
MONTE_CARLO = 3.0
"""Standard errors of the sampler's draws that are allowed beside that."""
ERROR_CENTS, ERROR_SHARE = 0.2, 0.05
LOG_ODDS = 0.3
"""Of a probability: evidence from draws and tables is good to about a third of a nat."""
GAIN_SHARE = 0.1
"""Of a plan's gain, beside three times its own error."""
MOST_TIME = 1.2
"""Processor time over that of the reference, all results of a part together."""
_NAMES = ("effects", "refitted")
"""Lists of which the order means nothing: alternatives stand in that of their probabilities."""


@dataclass(frozen=True)
class Difference:
    """One number or word that is not what it was.

    Attributes
    ----------
    name : str
        Of the result: "spruce-free-2R".
    what : str
        "diagnose constants E_x".
    stored, computed : str
    size : str
        By how much, in the unit of its tolerance.
    """

    name: str
    what: str
    stored: str
    computed: str
    size: str = ""


def differences(
    part: str, stored: Mapping[str, Json], computed: Mapping[str, Json], mesh: Mapping[str, Json] | None = None
) -> list[Difference]:
    """Differences of the results that were computed from those that are stored, by the part's tolerances.

    Parameters
    ----------
    part : str
    stored, computed : dict
        By name, as `results.read` gives them. What is stored but was not computed is not judged.
    mesh : dict, optional
        By plate and label under "cents": what a finer mesh did (`mesh.py`).

    Returns
    -------
    list of Difference
    """
    found: list[Difference] = []
    for name, one in computed.items():
        if name not in stored:
            found.append(Difference(name, "all", "nothing", "a result"))
            continue
        judged = {key: one[key] for key in one if key != "made_on"}
        kept = {key: stored[name][key] for key in stored[name] if key != "made_on"}
        for key in sorted({*judged, *kept}, key=list({**kept, **judged}).index):
            if key not in judged or key not in kept:
                found.append(
                    Difference(name, key, "there" if key in kept else "none", "there" if key in judged else "none")
                )
            elif part == "plates":
                found += frequency_differences(
                    name, key, kept[key], judged[key], (mesh or {}).get(name, {}).get("cents", {})
                )
            else:
                found += _judged(name, key, kept[key], judged[key])
    return found


def frequency_differences(
    name: str, what: str, stored: Mapping[str, float], computed: Mapping[str, float], mesh: Mapping[str, float]
) -> list[Difference]:
    """Frequencies of a plate by label; modes of which only one side can tell the label are taken in their order."""
    pairs = [(label, label, stored[label], computed[label]) for label in stored if label in computed]
    left = [(label, hz) for label, hz in stored.items() if label not in computed]
    new = [(label, hz) for label, hz in computed.items() if label not in stored]
    pairs += [(a, b, first, second) for (a, first), (b, second) in zip(left, new, strict=False)]
    found = []
    for label, other, first, second in pairs:
        cents, open_to = 1200.0 * math.log2(second / first), MESH * mesh.get(label, 0.0)
        if not min(0.0, open_to) - FREQUENCY_CENTS <= cents <= max(0.0, open_to) + FREQUENCY_CENTS:
            shown = label if label == other else f"{label} as {other}"
            found.append(Difference(name, f"{what} {shown}", f"{first:g} Hz", f"{second:g} Hz", f"{cents:+.2f} cents"))
    if len(stored) != len(computed):
        found.append(Difference(name, what, f"{len(stored)} modes", f"{len(computed)} modes"))
    return found


def _judged(name: str, what: str, stored: Any, computed: Any) -> Iterator[Difference]:
    """Differences of whatever stands under a key, by its key or its shape."""
    key = what.rsplit(" ", 1)[-1]
    if isinstance(stored, Mapping) and isinstance(computed, Mapping):
        if {"mean", "sd"} <= set(stored) & set(computed):
            yield from _spread(name, what, stored, computed)
        elif "sentence" in stored and "sentence" in computed:
            yield from _proposal(name, what, stored, computed)
        else:
            in_both = [one for one in stored if one in computed]
            every = in_both if key == "explanations" else [*{**stored, **computed}]
            for each in every:
                yield from _judged(name, f"{what} {each}", stored.get(each), computed.get(each))
    elif isinstance(stored, list) and isinstance(computed, list) and key in _NAMES:
        if sorted(stored) != sorted(computed):
            yield Difference(name, what, _shown(stored), _shown(computed))
    elif isinstance(stored, list) and isinstance(computed, list):
        if len(stored) != len(computed):
            yield Difference(name, what, f"{len(stored)} entries", f"{len(computed)} entries")
        for place, (one, other) in enumerate(zip(stored, computed, strict=False), start=1):
            yield from _judged(name, f"{what} {place}", one, other)
    elif _is_number(stored) and _is_number(computed):
        yield from _number(name, what, float(stored), float(computed))
    elif stored != computed:
        yield Difference(name, what, _shown(stored), _shown(computed))


def _spread(name: str, what: str, stored: Json, computed: Json) -> Iterator[Difference]:
    """A posterior's mean and sd: a share of the sd, and the Monte Carlo errors of both sides together."""
    sd = max(stored["sd"], computed["sd"])
    if sd == 0.0:
        if not math.isclose(stored["mean"], computed["mean"], rel_tol=1e-4):
            yield Difference(name, what, f"{stored['mean']:g}", f"{computed['mean']:g}")
        return
    draws = [one["draws"] or math.inf for one in (stored, computed)]
    monte_carlo = MONTE_CARLO * math.sqrt(sum(1.0 / n for n in draws))
    shift = (computed["mean"] - stored["mean"]) / sd
    if abs(shift) > MEAN_SDS + monte_carlo:
        yield Difference(name, what, _of(stored), _of(computed), f"{shift:+.2f} sd")
    ratio = computed["sd"] / stored["sd"] if stored["sd"] else math.inf
    if abs(ratio - 1.0) > SD_SHARE + monte_carlo / math.sqrt(2.0):
        yield Difference(name, f"{what} sd", f"{stored['sd']:.3g}", f"{computed['sd']:.3g}", f"{ratio:.2f} times")


def _proposal(name: str, what: str, stored: Json, computed: Json) -> Iterator[Difference]:
    """A proposal of a plan: the same sentence, gains within their errors."""
    if stored["sentence"] != computed["sentence"]:
        yield Difference(name, what, stored["sentence"], computed["sentence"])
        return
    for gain in ("constants", "explanations"):
        first, second = stored[gain], computed[gain]
        if first is None or second is None:
            if first != second:
                yield Difference(name, f"{what} {gain}", _shown(first), _shown(second))
            continue
        errors = math.hypot(stored[f"{gain}_error"], computed[f"{gain}_error"])
        if abs(second - first) > GAIN_SHARE * abs(first) + MONTE_CARLO * errors:
            yield Difference(name, f"{what} {gain}", f"{first:g}", f"{second:g}", f"{second - first:+.3g}")


def _number(name: str, what: str, stored: float, computed: float) -> Iterator[Difference]:
    """A single number by the key that it stands under: an error in cents, a probability, an entropy; times are free."""
    key = what.rsplit(" ", 1)[-1]
    if key == "cpu_s":
        return
    change = computed - stored
    shown = f"{change:+.3g}"
    if key.endswith("_cents"):
        differs, shown = abs(change) > max(ERROR_CENTS, ERROR_SHARE * abs(stored)), f"{change:+.2f} cents"
    elif key == "probability_of_none" or " explanations " in what:
        change = _log_odds(computed) - _log_odds(stored)
        differs, shown = abs(change) > LOG_ODDS, f"{change:+.2f} in ln odds"
    else:
        differs = abs(change) > GAIN_SHARE * abs(stored)
    if differs:
        yield Difference(name, what, f"{stored:g}", f"{computed:g}", shown)


def times(stored: Mapping[str, Json], computed: Mapping[str, Json]) -> dict[str, tuple[float, float]]:
    """Processor seconds of every command, "spruce-free-2R fit", stored and computed."""
    return {
        f"{name} {command}": (stored[name][command]["cpu_s"], one[command]["cpu_s"])
        for name, one in computed.items()
        for command in one
        if command != "made_on" and "cpu_s" in one[command] and "cpu_s" in stored.get(name, {}).get(command, {})
    }


def _log_odds(probability: float) -> float:
    inside = min(max(probability, 1e-9), 1.0 - 1e-9)
    return math.log(inside / (1.0 - inside))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _of(spread: Json) -> str:
    return f"{spread['mean']:.5g} ± {spread['sd']:.2g}"


def _shown(value: object) -> str:
    if isinstance(value, list):
        return ", ".join(map(str, value)) or "none"
    return "none" if value is None else str(value)
