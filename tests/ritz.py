"""An independent solver of the thin orthotropic plate: Ritz with boundary factors times Legendre polynomials.

It shares no code and no discretisation with the package, so that boards simulated from it are no inverse crime:
global polynomials in physical units here, piecewise cubics on the unit square there. Another effect is another matrix
added to `Ritz.stiffness` or `Ritz.mass` before `solve`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Edges = Mapping[str, str]
Beams = tuple[int, int]

HELD_DERIVATIVES = {"clamped": 2, "supported": 1, "free": 0}
"""How many of value and slope an end holds: the power of its boundary factor."""

CANTILEVER = {"x0": "clamped", "x1": "free", "y0": "free", "y1": "free"}
ALL_CLAMPED, ALL_SUPPORTED, ALL_FREE = (
    dict.fromkeys(("x0", "x1", "y0", "y1"), end) for end in ("clamped", "supported", "free")
)

N_POLYNOMIALS = 20
N_NAMED = 30
"""How many of the lowest modes are given a name."""

_N_BEAMS = 12


@dataclass(frozen=True)
class Plate:
    """A thin orthotropic plate on its supports; SI units.

    Attributes
    ----------
    D_x, D_y, D_s : float
        Rigidities, N m, as the paper defines them (D_s = G_xy h^3 / 3).
    nu_xy : float
    rho, h : float
        Density, kg m^-3, and thickness, m.
    L_x, L_y : float
        Side lengths, m.
    edges : dict
        "clamped", "supported" or "free" for each of x0, x1, y0, y1.
    """

    D_x: float
    D_y: float
    D_s: float
    nu_xy: float
    rho: float
    h: float
    L_x: float
    L_y: float
    edges: Edges

    @classmethod
    def from_moduli(cls, E_x: float, E_y: float, G_xy: float, nu_xy: float, **board: Any) -> Plate:
        """A plate from its elastic moduli, Pa; the other arguments are those of the class."""
        h = board["h"]
        bending = h**3 / (12.0 * (1.0 - nu_xy**2 * E_y / E_x))
        return cls(E_x * bending, E_y * bending, G_xy * h**3 / 3.0, nu_xy, **board)

    @classmethod
    def isotropic(cls, nu: float, edges: Edges, L_x: float = 1.0, L_y: float = 1.0) -> Plate:
        """A plate of unit rigidity and unit mass per area: its omega are those of the handbooks where L_x = L_y = 1."""
        return cls(1.0, 1.0, 2.0 * (1.0 - nu), nu, 1.0, 1.0, L_x, L_y, edges)

    @property
    def swapped(self) -> Plate:
        """The same plate with x and y exchanged; D_y nu_xy = D_x nu_yx gives the other Poisson ratio."""
        swap = {"x0": "y0", "x1": "y1", "y0": "x0", "y1": "x1"}
        return Plate(
            D_x=self.D_y,
            D_y=self.D_x,
            D_s=self.D_s,
            nu_xy=self.nu_xy * self.D_y / self.D_x,
            rho=self.rho,
            h=self.h,
            L_x=self.L_y,
            L_y=self.L_x,
            edges={swap[edge]: end for edge, end in self.edges.items()},
        )

    @property
    def unit_weights(self) -> Floats:
        """Weights of w_xx^2, w_yy^2, 2 w_xx w_yy and w_xy^2 once sides and mass are scaled to one: (4,) array, s^-2."""
        to_unit = self.rho * self.h
        return np.array(
            [
                self.D_x / (to_unit * self.L_x**4),
                self.D_y / (to_unit * self.L_y**4),
                self.nu_xy * self.D_y / (to_unit * self.L_x**2 * self.L_y**2),
                self.D_s / (to_unit * self.L_x**2 * self.L_y**2),
            ]
        )

    @property
    def ends(self) -> tuple[tuple[str, str], tuple[str, str]]:
        """Conditions at the two ends of each side: (x0, x1) and (y0, y1)."""
        return (self.edges["x0"], self.edges["x1"]), (self.edges["y0"], self.edges["y1"])


FINNISH = Plate.from_moduli(13.0e9, 0.702e9, 0.668e9, 0.51, rho=473.9, h=3e-3, L_x=0.223, L_y=0.114, edges=CANTILEVER)
FIEMME = Plate.from_moduli(10.4e9, 1.003e9, 0.53e9, 0.51, rho=399.0, h=3e-3, L_x=0.600, L_y=0.412, edges=ALL_CLAMPED)
"""The paper's two boards at the constants it prints."""

FREE_SPRUCE = Plate.from_moduli(12.0e9, 0.9e9, 0.75e9, 0.4, rho=429.0, h=4.7e-3, L_x=0.580, L_y=0.217, edges=ALL_FREE)
"""A guitar board hung free: sizes of a measured one, constants of the same order."""


