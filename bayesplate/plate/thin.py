"""The thin plate: four stiffness terms and a mass on the unit square.

    omega^2 = phi' (theta_xx K_xx + theta_yy K_yy + theta_mix K_mix + theta_xy K_xy) phi / mu phi' M phi

with K_xx = int w_xx^2, K_yy = int w_yy^2, K_mix = 2 int w_xx w_yy (the 2 is inside, once) and K_xy = int w_xy^2.
"""

from __future__ import annotations

from functools import lru_cache

from bayesplate.board.setup import EdgeConditions
from bayesplate.plate.line import line
from bayesplate.plate.plate import Plate, plate_of
from bayesplate.plate.terms import Derivative, Kinematics

THIN_TERMS = ("xx", "yy", "mix", "xy")


THIN = Kinematics(
    fields=("w",),
    strains={
        "w": (Derivative(1.0, "w", 0, 0),),
        "slope_x": (Derivative(1.0, "w", 1, 0),),
        "slope_y": (Derivative(1.0, "w", 0, 1),),
        "turn_x": (Derivative(1.0, "w", 1, 0),),
        "turn_y": (Derivative(1.0, "w", 0, 1),),
        "bend_x": (Derivative(1.0, "w", 2, 0),),
        "bend_y": (Derivative(1.0, "w", 0, 2),),
        "twist": (Derivative(1.0, "w", 1, 1),),
        "twice_twist": (Derivative(2.0, "w", 1, 1),),
    },
    # The last two, 4 int w_xx w_xy and 4 int w_yy w_xy, are there where the grain runs at an angle.
    stiffnesses=(
        ("bend_x", "bend_x"),
        ("bend_y", "bend_y"),
        ("bend_x", "bend_y"),
        ("twist", "twist"),
        ("bend_x", "twice_twist"),
        ("bend_y", "twice_twist"),
    ),
    masses=(("w", "w"),),
    groups_of_stiffnesses=("along", "bending", "bending", "bending"),
    turned_groups=("along",) * 6,  # the modulus along a turned grain has a part in every term
    groups_of_masses=("mass",),
)


@lru_cache(maxsize=16)
def thin_plate(ends_x: EdgeConditions, ends_y: EdgeConditions, n_x: int, n_y: int) -> Plate:
    """The bare thin plate, its terms as `THIN_TERMS`; the result is shared, so it must not be changed.

    Ducceschi et al., eq. (1) and (2), as energies.
    """
    return plate_of(THIN, line(ends_x, n_x), line(ends_y, n_y))
