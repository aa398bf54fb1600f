"""A plate as a budget of energies: stiffness terms and mass terms on the unit square, and what each weighs.

    omega^2 = phi' (sum_i theta_i K_i) phi / phi' (sum_j mu_j M_j) phi

The side lengths appear in the weights theta and mu only (`bayesplate.frequencies.terms`), so that boards that share
their edges share these matrices whatever their size. Where opposite edges are alike the matrices split into classes of
even and odd functions: no two modes of one class cross, and none of different classes mix.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.banded import Band
from bayesplate.modes.line import Line, rigid_degrees
from bayesplate.modes.sparse import mirrored
from bayesplate.modes.threads import in_threads
from bayesplate.plate.setup import Ends

KronSum = tuple[tuple[Any, Any], ...]
"""A term of the plate as a sum of products of one matrix along x and one along y, on the unknowns of the two lines."""


class EdgeTurn(NamedTuple):
    """A stiffness term: the squared turning of the cross-sections, integrated along edges.

    The thin plate's cross-sections turn with its slope, those of the shear-flexible plate by the shear strain less.

    Attributes
    ----------
    axis : int
        0: the edges x0 and x1, 1: the edges y0 and y1.
    at : tuple of bool
        Which of the two.
    """

    axis: int
    at: tuple[bool, bool]


class Beside(NamedTuple):
    """A term of a coordinate beside the plate, such as the rise of a magnet that hangs on it.

    Attributes
    ----------
    coordinate : int
        Which one, from 0.
    rows : tuple of pairs of (1, n_dof_x) and (1, n_dof_y) arrays
        The term is twice the product of the coordinate with the deflection that these rows give, summed over the pairs;
        without rows it is the square of the coordinate.
    """

    coordinate: int
    rows: KronSum = ()


Term = KronSum | EdgeTurn | Beside
"""A stiffness term: on the deflection, on the turning of cross-sections along edges, or of a coordinate beside."""

Projection = Callable[[Line, Line, NDArray[np.float64]], NDArray[np.float64]]
"""Terms without sparse matrices: from the lines and (n_vectors, n_dof_x, n_dof_y) deflections to their
(n_terms, n_vectors, n_vectors) matrices; a term alone may be an (n_vectors, n_vectors) one."""

Beams = tuple[int, int]
"""Order of the beam functions along x and y whose product a mode resembles; (0, 0) is the lowest."""


_TERMS_AT_ONCE = 8
"""Whose products with a basis are held at once."""


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


class Panel(NamedTuple):
    """Rows of a symmetric matrix that hold the same columns: a dense part of it.

    Attributes
    ----------
    rows : (n_rows,) array of int
    columns : (n_columns,) array of int
    places : (n_rows, n_columns) array of int
        Where the values stand among those of the lower triangle.
    """

    rows: NDArray[np.intp]
    columns: NDArray[np.int32]
    places: NDArray[np.intp]


OnDeflections = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""A `Projection` on the lines of its plate."""


