"""Checks of a board: physical faults, and remarks for its user. Each check holds a condition."""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from bayesplate.board.board import Board, board_density, nominal_mass
from bayesplate.board.inputs import INPUTS
from bayesplate.board.measures import Place
from bayesplate.board.quantity import Quantity
from bayesplate.board.repeated import CALIPER, FEELER, RULE, SCALES, are_equal
from bayesplate.board.setup import Setup
from bayesplate.board.words import setup_places
from bayesplate.errors import Fault

Check = tuple[str, bool, str, str, str]
"""Place, whether it holds, wanted, got, remedy."""
Remark = tuple[bool, str]
"""Whether the remark applies, and its sentence."""

LIGHTEST, HEAVIEST = 20.0, 25_000.0  # kg/m3: lighter than balsa foam, heavier than any metal in use
_LIKELY_LIGHTEST, _LIKELY_HEAVIEST = 100.0, 9_000.0  # kg/m3: balsa and brass, between which a board is likely
MOST_WARP = 0.1  # of the side: a shallow shell, of which the effect is computed, rises by less
THICKEST_SHARE = 0.5  # of the shorter side; beyond it no plate theory holds
ISOTROPIC_RANGE = (-1.0, 0.5)
"""Limits of the Poisson ratio of an isotropic solid."""
_INCH, _THINNEST_IN_THOU, _LONGEST_IN_INCHES = 25.4, 20.0, 60.0
"""mm of an inch; a thickness in thousandths of it is a number of tens: veneer of half a millimetre has 20."""
THICK_SHARE = 0.1
"""Thickness over the shorter free side beyond which a thin plate is too stiff."""
LARGE_NOISE = 0.2
"""Relative noise beyond which frequencies say next to nothing: a modulus goes with their square."""
_TOLERANCE = 1e-9  # m: the rounding of a change of units
_SHEAR = "transverse_shear"
_ROUND_DIGITS = (1.0, 2.0, 5.0)
_MOST_LISTED = 3
_ASSUMED_STEPS = {
    "length_x_mm": f"length along x to {RULE:g} mm",
    "length_y_mm": f"length along y to {RULE:g} mm",
    "thickness_mm": f"thickness to {CALIPER:g} mm",
    "mass_g": f"mass to {SCALES:g} g",
}


def physical_faults(board: Board) -> list[Fault]:
    """Physical faults of a board; those of its labels, effects and named cards are found elsewhere."""
    rows = [*_plate_checks(board), *_poisson_check(board)]
    for setup, section in zip(board.setups, setup_places(board.file, [s.name for s in board.setups]), strict=True):
        rows += [
            *_clamp_checks(board, setup, section),
            *_label_checks(setup, section),
            *_attached_place_checks(board, setup, section),
            *_mass_checks(board, setup, section),
            *_bounce_checks(setup, section),
        ]
    return faults_of(rows)


def faults_of(rows: Collection[Check] | Iterator[Check]) -> list[Fault]:
    """A fault for each check that does not hold."""
    return [Fault(place, wanted, got, remedy) for place, holds, wanted, got, remedy in rows if not holds]


def board_remarks(board: Board, effects: Collection[str]) -> tuple[str, ...]:
    """Remarks for the user of a board with these declared effects."""
    rows = [*_assumption_remarks(board)]
    for setup in board.setups:
        rows += [
            _thickness_remark(board, setup, effects),
            *_uncertainty_remarks(setup),
            _resolution_remark(setup),
            *_close_pair_remarks(setup),
            *_repeated_peak_remarks(setup),
        ]
    return tuple(dict.fromkeys(sentence for is_said, sentence in rows if is_said))


def readings_sha256(board: Board) -> str:
    """Hash of the sizes, the mass and the frequencies of a board, by which a copy is recognised."""
    sizes = [(name, board.inputs[name]) for name in INPUTS if name != "poisson_xy" and name in board.inputs]
    readings = [
        (setup.edges, sorted((reading.label, reading.frequency) for reading in setup.readings), setup.peaks)
        for setup in board.setups
    ]
    return hashlib.sha256(repr((sizes, board.warp, readings)).encode()).hexdigest()


def _largest_value(quantity: Quantity) -> float:
    """Largest value that the card allows."""
    return max(quantity.mean + 3 * quantity.sd, *quantity.readings, quantity.mean)


