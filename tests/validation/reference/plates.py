"""Frequencies of the plates of `plates.toml` by full solves, mode by mode, of the package that is imported."""

from __future__ import annotations

import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.commands.prepare import prepare
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.frequencies.system import system_of

N_MODES = 10
STEP = 1.1
"""Factor on one constant or size at a time: what its weight and its slope do."""
_EDGES = {"c": "clamped", "s": "supported", "f": "free"}
_RIGIDITIES = ("D_x", "D_y", "D_s")
_DECLARED_BY = {
    "poisson_xy": "poisson_ratio", "thickness_mm": "thickness_profile", "length_y_mm": "outline_profile",
}  # fmt: skip
_STATED = ("density", "length_x", "length_y", "thickness", "poisson_xy")

Values = dict[str, float]
Frequencies = dict[str, float]
Plate = Mapping[str, Any]


def full_solve(card: Path, values: Values) -> Frequencies:
    """Lowest frequencies of the card's only setup by label, Hz, solved at given values; no reduced law.

    This function alone knows the package's inner names: mend it here when they move.

    Parameters
    ----------
    card : Path
    values : dict of float
        D_x, D_y, D_s (N m), and inputs or parameters of effects (SI) in place of the card's, without their setup.

    Returns
    -------
    dict of float
        In the order of frequency; "?" and its place is a mode whose label cannot be told.
    """
    board = prepare(card, may_lack_frequencies=True).board
    setup = board.setups[0]
    known = {name.removesuffix(f"[{setup.name}]"): name for name in board.inputs} | {d: d for d in _RIGIDITIES}
    at = board.nominal() | {known[name]: np.asarray(value) for name, value in values.items()}
    found: dict[str, list[float]] = {}
    stations = system_of(board, setup).stations
    for station in stations:
        _, modes = spectrum(station, at, N_MODES)
        for place, mode in enumerate(modes, start=1):
            name = f"? {place}" if mode.label is None else str(mode.label)
            found.setdefault(name, []).append(mode.frequency)
    # What is read of a drive or sensor that roved is the mean over its places.
    means = {name: float(np.mean(each)) for name, each in found.items() if len(each) == len(stations)}
    return dict(sorted(means.items(), key=lambda one: one[1]))


def read_plates(path: Path | None = None) -> dict[str, Plate]:
    """Plates by name, each completed by the defaults."""
    stated = tomllib.loads((path or Path(__file__).with_name("plates.toml")).read_text())
    defaults = stated.pop("defaults")
    return {name: defaults | one for name, one in stated.items()}


def plate_frequencies(name: str, plate: Plate) -> dict[str, Frequencies]:
    """Frequencies at the plate's constants ("as stated") and, if it asks for them, with each moved in turn."""
    values = values_of(plate)
    with tempfile.TemporaryDirectory() as folder:
        card = Path(folder) / f"{name}.toml"
        card.write_text(card_text(name, plate))
        found = {"as stated": full_solve(card, values)}
        if plate.get("at_moved"):
            inputs = _stated_inputs(plate)
            for key, value in (values | inputs).items():
                found[f"{key} x {STEP:g}"] = full_solve(card, values | {key: value * STEP})
    return found


def values_of(plate: Plate) -> Values:
    """Rigidities (N m) and sizes of effects (SI) of a plate."""
    E_x, E_y, G_xy = (1e9 * modulus for modulus in plate["moduli_gpa"])
    h, nu_xy = 1e-3 * plate["sides_mm"][2], plate["poisson_xy"]
    bending = h**3 / (12.0 * (1.0 - nu_xy**2 * E_y / E_x))
    return {"D_x": E_x * bending, "D_y": E_y * bending, "D_s": G_xy * h**3 / 3.0, **plate.get("sizes", {})}


def _stated_inputs(plate: Plate) -> Values:
    """Inputs of the board that its card gives as one number, SI."""
    sides = (1e-3 * side for side in plate["sides_mm"])
    found = dict(zip(_STATED, (plate["density_kg_m3"], *sides, plate["poisson_xy"]), strict=True))
    return {name: value for name, value in found.items() if f"{name}_mm" not in plate.get("board", {})}


def card_text(name: str, plate: Plate) -> str:
    """The card of a plate, without frequencies."""
    read, sizes = plate.get("board", {}), plate.get("sizes", {})
    effects = {*plate.get("effects", ()), *(key.split(".")[0] for key in sizes)} - {"poisson_xy"}
    effects |= {effect for key, effect in _DECLARED_BY.items() if key in (*sizes, *read)}
    sides = dict(zip(("length_x_mm", "length_y_mm", "thickness_mm"), plate["sides_mm"], strict=True))
    edges = dict(zip(("x0", "x1", "y0", "y1"), (_EDGES[one] for one in plate["edges"]), strict=True))
    card = {
        "format": 1, "name": name, "title": name, "source": "a plate of the reference", "effects": sorted(effects),
        "plate": {**sides, "density_kg_m3": plate["density_kg_m3"], **read},
        "material": {"poisson_xy": plate["poisson_xy"], **plate.get("material", {})},
        "setup": {"name": "made", "edges": edges, **plate.get("setup", {})},
    }  # fmt: skip
    return "\n".join(_lines(card)) + "\n"


def _lines(table: Mapping[str, Any]) -> Iterator[str]:
    """A card as TOML: its tables under their heads, all within them in line."""
    heads = {key: one for key, one in table.items() if isinstance(one, Mapping)}
    yield from (f"{key} = {_inline(one)}" for key, one in table.items() if key not in heads)
    for head, inner in heads.items():
        yield f"[{head}]"
        yield from (f"{key} = {_inline(one)}" for key, one in inner.items())


def _inline(value: object) -> str:
    """A value of TOML on one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return f"[{', '.join(map(_inline, value))}]"
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {_inline(one)}' for key, one in value.items())} }}"
    return repr(value)
