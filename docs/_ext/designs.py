"""Boards that were never built: an ideal plate of known constants, in the setups that the pages compare.

The paper's cantilever board with the constants of its simulations. The frequencies are solved for when the pages are
built and rounded as a careful reading would be; the noise that a card states is that of a real bench.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bayesplate.board.board import Board
from bayesplate.board.material import rigidities
from bayesplate.commands.prepare import prepare
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.system import system_of

E_X, E_Y, G_XY = 10.7e9, 0.716e9, 0.50e9
"""The paper's simulation inputs, Pa."""

CANTILEVER = ("(1,0)", "(1,1)", "(2,0)", "(1,2)", "(2,1)", "(2,2)")
THREE_MORE = ("(3,0)", "(1,3)", "(3,1)")
FREE = ("(1,1)", "(2,0)", "(2,1)", "(0,2)", "(1,2)", "(3,0)")
NOISE = "noise_percent = { median = 0.3, factor = 1.65 }"

HEAD = """\
# Computed, not measured: an ideal thin plate with the constants of the paper's simulations.
format = 1
name = "{name}"

[plate]
length_x_mm = 253
length_y_mm = 114
thickness_mm = 3
density_kg_m3 = 473.9

[material]
poisson_xy = 0.51
"""
SETUPS = {
    "cantilever": """
[[setup]]
name = "cantilever"
edges = {{ x0 = "clamped", x1 = "free", y0 = "free", y1 = "free" }}
clamped_mm = {{ x0 = 30 }}
first_label = [1, 0]
resolution_hz = 0.1
{noise}
""",
    "free": """
[[setup]]
name = "free"
edges = {{ x0 = "free", x1 = "free", y0 = "free", y1 = "free" }}
resolution_hz = 0.1
{noise}
""",
}
DESIGNS: Mapping[str, Mapping[str, Sequence[str]]] = {
    "six-modes": {"cantilever": CANTILEVER},
    "nine-modes": {"cantilever": (*CANTILEVER, *THREE_MORE)},
    "two-ways": {"cantilever": CANTILEVER, "free": FREE},
}


def write_designs(folder: Path) -> None:
    """Write the card of every design into a folder."""
    for name, labels in DESIGNS.items():
        path = folder / f"{name}.toml"
        path.write_text(_card(name, {s: {k: 50.0 * i for i, k in enumerate(ks, 1)} for s, ks in labels.items()}))
        solved = _solved(prepare(path).board)
        path.write_text(_card(name, solved))


def _card(name: str, frequencies: Mapping[str, Mapping[str, float]]) -> str:
    parts = [HEAD.format(name=name)]
    for setup, by_label in frequencies.items():
        parts.append(SETUPS[setup].format(noise=NOISE))
        parts.append("[setup.frequencies_hz]\n" + "".join(f'"{k}" = {hz:.1f}\n' for k, hz in by_label.items()))
    return "".join(parts)


def _solved(board: Board) -> dict[str, dict[str, float]]:
    """Frequencies of every labelled mode of a board with the constants above, Hz."""
    nominal = board.nominal()
    constants = rigidities(E_X, E_Y, G_XY, nominal["thickness"], nominal["poisson_xy"])
    values = nominal | constants._asdict()
    solved = {}
    for setup in board.setups:
        hertz = np.exp(setup_model(system_of(board, setup), values).log_frequencies(values, "linear")[0])
        solved[setup.name] = {str(label): float(one) for label, one in zip(setup.labels, hertz, strict=True)}
    return solved
