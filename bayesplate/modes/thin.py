"""The thin plate: four stiffness terms and a mass on the unit square.

    omega^2 = phi' (theta_xx K_xx + theta_yy K_yy + theta_mix K_mix + theta_xy K_xy) phi / mu phi' M phi

with K_xx = int w_xx^2, K_yy = int w_yy^2, K_mix = 2 int w_xx w_yy (the 2 is inside, once) and K_xy = int w_xy^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from bayesplate.modes.fields import UNIFORM, Fabric, Floats, Group, Measure, Outline, layout
from bayesplate.modes.line import Line, line
from bayesplate.modes.plate import (
    Beams,
    Block,
    EdgeTurn,
    KronSum,
    Parity,
    PlateMatrices,
    Term,
    count_rigid,
    kron_sum,
)
from bayesplate.modes.sparse import on_one_pattern
from bayesplate.plate.setup import Ends

THIN_TERMS = ("xx", "yy", "mix", "xy")

_DERIVATIVES: tuple[tuple[Beams, Beams, float], ...] = (
    ((2, 0), (2, 0), 1.0),
    ((0, 2), (0, 2), 1.0),
    ((2, 0), (0, 2), 1.0),
    ((1, 1), (1, 1), 1.0),
    ((2, 0), (1, 1), 2.0),
    ((0, 2), (1, 1), 2.0),
)
"""Two derivatives of the deflection, orders along x and y, whose product each term integrates, and a factor; twice
where they differ, so that the matrix is symmetric. The last two couple bending with twist."""


@lru_cache(maxsize=16)
def thin_plate(ends_x: Ends, ends_y: Ends, n_x: int, n_y: int) -> PlateMatrices:
    """Assemble the thin plate from two lines; the result is shared, so it must not be changed.

    Parameters
    ----------
    ends_x, ends_y : tuple of str
        Condition at the two ends of each side: (x0, x1) and (y0, y1).
    n_x, n_y : int
        Numbers of elements along x and y.

    Returns
    -------
    PlateMatrices
        Stiffness terms in the order of `THIN_TERMS`.

    References
    ----------
    Ducceschi et al., eq. (1) and (2), as energies.
    """
    x, y = line(ends_x, n_x), line(ends_y, n_y)
    return assemble(x, y, thin_terms(x, y), thin_masses(x, y))


def thin_groups(is_turned: bool = False) -> tuple[tuple[Group, ...], tuple[Group, ...]]:
    """Group of each stiffness and of each mass term that is the thin plate's own.

    Where the grain runs at an angle, the modulus along it has a part in every term.
    """
    return (("along",) * 6 if is_turned else ("along", "bending", "bending", "bending")), ("mass",)


def thin_terms(x: Line, y: Line, fabric: Fabric = UNIFORM) -> tuple[KronSum, ...]:
    """The bending terms of the thin plate.

    Parameters
    ----------
    x, y : Line
    fabric : Fabric
        Varying properties repeat the terms in the order of `bayesplate.modes.fields.layout`.

    Returns
    -------
    tuple of KronSum
        The four of `THIN_TERMS`; 4 int w_xx w_xy and 4 int w_yy w_xy follow where the grain runs at an angle.
    """
    stiffness, _ = thin_groups(fabric.is_turned)
    measures = fabric.measures(set(stiffness), x, y)
    counts = {group: len(each) for group, each in measures.items()}

    def own(term: int, measure: Measure) -> KronSum:
        a, b, factor = _DERIVATIVES[term]
        once = _integral(measure, x, y, a, b, factor)
        return once if a == b else (*once, *_integral(measure, x, y, b, a, factor))

    return tuple(own(term, measures[stiffness[term]][k]) for term, k in layout(stiffness, counts))


def thin_masses(x: Line, y: Line, fabric: Fabric = UNIFORM) -> tuple[KronSum, ...]:
    """The board's own mass, once for each field that it takes."""
    return tuple(_integral(measure, x, y, (0, 0), (0, 0)) for measure in fabric.measures(("mass",), x, y)["mass"])


def _integral(measure: Measure, x: Line, y: Line, a: Beams, b: Beams, factor: float = 1.0) -> KronSum:
    """Integral of one derivative of the deflection (orders along x and y; rows) times another (columns)."""
    kept_x, kept_y = (np.ix_(side.kept, side.kept) for side in (x, y))
    return tuple((factor * along_x[a[0], b[0]][kept_x], along_y[a[1], b[1]][kept_y]) for along_x, along_y in measure)


def within_outline(x: Line, y: Line, a: Beams, b: Beams, outline: Outline | None) -> KronSum:
    """Integral of two derivatives of the deflection, orders along x and y, within an outline; None: everywhere."""
    return _integral(Fabric(outline=outline).inside(x, y), x, y, a, b)


def mean_deflections(x: Line, y: Line, deflections: Floats, outline: Outline | None) -> Floats:
    """Integrals over the unit square, or what an outline leaves of it, of (n, n_dof_x, n_dof_y) deflections: (n,)."""
    measure = Fabric(outline=outline).inside(x, y)
    return np.asarray(sum(np.einsum("i,kij,j->k", x.load(a), deflections, y.load(b)) for a, b in measure))


def assemble(x: Line, y: Line, stiffness: Sequence[Term], masses: Sequence[KronSum]) -> PlateMatrices:
    """A thin plate from any terms, class by class.

    Parameters
    ----------
    x, y : Line
        Unsplit along a side on which a term is not symmetric.
    stiffness : sequence of Term
    masses : sequence of KronSum
        The first is the board's own.

    Returns
    -------
    PlateMatrices
    """
    blocks = []
    terms = [*(term.on_slopes(x, y) if isinstance(term, EdgeTurn) else term for term in stiffness), *masses]
    for i, part_x in enumerate(x.parts):
        for j, part_y in enumerate(y.parts):
            matrices = [kron_sum(term, part_x, part_y) for term in terms]
            stored, indices, indptr = on_one_pattern(matrices)
            n = len(stiffness)
            parity = Parity(i, j)
            rigid = count_rigid(parity, x, y)
            blocks.append(Block(parity, stored[:n], stored[n:], indices, indptr, part_x, part_y, rigid))
    return PlateMatrices(x, y, tuple(blocks))
