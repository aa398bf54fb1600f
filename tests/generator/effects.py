"""What a real board has besides the ideal plate: one small frozen value an effect, SI units, own quadratures.

An effect changes the plate (its constants, edges or profiles) or adds to its stiffness and mass. Places and profiles
are counted on the whole board, parts under a clamp included; profiles keep the mean of the whole board.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from generator.basis import Basis, Floats
from generator.panels import air_mass
from generator.plate import Plate
from generator.rider import Rider
from generator.spring import Spring

Places = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class NoEffect:
    """An effect that does nothing; the others say what they do differently."""

    def variants(self) -> tuple[NoEffect, ...]:
        """The situations over which a laboratory averages its frequencies."""
        return (self,)

    def changed(self, plate: Plate) -> Plate:
        """The plate with this effect in it."""
        return plate

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        """Stiffness and mass with this effect; `plate` has all changes made."""
        return stiffness, mass

    def riders(self, plate: Plate, basis: Basis) -> tuple[Rider, ...]:
        """Bodies that hang on the board by a spring and move by themselves."""
        return ()


@dataclass(frozen=True)
class TransverseShear(NoEffect):
    """Finite shear moduli G_xz and G_yz, Pa, and rotary inertia; absent: those of an isotropic plate, its G_xy."""

    G_xz: float | None = None
    G_yz: float | None = None

    def changed(self, plate: Plate) -> Plate:
        G_xz, G_yz = (plate.G_xy if G is None else G for G in (self.G_xz, self.G_yz))
        return replace(plate, shear=(G_xz, G_yz))


@dataclass(frozen=True)
class FluidLoading(NoEffect):
    """A fluid of a density, kg m^-3, on both faces, air or water; baffle 0 is open, 1 a rigid wall around the plate."""

    density: float = 1.2
    baffle: float = 0.0

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        shares = ((False, 1.0 - self.baffle), (True, self.baffle))
        return stiffness, mass + sum(self.density * f * air_mass(basis, baffled) for baffled, f in shares if f)


@dataclass(frozen=True)
class AttachedMass(NoEffect):
    """A small mass, kg, of a rotary radius, m, at a place, m; several places: frequencies are averaged over them."""

    mass: float
    places: Places
    rotary_radius: float = 0.0

    def variants(self) -> tuple[NoEffect, ...]:
        return tuple(replace(self, places=(place,)) for place in self.places)

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        ((x, y),) = self.places
        at = np.array([x - plate.covered]), np.array([y])
        moved = basis.deflection(*at)
        mass = mass + self.mass * moved.T @ moved
        for axis in (0, 1) if self.rotary_radius else ():
            turned = basis.rotation(axis, *at)
            mass = mass + self.mass * self.rotary_radius**2 * turned.T @ turned
        return stiffness, mass


@dataclass(frozen=True)
class ClampRotation(NoEffect):
    """Every clamped edge turns against k_R, N m per m and rad; the deflection stays held."""

    stiffness: float

    def changed(self, plate: Plate) -> Plate:
        return _released(plate, rotation=self.stiffness)


@dataclass(frozen=True)
class ClampTranslation(NoEffect):
    """Every clamped edge gives way against k_T, N per m and m; its rotation stays held."""

    stiffness: float

    def changed(self, plate: Plate) -> Plate:
        return _released(plate, translation=self.stiffness)


def _released(plate: Plate, **spring: float) -> Plate:
    springs = {
        edge: replace(plate.springs.get(edge, Spring()), **spring)
        for edge, word in plate.edges.items()
        if word == "clamped"
    }
    return replace(plate, springs=springs)


@dataclass(frozen=True)
class SupportMass(NoEffect):
    """The frame weighs M_f, kg, and hangs on a soft mount: it moves as a whole along z, so that momentum is kept."""

    mass: float

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        x, y, weights = basis.points
        area_density = plate.rho * plate.h
        volume = area_density * (weights @ basis.deflection(x, y))
        return stiffness, mass - np.outer(volume, volume) / (self.mass + area_density * plate.L_x * plate.L_y)


@dataclass(frozen=True)
class MembraneTension(NoEffect):
    """Tension N_x and N_y, N per m, in the plane of a held board."""

    N_x: float
    N_y: float

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        x, y, weights = basis.points
        for tension, order in ((self.N_x, (1, 0)), (self.N_y, (0, 1))):
            slope = basis.deflection(x, y, *order)
            stiffness = stiffness + tension * slope.T @ (weights[:, None] * slope)
        return stiffness, mass


@dataclass(frozen=True)
class SupportStiffness(NoEffect):
    """A uniform elastic foundation under the whole plate (Winkler), N per m and m^2."""

    stiffness: float

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        x, y, weights = basis.points
        moved = basis.deflection(x, y)
        return stiffness + self.stiffness * moved.T @ (weights[:, None] * moved), mass


@dataclass(frozen=True)
class LinearProfile:
    """A factor with mean one over the board: 1 + along_x (x / L_x - 1/2) + along_y (y / L_y - 1/2)."""

    along_x: float
    along_y: float
    L_x: float
    L_y: float

    def __call__(self, x: Floats, y: Floats) -> Floats:
        return 1.0 + self.along_x * (x / self.L_x - 0.5) + self.along_y * (y / self.L_y - 0.5)


@dataclass(frozen=True)
class ThicknessProfile(NoEffect):
    """Thickness that grows linearly by these fractions of its mean from end to end, along x and along y.

    For an arbitrary h(x, y) give `Plate.thickness` a function of x and y, m, in place of this effect.
    """

    taper_x: float
    taper_y: float = 0.0

    def changed(self, plate: Plate) -> Plate:
        profile = LinearProfile(self.taper_x, self.taper_y, plate.whole_length, plate.L_y)
        return replace(plate, thickness=(*plate.thickness, profile))


@dataclass(frozen=True)
class OutlineProfile(NoEffect):
    """The width at stations x, m, and linear between them, about the middle line; only with the edges along x free."""

    stations: tuple[float, ...]
    widths: tuple[float, ...]

    def changed(self, plate: Plate) -> Plate:
        if {plate.edges["y0"], plate.edges["y1"]} != {"free"}:
            raise ValueError("outline_profile: wanted y0 and y1 free, a held edge must stay straight")
        outline = tuple(zip(self.stations, self.widths, strict=True))
        return replace(plate, L_y=max(self.widths), outline=outline)


@dataclass(frozen=True)
class DensityGradient(NoEffect):
    """Density that grows linearly along x by this fraction of its mean from end to end."""

    gradient: float

    def changed(self, plate: Plate) -> Plate:
        profile = LinearProfile(self.gradient, 0.0, plate.whole_length, plate.L_y)
        return replace(plate, density=(*plate.density, profile))


@dataclass(frozen=True)
class StiffnessGradient(NoEffect):
    """E_x that grows linearly along x by this fraction of its mean from end to end; E_y, G_xy, nu_xy, density stay."""

    gradient: float

    def changed(self, plate: Plate) -> Plate:
        profile = LinearProfile(self.gradient, 0.0, plate.whole_length, plate.L_y)
        return replace(plate, stiffness_x=(*plate.stiffness_x, profile))


@dataclass(frozen=True)
class GrainAngle(NoEffect):
    """The grain runs at an angle, rad, to the side x."""

    angle: float

    def changed(self, plate: Plate) -> Plate:
        return replace(plate, grain=self.angle)


@dataclass(frozen=True)
class PoissonRatio(NoEffect):
    """The Poisson ratio nu_xy is not the tabulated one."""

    nu_xy: float

    def changed(self, plate: Plate) -> Plate:
        return replace(plate, nu_xy=self.nu_xy)
