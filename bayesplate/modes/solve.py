"""Modes of a plate: eigenvalues and shapes of K phi = omega^2 M phi, class by class."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.plate import Block, Parity, PlateMatrices, Weights

_SPARE_FOR_PROJECTED = 8
_FIRST_OF_CLASS = 8
_MORE, _FEWEST_MORE = 1.15, 4
"""What is added to an estimate of how many modes there are."""
_TOLERANCE = 1e-8
"""Of the solver's own values; those of the modes are Ritz values on its vectors, which err by the square of it."""


@dataclass(frozen=True, eq=False)
class ClassModes:
    """Lowest elastic modes of one symmetry class.

    Attributes
    ----------
    block : Block
    eigenvalues : (n_modes,) array
        omega^2, s^-2, increasing; rigid motions are left out.
    vectors : (n_dof, n_modes) array
        Mass-normalised.
    rigid : (n_dof, n_rigid) array
        The class's rigid motions, mass-normalised.
    on_plate : (n_modes,) array
        Share of the kinetic energy of each mode that is not of coordinates beside the plate.
    """

    block: Block
    eigenvalues: NDArray[np.float64]
    vectors: NDArray[np.float64]
    rigid: NDArray[np.float64]
    on_plate: NDArray[np.float64]

    def of(self, ranks: Sequence[int] | NDArray[np.intp]) -> ClassModes:
        """Some of the modes."""
        own = list(ranks)
        return replace(
            self, eigenvalues=self.eigenvalues[own], vectors=self.vectors[:, own], on_plate=self.on_plate[own]
        )

    def coefficients(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """phi' K_i phi and phi' M_j phi of each mode: (n_modes, n_terms) and (n_modes, n_masses) arrays.

        Weighted with the weights of the solve they sum to the eigenvalue and to 1 (the sum rule).
        """
        return self.block.stiffness_energies(self.vectors).T, self.block.mass_energies(self.vectors).T


def solve_class(block: Block, weights: Weights, n_modes: int) -> ClassModes:
    """Lowest `n_modes` elastic modes of one class.

    Parameters
    ----------
    block : Block
    weights : Weights
        Of one draw.
    n_modes : int

    Returns
    -------
    ClassModes
    """
    from scipy.sparse.linalg import LinearOperator, eigsh, splu

    stiffness, mass = block.stiffness(weights), block.mass(weights)
    shift = shift_below(block, stiffness.diagonal(), mass.diagonal())
    factors = splu(
        stiffness - shift * mass, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    n_bare = n_modes + _SPARE_FOR_PROJECTED if block.projected or block.projected_terms else n_modes
    n_wanted = min(n_bare + block.n_rigid, block.n_dof - 1)
    start = np.random.default_rng(0).standard_normal(block.n_dof)
    _, vectors = eigsh(
        stiffness,
        k=n_wanted,
        M=mass,
        sigma=shift,
        OPinv=LinearOperator(stiffness.shape, matvec=factors.solve, dtype=float),
        v0=start,
        ncv=min(block.n_dof, max(2 * n_wanted + 1, 20)),
        tol=_TOLERANCE,
    )
    values, vectors = _ritz(block, weights, stiffness, mass, vectors)
    return class_modes(block, weights, values[: block.n_rigid + n_modes], vectors)


def class_modes(
    block: Block, weights: Weights, values: NDArray[np.float64], vectors: NDArray[np.float64]
) -> ClassModes:
    """Modes of a class from its lowest eigenvalues and at least as many vectors, rigid motions first."""
    elastic = vectors[:, block.n_rigid : values.size]
    rigid, on_plate = vectors[:, : block.n_rigid], block.share_on_plate(weights, elastic)
    return ClassModes(block, values[block.n_rigid :], elastic, rigid, on_plate)


def shift_below(block: Block, stiffness: NDArray[np.float64], mass: NDArray[np.float64]) -> float:
    """A shift below zero that keeps rigid motions from making the shifted matrix singular, s^-2; 0 if there are none.

    Its scale is the lowest Rayleigh quotient of a single unknown: the lowest modes lie far below it, so the shift stays
    small, and stiff shear or short elements cannot raise it.

    Parameters
    ----------
    block : Block
    stiffness, mass : (n_dof,) arrays
        The diagonals.
    """
    return -1e-6 * float((stiffness / mass)[: block.n_dof - block.n_beside].min()) if block.n_rigid else 0.0


def _ritz(
    block: Block, weights: Weights, stiffness: Any, mass: Any, vectors: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Modes on the span of the solver's vectors, with the projected terms joined; rigid ones included, lowest first.

    The solver's own values carry the rounding of a nearly singular factorisation where the plate can move as a whole.
    """
    from scipy.linalg import eigh

    if block.projected:
        small_mass = np.tensordot(weights.mass, block.project_masses(vectors), axes=1)
    else:
        small_mass = vectors.T @ (mass @ vectors)
    small_stiffness = vectors.T @ (stiffness @ vectors) + block.further_stiffness(weights, vectors)
    values, combinations = eigh(small_stiffness, small_mass)
    return values, vectors @ combinations


def solve_classes(plate: PlateMatrices, weights: Weights, n_modes: Mapping[Parity, int]) -> dict[Parity, ClassModes]:
    """Lowest modes of the classes asked for; see `solve_class`."""
    return {parity: solve_class(plate.block(parity), weights, n) for parity, n in n_modes.items()}


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes of a plate in the order of their frequencies.

    Attributes
    ----------
    plate : PlateMatrices
    eigenvalues : (n_modes,) array
        omega^2, s^-2.
    parities : tuple of Parity
        Symmetry class of each mode.
    ranks : (n_modes,) array of int
        Position of each mode among the elastic modes of its class, from 0.
    shapes : (n_modes, n_dof_x, n_dof_y) array
        Mass-normalised shapes as coefficients of the two lines' functions.
    classes : dict of ClassModes
        The modes of each symmetry class, at least these.
    """

    plate: PlateMatrices
    eigenvalues: NDArray[np.float64]
    parities: tuple[Parity, ...]
    ranks: NDArray[np.intp]
    shapes: NDArray[np.float64]
    classes: Mapping[Parity, ClassModes]

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """phi' K_i phi; weighted they sum to the eigenvalue exactly (the sum rule): (n_modes, n_terms) array."""
        return self._energies[0]

    @property
    def mass_coefficients(self) -> NDArray[np.float64]:
        """phi' M_j phi; weighted they sum to 1: (n_modes, n_masses) array."""
        return self._energies[1]

    @cached_property
    def _energies(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rows = {p: [i for i, parity in enumerate(self.parities) if parity == p] for p in dict.fromkeys(self.parities)}
        found = [self.classes[parity].of(self.ranks[own]).coefficients() for parity, own in rows.items()]
        order = np.argsort(np.concatenate(list(rows.values())))
        stiffness, mass = (np.concatenate(parts)[order] for parts in zip(*found, strict=True))
        return stiffness, mass

    def displacement(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Shapes on a grid: (n_modes, n_x, n_y) array; x and y are fractions of the sides in [0, 1]."""
        along_x, along_y = self.plate.line_x.shapes(x).toarray(), self.plate.line_y.shapes(y).toarray()
        return np.asarray(along_x @ self.shapes @ along_y.T)


def solve(plate: PlateMatrices, weights: Weights, n_modes: int) -> Modes:
    """Lowest `n_modes` elastic modes of a plate.

    Each class is solved for a few modes more than its share, and for more again until no class can hide a mode below
    the highest that is returned.

    Parameters
    ----------
    plate : PlateMatrices
    weights : Weights
        Of one draw.
    n_modes : int

    Returns
    -------
    Modes
    """
    n_each = -(-n_modes // len(plate.blocks)) + 2
    solved = solve_classes(plate, weights, dict.fromkeys((b.parity for b in plate.blocks), n_each))
    while True:
        values = np.sort(np.concatenate([c.eigenvalues for c in solved.values()]))
        limit = values[min(n_modes, values.size) - 1]
        short = {p: 2 * c.eigenvalues.size for p, c in solved.items() if c.eigenvalues[-1] < limit}
        if not short and values.size >= n_modes:
            return collect(plate, solved, n_modes)
        solved |= solve_classes(plate, weights, short or {p: 2 * c.eigenvalues.size for p, c in solved.items()})


def solve_up_to(plate: PlateMatrices, weights: Weights, highest: float, n_least: int = 1) -> Modes:
    """All elastic modes of a plate up to an eigenvalue (s^-2), and at least so many; see `solve`."""
    solved = {block.parity: solve_class(block, weights, _FIRST_OF_CLASS) for block in plate.blocks}
    eigenvalues = np.sort(np.concatenate([c.eigenvalues for c in solved.values()]))
    highest = max(highest, eigenvalues[min(n_least, eigenvalues.size) - 1])
    while short := {p: _enough(c.eigenvalues, highest) for p, c in solved.items() if c.eigenvalues[-1] < highest}:
        solved |= solve_classes(plate, weights, short)
    n_modes = sum(int(np.sum(c.eigenvalues <= highest)) for c in solved.values())
    return collect(plate, solved, n_modes)


def _enough(eigenvalues: NDArray[np.float64], highest: float) -> int:
    """How many modes will reach up to an eigenvalue: those of a plate are about as dense at every frequency."""
    ratio = float(np.sqrt(highest / eigenvalues[-1]))
    return max(eigenvalues.size + _FEWEST_MORE, math.ceil(_MORE * ratio * eigenvalues.size))


def collect(plate: PlateMatrices, solved: Mapping[Parity, ClassModes], n_modes: int | None = None) -> Modes:
    """Sort the modes of several classes into one list, keeping the lowest `n_modes` (all if None)."""
    eigenvalues = np.concatenate([c.eigenvalues for c in solved.values()])
    order = np.argsort(eigenvalues, kind="stable")[:n_modes]
    parities = [p for p, c in solved.items() for _ in c.eigenvalues]
    ranks = np.concatenate([np.arange(c.eigenvalues.size) for c in solved.values()])
    return Modes(
        plate=plate,
        eigenvalues=eigenvalues[order],
        parities=tuple(parities[i] for i in order),
        ranks=ranks[order],
        shapes=np.concatenate([c.block.spread(c.vectors) for c in solved.values()])[order],
        classes=solved,
    )
