"""Transverse shear: the cross-section of a plate does not stay normal to its middle, most of all across the grain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from bayesplate.effects.base import Effect, EffectParameter, Scope, Theory
from bayesplate.plate.board import Board
from bayesplate.plate.setup import Setup
from bayesplate.quantities import Quantity

_SOURCE = "spruce, log-normal around published values of G_xz 0.5-0.75 GPa and G_yz 20-40 MPa, widened for other woods"
DEFAULT_XZ = Quantity.from_median(0.62e9, 1.5)
DEFAULT_YZ = Quantity.from_median(0.030e9, 1.8)


@dataclass(frozen=True)
class TransverseShear(Effect):
    """The shear-flexible plate in place of the thin one.

    Attributes
    ----------
    xz, yz : Quantity, Pa
        Transverse shear moduli.
    """

    xz: Quantity = DEFAULT_XZ
    yz: Quantity = DEFAULT_YZ

    name: ClassVar[str] = "transverse_shear"
    scope: ClassVar[Scope] = "board"
    theory: ClassVar[Theory] = "shear-flexible"
    sentence: ClassVar[str] = "The board gives way in shear through its thickness, so higher modes ring lower."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> TransverseShear:
        """The effect with the card's thick-plate constants where it gives them."""
        return cls(xz=board.shear_xz or DEFAULT_XZ, yz=board.shear_yz or DEFAULT_YZ)

    def parameters(self) -> tuple[EffectParameter, ...]:
        """G_xz and G_yz."""
        return (
            EffectParameter("G_xz", "Pa", self.xz, _SOURCE),
            EffectParameter("G_yz", "Pa", self.yz, _SOURCE),
        )
