"""Campaigns: a card, and simulated boards with one accelerometer, by the independent generator."""

from __future__ import annotations

import numpy as np
from generator.boards import plant
from generator.designs import DESIGNS

MASS = 0.003
"""kg, of the accelerometer."""
SHEAR = {"G_xz": 0.65e9, "G_yz": 0.03e9}
"""Pa, of boards that have shear."""

TWO_BOARDS = """\
format = 1
name = "my-campaign"
title = "Two boards"
boards = ["spruce-free-2L", "./my-board.toml"]

[[shared]]
effect = "attached_mass"

[[shared]]
effect = "transverse_shear"
as = "ratio"

[population]
prior = "spruce"
"""
"""A card of a campaign that says all that one may."""


def write_campaign(folder, masses=(MASS,) * 3, seed=5, population="spruce", noise_cents=5.0, has_shear=False):
    """Cards of simulated boards that share an accelerometer, and of their campaign; the path of the latter."""
    rng = np.random.default_rng(seed)
    design = DESIGNS["free-12"]
    for i, mass in enumerate(masses):
        planted = plant(
            rng,
            design,
            [*(["attached_mass"] if mass else []), *(["transverse_shear"] if has_shear else [])],
            1.0,
            noise_cents,
            name=f"board-{i}",
            sensor=(0.9 * design.L_x, 0.9 * design.L_y),
            fixed={"attached_mass": {"mass": mass, "rotary_radius": 0.0}, "transverse_shear": SHEAR},
        )
        (folder / f"board-{i}.toml").write_text(planted.card_text())
    boards = ", ".join(f'"./board-{i}.toml"' for i in range(len(masses)))
    pooled = f'[population]\nprior = "{population}"\n' if population else ""
    path = folder / "together.toml"
    path.write_text(
        f'format = 1\nname = "together"\nboards = [{boards}]\n\n[[shared]]\neffect = "attached_mass"\n\n{pooled}'
    )
    return path
