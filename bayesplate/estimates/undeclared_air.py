"""Air that a card does not declare: by how much its mass would raise the constants of a board in a room."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.attached import DeclaredFluid
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, moduli
from bayesplate.effects import effects_of
from bayesplate.effects.fluid_loading import DEFAULT_DENSITY, FluidLoading
from bayesplate.estimates.least_squares import Estimate
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.system import System

_OPEN_AIR = DeclaredFluid(DEFAULT_DENSITY, "none")
SMALLEST_RISE = 0.005
"""Relative rise of a constant below which nothing is said."""


def rise_with_air(board: Board, estimate: Estimate) -> Floats:
    """Relative rise of E_x, E_y and G_xy, (3,), with the fluid that the card states around every setup, or open air of
    1.2 kg/m3.

    Zeros where a fluid is declared: whatever it is, it is in the model.
    """
    if FluidLoading.name in board.effects:
        return np.zeros(len(MODULI))
    shifts = []
    for setup, model in zip(board.setups, estimate.models, strict=True):
        air = FluidLoading.of(board, replace(setup, fluid=setup.fluid or _OPEN_AIR))
        values = {**estimate.values, air.name_of("density"): np.asarray(air.density.mean)}
        values[air.name_of("baffle")] = np.asarray(air.baffle.mean)
        with_air = setup_model(System(setup, (*effects_of(board, setup), air)), values)
        shifts.append((with_air.log_frequencies(values, "linear") - model.log_frequencies(values, "linear"))[0])
    weighted = board.symmetry.along(estimate.sensitivities) / estimate.scales[:, None]
    step, *_ = np.linalg.lstsq(weighted, -np.concatenate(shifts) / estimate.scales, rcond=None)
    rigidities = estimate.rigidities * np.exp(step[list(board.symmetry.follows)])
    thickness, nu_xy = (estimate.values[name] for name in ("thickness", "poisson_xy"))
    before, after = (
        np.stack(moduli(D_x, D_y, D_s, thickness, nu_xy)) for D_x, D_y, D_s in (estimate.rigidities, rigidities)
    )
    return np.asarray(after / before - 1.0)


def air_sentence(board: Board, estimate: Estimate) -> str:
    """Sentence on the shift of the constants by undeclared air, and how to declare it; empty where it is small."""
    rise = rise_with_air(board, estimate)
    if np.abs(rise).max() < SMALLEST_RISE:
        return ""
    cause = "no air is declared, and a board in a room carries it along"
    remedy = 'add to [setup.fluid] the lines density_kg_m3 = 1.2 and baffle = "none"'
    if any(setup.fluid is not None for setup in board.setups):
        cause = "what the card states of the air or the water around the board is not declared"
        effects = ",".join((*board.effects, FluidLoading.name))
        remedy = f"--effects {effects}, or fluid_loading among the effects of the card, puts it in"
    changes = [f"{name} {100.0 * change:+.1f} %" for name, change in zip(board.symmetry.moduli, rise, strict=False)]
    return f"{cause}; with it the constants would change by {', '.join(changes)}: {remedy}"
