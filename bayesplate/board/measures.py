"""Readers of measured things: quantities, noise, labels, tables by label, places on the board."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from bayesplate.board.quantity import Kind, Quantity
from bayesplate.board.repeated import are_alike, comma_complaint, scatter_complaint
from bayesplate.board.values import Complaint, Number, Refusal, Whole, read_each, read_list, read_table, refuse
from bayesplate.board.words import quoted, shown
from bayesplate.errors import InputError
from bayesplate.labels import HIGHEST_FIRST, Label

T = TypeVar("T")
Place = tuple[float, float]
MOST_READINGS = 1000
MOST_MODES = 200
WHY_MOST_MODES = "the modes that tell the constants of a thin plate are its first tens"
_SMALLEST_SHARE = 1e-9
_COORDINATE = Number(-100_000, 100_000, "mm")
_PLACE_SD = Number(0, 1000, "mm")
_ROUNDING = "the number alone if it is exact; a reading rounded to r has sd = r / sqrt(12)"


DENSITY = Number(1, 30_000, "kg/m3", "in kg/m3: 1 g/cm3 is 1000 kg/m3")


@dataclass(frozen=True)
class QuantityReader:
    """Reads a quantity: a number, { mean, sd }, a list of readings, or a table of readings with what is said of them.

    That table is { readings, resolution, at_x_mm, at_y_mm, place_sd_mm }.

    `places` names the coordinates that readings of this quantity may (and then must) have, and with them an uncertainty
    of the places; `furthest` is the ratio up
    to which readings without places may lie apart; `resolution` is assumed where all readings are alike and none is
    stated. A normal quantity has a standard deviation of at most `widest`, and is cut off at `lower`.
    """

    number: Number
    kind: Kind = "log-normal"
    places: tuple[str, ...] = ()
    furthest: float = math.inf
    resolution: float = 0.0
    widest: float = 1.0
    lower: float = -math.inf

    def __call__(self, value: object) -> Quantity:
        if isinstance(value, list):
            return self._of(self._together(value), {})
        if not isinstance(value, dict):
            return Quantity.exact(self.number(value))
        if "readings" in value:
            return self._from_readings(value)
        if "mean" in value or "sd" in value:
            return self._from_mean(value)
        raise Refusal(Complaint("{ mean, sd } or { readings, resolution }", shown(value)))

    def _from_mean(self, table: dict[str, Any]) -> Quantity:
        read = read_whole_table(
            table, {"mean": self.number, "sd": Number(1e-300, self.number.high, self.number.unit, _ROUNDING)}
        )
        mean, sd = read["mean"], read["sd"]
        scale = mean if self.kind == "log-normal" else self.widest
        if not _SMALLEST_SHARE * scale <= sd <= scale:
            wanted = f"a number from {_SMALLEST_SHARE * scale:g} to {scale:g} {self.number.unit}".rstrip()
            raise Refusal(Complaint(wanted, shown(table["sd"]), _ROUNDING, ("sd",)))
        return Quantity.from_mean(mean, sd, self.kind, self.lower)

    def _from_readings(self, table: dict[str, Any]) -> Quantity:
        readers: dict[str, Callable[[object], Any]] = {
            "readings": self._readings if any(key in table for key in self.places) else self._together,
            "resolution": Number(0, self.number.high, self.number.unit),
            **dict.fromkeys(self.places, _read_coordinates),
            **({"place_sd_mm": _PLACE_SD} if self.places else {}),
        }
        read = read_table(table, readers)
        places = [key for key in self.places if key in read]
        if places and len(places) < len(self.places):
            raise Refusal(Complaint(f"{' and '.join(self.places)} together", f"only {places[0]}"))
        if "place_sd_mm" in read and not places:
            raise Refusal(Complaint(f"{' and '.join(self.places)} beside it", "no places", inside=("place_sd_mm",)))
        count = len(read["readings"])
        wrong = [key for key in places if len(read[key]) != count]
        if wrong:
            wanted = f"{count} places, one per reading"
            raise Refusal(*(Complaint(wanted, str(len(read[key])), inside=(key,)) for key in wrong))
        return self._of(read["readings"], read)

    def _of(self, readings: list[float], read: dict[str, Any]) -> Quantity:
        """The quantity of readings that are in order, and what the card says of them."""
        assumed = self.resolution if are_alike(readings) else 0.0
        resolution, at_x, at_y = read.get("resolution", assumed), read.get("at_x_mm", ()), read.get("at_y_mm", ())
        found = Quantity.from_readings(readings, resolution, at_x, at_y, self.kind, read.get("place_sd_mm", 0.0))
        return found if found.is_exact else replace(found, lower=self.lower)

    def _readings(self, value: object) -> list[float]:
        """Readings of a field: they may lie apart."""
        items = read_list(value, "readings", MOST_READINGS)
        refuse(comma_complaint(items, self.furthest))
        return read_each(enumerate(items), self.number)

    def _together(self, value: object) -> list[float]:
        """Readings of one thing."""
        readings = self._readings(value)
        refuse(scatter_complaint(readings, self.furthest))
        return readings


def read_whole_table(table: dict[str, Any], readers: dict[str, Callable[[object], Any]]) -> dict[str, Any]:
    """Read a table that must have all the keys of `readers` and no other."""
    complaints = [Complaint("a value", "nothing", inside=(key,)) for key in readers if key not in table]
    try:
        read = read_table(table, readers)
    except Refusal as refusal:
        raise Refusal(*refusal.complaints, *complaints) from None
    if complaints:
        raise Refusal(*complaints)
    return read


def read_noise(value: object) -> Quantity:
    """A noise prior { median, factor }, in percent."""
    if not isinstance(value, dict):
        raise Refusal(Complaint("{ median = 0.5, factor = 2 }, in percent", shown(value)))
    read = read_whole_table(value, {"median": Number(1e-4, 100, "%"), "factor": read_factor})
    return Quantity.from_median(read["median"], read["factor"])


def read_factor(value: object) -> float:
    """The factor of a log-normal density: above 1, because 1 would leave no width."""
    factor = Number(1e-300, 1000)(value)
    if factor <= 1.000_001:
        raise Refusal(Complaint("a factor above 1", shown(value), "1.65 is a standard deviation of 0.5 of the log"))
    return factor


def read_label(text: str) -> Label:
    """A label; the complaint reminds of keys that slipped below a table of labels."""
    try:
        return Label.parse(text)
    except InputError as error:
        fault = error.faults[0]
        slipped = re.fullmatch(r"[a-z][a-z0-9_]*", text)
        remedy = "a key of [setup] stands above the table of labels" if slipped else ""
        raise Refusal(Complaint(fault.wanted, fault.got, remedy, (text,))) from None


def read_by_label(value: object, read: Callable[[object], T]) -> dict[Label, T]:
    """A table whose keys are labels; a label written twice, with and without spaces, is refused."""
    if not isinstance(value, dict):
        raise Refusal(Complaint('a table of labels, "(1,0)" = ...', shown(value)))
    if len(value) > MOST_MODES:
        raise Refusal(Complaint(f"at most {MOST_MODES} modes", str(len(value)), WHY_MOST_MODES))
    complaints: list[Complaint] = []
    found: dict[Label, T] = {}
    spelt: dict[Label, str] = {}
    for text, entry in value.items():
        try:
            label = read_label(text)
        except Refusal as refusal:
            complaints.extend(refusal.complaints)
            continue
        try:
            (found[label],) = read_each([(text, entry)], read)
        except Refusal as refusal:
            complaints.extend(refusal.complaints)
        if label in spelt:
            first = spelt[label]
            both = f"{quoted(first)} = {shown(value[first])} and {quoted(text)} = {shown(entry)}"
            remedy = f'repeated measurements are a list: "{label}" = [.., ..]'
            complaints.append(Complaint(f"the label {label} once", both, remedy))
        spelt.setdefault(label, text)
    if complaints:
        raise Refusal(*complaints)
    return found


def read_first_label(value: object) -> Label:
    """The laboratory's label of the lowest beam indices, [m, n]."""
    if not isinstance(value, list) or len(value) != 2:
        raise Refusal(Complaint("two whole numbers, [1, 0]", shown(value)))
    return Label(*read_each(enumerate(value), Whole(0, HIGHEST_FIRST)))


def read_place(value: object) -> Place:
    """A place on the board [x, y], in mm from the corner of the edges x0 and y0."""
    if not isinstance(value, list) or len(value) != 2:
        raise Refusal(Complaint("a place [x, y] in mm", shown(value)))
    x, y = read_each(enumerate(value), _COORDINATE)
    return x, y


def read_places(value: object) -> tuple[Place, ...]:
    """One place [x, y], or a list of places if the thing roved."""
    if not (isinstance(value, list) and value and isinstance(value[0], list)):
        return (read_place(value),)
    return tuple(read_each(enumerate(read_list(value, "places", MOST_READINGS)), read_place))


def _read_coordinates(value: object) -> tuple[float, ...]:
    return tuple(read_each(enumerate(read_list(value, "places in mm", MOST_READINGS)), _COORDINATE))
