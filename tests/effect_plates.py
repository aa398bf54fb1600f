"""Plates with effects, solved by the package and by the generator's own polynomials, for the tests of effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import made_boards
import numpy as np
from generator.effects import NoEffect
from generator.effects import TransverseShear as GeneratorShear
from generator.plate import EDGES, Plate
from generator.plate import solve as solve_generator

from bayesplate.board.attached import AttachedItem, DeclaredFluid
from bayesplate.board.board import Board
from bayesplate.board.parameter import Owner, parameter_name
from bayesplate.board.quantity import Quantity
from bayesplate.board.random_field import Surface
from bayesplate.board.reading import Reading
from bayesplate.board.setup import Setup
from bayesplate.commands.prepare import prepare
from bayesplate.effects import EFFECTS, Effect, declare
from bayesplate.effects.field_components import FieldProfile
from bayesplate.effects.transverse_shear import TransverseShear
from bayesplate.frequencies.system import System
from bayesplate.plate.membrane import Curvature
from bayesplate.plate.naming import find_named_modes
from bayesplate.plate.solve import Modes, solve
from bayesplate.posterior.posing import PosedProblem, pose

SETUP = "made"
MADE = Owner("setup", SETUP)
ALL_SUPPORTED = dict.fromkeys(EDGES, "supported")
G_XZ, G_YZ = 0.62e9, 0.03e9
SHEAR = {"transverse_shear.G_xz": G_XZ, "transverse_shear.G_yz": G_YZ}

Parameters = Mapping[str, float]
Beams = tuple[int, int]


def setup_of(plate: Plate) -> Setup:
    """A setup with the edges of a plate."""
    return made_boards.setup_of(plate.edges, {(2, 2): 1.0}, name=SETUP)


def board_with(
    plate: Plate,
    attached: Sequence[AttachedItem] = (),
    *,
    effects: Sequence[str] = (),
    warp: Mapping[Curvature, Quantity] | None = None,
    fluid: DeclaredFluid | None = None,
    bounce: Quantity | None = None,
    **inputs: Quantity,
) -> Board:
    """A board of a plate in one setup, with what a card states of it."""
    setup = replace(setup_of(plate), attached=tuple(attached), fluid=fluid, bounce=bounce)
    return replace(made_boards.board_of(plate, [setup], **inputs), effects=tuple(effects), warp=dict(warp or {}))


def tapered(taper_x: float, taper_y: float) -> FieldProfile:
    """A profile that readings leave no doubt of: tapers along x and along y."""
    surface = Surface(((1, 0), (0, 1)), tuple(taper / np.sqrt(12.0) for taper in (taper_x, taper_y)))
    return FieldProfile(surface, None, (), 1.0, 0.0)


def values_of(plate: Plate, parameters: Parameters) -> dict[str, np.ndarray]:
    """Constants and sizes of a plate, and parameters of effects; those of a setup without its name."""
    own = {"length_x": plate.L_x, "length_y": plate.L_y, "thickness": plate.h, "density": plate.rho}
    own |= {"D_x": plate.D_x, "D_y": plate.D_y, "D_s": plate.G_xy * plate.h**3 / 3.0, "poisson_xy": plate.nu_xy}
    of_effects = {parameter_name(n, MADE) if _is_of_setup(n) else n: v for n, v in parameters.items()}
    return {name: np.asarray(value) for name, value in (own | of_effects).items()}


def _is_of_setup(name: str) -> bool:
    """Whether a value is a parameter of an effect that belongs to a setup."""
    effect, dot, _ = name.partition(".")
    return bool(dot) and EFFECTS[effect].scope == "setup"


def modes_of(plate: Plate, effects: Sequence[Effect], parameters: Parameters, n_modes: int) -> Modes:
    """Lowest modes by the package."""
    system, values = System(setup_of(plate), tuple(effects)), values_of(plate, parameters)
    return solve(system.plate(values), system.weights(values).at(0), n_modes)


def hertz(plate: Plate, effects: Sequence[Effect], parameters: Parameters, n_modes: int) -> np.ndarray:
    """Lowest frequencies by the package."""
    return np.sqrt(modes_of(plate, effects, parameters, n_modes).eigenvalues) / (2.0 * np.pi)


def hertz_apart(
    plate: Plate,
    effects: Sequence[Effect],
    parameters: Parameters,
    generator: Sequence[NoEffect],
    n_modes: int,
    is_sheared: bool = False,
    n: Sequence[int] = (),
) -> np.ndarray:
    """The package's frequencies against the generator's, cents.

    n: polynomials of the generator along each side; with two numbers the error of a point mass, which goes with the
    inverse square of their number, is taken away.
    """
    if is_sheared:
        effects, parameters = (*effects, TransverseShear()), {**parameters, **SHEAR}
        generator = (*generator, GeneratorShear(G_XZ, G_YZ))
    n_rigid = 3 if set(plate.edges.values()) == {"free"} else 0
    solved = [
        solve_generator(plate, generator, n_modes + n_rigid, one).frequencies[n_rigid:]
        for one in [(each, each) for each in n] or [None]
    ]
    independent = solved[-1]
    if len(n) == 2:
        independent = independent + (solved[1] - solved[0]) / ((n[1] / n[0]) ** 2 - 1)
    return 1200.0 * np.log2(hertz(plate, effects, parameters, n_modes) / independent)


def shifts(plate: Plate, effects: Sequence[Effect], parameters: Parameters, beams: Sequence[Beams]) -> np.ndarray:
    """Shift of named modes by effects, cents."""
    squared = []
    for present in ((), tuple(effects)):
        system, values = System(setup_of(plate), present), values_of(plate, parameters)
        found = find_named_modes(system.plate(values), system.weights(values).at(0), beams)
        squared.append(np.array([found[b].eigenvalue for b in beams]))
    return 600.0 * np.log2(squared[1] / squared[0])


def _taken_for_sure(setup: Setup) -> tuple[Reading, ...]:
    return tuple(replace(reading, confidence=1.0) for reading in setup.readings)


def posed(
    card: str, effects: Sequence[str], attached: AttachedItem | None = None, *, with_peaks: bool = False
) -> PosedProblem:
    """A shipped board with declared effects, ready to be sampled; its labels taken for sure, or with all its peaks."""
    prepared = prepare(card)
    setups = prepared.board.setups
    if not with_peaks:
        setups = tuple(replace(setup, peaks=(), readings=_taken_for_sure(setup)) for setup in setups)
    if attached is not None:
        setups = tuple(replace(setup, attached=(attached,)) for setup in setups)
    board = declare(replace(prepared.board, effects=tuple(effects), setups=setups))
    return pose(board, prepared.prior)
