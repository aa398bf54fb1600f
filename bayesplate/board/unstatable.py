"""What a board made in Python holds that no card can state: values of the wrong type, and other densities."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from bayesplate.board.board_keys import WARPS
from bayesplate.board.density import DensityKind
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import NOISE_WANTED, Setup
from bayesplate.errors import Fault, printable

if TYPE_CHECKING:
    from bayesplate.board.board import Board


def attribute_faults(board: Board) -> list[Fault]:
    """A fault for every attribute of a board, of its setups and of their parts that is of another type than it says."""
    from pydantic import ConfigDict, TypeAdapter, ValidationError

    # in a list, for a dataclass takes no configuration from an adapter; its type, for the board imports this file
    config = ConfigDict(arbitrary_types_allowed=True, revalidate_instances="always")
    boards: Any = list[type(board)]  # type: ignore[misc]
    try:
        TypeAdapter(boards, config=config).validate_python([board], strict=True)
    except ValidationError as error:
        return [
            Fault(
                "board" + "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in detail["loc"][1:]),
                detail["msg"].removeprefix("Input should be "),
                printable(repr(detail["input"]))[:60],
            )
            for detail in error.errors(include_url=False)
            if not isinstance(detail["input"], str) or detail["type"] != "literal_error"  # a card refuses the word
        ]
    return []


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