@dataclass(frozen=True, eq=False)
class Block:
    """One symmetry class: the lower triangles of its stiffness and mass terms, which are symmetric, on one pattern.

    Attributes
    ----------
    parity : Parity
    terms : (n_terms, n_stored) array
        Stored values of each stiffness term, non-dimensional.
    masses : (n_masses, n_stored) array
        Stored values of each mass term; the first is the board's own.
    indices, indptr : arrays
        The pattern they share (compressed columns).
    spread_x, spread_y : sparse arrays
        From the class's functions along x and y to all functions of the line; the deflection's unknowns come first.
    n_rigid : int
        Number of rigid motions of the whole plate in this class.
    n_beside : int
        Number of coordinates beside the plate, the last unknowns.
    projected_terms, projected : tuple of callable
        Stiffness and mass terms beyond `terms` and `masses` that exist on given deflections only.
    """

    parity: Parity
    terms: NDArray[np.float64]
    masses: NDArray[np.float64]
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]
    spread_x: Any
    spread_y: Any
    n_rigid: int
    n_beside: int = 0
    projected_terms: tuple[OnDeflections, ...] = ()
    projected: tuple[OnDeflections, ...] = ()

    @property
    def n_dof(self) -> int:
        """Number of unknowns of the class."""
        return self.indptr.size - 1

    @property
    def n_masses(self) -> int:
        """Number of mass terms; each of the projected ones is one."""
        return len(self.masses) + len(self.projected)

    def matrix(self, stored: NDArray[np.float64]) -> Any:
        """Sparse (n_dof, n_dof) array with the given stored values, whole."""
        from scipy.sparse import csc_array

        places, indices, indptr = self._whole
        return csc_array((stored[places], indices, indptr), shape=(self.n_dof, self.n_dof))

    @cached_property
    def _whole(self) -> tuple[NDArray[np.intp], NDArray[np.int32], NDArray[np.int32]]:
        return mirrored(self.indices, self.indptr)

    def stored_stiffness(self, weights: Weights) -> NDArray[np.float64]:
        """Stored values of the weighted sum of the stiffness terms, save the projected ones."""
        return np.asarray(weights.stiffness[..., : len(self.terms)] @ self.terms)

    def stiffness(self, weights: Weights) -> Any:
        """Weighted sum of the stiffness terms, save the projected ones, as a sparse (n_dof, n_dof) array."""
        return self.matrix(self.stored_stiffness(weights))

    def mass(self, weights: Weights) -> Any:
        """Weighted sum of the mass terms, save the projected ones, as a sparse (n_dof, n_dof) array."""
        return self.matrix(weights.mass[: len(self.masses)] @ self.masses)

    @cached_property
    def panels(self) -> tuple[Panel, ...]:
        """The unknowns of each node of the mesh, in the order of the first one: their rows hold the same columns."""
        places, columns, starts = self._whole
        alike: dict[bytes, list[int]] = {}
        for row in range(self.n_dof):
            alike.setdefault(columns[starts[row] : starts[row + 1]].tobytes(), []).append(row)
        return tuple(
            Panel(
                np.array(rows, dtype=np.intp),
                columns[starts[rows[0]] : starts[rows[0] + 1]],
                np.stack([places[starts[row] : starts[row + 1]] for row in rows]),
            )
            for rows in alike.values()
        )

    @cached_property
    def band(self) -> Band:
        """Where the stored values stand in a band, node by node."""
        return Band.of(self.indices, self.indptr, np.concatenate([panel.rows for panel in self.panels]))

    @cached_property
    def diagonal(self) -> NDArray[np.intp]:
        """Where the diagonal stands among the stored values: each column's first, for all of it is stored."""
        return self.indptr[:-1].astype(np.intp)

    def times(self, terms: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Terms times (n_dof, n_vectors) vectors: (n_terms, n_dof, n_vectors) array.

        Panel by panel, for a product of dense matrices is several times faster than one of a sparse matrix.
        """
        found = np.empty((len(terms), *vectors.shape))
        for rows, columns, places in self.panels:
            found[:, rows] = terms[:, places] @ vectors[columns]
        return found

    def project(self, terms: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Terms on the span of (n_dof, n_vectors) vectors: (n_terms, n_vectors, n_vectors) array."""
        parts = [terms[start : start + _TERMS_AT_ONCE] for start in range(0, len(terms), _TERMS_AT_ONCE)]
        found = in_threads(lambda some: vectors.T @ self.times(some, vectors), parts)
        small = np.concatenate(found) if found else np.empty((0, vectors.shape[1], vectors.shape[1]))
        return (small + np.swapaxes(small, -1, -2)) / 2.0

    def energies(self, terms: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Each term's phi' K phi of (n_dof, n_vectors) vectors: (n_terms, n_vectors) array, the diagonal of `project`.

        Row by row of whole terms, of which each nearly cancels; triangles alone would lose a digit.
        """

        def of(panels: Sequence[Panel]) -> NDArray[np.float64]:
            found = np.zeros((len(terms), vectors.shape[1]))
            for rows, columns, places in panels:
                found += np.einsum("trv,rv->tv", terms[:, places] @ vectors[columns], vectors[rows])
            return found

        return np.asarray(sum(in_threads(of, [self.panels[::2], self.panels[1::2]])))

    def project_stiffness(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """All stiffness terms on the span of vectors, the projected ones last."""
        return np.concatenate([self.project(self.terms, vectors), self._on_span(self.projected_terms, vectors)])

    def project_masses(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """All mass terms on the span of vectors, the projected ones last."""
        return np.concatenate([self.project(self.masses, vectors), self._on_span(self.projected, vectors)])

    def stiffness_energies(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """phi' K phi of all stiffness terms, the projected ones last: (n_terms, n_vectors) array."""
        further = np.diagonal(self._on_span(self.projected_terms, vectors), axis1=1, axis2=2)
        return np.concatenate([self.energies(self.terms, vectors), further])

    def mass_energies(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same of all mass terms, the projected ones last: (n_masses, n_vectors) array."""
        further = np.diagonal(self._on_span(self.projected, vectors), axis1=1, axis2=2)
        return np.concatenate([self.energies(self.masses, vectors), further])

    def further_stiffness(self, weights: Weights, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Weighted sums of the projected stiffness terms on the span of vectors.

        Returns
        -------
        (n_vectors, n_vectors) array
            Of one draw, or (n_draws, n_vectors, n_vectors); zeros where there are no such terms.
        """
        further = self._on_span(self.projected_terms, vectors)
        return np.tensordot(weights.stiffness[..., len(self.terms) :], further, axes=1)

    def beside(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """The coordinates beside the plate in (n_dof, n_vectors) vectors: (n_beside, n_vectors) array."""
        return vectors[self.n_dof - self.n_beside :]

    @cached_property
    def masses_beside(self) -> NDArray[np.float64]:
        """What each stored mass term gives to the coordinates beside the plate: (n_masses, n_beside) array."""
        return self.masses[:, self.diagonal[self.n_dof - self.n_beside :]]

    def share_on_plate(self, weights: Weights, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Share of the kinetic energy that is no magnet's: (n_vectors,) array.

        Parameters
        ----------
        weights : Weights
        vectors : (n_dof, n_vectors) array
            Normalised in the mass of these weights.
        """
        return np.asarray(1.0 - (weights.mass[: len(self.masses)] @ self.masses_beside) @ self.beside(vectors) ** 2)

    def _on_span(self, terms: Sequence[OnDeflections], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        if not terms:
            return np.empty((0, vectors.shape[1], vectors.shape[1]))
        deflections = self.spread(vectors)
        n = vectors.shape[1]
        return np.concatenate([np.reshape(term(deflections), (-1, n, n)) for term in terms])

    def spread(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Deflection of (n_dof, n_vectors) of the class as (n_vectors, n_dof_x, n_dof_y) of the two lines."""
        n_x, n_y = self.spread_x.shape[1], self.spread_y.shape[1]
        grids = vectors[: n_x * n_y].T.reshape(-1, n_x, n_y)
        return np.stack([(self.spread_y @ (self.spread_x @ grid).T).T for grid in grids])


@dataclass(frozen=True, eq=False)
class PlateMatrices:
    """A plate's two lines and the matrices of its symmetry classes; see `bayesplate.modes.thin`."""

    line_x: Line
    line_y: Line
    blocks: tuple[Block, ...]

    def parity(self, beams: Beams) -> Parity:
        """Symmetry class to which a product of beam functions belongs."""
        return Parity(beams[0] % 2 if self.line_x.is_symmetric else 0, beams[1] % 2 if self.line_y.is_symmetric else 0)

    @cached_property
    def elastic_products(self) -> dict[Parity, list[Beams]]:
        """Orders of those products of beam functions that bend, by symmetry class."""
        shape = self.line_x.beams.shape[1], self.line_y.beams.shape[1]
        found: dict[Parity, list[Beams]] = {block.parity: [] for block in self.blocks}
        for beams in np.ndindex(shape):
            if not is_rigid(beams, self.line_x.ends, self.line_y.ends):
                found[self.parity(beams)].append(beams)
        return found

    def block(self, parity: Parity) -> Block:
        """The block of a class."""
        return next(block for block in self.blocks if block.parity == parity)

    def with_projected(self, masses: Sequence[Projection], terms: Sequence[Projection] = ()) -> PlateMatrices:
        """The same plate with these as all of its terms without a matrix; its own matrices are shared."""
        stiff, inert = (tuple(partial(one, self.line_x, self.line_y) for one in each) for each in (terms, masses))
        return replace(
            self, blocks=tuple(replace(block, projected_terms=stiff, projected=inert) for block in self.blocks)
        )


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
