"""Effects that can be looked at without a frequency: a sensor is weighed, a taper is read with a calliper.

An explanation with the effect expects the size that the readings say; one without it expects none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.shifts.tables import Table
from bayesplate.planning.beliefs import Beliefs, Explanation
from bayesplate.planning.gains import Readings
from bayesplate.planning.inputs_read import GRID, WEIGHED_TO

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

_CALLIPER = 2e-5
"""Of a reading of the thickness at a place, m."""
_UNEVEN = 0.005
"""Of the thickness at a place about a straight taper, over the thickness: planes and sanders leave as much."""
_PROTRACTOR = 0.5 * np.pi / 180.0


@dataclass(frozen=True)
class Look:
    """How an effect is looked at.

    Attributes
    ----------
    sentence : str
    n : int
        Readings that it takes.
    sd : callable
        From the board to the standard deviation of each of the effect's parameters, SI.
    can : callable
        Whether there is anything to look at on a board.
    """

    sentence: str
    n: int
    sd: Callable[[Board], float]
    can: Callable[[Board], bool]


def _has_unweighed(board: Board) -> bool:
    return any(item.mass is None and item.kind != "exciter" for setup in board.setups for item in setup.attached)


def _of_taper(board: Board) -> float:
    """Of a taper from readings at the grid of places: a regression on the place."""
    at_place = np.hypot(_CALLIPER / board.inputs["thickness"].mean, _UNEVEN)
    leverage = len(GRID[1]) * sum((s - 0.5) ** 2 for s in GRID[0])
    return float(at_place / np.sqrt(leverage))


LOOKS: dict[str, Look] = {
    "attached_mass": Look("Weigh what is attached to the board", 1, lambda board: WEIGHED_TO, _has_unweighed),
    "thickness_profile": Look(
        f"Read the thickness at {len(GRID[0]) * len(GRID[1])} places all over the board",
        len(GRID[0]) * len(GRID[1]),
        _of_taper,
        lambda board: not board.inputs["thickness"].has_profile,
    ),
    "grain_angle": Look(
        "Measure the angle of the grain to the long side, to half a degree", 1, lambda board: _PROTRACTOR,
        lambda board: True,
    ),
}  # fmt: skip
"""By effect."""


def look_readings(beliefs: Beliefs, found: Found, effect: str) -> Readings | None:
    """What looking at an effect would read; None where no explanation has it, or nothing is there to be looked at."""
    look = LOOKS[effect]
    if not look.can(beliefs.board) or not any(effect in one.members for one in beliefs.explanations):
        return None
    law = found.ground.candidates[effect].laws[0]
    free = law.form.free
    shift, slopes, variance = [], [], []
    for one in beliefs.explanations:
        n_u = one.mean.shape[1]
        value = np.tile([0.0 if p.null is None else p.null for p in free], (one.n_terms, 1))
        along = np.zeros((one.n_terms, len(free), n_u))
        if effect in one.members:
            table, cells, first = _own(one, found, effect)
            for j, parameter in enumerate(free):
                z, step = table.z[cells, j], table.z_slopes[cells, j]
                value[:, j] = parameter.prior.value(z)
                along[:, j, first + j] = 0.5 * (parameter.prior.value(z + step) - parameter.prior.value(z - step))
        shift.append(value)
        slopes.append(along)
        variance.append(np.full((one.n_terms, len(free)), look.sd(beliefs.board) ** 2))
    return Readings(tuple(shift), tuple(slopes), tuple(variance))


def _own(one: Explanation, found: Found, effect: str) -> tuple[Table, Rows, int]:
    """The table of one effect of an explanation, the cells of its terms there, and the first column of its tangents."""
    members = one.members
    for name, table, cells, columns in members_of(found, one):
        if name == effect:
            n_tangents = found.ground.hypotheses[one.hypothesis].table.slopes.shape[2]
            return table, cells, one.mean.shape[1] - n_tangents + columns.start
    raise ValueError(f"wanted one of {', '.join(members)}, got {effect}")


def members_of(found: Found, one: Explanation) -> list[tuple[str, Table, Rows, slice]]:
    """Each effect of an explanation with its own table, the cells of its terms there, and its tangents' columns."""
    candidates = found.ground.candidates
    if len(one.members) == 1:
        table = candidates[one.members[0]].fine
        return [(one.members[0], table, one.cells, slice(0, table.slopes.shape[2]))]
    first, second = (candidates[name].coarse for name in one.members)
    n = first.slopes.shape[2]
    of_first, of_second = np.divmod(one.cells, second.n_cells)
    return [
        (one.members[0], first, of_first, slice(0, n)),
        (one.members[1], second, of_second, slice(n, n + second.slopes.shape[2])),
    ]
