"""The shear-flexible plate as a budget of energies: the thin plate's terms, two shear stiffnesses, two rotary inertias.

Unknowns on the unit square are the deflection w and the shear strains g_x = L_x gamma_x and g_y = L_y gamma_y; the
cross-section turns by (w_x - g_x) / L_x and (w_y - g_y) / L_y where a thin plate has the slope. So

    K_xx = int (w_xx - g_x,x)^2                       K_yy = int (w_yy - g_y,y)^2
    K_mix = 2 int (w_xx - g_x,x) (w_yy - g_y,y)       K_xy = int (w_xy - g_x,y / 2 - g_y,x / 2)^2
    K_shear_x = int g_x^2                             K_shear_y = int g_y^2
    M = int w^2                                       M_x = int (w_x - g_x)^2,  M_y = int (w_y - g_y)^2

keep the thin plate's weights, joined by S_x L_y / (L_x m) and S_y L_x / (L_y m) for shear, S_x = kappa h G_xz and
S_y = kappa h G_yz, and by h^2 / (12 L_x^2) and h^2 / (12 L_y^2) for rotary inertia (m: the vibrating mass). Because the
strains are unknowns themselves, stiff shear drives them to zero and leaves the thin plate of the same functions: there
is nothing to lock.
"""

from __future__ import annotations

from functools import lru_cache

from bayesplate.modes.energies import Derivative, Functions, Groups, Kinematics, Piece, assembled_plate, deflected
from bayesplate.modes.fields import Group
from bayesplate.modes.hermite import even_and_odd, kept_unknowns, slopes_as_values
from bayesplate.modes.line import Line, line
from bayesplate.modes.plate import PlateMatrices
from bayesplate.modes.thin import THIN_TERMS, thin_groups
from bayesplate.plate.setup import Ends

SHEAR_TERMS = (*THIN_TERMS, "shear_x", "shear_y")
SHEAR_MASSES = ("board", "rotary_x", "rotary_y")

SHEAR_CORRECTION = 5.0 / 6.0
"""kappa: what the parabolic course of the shear stress over the thickness leaves of the shear stiffness."""

SHEAR_ELEMENTS_PER_SIDE = 16
"""Elements per side for `bayesplate.modes.mesh.mesh`: six modes within 0.15 cent, twelve within 0.3, in about 60 ms."""

_DEFLECTION = (Derivative(1.0, "w", 0, 0),)
_SHEAR_X = (Derivative(1.0, "g_x", 0, 0),)
_SHEAR_Y = (Derivative(1.0, "g_y", 0, 0),)
_TURN_X = (Derivative(1.0, "w", 1, 0), Derivative(-1.0, "g_x", 0, 0))
_TURN_Y = (Derivative(1.0, "w", 0, 1), Derivative(-1.0, "g_y", 0, 0))
_BEND_X = (Derivative(1.0, "w", 2, 0), Derivative(-1.0, "g_x", 1, 0))
_BEND_Y = (Derivative(1.0, "w", 0, 2), Derivative(-1.0, "g_y", 0, 1))
_TWIST = (Derivative(1.0, "w", 1, 1), Derivative(-0.5, "g_x", 0, 1), Derivative(-0.5, "g_y", 1, 0))

_TWICE_TWIST = tuple(d._replace(factor=2.0 * d.factor) for d in _TWIST)


def _functions(side: Line, parity: int) -> Functions:
    """Functions of one class along one side.

    Returns
    -------
    dict of sparse array
        "deflected": of the deflection; "strained": of the strain along this side, of opposite parity and without its
        value at ends that hold the turning; "tied": that value, which is the slope of the deflection.
    """
    from scipy.sparse import csr_array, identity

    strain_held = slopes_as_values(side.held)
    kept = kept_unknowns(strain_held, side.n_elements)
    free = identity(2 * (side.n_elements + 1), format="csr")
    strained = free[:, kept]
    if side.is_symmetric:
        strained = strained @ even_and_odd(side.ends, side.n_elements, kept)[-1 - parity]
    values = [2 * node for end, node in zip(strain_held, (0, side.n_elements), strict=True) if end == "supported"]
    slopes = [value + 1 for value in values]
    value_from_slope = csr_array(([1.0] * len(values), (values, slopes)), shape=free.shape)
    of_deflection = deflected(side, parity)
    return {"deflected": of_deflection, "strained": strained, "tied": value_from_slope @ of_deflection}


def shear_groups(is_turned: bool = False) -> Groups:
    """Group of each stiffness and of each mass term that is the shear-flexible plate's own.

    Where the grain runs at an angle, the terms that couple bending with twist and the two shear strains come last.
    """
    bending, _ = thin_groups(is_turned)
    own, coupling = bending[: len(THIN_TERMS)], bending[len(THIN_TERMS) :]
    strains: tuple[Group, ...] = ("shear",) if is_turned else ()
    return (*own, "shear", "shear", *coupling, *strains), ("mass", "rotary", "rotary")


SHEAR_FLEXIBLE = Kinematics(
    fields={
        "w": (Piece("w", "deflected", "deflected"),),
        "g_x": (Piece("g_x", "strained", "deflected"), Piece("w", "tied", "deflected")),
        "g_y": (Piece("g_y", "deflected", "strained"), Piece("w", "deflected", "tied")),
    },
    # The last three are there where the grain runs at an angle.
    stiffnesses=(
        (_BEND_X, _BEND_X),
        (_BEND_Y, _BEND_Y),
        (_BEND_X, _BEND_Y),
        (_TWIST, _TWIST),
        (_SHEAR_X, _SHEAR_X),
        (_SHEAR_Y, _SHEAR_Y),
        (_BEND_X, _TWICE_TWIST),
        (_BEND_Y, _TWICE_TWIST),
        (_SHEAR_X, _SHEAR_Y),
    ),
    masses=((_DEFLECTION, _DEFLECTION), (_TURN_X, _TURN_X), (_TURN_Y, _TURN_Y)),
    turns=(_TURN_X, _TURN_Y),
    functions=_functions,
    groups=shear_groups,
)


@lru_cache(maxsize=16)
def shear_flexible_plate(ends_x: Ends, ends_y: Ends, n_x: int, n_y: int) -> PlateMatrices:
    """Assemble the shear-flexible plate; the result is shared, so it must not be changed.

    A free edge holds nothing. A supported one (a hard support) holds the deflection and the turning along the edge. A
    clamped one holds the turning across it as well, w_n = g_n: the deflection meets the clamp at the angle of the shear
    strain.

    Parameters
    ----------
    ends_x, ends_y : tuple of str
        Condition at the two ends of each side: (x0, x1) and (y0, y1).
    n_x, n_y : int
        Numbers of elements along x and y, graded towards free edges.

    Returns
    -------
    PlateMatrices
        Stiffness terms in the order of `SHEAR_TERMS`, mass terms in that of `SHEAR_MASSES`.

    References
    ----------
    Reissner (1945) and Mindlin (1951); the shear strains as unknowns in place of the turning: Endo and Kimura (2007).
    """
    x, y = (line(ends, n, is_sheared=True) for ends, n in ((ends_x, n_x), (ends_y, n_y)))
    return assembled_plate(SHEAR_FLEXIBLE, x, y)
