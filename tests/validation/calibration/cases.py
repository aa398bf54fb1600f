"""What is planted and declared: an effect on a design, its card, and the generator's effect of drawn parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from generator import effects as planted
from generator.basis import Counts
from generator.effects import NoEffect
from generator.exciter import Exciter
from generator.plate import FINE_SHEAR, Plate
from generator.warp import Warp

Values = Mapping[str, float]
Place = tuple[float, float]

COMPACT_DENSITY, COMPACT_GYRATION = 5000.0, 1.0 / 16.0 + 1.0 / 3.0
"""An attached thing is a cylinder as high as wide: squared radius of gyration about a diameter of its base."""


@dataclass(frozen=True)
class Case:
    """An effect on a design.

    Attributes
    ----------
    design : str
        One of the generator's.
    make : callable
        Values by short name (of the effect's parameters), the ideal plate and the place of what is attached -> effect.
    main : str
        The parameter that stands for the effect where effects are pooled.
    effect : str
        Its name, where that is not the name of the case.
    others : tuple of str
        Uncertain inputs that are counted as well.
    times : int
        How many times as many boards as of other cases.
    stated : dict
        What the card says beyond the sizes, as TOML.
    is_attached : bool
        Whether something of unknown mass sits at a random place.
    is_driven : bool
        Whether an exciter does.
    n : (int, int), optional
        Polynomials of the generator, if not its own number.
    """

    design: str
    make: Callable[[Values, Plate, Place], NoEffect]
    main: str
    stated: Mapping[str, str] = field(default_factory=dict)
    is_attached: bool = False
    is_driven: bool = False
    n: Counts | None = None
    effect: str = ""
    others: tuple[str, ...] = ()
    times: int = 1


def _compliant(effect: Callable[[float], NoEffect], power: int) -> Callable[[Values, Plate, Place], NoEffect]:
    """A spring of stiffness D / (compliance L^power), with D and L along x, where the first clamp is."""
    return lambda v, plate, place: effect(plate.D_x / (v["compliance"] * plate.L_x**power))


def _attached(values: Values, plate: Plate, place: Place) -> NoEffect:
    diameter = (4.0 * values["mass"] / (np.pi * COMPACT_DENSITY)) ** (1.0 / 3.0)
    return planted.AttachedMass(values["mass"], (place,), diameter * COMPACT_GYRATION**0.5)


CASES: dict[str, Case] = {
    "transverse_shear": Case(
        "free-12", lambda v, p, at: planted.TransverseShear(v["G_xz"], v["G_yz"]), "G_yz", n=FINE_SHEAR
    ),
    "attached_mass": Case("free-12", _attached, "mass", is_attached=True),
    "exciter": Case(
        "clamped-9",
        lambda v, p, at: Exciter(v["mass"], (at,), v["coil"], v["suspension"]),
        "suspension",
        {
            "exciter_mass_g": "{ mean = 8, sd = 0.8 }",
            "coil_mass_g": "{ mean = 0.4, sd = 0.08 }",
            "suspension_n_per_m": "{ mean = 400, sd = 80 }",
        },
        is_driven=True,
        n=(24, 24),
    ),
    "warp": Case("free-12", lambda v, p, at: Warp(v["cup"], v["bow"], v["twist"]), "cup"),
    "clamp_rotation": Case("cantilever-9", _compliant(planted.ClampRotation, 1), "compliance"),
    "clamp_rotation, board free too": Case(
        "cantilever-6-free-6",
        _compliant(planted.ClampRotation, 1),
        "compliance",
        {"clamped_x0_mm": "{ mean = 30.0, sd = 1.5 }"},
        effect="clamp_rotation",
        others=("clamped_x0",),
        times=5,
    ),
    "fluid_loading": Case(
        "clamped-9",
        lambda v, p, at: planted.FluidLoading(v["density"], v["baffle"]),
        "baffle",
        {"air": "{ density_kg_m3 = { mean = 1.2, sd = 0.06 } }"},
    ),
    "membrane_tension": Case("clamped-9", lambda v, p, at: planted.MembraneTension(v["N"], v["N"]), "N"),
    "clamp_translation": Case("cantilever-9", _compliant(planted.ClampTranslation, 3), "compliance"),
    "support_stiffness": Case("free-12", lambda v, p, at: planted.SupportStiffness(v["stiffness"]), "stiffness"),
    "support_mass": Case("clamped-9", lambda v, p, at: planted.SupportMass(v["mass"]), "mass"),
    "thickness_profile": Case(
        "cantilever-9", lambda v, p, at: planted.ThicknessProfile(v["taper_x"], v["taper_y"]), "taper_x"
    ),
    "density_gradient": Case("cantilever-9", lambda v, p, at: planted.DensityGradient(v["gradient"]), "gradient"),
    "stiffness_gradient": Case("cantilever-9", lambda v, p, at: planted.StiffnessGradient(v["gradient"]), "gradient"),
    "grain_angle": Case("cantilever-9", lambda v, p, at: planted.GrainAngle(v["angle"]), "angle"),
    "poisson_ratio": Case(
        "cantilever-9", lambda v, p, at: planted.PoissonRatio(v["nu_xy"]), "poisson_xy", {"poisson_xy": "0.4"}
    ),
}
"""Every effect that has a parameter, on a design where the readings tell something of it; and a clamp whose grip is not
known either, which the board held free as well tells apart from its give: one setup alone cannot."""


def effect_of(case: str) -> str:
    """The effect of a case."""
    return CASES[case].effect or case
