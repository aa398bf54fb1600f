"""Cards as text: numbers, quantities and densities in the units of their keys, so that reading gives them back."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayesplate.board.quantity import Kind, Quantity
from bayesplate.errors import Fault, InputError, plain
from bayesplate.files import whole_file

if TYPE_CHECKING:
    from bayesplate.board.prior import PriorCard

_DIGITS = 12
"""Where they say a number but for the rounding of a change of units, they are the ones that somebody wrote."""
_ROUNDING = 2e-15
_STEPS = (0, 1, -1, 2, -2)
_MOST_BITS = 10_000


def prior_text(prior: PriorCard) -> str:
    """The card of a prior, as TOML.

    Parameters
    ----------
    prior : PriorCard

    Returns
    -------
    str
        In card format 1.
    """
    lines = ["format = 1", f"name = {text(prior.name)}", *([f"title = {text(prior.title)}"] if prior.title else [])]
    constants = {} if prior.is_of_isotropic else prior.stated_constants
    for name, stated in (constants | ({} if prior.E is None else {"E": prior.E})).items():
        unit, scale = ("gpa", 1e9) if name[0] in "EG" else ("n_m", 1.0)
        lines += ["", f"[{name}]", *_density(stated.quantity, unit, scale), f"source = {text(stated.source)}"]
    if prior.stated_noise is not None:
        median, factor = density_numbers(prior.stated_noise.quantity, 1.0, Quantity.from_median)
        source = text(prior.stated_noise.source)
        lines += ["", "[noise_percent]", f"median = {median}", f"factor = {factor}", f"source = {source}"]
    for key, one in (("poisson_xy", prior.stated_poisson), ("density_kg_m3", prior.stated_density)):
        if one is not None:
            lines += ["", f"[{key}]", f"mean = {number(one.quantity.mean)}", f"sd = {number(one.quantity.sd)}"]
            lines += [f"source = {text(one.source)}"]
    return "\n".join(lines) + "\n"


def _density(quantity: Quantity, unit: str, scale: float) -> Iterator[str]:
    """The lines that state the density of a constant; `scale` is one unit of the key in SI."""
    yield f"distribution = {text(quantity.kind)}"
    if quantity.kind == "log-uniform":
        yield f"lower_{unit} = {number(quantity.lower, scale)}"
        yield f"upper_{unit} = {number(quantity.upper, scale)}"
    else:
        median, factor = density_numbers(quantity, scale, lambda m, f: Quantity.from_median(m * scale, f))
        yield f"median_{unit} = {median}"
        yield f"factor = {factor}"


def number(value: float, scale: float = 1.0) -> str:
    """A number in the unit of its key, which is `scale` in the unit of the value: text * scale is the value again."""
    written = value / scale
    short = f"{written:.{_DIGITS}g}"
    if not math.isclose(float(short) * scale, value, rel_tol=_ROUNDING, abs_tol=0.0):
        short = next((text for at in _near(written) if float(text := repr(at)) * scale == value), repr(written))
    return short if any(mark in short for mark in ".en") else f"{short}.0"


def density_numbers(one: Quantity, scale: float, read: Callable[[float, float], Quantity]) -> tuple[str, str]:
    """Median and factor of a log-normal density as its key has them; `read` makes the density of two such numbers."""
    median, factor = one.median / scale, one.factor
    short = (float(f"{median:.{_DIGITS}g}"), float(f"{factor:.{_DIGITS}g}"))
    if short[1] > 1 and _is_alike(read(*short), one):
        return number(short[0]), number(short[1])
    near = ((short[0], factor), *product(_near(median), _near(factor)))
    best = next((pair for pair in near if pair[1] > 1 and read(*pair) == one), (median, factor))
    return number(best[0]), number(best[1])


def _is_alike(found: Quantity, one: Quantity) -> bool:
    """Whether two densities are the same to the rounding of a change of units."""
    pairs = ((found.mean, one.mean), (found.sd, one.sd))
    return all(math.isclose(a, b, rel_tol=_ROUNDING, abs_tol=0.0) for a, b in pairs)


def _near(value: float) -> Iterator[float]:
    """The number and its neighbours: a change of units rounds."""
    for steps in _STEPS:
        at = value
        for _ in range(abs(steps)):
            at = math.nextafter(at, math.copysign(math.inf, steps))
        yield at


def quantity(one: Quantity, scale: float, place_scale: float = 1.0) -> str:
    """A quantity in the unit of its key, in the shortest form that says all of it."""
    if one.readings:
        readings = array(number(value, scale) for value in one.readings)
        further = {"resolution": number(one.resolution, scale)} if one.resolution else {}
        places = {"at_x_mm": one.at_x, "at_y_mm": one.at_y}
        further |= {key: array(number(at, place_scale) for at in values) for key, values in places.items() if values}
        further |= {"place_sd_mm": number(one.place_sd, place_scale)} if one.place_sd else {}
        return table({"readings": readings, **further}) if further else readings
    if one.is_exact:
        return number(one.mean, scale)
    return table({"mean": number(one.mean, scale), "sd": number(one.sd, scale)})


def unstatable(place: str, one: Quantity, kind: Kind = "log-normal", lower: float = -math.inf) -> list[Fault]:
    """What a card cannot say of a quantity whose key takes a density of one kind, without bounds but a lower one."""
    if one.is_exact or (one.kind == kind and (one.lower, one.upper) == (lower, math.inf)):
        return []
    is_bounded = math.isfinite(one.lower) or math.isfinite(one.upper)
    got = f"a {one.kind} one" + (" with bounds" if is_bounded else "")
    bounds = f"from {lower:g} on" if math.isfinite(lower) else "without bounds"
    return [Fault(place, f"a {kind} quantity {bounds}, as cards state it", got)]


def text(value: str) -> str:
    """A basic string of TOML; JSON escapes it the same way, but for one character that TOML does not let through."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def whole(value: int) -> str:
    """A whole number; one of thousands of digits, which Python does not write in tens, as TOML may have it too."""
    return str(value) if value.bit_length() < _MOST_BITS else hex(value)


