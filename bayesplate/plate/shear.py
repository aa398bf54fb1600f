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

from bayesplate.board.setup import EdgeConditions
from bayesplate.plate.line import line
from bayesplate.plate.plate import Plate, plate_of
from bayesplate.plate.terms import Derivative, Kinematics
from bayesplate.plate.thin import THIN, THIN_TERMS

SHEAR_TERMS = (*THIN_TERMS, "shear_x", "shear_y")
SHEAR_MASSES = ("board", "rotary_x", "rotary_y")

SHEAR_CORRECTION = 5.0 / 6.0
"""kappa: what the parabolic course of the shear stress over the thickness leaves of the shear stiffness."""

SHEAR_ELEMENTS_PER_SIDE = 16
"""Elements per side for `bayesplate.plate.mesh.mesh`: six modes within 0.15 cent, twelve within 0.3."""

_TWIST = (Derivative(1.0, "w", 1, 1), Derivative(-0.5, "g_x", 0, 1), Derivative(-0.5, "g_y", 1, 0))


SHEAR_FLEXIBLE = Kinematics(
    fields=("w", "g_x", "g_y"),
    strains={
        **{name: THIN.strains[name] for name in ("w", "slope_x", "slope_y")},
        "shear_x": (Derivative(1.0, "g_x", 0, 0),),
        "shear_y": (Derivative(1.0, "g_y", 0, 0),),
        "turn_x": (Derivative(1.0, "w", 1, 0), Derivative(-1.0, "g_x", 0, 0)),
        "turn_y": (Derivative(1.0, "w", 0, 1), Derivative(-1.0, "g_y", 0, 0)),
        "bend_x": (Derivative(1.0, "w", 2, 0), Derivative(-1.0, "g_x", 1, 0)),
        "bend_y": (Derivative(1.0, "w", 0, 2), Derivative(-1.0, "g_y", 0, 1)),
        "twist": _TWIST,
        "twice_twist": tuple(d._replace(factor=2.0 * d.factor) for d in _TWIST),
    },
    # The last three are there where the grain runs at an angle.
    stiffnesses=(
        *THIN.stiffnesses[: len(THIN_TERMS)],
        ("shear_x", "shear_x"),
        ("shear_y", "shear_y"),
        *THIN.stiffnesses[len(THIN_TERMS) :],
        ("shear_x", "shear_y"),
    ),
    masses=(("w", "w"), ("turn_x", "turn_x"), ("turn_y", "turn_y")),
    groups_of_stiffnesses=(*THIN.groups_of_stiffnesses, "shear", "shear"),
    turned_groups=(*THIN.turned_groups[:4], "shear", "shear", *THIN.turned_groups[4:], "shear"),
    groups_of_masses=("mass", "rotary", "rotary"),
)


@lru_cache(maxsize=16)
def shear_flexible_plate(ends_x: EdgeConditions, ends_y: EdgeConditions, n_x: int, n_y: int) -> Plate:
    """The bare shear-flexible plate, its terms as `SHEAR_TERMS` and `SHEAR_MASSES`; shared, so it must not be changed.

    A free edge holds nothing. A supported one (a hard support) holds the deflection and the turning along the edge. A
    clamped one holds the turning across it as well, w_n = g_n: the deflection meets the clamp at the angle of the shear
    strain. Reissner (1945) and Mindlin (1951); the shear strains as unknowns in place of the turning: Endo and Kimura
    (2007).
    """
    x, y = (line(ends, n, is_sheared=True) for ends, n in ((ends_x, n_x), (ends_y, n_y)))
    return plate_of(SHEAR_FLEXIBLE, x, y)
