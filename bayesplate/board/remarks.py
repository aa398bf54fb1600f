"""What a card leaves to be assumed or makes doubtful, in a sentence each: accepted, but the user is told."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

from bayesplate.board.board_card import BoardCard
from bayesplate.board.quantity import Quantity
from bayesplate.board.repeated import CALIPER, FEELER, RULE, SCALES, are_alike
from bayesplate.board.setup_card import SetupSection

THICK_SHARE = 0.1
"""Thickness over the shorter free side beyond which a thin plate is too stiff."""

LARGE_NOISE = 0.2
"""Relative noise beyond which frequencies say next to nothing: a modulus goes with their square."""

_SHEAR = "transverse_shear"
_ROUND = (1.0, 2.0, 5.0)
_MOST_TOLD = 3
_SIZES = {
    "length_x_mm": ("length along x", f"{RULE:g} mm"),
    "length_y_mm": ("length along y", f"{RULE:g} mm"),
    "thickness_mm": ("thickness", f"{CALIPER:g} mm"),
    "mass_g": ("mass", f"{SCALES:g} g"),
}


def remarks(card: BoardCard, effects: Collection[str]) -> tuple[str, ...]:
    """What the user of a card should know before its numbers.

    Parameters
    ----------
    card : BoardCard
    effects : collection of str
        Names of the declared effects.

    Returns
    -------
    tuple of str
    """
    found = [*_exact_thickness(card), *_assumed_resolutions(card)]
    for setup in card.setups:
        found += [*_thick(card, setup, effects), *_noisy(setup), *_finer_than_said(setup), *_twice(setup)]
    return tuple(dict.fromkeys(found))


def _exact_thickness(card: BoardCard) -> Iterator[str]:
    thickness = card.plate.thickness_mm
    if thickness.is_exact:
        yield (
            f"the thickness is taken as exact, and the moduli go with its third power; a caliper reads to "
            f"{CALIPER:g} mm: write thickness_mm = {{ mean = {thickness.mean:g}, sd = {CALIPER:g} }}, or its readings"
        )


def _assumed_resolutions(card: BoardCard) -> Iterator[str]:
    plate = card.written.get("plate", {})
    assumed = [f"{name} to {step}" for key, (name, step) in _SIZES.items() if _lacks_resolution(plate.get(key))]
    warp = plate.get("warp_mm", {})
    assumed += [f"{name} to {FEELER:g} mm" for name, read in warp.items() if _lacks_resolution(read)]
    if assumed:
        yield (
            f"readings that are all alike were taken as rounded, {', '.join(assumed)}; "
            "{ readings = [..], resolution = .. } states another resolution"
        )


def _lacks_resolution(value: Any) -> bool:
    if isinstance(value, dict):
        return "resolution" not in value and _lacks_resolution(value.get("readings"))
    return isinstance(value, list) and are_alike(value)


def _thick(card: BoardCard, setup: SetupSection, effects: Collection[str]) -> Iterator[str]:
    covered = {axis: sum(q.mean for e, q in setup.clamped_mm.items() if e.startswith(axis)) for axis in "xy"}
    plate = card.plate
    shorter = min(plate.length_x_mm.mean - covered["x"], plate.length_y_mm.mean - covered["y"])
    share = plate.thickness_mm.mean / shorter
    if share > THICK_SHARE and _SHEAR not in effects:
        yield (
            f"the thickness is 1/{1 / share:.1f} of the shorter side, more than a tenth: transverse shear matters, and "
            f"without it the moduli come out too low; declare it with --effects {_SHEAR}"
        )


def _noisy(setup: SetupSection) -> Iterator[str]:
    where = f"setup '{setup.name}'"
    if setup.noise_percent is not None and setup.noise_percent.median > 100.0 * LARGE_NOISE:
        yield (
            f"{where}: a noise of {setup.noise_percent.median:g} % leaves the frequencies little to say: the posterior "
            "stays close to the prior"
        )
    vague = [str(label) for label, hz in setup.frequencies_hz.items() if hz.sd > LARGE_NOISE * hz.mean]
    if vague:
        yield f"{where}: more than {100 * LARGE_NOISE:g} % uncertain, so they say next to nothing: {', '.join(vague)}"


def _finer_than_said(setup: SetupSection) -> Iterator[str]:
    """A step of rounding on which the readings do not lie; one that is no round number may itself be rounded."""
    step = setup.resolution_hz
    if step is None or float(f"{step:e}".partition("e")[0]) not in _ROUND:
        return
    named = [(f"{hz:g} of {label}", hz) for label, q in setup.frequencies_hz.items() for hz in _as_read(q)]
    finer = [name for name, hz in named if abs(2.0 * hz / step - round(2.0 * hz / step)) > 1e-6]
    if finer:
        told = ", ".join(finer[:_MOST_TOLD]) + (" and others" if len(finer) > _MOST_TOLD else "")
        yield (
            f"setup '{setup.name}': resolution_hz = {step:g} says that frequencies are rounded to multiples of "
            f"{step:g} Hz, and {told} are none: state the step of the last digit that was read, or leave it out"
        )


def _twice(setup: SetupSection) -> Iterator[str]:
    """A peak without a label at the very frequency of a labelled one: it would count as two."""
    labelled = {q.mean: label for label, q in setup.frequencies_hz.items()}
    for hz in (q.mean for q in (*setup.unlabelled_hz, *(peak.hz for peak in setup.peaks))):
        if hz in labelled:
            yield (
                f"setup '{setup.name}': the peak without a label at {hz:g} Hz is where {labelled[hz]} is: if it is the "
                "same peak, leave it out, for it counts as a second mode"
            )


def _as_read(quantity: Quantity) -> tuple[float, ...]:
    """The numbers that were read; none where a mean is stated with its standard deviation."""
    return tuple(quantity.readings) or ((quantity.mean,) if quantity.is_exact else ())
