"""The experiments that are simulated, on spruce boards, and how large each effect is on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from generator.naming import Label
from generator.plate import EDGES, Plate

CANTILEVER = {"x0": "clamped", "x1": "free", "y0": "free", "y1": "free"}
ALL_CLAMPED, ALL_FREE = dict.fromkeys(EDGES, "clamped"), dict.fromkeys(EDGES, "free")

POISSON = 0.4
MEDIANS = {"E_x": (11.5e9, 1.12), "E_y": (0.90e9, 1.15), "G_xy": (0.70e9, 1.12)}
"""Median, Pa, and factor of the log-normal spread of the constants; inside those of published spruce boards."""

SHEAR_MEANS = {"G_xz": (0.65e9, 0.15e9), "G_yz": (0.03e9, 0.01e9)}
"""Mean and sd, Pa, of literature values, as cards state them."""


@dataclass(frozen=True)
class Setup:
    """One way to hold the board, and the modes that are read.

    Attributes
    ----------
    name : str
    edges : mapping
    beams : tuple of (int, int)
        Beam orders of the modes that are read, in the order of the nominal board.
    first_label : (int, int)
        The laboratory's label of the lowest beam orders.
    covered : float, m
        What the clamp at x = 0 covers.
    """

    name: str
    edges: Mapping[str, str]
    beams: tuple[Label, ...]
    first_label: Label = (0, 0)
    covered: float = 0.0

    def label(self, beams: Label) -> Label:
        """The laboratory's label of beam orders."""
        return beams[0] + self.first_label[0], beams[1] + self.first_label[1]

    @property
    def is_clamped(self) -> bool:
        """Whether any edge is clamped."""
        return "clamped" in self.edges.values()

    @property
    def is_framed(self) -> bool:
        """Whether no edge is free, so that a frame can pull on the board."""
        return "free" not in self.edges.values()

    @property
    def is_free(self) -> bool:
        """Whether all edges are free."""
        return set(self.edges.values()) == {"free"}


@dataclass(frozen=True)
class Design:
    """A board and its setups.

    Attributes
    ----------
    name : str
    L_x, L_y, h : float, m
        Of the whole board.
    rho : float, kg m^-3
    setups : tuple of Setup
    nominal : mapping
        Size of each effect, SI units: see `recipes`.
    drawn : tuple of str
        Effects of the library that a random board may have: those with a visible trace on this design.
    drawn_outside : tuple of str
        Those outside the library likewise.
    """

    name: str
    L_x: float
    L_y: float
    h: float
    rho: float
    setups: tuple[Setup, ...]
    nominal: Mapping[str, float] = field(hash=False)
    drawn: tuple[str, ...] = ()
    drawn_outside: tuple[str, ...] = ("rib", "crack")

    @property
    def mass(self) -> float:
        """Mass of the board, kg."""
        return self.rho * self.h * self.L_x * self.L_y

    def plate(self, setup: Setup, constants: Mapping[str, float]) -> Plate:
        """The vibrating part in a setup, ideal and thin."""
        sizes = {"L_x": self.L_x - setup.covered, "L_y": self.L_y, "h": self.h, "rho": self.rho}
        return Plate(**constants, **sizes, edges=setup.edges, covered=setup.covered, whole=self.L_x)


