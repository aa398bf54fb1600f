"""Every effect that the generator plants, declared on a card with what is true of it: the generator's frequencies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from generator.boards import PlantedBoard, plant
from generator.card import told
from generator.designs import DESIGNS, Design
from generator.naming import Label, frequencies
from generator.plate import FINE_SHEAR, Plate
from generator.recipes import LIBRARY, RECIPES

from bayesplate.board.board import Board
from bayesplate.commands.prepare import prepare
from bayesplate.effects import EFFECTS
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.system import system_of

Parameters = Mapping[str, Any]
SIZE = 2.0
"""Multiple of the design's nominal size: an error grows with the effect, or is there without."""
LIGHT = 0.001
"""Share of the board that roves at nominal size: the mean over its places is right to first order, see AttachedMass."""
SENSOR = 0.01
"""Share of the board of a sensor that turns; of a larger one the base is no point, as it is in the generator."""
CLAMPS = ("cantilever-9", "clamped-9", "cantilever-6-free-6")
ALL = ("free-12", *CLAMPS)
FREE_SIDES = ("cantilever-9", "free-12", "cantilever-6-free-6")


def _number(value: float) -> str:
    return repr(float(value))


def _numbers(*values: float) -> str:
    return "[" + ", ".join(_number(value) for value in values) + "]"


def _nothing(*_: Any) -> dict[str, Any]:
    return {}


def _same(*keys: str) -> Callable[[Parameters, Plate], dict[str, float]]:
    """Parameters that the package has under the same names."""
    return lambda parameters, plate: {key: parameters[key] for key in keys}


@dataclass(frozen=True)
class Declared:
    """An effect as it is planted and as it is declared.

    Attributes
    ----------
    effect : str
    designs : tuple of str
        Where it acts.
    on_card : callable
        Parameters and the board -> what the card says of it, as TOML by key.
    values : callable
        Parameters and the ideal plate -> parameters for which a card has no key, by the package's names.
    fixed : callable
        Design and size -> parameters that are not drawn.
    n_places : int
    n : tuple of (int, int)
        Polynomials of the generator, its own number if empty; a point mass errs as their inverse square, which two
        numbers of them take away.
    """

    effect: str
    designs: tuple[str, ...]
    on_card: Callable[[Parameters, PlantedBoard], dict[str, str]] = _nothing
    values: Callable[[Parameters, Plate], dict[str, float]] = _nothing
    fixed: Callable[[Design, float], Parameters] = _nothing
    n_places: int = 1
    n: tuple[tuple[int, int], ...] = ()


def _grid(parameters: Parameters, board: PlantedBoard) -> dict[str, str]:
    """Thickness read at nine places by seven, mm: so many that they leave nothing open of a smooth board."""
    L_x, L_y, h = (1e3 * length for length in (board.design.L_x, board.design.L_y, board.design.h))
    s, t = (at.ravel() for at in np.meshgrid(np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 7)))
    read = h * (1.0 + parameters["taper_x"] * (s - 0.5) + parameters["taper_y"] * (t - 0.5))
    places = f"at_x_mm = {_numbers(*(s * L_x))}, at_y_mm = {_numbers(*(t * L_y))}"
    return {"thickness_mm": f"{{ readings = {_numbers(*read)}, {places} }}"}


def _widths(parameters: Parameters, board: PlantedBoard) -> dict[str, str]:
    """Width read at eleven stations, mm."""
    at = np.linspace(0.0, 1e3 * board.design.L_x, 11)
    read = np.interp(at, *(1e3 * np.array(parameters[name]) for name in ("stations", "widths")))
    return {"length_y_mm": f"{{ readings = {_numbers(*read)}, at_x_mm = {_numbers(*at)} }}"}


def _item(kind: str) -> Callable[[Parameters, PlantedBoard], dict[str, str]]:
    return lambda p, board: {"kind": f'"{kind}"', "mass_g": _number(1e3 * p["mass"])}


