"""Boards made for tests: from a plate with known constants, or from bare numbers, without a card."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import ritz

from bayesplate.board.board import INPUTS, Board, make_board
from bayesplate.board.material import RIGIDITIES
from bayesplate.board.parameter import BOARD_OWNER
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak, Reading
from bayesplate.board.setup import Setup
from bayesplate.frequencies.model import SetupModel, setup_model
from bayesplate.frequencies.system import system_of
from bayesplate.labels import Label

NARROW = 1.0001
"""Factor of a noise prior that fixes the noise for all practical purposes: its logarithm has an sd of 1e-4."""

CANTILEVER_LABELS = ((0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2))
"""Beam orders of the six modes of the paper's cantilever board, in the order of its table."""

FREE_LABELS = ((1, 1), (2, 0), (2, 1), (0, 2), (1, 2), (3, 0), (3, 1), (2, 2))


def setup_of(
    edges: Mapping[str, str],
    hertz: Mapping[tuple[int, int], float | Quantity],
    *,
    name: str = "setup",
    resolution: float = 0.0,
    noise: Quantity | None = None,
    clamped: Mapping[str, Quantity] | None = None,
) -> Setup:
    """A setup from frequencies by beam orders; plain numbers are exact readings, rounded to the resolution."""
    readings = tuple(
        Reading(Label(*beams), beams, f if isinstance(f, Quantity) else Quantity.exact(f)) for beams, f in hertz.items()
    )
    return Setup(
        name=name,
        ends_x=(edges["x0"], edges["x1"]),
        ends_y=(edges["y0"], edges["y1"]),
        readings=readings,
        noise=Quantity.from_median(0.003, np.exp(0.5)) if noise is None else noise,
        clamped=dict(clamped or {}),
        resolution=resolution,
    )


def peaks_of(*hertz: float) -> tuple[Peak, ...]:
    """Peaks without a label, of which nothing but the frequency is known."""
    return tuple(Peak(Quantity.exact(one)) for one in hertz)


def board_of(plate: ritz.Plate, setups: Sequence[Setup], **inputs: Quantity) -> Board:
    """A board with the sizes of a plate; what a clamp covers is added to its length."""
    lengths = {"length_x": plate.L_x, "length_y": plate.L_y}
    for setup in setups:
        for edge, length in setup.clamped.items():
            lengths[f"length_{edge[0]}"] += length.mean
    exact = {**lengths, "thickness": plate.h, "density": plate.rho, "poisson_xy": plate.nu_xy}
    stated = {n: Quantity.exact(v) for n, v in exact.items() if n != "density" or "mass" not in inputs}
    board = make_board("made", stated | {n: q for n, q in inputs.items() if n in INPUTS}, setups)
    return board.with_priors({n: q for n, q in inputs.items() if n not in INPUTS})


def models_at(board: Board, rigidities: Sequence[float], **inputs: float) -> tuple[SetupModel, ...]:
    """Every setup of a board solved at given rigidities, N m, and nominal inputs unless given."""
    values = board.nominal() | {name: np.asarray(value) for name, value in inputs.items()}
    values |= {name: np.asarray(value) for name, value in zip(RIGIDITIES, rigidities, strict=True)}
    return tuple(setup_model(system_of(board, setup), values) for setup in board.setups)


def with_noise(hertz: Mapping[Any, float], sd: float, rng: np.random.Generator, resolution: float = 0.0) -> dict:
    """Frequencies as a laboratory reads them: relative normal noise, then rounding."""
    noisy = {label: f * float(np.exp(sd * rng.standard_normal())) for label, f in hertz.items()}
    return {label: round(f / resolution) * resolution for label, f in noisy.items()} if resolution else noisy


def swapped(board: Board) -> Board:
    """The same board with x and y exchanged; its nu_xy is left alone."""
    exchange = {"x0": "y0", "x1": "y1", "y0": "x0", "y1": "x1"}
    setups = tuple(
        replace(
            setup,
            ends_x=setup.ends_y,
            ends_y=setup.ends_x,
            clamped={exchange[e]: length for e, length in setup.clamped.items()},
            readings=tuple(replace(r, label=Label(r.label.n, r.label.m), beams=r.beams[::-1]) for r in setup.readings),
        )
        for setup in board.setups
    )
    own = {one.name: one.prior for one in board.parameters if one.owner == BOARD_OWNER}
    own["length_x"], own["length_y"] = own["length_y"], own["length_x"]
    return make_board(board.name, own, setups, prior=board.prior, effects=board.effects)
