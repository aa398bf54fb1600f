"""Polynomials and Gauss points of a rectangle: deflection, rotations and strains of every unknown at any point.

Thin: one polynomial field, the deflection w. Shear-flexible: three, w and the rotations psi_x and psi_y of the normal
(not shear strains); the rotations contain grad w of every admissible thin plate, so nothing locks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import ritz
import scipy.linalg
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Counts = tuple[int, int]
Term = tuple[float, int, int, int]
"""A factor, a field, and the orders of its derivative along x and along y."""

_POWER = {0: "free", 1: "supported", 2: "clamped"}
"""Names of `ritz.Side` for the powers of its boundary factors."""


@dataclass(frozen=True)
class Line:
    """Polynomials along one side; level ends, m, are those where the slope but not the value is held."""

    side: ritz.Side
    level: tuple[float, ...] = ()

    @cached_property
    def _kept(self) -> Floats:
        """Combinations of the side's polynomials with no slope at the level ends."""
        return scipy.linalg.null_space(self.side.values(np.array(self.level), 1)) if self.level else np.eye(self.side.n)

    @property
    def count(self) -> int:
        """Number of polynomials."""
        return self.side.n - len(self.level)

    def values(self, points: Floats, derivative: int = 0) -> Floats:
        """A derivative of every polynomial at points, m, each computed once: (n_points, count) array."""
        once, back = np.unique(points, return_inverse=True)
        return (self.side.values(once, derivative) @ self._kept)[back]


