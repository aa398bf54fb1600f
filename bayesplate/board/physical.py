"""What a well-written board card cannot mean: things off the board, impossible masses, labels below the first."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping

from bayesplate.board.board_card import ISOTROPIC_RANGE, BoardCard
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup_card import SetupSection
from bayesplate.board.words import setup_places
from bayesplate.errors import Fault
from bayesplate.labels import Label

LIGHTEST, HEAVIEST = 20.0, 25_000.0  # kg/m3: lighter than balsa foam, heavier than any metal in use
_LIGHT, _HEAVY = 100.0, 9_000.0  # kg/m3: balsa and brass, between which a board is likely
MOST_WARP = 0.1  # of the side: a shallow shell, of which the effect is computed, rises by less
MM_OF_A_THOU, THINNEST_IN_THOU = 0.0254, 20.0
"""A thickness in thousandths of an inch is a number of tens and more: veneer of half a millimetre has 20."""
THICKEST_SHARE = 0.5  # of the shorter side; beyond it no plate theory holds


def physical_faults(card: BoardCard) -> list[Fault]:
    """Every physical fault of a card that follows the format.

    Parameters
    ----------
    card : BoardCard

    Returns
    -------
    list of Fault
        Empty if there is none. Cards that it names and that cannot be read are found where they are read, labels that
        no mode of the board has where modes are computed, effects that cannot act where effects are known, not here.
    """
    file = card.file
    faults = [*_plate_faults(card, file), *_isotropic_faults(card, file)]
    for setup, where in zip(card.setups, setup_places(file, [setup.name for setup in card.setups]), strict=True):
        faults += [
            *_clamp_faults(card, setup, where),
            *_label_faults(setup, where),
            *_place_faults(card, setup, where),
            *_mass_faults(card, setup, where),
            *_bounce_faults(setup, where),
        ]
    return faults


def plate_mass_g(card: BoardCard) -> float:
    """Mean mass of the whole board in g, from its mass or its density."""
    plate = card.plate
    if plate.mass_g is not None:
        return plate.mass_g.mean
    assert plate.density_kg_m3 is not None  # the schema wants one of the two
    return plate.density_kg_m3.mean * _volume_mm3(card) * 1e-6


def _volume_mm3(card: BoardCard) -> float:
    plate = card.plate
    return plate.length_x_mm.mean * plate.length_y_mm.mean * plate.thickness_mm.mean


def _reach(quantity: Quantity) -> float:
    """The largest value that the card itself holds possible."""
    return max(quantity.mean + 3 * quantity.sd, *quantity.readings, quantity.mean)


def _plate_faults(card: BoardCard, file: str) -> Iterator[Fault]:
    plate = card.plate
    density = plate_mass_g(card) / _volume_mm3(card) * 1e6
    if not LIGHTEST <= density <= HEAVIEST:
        key = "mass_g" if plate.mass_g is not None else "density_kg_m3"
        wanted = f"a density from {LIGHTEST:g} to {HEAVIEST:g} kg/m3"
        remedy = "mass in g, density in kg/m3, lengths in mm"
        if plate.mass_g is not None:
            remedy = next(_in_other_units(plate.mass_g.mean, density), remedy)
        yield Fault(f"{file} [plate] {key}", wanted, f"{density:.3g} kg/m3", remedy)
    shorter = min(plate.length_x_mm.mean, plate.length_y_mm.mean)
    if plate.thickness_mm.mean > THICKEST_SHARE * shorter:
        wanted = f"at most half the shorter side, {THICKEST_SHARE * shorter:g} mm"
        remedy, thickness = "no plate is so thick", plate.thickness_mm.mean
        if thickness >= THINNEST_IN_THOU and thickness * MM_OF_A_THOU <= THICKEST_SHARE * shorter:
            remedy += f"; {thickness:g} thousandths of an inch would be {thickness * MM_OF_A_THOU:.3g} mm"
        yield Fault(f"{file} [plate] thickness_mm", wanted, f"{thickness:g} mm", remedy)
    sides = {"cup": plate.length_y_mm.mean, "bow": plate.length_x_mm.mean}
    for key, warp in plate.warp_mm.items():
        most = MOST_WARP * sides.get(key, max(sides.values()))
        if abs(warp.mean) > most:
            wanted = f"at most a tenth of the side, {most:g} mm"
            yield Fault(f"{file} [plate] warp_mm.{key}", wanted, f"{warp.mean:g} mm", "in mm; a board is nearly flat")
    limits = {"at_x_mm": _reach(plate.length_x_mm), "at_y_mm": _reach(plate.length_y_mm)}
    for key in ("length_x_mm", "length_y_mm", "thickness_mm"):
        quantity: Quantity = getattr(plate, key)
        for axis, places in (("at_x_mm", quantity.at_x), ("at_y_mm", quantity.at_y)):
            for number, value in enumerate(places, start=1):
                if not 0 <= value <= limits[axis]:
                    wanted = f"a place on the board, 0 to {limits[axis]:g} mm"
                    yield Fault(f"{file} [plate] {key}.{axis} {number}", wanted, f"{value:g} mm")


def _isotropic_faults(card: BoardCard, file: str) -> Iterator[Fault]:
    """A Poisson ratio that no isotropic solid has; an orthotropic plate may have a larger one."""
    nu, (low, high) = card.material.poisson_xy, ISOTROPIC_RANGE
    if card.material.isotropic and not card.material.poisson_is_default and not low < nu.mean <= high:
        wanted = f"more than {low:g} and at most {high:g} where isotropic = true"
        remedy = "the ratio of an isotropic material, or isotropic = false"
        yield Fault(f"{file} [material] poisson_xy", wanted, f"{nu.mean:g}", remedy)


def _in_other_units(mass: float, density: float) -> Iterator[str]:
    """What a mass would be in g, had it been written in another unit of a balance: as far as a board can weigh that."""
    for unit, grams in (("kg", 1000.0), ("oz", 28.3495)):
        if _LIGHT <= density * grams <= _HEAVY:
            yield f"{mass:g} {unit} is {mass * grams:.4g} g"


def _free_span(length: Quantity, clamped: dict[str, float], start: str, end: str) -> tuple[float, float]:
    """From where to where the board is not covered by a clamp, in mm."""
    reach = _reach(length) if end not in clamped else length.mean
    return clamped.get(start, 0.0), reach - clamped.get(end, 0.0)


def _spans(card: BoardCard, setup: SetupSection) -> dict[str, tuple[float, float]]:
    clamped = {edge: quantity.mean for edge, quantity in setup.clamped_mm.items()}
    return {
        "x": _free_span(card.plate.length_x_mm, clamped, "x0", "x1"),
        "y": _free_span(card.plate.length_y_mm, clamped, "y0", "y1"),
    }


def _clamp_faults(card: BoardCard, setup: SetupSection, where: str) -> Iterator[Fault]:
    for axis, (start, end) in _spans(card, setup).items():
        if start >= end:
            length: Quantity = getattr(card.plate, f"length_{axis}_mm")
            wanted = f"clamps that leave a part of the {length.mean:g} mm along {axis} free"
            yield Fault(f"{where} clamped_mm", wanted, f"{start:g} mm clamped at {axis}0, free only up to {end:g} mm")


def _label_faults(setup: SetupSection, where: str) -> Iterator[Fault]:
    first = setup.first_label
    for label in setup.frequencies_hz:
        if label.m < first.m or label.n < first.n:
            wanted = f"labels not below first_label, {first}"
            remedy = f"first_label = [{min(label.m, first.m)}, {min(label.n, first.n)}]?"
            yield Fault(f'{where} frequencies_hz."{label}"', wanted, str(label), remedy)
    if setup.resolution_hz is None:
        return
    ascending = sorted(setup.frequencies_hz.items(), key=lambda item: (item[1].mean, item[0]))
    for (below, low), (above, high) in itertools.pairwise(ascending):
        if high.mean - low.mean < setup.resolution_hz:
            yield _unresolved(where, setup.resolution_hz, (below, above), high.mean - low.mean)


def _unresolved(where: str, resolution: float, pair: tuple[Label, Label], spacing: float) -> Fault:
    wanted = f"a rounding finer than the spacing of {pair[0]} and {pair[1]}, {spacing:g} Hz"
    return Fault(f"{where} resolution_hz", wanted, f"{resolution:g} Hz", "these labels cannot be told apart")


def _place_faults(card: BoardCard, setup: SetupSection, where: str) -> Iterator[Fault]:
    places = [
        (f"attached {number} at_mm" + (f" {position}" if len(item.at_mm) > 1 else ""), place)
        for number, item in enumerate(setup.attached, start=1)
        for position, place in enumerate(item.at_mm, start=1)
    ]
    if setup.hammer is not None:
        places.append(("hammer.at_mm", setup.hammer.at_mm))
    yield from off_the_board(card, setup, {f"{where} {key}": place for key, place in places})


def off_the_board(card: BoardCard, setup: SetupSection, places: Mapping[str, tuple[float, float]]) -> Iterator[Fault]:
    """A fault for each named place, mm, that is not on the part of the board that no clamp covers."""
    (left, right), (bottom, top) = _spans(card, setup).values()
    for where, (x, y) in places.items():
        if left < right and bottom < top and not (left <= x <= right and bottom <= y <= top):
            wanted = f"a place on the free part of the board, x {left:g} to {right:g} mm, y {bottom:g} to {top:g} mm"
            yield Fault(where, wanted, f"[{x:g}, {y:g}]", "from the corner of x0 and y0 of the whole board")


def _mass_faults(card: BoardCard, setup: SetupSection, where: str) -> Iterator[Fault]:
    for number, item in enumerate(setup.attached, start=1):
        own = f"{where} attached {number}"
        if item.mass_g is None:
            continue
        if item.kind != "exciter":
            yield from too_heavy(card, f"{own} mass_g", item.mass_g.mean)
        elif item.coil_mass_g is not None and item.coil_mass_g.mean >= item.mass_g.mean:
            wanted = f"less than the whole exciter's {item.mass_g.mean:g} g"
            got, remedy = f"{item.coil_mass_g.mean:g} g", "mass_g is coil and magnet together"
            yield Fault(f"{own} coil_mass_g", wanted, got, remedy)
        if not item.at_mm and item.kind != "exciter":
            remedy = "at_mm = [x, y]; without mass_g it is a candidate of diagnose, which tries likely places"
            yield Fault(f"{own} at_mm", "a place, because the mass is declared", "nothing", remedy)


def _bounce_faults(setup: SetupSection, where: str) -> Iterator[Fault]:
    """A support raises the square of every frequency by that of the bounce, so that no mode is below it."""
    bounce = None if setup.support is None else setup.support.bounce_hz
    read = [hz.mean for hz in setup.frequencies_hz.values()]
    if bounce is not None and read and bounce.mean >= min(read):
        wanted = f"less than the lowest mode, {min(read):g} Hz"
        remedy = "the peak of a board that moves as a whole on its support"
        yield Fault(f"{where} support.bounce_hz", wanted, f"{bounce.mean:g} Hz", remedy)


def too_heavy(card: BoardCard, where: str, grams: float) -> Iterator[Fault]:
    """A fault for a thing on the board that weighs as much as the board itself."""
    board = plate_mass_g(card)
    if grams >= board:
        yield Fault(where, f"less than the board's own {board:.4g} g", f"{grams:g} g")
