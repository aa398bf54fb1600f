"""A board as the text of a card: the way back from SI units to the keys and units of the card format."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import takewhile

from bayesplate.board.board import WARPS, Board
from bayesplate.board.parameter import BOARD
from bayesplate.board.quantity import Kind, Quantity
from bayesplate.board.reading import Peak
from bayesplate.board.setup import NOISE_WANTED, AttachedItem, Setup
from bayesplate.board.setup_card import MISSED, SPURIOUS
from bayesplate.board.writing import array, density_numbers, number, quantity, table, text, unstatable
from bayesplate.errors import Fault, InputError

_MILLI = 1e-3
_PERCENT = 1e-2
_INPUT_KEYS = {
    "length_x": ("length_x_mm", _MILLI),
    "length_y": ("length_y_mm", _MILLI),
    "thickness": ("thickness_mm", _MILLI),
    "mass": ("mass_g", _MILLI),
    "density": ("density_kg_m3", 1.0),
}
"""Key of each input, and one unit of the key in SI."""


def card_text(board: Board) -> str:
    """The card of a board, as TOML; reading it gives the board again, what was assumed from the prior it is read with.

    Parameters
    ----------
    board : Board

    Returns
    -------
    str
        In card format 1. Effects in another form than a card can state (`Board.chosen`) are written by their names.

    Raises
    ------
    InputError
        If a quantity has a density that no card can state.
    """
    own = [one for one in board.parameters if one.owner == BOARD and not one.is_of_effect and not one.is_assumed]
    inputs = {one.name: one.prior for one in own}
    faults = [fault for place, one, kind in _uncertain(board) for fault in unstatable(place, one, kind)]
    exact = (setup.name for setup in board.setups if setup.noise.is_exact)
    faults += [
        fault for name, one in board.warp.items() for fault in unstatable(f"warp {name}", one, "normal", WARPS[name])
    ]
    faults += [Fault(f"{name} noise", NOISE_WANTED, "an exact number") for name in exact]
    if faults:
        raise InputError(faults)
    lines = ["format = 1", f"name = {text(board.name)}"]
    lines += [f"{key} = {text(said)}" for key, said in (("title", board.title), ("source", board.source)) if said]
    if board.effects or not board.implies:
        lines.append(f"effects = {array(text(name) for name in board.effects)}")
    lines += ["", "[plate]"]
    lines += [f"{key} = {quantity(inputs[name], f, f)}" for name, (key, f) in _INPUT_KEYS.items() if name in inputs]
    if board.warp:
        lines.append(f"warp_mm = {table({name: quantity(rise, _MILLI) for name, rise in board.warp.items()})}")
    lines += ["", "[material]"]
    lines += [f"poisson_xy = {quantity(inputs['poisson_xy'], 1.0)}"] if "poisson_xy" in inputs else []
    lines += ["isotropic = true"] if board.isotropic else []
    lines += [f"prior = {text(board.prior)}"]
    shear = {"shear_xz_gpa": board.shear_xz, "shear_yz_gpa": board.shear_yz}
    lines += [f"{key} = {quantity(modulus, 1e9)}" for key, modulus in shear.items() if modulus is not None]
    header = "[setup]" if len(board.setups) == 1 else "[[setup]]"
    for setup in board.setups:
        lines += ["", header, *_setup(setup)]
    return "\n".join(lines) + "\n"


def _uncertain(board: Board) -> Iterator[tuple[str, Quantity, Kind]]:
    """Every quantity of a board that a card holds: its place, itself, and the kind of density that its key takes."""
    for one in board.parameters:
        if not one.is_of_effect and one.owner.kind != "group":  # sessions are found again when the card is read
            yield one.name, one.prior, "normal" if one.name == "poisson_xy" else "log-normal"
    for name, modulus in (("shear_xz", board.shear_xz), ("shear_yz", board.shear_yz)):
        if modulus is not None:
            yield name, modulus, "log-normal"
    for setup in board.setups:
        yield f"{setup.name} noise", setup.noise, "log-normal"
        for reading in setup.readings:
            yield f"{setup.name} {reading.label}", reading.frequency, "log-normal"
        for i, peak in enumerate(setup.peaks, start=1):
            yield f"{setup.name} peak {i}", peak.frequency, "log-normal"
        for i, item in enumerate(setup.attached, start=1):
            for stated in (item.mass, item.coil, item.suspension, item.resonance):
                if stated is not None:
                    yield f"{setup.name} attached {i}", stated, "log-normal"
        if setup.fluid is not None and setup.fluid.density is not None:
            yield f"{setup.name} fluid", setup.fluid.density, "log-normal"
        if setup.bounce is not None:
            yield f"{setup.name} bounce", setup.bounce, "log-normal"


def _setup(setup: Setup) -> Iterator[str]:
    """The lines of a setup: its own keys, then its tables."""
    yield f"name = {text(setup.name)}"
    yield f"edges = {table({edge: text(word) for edge, word in setup.edges.items()})}"
    if setup.clamped:
        yield f"clamped_mm = {table({edge: quantity(length, _MILLI) for edge, length in setup.clamped.items()})}"
    yield f"first_label = [{setup.first_label.m}, {setup.first_label.n}]"
    if setup.resolution:
        yield f"resolution_hz = {number(setup.resolution)}"
    if setup.published_coefficients is not None:
        yield f"published_coefficients = {text(setup.published_coefficients.name)}"
    yield from _peaks(setup.peaks)
    yield from _probabilities(setup)
    if not setup.is_noise_assumed:
        noise = density_numbers(setup.noise, _PERCENT, lambda m, f: Quantity.from_median(m, f).scaled(_PERCENT))
        yield f"noise_percent = {table(dict(zip(('median', 'factor'), noise, strict=True)))}"
    if setup.hammer is not None:
        yield f"hammer = {table({'at_mm': _place(setup.hammer)})}"
    if setup.fluid is not None:
        fluid = {} if setup.fluid.density is None else {"density_kg_m3": quantity(setup.fluid.density, 1.0)}
        fluid |= {} if setup.fluid.baffle is None else {"baffle": text(setup.fluid.baffle)}
        yield f"fluid = {table(fluid)}"
    if setup.bounce is not None:
        yield f"support = {table({'bounce_hz': quantity(setup.bounce, 1.0)})}"
    if setup.attached:
        yield f"attached = {array(_item(item) for item in setup.attached)}"
    yield f"frequencies_hz = {_by_label(setup)}"
    signs = {f'"{reading.label}"': text(reading.sign) for reading in setup.readings if reading.sign}
    if signs:
        yield f"signs = {table(signs)}"


def _peaks(peaks: Sequence[Peak]) -> Iterator[str]:
    """Peaks without a label, in their order: a list as far as nothing but their frequencies is known, then tables."""
    listed = tuple(takewhile(lambda peak: peak.is_bare, peaks))
    if listed:
        yield f"unlabelled_hz = {array(quantity(peak.frequency, 1.0) for peak in listed)}"
    if len(listed) < len(peaks):
        yield f"peaks = {array(_peak(peak) for peak in peaks[len(listed) :])}"


def _peak(peak: Peak) -> str:
    entries = {"hz": quantity(peak.frequency, 1.0)} | ({"sign": text(peak.sign)} if peak.sign else {})
    entries |= {} if peak.amplitude is None else {"amplitude": number(peak.amplitude)}
    return table(entries | ({} if peak.damping is None else {"damping_percent": number(peak.damping, _PERCENT)}))


def _probabilities(setup: Setup) -> Iterator[str]:
    """What is believed of labels and peaks, where it is not what a card without these keys says."""
    doubted = {f'"{one.label}"': number(one.confidence) for one in setup.readings if one.confidence != 1}
    if doubted:
        alike = len(doubted) == len(setup.readings) and len({*doubted.values()}) == 1
        yield f"label_confidence = {next(iter(doubted.values())) if alike else table(doubted)}"
    if setup.missed != MISSED:
        yield f"missed_probability = {number(setup.missed)}"
    if setup.spurious != SPURIOUS:
        yield f"spurious_probability = {number(setup.spurious)}"


def _by_label(setup: Setup) -> str:
    """The frequencies, a label that stands twice included: it is for the reader of the card to refuse."""
    entries = [f'"{reading.label}" = {quantity(reading.frequency, 1.0)}' for reading in setup.readings]
    return "{ " + ", ".join(entries) + " }" if entries else "{}"


def _item(item: AttachedItem) -> str:
    places = [_place(place) for place in item.places]
    entries = {"kind": text(item.kind)}
    entries |= {"at_mm": places[0] if len(places) == 1 else array(places)} if places else {}
    stated = (
        ("mass_g", item.mass, _MILLI),
        ("coil_mass_g", item.coil, _MILLI),
        ("suspension_n_per_m", item.suspension, 1.0),
        ("resonance_hz", item.resonance, 1.0),
    )
    entries |= {key: quantity(one, scale) for key, one, scale in stated if one is not None}
    return table(entries | ({} if item.magnet == "free" else {"magnet": text(item.magnet)}))


def _place(place: Sequence[float]) -> str:
    return array(number(value, _MILLI) for value in place)
