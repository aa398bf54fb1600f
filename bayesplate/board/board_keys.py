"""The keys of a board card: its plate, its material, and its setups."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Annotated, Any

from pydantic import Field

from bayesplate.board.fragment import merge_fragment
from bayesplate.board.measures import DENSITY, POISSON, QuantityReader
from bayesplate.board.quantity import Quantity
from bayesplate.board.repeated import CALIPER, FEELER, LARGEST_SIZE_RATIO, RULE, SCALES
from bayesplate.board.schema import BaseCard, Section, fault_place, validate_card
from bayesplate.board.setup_keys import SetupKeys
from bayesplate.board.shelf import CAMPAIGN_REMEDY, CardFile
from bayesplate.board.values import (
    CardReference,
    Complaint,
    Key,
    Number,
    Refusal,
    Text,
    list_of_tables,
    read_boolean,
    read_effects,
    read_entries,
)
from bayesplate.board.words import quote_text, show_value
from bayesplate.errors import Fault, InputError

DEFAULT_PRIOR = "weakly-informative"
MOST_SETUPS = 20
_SIZE_READER = partial(QuantityReader, furthest=LARGEST_SIZE_RATIO)
_LENGTH = Number(1, 100_000, "mm", too_small="in mm: 1 m is 1000 mm, 1 cm is 10 mm")
_LENGTH_X = _SIZE_READER(_LENGTH, places=("at_y_mm",), resolution=RULE).key
_LENGTH_Y = _SIZE_READER(_LENGTH, places=("at_x_mm",), resolution=RULE).key
_THICKNESS = _SIZE_READER(Number(0.01, 1000, "mm"), places=("at_x_mm", "at_y_mm"), resolution=CALIPER).key
_DENSITY = _SIZE_READER(DENSITY).key
_MASS = _SIZE_READER(Number(1e-3, 1e8, "g"), resolution=SCALES).key
_WARP_SIGN_HINT = "seen from below every warp has the other sign, and turning the board over changes nothing"
WARPS = {"cup": 0.0, "bow": -math.inf, "twist": 0.0}
"""Forms of warp with their lowest value: the sign of all three at once changes nothing, nor does that of the twist
alone."""
_WARP_KEYS = {
    name: QuantityReader(
        Number(0 if lowest == 0 else -1000, 1000, "mm", _WARP_SIGN_HINT if lowest == 0 else ""),
        "normal",
        resolution=FEELER,
        widest=1000,
        lower=lowest,
    ).key
    for name, lowest in WARPS.items()
}
_SHEAR = QuantityReader(Number(1e-4, 1000, "GPa")).key


def _read_warp(value: object) -> dict[str, Quantity]:
    """The rise across the width, along the length and of a corner, as read with a straightedge."""
    if not isinstance(value, dict):
        raise Refusal(Complaint("a table of cup, bow and twist, { cup = 0.8 }", show_value(value)))
    return read_entries(value, {name: key.read for name, key in _WARP_KEYS.items()})


_WARP = Key(_read_warp, lambda warps: {name: _WARP_KEYS[name].write(rise) for name, rise in warps.items()})


class PlateKeys(Section):
    """The whole board before clamping: its lengths, and its mass or its density, one of the two.

    Its warp is read with a straightedge: `cup` is the rise across the width, `bow` that along the length, of
    the cup's sign on a dome and negative on a saddle, `twist` a corner's lift off a table that the other three touch.
    """

    length_x: Annotated[Quantity, _LENGTH_X] = Field(
        alias="length_x_mm", description="the length along the grain in mm"
    )
    length_y: Annotated[Quantity, _LENGTH_Y] = Field(
        alias="length_y_mm", description="the length across the grain in mm"
    )
    thickness: Annotated[Quantity, _THICKNESS] = Field(alias="thickness_mm", description="the thickness in mm")
    mass: Annotated[Quantity | None, _MASS] = Field(default=None, alias="mass_g")
    density: Annotated[Quantity | None, _DENSITY] = Field(default=None, alias="density_kg_m3")
    warp: Annotated[Mapping[str, Quantity], _WARP] = Field(default={}, alias="warp_mm")


class MaterialKeys(Section):
    """What is known of the material: nu_xy, thick-plate shear moduli, and the prior card of the constants.

    An isotropic one has E_y = E_x, and G_xy = E_x / (2 (1 + nu_xy)).
    """

    poisson_xy: Annotated[Quantity | None, POISSON] = None
    shear_xz: Annotated[Quantity | None, _SHEAR] = Field(default=None, alias="shear_xz_gpa")
    shear_yz: Annotated[Quantity | None, _SHEAR] = Field(default=None, alias="shear_yz_gpa")
    isotropic: Annotated[bool, Key(read_boolean)] = False
    prior: CardReference = DEFAULT_PRIOR


class BoardKeys(BaseCard):
    """A board card, in SI units. `read_board` makes one; a `Board` is made from it."""

    source: Text = ""
    notes: Text = ""
    effects: Annotated[tuple[str, ...] | None, Key(read_effects, list)] = None
    plate: PlateKeys = Field(description="a [plate] table")
    material: MaterialKeys = MaterialKeys()
    setups: Annotated[tuple[SetupKeys, ...], list_of_tables("[[setup]] tables", MOST_SETUPS)] = Field(
        alias="setup", description="a [setup] table, or several [[setup]]"
    )


def read_board(
    card: CardFile, may_lack_frequencies: bool = False, setup: str | os.PathLike[str] | None = None
) -> tuple[BoardKeys, CardFile]:
    """The keys of a card, and the card with the fragment that completes it; InputError has every fault at once."""
    table, file = card.table, card.display_name
    if {*table} == {"setup"} and isinstance(table["setup"], dict):
        remedy = f"it completes a card: CARD --setup {file}"
        raise InputError(Fault(file, "a card, which has a [plate]", "a [setup] alone, as pick writes it", remedy))
    if "boards" in table and not {"plate", "setup"} & table.keys():
        raise InputError(Fault(file, "a board card", "a campaign", CAMPAIGN_REMEDY))
    if setup is not None:
        table, file = merge_fragment(table, file, setup)
        card = CardFile(table, card.name, card.folder)
    context = {"may_lack_frequencies": may_lack_frequencies}
    return validate_card(BoardKeys, card, _cross_key_faults, context, file), card


def _cross_key_faults(table: Mapping[str, Any], file: str) -> Iterator[Fault]:
    """Faults unless there is exactly one of mass and density, and a name of its own for each of several setups."""
    plate, setups = table.get("plate"), table.get("setup")
    mass_keys = [key for key in ("mass_g", "density_kg_m3") if isinstance(plate, dict) and key in plate]
    if isinstance(plate, dict) and len(mass_keys) != 1:
        got = (
            f"both, {show_value(plate['mass_g'])} and {show_value(plate['density_kg_m3'])}" if mass_keys else "neither"
        )
        yield Fault(fault_place(file, table, ("plate",)), "exactly one of mass_g and density_kg_m3", got)
    if not isinstance(setups, list) or not 2 <= len(setups) <= MOST_SETUPS:
        return
    seen_names: set[str] = set()
    for index, setup in enumerate(setups):
        if not isinstance(setup, dict):
            continue
        name, name_place = setup.get("name"), fault_place(file, table, ("setup", index, "name"))
        if name is None:
            yield Fault(name_place, "a name, because there are several setups", "nothing")
        elif isinstance(name, str) and name.casefold() in seen_names:
            yield Fault(name_place, "a name of its own", f"{quote_text(name)} again")
        seen_names.add(str(name).casefold())
