"""The thin plate as a budget of energies: four stiffness terms and a mass on the unit square.

    omega^2 = phi' (theta_xx K_xx + theta_yy K_yy + theta_mix K_mix + theta_xy K_xy) phi / mu phi' M phi

with K_xx = int w_xx^2, K_yy = int w_yy^2, K_mix = 2 int w_xx w_yy (the 2 is inside, once), K_xy = int w_xy^2 taken over
the unit square, so that the side lengths appear in theta only (`bayesplate.frequencies.terms`) and boards that share
their edges share these matrices whatever their size. Where opposite edges are alike the matrices split into classes of
even and odd functions: no two modes of one class cross, and none of different classes mix.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.line import Line, line, rigid_degrees
from bayesplate.plate.setup import Ends

THIN_TERMS = ("xx", "yy", "mix", "xy")

Beams = tuple[int, int]
"""Order of the beam functions along x and y whose product a mode resembles; (0, 0) is the lowest."""


class Weights(NamedTuple):
    """Weights of the stiffness terms, s^-2, and of the mass terms, as fractions of the board's mass.

    Arrays of (n_terms,) and (n_masses,), or of (n_draws, n_terms) and (n_draws, n_masses).
    """

    stiffness: NDArray[np.float64]
    mass: NDArray[np.float64]

    def at(self, draw: int) -> Weights:
        """The weights of one draw."""
        return Weights(self.stiffness[draw], self.mass[draw])


class Parity(NamedTuple):
    """Class of functions: 0 even, 1 odd along each side; 0 where the two ends differ and there is no such class."""

    x: int
    y: int


@dataclass(frozen=True, eq=False)
class Block:
    """One symmetry class: its stiffness and mass terms on one sparsity pattern.

    Attributes
    ----------
    parity : Parity
    terms : (n_terms, n_stored) array
        Stored values of each stiffness term, non-dimensional.
    masses : (n_masses, n_stored) array
        Stored values of each mass term; the first is the board's own.
    indices, indptr : arrays
        The pattern they share (compressed columns; the matrices are symmetric).
    spread_x, spread_y : sparse arrays
        From the class's functions along x and y to all functions of the line; the deflection's unknowns come first.
    n_rigid : int
        Number of rigid motions of the whole plate in this class.
    """

    parity: Parity
    terms: NDArray[np.float64]
    masses: NDArray[np.float64]
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]
    spread_x: Any
    spread_y: Any
    n_rigid: int

    @property
    def n_dof(self) -> int:
        """Number of unknowns of the class."""
        return self.indptr.size - 1

    def matrix(self, stored: NDArray[np.float64]) -> Any:
        """Sparse (n_dof, n_dof) array with the given stored values."""
        from scipy.sparse import csc_array

        return csc_array((stored, self.indices, self.indptr), shape=(self.n_dof, self.n_dof))

    def stiffness(self, weights: Weights) -> Any:
        """Weighted sum of the stiffness terms as a sparse (n_dof, n_dof) array."""
        return self.matrix(weights.stiffness @ self.terms)

    def mass(self, weights: Weights) -> Any:
        """Weighted sum of the mass terms as a sparse (n_dof, n_dof) array."""
        return self.matrix(weights.mass @ self.masses)

    def spread(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Deflection of (n_dof, n_vectors) of the class as (n_vectors, n_dof_x, n_dof_y) of the two lines."""
        n_x, n_y = self.spread_x.shape[1], self.spread_y.shape[1]
        grids = vectors[: n_x * n_y].T.reshape(-1, n_x, n_y)
        return np.stack([(self.spread_y @ (self.spread_x @ grid).T).T for grid in grids])


