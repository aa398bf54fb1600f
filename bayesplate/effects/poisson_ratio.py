"""Poisson ratio: nu_xy was taken from a table, and this board's own differs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from bayesplate.board.board import Board
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Effect, Scope

FREE_POISSON = Quantity.from_mean(0.4, 0.15, "normal", lower=0.0, upper=0.9)
FREE_ISOTROPIC = Quantity.from_mean(0.3, 0.1, "normal", lower=0.0, upper=0.5)
_ISOTROPIC_SOURCE = "normal between 0 and 0.5: foams and glass lie near 0.2, most metals near 0.3, acrylic near 0.37"
_SOURCE = (
    "normal between 0 and 0.9: published nu_LR and nu_LT of woods lie between 0.3 and 0.6; positive energy, "
    "nu_xy^2 < E_x / E_y, holds besides"
)


@dataclass(frozen=True)
class PoissonRatio(Effect):
    """The board's own nu_xy in place of the card's number.

    Its parameter is the board's input `poisson_xy` itself: once declared, every use of that input, from the weight of
    the mixed term to E from D, takes the free value.
    """

    stated: float = FREE_POISSON.mean  # the card's own number
    is_isotropic: bool = False  # G_xy follows from it, too

    name: ClassVar[str] = "poisson_ratio"
    scope: ClassVar[Scope] = "board"
    sentence: ClassVar[str] = "This wood narrows under a pull by another share than the table says."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> PoissonRatio:
        return cls(stated=board.inputs["poisson_xy"].mean, is_isotropic=board.isotropic)

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        """Only a ratio that the card gives as exact can be set free."""
        stated = board.inputs["poisson_xy"]
        if not stated.is_exact and stated != (FREE_ISOTROPIC if board.isotropic else FREE_POISSON):
            return f"poisson_xy is already uncertain ({stated.mean:g} ± {stated.sd:g}) and so part of every fit"
        return ""

    def parameters(self) -> tuple[Parameter, ...]:
        """The Poisson ratio nu_xy, in the place of the board's own; the card's number is its null value."""
        prior, source = (FREE_ISOTROPIC, _ISOTROPIC_SOURCE) if self.is_isotropic else (FREE_POISSON, _SOURCE)
        free = self.parameter("nu_xy", prior, "1", self.stated, source)
        return (replace(free, replaces="poisson_xy", display_name="Poisson ratio nu_xy"),)