@dataclass(frozen=True)
class Basis:
    """Products of orthonormal polynomials that keep what the edges hold rigidly.

    Attributes
    ----------
    L_x, L_y : float, m
    held : four of (bool, bool)
        Deflection and normal rotation held at x0, x1, y0, y1.
    n : (int, int)
        Polynomials along x and along y.
    shear : bool
        Three fields instead of one.
    """

    L_x: float
    L_y: float
    held: tuple[tuple[bool, bool], ...]
    n: Counts
    shear: bool

    @cached_property
    def _fields(self) -> list[tuple[Line, Line]]:
        """Lines along x and y of w, and of psi_x and psi_y if the plate is shear-flexible."""
        deflection = [int(w) for w, _ in self.held]
        normal = [int(slope) for _, slope in self.held]
        if not self.shear:
            powers = [w * (1 + slope) for w, slope in self.held]
            return [self._lines(powers, [slope and not w for w, slope in self.held])]
        psi_x = normal[:2] + deflection[2:]  # along an edge the rotation is held where the deflection is
        psi_y = deflection[:2] + normal[2:]
        return [self._lines(powers, [False] * 4) for powers in (deflection, psi_x, psi_y)]

    def _lines(self, powers: Sequence[int], level: Sequence[bool]) -> tuple[Line, Line]:
        lines = []
        for axis, length in enumerate((self.L_x, self.L_y)):
            both = slice(2 * axis, 2 * axis + 2)
            low, high = (_POWER[power] for power in powers[both])
            at = tuple(end for end, is_level in zip((0.0, length), level[both], strict=True) if is_level)
            lines.append(Line(ritz.Side((low, high), length, self.n[axis]), at))
        return lines[0], lines[1]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self._fields) * self.n_products

    @property
    def n_products(self) -> int:
        """Number of unknowns of one field."""
        along_x, along_y = self._fields[0]
        return along_x.count * along_y.count

    def _row(self, which: int, i: int, j: int, x: Floats, y: Floats) -> Floats:
        along_x, along_y = self._fields[which]
        at_x, at_y = along_x.values(x, i), along_y.values(y, j)
        row = np.zeros((len(x), self.size))
        block = slice(which * self.n_products, (which + 1) * self.n_products)
        row[:, block] = (at_x[:, :, None] * at_y[:, None, :]).reshape(len(x), -1)
        return row

    def deflection(self, x: Floats, y: Floats, i: int = 0, j: int = 0) -> Floats:
        """The derivative d^(i+j) w / dx^i dy^j of every unknown at points, m: (n_points, size) array."""
        return self._row(0, i, j, np.asarray(x, dtype=float), np.asarray(y, dtype=float))

    def rotation(self, axis: int, x: Floats, y: Floats, i: int = 0, j: int = 0) -> Floats:
        """The same of the rotation of the normal in the plane of x (axis 0) or y (axis 1): psi, or grad w if thin."""
        x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        return self._row(1 + axis, i, j, x, y) if self.shear else self._row(0, i + (axis == 0), j + (axis == 1), x, y)

    def strains(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Curvatures and twist (3, n_points, size), and shear strains (2, n_points, size; of zero points if thin)."""
        r = self.rotation
        bent = np.stack([r(0, x, y, 1, 0), r(1, x, y, 0, 1), r(0, x, y, 0, 1) + r(1, x, y, 1, 0)])
        if not self.shear:
            return bent, np.zeros((2, 0, self.size))
        w = self.deflection
        return bent, np.stack([w(x, y, 1, 0) - r(0, x, y), w(x, y, 0, 1) - r(1, x, y)])

    @cached_property
    def points(self) -> tuple[Floats, Floats, Floats]:
        """Gauss points x and y, m, and weights, m^2, of the rectangle, flattened; exact for a cubic weight."""
        (s, along), (t, across) = gauss(self.n[0]), gauss(self.n[1])
        x, y = np.meshgrid(0.5 * self.L_x * (1.0 + s), 0.5 * self.L_y * (1.0 + t), indexing="ij")
        return x.ravel(), y.ravel(), 0.25 * self.L_x * self.L_y * np.outer(along, across).ravel()

    @cached_property
    def rows(self) -> tuple[Floats, Floats, Floats]:
        """Strains, shear strains and (w, psi_x, psi_y) at the points of the rectangle."""
        return self.rows_at(*self.points[:2])

    def rows_at(self, x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
        """Strains, shear strains and motions (w; with shear also psi_x, psi_y) at points."""
        motions = [self.deflection(x, y)]
        if self.shear:
            motions += [self.rotation(0, x, y), self.rotation(1, x, y)]
        return (*self.strains(x, y), np.stack(motions))

    @cached_property
    def unit_matrices(self) -> tuple[dict[tuple[int, int], Floats], dict[tuple[int, int], Floats], list[Floats]]:
        """Matrices of uniform unit stiffnesses, bending and shear, and of the motions' unit masses."""
        w: list[Term] = [(1.0, 0, 0, 0)]
        bent = [self._turned(0, 1, 0), self._turned(1, 0, 1), [*self._turned(0, 0, 1), *self._turned(1, 1, 0)]]
        sheared, motions = [], [w]
        if self.shear:
            motions += [self._turned(0), self._turned(1)]
            sheared = [[(1.0, 0, 1, 0), (-1.0, 1, 0, 0)], [(1.0, 0, 0, 1), (-1.0, 2, 0, 0)]]
        pairs = [
            {(a, b): self._integral(rows[a], rows[b]) for a in range(len(rows)) for b in range(a, len(rows))}
            for rows in (bent, sheared)
        ]
        return pairs[0], pairs[1], [self._integral(motion, motion) for motion in motions]

    def _turned(self, axis: int, i: int = 0, j: int = 0) -> list[Term]:
        """A derivative of the rotation of the normal: its own field, or that of grad w if thin."""
        return [(1.0, 1 + axis, i, j)] if self.shear else [(1.0, 0, i + (axis == 0), j + (axis == 1))]

    def _integral(self, first: Sequence[Term], second: Sequence[Term]) -> Floats:
        """The integral of a product over the rectangle, which separates into x and y; symmetric."""
        matrix = np.zeros((self.size, self.size))
        for factor, p, *orders in first:
            for other, q, *others in second:
                along_x, along_y = (self._gram(axis, p, orders[axis], q, others[axis]) for axis in (0, 1))
                rows, columns = (slice(f * self.n_products, (f + 1) * self.n_products) for f in (p, q))
                matrix[rows, columns] += factor * other * np.kron(along_x, along_y)
        return 0.5 * (matrix + matrix.T)

    def _gram(self, axis: int, p: int, order: int, q: int, other: int) -> Floats:
        """Integrals along a side of products of derivatives of the functions of two fields."""
        points, weights = gauss(self.n[axis])
        length = (self.L_x, self.L_y)[axis]
        at = 0.5 * length * (1.0 + points)
        left, right = self._fields[p][axis].values(at, order), self._fields[q][axis].values(at, other)
        return 0.5 * length * left.T @ (weights[:, None] * right)


def gauss(n: int) -> tuple[Floats, Floats]:
    """Gauss points and weights on [-1, 1], exact for a product of two of n polynomials and a cubic weight."""
    return np.polynomial.legendre.leggauss(n + 6)


def symmetric(a: Floats, b: Floats, weights: Floats) -> Floats:
    """The matrix of the quadratic form: integral of a b, symmetric."""
    product = a.T @ (weights[:, None] * b)
    return product if a is b else 0.5 * (product + product.T)


def edge_points(basis: Basis, edge: str) -> tuple[Floats, Floats, Floats]:
    """Gauss points x and y, m, along an edge and their weights, m."""
    t, weights = gauss(basis.n[1] if edge[0] == "x" else basis.n[0])
    length = basis.L_y if edge[0] == "x" else basis.L_x
    along, at = 0.5 * length * (1.0 + t), {"x0": 0.0, "x1": basis.L_x, "y0": 0.0, "y1": basis.L_y}[edge]
    across = np.full_like(along, at)
    x, y = (across, along) if edge[0] == "x" else (along, across)
    return x, y, 0.5 * length * weights
