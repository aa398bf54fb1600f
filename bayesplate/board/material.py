"""Elastic moduli and rigidities of a plate, which of them are free, and the wave speeds makers derive from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayesplate.arrays import Floats

RIGIDITIES = ("D_x", "D_y", "D_s")
MODULI = ("E_x", "E_y", "G_xy")


class Rigidities(NamedTuple):
    """D_x, D_y, D_s: arrays of one shape, N m."""

    D_x: NDArray[np.float64]
    D_y: NDArray[np.float64]
    D_s: NDArray[np.float64]


class Moduli(NamedTuple):
    """E_x, E_y, G_xy: arrays of one shape, Pa."""

    E_x: NDArray[np.float64]
    E_y: NDArray[np.float64]
    G_xy: NDArray[np.float64]


@dataclass(frozen=True)
class Symmetry:
    """Which rigidities of a material are free, and how the others follow them.

    A fit moves the logarithms of the free rigidities. Those of D_x, D_y, D_s follow them at slopes of one or zero, with
    offsets that depend on nu_xy alone, so that they follow an uncertain nu_xy draw by draw.
    """

    free: tuple[str, ...]
    moduli: tuple[str, ...]  # by which each free rigidity is reported
    follows: tuple[int, ...]  # the free rigidity that each of D_x, D_y, D_s is proportional to

    @property
    def n(self) -> int:
        """Number of free rigidities: the constants of a fit."""
        return len(self.free)

    @property
    def is_isotropic(self) -> bool:
        """Whether the material is the same in all directions."""
        return self.n == 1

    def rigidities(self, free: Sequence[Floats] | Floats, nu_xy: Floats) -> dict[str, Floats]:
        """D_x, D_y, D_s by name from the free rigidities: n arrays, N m."""
        by_name = {name: free[i] for name, i in zip(RIGIDITIES, self.follows, strict=True)}
        if self.is_isotropic:
            by_name["D_s"] = np.asarray(2.0 * (1.0 - nu_xy) * by_name["D_s"])
        return by_name

    def free_of(self, values: Mapping[str, Floats]) -> Floats:
        """The free rigidities of one plate, N m: (n,) array from D_x, D_y, D_s by name."""
        return np.array([float(values[RIGIDITIES[self.follows.index(i)]]) for i in range(self.n)])

    def columns(self, nu_xy: Floats) -> Floats:
        """The matrix that takes the free rigidities to (D_x, D_y, D_s): (3, n) array."""
        return np.array([list(self.rigidities(unit, nu_xy).values()) for unit in np.eye(self.n)]).T

    def along(self, by_rigidity: Floats) -> Floats:
        """Slopes by the logarithms of the free rigidities from those by ln D_x, D_y, D_s: (..., n) from (..., 3)."""
        return by_rigidity if not self.is_isotropic else by_rigidity.sum(axis=-1, keepdims=True)


ORTHOTROPIC = Symmetry(RIGIDITIES, MODULI, (0, 1, 2))
"""E_x, E_y and G_xy are three constants: wood, fibre composites."""

ISOTROPIC = Symmetry(("D",), ("E",), (0, 0, 0))
"""E_x = E_y = E and G_xy = E / (2 (1 + nu)), so that D_s = 2 (1 - nu) D: metal, glass, foam, MDF."""


def rigidities(E_x: ArrayLike, E_y: ArrayLike, G_xy: ArrayLike, thickness: ArrayLike, nu_xy: ArrayLike) -> Rigidities:
    """Rigidities, N m, from moduli in Pa and a thickness in m: Ducceschi et al., eq. (3) and (4).

    Not a number where nu_xy nu_yx >= 1, nu_yx = nu_xy E_y / E_x, which no material reaches.
    """
    E_x, E_y, G_xy, h = (np.asarray(v, dtype=float) for v in (E_x, E_y, G_xy, thickness))
    remainder = 1.0 - np.asarray(nu_xy) ** 2 * E_y / E_x
    factor = h**3 / (12.0 * np.where(remainder > 0, remainder, np.nan))
    return Rigidities(E_x * factor, E_y * factor, np.asarray(G_xy * h**3 / 3.0))


def moduli(D_x: ArrayLike, D_y: ArrayLike, D_s: ArrayLike, thickness: ArrayLike, nu_xy: ArrayLike) -> Moduli:
    """Moduli, Pa, from rigidities in N m and a thickness in m: Ducceschi et al., eq. (14), the inverse of `rigidities`.

    The map of (ln D_x, ln D_y, ln D_s) to (ln E_x, ln E_y, ln G_xy) at fixed thickness and nu_xy has determinant 1,
    so that a density of one set of logarithms is a density of the other.
    """
    D_x, D_y, D_s, h = (np.asarray(v, dtype=float) for v in (D_x, D_y, D_s, thickness))
    remainder = 1.0 - np.asarray(nu_xy) ** 2 * D_y / D_x
    factor = 12.0 * np.where(remainder > 0, remainder, np.nan) / h**3
    return Moduli(D_x * factor, D_y * factor, np.asarray(3.0 * D_s / h**3))


def moduli_of(values: Mapping[str, Floats]) -> Moduli:
    """Moduli of a plate, Pa, from its rigidities, thickness and nu_xy by name."""
    return moduli(*(values[name] for name in (*RIGIDITIES, "thickness", "poisson_xy")))


def isotropic_moduli(E: ArrayLike, nu: ArrayLike) -> Moduli:
    """Moduli of an isotropic material from its E, Pa, and its Poisson ratio."""
    E = np.asarray(E, dtype=float)
    return Moduli(E, E, np.asarray(E / (2.0 * (1.0 + np.asarray(nu)))))


class DerivedQuantity(NamedTuple):
    """A quantity that makers use, its values and its unit."""

    values: NDArray[np.float64]
    unit: str


def derived_quantities(constants: Moduli, density: ArrayLike) -> dict[str, DerivedQuantity]:
    """Wave speeds, radiation ratios, impedances, specific stiffnesses along x and y, and ratios; density in kg/m^3."""
    rho = np.asarray(density, dtype=float)
    result = {}
    for axis, modulus in (("x", constants.E_x), ("y", constants.E_y)):
        speed = np.sqrt(modulus / rho)
        result[f"wave_speed_{axis}"] = DerivedQuantity(speed, "m/s")
        result[f"radiation_ratio_{axis}"] = DerivedQuantity(speed / rho, "m^4/(kg s)")
        result[f"impedance_{axis}"] = DerivedQuantity(speed * rho, "kg/(m^2 s)")
        result[f"specific_stiffness_{axis}"] = DerivedQuantity(modulus / rho, "m^2/s^2")
    result["anisotropy"] = DerivedQuantity(constants.E_x / constants.E_y, "1")
    result["E_x_over_G_xy"] = DerivedQuantity(constants.E_x / constants.G_xy, "1")
    result["density"] = DerivedQuantity(rho + 0.0 * constants.E_x, "kg/m^3")
    return result
