"""The thin plate: four stiffness terms and a mass on the unit square.

    omega^2 = phi' (theta_xx K_xx + theta_yy K_yy + theta_mix K_mix + theta_xy K_xy) phi / mu phi' M phi

with K_xx = int w_xx^2, K_yy = int w_yy^2, K_mix = 2 int w_xx w_yy (the 2 is inside, once) and K_xy = int w_xy^2.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bayesplate.modes.energies import Derivative, Groups, Kinematics, Piece, assembled_plate, deflected
from bayesplate.modes.fields import Fabric, Floats, Outline
from bayesplate.modes.line import Line, line
from bayesplate.modes.plate import Beams, KronSum, PlateMatrices
from bayesplate.plate.setup import Ends

THIN_TERMS = ("xx", "yy", "mix", "xy")

_DEFLECTION = (Derivative(1.0, "w", 0, 0),)
_SLOPE_X = (Derivative(1.0, "w", 1, 0),)
_SLOPE_Y = (Derivative(1.0, "w", 0, 1),)
_BEND_X = (Derivative(1.0, "w", 2, 0),)
_BEND_Y = (Derivative(1.0, "w", 0, 2),)
_TWIST = (Derivative(1.0, "w", 1, 1),)
_TWICE_TWIST = (Derivative(2.0, "w", 1, 1),)


def thin_groups(is_turned: bool = False) -> Groups:
    """Group of each stiffness and of each mass term that is the thin plate's own.

    Where the grain runs at an angle, the modulus along it has a part in every term.
    """
    return (("along",) * 6 if is_turned else ("along", "bending", "bending", "bending")), ("mass",)


THIN = Kinematics(
    fields={"w": (Piece("w", "deflected", "deflected"),)},
    # The last two, 4 int w_xx w_xy and 4 int w_yy w_xy, are there where the grain runs at an angle.
    stiffnesses=(
        (_BEND_X, _BEND_X),
        (_BEND_Y, _BEND_Y),
        (_BEND_X, _BEND_Y),
        (_TWIST, _TWIST),
        (_BEND_X, _TWICE_TWIST),
        (_BEND_Y, _TWICE_TWIST),
    ),
    masses=((_DEFLECTION, _DEFLECTION),),
    turns=(_SLOPE_X, _SLOPE_Y),
    functions=lambda side, parity: {"deflected": deflected(side, parity)},
    groups=thin_groups,
)


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
    return assembled_plate(THIN, line(ends_x, n_x), line(ends_y, n_y))


def within_outline(x: Line, y: Line, a: Beams, b: Beams, outline: Outline | None) -> KronSum:
    """Integral of two derivatives of the deflection, orders along x and y, within an outline; None: everywhere.

    The first one is that of the rows, the second one that of the columns.
    """
    kept_x, kept_y = (np.ix_(side.kept, side.kept) for side in (x, y))
    measure = Fabric(outline=outline).inside(x, y)
    return tuple((along_x[a[0], b[0]][kept_x], along_y[a[1], b[1]][kept_y]) for along_x, along_y in measure)


def mean_deflections(x: Line, y: Line, deflections: Floats, outline: Outline | None) -> Floats:
    """Integrals over the unit square, or what an outline leaves of it, of (n, n_dof_x, n_dof_y) deflections: (n,)."""
    measure = Fabric(outline=outline).inside(x, y)
    return np.asarray(sum(np.einsum("i,kij,j->k", x.load(a), deflections, y.load(b)) for a, b in measure))