def _compact(design: Design, size: float) -> Parameters:
    """Radius of gyration of a cylinder of 5000 kg/m3, as high as wide, about a diameter of its base."""
    mass = SENSOR * size * design.mass
    diameter = (4.0 * mass / (np.pi * 5000.0)) ** (1.0 / 3.0)
    return {"mass": mass, "rotary_radius": diameter * (1.0 / 16.0 + 1.0 / 3.0) ** 0.5}


def _told(effect: str) -> Callable[[Parameters, PlantedBoard], dict[str, str]]:
    return lambda p, board: told({effect: p})


def _air(baffle: str) -> Callable[[Parameters, PlantedBoard], dict[str, str]]:
    return lambda p, board: {"air": f'{{ density_kg_m3 = {_number(p["density"])}, baffle = "{baffle}" }}'}


def _shear(parameters: Parameters, board: PlantedBoard) -> dict[str, str]:
    keys = {"shear_xz_gpa": "G_xz", "shear_yz_gpa": "G_yz"}
    return {key: _number(parameters[name] / 1e9) for key, name in keys.items()}


CASES: dict[str, Declared] = {
    "transverse_shear": Declared("transverse_shear", ALL, _shear, n=(FINE_SHEAR,)),
    "known mass": Declared("attached_mass", ALL, _item("shaker"), n=((18, 18), (24, 24))),
    "mass that turns": Declared(
        "attached_mass", ALL, _item("accelerometer"), n=((18, 18), (24, 24)), fixed=_compact
    ),
    "roving mass": Declared(
        "attached_mass", ALL, _item("shaker"), n_places=4,
        fixed=lambda design, size: {"mass": LIGHT * size * design.mass},
    ),
    "clamp_rotation": Declared(
        "clamp_rotation", CLAMPS,
        values=lambda p, plate: {"compliance": plate.D_x / (p["stiffness"] * plate.L_x)},
    ),
    "clamp_translation": Declared(
        "clamp_translation", CLAMPS,
        values=lambda p, plate: {"compliance": plate.D_x / (p["stiffness"] * plate.L_x**3)},
    ),
    "membrane_tension": Declared(
        "membrane_tension", ("clamped-9",), values=lambda p, plate: {"N": p["N_x"]},
        fixed=lambda design, size: dict.fromkeys(("N_x", "N_y"), size * design.nominal["membrane_tension"]),
    ),
    "support_mass": Declared("support_mass", ("clamped-9",), values=_same("mass")),
    "support_stiffness": Declared(
        "support_stiffness", ("free-12", "cantilever-6-free-6"), values=_same("stiffness")
    ),
    "air without a baffle": Declared(
        "fluid_loading", ALL, _air("none"), fixed=lambda design, size: {"baffle": 0.0}
    ),
    "air with a full baffle": Declared(
        "fluid_loading", ALL, _air("full"), fixed=lambda design, size: {"baffle": 1.0}
    ),
    "read thickness": Declared(
        "thickness_profile", ALL, _grid, fixed=lambda design, size: {"taper_y": 0.02}
    ),
    "free taper": Declared("thickness_profile", ALL, values=_same("taper_x", "taper_y")),
    "outline_profile": Declared(
        "outline_profile", FREE_SIDES, _widths,
        fixed=lambda design, size: {
            "stations": (0.0, design.L_x), "widths": (design.L_y, design.L_y * (1.0 - size * design.nominal["outline"]))
        },
    ),
    "density_gradient": Declared("density_gradient", ALL, values=_same("gradient")),
    "stiffness_gradient": Declared("stiffness_gradient", ALL, values=_same("gradient")),
    "warp": Declared("warp", ALL, _told("warp")),
    "exciter": Declared("exciter", ALL, _told("exciter"), n=((18, 18), (24, 24))),
    "exciter whose magnet is held": Declared(
        "exciter", ALL, _told("exciter"), n=((18, 18), (24, 24)),
        fixed=lambda design, size: {"magnet": "held"},
    ),
    "grain_angle": Declared("grain_angle", ALL, values=_same("angle")),
    "poisson_ratio": Declared("poisson_ratio", ALL, values=_same("nu_xy")),
}  # fmt: skip