_COMMON = {
    "taper": 0.05,
    "density_gradient": 0.05,
    "grain_angle": 3.0,  # degrees
    "poisson_ratio": 0.16,
    "outline": 0.04,
    "stiffness_gradient": 0.10,
    "crack": 0.4,
    "warp": 1.0,  # times the spread of boards as they come, see recipes
    "exciter": 0.05,  # times a 48 g exciter
}
_CANTILEVER_SIZES = {
    **_COMMON,
    "attached_mass": 0.6e-3,  # kg
    "clamp_rotation": 3500.0,  # N: k_R L / D_x = 30
    "clamp_translation": 2.3e7,  # N m^-2: k_T L^3 / D_x = 1e4
    "support_stiffness": 8000.0,  # N m^-3: a free board of 1.3 kg m^-2 bounces at 12 Hz
    "rib": 0.02,  # N m^2
}
_FREE_SIZES = {**_COMMON, "attached_mass": 3e-3, "support_stiffness": 3000.0, "rib": 0.25, "exciter": 0.2}
_CLAMPED_SIZES = {
    **_COMMON,
    "attached_mass": 10e-3,
    "clamp_rotation": 5000.0,  # N: k_R L / D_x about 100
    "clamp_translation": 2.5e6,  # N m^-2: k_T L^3 / D_x about 2e4
    "support_mass": 8.0,  # kg
    "membrane_tension": 160.0,  # N m^-1
    "rib": 0.05,
    "warp": 0.2,  # a frame presses a board nearly flat
    "exciter": 1.0,
}
_IN_AIR = ("transverse_shear", "fluid_loading")
_ANYWHERE = (*_IN_AIR, "attached_mass", "grain_angle", "poisson_ratio")
_TAPERED = ("thickness_profile", "density_gradient", "stiffness_gradient")
"""What differs from end to end along x: of second order, and invisible, where the board is held alike at both."""
_CLAMP = ("clamp_rotation", "clamp_translation")

_CANTILEVER_MODES: tuple[Label, ...] = (
    (0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2), (2, 0), (2, 1), (0, 3),
)  # fmt: skip
_FREE_MODES: tuple[Label, ...] = (
    (1, 1), (2, 0), (2, 1), (0, 2), (1, 2), (3, 0), (3, 1), (2, 2), (3, 2), (4, 0), (0, 3), (1, 3),
)  # fmt: skip
_CLAMPED_MODES: tuple[Label, ...] = (
    (0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2), (2, 0), (0, 3), (2, 1),
)  # fmt: skip


def _cantilever(n_modes: int, covered: float = 0.0) -> Setup:
    return Setup("cantilever", CANTILEVER, _CANTILEVER_MODES[:n_modes], (1, 0), covered)


_SMALL = {"L_y": 0.114, "h": 3e-3, "rho": 440.0}
_TOP = {"L_x": 0.600, "L_y": 0.412, "h": 3e-3, "rho": 400.0}
_CLAMPED = {"setups": (Setup("clamped", ALL_CLAMPED, _CLAMPED_MODES),), "nominal": _CLAMPED_SIZES}
# Clamped all round, nu_xy shows only together with G_xy: no trace of it is visible.
_IN_A_FRAME = ("grain_angle", *_CLAMP, "support_mass", "membrane_tension")
_ON_A_CANTILEVER = {
    "nominal": _CANTILEVER_SIZES,
    "drawn": (*_ANYWHERE, *_TAPERED, *_CLAMP),
}
DESIGNS: dict[str, Design] = {
    design.name: design
    for design in (
        Design("cantilever-6", 0.223, **_SMALL, setups=(_cantilever(6),), **_ON_A_CANTILEVER),
        Design("cantilever-9", 0.223, **_SMALL, setups=(_cantilever(9),), **_ON_A_CANTILEVER),
        Design(
            "free-12",
            *(0.580, 0.217, 4.7e-3, 430.0),
            setups=(Setup("free", ALL_FREE, _FREE_MODES),),
            nominal=_FREE_SIZES,
            drawn=(*_ANYWHERE, "support_stiffness"),
        ),
        Design("clamped-9", **_TOP, **_CLAMPED, drawn=(*_IN_AIR, "attached_mass", *_IN_A_FRAME)),
        Design(
            "cantilever-6-free-6",
            0.253,
            **_SMALL,
            setups=(_cantilever(6, 0.030), Setup("free", ALL_FREE, ((1, 1), (2, 0), (0, 2), (2, 1), (1, 2), (3, 0)))),
            **(_ON_A_CANTILEVER | {"drawn": (*_ON_A_CANTILEVER["drawn"], "support_stiffness")}),
        ),
        Design("clamped-9-driven", **_TOP, **_CLAMPED, drawn=(*_IN_AIR, "exciter", *_IN_A_FRAME)),
    )
}
