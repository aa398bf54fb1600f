"""The paper's training: frequencies of twenty-five computed plates, tracked by their shapes, fitted by planes in p, q.

It is kept beside the energy shares of one solve, which give the same coefficients, for comparison with the paper. Two
things differ: the planes are held non-negative, which the paper asks for and no law of mechanics does, and a plane
through plates 20 % apart is a chord where the energy shares are a tangent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.material import rigidities
from bayesplate.board.setup import EdgeConditions
from bayesplate.errors import NotIdentifiableError
from bayesplate.plate.beams import Beams
from bayesplate.plate.naming import find_named_modes
from bayesplate.plate.plate import Plate
from bayesplate.plate.shear import SHEAR_CORRECTION, SHEAR_ELEMENTS_PER_SIDE, shear_flexible_plate
from bayesplate.plate.solve import Modes, solve
from bayesplate.plate.terms import Theory, Weights
from bayesplate.plate.thin import thin_plate

MODULUS_FACTORS = (0.8, 0.9, 1.0, 1.1, 1.2)
"""Factors on E_x and on E_y, in all combinations."""

REFERENCE_FACTORS = (0.8, 0.8)
"""The plate whose shapes name the modes: the paper's batch p = 4.36, q = 0.29."""

LOWEST_MAC = 0.9
"""A mode that resembles its reference no better than this is left out of the fit."""

_SPARE_MODES = 4
_GRID = 24


@dataclass(frozen=True)
class TrainingConstants:
    """Material of the plate in the middle of the training set, Pa; the thin plate reads no G_xz and G_yz."""

    E_x: float
    E_y: float
    G_xy: float
    nu_xy: float
    G_xz: float | None = None
    G_yz: float | None = None


@dataclass(frozen=True, eq=False)
class TrainingPlate:
    factors: tuple[float, float]  # of E_x and E_y
    p: float  # D_x / D_s
    q: float  # D_y / D_s
    squared: Floats  # (n_modes,): non-dimensional omega_bar^2, increasing
    mac: Floats  # (n_reference, n_modes): modal assurance criterion between reference modes and its own
    matches: Mapping[Beams, int]  # which of its modes each reference mode is, where it can be recognised


@dataclass(frozen=True)
class TrainedMode:
    """Plane omega_bar^2 = a p + b q + c, none negative, through the plates in which the mode was recognised."""

    a: float
    b: float
    c: float
    r_squared: float  # coefficient of determination
    n_plates: int


@dataclass(frozen=True, eq=False)
class Training:
    """Result of a training: the fit of each mode by its beam functions, and the plates it rests on."""

    modes: Mapping[Beams, TrainedMode]
    plates: tuple[TrainingPlate, ...]


def train(
    ends_x: EdgeConditions,
    ends_y: EdgeConditions,
    aspect_ratio: float,
    thickness_ratio: float,
    constants: TrainingConstants,
    theory: Theory,
    beams: Sequence[Beams],
) -> Training:
    """Train the linear frequency model as the paper does, for modes by their orders of beam functions.

    Ducceschi et al., section 3.1, tables 1 and 2 and figure 2. They do not say when a shape counts as recognised: here
    when its MAC exceeds `LOWEST_MAC` and is the largest of its row and of its column. KeyError if a mode is none of the
    reference plate's, NotIdentifiableError if it is recognised in fewer than three plates.
    """
    plate = training_matrices(ends_x, ends_y, theory)
    weights = {
        (f, g): training_weights(aspect_ratio, thickness_ratio, constants, theory, (f, g))
        for f in MODULUS_FACTORS
        for g in MODULUS_FACTORS
    }
    modes = find_named_modes(plate, weights[REFERENCE_FACTORS], beams)
    n_modes = _count_modes(plate, weights[REFERENCE_FACTORS], max(mode.eigenvalue for mode in modes.values()))
    solved = {factors: solve(plate, plate_weights, n_modes) for factors, plate_weights in weights.items()}
    places = list(zip(solved[REFERENCE_FACTORS].parities, solved[REFERENCE_FACTORS].ranks, strict=True))
    rows = [places.index((mode.place.parity, mode.place.rank)) for mode in modes.values()]
    reference = _sample_shapes(solved[REFERENCE_FACTORS])[rows]
    plates = tuple(
        _track_modes(factors, weights[factors], aspect_ratio, modes, reference, beams)
        for factors, modes in solved.items()
    )
    return Training({name: _fit_plane(name, plates) for name in beams}, plates)


