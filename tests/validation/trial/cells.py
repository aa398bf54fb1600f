"""The cells of the trial: which boards are planted, how many, how large the effects, how loud the noise."""

from __future__ import annotations

import ast
import hashlib
import zlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from generator.designs import DESIGNS, Design

Kind = Literal["null", "one", "two", "outside"]
Noise = Literal["median", "drawn", "known", "rounded"]

UNKNOWN, KNOWN = 1.65, 1.05
"""Factor of the noise prior that a card states: hardly known, and nearly known."""

NOISES: dict[Noise, str] = {
    "median": "noise at its prior's median",
    "drawn": "noise drawn from its prior",
    "known": "noise known",
    "rounded": "readings rounded",
}
ROUNDED_TO = 1.0
"""Hz."""

SENSORS = {
    "cantilever-6": (0.9 * 0.223, 0.75 * 0.114),
    "cantilever-9": (0.9 * 0.223, 0.75 * 0.114),
    "free-12": (0.580 - 0.020, 0.217 - 0.020),
    "clamped-9": (0.3 * 0.600, 0.35 * 0.412),
    "cantilever-6-free-6": (0.030 + 0.9 * 0.223, 0.75 * 0.114),
    "clamped-9-driven": (0.3 * 0.600, 0.35 * 0.412),
}
"""Where every board of a design carries a sensor of unstated mass, m: cards do not tell whether it weighs anything."""

KINDS = dict.fromkeys(SENSORS, "accelerometer") | {"clamped-9": "shaker", "clamped-9-driven": "exciter"}
"""What the card calls it: a guitar top of 300 g is driven by a shaker, of some 10 g, or by an exciter."""


@dataclass(frozen=True)
class Setting:
    """What the boards of a cell have in common before anything is drawn: null simulations depend on nothing else.

    Attributes
    ----------
    design : str
    noise_cents : float
        Median of the noise prior on the card.
    noise_factor : float
        Of that prior.
    resolution : float, Hz
        To which readings are rounded; 0 if they are not.
    """

    design: str
    noise_cents: float
    noise_factor: float
    resolution: float

    def rng(self) -> np.random.Generator:
        """Random numbers of the null simulations."""
        return np.random.default_rng(zlib.crc32(repr(self).encode()))


@dataclass(frozen=True)
class Cell:
    """Boards that are alike but for what is drawn.

    Attributes
    ----------
    kind : str
        "null", "one" effect of the library, "two", or one "outside" it.
    design : str
    n : int
        Boards.
    noise_cents : float
        Median of the noise prior on the card, and the true noise unless that is drawn.
    size : float
        Multiple of the nominal size; air and shear keep theirs, which nature sets.
    noise : str
        "median": true noise at the median of the prior on the card; "drawn": drawn from that prior, for each setup;
        "known": at the median of a narrow prior; "rounded": at the median, and readings rounded to `ROUNDED_TO`.
    planted : tuple of str
        What every board has; empty: drawn anew for each, of the design's classes.
    """

    kind: Kind
    design: str
    n: int
    noise_cents: float = 5.0
    size: float = 1.0
    noise: Noise = "median"
    planted: tuple[str, ...] = ()

    @property
    def setting(self) -> Setting:
        """What its boards have in common with those of other cells."""
        factor = KNOWN if self.noise == "known" else UNKNOWN
        return Setting(self.design, self.noise_cents, factor, ROUNDED_TO if self.noise == "rounded" else 0.0)

    @property
    def name(self) -> str:
        """Kind, design, noise, size, and what every board has."""
        size = "" if self.kind == "null" else f" {self.size:g}x"
        noise = "" if self.noise == "median" else f" {self.noise}"
        planted = f" {' + '.join(self.planted)}" if self.planted else ""
        return f"{self.kind} {self.design} {self.noise_cents:g}c{size}{noise}{planted}"

    @property
    def of(self) -> Design:
        """The design."""
        return DESIGNS[self.design]

    def draw_effects(self, rng: np.random.Generator) -> tuple[str, ...]:
        """Names of what is planted, each class equally often if they are drawn."""
        if self.planted:
            return self.planted
        if self.kind == "outside":
            return (str(rng.choice(self.of.drawn_outside)),)
        n = {"null": 0, "one": 1, "two": 2}[self.kind]
        return tuple(str(name) for name in rng.choice(self.of.drawn, size=n, replace=False))

    def rng(self, base_seed: int, index: int) -> np.random.Generator:
        """Random numbers of one board, whatever ran before it."""
        return np.random.default_rng(np.random.SeedSequence([base_seed, zlib.crc32(self.name.encode()), index]))