def _plate_checks(board: Board) -> Iterator[Check]:
    inputs, section = board.inputs, f"{board.file} [plate]"
    mean_density, thickness = float(board_density(board.nominal())), inputs["thickness"].mean
    key, remedy = "density_kg_m3", "mass in g, density in kg/m3, lengths in mm"
    if "mass" in inputs:
        key, remedy = "mass_g", next(_in_other_units(inputs, mean_density), remedy)
    limits = f"a density from {LIGHTEST:g} to {HEAVIEST:g} kg/m3"
    yield f"{section} {key}", LIGHTEST <= mean_density <= HEAVIEST, limits, f"{mean_density:.3g} kg/m3", remedy

    sides = {"cup": inputs["length_y"].mean, "bow": inputs["length_x"].mean}
    thickest = THICKEST_SHARE * min(sides.values())
    remedy, thou = "no plate is so thick", thickness * _INCH / 1e3
    if 1e3 * thickness >= _THINNEST_IN_THOU and thou <= thickest:
        remedy += f"; {1e3 * thickness:g} thousandths of an inch would be {1e3 * thou:.3g} mm"
    elif thickness <= _INCH * thickest and (sides_remedy := _sides_in_inches(inputs)):
        remedy += f"; {sides_remedy}"
    wanted = f"at most half the shorter side, {1e3 * thickest:g} mm"
    yield f"{section} thickness_mm", thickness <= thickest + _TOLERANCE, wanted, f"{1e3 * thickness:g} mm", remedy

    for key, warp in board.warp.items():
        limit = MOST_WARP * sides.get(key, max(sides.values()))
        wanted = f"at most a tenth of the side, {1e3 * limit:g} mm"
        got, remedy = f"{1e3 * warp.mean:g} mm", "in mm; a board is nearly flat"
        yield f"{section} warp_mm.{key}", abs(warp.mean) <= limit + _TOLERANCE, wanted, got, remedy

    for name in ("length_x", "length_y", "thickness"):
        for axis, places in (("x", inputs[name].at_x), ("y", inputs[name].at_y)):
            limit = _largest_value(inputs[f"length_{axis}"])
            wanted = f"a place on the board, 0 to {1e3 * limit:g} mm"
            for number, value in enumerate(places, start=1):
                coordinate = f"{section} {name}_mm.at_{axis}_mm {number}"
                yield coordinate, 0 <= value <= limit + _TOLERANCE, wanted, f"{1e3 * value:g} mm", ""


def _in_other_units(inputs: Mapping[str, Quantity], mean_density: float) -> Iterator[str]:
    """The mass in g, or the sides in mm, if they had another unit in which the board would be possible."""
    mass = 1e3 * inputs["mass"].mean
    for unit, grams in (("kg", 1000.0), ("oz", 28.3495)):
        if _LIKELY_LIGHTEST <= mean_density * grams <= _LIKELY_HEAVIEST:
            yield f"{mass:g} {unit} is {mass * grams:.4g} g"
    sides = _sides_in_inches(inputs)
    if sides and any(_LIKELY_LIGHTEST <= mean_density / _INCH**power <= _LIKELY_HEAVIEST for power in (2, 3)):
        yield sides


def _sides_in_inches(inputs: Mapping[str, Quantity]) -> str:
    """The sides in mm if they had been written in inches; empty where the board would be too long."""
    x, y = (1e3 * inputs[f"length_{axis}"].mean for axis in "xy")
    sentence = f"sides of {x:g} and {y:g} inches would be {_INCH * x:.4g} and {_INCH * y:.4g} mm"
    return sentence if max(x, y) <= _LONGEST_IN_INCHES else ""


def _poisson_check(board: Board) -> Iterator[Check]:
    """A Poisson ratio that no isotropic solid has; an orthotropic plate may have a larger one."""
    nu, (low, high) = board.parameter("poisson_xy"), ISOTROPIC_RANGE
    holds = not board.isotropic or nu.is_assumed or low < nu.prior.mean <= high
    wanted = f"more than {low:g} and at most {high:g} where isotropic = true"
    remedy = "the ratio of an isotropic material, or isotropic = false"
    yield f"{board.file} [material] poisson_xy", holds, wanted, f"{nu.prior.mean:g}", remedy


def _free_spans(board: Board, setup: Setup) -> dict[str, tuple[float, float]]:
    """Start and end of the part of the board that no clamp covers, along x and y, m."""
    spans = {}
    for axis in "xy":
        length, start, end = (
            board.inputs[f"length_{axis}"],
            setup.clamped.get(f"{axis}0"),
            setup.clamped.get(f"{axis}1"),
        )
        spans[axis] = (start.mean if start else 0.0, length.mean - end.mean if end else _largest_value(length))
    return spans


