"""Transverse shear: the cross-section of a plate does not stay normal to its middle, most of all across the grain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from bayesplate.board.board import Board, Values
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Effect, Ratio, Scope
from bayesplate.plate.terms import Theory

_SOURCE = "spruce, log-normal around published values of G_xz 0.5-0.75 GPa and G_yz 20-40 MPa, widened for other woods"
_RIGID_MODULUS = 1e13
"""A modulus, Pa, at which the frequencies are those of the thin plate to a hundredth of a cent."""

DEFAULT_XZ = Quantity.from_median(0.62e9, 1.5)
DEFAULT_YZ = Quantity.from_median(0.030e9, 1.8)
_RATIO_SOURCE = "log-normal around the published G_xz / E_x 0.05-0.12 and G_yz / E_y 0.025-0.08 of spruces"


@dataclass(frozen=True)
class TransverseShear(Effect):
    """The shear-flexible plate in place of the thin one; a modulus (Pa) that is None is G_xy."""

    xz: Quantity | None = DEFAULT_XZ
    yz: Quantity | None = DEFAULT_YZ

    name: ClassVar[str] = "transverse_shear"
    scope: ClassVar[Scope] = "board"
    is_of_campaign: ClassVar[bool] = True
    theory: ClassVar[Theory] = "shear-flexible"
    ratios: ClassVar[Mapping[str, Ratio]] = {
        "G_xz": Ratio("E_x", Quantity.from_median(0.060, 1.5), _RATIO_SOURCE),
        "G_yz": Ratio("E_y", Quantity.from_median(0.036, 1.8), _RATIO_SOURCE),
    }
    sentence: ClassVar[str] = "The board gives way in shear through its thickness, so higher modes ring lower."

    references: ClassVar[tuple[str, ...]] = (
        "E. Reissner: The effect of transverse shear deformation on the bending of elastic plates. J. Appl. Mech. 12, "
        "A69-A77 (1945). [the plate theory]",
        "R. D. Mindlin: Influence of rotatory inertia and shear on flexural motions of isotropic, elastic plates. J. "
        "Appl. Mech. 18, 31-38 (1951), doi:10.1115/1.4010217. [the plate theory]",
        "M. Endo, N. Kimura: An alternative formulation of the boundary value problem for the Timoshenko beam and "
        "Mindlin plate. J. Sound Vib. 301, 355-373 (2007). [shear strains as unknowns]",
    )

    @classmethod
    def of(cls, board: Board, setup: Setup) -> TransverseShear:
        if board.isotropic:
            return cls(xz=board.shear_xz, yz=board.shear_yz)
        return cls(xz=board.shear_xz or DEFAULT_XZ, yz=board.shear_yz or DEFAULT_YZ)

    @classmethod
    def is_known(cls, board: Board) -> bool:
        """Always: moduli that the card does not state are published."""
        return True

    def parameters(self) -> tuple[Parameter, ...]:
        """G_xz and G_yz, where they are not G_xy; a plate stiffer than any solid does not give way in shear."""
        moduli = (("G_xz", self.xz, DEFAULT_XZ), ("G_yz", self.yz, DEFAULT_YZ))
        return tuple(
            self.parameter(key, prior, "Pa", _RIGID_MODULUS, _SOURCE if prior is default else "")
            for key, prior, default in moduli
            if prior is not None
        )

    def adjusted(self, values: Values) -> Values:
        """The values with the moduli that are not G_xy under the names that the shear-flexible plate knows."""
        keys = (key for key, modulus in (("G_xz", self.xz), ("G_yz", self.yz)) if modulus is not None)
        return {**values, **{key: self.value(values, key) for key in keys}}
