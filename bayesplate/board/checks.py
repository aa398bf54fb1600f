"""The list of checks of a board: what it cannot be, and what its user should know. Each row holds a condition."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from bayesplate.board.board import Board, density
from bayesplate.board.inputs import INPUTS
from bayesplate.board.quantity import Quantity
from bayesplate.board.repeated import CALIPER, FEELER, RULE, SCALES, are_alike
from bayesplate.board.setup import Setup
from bayesplate.board.words import setup_places
from bayesplate.errors import Fault

Row = tuple[str, bool, str, str, str]
"""Place, whether it holds, wanted, got, remedy."""
Remark = tuple[bool, str]
"""Whether it is to be said, and the sentence."""
Place = tuple[float, float]

LIGHTEST, HEAVIEST = 20.0, 25_000.0  # kg/m3: lighter than balsa foam, heavier than any metal in use
_LIGHT, _HEAVY = 100.0, 9_000.0  # kg/m3: balsa and brass, between which a board is likely
MOST_WARP = 0.1  # of the side: a shallow shell, of which the effect is computed, rises by less
THICKEST_SHARE = 0.5  # of the shorter side; beyond it no plate theory holds
ISOTROPIC_RANGE = (-1.0, 0.5)
"""Between which the Poisson ratio of a solid that is alike in all directions lies."""
_INCH, _THINNEST_IN_THOU, _LONGEST_IN_INCHES = 25.4, 20.0, 60.0
"""mm of an inch; a thickness in thousandths of it is a number of tens: veneer of half a millimetre has 20."""
THICK_SHARE = 0.1
"""Thickness over the shorter free side beyond which a thin plate is too stiff."""
LARGE_NOISE = 0.2
"""Relative noise beyond which frequencies say next to nothing: a modulus goes with their square."""
_NEARLY = 1e-9  # m: what a change of units rounds
_SHEAR = "transverse_shear"
_ROUND = (1.0, 2.0, 5.0)
_MOST_TOLD = 3
_STEPS = {
    "length_x_mm": f"length along x to {RULE:g} mm",
    "length_y_mm": f"length along y to {RULE:g} mm",
    "thickness_mm": f"thickness to {CALIPER:g} mm",
    "mass_g": f"mass to {SCALES:g} g",
}


def physical_faults(board: Board) -> list[Fault]:
    """Physical faults of a board; those of its labels, effects and named cards are found elsewhere."""
    rows = [*_plate(board), *_isotropic(board)]
    for setup, where in zip(board.setups, setup_places(board.file, [one.name for one in board.setups]), strict=True):
        rows += [
            *_clamps(board, setup, where),
            *_labels(setup, where),
            *_places(board, setup, where),
            *_masses(board, setup, where),
            *_bounce(setup, where),
        ]
    return faults_of(rows)


def faults_of(rows: Collection[Row] | Iterator[Row]) -> list[Fault]:
    """A fault for each row that does not hold."""
    return [Fault(where, wanted, got, remedy) for where, holds, wanted, got, remedy in rows if not holds]


def remarks(board: Board, effects: Collection[str]) -> tuple[str, ...]:
    """Remarks for the user of a board with these declared effects."""
    rows = [*_assumed(board)]
    for setup in board.setups:
        rows += [_thick(board, setup, effects), *_vague(setup), _finer_than_said(setup), *_twice(setup)]
    return tuple(dict.fromkeys(sentence for is_said, sentence in rows if is_said))


def readings_sha256(board: Board) -> str:
    """Hash of the sizes, the mass and the frequencies of a board, by which a copy is known."""
    sizes = [(name, board.inputs[name]) for name in INPUTS if name != "poisson_xy" and name in board.inputs]
    read = [(one.name, sorted((r.label, r.frequency) for r in one.readings), one.peaks) for one in board.setups]
    return hashlib.sha256(repr((sizes, board.warp, read)).encode()).hexdigest()


def board_mass(board: Board) -> float:
    """Mean mass of the whole board, kg, from its mass or its density."""
    means = board.nominal()
    return float(density(means) * means["length_x"] * means["length_y"] * means["thickness"])


def _reach(quantity: Quantity) -> float:
    """Largest value that the card allows."""
    return max(quantity.mean + 3 * quantity.sd, *quantity.readings, quantity.mean)


def _plate(board: Board) -> Iterator[Row]:
    inputs, section = board.inputs, f"{board.file} [plate]"
    heaviness, thickness = float(density(board.nominal())), inputs["thickness"].mean
    key, remedy = "density_kg_m3", "mass in g, density in kg/m3, lengths in mm"
    if "mass" in inputs:
        key, remedy = "mass_g", next(_in_other_units(inputs, heaviness), remedy)
    limits = f"a density from {LIGHTEST:g} to {HEAVIEST:g} kg/m3"
    yield f"{section} {key}", LIGHTEST <= heaviness <= HEAVIEST, limits, f"{heaviness:.3g} kg/m3", remedy

    sides = {"cup": inputs["length_y"].mean, "bow": inputs["length_x"].mean}
    thickest = THICKEST_SHARE * min(sides.values())
    remedy, thou = "no plate is so thick", thickness * _INCH / 1e3
    if 1e3 * thickness >= _THINNEST_IN_THOU and thou <= thickest:
        remedy += f"; {1e3 * thickness:g} thousandths of an inch would be {1e3 * thou:.3g} mm"
    elif thickness <= _INCH * thickest and (sides_told := _sides_in_inches(inputs)):
        remedy += f"; {sides_told}"
    wanted = f"at most half the shorter side, {1e3 * thickest:g} mm"
    yield f"{section} thickness_mm", thickness <= thickest + _NEARLY, wanted, f"{1e3 * thickness:g} mm", remedy

    for key, warp in board.warp.items():
        most = MOST_WARP * sides.get(key, max(sides.values()))
        wanted = f"at most a tenth of the side, {1e3 * most:g} mm"
        got, remedy = f"{1e3 * warp.mean:g} mm", "in mm; a board is nearly flat"
        yield f"{section} warp_mm.{key}", abs(warp.mean) <= most + _NEARLY, wanted, got, remedy

    for name in ("length_x", "length_y", "thickness"):
        for axis, places in (("x", inputs[name].at_x), ("y", inputs[name].at_y)):
            most = _reach(inputs[f"length_{axis}"])
            wanted = f"a place on the board, 0 to {1e3 * most:g} mm"
            for number, value in enumerate(places, start=1):
                where = f"{section} {name}_mm.at_{axis}_mm {number}"
                yield where, 0 <= value <= most + _NEARLY, wanted, f"{1e3 * value:g} mm", ""


def _in_other_units(inputs: Mapping[str, Quantity], heaviness: float) -> Iterator[str]:
    """The mass in g, or the sides in mm, if they had another unit in which the board would be possible."""
    mass = 1e3 * inputs["mass"].mean
    for unit, grams in (("kg", 1000.0), ("oz", 28.3495)):
        if _LIGHT <= heaviness * grams <= _HEAVY:
            yield f"{mass:g} {unit} is {mass * grams:.4g} g"
    sides = _sides_in_inches(inputs)
    if sides and any(_LIGHT <= heaviness / _INCH**sizes <= _HEAVY for sizes in (2, 3)):
        yield sides


def _sides_in_inches(inputs: Mapping[str, Quantity]) -> str:
    """The sides in mm if they had been written in inches; empty where the board would be too long."""
    x, y = (1e3 * inputs[f"length_{axis}"].mean for axis in "xy")
    told = f"sides of {x:g} and {y:g} inches would be {_INCH * x:.4g} and {_INCH * y:.4g} mm"
    return told if max(x, y) <= _LONGEST_IN_INCHES else ""


def _isotropic(board: Board) -> Iterator[Row]:
    """A Poisson ratio that no isotropic solid has; an orthotropic plate may have a larger one."""
    nu, (low, high) = board.parameter("poisson_xy"), ISOTROPIC_RANGE
    holds = not board.isotropic or nu.is_assumed or low < nu.prior.mean <= high
    wanted = f"more than {low:g} and at most {high:g} where isotropic = true"
    remedy = "the ratio of an isotropic material, or isotropic = false"
    yield f"{board.file} [material] poisson_xy", holds, wanted, f"{nu.prior.mean:g}", remedy


def _spans(board: Board, setup: Setup) -> dict[str, tuple[float, float]]:
    """From where to where the board is not covered by a clamp along x and y, m."""
    found = {}
    for axis in "xy":
        length, start, end = (
            board.inputs[f"length_{axis}"],
            setup.clamped.get(f"{axis}0"),
            setup.clamped.get(f"{axis}1"),
        )
        found[axis] = (start.mean if start else 0.0, length.mean - end.mean if end else _reach(length))
    return found


def _clamps(board: Board, setup: Setup, where: str) -> Iterator[Row]:
    for axis, (start, end) in _spans(board, setup).items():
        length = 1e3 * board.inputs[f"length_{axis}"].mean
        wanted = f"clamps that leave a part of the {length:g} mm along {axis} free"
        got = f"{1e3 * start:g} mm clamped at {axis}0, free only up to {1e3 * end:g} mm"
        yield f"{where} clamped_mm", start < end - _NEARLY, wanted, got, ""


def _labels(setup: Setup, where: str) -> Iterator[Row]:
    first = setup.first_label
    lowest = [min((getattr(label, order) for label in setup.labels), default=0) for order in ("m", "n")]
    remedy = f"first_label = [{min(lowest[0], first.m)}, {min(lowest[1], first.n)}]?"
    for label in setup.labels:
        holds = label.m >= first.m and label.n >= first.n
        yield f'{where} frequencies_hz."{label}"', holds, f"labels not below first_label, {first}", str(label), remedy
    ascending = sorted((reading.frequency.mean, reading.label) for reading in setup.readings)
    for (low, below), (high, above) in itertools.pairwise(ascending):
        wanted = f"a rounding finer than the spacing of {below} and {above}, {high - low:g} Hz"
        got, remedy = f"{setup.resolution:g} Hz", "these labels cannot be told apart"
        yield f"{where} resolution_hz", high - low >= setup.resolution, wanted, got, remedy


def _places(board: Board, setup: Setup, where: str) -> Iterator[Row]:
    places = {
        f"{where} attached {number} at_mm" + (f" {position}" if len(item.places) > 1 else ""): place
        for number, item in enumerate(setup.attached, start=1)
        for position, place in enumerate(item.places, start=1)
    }
    if setup.hammer is not None:
        places[f"{where} hammer.at_mm"] = setup.hammer
    yield from on_the_board(board, setup, places)


def on_the_board(board: Board, setup: Setup, places: Mapping[str, Place]) -> Iterator[Row]:
    """Whether each named place, m, is on the part of the board that no clamp covers."""
    (left, right), (bottom, top) = _spans(board, setup).values()
    x_range, y_range = f"x {1e3 * left:g} to {1e3 * right:g} mm", f"y {1e3 * bottom:g} to {1e3 * top:g} mm"
    wanted = f"a place on the free part of the board, {x_range}, {y_range}"
    remedy = "from the corner of x0 and y0 of the whole board"
    for where, (x, y) in places.items():
        is_on = left - _NEARLY <= x <= right + _NEARLY and bottom - _NEARLY <= y <= top + _NEARLY
        got = f"[{1e3 * x:g}, {1e3 * y:g}]"
        yield where, is_on or left >= right or bottom >= top, wanted, got, remedy


def _masses(board: Board, setup: Setup, where: str) -> Iterator[Row]:
    for number, item in enumerate(setup.attached, start=1):
        own = f"{where} attached {number}"
        if item.mass is None:
            continue
        if item.kind != "exciter":
            yield lighter_than_the_board(board, f"{own} mass_g", item.mass.mean)
            remedy = "at_mm = [x, y]; without mass_g it is a candidate of diagnose, which tries likely places"
            yield f"{own} at_mm", bool(item.places), "a place, because the mass is declared", "nothing", remedy
        elif item.coil is not None:
            wanted = f"less than the whole exciter's {1e3 * item.mass.mean:g} g"
            got, remedy = f"{1e3 * item.coil.mean:g} g", "mass_g is coil and magnet together"
            yield f"{own} coil_mass_g", item.coil.mean < item.mass.mean, wanted, got, remedy


def lighter_than_the_board(board: Board, where: str, mass: float) -> Row:
    """Whether a thing on the board, kg, weighs less than the board itself."""
    own = board_mass(board)
    return where, mass < own, f"less than the board's own {1e3 * own:.4g} g", f"{1e3 * mass:g} g", ""


def _bounce(setup: Setup, where: str) -> Iterator[Row]:
    """A support raises the square of every frequency by that of the bounce, so that no mode is below it."""
    if setup.bounce is not None and setup.readings:
        lowest, bounce = min(setup.measured), setup.bounce.mean
        wanted = f"less than the lowest mode, {lowest:g} Hz"
        remedy = "the peak of a board that moves as a whole on its support"
        yield f"{where} support.bounce_hz", bounce < lowest, wanted, f"{bounce:g} Hz", remedy


def _assumed(board: Board) -> Iterator[Remark]:
    thickness = board.inputs["thickness"]
    yield (
        thickness.is_exact,
        f"the thickness is taken as exact, and the moduli go with its third power; a caliper reads to {CALIPER:g} mm: "
        f"write thickness_mm = {{ mean = {1e3 * thickness.mean:g}, sd = {CALIPER:g} }}, or its readings",
    )
    plate: Mapping[str, Any] = {} if board.card is None else board.card.table["plate"]
    steps = [step for key, step in _STEPS.items() if _lacks_resolution(plate.get(key))]
    steps += [f"{name} to {FEELER:g} mm" for name, one in plate.get("warp_mm", {}).items() if _lacks_resolution(one)]
    yield (
        bool(steps),
        f"readings that are all alike were taken as rounded, {', '.join(steps)}; "
        "{ readings = [..], resolution = .. } states another resolution",
    )


def _lacks_resolution(value: Any) -> bool:
    if isinstance(value, dict):
        return "resolution" not in value and _lacks_resolution(value.get("readings"))
    return isinstance(value, list) and are_alike(value)


def _thick(board: Board, setup: Setup, effects: Collection[str]) -> Remark:
    covered = {axis: sum(q.mean for e, q in setup.clamped.items() if e.startswith(axis)) for axis in "xy"}
    shorter = min(board.inputs[f"length_{axis}"].mean - covered[axis] for axis in "xy")
    share = board.inputs["thickness"].mean / shorter
    return share > THICK_SHARE and _SHEAR not in effects, (
        f"the thickness is 1/{1 / share:.1f} of the shorter side, more than a tenth: transverse shear matters, and "
        f"without it the moduli come out too low; declare it with --effects {_SHEAR}"
    )


def _vague(setup: Setup) -> Iterator[Remark]:
    where = f"setup '{setup.name}'"
    noise = 0.0 if setup.is_noise_assumed or setup.noise.is_exact else setup.noise.median
    yield (
        noise > LARGE_NOISE,
        f"{where}: a noise of {100 * noise:g} % leaves the frequencies little to say: the posterior stays close to the "
        "prior",
    )
    vague = [str(one.label) for one in setup.readings if one.frequency.sd > LARGE_NOISE * one.frequency.mean]
    told = f"more than {100 * LARGE_NOISE:g} % uncertain, so they say next to nothing: {', '.join(vague)}"
    yield bool(vague), f"{where}: {told}"


def _finer_than_said(setup: Setup) -> Remark:
    """A step of rounding on which the readings do not lie; one that is no round number may itself be rounded."""
    step = setup.resolution
    if not step or float(f"{step:e}".partition("e")[0]) not in _ROUND:
        return False, ""
    named = [(f"{hz:g} of {one.label}", hz) for one in setup.readings for hz in _as_read(one.frequency)]
    finer = [name for name, hz in named if abs(2.0 * hz / step - round(2.0 * hz / step)) > 1e-6]
    told = ", ".join(finer[:_MOST_TOLD]) + (" and others" if len(finer) > _MOST_TOLD else "")
    return bool(finer), (
        f"setup '{setup.name}': resolution_hz = {step:g} says that frequencies are rounded to multiples of "
        f"{step:g} Hz, and {told} are none: state the step of the last digit that was read, or leave it out"
    )


def _twice(setup: Setup) -> Iterator[Remark]:
    """A peak without a label at the very frequency of a labelled one: it would count as two."""
    labelled = {one.frequency.mean: one.label for one in setup.readings}
    for hz in setup.unlabelled:
        yield (
            hz in labelled,
            f"setup '{setup.name}': the peak without a label at {hz:g} Hz is where {labelled.get(hz)} is: if it is the "
            "same peak, leave it out, for it counts as a second mode",
        )


def _as_read(quantity: Quantity) -> tuple[float, ...]:
    """The numbers that were read; none where a mean is stated with its standard deviation."""
    return tuple(quantity.readings) or ((quantity.mean,) if quantity.is_exact else ())