def planted(case: Declared, design: str) -> PlantedBoard:
    """A board whose labels are beyond doubt, without noise."""
    fixed = {case.effect: case.fixed(DESIGNS[design], SIZE)}
    rng = np.random.default_rng(3)
    return plant(rng, design, [case.effect], SIZE, 0.0, scale_known=True, n_places=case.n_places, fixed=fixed)


def expected(case: Declared, board: PlantedBoard) -> dict[str, dict[Label, float]]:
    """The generator's frequencies by setup and label, without end where its polynomials are slow."""
    if not case.n:
        return board.exact
    found: dict[str, dict[Label, float]] = {}
    effect = RECIPES[case.effect].make(dict(board.truth.effects[case.effect]))
    for setup in board.design.setups:
        plate = board.design.plate(setup, board.truth.constants)
        solved = [frequencies(plate, [effect], setup.beams, n)[0] for n in case.n]
        low, high = solved[0], solved[-1]
        step = (case.n[-1][0] / case.n[0][0]) ** 2 - 1.0 or 1.0  # with one number of polynomials low and high are equal
        found[setup.name] = {setup.label(b): high[b] + (high[b] - low[b]) / step for b in setup.beams}
    return found


def values_of(board: Board, case: Declared, parameters: Parameters, ideal: PlantedBoard) -> list[dict[str, np.ndarray]]:
    """Everything a model takes, setup after setup: what the card says, the true rigidities, and what has no key."""
    found = []
    for setup, drawn in zip(board.setups, ideal.design.setups, strict=True):
        nu_xy = {"nu_xy": parameters["nu_xy"]} if "poisson_ratio" in board.effects else {}
        plate = ideal.design.plate(drawn, {**ideal.truth.constants, **nu_xy})
        values = board.nominal() | {"D_x": plate.D_x, "D_y": plate.D_y, "D_s": plate.G_xy * plate.h**3 / 3.0}
        if case.effect in board.effects and not EFFECTS[case.effect].refusal(board, setup):
            effect = EFFECTS[case.effect].of(board, setup)
            acts = float(RECIPES[case.effect].acts(drawn))  # what lies under the free board does not under the clamped
            named = {parameter.key: parameter.name for parameter in effect.parameters()}
            values |= {named[key]: acts * value for key, value in case.values(parameters, plate).items()}
        found.append({name: np.asarray(value) for name, value in values.items()})
    return found


def cents_apart(
    case: Declared, ideal: PlantedBoard, parameters: Parameters, folder: Path, effects: tuple[str, ...] | None = None
) -> np.ndarray:
    """The package's frequencies of a card against the generator's, every mode of every setup."""
    stated = {"effects": f'["{case.effect}"]', **case.on_card(parameters, ideal)}
    card = folder / "planted.toml"
    card.write_text(ideal.card_text(stated), encoding="utf-8")
    board = prepare(card, effects).board
    truth = expected(case, ideal)
    apart = []
    for setup, values in zip(board.setups, values_of(board, case, parameters, ideal), strict=True):
        log_hertz = setup_model(system_of(board, setup), values).log_frequencies(values, "linear")[0]
        exact = [truth[setup.name][label.m, label.n] for label in setup.labels]
        apart.append(1200.0 * (log_hertz / np.log(2.0) - np.log2(exact)))
    return np.concatenate(apart)


FIRST = [(name, case.designs[0]) for name, case in CASES.items()]
OTHERS = [(name, design) for name, case in CASES.items() for design in case.designs[1:]]


@pytest.mark.parametrize(("name", "design"), [*FIRST, *(pytest.param(*one, marks=pytest.mark.slow) for one in OTHERS)])
def test_the_generators_frequencies_within_a_cent(name, design, tmp_path):
    """The card without the effect is the control, on the first design: it misses by more than a cent."""
    case = CASES[name]
    board = planted(case, design)
    parameters = board.truth.effects[case.effect]
    assert cents_apart(case, board, parameters, tmp_path) == pytest.approx(0.0, abs=1.0)
    if (name, design) in FIRST:
        none = cents_apart(case, board, parameters, tmp_path, effects=())
        assert np.abs(none).max() > 1.0


def test_every_effect_of_the_generator_is_declared():
    assert {case.effect for case in CASES.values()} == set(LIBRARY) == set(EFFECTS)
