"""How each effect is drawn for a design: its parameters at a size, and the effect they make in a setup."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from generator import effects, outside
from generator.designs import POISSON, SHEAR_MEANS, Design, Setup
from generator.effects import NoEffect
from generator.exciter import COIL, SUSPENSION, Exciter
from generator.warp import Warp

STEEPEST_GRAIN = 5.0  # degrees
EXCITER = 48e-3
"""Mass of an exciter, kg, coil and magnet."""
WARP = (0.005, 0.004, 0.01)
"""Spread of cup over the width, bow over the length, twist over the longer side, of boards as they come."""
Parameters = dict[str, Any]
Draw = Callable[[np.random.Generator, Design, float], Parameters]


@dataclass(frozen=True)
class Recipe:
    """How to draw an effect's parameters at a size, to make it of them, and whether it can act in a setup.

    Size multiplies the nominal amplitude; of a spring, the compliance.
    """

    draw: Draw
    make: Callable[[Parameters], NoEffect]
    acts: Callable[[Setup], bool] = lambda setup: True


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _amplitude(parameter: str, nominal: str, signed: bool = False) -> Draw:
    def draw(rng: np.random.Generator, design: Design, size: float) -> Parameters:
        return {parameter: size * design.nominal[nominal] * (_sign(rng) if signed else 1.0)}

    return draw


def _compliance(parameter: str, nominal: str) -> Draw:
    return lambda rng, design, size: {parameter: design.nominal[nominal] / size}


def _shear(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    """Log-normal with the mean and sd of the card, cut at two sd; size divides both."""
    drawn: Parameters = {}
    for name, (mean, sd) in SHEAR_MEANS.items():
        spread = np.sqrt(np.log1p((sd / mean) ** 2))
        drawn[name] = float(mean * np.exp(spread * np.clip(rng.standard_normal(), -2.0, 2.0) - 0.5 * spread**2) / size)
    return drawn


def _air(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    return {"density": 1.2 * size * float(rng.uniform(0.97, 1.03)), "baffle": float(rng.uniform())}


def _attached(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    """One place, in the outer part of the board if it is a cantilever."""
    low = 0.4 if any("free" in s.edges.values() and s.is_clamped for s in design.setups) else 0.05
    place = (float(design.L_x * rng.uniform(low, 0.95)), float(design.L_y * rng.uniform(0.05, 0.95)))
    return {"mass": size * design.nominal["attached_mass"], "places": (place,), "rotary_radius": 0.0}


def _exciter(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    """Suspension and coil as such exciters spread, cut at two sd; well inside the board; size multiplies all three."""
    z = np.clip(rng.standard_normal(2), -2.0, 2.0)
    times = size * design.nominal["exciter"]
    place = (float(design.L_x * rng.uniform(0.15, 0.85)), float(design.L_y * rng.uniform(0.15, 0.85)))
    return {
        "mass": times * EXCITER,
        "places": (place,),
        "coil_mass": times * COIL * 1.3 ** float(z[0]),
        "suspension": times * SUSPENSION * 1.5 ** float(z[1]),
        "magnet": "free",
    }


def _warp(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    """Normal about flat; only signs that can be told: the bow's, which makes a dome or a saddle."""
    spread = size * design.nominal["warp"] * np.multiply(WARP, (design.L_y, design.L_x, max(design.L_x, design.L_y)))
    cup, bow, twist = (float(value) for value in spread * rng.standard_normal(3))
    return {"cup": abs(cup), "bow": bow, "twist": abs(twist)}