@dataclass(frozen=True)
class Side:
    """Orthonormal polynomials that keep the conditions at the two ends of one side.

    Attributes
    ----------
    ends : tuple of str
    length : float, m
    n : int
        Number of polynomials.
    """

    ends: tuple[str, str]
    length: float
    n: int

    @cached_property
    def _raw(self) -> list[Floats]:
        """Legendre series on [-1, 1]: (1 + t)^i (1 - t)^j P_k(t)."""
        low, high = (HELD_DERIVATIVES[end] for end in self.ends)
        factor = np.ones(1)
        for _ in range(low):
            factor = legendre.legmul(factor, [1.0, 1.0])
        for _ in range(high):
            factor = legendre.legmul(factor, [1.0, -1.0])
        return [legendre.legmul(factor, np.eye(self.n)[k]) for k in range(self.n)]

    @cached_property
    def points(self) -> Floats:
        """Gauss points of the side, m; exact for the product of any two of its polynomials."""
        return 0.5 * self.length * (1.0 + self._gauss[0])

    @cached_property
    def weights(self) -> Floats:
        """Their weights, m."""
        return 0.5 * self.length * self._gauss[1]

    @cached_property
    def _gauss(self) -> tuple[Floats, Floats]:
        return legendre.leggauss(self.n + 4)

    @cached_property
    def _to_orthonormal(self) -> Floats:
        """Inverse triangular factor: orthonormality is what keeps high degrees well conditioned."""
        values = self._raw_values(self.points, 0)
        return np.linalg.inv(np.linalg.qr(np.sqrt(self.weights)[:, None] * values, mode="r"))

    def _raw_values(self, x: Floats, derivative: int) -> Floats:
        t = 2.0 * np.asarray(x, dtype=float) / self.length - 1.0
        chain = (2.0 / self.length) ** derivative
        return chain * np.stack([legendre.legval(t, legendre.legder(c, derivative)) for c in self._raw], axis=-1)

    def values(self, x: Floats, derivative: int = 0) -> Floats:
        """A derivative of every polynomial at points x, m: (n_points, n) array."""
        return self._raw_values(x, derivative) @ self._to_orthonormal

    def integral(self, i: int, j: int) -> Floats:
        """Integrals of the i-th derivative (row) times the j-th (column) over the side: (n, n) array."""
        return self.values(self.points, i).T @ (self.weights[:, None] * self.values(self.points, j))

    @cached_property
    def beams(self) -> Floats:
        """Beam functions in terms of the polynomials, lowest first, rigid shift before rigid turn: (n, n) array."""
        _, vectors = np.linalg.eigh(self.integral(2, 2))
        if self.ends == ("free", "free"):
            vectors[:, :2] = np.eye(self.n)[:, :2]
        return vectors


@dataclass(frozen=True)
class Modes:
    """Elastic modes of a plate in the order of their frequencies.

    Attributes
    ----------
    frequencies : (n_modes,) array, Hz
    shapes : (n_modes, n, n) array
        Coefficients of the products of the two sides' polynomials.
    sides : tuple of Side
        Along x and along y.
    """

    frequencies: Floats
    shapes: Floats
    sides: tuple[Side, Side]

    def shape(self, mode: int, derivatives: Beams = (0, 0)) -> Callable[[Floats, Floats], Floats]:
        """Deflection of a mode, or a derivative of it: a function of x and y, m, giving an (n_x, n_y) grid."""
        along_x, along_y = self.sides
        i, j = derivatives
        return lambda x, y: along_x.values(x, i) @ self.shapes[mode] @ along_y.values(y, j).T

    def names(self) -> list[tuple[Beams, float]]:
        """Product of beam functions that each of the lowest modes resembles, and the correlation.

        Each product is given once: to the best fitting mode, then to the best of what remains, which is another rule
        than the package's.
        """
        along_x, along_y = self.sides
        shapes = self.shapes[:N_NAMED]
        shares = np.einsum("ip,kij,jq->kpq", along_x.beams[:, :_N_BEAMS], shapes, along_y.beams[:, :_N_BEAMS]) ** 2
        shares[:, *np.array(_rigid_products(self.sides), dtype=int).reshape(-1, 2).T] = 0.0
        names: dict[int, tuple[Beams, float]] = {}
        for _ in shapes:
            mode, i, j = (int(k) for k in np.unravel_index(np.argmax(shares), shares.shape))
            names[mode] = ((i, j), float(np.sqrt(shares[mode, i, j])))
            shares[mode], shares[:, i, j] = -1.0, -1.0
        return [names[mode] for mode in range(len(shapes))]


