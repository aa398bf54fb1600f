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

CERTAIN_CORRELATION = 0.75
"""Correlation with its product of beam functions below which a mode's name is "cannot tell"."""

_STRAY_CORRELATION = 0.3
"""Correlation below which a mode has its name only because no other was left: the mode of that name lies higher."""

_SPARE_MODES = 3
_MOST_MODES = 40
_MODES_AHEAD = 12
"""Modes beyond the required ones when a class is solved again, so that it is solved again only once."""


@dataclass(frozen=True)
class ModePlace:
    """The place of a named mode: its class, its rank there, and how well the name fits."""

    parity: Parity
    rank: int  # among the elastic modes of the class, from 0
    correlation: float  # between its shape and the product of beam functions, 0 to 1

    @property
    def is_certain(self) -> bool:
        return self.correlation >= CERTAIN_CORRELATION


def modes_to_hold(places: Iterable[ModePlace]) -> dict[Parity, int]:
    """How many of the lowest modes of each class include all places."""
    counts: dict[Parity, int] = {}
    for place in places:
        counts[place.parity] = max(counts.get(place.parity, 0), place.rank + 1)
    return counts


@dataclass(frozen=True, eq=False)
class PlacedMode:
    """A named mode: its place, its eigenvalue (s^-2), and its energy in each stiffness and mass term."""

    place: ModePlace
    eigenvalue: float
    stiffness: Floats
    mass: Floats


def name_shapes(symmetry_class: SymmetryClass, vectors: Floats, on_plate: Floats) -> list[tuple[Beams, float]]:
    """Beam product and correlation of each mode of a class, its lowest ones, each product given to one mode only.

    `on_plate` is the share of each mode's kinetic energy that is the plate's, with all that it carries along.
    """
    parts, squares = beam_parts(symmetry_class, vectors)
    products, named = (
        symmetry_class.plate.elastic_products[symmetry_class.parity],
        assign_products(product_fits(parts, np.diagonal(squares), on_plate)),
    )
    return [(products[column], correlation) for column, correlation in named]


def beam_parts(symmetry_class: SymmetryClass, vectors: Floats) -> tuple[Floats, Floats]:
    """Components of deflections along each of `elastic_products`, (n_vectors, n_products), and their mean products."""
    x, y = symmetry_class.plate.x, symmetry_class.plate.y
    deflections = symmetry_class.strains(["w"], vectors)["w"].reshape(-1, x.points.size, y.points.size)
    along_x, along_y = (side.weights * beam_functions(side.ends).at(side.points).T for side in (x, y))
    parts = along_x @ deflections @ along_y.T
    orders = np.array(symmetry_class.plate.elastic_products[symmetry_class.parity]).T
    weighed = (np.outer(x.weights, y.weights) * deflections).reshape(len(deflections), -1)
    return parts[:, orders[0], orders[1]], weighed @ deflections.reshape(len(deflections), -1).T


def product_fits(parts: Floats, squares: Floats, on_plate: Floats) -> Floats:
    """How well each shape fits each product: its correlation by the root of the plate's share of the motion.

    `squares` are the mean squares of the deflections: a shape is measured by itself, for the water that a plate carries
    along may weigh ten times what it weighs, and changes no shape by it. A magnet that bounces on its spring bends the
    plate a little, in a shape like that of the lowest mode: by the share it takes no name.
    """
    return np.asarray(parts * np.sqrt(np.maximum(on_plate, 0.0) / squares)[:, None])


def assign_products(parts: Floats) -> list[tuple[int, float]]:
    """Product and correlation of each mode, from its correlations with all; a product goes to one mode only."""
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(parts**2, maximize=True)
    return [(int(c), float(np.abs(parts[r, c]))) for r, c in zip(rows, columns, strict=True)]


def name_modes(modes: Modes) -> list[tuple[Beams, float]]:
    """Beam product and correlation of each of the lowest modes of a plate, in their order."""
    named = {
        parity: list(zip(modes.rows(parity), name_shapes(c.symmetry_class, c.vectors, c.on_plate), strict=True))
        for parity, c in modes.by_class.items()
    }
    names = dict(row for rows in named.values() for row in rows)
    return [names[i] for i in range(len(names))]


