"""A board as the text of a card: the way back from SI units to the keys and units of the card format."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence

from bayesplate.plate.board import Board
from bayesplate.plate.parameter import BOARD
from bayesplate.plate.setup import AttachedItem, Setup
from bayesplate.quantities import Quantity

_MILLI = 1e3
_INPUT_KEYS = {
    "length_x": ("length_x_mm", _MILLI),
    "length_y": ("length_y_mm", _MILLI),
    "thickness": ("thickness_mm", _MILLI),
    "mass": ("mass_g", _MILLI),
    "density": ("density_kg_m3", 1.0),
}


def card_text(board: Board) -> str:
    """The card of a board, as TOML; reading it gives the board again, to twelve digits.

    Parameters
    ----------
    board : Board

    Returns
    -------
    str
        In card format 1. Effects in another form than a card can state (`Board.chosen`) are written by their names.
    """
    inputs = {one.key: one.prior for one in board.parameters if one.owner == BOARD and not one.is_of_effect}
    lines = ["format = 1", f"name = {_text(board.name)}"]
    lines += [f"{key} = {_text(text)}" for key, text in (("title", board.title), ("source", board.source)) if text]
    if board.effects:
        lines.append(f"effects = {_list(_text(name) for name in board.effects)}")
    lines += ["", "[plate]"]
    lines += [f"{key} = {_quantity(inputs[name], f)}" for name, (key, f) in _INPUT_KEYS.items() if name in inputs]
    lines += ["", "[material]", f"poisson_xy = {_quantity(inputs['poisson_xy'], 1.0)}", f"prior = {_text(board.prior)}"]
    shear = {"shear_xz_gpa": board.shear_xz, "shear_yz_gpa": board.shear_yz}
    lines += [f"{key} = {_quantity(quantity, 1e-9)}" for key, quantity in shear.items() if quantity is not None]
    table = "[setup]" if len(board.setups) == 1 else "[[setup]]"
    for setup in board.setups:
        lines += ["", table, *_setup(setup)]
    return "\n".join(lines) + "\n"


def _setup(setup: Setup) -> Iterator[str]:
    """The lines of a setup: its own keys, then its tables."""
    yield f"name = {_text(setup.name)}"
    yield f"edges = {_table({edge: _text(word) for edge, word in setup.edges.items()})}"
    if setup.clamped:
        yield f"clamped_mm = {_table({edge: _quantity(length, _MILLI) for edge, length in setup.clamped.items()})}"
    yield f"first_label = [{setup.first_label.m}, {setup.first_label.n}]"
    if setup.resolution:
        yield f"resolution_hz = {_number(setup.resolution)}"
    if setup.published_coefficients is not None:
        yield f"published_coefficients = {_text(setup.published_coefficients.name)}"
    if setup.unlabelled:
        yield f"unlabelled_hz = {_list(_number(peak) for peak in setup.unlabelled)}"
    noise = {"median": _number(100.0 * setup.noise.median), "factor": _number(setup.noise.factor)}
    yield f"noise_percent = {_table(noise)}"
    if setup.hammer is not None:
        yield f"hammer = {_table({'at_mm': _place(setup.hammer)})}"
    if setup.air is not None:
        air = {} if setup.air.density is None else {"density_kg_m3": _quantity(setup.air.density, 1.0)}
        air |= {} if setup.air.baffle is None else {"baffle": _text(setup.air.baffle)}
        yield f"air = {_table(air)}"
    if setup.attached:
        yield f"attached = {_list(_item(item) for item in setup.attached)}"
    frequencies = {f'"{reading.label}"': _quantity(reading.frequency, 1.0) for reading in setup.readings}
    yield f"frequencies_hz = {_table(frequencies)}"
    signs = {f'"{reading.label}"': _text(reading.sign) for reading in setup.readings if reading.sign}
    if signs:
        yield f"signs = {_table(signs)}"


def _item(item: AttachedItem) -> str:
    places = [_place(place) for place in item.places]
    entries = {"kind": _text(item.kind), "at_mm": places[0] if len(places) == 1 else _list(places)}
    return _table(entries | ({} if item.mass is None else {"mass_g": _quantity(item.mass, _MILLI)}))


def _place(place: Sequence[float]) -> str:
    return _list(_number(_MILLI * value) for value in place)


def _quantity(quantity: Quantity, factor: float) -> str:
    """A quantity in the unit of its key, in the shortest form that says all of it."""
    if quantity.readings:
        readings = _list(_number(factor * value) for value in quantity.readings)
        further = {"resolution": _number(factor * quantity.resolution)} if quantity.resolution else {}
        places = {"at_x_mm": quantity.at_x, "at_y_mm": quantity.at_y}
        further |= {key: _list(_number(_MILLI * at) for at in values) for key, values in places.items() if values}
        return _table({"readings": readings, **further}) if further else readings
    if quantity.is_exact:
        return _number(factor * quantity.mean)
    return _table({"mean": _number(factor * quantity.mean), "sd": _number(factor * quantity.sd)})


def _number(value: float) -> str:
    text = f"{value:.12g}"
    return text if any(mark in text for mark in ".en") else f"{text}.0"


def _text(text: str) -> str:
    """A basic string of TOML; JSON escapes it the same way."""
    return json.dumps(text, ensure_ascii=False)


def _table(entries: Mapping[str, str]) -> str:
    return "{ " + ", ".join(f"{key} = {value}" for key, value in entries.items()) + " }" if entries else "{}"


def _list(items: Iterator[str] | Sequence[str]) -> str:
    return "[" + ", ".join(items) + "]"