@dataclass(frozen=True)
class Ritz:
    """Matrices of a plate in an orthonormal basis of n x n polynomials.

    Attributes
    ----------
    plate : Plate
    n : int
        Polynomials along each side; above 30 rounding begins to show.
    """

    plate: Plate
    n: int = N_POLYNOMIALS

    @cached_property
    def sides(self) -> tuple[Side, Side]:
        """The sides along x and along y."""
        ends_x, ends_y = self.plate.ends
        return Side(ends_x, self.plate.L_x, self.n), Side(ends_y, self.plate.L_y, self.n)

    def integral(self, row: Beams, column: Beams) -> Floats:
        """Integrals over the plate of one derivative of the basis (row) times another (column): (n^2, n^2) array."""
        along_x, along_y = self.sides
        return np.kron(along_x.integral(row[0], column[0]), along_y.integral(row[1], column[1]))

    @cached_property
    def stiffness(self) -> Floats:
        """Twice the bending energy: the integral of D_x w_xx^2 + D_y w_yy^2 + 2 nu_xy D_y w_xx w_yy + D_s w_xy^2."""
        plate = self.plate
        mixed = self.integral((2, 0), (0, 2))
        return (
            plate.D_x * self.integral((2, 0), (2, 0))
            + plate.D_y * (self.integral((0, 2), (0, 2)) + plate.nu_xy * (mixed + mixed.T))
            + plate.D_s * self.integral((1, 1), (1, 1))
        )

    @cached_property
    def mass(self) -> Floats:
        """Twice the kinetic energy at unit frequency: the integral of rho h w^2, diagonal in this basis."""
        return self.plate.rho * self.plate.h * np.eye(self.n**2)

    @property
    def n_rigid(self) -> int:
        """Number of motions without bending."""
        return len(_rigid_products(self.sides))


def solve(ritz: Ritz, stiffness: Floats | None = None, mass: Floats | None = None) -> Modes:
    """All elastic modes of a plate; only the lower ones mean anything.

    Parameters
    ----------
    ritz : Ritz
    stiffness, mass : (n^2, n^2) array, optional
        In place of the bare plate's, for a plate with an effect.

    Returns
    -------
    Modes
    """
    stiffness = ritz.stiffness if stiffness is None else stiffness
    if mass is None:
        to_basis = np.eye(len(stiffness)) / np.sqrt(ritz.plate.rho * ritz.plate.h)
        values, vectors = np.linalg.eigh(stiffness / (ritz.plate.rho * ritz.plate.h))
    else:
        to_basis = np.linalg.inv(np.linalg.cholesky(mass)).T
        values, vectors = np.linalg.eigh(to_basis.T @ stiffness @ to_basis)
    elastic = slice(ritz.n_rigid, None)
    shapes = (to_basis @ vectors[:, elastic]).T.reshape(-1, ritz.n, ritz.n)
    shapes = shapes / np.linalg.norm(shapes, axis=(1, 2), keepdims=True)
    return Modes(np.sqrt(values[elastic]) / (2.0 * np.pi), shapes, ritz.sides)


def frequencies(plate: Plate, n_modes: int, n: int = N_POLYNOMIALS) -> Floats:
    """Lowest elastic frequencies of a plate: (n_modes,) array, Hz."""
    return solve(Ritz(plate, n)).frequencies[:n_modes]


def simulate(
    plate: Plate,
    labels: Iterable[Beams],
    first_label: Beams = (0, 0),
    n: int = N_POLYNOMIALS,
    modes: Modes | None = None,
) -> dict[Beams, float]:
    """Frequencies of labelled modes, as a laboratory without noise would read them.

    Parameters
    ----------
    plate : Plate
    labels : iterable of (int, int)
        This laboratory's labels.
    first_label : (int, int)
        Its label of the lowest beam indices.
    n : int
        Polynomials along each side.
    modes : Modes, optional
        In place of the bare plate's, for a plate with an effect.

    Returns
    -------
    dict
        Label -> Hz.

    Raises
    ------
    KeyError
        If a label is no mode among the lowest `N_NAMED`.
    """
    modes = solve(Ritz(plate, n)) if modes is None else modes
    found = {
        (i + first_label[0], j + first_label[1]): float(hz)
        for ((i, j), _), hz in zip(modes.names(), modes.frequencies, strict=False)
    }
    return {label: found[label] for label in map(tuple, labels)}


def _rigid_products(sides: tuple[Side, Side]) -> list[Beams]:
    """Products of beam functions that do not bend: shifts and turns, without the twist xy."""
    degrees = [_rigid_degrees(side.ends) for side in sides]
    return [(i, j) for i, p in enumerate(degrees[0]) for j, q in enumerate(degrees[1]) if p + q <= 1]


def _rigid_degrees(ends: tuple[str, str]) -> list[int]:
    """Degrees of the straight lines that keep the conditions at two ends."""
    held = [HELD_DERIVATIVES[end] for end in ends]
    return {0: [0, 1], 1: [1]}.get(sum(held), [])
