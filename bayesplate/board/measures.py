"""Keys of measured data: quantities, noise, labels, tables by label, places on the board."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from bayesplate.board.density import DensityKind
from bayesplate.board.quantity import Quantity
from bayesplate.board.repeated import LARGEST_PROFILE_RATIO, are_equal, comma_complaint, scatter_complaint
from bayesplate.board.units import SI, in_unit, median_and_factor
from bayesplate.board.values import (
    Complaint,
    Key,
    Number,
    Refusal,
    WholeNumber,
    read_entries,
    read_items,
    read_list,
    refuse,
    strange_character_remedy,
)
from bayesplate.board.words import quote_text, show_value
from bayesplate.errors import InputError
from bayesplate.labels import HIGHEST_FIRST_LABEL, Label

Place = tuple[float, float]
MOST_READINGS = 1000
MOST_MODES = 200
MOST_MODES_REASON = "the modes that tell the constants of a thin plate are its first tens"
_SMALLEST_RELATIVE_SD = 1e-9
_COORDINATE = Number(-100_000, 100_000, "mm")
_PLACE_SD = Number(0, 1000, "mm")
_SD_HINT = "the number alone if it is exact; a reading rounded to r has sd = r / sqrt(12)"


@dataclass(frozen=True)
class QuantityReader:
    """Reads a quantity into SI units: a number, { mean, sd }, a list of readings, or a table of readings.

    That table is { readings, resolution, at_x_mm, at_y_mm, place_sd_mm }.
    """

    number: Number
    kind: DensityKind = "log-normal"
    places: tuple[str, ...] = ()  # coordinates that readings may, and then must, have
    furthest: float = math.inf  # ratio up to which readings without places may lie apart
    resolution: float = 0.0  # assumed where all readings are equal and none is stated
    widest: float = 1.0  # the largest standard deviation of a normal quantity
    lower: float = -math.inf  # where a normal quantity is cut off

    @property
    def key(self) -> Key:
        """A key that holds such a quantity."""
        return Key(self, self.write)

    def __call__(self, value: object) -> Quantity:
        quantity, scale = self._read_in_key_units(value), self.number.si
        return quantity if scale == 1.0 else quantity.scaled(scale, SI["mm"])

    def write(self, quantity: Quantity) -> Any:
        """A quantity in the unit of its key, in the shortest form that states it completely."""
        scale = self.number.si
        if quantity.readings:
            # of readings that are all alike the reader takes the instrument's own, where none is stated
            is_stated = bool(quantity.resolution) or (self.resolution > 0.0 and are_equal(list(quantity.readings)))
            details: dict[str, Any] = {"resolution": in_unit(quantity.resolution, scale)} if is_stated else {}
            places = {"at_x_mm": quantity.at_x, "at_y_mm": quantity.at_y}
            details |= {
                key: [in_unit(coordinate, SI["mm"]) for coordinate in values]
                for key, values in places.items()
                if values
            }
            details |= {"place_sd_mm": in_unit(quantity.place_sd, SI["mm"])} if quantity.place_sd else {}
            readings = [in_unit(value, scale) for value in quantity.readings]
            return {"readings": readings, **details} if details else readings
        if quantity.is_exact:
            return in_unit(quantity.mean, scale)
        return {"mean": in_unit(quantity.mean, scale), "sd": in_unit(quantity.sd, scale)}

    def _read_in_key_units(self, value: object) -> Quantity:
        """The quantity in the units of its keys."""
        if isinstance(value, list):
            return self._make_quantity(self._read_repeated(value), {})
        if not isinstance(value, dict):
            return Quantity.exact(self.number(value))
        if "readings" in value:
            return self._read_table_of_readings(value)
        if "mean" in value or "sd" in value:
            return self._read_mean(value)
        raise Refusal(Complaint("{ mean, sd } or { readings, resolution }", show_value(value)))

    def _read_mean(self, table: dict[str, Any]) -> Quantity:
        readers = {"mean": self.number, "sd": Number(1e-300, self.number.high, self.number.unit, _SD_HINT)}
        entries = read_entries(table, readers, needed=readers)
        mean, sd = entries["mean"], entries["sd"]
        scale = mean if self.kind == "log-normal" else self.widest
        if not _SMALLEST_RELATIVE_SD * scale <= sd <= scale:
            wanted = f"a number from {_SMALLEST_RELATIVE_SD * scale:g} to {scale:g} {self.number.unit}".rstrip()
            raise Refusal(Complaint(wanted, show_value(table["sd"]), _SD_HINT, ("sd",)))
        return Quantity.from_mean(mean, sd, self.kind, self.lower)

    def _read_table_of_readings(self, table: dict[str, Any]) -> Quantity:
        readers: dict[str, Callable[[Any], Any]] = {
            "readings": self._read_profile if any(key in table for key in self.places) else self._read_repeated,
            "resolution": Number(0, self.number.high, self.number.unit),
            **dict.fromkeys(self.places, _read_coordinates),
            **({"place_sd_mm": _PLACE_SD} if self.places else {}),
        }
        entries = read_entries(table, readers)
        places = [key for key in self.places if key in entries]
        if places and len(places) < len(self.places):
            raise Refusal(Complaint(f"{' and '.join(self.places)} together", f"only {places[0]}"))
        if "place_sd_mm" in entries and not places:
            raise Refusal(Complaint(f"{' and '.join(self.places)} beside it", "no places", path=("place_sd_mm",)))
        count = len(entries["readings"])
        wrong_keys = [key for key in places if len(entries[key]) != count]
        if wrong_keys:
            wanted = f"{count} places, one per reading"
            raise Refusal(*(Complaint(wanted, str(len(entries[key])), path=(key,)) for key in wrong_keys))
        return self._make_quantity(entries["readings"], entries)

    def _make_quantity(self, readings: list[float], table: dict[str, Any]) -> Quantity:
        """The quantity of valid readings, with the other entries of their table."""
        assumed = self.resolution if are_equal(readings) else 0.0
        resolution, at_x, at_y = (
            table.get("resolution", assumed),
            table.get("at_x_mm", ()),
            table.get("at_y_mm", ()),
        )
        quantity = Quantity.from_readings(readings, resolution, at_x, at_y, self.kind, table.get("place_sd_mm", 0.0))
        return quantity if quantity.is_exact else replace(quantity, lower=self.lower)

    def _read_list(self, value: object) -> list[float]:
        """A list of readings."""
        items = read_list(value, "readings", MOST_READINGS)
        refuse(comma_complaint(items, self.furthest))
        return read_items(enumerate(items), self.number)

    def _read_profile(self, value: object) -> list[float]:
        """Readings at different places, whose ratio is `LARGEST_PROFILE_RATIO` at most."""
        readings = self._read_list(value)
        refuse(scatter_complaint(readings, LARGEST_PROFILE_RATIO))
        return readings

    def _read_repeated(self, value: object) -> list[float]:
        """Repeated readings of one quantity, whose ratio is `furthest` at most."""
        readings = self._read_list(value)
        refuse(scatter_complaint(readings, self.furthest))
        return readings


LARGEST_POISSON = 1.5
POISSON = QuantityReader(Number(-LARGEST_POISSON, LARGEST_POISSON), "normal").key
DENSITY = Number(1, 30_000, "kg/m3", "in kg/m3: 1 g/cm3 is 1000 kg/m3")


def read_noise_percent(value: object) -> Quantity:
    """A noise prior { median, factor }, in percent."""
    if not isinstance(value, dict):
        raise Refusal(Complaint("{ median = 0.5, factor = 2 }, in percent", show_value(value)))
    readers: dict[str, Callable[[Any], float]] = {"median": Number(1e-4, 100, "%"), "factor": read_factor}
    return Quantity.from_median(**read_entries(value, readers, needed=readers))


def read_factor(value: object) -> float:
    """The factor of a log-normal density: above 1, because 1 would leave no width."""
    factor = Number(1e-300, 1000)(value)
    if factor <= 1.000_001:
        raise Refusal(
            Complaint("a factor above 1", show_value(value), "1.65 is a standard deviation of 0.5 of the log")
        )
    return factor


def write_noise(quantity: Quantity, scale: float) -> dict[str, float]:
    """A relative noise as { median, factor } in the unit of its key, which is `scale` of the quantity's unit."""
    pair = median_and_factor(quantity, scale, lambda m, f: Quantity.from_median(m, f).scaled(scale))
    return dict(zip(("median", "factor"), pair, strict=True))


