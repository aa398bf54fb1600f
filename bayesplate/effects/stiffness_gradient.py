"""Stiffness gradient: the wood is stiffer along the grain at one end of the board than at the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.gradients import GradientAlongX
from bayesplate.plate.fields import TermGroup


@dataclass(frozen=True)
class StiffnessGradient(GradientAlongX):
    """E_x 1 + g (s - 1/2) times its mean, s from 0 to 1 along the whole board; the density stays.

    Where the plate has the curvatures a along and b across the grain, twice its bending energy per area is
    E_x h^3 / 12 a^2 + D_y (b + nu_xy a)^2. The first part alone grows, so D_x grows by g times D_x - nu_xy^2 D_y. E_y,
    G_xy and nu_xy stay, and with them D_s. D_y and nu_xy D_y stay as well: strictly they hold E_x in
    1 - nu_xy^2 E_y / E_x and fall by a hundredth of g where it grows by g, which is 0.2 cents at g = 0.1.
    """

    name: ClassVar[str] = "stiffness_gradient"
    sentence: ClassVar[str] = "The wood is stiffer towards one end, so modes that bend it there ring higher."
    default: ClassVar[Quantity] = Quantity.from_mean(0.0, 0.08, "normal")
    source: ClassVar[str] = "normal: E_x varies by some per cent along one plank; a board is not stiffer at a known end"

    groups: ClassVar[tuple[TermGroup, ...]] = ("along",)

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        """E_x alone grows, which then is no longer E_y."""
        return "the board is isotropic: it cannot be stiffer along x alone" if board.isotropic else ""
