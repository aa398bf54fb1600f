"""Keys of a card: how each value is read into SI units and written again; plain values are read here."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, TypeVar

from pydantic import BeforeValidator
from pydantic_core import core_schema

from bayesplate.board.units import OTHER_UNITS, SI, in_unit
from bayesplate.board.words import EFFECT_NAMES, did_you_mean, effect_named, listed, name_complaint, quoted, shown

T = TypeVar("T")
Inside = tuple[str | int, ...]


@dataclass(frozen=True)
class Complaint:
    """What is wrong with a value, before it is known in which file and section it stands."""

    wanted: str
    got: str
    remedy: str = ""
    inside: Inside = ()


class Refusal(ValueError):
    """One or more complaints about a value; pydantic carries it to `bayesplate.board.schema`."""

    def __init__(self, *complaints: Complaint) -> None:
        super().__init__("; ".join(f"wanted {one.wanted}, got {one.got}" for one in complaints))
        self.complaints = complaints

    def inside(self, *keys: str | int) -> list[Complaint]:
        """The complaints about a part of a value."""
        return [replace(one, inside=(*keys, *one.inside)) for one in self.complaints]


@dataclass(frozen=True)
class Key:
    """How a value of a card is read into SI units, and how it is written again: the annotation of a field."""

    read: Callable[[Any], Any]  # from what the TOML reader returned; raises Refusal
    write: Callable[[Any], Any] = lambda value: value  # to what the TOML writer takes

    def __get_pydantic_core_schema__(self, source: object, handler: object) -> core_schema.CoreSchema:
        writing = core_schema.plain_serializer_function_ser_schema(self.write)
        return core_schema.no_info_plain_validator_function(self.read, serialization=writing)


def refuse(complaint: Complaint | None) -> None:
    """Raise what is wrong with a value, if anything is."""
    if complaint is not None:
        raise Refusal(complaint)


def read_each(items: Iterable[tuple[str | int, Any]], read: Callable[[Any], T]) -> list[T]:
    """Read the parts of a list or table and refuse all bad ones at once."""
    good: list[T] = []
    bad: list[Complaint] = []
    for key, value in items:
        try:
            good.append(read(value))
        except Refusal as refusal:
            bad += refusal.inside(key)
    if bad:
        raise Refusal(*bad)
    return good


def read_table(
    table: dict[str, Any], readers: Mapping[str, Callable[[Any], Any]], needed: Iterable[str] = ()
) -> dict[str, Any]:
    """Read each entry of a table with the reader of its key; unknown keys are refused with the nearest known one."""
    good: dict[str, Any] = {}
    bad: list[Complaint] = []
    for key, value in table.items():
        if key not in readers:
            known = f"one of {', '.join(readers)}"
            bad.append(Complaint(known, "an unknown key", did_you_mean(key, readers), (key,)))
            continue
        try:
            good[key] = readers[key](value)
        except Refusal as refusal:
            bad += refusal.inside(key)
    bad += [Complaint("a value", "nothing", inside=(key,)) for key in needed if key not in table]
    if bad:
        raise Refusal(*bad)
    return good


def read_list(value: object, what: str, most: int, why: str = "") -> list[Any]:
    """A list that is neither empty nor longer than `most`."""
    if not isinstance(value, list):
        raise Refusal(Complaint(f"a list of {what}", shown(value)))
    if not value:
        raise Refusal(Complaint(f"at least one of {what}", "an empty list"))
    if len(value) > most:
        raise Refusal(Complaint(f"at most {most} {what}", str(len(value)), why))
    return value


def one_or_more(tables: str, most: int) -> BeforeValidator:
    """A table alone is a list of one; the tables are read by their model."""
    return BeforeValidator(lambda value: [value] if isinstance(value, dict) else read_list(value, tables, most))


@dataclass(frozen=True)
class Number:
    """Reads a finite number between two limits, in the unit that stands in the key.

    The range is checked before any arithmetic, so that 1e300 or a thousand-digit integer never reaches a formula. What
    is below it, but positive, may be in another unit: `too_small` says so.
    """

    low: float
    high: float
    unit: str = ""
    hint: str = ""
    too_small: str = ""

    def __call__(self, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise Refusal(Complaint("a number", shown(value), number_hint(value, self.unit)))
        if isinstance(value, float) and not math.isfinite(value):
            raise Refusal(Complaint("a finite number", shown(value)))
        if value <= 0 < self.low:
            raise Refusal(Complaint("a positive number", shown(value), self.hint))
        if not self.low <= value <= self.high:
            limits = f"a number from {self.low:.10g} to {self.high:.10g} {self.unit}".rstrip()
            hint = self.too_small if value < self.low else ""
            raise Refusal(Complaint(limits, shown(value), hint or self.hint))
        return float(value)

    @property
    def si(self) -> float:
        """One unit of the key in SI."""
        return SI.get(self.unit, 1.0)

    @property
    def key(self) -> Key:
        """A key that holds such a number."""
        return Key(lambda value: self(value) * self.si, lambda value: in_unit(value, self.si))


def number_hint(value: object, unit: str) -> str:
    """How to write the number that a text seems to mean."""
    if not isinstance(value, str):
        return ""
    text = value.strip()
    if strange := strange_character(value):
        return strange
    if re.fullmatch(r"[+-]?[0-9]{1,12},[0-9]{1,12}", text):
        return two_readings(text) or f"a decimal point and no quotes: {text.replace(',', '.')}"
    if re.fullmatch(r"[+-]?[0-9]{1,12}(\.[0-9]{0,12})?", text):
        return "no quotes around a number"
    stated = re.fullmatch(r"([0-9]{1,9}(?:\.[0-9]{1,9})?) ?([A-Za-z/0-9%\"]{1,8})", text)
    if stated and (factor := OTHER_UNITS.get(unit, {}).get(stated[2])):
        meant = f"{float(stated[1]) * factor:.4g}"
        return f"{text} are {meant} {unit}: write {meant} alone, the unit stands in the key"
    if re.fullmatch(r"[0-9.]{1,12} ?[A-Za-z/0-9%]{1,8}", text):
        return "the unit stands in the key: write the number alone"
    return ""


_STRANGE = {
    "\u2212": "a typographic minus: write the hyphen -, which is the minus sign of a card",
    "\u2013": "a dash: write the hyphen -, which is the minus sign of a card",
    "\u00a0": "a non-breaking space: write a plain one, or none",
    "\u202f": "a narrow non-breaking space: write a plain one, or none",
    "\u2009": "a thin space: write a plain one, or none",
}


def strange_character(text: str) -> str:
    """What to write in place of a character that programs for texts put beside numbers; empty if there is none."""
    return next((f"it holds {remedy}" for character, remedy in _STRANGE.items() if character in text), "")


def two_readings(text: str) -> str:
    """Both numbers that "1,024" may be, where the comma may part thousands as well as decimals; empty for others."""
    if not re.fullmatch(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}", text):
        return ""
    return f"ambiguous: write {text.replace(',', '.')} or {text.replace(',', '')}, whichever is meant"


@dataclass(frozen=True)
class Whole:
    """Reads a whole number between two limits."""

    low: int
    high: int

    def __call__(self, value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not self.low <= value <= self.high:
            raise Refusal(Complaint(f"a whole number from {self.low} to {self.high}", shown(value)))
        return value


@dataclass(frozen=True)
class Choice:
    """Reads one word of a list."""

    words: tuple[str, ...]

    def __call__(self, value: object) -> str:
        if isinstance(value, str) and value in self.words:
            return value
        remedy = did_you_mean(value, self.words) if isinstance(value, str) else ""
        raise Refusal(Complaint(listed(self.words), shown(value), remedy))


def read_format(value: object) -> int:
    """The number of the card format."""
    if isinstance(value, bool) or value != 1 or not isinstance(value, int):
        raise Refusal(Complaint("1", shown(value), "this version reads card format 1"))
    return value


def read_name(value: object) -> str:
    """A name that can become a file name."""
    if not isinstance(value, str):
        raise Refusal(Complaint("a name", shown(value)))
    complaint = name_complaint(value)
    if complaint:
        raise Refusal(Complaint(complaint, quoted(value)))
    return value


def read_reference(value: object) -> str:
    """The name of another card, or a path to it that ends in .toml."""
    if isinstance(value, str) and value.endswith(".toml") and value.isprintable() and len(value) <= 1000:
        return value
    return read_name(value)


def read_switch(value: object) -> bool:
    """Read true or false."""
    if not isinstance(value, bool):
        raise Refusal(Complaint("true or false", shown(value)))
    return value


def read_text(value: object) -> str:
    """A text for people: any writing, no control characters."""
    if not isinstance(value, str):
        raise Refusal(Complaint("a text in quotes", shown(value)))
    if len(value) > 4000:
        raise Refusal(Complaint("a text of at most 4000 characters", f"{len(value)} characters"))
    if re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", value):
        raise Refusal(Complaint("a text without control characters", quoted(value)))
    return value


def read_effect(value: object) -> str:
    """The name of an effect, or another one that is accepted for it."""
    return Choice(EFFECT_NAMES)(effect_named(value) if isinstance(value, str) else value)


def read_effects(value: object) -> tuple[str, ...]:
    """A list of different effects; it may be empty."""
    if value == []:
        return ()
    read = read_each(enumerate(read_list(value, "names of effects", len(EFFECT_NAMES))), read_effect)
    twice = sorted({word for word in read if read.count(word) > 1})
    if twice:
        raise Refusal(Complaint("each name once", f"{listed(twice)} twice"))
    return tuple(read)


Text = Annotated[str, Key(read_text)]
Reference = Annotated[str, Key(read_reference)]
