"""Names of modes: which product of beam functions each mode resembles, by optimal assignment within its class."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.plate import Beams, Parity, PlateMatrices, Weights
from bayesplate.modes.solve import ClassModes, Modes, solve_classes

CERTAIN = 0.75
"""Correlation with its product of beam functions below which a mode's name is "cannot tell"."""

_STRAY = 0.3
"""Correlation below which a name was given to a mode that was merely left over: its own lies higher."""

_SPARE = 3
_MOST_MODES = 40
_AHEAD = 12
"""Modes beyond those that are asked for, where some turned out to be too few: to be solved for once more at most."""


@dataclass(frozen=True)
class Place:
    """Where a named mode stands: its class, its rank there, and how well the name fits.

    Attributes
    ----------
    parity : Parity
    rank : int
        Position among the elastic modes of the class, from 0.
    correlation : float
        Between the mode's shape and the product of beam functions, 0 to 1.
    """

    parity: Parity
    rank: int
    correlation: float

    @property
    def is_certain(self) -> bool:
        """Whether the shape supports the name."""
        return self.correlation >= CERTAIN


@dataclass(frozen=True, eq=False)
class Found:
    """A named mode: its place, its eigenvalue (s^-2), and its energy in each stiffness and mass term."""

    place: Place
    eigenvalue: float
    stiffness: NDArray[np.float64]
    mass: NDArray[np.float64]


def name_shapes(
    plate: PlateMatrices, shapes: NDArray[np.float64], parity: Parity, on_plate: NDArray[np.float64]
) -> list[tuple[Beams, float]]:
    """Beam product and correlation of each mode of a class, each product given to one mode only.

    Parameters
    ----------
    plate : PlateMatrices
    shapes : (n_modes, n_dof_x, n_dof_y) array
        Deflections of the lowest modes of the class, of any size.
    parity : Parity
    on_plate : (n_modes,) array
        Share of the kinetic energy of each that is the plate's, with all that it carries along.

    Returns
    -------
    list of (tuple of int, float)
        In the order of the modes.
    """
    parts = beam_parts(plate, shapes, parity)
    squares = np.einsum("nij,nij->n", shapes, plate.line_x.mass @ shapes @ plate.line_y.mass)
    products, named = list(parts), name_parts(fits(np.stack(list(parts.values()), axis=1), squares, on_plate))
    return [(products[column], correlation) for column, correlation in named]


def beam_parts(plate: PlateMatrices, shapes: NDArray[np.float64], parity: Parity) -> dict[Beams, NDArray[np.float64]]:
    """What deflections of a class have of each product of beam functions: (n_shapes,) arrays, of its elastic products.

    Parameters
    ----------
    plate : PlateMatrices
    shapes : (n_shapes, n_dof_x, n_dof_y) array
    parity : Parity
    """
    beams_x = plate.line_x.beams.T @ plate.line_x.mass
    beams_y = plate.line_y.beams.T @ plate.line_y.mass
    correlations = beams_x @ shapes @ beams_y.T
    return {(i, j): correlations[:, i, j] for i, j in plate.elastic_products[parity]}


