"""The terms of a plate: integrals over it or along its edges, products at places, or projections on given deflections.

A term is a form: the product of two strains, which are derivatives of the deflection or of a shear strain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.plate.fields import Outline, TermGroup, weights_within
from bayesplate.plate.line import Line

Theory = Literal["thin", "shear-flexible"]


class Weights(NamedTuple):
    """Weights of the stiffness terms, s^-2, and of the mass terms, as fractions of the board's mass.

    Arrays of (n_terms,) and (n_masses,), or of (n_draws, n_terms) and (n_draws, n_masses).
    """

    stiffness: Floats
    mass: Floats

    def at(self, draw: int) -> Weights:
        return Weights(self.stiffness[draw], self.mass[draw])


class Parity(NamedTuple):
    """Class of functions: 0 even, 1 odd along each side; 0 where the two ends differ and there is no such class."""

    x: int
    y: int


class Derivative(NamedTuple):
    """A field of unknowns, differentiated so many times along x and along y, times a factor."""

    factor: float
    field: str
    along_x: int
    along_y: int


Strain = tuple[Derivative, ...]
"""A strain or a motion: a sum of derivatives."""

StrainPair = tuple[str, str]
"""Names of two strains whose product is integrated: twice where they differ, so that the form is symmetric."""


class Kinematics(NamedTuple):
    """How a plate deforms."""

    fields: tuple[str, ...]  # unknowns: the deflection "w", then the shear strains if there are any
    strains: Mapping[str, Strain]  # "turn_x" and "turn_y" are how the cross-sections turn
    stiffnesses: tuple[StrainPair, ...]  # of the plate's own terms, those that a turned grain adds last
    masses: tuple[StrainPair, ...]
    groups_of_stiffnesses: tuple[TermGroup, ...]
    turned_groups: tuple[TermGroup, ...]  # of the stiffnesses where the grain runs at an angle
    groups_of_masses: tuple[TermGroup, ...]

    def groups(self, is_turned: bool) -> tuple[tuple[TermGroup, ...], tuple[TermGroup, ...]]:
        """Group of each stiffness and of each mass term that is the plate's own."""
        return self.turned_groups if is_turned else self.groups_of_stiffnesses, self.groups_of_masses


@dataclass(frozen=True)
class PlateTerm:
    """A term: two strains, integrated over the plate or its part within an outline."""

    strains: StrainPair
    outline: Outline | None = None


@dataclass(frozen=True)
class EdgeTerm:
    """A term: the square of a strain, integrated along the selected edges of x0 and x1 (axis 0) or of y0 and y1."""

    axis: int
    at: tuple[bool, bool]
    strain: str


class PointMotion(NamedTuple):
    """A sum of deflections at places (factor, x, y); or a coordinate beside the plate, such as a magnet's rise."""

    places: tuple[tuple[float, float, float], ...] = ()
    coordinate: int = -1


@dataclass(frozen=True)
class PointTerm:
    """A term: products of two point motions, each with its factor."""

    products: tuple[tuple[float, PointMotion, PointMotion], ...]

    @property
    def is_on_plate(self) -> bool:
        return self.n_coordinates == 0

    @property
    def n_coordinates(self) -> int:
        return 1 + max(motion.coordinate for _, *motions in self.products for motion in motions)


@dataclass(frozen=True)
class ProjectedTerms:
    """Terms that can only be projected on given deflections, because they couple the whole plate."""

    project: Callable[[Deflections], Floats]  # to (n_terms, n_vectors, n_vectors) matrices
    n_terms: int = 1


Term = PlateTerm | EdgeTerm | PointTerm | ProjectedTerms


@dataclass(frozen=True, eq=False)
class Deflections:
    """Deflections of one symmetry class as functions on the plate."""

    x: Line
    y: Line
    parity: Parity
    coefficients: Floats  # (n_vectors, n_functions_x, n_functions_y)

    def on(self, x: Floats, y: Floats) -> Floats:
        """Values on a lattice, x and y fractions of the sides: (n_vectors, n_x, n_y) array."""
        along_x, along_y = self.x.shapes(x, self.parity.x).toarray(), self.y.shapes(y, self.parity.y).toarray()
        return np.asarray(along_x @ self.coefficients @ along_y.T)

    def across(self, x: Floats, y: Floats) -> Floats:
        """Values at points x, (n_x,), and y, (n_x, n_y), which differ with x: (n_vectors, n_x, n_y) array."""
        along_x = self.x.shapes(x, self.parity.x).toarray()
        along_y = self.y.shapes(y.ravel(), self.parity.y).toarray().reshape(*y.shape, -1)
        return np.einsum("xi,nij,xyj->nxy", along_x, self.coefficients, along_y, optimize=True)

    def integrals(self, outline: Outline | None) -> Floats:
        """Integrals over the plate, or its part within an outline: (n_vectors,) array; zero where they are odd."""
        if any(self.parity[axis] and side.is_split for axis, side in enumerate((self.x, self.y))):
            return np.zeros(len(self.coefficients))
        grid = self.x.derivatives[0] @ self.coefficients @ self.y.derivatives[0].T
        return np.asarray(np.einsum("nxy,xy->n", grid, weights_within(self.x, self.y, outline)))
