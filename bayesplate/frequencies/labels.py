"""Labels that no mode of the board has: rigid motions, and modes with more nodal lines than the mesh resolves."""

from __future__ import annotations

from bayesplate.board.board import Board
from bayesplate.board.reading import NO_OFFSET
from bayesplate.board.setup import EdgeConditions, Setup
from bayesplate.errors import Fault
from bayesplate.labels import HIGHEST_ORDER, Label
from bayesplate.plate.beams import is_rigid


def label_faults(board: Board) -> list[Fault]:
    """A fault for every label of a board that its model cannot have."""
    return [
        Fault(
            f'{board.name}.toml setup "{setup.name}" frequencies_hz "{reading.label}"',
            f"a mode of a plate with edges {', '.join(f'{e} {w}' for e, w in setup.edges.items())}",
            problem,
            f"the lowest are {', '.join(str(label) for label in _example_labels(setup))}",
        )
        for setup in board.setups
        for reading in setup.readings
        if (problem := _label_problem(setup, reading.beams))
    ]


def _label_problem(setup: Setup, beams: tuple[int, int]) -> str:
    if min(beams) < 0:
        return ""  # below first_label, which is among the physical faults
    if max(beams) > HIGHEST_ORDER:
        return f"more than {HIGHEST_ORDER} nodal lines one way, beyond what the mesh resolves"
    if is_rigid(beams, setup.ends_x, setup.ends_y):
        return "a motion without bending, at 0 Hz"
    return ""


def lowest_labels(ends_x: EdgeConditions, ends_y: EdgeConditions, first: Label = NO_OFFSET) -> list[Label]:
    """Labels of modes with few nodal lines that a plate with these edges has, the fewest first."""
    beams = [(i, j) for i in range(4) for j in range(4) if not is_rigid((i, j), ends_x, ends_y)]
    return [Label(i + first.m, j + first.n) for i, j in sorted(beams, key=lambda b: (sum(b), abs(b[0] - b[1]), -b[0]))]


def _example_labels(setup: Setup) -> list[Label]:
    return lowest_labels(setup.ends_x, setup.ends_y, setup.first_label)[:5]
