"""One side of the plate: Hermite line elements on the unit interval, with its two ends held or free.

The plate's matrices are Kronecker products of these (`plate.py`); the eigenvectors of a line are the beam functions
that name the modes (`naming.py`). Everything is non-dimensional: lengths enter later, as scalings of the stiffness
terms.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.element import Products, function_values
from bayesplate.modes.hermite import (
    Holds,
    end_products,
    even_and_odd,
    graded_nodes,
    kept_unknowns,
    products,
    values_held,
)
from bayesplate.plate.setup import Ends

N_BEAMS = 16


@dataclass(frozen=True, eq=False)
class Line:
    """Matrices of one line of cubic Hermite elements on [0, 1], held ends already removed.

    Attributes
    ----------
    ends : tuple of str
        Condition at 0 and at 1: "clamped", "supported" or "free". They name the modes and tell the rigid motions.
    held : tuple of str
        What the functions themselves hold there: the same, or less where an effect has put springs in place of a clamp.
    nodes : (n_elements + 1,) array
        Where the elements meet, from 0 to 1, mirrored about the middle where both ends are alike.
    kept : (n_dof,) array of int
        Which unknowns of the free line these are; see `bayesplate.modes.hermite`.
    mass, slope, bending, mixed : (n_dof, n_dof) array
        Integrals of u v, u' v', u'' v'' and of u v'' (row: the second derivative).
    parts : tuple of (n_dof, n_part) sparse array
        Orthonormal bases of the even and the odd functions where both ends are alike, otherwise the identity alone.

    References
    ----------
    Bogner, Fox and Schmit (1965): on a rectangle their element is the product of two Hermite lines.
    """

    ends: Ends
    held: Holds
    nodes: NDArray[np.float64]
    kept: NDArray[np.intp]
    mass: NDArray[np.float64]
    slope: NDArray[np.float64]
    bending: NDArray[np.float64]
    mixed: NDArray[np.float64]
    parts: tuple[Any, ...]

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return self.nodes.size - 1

    @property
    def n_dof(self) -> int:
        """Number of unknowns."""
        return int(self.mass.shape[0])

    @property
    def is_symmetric(self) -> bool:
        """Whether both ends are alike, so that functions split into even and odd ones."""
        return len(self.parts) == 2

    @cached_property
    def beams(self) -> NDArray[np.float64]:
        """Beam functions, lowest first, mass-normalised: (n_dof, n_beams) array; rigid motions come first."""
        from scipy.linalg import eigh

        bent = np.flatnonzero(np.isin(self.kept, kept_unknowns(self.ends, self.n_elements)))
        bending, mass = (matrix[np.ix_(bent, bent)] for matrix in (self.bending, self.mass))
        vectors = np.zeros((self.n_dof, min(N_BEAMS, bent.size)))
        vectors[bent] = eigh(bending, mass, subset_by_index=[0, vectors.shape[1] - 1])[1]
        return self._without_rigid_mixing(vectors)

    @cached_property
    def beam_energies(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Integrals of X''^2, X'^2 and X X'' of the beam functions: three (n_beams,) arrays."""
        bending, slope, mixed = (
            np.einsum("ib,ib->b", self.beams, matrix @ self.beams) for matrix in (self.bending, self.slope, self.mixed)
        )
        return bending, slope, mixed

    def _without_rigid_mixing(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Replace the two degenerate rigid motions of a free line by the shift and the turn about its middle."""
        if self.ends != ("free", "free"):
            return vectors
        shift = self.interpolate(np.ones_like, np.zeros_like)
        turn = self.interpolate(lambda x: np.sqrt(12.0) * (x - 0.5), lambda x: np.full_like(x, np.sqrt(12.0)))
        return np.column_stack([shift, turn, vectors[:, 2:]])

    def interpolate(self, value: Any, derivative: Any) -> NDArray[np.float64]:
        """Coefficients of a function given by its value and derivative on [0, 1]: (n_dof,) array."""
        both = np.empty(2 * self.nodes.size)
        both[0::2], both[1::2] = value(self.nodes), derivative(self.nodes)
        return both[self.kept]

    def shapes(self, points: NDArray[np.float64]) -> Any:
        """Values of the element functions at points of [0, 1]: (n_points, n_dof) sparse array."""
        return function_values(self.nodes, np.asarray(points, dtype=np.float64))[:, self.kept]

    @cached_property
    def integrals(self) -> NDArray[np.float64]:
        """Integral of each function over [0, 1], the load vector of a uniform load: (n_dof,) array."""
        return self.load(products(tuple(self.nodes)))

    def load(self, weighted: Products) -> NDArray[np.float64]:
        """Integral of each function with the weight that the integrals of their products have: (n_dof,) array."""
        # The constant 1 is itself a function of the free line: unit values, no slopes.
        one = np.tile([1.0, 0.0], self.nodes.size)
        return np.asarray(weighted[0, 0][self.kept] @ one)

    def at_ends(self, at: tuple[bool, bool], order: int) -> NDArray[np.float64]:
        """Products of values (order 0) or slopes (1), summed over the ends asked for: (n_dof, n_dof) array."""
        return end_products(self.n_elements, at)[order, order][np.ix_(self.kept, self.kept)]


def rigid_degrees(ends: Ends) -> tuple[int, ...]:
    """Degrees of the rigid motions of a line, in the order of its beam functions.

    A free line can shift (0) and turn (1), a line supported at one end only can turn, others cannot move.
    """
    if ends == ("free", "free"):
        return (0, 1)
    if set(ends) == {"supported", "free"}:
        return (1,)
    return ()


@lru_cache(maxsize=64)
def line(
    ends: Ends, n_elements: int, is_sheared: bool = False, is_split: bool = True, held: Holds | None = None
) -> Line:
    """Assemble a line; the result is shared, so it must not be changed.

    Parameters
    ----------
    ends : tuple of str
        Condition at 0 and at 1.
    n_elements : int
        Number of elements.
    is_sheared : bool
        A line of a shear-flexible plate. Its elements are graded towards free ends, and it keeps the slope at clamped
        ends, where the deflection meets the clamp at the angle of the shear strain. The beam functions stay those of a
        line that only bends.
    is_split : bool
        Whether functions split into even and odd ones where both ends are alike; not so if something else on the plate
        tells the two halves apart.
    held : tuple of str, optional
        What the ends hold where that is less than `ends` says.

    Returns
    -------
    Line
    """
    from scipy.sparse import identity

    held = ends if held is None else held
    nodes = graded_nodes(ends, n_elements) if is_sheared else np.linspace(0.0, 1.0, n_elements + 1)
    kept = kept_unknowns(values_held(held) if is_sheared else held, n_elements)

    def integrals(i: int, j: int) -> NDArray[np.float64]:
        return products(tuple(nodes))[i, j][np.ix_(kept, kept)]

    return Line(
        ends=ends,
        held=held,
        nodes=nodes,
        kept=kept,
        mass=integrals(0, 0),
        slope=integrals(1, 1),
        bending=integrals(2, 2),
        mixed=integrals(2, 0),
        parts=even_and_odd(ends, n_elements, kept) if is_split else (identity(kept.size, format="csr"),),
    )
