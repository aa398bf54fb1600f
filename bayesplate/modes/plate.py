"""The thin plate as a budget of energies: four stiffness terms and a mass on the unit square.

    omega^2 = phi' (theta_xx K_xx + theta_yy K_yy + theta_mix K_mix + theta_xy K_xy) phi / mu phi' M phi

with K_xx = int w_xx^2, K_yy = int w_yy^2, K_mix = 2 int w_xx w_yy (the 2 is inside, once), K_xy = int w_xy^2 taken over
the unit square, so that the side lengths appear in theta only (`bayesplate.frequencies.terms`) and boards that share
their edges share these matrices whatever their size. Where opposite edges are alike the matrices split into classes of
even and odd functions: no two modes of one class cross, and none of different classes mix.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.fields import Fabric, Group, Measure, layout
from bayesplate.modes.line import Line, line, rigid_degrees
from bayesplate.modes.sparse import on_one_pattern
from bayesplate.plate.setup import Ends

THIN_TERMS = ("xx", "yy", "mix", "xy")
UNIFORM = Fabric()


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

    def on_slopes(self, x: Line, y: Line) -> KronSum:
        """The term of a thin plate."""
        if self.axis == 0:
            return ((x.at_ends(self.at, 1), y.mass),)
        return ((x.mass, y.at_ends(self.at, 1)),)


Term = KronSum | EdgeTurn
"""A stiffness term: on the deflection, or on the turning of cross-sections along edges."""

Projection = Callable[[Line, Line, NDArray[np.float64]], NDArray[np.float64]]
"""A mass term without a sparse matrix: from the lines and (n_vectors, n_dof_x, n_dof_y) deflections to its
(n_vectors, n_vectors) matrix."""

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
    projected : tuple of Projection
        Mass terms beyond `masses` that exist on given deflections only.
    """

    parity: Parity
    terms: NDArray[np.float64]
    masses: NDArray[np.float64]
    indices: NDArray[np.int32]
    indptr: NDArray[np.int32]
    spread_x: Any
    spread_y: Any
    n_rigid: int
    projected: tuple[Callable[[NDArray[np.float64]], NDArray[np.float64]], ...] = ()

    @property
    def n_dof(self) -> int:
        """Number of unknowns of the class."""
        return self.indptr.size - 1

    @property
    def n_masses(self) -> int:
        """Number of mass terms, the projected ones included."""
        return len(self.masses) + len(self.projected)

    def matrix(self, stored: NDArray[np.float64]) -> Any:
        """Sparse (n_dof, n_dof) array with the given stored values."""
        from scipy.sparse import csc_array

        return csc_array((stored, self.indices, self.indptr), shape=(self.n_dof, self.n_dof))

    def stiffness(self, weights: Weights) -> Any:
        """Weighted sum of the stiffness terms as a sparse (n_dof, n_dof) array."""
        return self.matrix(weights.stiffness @ self.terms)

    def mass(self, weights: Weights) -> Any:
        """Weighted sum of the mass terms, save the projected ones, as a sparse (n_dof, n_dof) array."""
        return self.matrix(weights.mass[: len(self.masses)] @ self.masses)

    def project(self, terms: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Terms on the span of (n_dof, n_vectors) vectors: (n_terms, n_vectors, n_vectors) array."""
        small = np.stack([vectors.T @ (self.matrix(term) @ vectors) for term in terms])
        return (small + np.swapaxes(small, -1, -2)) / 2.0

    def project_masses(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """All mass terms on the span of vectors, the projected ones last."""
        small = self.project(self.masses, vectors)
        if not self.projected:
            return small
        deflections = self.spread(vectors)
        return np.concatenate([small, [term(deflections) for term in self.projected]])

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
    return assemble(x, y, thin_terms(x, y), thin_masses(x, y))


def thin_groups(is_turned: bool = False) -> tuple[tuple[Group, ...], tuple[Group, ...]]:
    """Group of each stiffness and of each mass term that is the thin plate's own."""
    stiffness: tuple[Group, ...] = ("bending", "bending", "bending", "bending")
    coupling: tuple[Group, ...] = ("bending", "bending") if is_turned else ()
    return stiffness + coupling, ("mass",)


def thin_terms(x: Line, y: Line, fabric: Fabric = UNIFORM) -> tuple[KronSum, ...]:
    """The bending terms of the thin plate.

    Parameters
    ----------
    x, y : Line
    fabric : Fabric
        Varying properties repeat the terms in the order of `bayesplate.modes.fields.layout`.

    Returns
    -------
    tuple of KronSum
        The four of `THIN_TERMS`; 4 int w_xx w_xy and 4 int w_yy w_xy follow where the grain runs at an angle.
    """
    measures = fabric.measures("bending", x, y)
    stiffness, _ = thin_groups(fabric.is_turned)

    def both(measure: Measure, a: Beams, b: Beams, factor: float = 1.0) -> KronSum:
        """Integral of the product of two derivatives of the deflection, symmetric."""
        return (*_integral(measure, x, y, a, b, factor), *_integral(measure, x, y, b, a, factor))

    def own(measure: Measure) -> tuple[KronSum, ...]:
        return (
            _integral(measure, x, y, (2, 0), (2, 0)),
            _integral(measure, x, y, (0, 2), (0, 2)),
            both(measure, (2, 0), (0, 2)),
            _integral(measure, x, y, (1, 1), (1, 1)),
            both(measure, (2, 0), (1, 1), 2.0),
            both(measure, (0, 2), (1, 1), 2.0),
        )

    made = [own(measure) for measure in measures]
    return tuple(made[k][term] for term, k in layout(stiffness, {"bending": len(measures)}))


def thin_masses(x: Line, y: Line, fabric: Fabric = UNIFORM) -> tuple[KronSum, ...]:
    """The board's own mass, once for each field that it takes."""
    return tuple(_integral(measure, x, y, (0, 0), (0, 0)) for measure in fabric.measures("mass", x, y))


def _integral(measure: Measure, x: Line, y: Line, a: Beams, b: Beams, factor: float = 1.0) -> KronSum:
    """Integral of one derivative of the deflection (orders along x and y; rows) times another (columns)."""
    return tuple(
        (factor * along_x[a[0], b[0]][x.kept][:, x.kept], along_y[a[1], b[1]][y.kept][:, y.kept])
        for along_x, along_y in measure
    )


def assemble(
    x: Line, y: Line, stiffness: Sequence[Term], masses: Sequence[KronSum], projected: Sequence[Projection] = ()
) -> PlateMatrices:
    """A thin plate from any terms, class by class.

    Parameters
    ----------
    x, y : Line
        Unsplit along a side on which a term is not symmetric.
    stiffness : sequence of Term
    masses : sequence of KronSum
        The first is the board's own.
    projected : sequence of Projection
        Further mass terms.

    Returns
    -------
    PlateMatrices
    """
    blocks = []
    terms = [*(term.on_slopes(x, y) if isinstance(term, EdgeTurn) else term for term in stiffness), *masses]
    for i, part_x in enumerate(x.parts):
        for j, part_y in enumerate(y.parts):
            matrices = [kron_sum(term, part_x, part_y) for term in terms]
            stored, indices, indptr = on_one_pattern(matrices)
            n = len(stiffness)
            parity = Parity(i, j)
            on_deflections = tuple(partial(term, x, y) for term in projected)
            rigid = count_rigid(parity, x, y)
            blocks.append(Block(parity, stored[:n], stored[n:], indices, indptr, part_x, part_y, rigid, on_deflections))
    return PlateMatrices(x, y, tuple(blocks))


def kron_sum(term: KronSum, part_x: Any, part_y: Any) -> Any:
    """A term on the functions of one class, as a sparse matrix."""
    from scipy.sparse import kron

    return sum(kron(part_x.T @ along_x @ part_x, part_y.T @ along_y @ part_y) for along_x, along_y in term)