@dataclass(frozen=True, eq=False)
class PlateMatrices:
    """A plate's two lines and the matrices of its symmetry classes; see `thin_plate`."""

    line_x: Line
    line_y: Line
    blocks: tuple[Block, ...]

    def parity(self, beams: Beams) -> Parity:
        """Symmetry class to which a product of beam functions belongs."""
        return Parity(beams[0] % 2 if self.line_x.is_symmetric else 0, beams[1] % 2 if self.line_y.is_symmetric else 0)

    def block(self, parity: Parity) -> Block:
        """The block of a class."""
        return next(block for block in self.blocks if block.parity == parity)


def is_rigid(beams: Beams, ends_x: Ends, ends_y: Ends) -> bool:
    """Whether a product of beam functions is a motion without bending: a shift or a turn, but not the twist xy."""
    rigid_x, rigid_y = rigid_degrees(ends_x), rigid_degrees(ends_y)
    if beams[0] >= len(rigid_x) or beams[1] >= len(rigid_y):
        return False
    return rigid_x[beams[0]] + rigid_y[beams[1]] <= 1


def count_rigid(parity: Parity, x: Line, y: Line) -> int:
    """Number of rigid motions of the plate in a class."""
    return sum(
        is_rigid((i, j), x.ends, y.ends)
        for i in range(2)
        for j in range(2)
        if (i % 2 if x.is_symmetric else 0, j % 2 if y.is_symmetric else 0) == parity
    )


@lru_cache(maxsize=16)
def thin_plate(ends_x: Ends, ends_y: Ends, n_x: int, n_y: int) -> PlateMatrices:
    """Assemble the thin plate from two lines; the result is shared, so it must not be changed.

    Parameters
    ----------
    ends_x, ends_y : tuple of str
        Condition at the two ends of each side: (x0, x1) and (y0, y1).
    n_x, n_y : int
        Numbers of elements along x and y.

    Returns
    -------
    PlateMatrices
        Stiffness terms in the order of `THIN_TERMS`.

    References
    ----------
    Ducceschi et al., eq. (1) and (2), as energies.
    """
    x, y = line(ends_x, n_x), line(ends_y, n_y)
    blocks = tuple(
        _block(Parity(i, j), x, y, x.parts[i], y.parts[j]) for i in range(len(x.parts)) for j in range(len(y.parts))
    )
    return PlateMatrices(x, y, blocks)


def _block(parity: Parity, x: Line, y: Line, part_x: Any, part_y: Any) -> Block:
    from scipy.sparse import kron

    def along(part: Any, matrix: Any) -> Any:
        return part.T @ matrix @ part

    mass_x, slope_x, bending_x, mixed_x = (along(part_x, m) for m in (x.mass, x.slope, x.bending, x.mixed))
    mass_y, slope_y, bending_y, mixed_y = (along(part_y, m) for m in (y.mass, y.slope, y.bending, y.mixed))
    terms = [
        kron(bending_x, mass_y),
        kron(mass_x, bending_y),
        kron(mixed_x, mixed_y.T) + kron(mixed_x.T, mixed_y),
        kron(slope_x, slope_y),
    ]
    n_rigid = count_rigid(parity, x, y)
    stored, indices, indptr = on_one_pattern([*terms, kron(mass_x, mass_y)])
    return Block(parity, stored[:-1], stored[-1:], indices, indptr, part_x, part_y, n_rigid)


def on_one_pattern(
    matrices: list[Any],
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]:
    """Stored values of several sparse matrices on the union of their patterns, so that sums are sums of values."""
    from scipy.sparse import coo_array, csc_array

    n = matrices[0].shape[0]
    entries = [coo_array(matrix) for matrix in matrices]
    keys = [entry.coords[1].astype(np.int64) * n + entry.coords[0] for entry in entries]
    pattern = np.unique(np.concatenate(keys))
    stored = np.zeros((len(matrices), pattern.size))
    for row, entry, key in zip(stored, entries, keys, strict=True):
        np.add.at(row, np.searchsorted(pattern, key), entry.data)
    shape = csc_array((np.ones(pattern.size), (pattern % n, pattern // n)), shape=(n, n))
    return stored, shape.indices, shape.indptr
