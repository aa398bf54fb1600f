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
from bayesplate.plate.fields import UNIFORM, Fabric, TermGroup, term_field_pairs
from bayesplate.plate.forms import Forms
from bayesplate.plate.line import Line
from bayesplate.plate.terms import Kinematics, Parity, PlateTerm, StrainPair, Term


@dataclass(frozen=True, eq=False)
class Plate(Forms):
    """A plate on two sides, class by class."""

    @cached_property
    def classes(self) -> tuple[SymmetryClass, ...]:
        """The symmetry classes, the even one first."""
        return tuple(SymmetryClass(self, parity) for parity in self.parities)

    def symmetry_class(self, parity: Parity) -> SymmetryClass:
        return next(candidate for candidate in self.classes if candidate.parity == parity)


def plate_of(kinematics: Kinematics, x: Line, y: Line, fabric: Fabric = UNIFORM) -> Plate:
    """A plate on two sides, with its own terms alone, each once for every field of its group (`term_field_pairs`).

    The line of a side whose halves differ must not be split.
    """
    groups = kinematics.groups(fabric.is_turned)
    weights = fabric.weights({*groups[0], *groups[1]}, x, y)
    counts = {group: len(grids) for group, grids in weights.items()}

    def terms(pairs: Sequence[StrainPair], group_of: Sequence[TermGroup]) -> list[tuple[Term, Floats | None]]:
        return [(PlateTerm(pairs[term]), weights[group_of[term]][k]) for term, k in term_field_pairs(group_of, counts)]

    return Plate(
        kinematics, x, y, tuple(terms(kinematics.stiffnesses, groups[0])), tuple(terms(kinematics.masses, groups[1]))
    )
