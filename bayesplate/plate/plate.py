"""A plate as a budget of energies: stiffness terms and mass terms on the unit square, and what each weighs.

    omega^2 = phi' (sum_i theta_i K_i) phi / phi' (sum_j mu_j M_j) phi

On products of the two sides' functions every strain is known at every Gauss point from one matrix along x and one along
y. The side lengths appear in the weights theta and mu only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from bayesplate.arrays import Floats
from bayesplate.plate.classes import SymmetryClass
from bayesplate.plate.fields import UNIFORM, Fabric, Group, layout
from bayesplate.plate.forms import Forms
from bayesplate.plate.line import Line
from bayesplate.plate.terms import Kinematics, OverPlate, Pair, Parity, Term


@dataclass(frozen=True, eq=False)
class Plate(Forms):
    """A plate on two sides, class by class."""

    @cached_property
    def classes(self) -> tuple[SymmetryClass, ...]:
        """The symmetry classes, the even one first."""
        return tuple(SymmetryClass(self, parity) for parity in self.parities)

    def symmetry_class(self, parity: Parity) -> SymmetryClass:
        return next(one for one in self.classes if one.parity == parity)


def plate_of(kinematics: Kinematics, x: Line, y: Line, fabric: Fabric = UNIFORM) -> Plate:
    """A plate on two sides, with its own terms alone, as often as `layout` has fields for them.

    A line is whole along a side along which the halves differ.
    """
    groups = kinematics.groups(fabric.is_turned)
    weights = fabric.weights({*groups[0], *groups[1]}, x, y)
    counts = {group: len(made) for group, made in weights.items()}

    def own(pairs: Sequence[Pair], group: Sequence[Group]) -> list[tuple[Term, Floats | None]]:
        return [(OverPlate(pairs[term]), weights[group[term]][k]) for term, k in layout(group, counts)]

    return Plate(
        kinematics, x, y, tuple(own(kinematics.stiffnesses, groups[0])), tuple(own(kinematics.masses, groups[1]))
    )