_SIX, _NINE, _FREE, _CLAMPED, _BOTH, _DRIVEN = DESIGNS
_OTHER_NOISES: tuple[Noise, ...] = ("drawn", "known", "rounded")

CELLS: tuple[Cell, ...] = (
    *(Cell("null", _SIX, 200, cents) for cents in (2.0, 5.0, 17.0)),
    *(Cell("null", _SIX, 600, noise=noise) for noise in _OTHER_NOISES),
    *(Cell("null", design, 300, noise=noise) for design in (_NINE, _FREE, _CLAMPED, _BOTH) for noise in NOISES),
    Cell("one", _SIX, 1200, size=2.0),
    Cell("one", _SIX, 200, size=1.0),
    Cell("one", _SIX, 200, size=0.5),
    Cell("one", _SIX, 200, 2.0, size=1.0),
    Cell("one", _SIX, 200, 17.0, size=1.0),
    Cell("one", _SIX, 200, size=2.0, noise="known"),
    *(Cell("one", design, 600, size=2.0) for design in (_NINE, _FREE, _CLAMPED)),
    Cell("one", _BOTH, 200, size=1.0),
    Cell("one", _BOTH, 600, size=2.0),
    Cell("two", _BOTH, 600, size=2.0),
    *(Cell("outside", design, 600, size=2.0) for design in (_SIX, _BOTH)),
)

WARPED_OR_DRIVEN: tuple[Cell, ...] = (
    *(Cell("null", design, 150, noise="drawn") for design in (_FREE, _BOTH, _DRIVEN)),
    *(Cell("one", design, 150, planted=("warp",)) for design in (_FREE, _BOTH)),
    Cell("one", _DRIVEN, 150, planted=("exciter",)),
    Cell("one", _DRIVEN, 150, size=2.0),
    Cell("two", _FREE, 100, planted=("support_stiffness", "warp")),
    Cell("two", _DRIVEN, 100, planted=("exciter", "fluid_loading")),
    *(Cell("outside", design, 100, size=2.0) for design in (_FREE, _BOTH)),
)
"""Boards that are not flat, or driven by an exciter; and those without such causes, where these might be named."""


_DECIDING = ("bayesplate/diagnosis", "bayesplate/effects", "tests/generator")
_OWN = ("judge.py", "shared.py", "amplitudes.py")


def jobs(cells: Sequence[Cell], most: int | None = None) -> list[tuple[Cell, int]]:
    """Every board of the cells, so ordered that all cells fill at the same pace.

    Parameters
    ----------
    cells : sequence of Cell
    most : int, optional
        Boards of a cell at most.
    """
    counts = [cell.n if most is None else min(cell.n, most) for cell in cells]
    every = [((i + 0.5) / n, c, i) for c, n in enumerate(counts) for i in range(n)]
    return [(cells[c], i) for _, c, i in sorted(every)]


def fingerprint() -> str:
    """Of the code that decides: records of two states of the search must not be mixed. Comments and docstrings are not
    part of it.
    """
    root = Path(__file__).resolve().parents[3]
    files = [file for folder in _DECIDING for file in sorted((root / folder).rglob("*.py"))]
    files = [file for file in files if not file.name.startswith("test_")]
    digest = hashlib.sha256()
    for file in [*files, *(root / "tests" / "validation" / "trial" / name for name in _OWN)]:
        tree = ast.parse(file.read_text())
        for node in ast.walk(tree):
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                node.value = ast.Constant("")
        digest.update(ast.dump(tree).encode())
    return digest.hexdigest()[:16]


def identity(cells: Sequence[Cell], base_seed: int) -> dict[str, Any]:
    """What a file of records must agree in before more are added to it; how many boards a cell has may change."""
    return {
        "format": 2,
        "base_seed": base_seed,
        "cells": {
            cell.name: {**asdict(replace(cell, n=0)), "n": None, "planted": list(cell.planted)} for cell in cells
        },
        "code": fingerprint(),
        "kinds": {cell.design: KINDS[cell.design] for cell in cells},
        "sensors": {cell.design: list(SENSORS[cell.design]) for cell in cells},
    }