def _clamp_checks(board: Board, setup: Setup, section: str) -> Iterator[Check]:
    for axis, (start, latest_end) in _free_spans(board, setup).items():
        end = min(latest_end, board.inputs[f"length_{axis}"].mean)
        length = 1e3 * board.inputs[f"length_{axis}"].mean
        wanted = f"clamps that leave a part of the {length:g} mm along {axis} free"
        got = f"{1e3 * start:g} mm clamped at {axis}0, free only up to {1e3 * end:g} mm"
        yield f"{section} clamped_mm", start < end - _TOLERANCE, wanted, got, ""


def _label_checks(setup: Setup, section: str) -> Iterator[Check]:
    first = setup.first_label
    lowest = [min((getattr(label, order) for label in setup.labels), default=0) for order in ("m", "n")]
    remedy = f"first_label = [{min(lowest[0], first.m)}, {min(lowest[1], first.n)}]?"
    for label in setup.labels:
        holds = label.m >= first.m and label.n >= first.n
        yield f'{section} frequencies_hz."{label}"', holds, f"labels not below first_label, {first}", str(label), remedy
    lowest_hz = min((*setup.measured, *setup.unlabelled), default=math.inf)
    wanted, got = f"a rounding below a quarter of the lowest frequency, {lowest_hz:g} Hz", f"{setup.resolution:g} Hz"
    yield f"{section} resolution_hz", setup.resolution < lowest_hz / 4.0, wanted, got, "the step of the last digit"


def _attached_place_checks(board: Board, setup: Setup, section: str) -> Iterator[Check]:
    places = {
        f"{section} attached {number} at_mm" + (f" {position}" if len(item.places) > 1 else ""): place
        for number, item in enumerate(setup.attached, start=1)
        for position, place in enumerate(item.places, start=1)
    }
    if setup.hammer is not None:
        places[f"{section} hammer.at_mm"] = setup.hammer
    yield from place_checks(board, setup, places)


def place_checks(board: Board, setup: Setup, places: Mapping[str, Place]) -> Iterator[Check]:
    """Whether each named place, m, is on the part of the board that no clamp covers."""
    (left, right), (bottom, top) = _free_spans(board, setup).values()
    x_range, y_range = f"x {1e3 * left:g} to {1e3 * right:g} mm", f"y {1e3 * bottom:g} to {1e3 * top:g} mm"
    wanted = f"a place on the free part of the board, {x_range}, {y_range}"
    remedy = "from the corner of x0 and y0 of the whole board"
    for name, (x, y) in places.items():
        is_on = left - _TOLERANCE <= x <= right + _TOLERANCE and bottom - _TOLERANCE <= y <= top + _TOLERANCE
        got = f"[{1e3 * x:g}, {1e3 * y:g}]"
        yield name, is_on or left >= right or bottom >= top, wanted, got, remedy


def _mass_checks(board: Board, setup: Setup, section: str) -> Iterator[Check]:
    for number, item in enumerate(setup.attached, start=1):
        item_place = f"{section} attached {number}"
        if item.mass is None:
            continue
        if item.kind != "exciter":
            yield mass_check(board, f"{item_place} mass_g", item.mass.mean)
            remedy = "at_mm = [x, y]; without mass_g it is a candidate of diagnose, which tries likely places"
            yield f"{item_place} at_mm", bool(item.places), "a place, because the mass is declared", "nothing", remedy
        elif item.coil is not None:
            wanted = f"less than the whole exciter's {1e3 * item.mass.mean:g} g"
            got, remedy = f"{1e3 * item.coil.mean:g} g", "mass_g is coil and magnet together"
            yield f"{item_place} coil_mass_g", item.coil.mean < item.mass.mean, wanted, got, remedy


def mass_check(board: Board, place: str, mass: float) -> Check:
    """Whether an attached mass, kg, is less than that of the board itself."""
    limit = nominal_mass(board)
    return place, mass < limit, f"less than the board's own {1e3 * limit:.4g} g", f"{1e3 * mass:g} g", ""


def _bounce_checks(setup: Setup, section: str) -> Iterator[Check]:
    """A support raises the square of every frequency by that of the bounce, so that no mode is below it."""
    if setup.bounce is not None:
        lowest, bounce = min((*setup.measured, *setup.unlabelled), default=math.inf), setup.bounce.mean
        wanted = f"less than the lowest mode, {lowest:g} Hz"
        remedy = "the peak of a board that moves as a whole on its support"
        yield f"{section} support.bounce_hz", bounce < lowest, wanted, f"{bounce:g} Hz", remedy


