"""Quantities of a board made in Python that no card can state."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from bayesplate.board.board_keys import WARPS
from bayesplate.board.density import DensityKind
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import NOISE_WANTED, Setup
from bayesplate.errors import Fault

if TYPE_CHECKING:
    from bayesplate.board.board import Board


def unstatable_faults(board: Board) -> Iterator[Fault]:
    """A fault for every quantity of a board that a card cannot state."""
    for parameter in board.parameters:
        # sessions are found again when the card is read
        if not parameter.is_of_effect and parameter.owner.kind != "group":
            yield from _quantity_faults(
                parameter.name, parameter.prior, "normal" if parameter.name == "poisson_xy" else "log-normal"
            )
    for name, modulus in (("shear_xz", board.shear_xz), ("shear_yz", board.shear_yz)):
        if modulus is not None:
            yield from _quantity_faults(name, modulus)
    for setup in board.setups:
        for place, quantity in _setup_quantities(setup):
            if quantity is not None:
                yield from _quantity_faults(f"{setup.name} {place}", quantity)
    for name, rise in board.warp.items():
        yield from _quantity_faults(f"warp {name}", rise, "normal", WARPS[name])
    for setup in board.setups:
        if setup.noise.is_exact:
            yield Fault(f"{setup.name} noise", NOISE_WANTED, "an exact number")


def _setup_quantities(setup: Setup) -> Iterator[tuple[str, Quantity | None]]:
    """Every quantity of a setup, with its place."""
    yield "noise", setup.noise
    yield from ((str(reading.label), reading.frequency) for reading in setup.readings)
    yield from ((f"peak {i}", peak.frequency) for i, peak in enumerate(setup.peaks, start=1))
    for i, item in enumerate(setup.attached, start=1):
        yield from ((f"attached {i}", quantity) for quantity in (item.mass, item.coil, item.suspension, item.resonance))
    yield "fluid", None if setup.fluid is None else setup.fluid.density
    yield "bounce", setup.bounce


def _quantity_faults(
    place: str, quantity: Quantity, kind: DensityKind = "log-normal", lower: float = -math.inf
) -> list[Fault]:
    """Faults of a quantity that a card cannot state, because its key takes one kind and one lower bound."""
    if quantity.is_exact or (quantity.kind == kind and (quantity.lower, quantity.upper) == (lower, math.inf)):
        return []
    is_bounded = math.isfinite(quantity.lower) or math.isfinite(quantity.upper)
    got = f"a {quantity.kind} one" + (" with bounds" if is_bounded else "")
    bounds = f"from {lower:g} on" if math.isfinite(lower) else "without bounds"
    return [Fault(place, f"a {kind} quantity {bounds}, as cards state it", got)]