def fits(
    parts: NDArray[np.float64], squares: NDArray[np.float64], on_plate: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How well each shape fits each product: its correlation by the root of the plate's share of the motion.

    A shape is measured by itself, for the water that a plate carries along may weigh ten times what it weighs, and
    changes no shape by it. A magnet that bounces on its spring bends the plate a little, in a shape like that of the
    lowest mode: by the share it takes no name.

    Parameters
    ----------
    parts : (n_modes, n_products) array
    squares : (n_modes,) array
        Mean square of the deflection.
    on_plate : (n_modes,) array
    """
    return np.asarray(parts * np.sqrt(np.maximum(on_plate, 0.0) / squares)[:, None])


def name_parts(parts: NDArray[np.float64]) -> list[tuple[int, float]]:
    """Product and correlation of each mode, each product given to one mode only.

    Parameters
    ----------
    parts : (n_modes, n_products) array
        What each mode has of each product, 1 being the whole of it.

    Returns
    -------
    list of (int, float)
        Which product, and the size of its part.
    """
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(parts**2, maximize=True)
    return [(int(c), float(np.abs(parts[r, c]))) for r, c in zip(rows, columns, strict=True)]


def name_modes(modes: Modes) -> list[tuple[Beams, float]]:
    """Beam product and correlation of each of the lowest modes of a plate, in their order."""
    names: dict[int, tuple[Beams, float]] = {}
    for parity in set(modes.parities):
        members = [i for i, p in enumerate(modes.parities) if p == parity]
        on_plate = modes.classes[parity].on_plate[modes.ranks[members]]
        names |= zip(members, name_shapes(modes.plate, modes.shapes[members], parity, on_plate), strict=True)
    return [names[i] for i in range(len(names))]


def product_coefficients(plate: PlateMatrices) -> NDArray[np.float64]:
    """Rayleigh quotients of all products of beam functions: (4, n_beams_x, n_beams_y) array.

    Rough, but they need no stiffness to be known: the start of every estimate.
    """
    bending_x, slope_x, mixed_x = plate.line_x.beam_energies
    bending_y, slope_y, mixed_y = plate.line_y.beam_energies
    return np.stack(
        [
            np.add.outer(bending_x, np.zeros_like(bending_y)),
            np.add.outer(np.zeros_like(bending_x), bending_y),
            2.0 * np.outer(mixed_x, mixed_y),
            np.outer(slope_x, slope_y),
        ]
    )


def find(plate: PlateMatrices, weights: Weights, wanted: Iterable[Beams]) -> dict[Beams, Found]:
    """Find each wanted name among the modes of a plate.

    Parameters
    ----------
    plate : PlateMatrices
    weights : Weights
        Of one draw.
    wanted : iterable of (int, int)
        Orders of the beam functions along x and y.

    Returns
    -------
    dict of Found
        For every wanted name; a name without a certain mode gets its best remaining one, with the low correlation.

    Raises
    ------
    KeyError
        If a name is no elastic mode of this plate or lies beyond the modes that can be resolved.
    """
    names = list(wanted)
    # With as many modes as products a class has given all its names, and with more some modes would have none.
    most = {parity: len(products) for parity, products in plate.elastic_products.items()}
    counts = {p: min(n + _SPARE, most[p]) for p, n in _expected_ranks(plate, weights, names).items()}
    solved: dict[Parity, ClassModes] = {}
    places: dict[Beams, Place] = {}
    while counts:
        short = {p: n for p, n in counts.items() if p not in solved or solved[p].eigenvalues.size < n}
        solved |= solve_classes(plate, weights, {p: min(n + _AHEAD * (p in solved), most[p]) for p, n in short.items()})
        places = {name: place for name, place in places.items() if place.parity not in counts}
        for parity, n in counts.items():
            places |= _places(plate, solved[parity].of(range(n)), names)
        lost = {plate.parity(n) for n in names if n not in places or places[n].correlation < _STRAY}
        unsure = {plate.parity(n) for n in names if n in places and not places[n].is_certain}
        counts = {
            p: min(n + 2 * _SPARE, most[p])
            for p, n in counts.items()
            if n < most[p] and (p in lost or (p in unsure and n < _MOST_MODES // len(plate.blocks)))
        }
    missing = [name for name in names if name not in places]
    if missing:
        raise KeyError(missing)
    found = _with_energies(solved, places)
    return {name: found[name] for name in names}


def _expected_ranks(plate: PlateMatrices, weights: Weights, names: list[Beams]) -> dict[Parity, int]:
    """How many products of each class lie at or below the highest wanted one, by their Rayleigh quotients."""
    values = np.tensordot(weights.stiffness[:4], product_coefficients(plate), axes=1)
    unknown = [name for name in names if name not in plate.elastic_products[plate.parity(name)]]
    if unknown:
        raise KeyError(unknown)
    highest: dict[Parity, float] = {}
    for name in names:
        parity = plate.parity(name)
        highest[parity] = max(highest.get(parity, 0.0), values[name])
    return {p: sum(bool(values[b] <= top) for b in plate.elastic_products[p]) for p, top in highest.items()}


def _places(plate: PlateMatrices, modes: ClassModes, names: Sequence[Beams]) -> dict[Beams, Place]:
    """Those of the wanted names that some of the lowest modes of a class have."""
    parity = modes.block.parity
    of_each = name_shapes(plate, modes.block.spread(modes.vectors), parity, modes.on_plate)
    return {name: Place(parity, rank, fit) for rank, (name, fit) in enumerate(of_each) if name in names}


def _with_energies(solved: Mapping[Parity, ClassModes], places: Mapping[Beams, Place]) -> dict[Beams, Found]:
    """The modes at some places."""
    found = {}
    for parity, modes in solved.items():
        own = {name: place for name, place in places.items() if place.parity == parity}
        energies = modes.of([place.rank for place in own.values()]).coefficients()
        for (name, place), stiffness, mass in zip(own.items(), *energies, strict=True):
            found[name] = Found(place, modes.eigenvalues[place.rank], stiffness, mass)
    return found
