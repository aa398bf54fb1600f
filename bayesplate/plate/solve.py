"""Modes of a plate: eigenvalues and shapes of K phi = omega^2 M phi, class by class."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.plate.beams import product_coefficients
from bayesplate.plate.classes import SymmetryClass
from bayesplate.plate.forms import Elements
from bayesplate.plate.plate import Plate
from bayesplate.plate.terms import Parity, Weights

_SPARE_MODES = 8
_FIRST_MODES = 8
_MODE_MARGIN, _FEWEST_MORE_MODES = 1.15, 4
"""Factor on an estimate of the number of modes, and the least number of modes that is added."""
_MASSLESS_SHARE = 1e-12
_TOLERANCE = 1e-8
"""Relative, of the solver's own values; the modes have Ritz values on its vectors, which err by the square of it."""
_SHIFT_RATIO = -1e-2
"""Shift over the lowest elastic eigenvalue."""


@dataclass(frozen=True, eq=False)
class ClassModes:
    """Lowest elastic modes of one symmetry class."""

    symmetry_class: SymmetryClass
    eigenvalues: Floats  # (n_modes,): omega^2, s^-2, increasing; rigid motions are left out
    vectors: Floats  # (n_dof, n_modes), mass-normalised
    rigid: Floats  # (n_dof, n_rigid): the rigid motions, mass-normalised
    on_plate: Floats  # (n_modes,): share of the kinetic energy that is not of coordinates beside the plate

    def at_ranks(self, ranks: Sequence[int] | Indices) -> ClassModes:
        rows = list(ranks)
        return replace(
            self, eigenvalues=self.eigenvalues[rows], vectors=self.vectors[:, rows], on_plate=self.on_plate[rows]
        )

    def coefficients(self) -> tuple[Floats, Floats]:
        """phi' K_i phi and phi' M_j phi of each mode: (n_modes, n_terms) and (n_modes, n_masses) arrays.

        Weighted with the weights of the solve they sum to the eigenvalue and to 1 (the sum rule).
        """
        return self.symmetry_class.energies(self.vectors)


def solve_classes(plate: Plate, weights: Weights, n_modes: Mapping[Parity, int]) -> dict[Parity, ClassModes]:
    """The lowest elastic modes, `n_modes` of each symmetry class, at the weights of one draw.

    LinAlgError if the weights are those of no plate.
    """
    elements = plate.elements(weights)
    return {parity: _solve_class(plate.symmetry_class(parity), elements, weights, n) for parity, n in n_modes.items()}