NOISE = Key(lambda value: read_noise_percent(value).scaled(SI["%"]), lambda noise: write_noise(noise, SI["%"]))
"""Relative noise, stated in percent."""


def read_label(text: str) -> Label:
    """A label; the complaint reminds of keys that slipped below a table of labels."""
    try:
        return Label.parse(text)
    except InputError as error:
        fault = error.faults[0]
        slipped = re.fullmatch(r"[a-z][a-z0-9_]*", text)
        remedy = "a key of [setup] stands above the table of labels" if slipped else strange_character_remedy(text)
        raise Refusal(Complaint(fault.wanted, fault.got, remedy, (text,))) from None


def table_by_label(entry: Key) -> Key:
    """A key that holds a table whose keys are labels."""
    return Key(
        lambda value: _read_label_table(value, entry.read),
        lambda table: {str(label): entry.write(value) for label, value in table.items()},
    )


def _read_label_table(value: object, read: Callable[[Any], Any]) -> dict[Label, Any]:
    """A table by label; a label written twice, with and without spaces, is refused."""
    if not isinstance(value, dict):
        raise Refusal(Complaint('a table of labels, "(1,0)" = ...', show_value(value)))
    if len(value) > MOST_MODES:
        raise Refusal(Complaint(f"at most {MOST_MODES} modes", str(len(value)), MOST_MODES_REASON))
    complaints: list[Complaint] = []
    table: dict[Label, Any] = {}
    spellings: dict[Label, str] = {}
    for text, entry in value.items():
        try:
            label = read_label(text)
        except Refusal as refusal:
            complaints.extend(refusal.complaints)
            continue
        try:
            (table[label],) = read_items([(text, entry)], read)
        except Refusal as refusal:
            complaints.extend(refusal.complaints)
        if label in spellings:
            first = spellings[label]
            got = f"{quote_text(first)} = {show_value(value[first])} and {quote_text(text)} = {show_value(entry)}"
            remedy = f'repeated measurements are a list: "{label}" = [.., ..]'
            complaints.append(Complaint(f"the label {label} once", got, remedy))
        spellings.setdefault(label, text)
    if complaints:
        raise Refusal(*complaints)
    return table