def _tension(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    nominal = size * design.nominal["membrane_tension"]
    return {name: nominal * float(rng.uniform(0.5, 1.5)) for name in ("N_x", "N_y")}


def _taper(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    return {"taper_x": size * design.nominal["taper"] * _sign(rng), "taper_y": 0.0}


def _outline(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    """Narrower at one end, straight from the middle to the other."""
    narrow = design.L_y * (1.0 - size * design.nominal["outline"])
    widths = (narrow, design.L_y, design.L_y)[:: int(_sign(rng))]
    return {"stations": (0.0, 0.5 * design.L_x, design.L_x), "widths": widths}


def _grain(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    """At most five degrees: nobody saws a board six degrees off the grain, and no range should end at the truth."""
    degrees = min(size * design.nominal["grain_angle"], STEEPEST_GRAIN)
    return {"angle": float(np.radians(degrees * _sign(rng)))}


def _poisson(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    return {"nu_xy": POISSON + size * design.nominal["poisson_ratio"] * _sign(rng)}


def _rib(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    stiffness = size * design.nominal["rib"]
    height = (12.0 * stiffness / 12e9) ** 0.25  # a square rib of spruce
    place = float(design.L_x * rng.uniform(0.3, 0.8))
    return {"place": place, "stiffness": stiffness, "line_mass": 430.0 * height**2}


def _crack(rng: np.random.Generator, design: Design, size: float) -> Parameters:
    """From one end of the board, over a quarter to a half of its length."""
    return {
        "start": float(design.L_x * rng.uniform(0.5, 0.75)),
        "end": design.L_x,
        "place": float(design.L_y * rng.uniform(0.25, 0.75)),
        "width": 0.2 * design.L_y,
        "loss": min(0.9, size * design.nominal["crack"]),
    }


def _make(effect: type[NoEffect]) -> Callable[[Parameters], NoEffect]:
    return lambda parameters: effect(**parameters)


LIBRARY: dict[str, Recipe] = {
    "transverse_shear": Recipe(_shear, _make(effects.TransverseShear)),
    "fluid_loading": Recipe(_air, _make(effects.FluidLoading)),
    "attached_mass": Recipe(_attached, _make(effects.AttachedMass)),
    "exciter": Recipe(_exciter, _make(Exciter)),
    "warp": Recipe(_warp, _make(Warp)),
    "clamp_rotation": Recipe(
        _compliance("stiffness", "clamp_rotation"), _make(effects.ClampRotation), lambda setup: setup.is_clamped
    ),
    "clamp_translation": Recipe(
        _compliance("stiffness", "clamp_translation"), _make(effects.ClampTranslation), lambda setup: setup.is_clamped
    ),
    "support_mass": Recipe(
        _compliance("mass", "support_mass"), _make(effects.SupportMass), lambda setup: setup.is_framed
    ),
    "membrane_tension": Recipe(_tension, _make(effects.MembraneTension), lambda setup: setup.is_framed),
    "support_stiffness": Recipe(
        _amplitude("stiffness", "support_stiffness"), _make(effects.SupportStiffness), lambda setup: setup.is_free
    ),
    "thickness_profile": Recipe(_taper, _make(effects.ThicknessProfile)),
    "outline_profile": Recipe(
        _outline, _make(effects.OutlineProfile), lambda setup: setup.edges["y0"] == setup.edges["y1"] == "free"
    ),
    "density_gradient": Recipe(_amplitude("gradient", "density_gradient", signed=True), _make(effects.DensityGradient)),
    "stiffness_gradient": Recipe(
        _amplitude("gradient", "stiffness_gradient", signed=True), _make(effects.StiffnessGradient)
    ),
    "grain_angle": Recipe(_grain, _make(effects.GrainAngle)),
    "poisson_ratio": Recipe(_poisson, _make(effects.PoissonRatio)),
}
"""The effects that the package's library also knows, by its names."""

OUTSIDE: dict[str, Recipe] = {
    "rib": Recipe(_rib, _make(outside.Rib)),
    "crack": Recipe(_crack, _make(outside.Crack)),
}
"""The effects that it does not know."""

RECIPES = LIBRARY | OUTSIDE
KNOWN_SIZE = ("transverse_shear", "fluid_loading", "exciter", "warp")
"""Effects whose size nature or a maker sets: they keep it when another is asked for, unless that is asked for too."""
