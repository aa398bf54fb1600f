"""Inputs of a board as parameters: sizes, mass, Poisson ratio, and what a clamp covers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from bayesplate.board.board_keys import WARPS
from bayesplate.board.density import DensityKind
from bayesplate.board.parameter import BOARD_OWNER, Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.random_field import PlacedReadings, condition_field, thickness_readings, width_readings
from bayesplate.board.setup import Setup
from bayesplate.board.stated import quantities_of
from bayesplate.board.words import did_you_mean
from bayesplate.errors import Fault

INPUTS = {
    "length_x": ("m", "length along the grain"),
    "length_y": ("m", "length across the grain"),
    "thickness": ("m", "thickness"),
    "mass": ("kg", "mass"),
    "density": ("kg/m^3", "density"),
    "poisson_xy": ("1", "Poisson ratio nu_xy"),
}
"""Inputs of a board on its card: unit, and name in words."""
DENSITY_KINDS: Mapping[str, DensityKind] = {"poisson_xy": "normal"}
DEFAULT_POISSON = Quantity.from_mean(0.4, 0.08, "normal")
ISOTROPIC_POISSON = Quantity.from_mean(0.3, 0.06, "normal")
"""Of an isotropic board: foams and glass lie near 0.2, most metals near 0.3, acrylic near 0.37."""


def default_poisson(is_isotropic: bool) -> Quantity:
    """The default Poisson ratio, of wood or of an isotropic board: a new object, see `Parameter.is_assumed`."""
    return replace(ISOTROPIC_POISSON if is_isotropic else DEFAULT_POISSON)


def input_parameters(
    inputs: Mapping[str, Quantity],
    setups: Sequence[Setup],
    assumed_poisson: Quantity | None,
    *,
    is_isotropic: bool = False,
) -> tuple[Parameter, ...]:
    """Inputs and clamped lengths as parameters, with an assumed Poisson ratio where none is stated.

    A thickness or a width that was read at places becomes the mean over the board of the field of the readings.
    """
    assumed = {} if assumed_poisson is None else {"poisson_xy": assumed_poisson}
    stated = {**inputs, **_field_means(inputs), **assumed}
    words = {key: name for key, (_, name) in INPUTS.items()}
    if is_isotropic:  # which has no grain
        words |= {"length_x": "length along x", "length_y": "length along y"}
    board_parameters = (
        Parameter(key, BOARD_OWNER, prior, INPUTS[key][0], display_name=words[key], assumed=assumed.get(key))
        for key, prior in stated.items()
    )
    return (*board_parameters, *(parameter for setup in setups for parameter in setup.clamped_parameters))


def _field_means(inputs: Mapping[str, Quantity]) -> dict[str, Quantity]:
    """Sizes that were read at places, with the mean of their field over the board; exact sizes are left out."""
    readings: dict[str, PlacedReadings | None] = {}
    if "length_y" in inputs and inputs["length_y"].has_profile:
        readings["length_y"] = width_readings(inputs["length_y"], inputs["length_x"])
    if "thickness" in inputs and inputs["thickness"].has_profile:
        readings["thickness"] = thickness_readings(inputs["thickness"], inputs["length_x"], inputs["length_y"])
    fields = {
        name: condition_field(placed)
        for name, placed in readings.items()
        if placed is not None and not inputs[name].is_exact
    }
    return {name: replace(inputs[name], mean=field.mean, sd=field.sd) for name, field in fields.items()}


def warp_quantities(stated: Mapping[str, Quantity | ArrayLike], place: str) -> tuple[dict[str, Quantity], list[Fault]]:
    """Heights of a warp by name as quantities, cup and twist from zero on, and faults."""
    unknown_faults = [unknown_name_fault(f"{place} warp", key, WARPS) for key in stated if key not in WARPS]
    known_warps = {key: stated[key] for key in WARPS if key in stated}
    warps, faults = quantities_of(known_warps, f"{place} warp", "in m", dict.fromkeys(WARPS, "normal"))
    for key, warp in warps.items():
        if warp.kind == "normal" and not warp.is_exact and warp.lower == -math.inf:
            warps[key] = replace(warp, lower=WARPS[key])
    return warps, [*unknown_faults, *faults]


def unknown_name_fault(place: str, name: object, known_names: Iterable[str]) -> Fault:
    """The fault of an unknown name."""
    names = tuple(known_names)
    remedy = did_you_mean(name, names) if isinstance(name, str) else ""
    return Fault(place, f"one of {', '.join(names)}", str(name), remedy)