def find_named_modes(plate: Plate, weights: Weights, wanted_names: Iterable[Beams]) -> dict[Beams, PlacedMode]:
    """Each wanted name among the modes of a plate at the weights of one draw.

    A name without a certain mode gets its best remaining one, with the low correlation. KeyError if a name is no
    elastic mode of this plate or lies beyond the modes that can be resolved.
    """
    names = list(wanted_names)
    # No more modes than products in a class: with as many, all names are given.
    n_most = {c.parity: min(len(plate.elastic_products[c.parity]), c.n_dof - c.n_rigid - 1) for c in plate.classes}
    counts = {p: min(n + _SPARE_MODES, n_most[p]) for p, n in _expected_ranks(plate, weights, names).items()}
    solved: dict[Parity, ClassModes] = {}
    places: dict[Beams, ModePlace] = {}
    while counts:
        short = {p: n for p, n in counts.items() if p not in solved or solved[p].eigenvalues.size < n}
        asked = {p: min(n + _MODES_AHEAD * (p in solved), n_most[p]) for p, n in short.items()}
        solved |= solve_classes(plate, weights, asked)
        n_most |= {p: solved[p].eigenvalues.size for p, n in asked.items() if solved[p].eigenvalues.size < n}
        counts = {p: min(n, n_most[p]) for p, n in counts.items()}
        places = {name: place for name, place in places.items() if place.parity not in counts}
        for parity, n in counts.items():
            places |= _places(solved[parity].at_ranks(range(n)), names)
        lost_classes = {plate.parity(n) for n in names if n not in places or places[n].correlation < _STRAY_CORRELATION}
        unsure_classes = {plate.parity(n) for n in names if n in places and not places[n].is_certain}
        counts = {
            p: min(n + 2 * _SPARE_MODES, n_most[p])
            for p, n in counts.items()
            if n < n_most[p] and (p in lost_classes or (p in unsure_classes and n < _MOST_MODES // len(plate.classes)))
        }
    missing = [name for name in names if name not in places]
    if missing:
        raise KeyError(missing)
    modes = _placed_modes(solved, places)
    return {name: modes[name] for name in names}


def _expected_ranks(plate: Plate, weights: Weights, names: list[Beams]) -> dict[Parity, int]:
    """How many products of each class lie at or below the highest wanted product, by their Rayleigh quotients."""
    values = np.tensordot(weights.stiffness[:4], product_coefficients(plate.x.ends, plate.y.ends), axes=1)
    unknown = [name for name in names if name not in plate.elastic_products[plate.parity(name)]]
    if unknown:
        raise KeyError(unknown)
    highest: dict[Parity, float] = {}
    for name in names:
        parity = plate.parity(name)
        highest[parity] = max(highest.get(parity, 0.0), values[name])
    return {p: sum(bool(values[b] <= top) for b in plate.elastic_products[p]) for p, top in highest.items()}


def _places(modes: ClassModes, names: Sequence[Beams]) -> dict[Beams, ModePlace]:
    """Places of the wanted names among the lowest modes of a class."""
    named = name_shapes(modes.symmetry_class, modes.vectors, modes.on_plate)
    parity = modes.symmetry_class.parity
    return {name: ModePlace(parity, rank, fit) for rank, (name, fit) in enumerate(named) if name in names}


def _placed_modes(solved: Mapping[Parity, ClassModes], places: Mapping[Beams, ModePlace]) -> dict[Beams, PlacedMode]:
    placed = {}
    for parity, modes in solved.items():
        class_places = {name: place for name, place in places.items() if place.parity == parity}
        energies = modes.at_ranks([place.rank for place in class_places.values()]).coefficients()
        for (name, place), stiffness, mass in zip(class_places.items(), *energies, strict=True):
            placed[name] = PlacedMode(place, modes.eigenvalues[place.rank], stiffness, mass)
    return placed
