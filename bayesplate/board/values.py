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
from bayesplate.board.words import (
    EFFECT_NAMES,
    canonical_effect,
    did_you_mean,
    list_words,
    name_complaint,
    quote_text,
    show_value,
)

T = TypeVar("T")
ValuePath = tuple[str | int, ...]


@dataclass(frozen=True)
class Complaint:
    """A fault of a value without its place: the reader of a value does not know the file and the section."""

    wanted: str
    got: str
    remedy: str = ""
    path: ValuePath = ()


class Refusal(ValueError):
    """One or more complaints about a value; pydantic carries it to `bayesplate.board.schema`."""

    def __init__(self, *complaints: Complaint) -> None:
        super().__init__("; ".join(f"wanted {complaint.wanted}, got {complaint.got}" for complaint in complaints))
        self.complaints = complaints

    def complaints_below(self, *keys: str | int) -> list[Complaint]:
        """The complaints about a part of a value, with the keys that lead to the part."""
        return [replace(complaint, path=(*keys, *complaint.path)) for complaint in self.complaints]


@dataclass(frozen=True)
class Key:
    """How a value of a card is read into SI units, and how it is written again: the annotation of a field."""

    read: Callable[[Any], Any]  # from what the TOML reader returned; raises Refusal
    write: Callable[[Any], Any] = lambda value: value  # to what the TOML writer takes

    def __get_pydantic_core_schema__(self, source: object, handler: object) -> core_schema.CoreSchema:
        serializer = core_schema.plain_serializer_function_ser_schema(self.write)
        return core_schema.no_info_plain_validator_function(self.read, serialization=serializer)


def refuse(complaint: Complaint | None) -> None:
    """Raise a complaint about a value; do nothing without one."""
    if complaint is not None:
        raise Refusal(complaint)


def read_items(items: Iterable[tuple[str | int, Any]], read: Callable[[Any], T]) -> list[T]:
    """Read the items of a list or table and refuse all bad ones at once."""
    values: list[T] = []
    complaints: list[Complaint] = []
    for key, value in items:
        try:
            values.append(read(value))
        except Refusal as refusal:
            complaints += refusal.complaints_below(key)
    if complaints:
        raise Refusal(*complaints)
    return values


def read_entries(
    table: dict[str, Any], readers: Mapping[str, Callable[[Any], Any]], needed: Iterable[str] = ()
) -> dict[str, Any]:
    """Read each entry of a table with the reader of its key; unknown keys are refused with the nearest known one."""
    entries: dict[str, Any] = {}
    complaints: list[Complaint] = []
    for key, value in table.items():
        if key not in readers:
            wanted = f"one of {', '.join(readers)}"
            complaints.append(Complaint(wanted, "an unknown key", did_you_mean(key, readers), (key,)))
            continue
        try:
            entries[key] = readers[key](value)
        except Refusal as refusal:
            complaints += refusal.complaints_below(key)
    complaints += [Complaint("a value", "nothing", path=(key,)) for key in needed if key not in table]
    if complaints:
        raise Refusal(*complaints)
    return entries


def read_list(value: object, what: str, most: int, why: str = "") -> list[Any]:
    """A list that is neither empty nor longer than `most`."""
    if not isinstance(value, list):
        raise Refusal(Complaint(f"a list of {what}", show_value(value)))
    if not value:
        raise Refusal(Complaint(f"at least one of {what}", "an empty list"))
    if len(value) > most:
        raise Refusal(Complaint(f"at most {most} {what}", str(len(value)), why))
    return value


def list_of_tables(tables: str, most: int) -> BeforeValidator:
    """A validator that takes a single table for a list of one; their model reads the tables."""
    return BeforeValidator(lambda value: [value] if isinstance(value, dict) else read_list(value, tables, most))


