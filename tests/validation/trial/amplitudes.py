"""How large a named effect is found to be, beside how large it was planted, where the two mean the same."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from generator.boards import PlantedBoard
from generator.designs import POISSON, Design
from numpy.typing import NDArray

from bayesplate.board.material import rigidities
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.search import SearchResult
from bayesplate.diagnosis.sizes import size_posterior
from bayesplate.diagnosis.verdict import Verdict

Floats = NDArray[np.float64]
Read = Callable[[Mapping[str, Any], float, float], float]
"""Planted parameters, D_x (N m), length of the vibrating part (m) -> the package's parameter."""

MEANINGS: dict[str, tuple[str, Read, float]] = {
    "transverse_shear": ("G_yz", lambda p, D, L: p["G_yz"], 0.0),
    "attached_mass": ("mass", lambda p, D, L: p["mass"], 0.0),
    "clamp_rotation": ("compliance", lambda p, D, L: D / (p["stiffness"] * L), 0.0),
    "clamp_translation": ("compliance", lambda p, D, L: D / (p["stiffness"] * L**3), 0.0),
    "support_mass": ("mass", lambda p, D, L: p["mass"], 0.0),
    "support_stiffness": ("stiffness", lambda p, D, L: p["stiffness"], 0.0),
    "thickness_profile": ("taper_x", lambda p, D, L: p["taper_x"], 0.0),
    "density_gradient": ("gradient", lambda p, D, L: p["gradient"], 0.0),
    "stiffness_gradient": ("gradient", lambda p, D, L: p["gradient"], 0.0),
    "grain_angle": ("angle", lambda p, D, L: abs(p["angle"]), 0.0),
    "poisson_ratio": ("nu_xy", lambda p, D, L: p["nu_xy"], POISSON),
}
"""Effect -> the package's parameter, its planted value, and the value at which there is no effect.

Air is missing, for nothing of its size is fitted, and tension, which is planted unequal along the two sides.
"""


def recovered(found: SearchResult, verdict: Verdict, planted: PlantedBoard) -> dict[str, dict[str, float]]:
    """Posterior of the size of each named effect that is really there.

    Returns
    -------
    dict
        Effect -> parameter, truth, nothing (its value without the effect), q05, q50, q95.
    """
    result = {}
    for member, name in enumerate(verdict.effects):
        if name not in planted.truth.effects or name not in MEANINGS:
            continue
        parameter, read, nothing = MEANINGS[name]
        laws = found.ground.candidates[name].laws
        place = next(i for i, free in enumerate(laws[0].form.free) if free.key == parameter)  # of the first setup
        values, shares = _sizes(found, verdict.index, member, place, laws[0].form.free[place].prior)
        true = read(planted.truth.effects[name], *_rigidity_and_length(planted.design, planted.truth.constants))
        low, middle, high = (float(f"{q:.6g}") for q in quantiles(values, shares, (0.05, 0.5, 0.95)))
        result[name] = {"truth": true, "nothing": nothing, "q05": low, "q50": middle, "q95": high}
    return result


def _sizes(found: SearchResult, index: int, member: int, place: int, prior: Quantity) -> tuple[Floats, Floats]:
    """Edges of the cells of a parameter and their probabilities, other parameters summed over."""
    shares, z = size_posterior(found, index, member, 0, place)
    middles, back = np.unique(np.round(z, 9), return_inverse=True)
    step = float(np.diff(middles).min()) if len(middles) > 1 else 1.0
    edges = np.r_[middles - 0.5 * step, middles[-1] + 0.5 * step]
    low, high = (float(prior.standard(bound)) for bound in (prior.lower, prior.upper))
    return np.asarray(prior.value(np.clip(edges, low, high))), np.bincount(back, weights=shares)


def quantiles(edges: Floats, shares: Floats, at: tuple[float, ...]) -> Floats:
    """Quantiles of a histogram, straight within its cells: edges are one more than shares."""
    below = np.r_[0.0, np.cumsum(shares)] / shares.sum()
    return np.interp(at, below, edges)


def _rigidity_and_length(design: Design, constants: Mapping[str, float]) -> tuple[float, float]:
    """D_x, N m, and the length of the vibrating part of the first setup, m."""
    D_x = rigidities(*(constants[name] for name in ("E_x", "E_y", "G_xy")), design.h, constants["nu_xy"]).D_x
    return float(D_x), design.L_x - design.setups[0].covered
