"""Values stated in Python instead of on a card: quantities, places, types of arguments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from bayesplate.board.density import DensityKind
from bayesplate.board.quantity import Quantity
from bayesplate.errors import Fault, InputError

Name = TypeVar("Name", str, int)
_LONGEST_REPR = 100


def quantity_of(
    value: Quantity | ArrayLike | None, place: str, unit: str, kind: DensityKind = "log-normal"
) -> Quantity:
    """A stated value as a quantity, see `Quantity.of`; raises InputError with the place and the unit."""
    try:
        return Quantity.of(value, kind)
    except InputError as error:
        faults = (
            replace(fault, place=place, wanted=f"{fault.wanted}, {unit}")
            if fault.place == "quantity"
            else replace(fault, place=f"{place} {fault.place}")
            for fault in error.faults
        )
        raise InputError(faults) from None


def quantities_of(
    stated: Mapping[Name, Quantity | ArrayLike | None],
    place: str,
    unit: str,
    kinds: Mapping[Name, DensityKind] | None = None,
) -> tuple[dict[Name, Quantity], list[Fault]]:
    """Stated values as quantities by name, log-normal unless `kinds` says otherwise, and faults."""
    quantities: dict[Name, Quantity] = {}
    faults: list[Fault] = []
    for name, value in stated.items():
        try:
            quantities[name] = quantity_of(value, f"{place} {name}", unit, (kinds or {}).get(name, "log-normal"))
        except InputError as error:
            faults += error.faults
    return quantities, faults


def type_faults(place: str, arguments: Iterable[tuple[str, object, bool, str]]) -> Iterator[Fault]:
    """A fault for every argument of a wrong type, from its name, its value, whether the type is right, and the type
    wanted."""
    for name, value, will_do, wanted in arguments:
        if not will_do:
            got = repr(value)
            yield Fault(f"{place} {name}", wanted, got if len(got) <= _LONGEST_REPR else f"{got[:_LONGEST_REPR]}...")


def are_instances(values: object, kind: type) -> bool:
    """Whether a value is a list or tuple of instances of one type."""
    return isinstance(values, list | tuple) and all(isinstance(value, kind) for value in values)


def is_place(value: object) -> bool:
    """Whether a value is a pair of numbers, as a place on the board is."""
    try:
        pair = np.asarray(value)
    except ValueError:
        return False
    return pair.shape == (2,) and pair.dtype.kind in "iuf"