@dataclass(frozen=True)
class Number:
    """Reads a finite number between two limits, in the unit that stands in the key.

    The range is checked before any arithmetic, so that 1e300 or a thousand-digit integer never reaches a formula. A
    positive number below the range may be in another unit: `too_small` says so.
    """

    low: float
    high: float
    unit: str = ""
    hint: str = ""
    too_small: str = ""

    def __call__(self, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise Refusal(Complaint("a number", show_value(value), number_hint(value, self.unit)))
        if isinstance(value, float) and not math.isfinite(value):
            raise Refusal(Complaint("a finite number", show_value(value)))
        if value <= 0 < self.low:
            raise Refusal(Complaint("a positive number", show_value(value), self.hint))
        if not self.low <= value <= self.high:
            limits = f"a number from {self.low:.10g} to {self.high:.10g} {self.unit}".rstrip()
            hint = self.too_small if value < self.low else ""
            raise Refusal(Complaint(limits, show_value(value), hint or self.hint))
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
    if remedy := strange_character_remedy(value):
        return remedy
    if re.fullmatch(r"[+-]?[0-9]{1,12},[0-9]{1,12}", text):
        return comma_ambiguity(text) or f"a decimal point and no quotes: {text.replace(',', '.')}"
    if re.fullmatch(r"[+-]?[0-9]{1,12}(\.[0-9]{0,12})?", text):
        return "no quotes around a number"
    with_unit = re.fullmatch(r"([0-9]{1,9}(?:\.[0-9]{1,9})?) ?([A-Za-z/0-9%\"]{1,8})", text)
    if with_unit and (factor := OTHER_UNITS.get(unit, {}).get(with_unit[2])):
        number = f"{float(with_unit[1]) * factor:.4g}"
        return f"{text} are {number} {unit}: write {number} alone, the unit stands in the key"
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


def strange_character_remedy(text: str) -> str:
    """What to write in place of a typographic character of word processors beside a number; empty if there is none."""
    return next((f"it holds {remedy}" for character, remedy in _STRANGE.items() if character in text), "")


def comma_ambiguity(text: str) -> str:
    """Both numbers that "1,024" may mean, its comma separating thousands or decimals; empty for other texts."""
    if not re.fullmatch(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}", text):
        return ""
    return f"ambiguous: write {text.replace(',', '.')} or {text.replace(',', '')}, whichever is meant"


@dataclass(frozen=True)
class WholeNumber:
    """Reads a whole number between two limits."""

    low: int
    high: int

    def __call__(self, value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not self.low <= value <= self.high:
            raise Refusal(Complaint(f"a whole number from {self.low} to {self.high}", show_value(value)))
        return value


@dataclass(frozen=True)
class Choice:
    """Reads one word of a list."""

    words: tuple[str, ...]

    def __call__(self, value: object) -> str:
        if isinstance(value, str) and value in self.words:
            return value
        remedy = did_you_mean(value, self.words) if isinstance(value, str) else ""
        raise Refusal(Complaint(list_words(self.words), show_value(value), remedy))


def read_format(value: object) -> int:
    """The number of the card format."""
    if isinstance(value, bool) or value != 1 or not isinstance(value, int):
        raise Refusal(Complaint("1", show_value(value), "this version reads card format 1"))
    return value


def read_name(value: object) -> str:
    """A name that can become a file name."""
    if not isinstance(value, str):
        raise Refusal(Complaint("a name", show_value(value)))
    complaint = name_complaint(value)
    if complaint:
        raise Refusal(Complaint(complaint, quote_text(value)))
    return value


def read_reference(value: object) -> str:
    """The name of another card, or a path to it that ends in .toml."""
    if isinstance(value, str) and value.endswith(".toml") and value.isprintable() and len(value) <= 1000:
        return value
    return read_name(value)


def read_boolean(value: object) -> bool:
    """Read true or false."""
    if not isinstance(value, bool):
        raise Refusal(Complaint("true or false", show_value(value)))
    return value


def read_text(value: object) -> str:
    """A text for people: any writing, no control characters."""
    if not isinstance(value, str):
        raise Refusal(Complaint("a text in quotes", show_value(value)))
    if len(value) > 4000:
        raise Refusal(Complaint("a text of at most 4000 characters", f"{len(value)} characters"))
    if re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]", value):
        raise Refusal(Complaint("a text without control characters", quote_text(value)))
    return value


def read_effect(value: object) -> str:
    """The name of an effect, or another one that is accepted for it."""
    return Choice(EFFECT_NAMES)(canonical_effect(value) if isinstance(value, str) else value)


def read_effects(value: object) -> tuple[str, ...]:
    """A list of different effects; it may be empty."""
    if value == []:
        return ()
    effects = read_items(enumerate(read_list(value, "names of effects", len(EFFECT_NAMES))), read_effect)
    repeated = sorted({word for word in effects if effects.count(word) > 1})
    if repeated:
        raise Refusal(Complaint("each name once", f"{list_words(repeated)} twice"))
    return tuple(effects)


Text = Annotated[str, Key(read_text)]
CardReference = Annotated[str, Key(read_reference)]