def training_weights(
    aspect_ratio: float,
    thickness_ratio: float,
    constants: TrainingConstants,
    theory: Theory,
    factors: tuple[float, float] = (1.0, 1.0),
) -> Weights:
    """Weights whose eigenvalues are omega_bar^2 = omega^2 rho h A^2 / D_s, for E_x and E_y times the given factors.

    Ducceschi et al., eq. (7) to (11); the ratios are L_x / L_y and h / L_x.
    """
    E_x, E_y = constants.E_x * factors[0], constants.E_y * factors[1]
    D_x, D_y, D_s = (float(D) for D in rigidities(E_x, E_y, constants.G_xy, 1.0, constants.nu_xy))
    p, q = D_x / D_s, D_y / D_s
    thin = [p / aspect_ratio**2, q * aspect_ratio**2, constants.nu_xy * q, 1.0]
    if theory == "thin":
        return Weights(np.array(thin), np.ones(1))
    if constants.G_xz is None or constants.G_yz is None:
        raise ValueError("the shear-flexible plate needs G_xz and G_yz: give both, or train the thin plate")
    over_x, over_y = thickness_ratio, thickness_ratio * aspect_ratio
    # S_x L_y^2 / D_s and S_y L_x^2 / D_s with S = kappa h G and D_s = G_xy h^3 / 3.
    shear_x = 3.0 * SHEAR_CORRECTION * constants.G_xz / constants.G_xy / over_y**2
    shear_y = 3.0 * SHEAR_CORRECTION * constants.G_yz / constants.G_xy / over_x**2
    return Weights(np.array([*thin, shear_x, shear_y]), np.array([1.0, over_x**2 / 12.0, over_y**2 / 12.0]))


def training_matrices(ends_x: EdgeConditions, ends_y: EdgeConditions, theory: Theory) -> Plate:
    assemble = thin_plate if theory == "thin" else shear_flexible_plate
    return assemble(ends_x, ends_y, SHEAR_ELEMENTS_PER_SIDE, SHEAR_ELEMENTS_PER_SIDE)


def _count_modes(plate: Plate, weights: Weights, highest: float) -> int:
    """How many modes reach the highest wanted mode of the reference plate, and a few more for crossings."""
    n_modes = 2 * _SPARE_MODES
    while solve(plate, weights, n_modes).eigenvalues[-1 - _SPARE_MODES] < highest * (1.0 - 1e-9):
        n_modes += 1
    return n_modes


def _sample_shapes(modes: Modes) -> Floats:
    """Shapes on a grid of cell centres, where sums stand for integrals: (n_modes, n_points) array of unit norm."""
    points = (np.arange(_GRID) + 0.5) / _GRID
    shapes = modes.displacement(points, points).reshape(len(modes.eigenvalues), -1)
    return np.asarray(shapes / np.linalg.norm(shapes, axis=1, keepdims=True))


def _track_modes(
    factors: tuple[float, float],
    weights: Weights,
    aspect_ratio: float,
    modes: Modes,
    reference: Floats,
    beams: Sequence[Beams],
) -> TrainingPlate:
    mac = (reference @ _sample_shapes(modes).T) ** 2
    matches = {}
    for row, name in enumerate(beams):
        column = int(mac[row].argmax())
        if mac[row, column] > LOWEST_MAC and mac[:, column].argmax() == row:
            matches[name] = column
    p, q = weights.stiffness[0] * aspect_ratio**2, weights.stiffness[1] / aspect_ratio**2
    return TrainingPlate(factors, float(p), float(q), modes.eigenvalues, mac, matches)


def _fit_plane(name: Beams, plates: Sequence[TrainingPlate]) -> TrainedMode:
    from scipy.optimize import nnls

    recognised = [plate for plate in plates if name in plate.matches]
    if len(recognised) < 3:
        raise NotIdentifiableError(
            f"beam functions {name}: recognised in {len(recognised)} of {len(plates)} training plates, a plane needs "
            "three; take the coefficients from the energy shares of one solve"
        )
    planes = np.array([[plate.p, plate.q, 1.0] for plate in recognised])
    squared = np.array([plate.squared[plate.matches[name]] for plate in recognised])
    (a, b, c), distance = nnls(planes, squared)
    r_squared = 1.0 - distance**2 / np.sum((squared - squared.mean()) ** 2)
    return TrainedMode(float(a), float(b), float(c), float(r_squared), len(recognised))