def _solve_class(
    symmetry_class: SymmetryClass, elements: tuple[Elements, Elements], weights: Weights, n_modes: int
) -> ClassModes:
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

    # The solver needs a positive mass; the negative terms, left out here, are added on the span of its vectors.
    is_definite = elements[1].is_definite
    pencil = symmetry_class.pencil(elements)
    stiffness, mass = pencil if is_definite else symmetry_class.pencil((elements[0], elements[1].without_negative()))
    shift = _shift_below(symmetry_class, weights)
    options = {"SymmetricMode": True}
    n_wanted = min(
        symmetry_class.n_rigid + n_modes + _SPARE_MODES * (symmetry_class.plate.is_projected or not is_definite),
        symmetry_class.n_dof - 1,
    )
    try:
        factors = splu(stiffness - shift * mass, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
        _, vectors = eigsh(
            stiffness,
            k=n_wanted,
            M=mass,
            sigma=shift,
            OPinv=LinearOperator(stiffness.shape, matvec=factors.solve, dtype=float),
            v0=np.random.default_rng(0).standard_normal(symmetry_class.n_dof),
            ncv=min(symmetry_class.n_dof, max(2 * n_wanted + 1, 20)),
            tol=_TOLERANCE,
        )
    except (ArpackError, RuntimeError) as failure:
        raise np.linalg.LinAlgError(str(failure)) from failure
    # The solver's own values carry the rounding of a nearly singular factorisation where the plate can move as a whole.
    on_span = symmetry_class.on_span([pencil], Weights(*(w[None] for w in weights)), vectors)
    values, combinations = _ritz_vectors(on_span[0][0], on_span[1][0])
    vectors = vectors @ combinations
    rigid, elastic = (
        vectors[:, : symmetry_class.n_rigid],
        vectors[:, symmetry_class.n_rigid : symmetry_class.n_rigid + n_modes],
    )
    on_plate = 1.0 - np.diagonal(np.tensordot(weights.mass, symmetry_class.project_coordinates(elastic), axes=1))
    return ClassModes(
        symmetry_class, values[symmetry_class.n_rigid : symmetry_class.n_rigid + n_modes], elastic, rigid, on_plate
    )


def _ritz_vectors(stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
    """Eigenvalues on the span of vectors, increasing, and the combinations of these that are modes of unit mass.

    Where the mass at a place is interpolated between others, the finest shapes may have a negative mass: they are no
    modes, and left out.
    """
    shares, directions = np.linalg.eigh(mass)
    is_kept = shares > _MASSLESS_SHARE * shares[-1]
    if not is_kept.any():
        raise np.linalg.LinAlgError("no shape has a mass above zero")
    whitening = directions[:, is_kept] / np.sqrt(shares[is_kept])
    values, rotations = np.linalg.eigh(whitening.T @ stiffness @ whitening)
    return np.asarray(values), np.asarray(whitening @ rotations)


def _shift_below(symmetry_class: SymmetryClass, weights: Weights) -> float:
    """A shift below zero that keeps rigid motions from making the shifted matrix singular, s^-2; 0 if there are none.

    It lies well below the lowest elastic mode, as products of beam functions bound it: from there rigid motions are far
    from all other modes, so that the solver, which finds equal eigenvalues by rounding, has them all before it stops.
    """
    if not symmetry_class.n_rigid:
        return 0.0
    values = np.tensordot(
        weights.stiffness[:4], product_coefficients(symmetry_class.plate.x.ends, symmetry_class.plate.y.ends), axes=1
    )
    return _SHIFT_RATIO * min(
        float(values[beams]) for beams in symmetry_class.plate.elastic_products[symmetry_class.parity]
    )


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of a plate in the order of their frequencies."""

    plate: Plate
    eigenvalues: Floats  # (n_modes,): omega^2, s^-2
    parities: tuple[Parity, ...]
    ranks: Indices  # (n_modes,): among the elastic modes of its class, from 0
    classes: Mapping[Parity, ClassModes]  # the modes of each symmetry class, at least these

    @property
    def coefficients(self) -> Floats:
        """phi' K_i phi; weighted they sum to the eigenvalue exactly (the sum rule): (n_modes, n_terms) array."""
        return self._energies[0]

    @property
    def mass_coefficients(self) -> Floats:
        """phi' M_j phi; weighted they sum to 1: (n_modes, n_masses) array."""
        return self._energies[1]

    @cached_property
    def _energies(self) -> tuple[Floats, Floats]:
        energies = {parity: modes.coefficients() for parity, modes in self.by_class.items()}
        stiffness, mass = (self.in_order({parity: pair[i] for parity, pair in energies.items()}) for i in (0, 1))
        return stiffness, mass

    @cached_property
    def by_class(self) -> dict[Parity, ClassModes]:
        by_class = {}
        for parity in dict.fromkeys(self.parities):
            by_class[parity] = self.classes[parity].at_ranks(self.ranks[self.rows(parity)])
        return by_class

    def in_order(self, of_class: Mapping[Parity, Any]) -> Floats:
        """Rows of the modes of each class, sorted into the order of frequency."""
        order = np.argsort(np.concatenate([self.rows(parity) for parity in self.by_class]))
        return np.concatenate([of_class[parity] for parity in self.by_class])[order]

    def rows(self, parity: Parity) -> list[int]:
        return [i for i, p in enumerate(self.parities) if p == parity]

    def displacement(self, x: Floats, y: Floats) -> Floats:
        """Shapes on a grid: (n_modes, n_x, n_y) array; x and y are fractions of the sides in [0, 1]."""
        return self.in_order({p: c.symmetry_class.deflections(c.vectors).on(x, y) for p, c in self.by_class.items()})

    def displacement_across(self, x: Floats, y: Floats) -> Floats:
        """Shapes at points y, (n_x, n_y), of their own at each x, (n_x,)."""
        return self.in_order(
            {p: c.symmetry_class.deflections(c.vectors).across(x, y) for p, c in self.by_class.items()}
        )


def solve(plate: Plate, weights: Weights, n_modes: int) -> Modes:
    """Lowest `n_modes` elastic modes of a plate at the weights of one draw.

    Each class is solved for a few modes more than its share, and for more again until no class can hide a mode below
    the highest that is returned.
    """
    counts = dict.fromkeys(plate.parities, -(-n_modes // len(plate.parities)) + 2)
    solved = solve_classes(plate, weights, counts)
    while True:
        values = np.sort(np.concatenate([c.eigenvalues for c in solved.values()]))
        limit = values[min(n_modes, values.size) - 1]
        short = [p for p, c in solved.items() if c.eigenvalues[-1] < limit]
        if not short and values.size >= n_modes:
            return collect_modes(plate, solved, n_modes)
        counts |= {p: 2 * counts[p] for p in short or counts}
        solved |= solve_classes(plate, weights, {p: counts[p] for p in short or counts})


def solve_up_to(plate: Plate, weights: Weights, highest: float, n_least: int = 1) -> Modes:
    """All elastic modes of a plate up to an eigenvalue (s^-2), and at least so many; see `solve`.

    No more than the products of beam functions can name: modes above are finer than the mesh.
    """
    n_most = {parity: len(products) for parity, products in plate.elastic_products.items()}
    counts = dict.fromkeys(plate.parities, _FIRST_MODES)
    solved = solve_classes(plate, weights, counts)
    eigenvalues = np.sort(np.concatenate([c.eigenvalues for c in solved.values()]))
    highest = max(highest, eigenvalues[min(n_least, eigenvalues.size) - 1])
    while short := [p for p, c in solved.items() if c.eigenvalues[-1] < highest and counts[p] < n_most[p]]:
        # A class that returned fewer modes than it was solved for is solved for more all the same.
        needed = {p: max(_modes_needed(solved[p].eigenvalues, highest), counts[p] + _FEWEST_MORE_MODES) for p in short}
        counts |= {p: min(n, n_most[p]) for p, n in needed.items()}
        solved |= solve_classes(plate, weights, {p: counts[p] for p in short})
    highest = min([highest, *(solved[p].eigenvalues[-1] for p, n in counts.items() if n == n_most[p])])
    n_modes = sum(int(np.sum(c.eigenvalues <= highest)) for c in solved.values())
    return collect_modes(plate, solved, n_modes)


def _modes_needed(eigenvalues: Floats, highest: float) -> int:
    """How many modes will reach up to an eigenvalue: those of a plate are about as dense at every frequency."""
    ratio = float(np.sqrt(highest / eigenvalues[-1]))
    return max(eigenvalues.size + _FEWEST_MORE_MODES, math.ceil(_MODE_MARGIN * ratio * eigenvalues.size))


def collect_modes(plate: Plate, solved: Mapping[Parity, ClassModes], n_modes: int | None = None) -> Modes:
    """Sort the modes of several classes into one list, keeping the lowest `n_modes` (all if None)."""
    eigenvalues = np.concatenate([c.eigenvalues for c in solved.values()])
    order = np.argsort(eigenvalues, kind="stable")[:n_modes]
    parities = [p for p, c in solved.items() for _ in c.eigenvalues]
    ranks = np.concatenate([np.arange(c.eigenvalues.size) for c in solved.values()])
    return Modes(plate, eigenvalues[order], tuple(parities[i] for i in order), ranks[order], solved)
