"""Names of modes: which product of beam functions each mode resembles, by optimal assignment within its class."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.plate.beams import Beams, beam_functions, product_coefficients
from bayesplate.plate.classes import SymmetryClass
from bayesplate.plate.plate import Plate
from bayesplate.plate.solve import ClassModes, Modes, solve_classes
from bayesplate.plate.terms import Parity, Weights

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
    """The place of a named mode: its class, its rank there, and how well the name fits."""

    parity: Parity
    rank: int  # among the elastic modes of the class, from 0
    correlation: float  # between its shape and the product of beam functions, 0 to 1

    @property
    def is_certain(self) -> bool:
        return self.correlation >= CERTAIN


def reaching(places: Iterable[Place]) -> dict[Parity, int]:
    """How many of the lowest modes of each class hold all places."""
    found: dict[Parity, int] = {}
    for place in places:
        found[place.parity] = max(found.get(place.parity, 0), place.rank + 1)
    return found


@dataclass(frozen=True, eq=False)
class Found:
    """A named mode: its place, its eigenvalue (s^-2), and its energy in each stiffness and mass term."""

    place: Place
    eigenvalue: float
    stiffness: Floats
    mass: Floats


def name_shapes(own: SymmetryClass, vectors: Floats, on_plate: Floats) -> list[tuple[Beams, float]]:
    """Beam product and correlation of each mode of a class, its lowest ones, each product given to one mode only.

    `on_plate` is the share of the kinetic energy of each that is the plate's, with all that it carries along.
    """
    parts, squares = beam_parts(own, vectors)
    products, named = own.plate.elastic_products[own.parity], name_parts(fits(parts, np.diagonal(squares), on_plate))
    return [(products[column], correlation) for column, correlation in named]


def beam_parts(own: SymmetryClass, vectors: Floats) -> tuple[Floats, Floats]:
    """What deflections have of each of `elastic_products`, (n_vectors, n_products), and their mean products."""
    x, y = own.plate.x, own.plate.y
    deflections = own.strains(["w"], vectors)["w"].reshape(-1, x.points.size, y.points.size)
    along_x, along_y = (side.weights * beam_functions(side.ends).at(side.points).T for side in (x, y))
    parts = along_x @ deflections @ along_y.T
    orders = np.array(own.plate.elastic_products[own.parity]).T
    weighed = (np.outer(x.weights, y.weights) * deflections).reshape(len(deflections), -1)
    return parts[:, orders[0], orders[1]], weighed @ deflections.reshape(len(deflections), -1).T


def fits(parts: Floats, squares: Floats, on_plate: Floats) -> Floats:
    """How well each shape fits each product: its correlation by the root of the plate's share of the motion.

    `squares` are the mean squares of the deflections: a shape is measured by itself, for the water that a plate carries
    along may weigh ten times what it weighs, and changes no shape by it. A magnet that bounces on its spring bends the
    plate a little, in a shape like that of the lowest mode: by the share it takes no name.
    """
    return np.asarray(parts * np.sqrt(np.maximum(on_plate, 0.0) / squares)[:, None])


def name_parts(parts: Floats) -> list[tuple[int, float]]:
    """Product and correlation of each mode, from what it has of each (1: all); a product goes to one mode only."""
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(parts**2, maximize=True)
    return [(int(c), float(np.abs(parts[r, c]))) for r, c in zip(rows, columns, strict=True)]


def name_modes(modes: Modes) -> list[tuple[Beams, float]]:
    """Beam product and correlation of each of the lowest modes of a plate, in their order."""
    named = {
        parity: list(zip(modes.rows(parity), name_shapes(one.own, one.vectors, one.on_plate), strict=True))
        for parity, one in modes.by_class.items()
    }
    names = dict(pair for of_class in named.values() for pair in of_class)
    return [names[i] for i in range(len(names))]


def find(plate: Plate, weights: Weights, wanted: Iterable[Beams]) -> dict[Beams, Found]:
    """Each wanted name among the modes of a plate at the weights of one draw.

    A name without a certain mode gets its best remaining one, with the low correlation. KeyError if a name is no
    elastic mode of this plate or lies beyond the modes that can be resolved.
    """
    names = list(wanted)
    # With as many modes as products a class has given all its names, and with more some modes would have none.
    most = {c.parity: min(len(plate.elastic_products[c.parity]), c.n_dof - c.n_rigid - 1) for c in plate.classes}
    counts = {p: min(n + _SPARE, most[p]) for p, n in _expected_ranks(plate, weights, names).items()}
    solved: dict[Parity, ClassModes] = {}
    places: dict[Beams, Place] = {}
    while counts:
        short = {p: n for p, n in counts.items() if p not in solved or solved[p].eigenvalues.size < n}
        solved |= solve_classes(plate, weights, {p: min(n + _AHEAD * (p in solved), most[p]) for p, n in short.items()})
        places = {name: place for name, place in places.items() if place.parity not in counts}
        for parity, n in counts.items():
            places |= _places(solved[parity].of(range(n)), names)
        lost = {plate.parity(n) for n in names if n not in places or places[n].correlation < _STRAY}
        unsure = {plate.parity(n) for n in names if n in places and not places[n].is_certain}
        counts = {
            p: min(n + 2 * _SPARE, most[p])
            for p, n in counts.items()
            if n < most[p] and (p in lost or (p in unsure and n < _MOST_MODES // len(plate.classes)))
        }
    missing = [name for name in names if name not in places]
    if missing:
        raise KeyError(missing)
    found = _with_energies(solved, places)
    return {name: found[name] for name in names}


def _expected_ranks(plate: Plate, weights: Weights, names: list[Beams]) -> dict[Parity, int]:
    """How many products of each class lie at or below the highest wanted one, by their Rayleigh quotients."""
    values = np.tensordot(weights.stiffness[:4], product_coefficients(plate.x.ends, plate.y.ends), axes=1)
    unknown = [name for name in names if name not in plate.elastic_products[plate.parity(name)]]
    if unknown:
        raise KeyError(unknown)
    highest: dict[Parity, float] = {}
    for name in names:
        parity = plate.parity(name)
        highest[parity] = max(highest.get(parity, 0.0), values[name])
    return {p: sum(bool(values[b] <= top) for b in plate.elastic_products[p]) for p, top in highest.items()}


def _places(modes: ClassModes, names: Sequence[Beams]) -> dict[Beams, Place]:
    """Places of those wanted names that some of the lowest modes of a class have."""
    of_each = name_shapes(modes.own, modes.vectors, modes.on_plate)
    parity = modes.own.parity
    return {name: Place(parity, rank, fit) for rank, (name, fit) in enumerate(of_each) if name in names}


def _with_energies(solved: Mapping[Parity, ClassModes], places: Mapping[Beams, Place]) -> dict[Beams, Found]:
    found = {}
    for parity, modes in solved.items():
        own = {name: place for name, place in places.items() if place.parity == parity}
        energies = modes.of([place.rank for place in own.values()]).coefficients()
        for (name, place), stiffness, mass in zip(own.items(), *energies, strict=True):
            found[name] = Found(place, modes.eigenvalues[place.rank], stiffness, mass)
    return found
