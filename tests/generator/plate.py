"""A rectangular orthotropic plate, thin or shear-flexible, on its edges and springs: matrices and modes.

Everything is integrated by the generator's own Gauss points, so that any property may vary over the plate. SI units.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np
import scipy.linalg

from generator.basis import Basis, Counts, Floats
from generator.outline import Outline, outline_points
from generator.rider import Rider
from generator.spring import Spring, spring_matrix

Profile = Callable[[Floats, Floats], Floats]
"""A factor over the board as a function of x and y, m, counted on the whole board."""

EDGES = ("x0", "x1", "y0", "y1")
SHEAR_FACTOR = 5.0 / 6.0
N_POLYNOMIALS: Counts = (16, 14)
N_POLYNOMIALS_SHEAR: Counts = (14, 20)
FINE_SHEAR: Counts = (20, 22)
"""Polynomials along x and along y. With shear, twist ends in a thin layer at free edges: there the first leave up to
1.3 cents in modes that twist, the fine ones a tenth."""


@dataclass(frozen=True)
class Plate:
    """The vibrating part of a board.

    Attributes
    ----------
    E_x, E_y, G_xy : float, Pa
        Along and across the grain.
    nu_xy : float
    rho, h : float, kg m^-3 and m
    L_x, L_y : float, m
        Sides of the vibrating part.
    edges : mapping
        "clamped", "supported" or "free" for each of x0, x1, y0, y1.
    shear : (float, float), Pa, or None
        G_xz and G_yz of a shear-flexible plate with rotary inertia; None is thin.
    grain : float, rad
        Angle from the side x to the grain.
    springs : mapping
        Edge -> Spring, for clamped edges that give way.
    covered : float, m
        What a clamp covers before x = 0 of the vibrating part; profiles and places count it.
    whole : float, m
        Length of the whole board along x; 0: that of the vibrating part.
    thickness, density, stiffness_x : tuple of Profile
        Factors on h, on rho, and on E_x.
    outline : Outline
        Empty: a rectangle.
    """

    E_x: float
    E_y: float
    G_xy: float
    nu_xy: float
    rho: float
    h: float
    L_x: float
    L_y: float
    edges: Mapping[str, str]
    shear: tuple[float, float] | None = None
    grain: float = 0.0
    springs: Mapping[str, Spring] = field(default_factory=dict)
    covered: float = 0.0
    whole: float = 0.0
    thickness: tuple[Profile, ...] = ()
    density: tuple[Profile, ...] = ()
    stiffness_x: tuple[Profile, ...] = ()
    outline: Outline = ()

    @classmethod
    def isotropic(
        cls, E: float, nu: float, rho: float, h: float, L_x: float, L_y: float, edges: Mapping[str, str]
    ) -> Plate:
        """A thin plate of metal, glass or foam: one modulus, Pa, and a Poisson ratio."""
        return cls(E, E, 0.5 * E / (1.0 + nu), nu, rho, h, L_x, L_y, edges)

    @property
    def whole_length(self) -> float:
        """Length of the whole board along x, m."""
        return self.whole or self.L_x

    @property
    def D_x(self) -> float:
        """Bending rigidity along the grain, N m."""
        return self.in_plane[0, 0] * self.h**3 / 12.0

    @property
    def D_y(self) -> float:
        """Bending rigidity across the grain, N m."""
        return self.in_plane[1, 1] * self.h**3 / 12.0

    @property
    def in_plane(self) -> Floats:
        """Plane-stress stiffness in the axes of the grain: (3, 3) array, Pa."""
        reduced = 1.0 - self.nu_xy**2 * self.E_y / self.E_x
        mixed = self.nu_xy * self.E_y / reduced
        return np.array([[self.E_x / reduced, mixed, 0.0], [mixed, self.E_y / reduced, 0.0], [0.0, 0.0, self.G_xy]])

    @property
    def held(self) -> tuple[tuple[bool, bool], ...]:
        """Whether the basis itself holds deflection and normal rotation at x0, x1, y0, y1."""
        return tuple(_held(self.edges[edge], self.springs.get(edge)) for edge in EDGES)

    def basis(self, n: Counts | None = None) -> Basis:
        """Its polynomials; plates of the same sides, edges and theory share them."""
        n = n or (N_POLYNOMIALS_SHEAR if self.shear else N_POLYNOMIALS)
        return _basis(self.L_x, self.L_y, self.held, n, self.shear is not None)


def _held(word: str, spring: Spring | None) -> tuple[bool, bool]:
    if word != "clamped" or spring is None:
        return word != "free", word == "clamped"
    return np.isinf(spring.translation), np.isinf(spring.rotation)


@lru_cache(maxsize=64)
def _basis(L_x: float, L_y: float, held: tuple[tuple[bool, bool], ...], n: Counts, shear: bool) -> Basis:
    return Basis(L_x, L_y, held, n, shear)


def rotated(in_plane: Floats, angle: float) -> Floats:
    """Plane-stress stiffness of a material turned by an angle, rad: Q11 .. Q66 with Q16 and Q26, (3, 3) array."""
    c, s = np.cos(angle), np.sin(angle)
    to_grain = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]])
    return to_grain.T @ in_plane @ to_grain


def matrices(plate: Plate, basis: Basis) -> tuple[Floats, Floats]:
    """Stiffness and mass of a plate with its springs: two (size, size) arrays.

    Twice the energies: strain energy of curvatures (psi_x,x  psi_y,y  psi_x,y + psi_y,x) and of the shear strains
    grad w - psi, and kinetic energy at unit frequency.
    """
    if plate.thickness or plate.density or plate.stiffness_x or plate.outline:
        stiffness, mass = _varying(plate, basis)
    else:
        stiffness, mass = _uniform(plate, basis)
    for edge, spring in plate.springs.items():
        stiffness = stiffness + spring_matrix(basis, edge, spring)
    return stiffness, mass


def _rigidities(plate: Plate) -> tuple[Floats, Floats]:
    """Bending (3, 3), N m, and shear (2, 2), N m^-1, stiffness in the axes of the sides."""
    c, s = np.cos(plate.grain), np.sin(plate.grain)
    turn = np.array([[c, s], [-s, c]])
    shear = np.diag(plate.shear or (0.0, 0.0)) * SHEAR_FACTOR * plate.h
    return rotated(plate.in_plane, plate.grain) * plate.h**3 / 12.0, turn.T @ shear @ turn


def _uniform(plate: Plate, basis: Basis) -> tuple[Floats, Floats]:
    bent, sheared, motions = basis.unit_matrices
    rigidity, shear = _rigidities(plate)
    stiffness = sum((2.0 - (a == b)) * rigidity[a, b] * matrix for (a, b), matrix in bent.items())
    stiffness = stiffness + sum((2.0 - (a == b)) * shear[a, b] * matrix for (a, b), matrix in sheared.items())
    inertia = plate.rho * plate.h
    return stiffness, inertia * motions[0] + inertia * plate.h**2 / 12.0 * sum(motions[1:])


def points_of(plate: Plate, basis: Basis) -> tuple[Floats, Floats, Floats]:
    """Gauss points x and y, m, and weights, m^2, of the plate within its outline."""
    return outline_points(basis, plate.outline, plate.covered) if plate.outline else basis.points


def in_plane_stiffness(plate: Plate, x: Floats, y: Floats) -> Floats:
    """Stiffness against stretching at points, in the axes of the sides: (3, 3, n_points) array, N m^-1."""
    thick, stiff = (_product(p, x + plate.covered, y) for p in (plate.thickness, plate.stiffness_x))
    local = [rotated(replace(plate, E_x=plate.E_x * f).in_plane, plate.grain) for f in stiff]
    return np.stack(local, axis=-1) * plate.h * thick


def _varying(plate: Plate, basis: Basis) -> tuple[Floats, Floats]:
    x, y, weights = points_of(plate, basis)
    bent, sheared, motions = basis.rows_at(x, y) if plate.outline else basis.rows
    thick, dense, stiff = (
        _product(p, x + plate.covered, y) for p in (plate.thickness, plate.density, plate.stiffness_x)
    )
    rigidity, shear = _rigidities(plate)
    local = rigidity[:, :, None] * thick**3  # (3, 3, n_points)
    if plate.stiffness_x:  # E_x alone varies; E_y, G_xy and nu_xy stay
        local = np.stack([_rigidities(replace(plate, E_x=plate.E_x * f))[0] for f in stiff], axis=-1) * thick**3
    stiffness = sum(bent[a].T @ sum((weights * local[a, b])[:, None] * bent[b] for b in range(3)) for a in range(3))
    if basis.shear:
        weighted = weights * thick
        stiffness = stiffness + sum(
            shear[a, b] * (sheared[a].T @ (weighted[:, None] * sheared[b])) for a in range(2) for b in range(2)
        )
    inertia = plate.rho * plate.h * weights * thick * dense
    mass = motions[0].T @ (inertia[:, None] * motions[0])
    for motion in motions[1:]:
        mass += motion.T @ ((inertia * (plate.h * thick) ** 2 / 12.0)[:, None] * motion)
    return 0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T)


def _product(profiles: Sequence[Profile], x: Floats, y: Floats) -> Floats:
    factor = np.ones_like(x)
    for profile in profiles:
        factor = factor * profile(x, y)
    return factor


class Effect(Protocol):
    """What a real board has besides: a changed plate, matrices to add, or bodies that ride on it."""

    def changed(self, plate: Plate) -> Plate:
        """The plate with this effect in its constants, edges or profiles."""

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        """Stiffness and mass with this effect."""

    def riders(self, plate: Plate, basis: Basis) -> tuple[Rider, ...]:
        """Bodies that this effect hangs on the board."""


@dataclass(frozen=True)
class Modes:
    """Lowest motions of a plate, rigid ones and those of bodies that ride on it included.

    Attributes
    ----------
    frequencies : (n_modes,) array, Hz
    vectors : (size, n_modes) array
        Coefficients in the basis, of unit modal mass.
    basis : Basis
    shares : (n_modes,) array
        Share of the kinetic energy that is not in bodies riding on the board; 1 where there are none.
    """

    frequencies: Floats
    vectors: Floats
    basis: Basis
    shares: Floats

    @cached_property
    def deflections(self) -> Floats:
        """Deflection at the basis's Gauss points: (n_points, n_modes) array."""
        return self.basis.deflection(*self.basis.points[:2]) @ self.vectors


def solve(plate: Plate, effects: Sequence[Effect] = (), n_modes: int = 24, n: Counts | None = None) -> Modes:
    """Lowest modes of a plate with effects, rigid motions counted; n: polynomials along x and along y."""
    for effect in effects:
        plate = effect.changed(plate)
    basis = plate.basis(n)
    stiffness, mass = matrices(plate, basis)
    for effect in effects:
        stiffness, mass = effect.added(plate, basis, stiffness, mass)
    riders = [rider for effect in effects for rider in effect.riders(plate, basis)]
    for rider in riders:
        stiffness, mass = rider.joined(stiffness, mass)
    squares, vectors = scipy.linalg.eigh(stiffness, mass, subset_by_index=[0, n_modes - 1], check_finite=False)
    ridden = sum((rider.mass * vectors[basis.size + k] ** 2 for k, rider in enumerate(riders)), np.zeros(n_modes))
    frequencies = np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi)
    return Modes(frequencies, vectors[: basis.size], basis, 1.0 - ridden)