def table(entries: Mapping[str, str]) -> str:
    """An inline table."""
    return "{ " + ", ".join(f"{key} = {value}" for key, value in entries.items()) + " }" if entries else "{}"


def array(items: Iterator[str] | Sequence[str]) -> str:
    """An array."""
    return "[" + ", ".join(items) + "]"


def write_card(path: Any, name: str, content: str, *, force: bool) -> None:
    """Write a card to a file of its name, completely or not at all.

    Raises
    ------
    InputError
        If the file has another name than the card, is there already and `force` is not given, or cannot be written.
    """
    path = Path(path)
    shown = plain(str(path))
    if path.name != f"{name}.toml":
        raise InputError(Fault(shown, f"{name}.toml, the name of the card", plain(path.name)))
    if os.path.exists(path) and not force:
        raise InputError(Fault(shown, "a new file", "one that exists", "force=True replaces it"))
    try:
        with whole_file(path) as stream:
            stream.write(content.encode("utf-8"))
    except OSError as error:
        raise InputError(Fault(shown, "a place for the card", error.strerror or str(error))) from None


def table_text(content: Mapping[str, Any]) -> str:
    """A whole table as TOML, as the reader of TOML would return it again; tables within lists stand on one line.

    Parameters
    ----------
    content : mapping
        Of texts, numbers, truth values, dates, lists and tables.

    Returns
    -------
    str
    """
    return "\n".join(_lines(content, ())) + "\n"


def _lines(content: Mapping[str, Any], above: tuple[str, ...]) -> Iterator[str]:
    tables = {key: value for key, value in content.items() if isinstance(value, Mapping) and len(above) < 2}
    for key, value in content.items():
        if key not in tables:
            yield f"{_key(key)} = {_value(value)}"
    for key, value in tables.items():
        names = (*above, _key(key))
        yield ""
        yield f"[{'.'.join(names)}]"
        yield from _lines(value, names)


def _key(key: str) -> str:
    return key if key.isascii() and key.replace("_", "").replace("-", "").isalnum() else text(key)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return table({_key(key): _value(one) for key, one in value.items()})
    if isinstance(value, list | tuple):
        return array(_value(one) for one in value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return text(value)
    if isinstance(value, int):
        return whole(value)
    return value.isoformat() if hasattr(value, "isoformat") else repr(value)