def _read_first_label(value: object) -> Label:
    """The laboratory's label of the lowest beam indices, [m, n]."""
    if not isinstance(value, list) or len(value) != 2:
        raise Refusal(Complaint("two whole numbers, [1, 0]", show_value(value)))
    return Label(*read_items(enumerate(value), WholeNumber(0, HIGHEST_FIRST_LABEL)))


FIRST_LABEL = Key(_read_first_label, list)


def _read_place(value: object) -> Place:
    """A place on the board [x, y], in mm from the corner of the edges x0 and y0."""
    if not isinstance(value, list) or len(value) != 2:
        raise Refusal(Complaint("a place [x, y] in mm", show_value(value)))
    x, y = read_items(enumerate(value), _COORDINATE)
    return x * SI["mm"], y * SI["mm"]


def _read_places(value: object) -> tuple[Place, ...]:
    """One place [x, y], or a list of places if the thing roved."""
    if not (isinstance(value, list) and value and isinstance(value[0], list)):
        return (_read_place(value),)
    return tuple(read_items(enumerate(read_list(value, "places", MOST_READINGS)), _read_place))


def _write_place(place: Place) -> list[float]:
    return [in_unit(value, SI["mm"]) for value in place]


def _write_places(places: tuple[Place, ...]) -> Any:
    return _write_place(places[0]) if len(places) == 1 else [*map(_write_place, places)]


PLACE, PLACES = Key(_read_place, _write_place), Key(_read_places, _write_places)
"""A place on the board, m, stated in mm; and the places of a thing that may have roved."""


def _read_coordinates(value: object) -> tuple[float, ...]:
    return tuple(read_items(enumerate(read_list(value, "places in mm", MOST_READINGS)), _COORDINATE))