def _assumption_remarks(board: Board) -> Iterator[Remark]:
    thickness = board.inputs["thickness"]
    yield (
        thickness.is_exact,
        f"the thickness is taken as exact, and 1 % of it is 3 % of the moduli; a caliper reads to {CALIPER:g} mm: "
        f"write thickness_mm = {{ mean = {1e3 * thickness.mean:g}, sd = {CALIPER:g} }}, or its readings",
    )
    plate: Mapping[str, Any] = {} if board.card is None else board.card.table["plate"]
    steps = [step for key, step in _ASSUMED_STEPS.items() if _lacks_resolution(plate.get(key))]
    steps += [f"{name} to {FEELER:g} mm" for name, rise in plate.get("warp_mm", {}).items() if _lacks_resolution(rise)]
    yield (
        bool(steps),
        f"readings that are all alike were taken as rounded, {', '.join(steps)}; "
        "{ readings = [..], resolution = .. } states another resolution",
    )


def _lacks_resolution(value: Any) -> bool:
    if isinstance(value, dict):
        return "resolution" not in value and _lacks_resolution(value.get("readings"))
    return isinstance(value, list) and are_equal(value)


def _thickness_remark(board: Board, setup: Setup, effects: Collection[str]) -> Remark:
    covered = {
        axis: sum(length.mean for edge, length in setup.clamped.items() if edge.startswith(axis)) for axis in "xy"
    }
    shorter = min(board.inputs[f"length_{axis}"].mean - covered[axis] for axis in "xy")
    share = board.inputs["thickness"].mean / shorter
    return share > THICK_SHARE and _SHEAR not in effects, (
        f"the thickness is 1/{1 / share:.1f} of the shorter side, more than a tenth: transverse shear matters, and "
        f"without it the moduli come out too low; declare it with --effects {','.join((*effects, _SHEAR))}"
    )


def _uncertainty_remarks(setup: Setup) -> Iterator[Remark]:
    title = f"setup '{setup.name}'"
    noise = 0.0 if setup.is_noise_assumed or setup.noise.is_exact else setup.noise.median
    yield (
        noise > LARGE_NOISE,
        f"{title}: a noise of {100 * noise:g} % leaves the frequencies little to say: the posterior stays close to the "
        "prior",
    )
    labels = [
        str(reading.label) for reading in setup.readings if reading.frequency.sd > LARGE_NOISE * reading.frequency.mean
    ]
    sentence = f"more than {100 * LARGE_NOISE:g} % uncertain, so they say next to nothing: {', '.join(labels)}"
    yield bool(labels), f"{title}: {sentence}"


def _resolution_remark(setup: Setup) -> Remark:
    """A remark on readings that are no multiples of the rounding step, unless the step is itself a rounded number."""
    step = setup.resolution
    if not step or float(f"{step:e}".partition("e")[0]) not in _ROUND_DIGITS:
        return False, ""
    readings = [
        (f"{hz:g} of {reading.label}", hz) for reading in setup.readings for hz in _numbers_read(reading.frequency)
    ]
    finer = [name for name, hz in readings if abs(2.0 * hz / step - round(2.0 * hz / step)) > 1e-6]
    examples = ", ".join(finer[:_MOST_LISTED]) + (" and others" if len(finer) > _MOST_LISTED else "")
    return bool(finer), (
        f"setup '{setup.name}': resolution_hz = {step:g} says that frequencies are rounded to multiples of "
        f"{step:g} Hz, and {examples} are none: state the step of the last digit that was read, or leave it out"
    )


def _close_pair_remarks(setup: Setup) -> Iterator[Remark]:
    """Two readings less than a rounding apart: one peak that was read twice, or two modes that their figures tell."""
    ascending = sorted((reading.frequency.mean, reading.label) for reading in setup.readings)
    for (low, below), (high, above) in itertools.pairwise(ascending):
        yield (
            high - low < setup.resolution,
            f"setup '{setup.name}': {below} and {above} are less than the rounding of {setup.resolution:g} Hz apart: "
            "their figures alone tell which is which, and that they are two",
        )


def _repeated_peak_remarks(setup: Setup) -> Iterator[Remark]:
    """A peak without a label at the very frequency of another one: it would count as two."""
    labelled = {reading.frequency.mean: reading.label for reading in setup.readings}
    for hz in setup.unlabelled:
        yield (
            hz in labelled,
            f"setup '{setup.name}': the peak without a label at {hz:g} Hz is where {labelled.get(hz)} is: if it is the "
            "same peak, leave it out, for it counts as a second mode",
        )
    for hz in sorted({*setup.unlabelled}):
        yield (
            setup.unlabelled.count(hz) > 1,
            f"setup '{setup.name}': several peaks without a label are at {hz:g} Hz: if they are one peak, leave one, "
            "for each counts as a mode of its own",
        )


def _numbers_read(quantity: Quantity) -> tuple[float, ...]:
    """The numbers that were read; none where a mean is stated with its standard deviation."""
    return tuple(quantity.readings) or ((quantity.mean,) if quantity.is_exact else ())
