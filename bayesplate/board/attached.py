"""Items attached to a board, a sensor, an exciter or a weight, and the fluid around it, air or water."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import ConfigDict, Field, ValidationInfo, field_validator

from bayesplate.board.measures import PLACES, Place, QuantityReader
from bayesplate.board.quantity import Quantity
from bayesplate.board.repeated import FINE_SCALES, LARGEST_FREQUENCY_RATIO, LARGEST_SIZE_RATIO
from bayesplate.board.stated import is_place, quantity_of, type_faults
from bayesplate.board.values import Choice, Complaint, Key, Number, Refusal
from bayesplate.board.words import ATTACHED_KINDS, BAFFLES, MAGNETS, quote_text
from bayesplate.errors import InputError

_MASS = QuantityReader(Number(1e-4, 1e6, "g"), furthest=LARGEST_SIZE_RATIO, resolution=FINE_SCALES).key
_SUSPENSION = QuantityReader(Number(0.1, 1e8, "N/m", "1 N/mm is 1000 N/m"), furthest=LARGEST_SIZE_RATIO).key
_RESONANCE = QuantityReader(Number(0.1, 10_000, "Hz"), furthest=LARGEST_FREQUENCY_RATIO).key
_DENSITY = QuantityReader(Number(1e-6, 2000, "kg/m3", "air at the ground is 1.2 kg/m3, water is 997")).key


@dataclass(frozen=True)
class AttachedItem:
    """Something fixed to the board: declared if it has a mass, otherwise a candidate at its place, or anywhere.

    Attributes
    ----------
    kind : str
        "accelerometer", "exciter", "shaker" or "weight"; an exciter is a coil on the board and a magnet on a spring.
    places : tuple of (float, float), m
        From the corner x = y = 0; several if it roved, none if nobody knows.
    mass : Quantity or None, kg
        Of the whole; None if not known, and so are those below, which an exciter alone has.
    coil : Quantity or None, kg
    suspension : Quantity or None, N/m
        Stiffness of the spring that holds the magnet.
    resonance : Quantity or None, Hz
        Of the magnet on that spring, in place of the suspension.
    magnet : str
        "free", or "held" by something else than the board.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")

    kind: Annotated[str, Field(description="what it is"), Key(Choice(ATTACHED_KINDS))]
    places: Annotated[
        tuple[Place, ...],
        Field(alias="at_mm", description="its place [x, y] in mm from the corner of the edges x0 and y0"),
        PLACES,
    ] = ()
    mass: Annotated[Quantity | None, Field(alias="mass_g"), _MASS] = None
    coil: Annotated[Quantity | None, Field(alias="coil_mass_g"), _MASS] = None
    suspension: Annotated[Quantity | None, Field(alias="suspension_n_per_m"), _SUSPENSION] = None
    resonance: Annotated[Quantity | None, Field(alias="resonance_hz"), _RESONANCE] = None
    magnet: Annotated[str, Key(Choice(MAGNETS))] = "free"

    def __post_init__(self) -> None:
        if not isinstance(self.places, list | tuple) or not all(map(is_place, self.places)):
            raise InputError(type_faults(str(self.kind), [("places", self.places, False, "((x, y), ...) in m")]))
        for name, unit in (("mass", "kg"), ("coil", "kg"), ("suspension", "N/m"), ("resonance", "Hz")):
            stated = getattr(self, name)
            if stated is not None:
                object.__setattr__(self, name, quantity_of(stated, f"{self.kind} {name}", f"in {unit}"))

    @field_validator("coil", "suspension", "resonance", "magnet")
    @classmethod
    def _is_of_an_exciter(cls, value: Any, info: ValidationInfo) -> Any:
        kind = info.data.get("kind", "exciter")
        if kind != "exciter":
            remedy = 'leave it out, or kind = "exciter" if it drives the board by a coil'
            raise Refusal(Complaint("it on an exciter only", f"a thing of kind {quote_text(kind)}", remedy))
        return value

    @field_validator("resonance")
    @classmethod
    def _is_stated_once(cls, value: Quantity | None, info: ValidationInfo) -> Quantity | None:
        if info.data.get("suspension") is not None:
            remedy = "each gives the other with the magnet's mass"
            raise Refusal(Complaint("one of suspension_n_per_m and resonance_hz", "both", remedy))
        return value


@dataclass(frozen=True)
class DeclaredFluid:
    """Air or water around the board: density in kg m^-3 and baffle ("none" or "full"), each None if not stated."""

    __pydantic_config__ = ConfigDict(extra="forbid")

    density: Annotated[Quantity | None, Field(alias="density_kg_m3"), _DENSITY] = None
    baffle: Annotated[str | None, Key(Choice(BAFFLES))] = None

    def __post_init__(self) -> None:
        if self.density is not None:
            object.__setattr__(self, "density", quantity_of(self.density, "fluid density", "in kg/m^3"))
