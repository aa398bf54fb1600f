"""Fluid loading: the board carries the air or the water around it along, computed from its size."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from bayesplate.board.board import Board, Values, board_density, vibrating_lengths
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Contribution, Effect, Floats, Mass, Scope
from bayesplate.effects.part import aspect_ratio_of
from bayesplate.plate.air import air_mass
from bayesplate.plate.fields import Outline
from bayesplate.plate.terms import ProjectedTerms

DEFAULT_DENSITY = Quantity.exact(1.2)
UNKNOWN_BAFFLE = Quantity.from_mean(0.5, 1.0, "normal", lower=0.0, upper=1.0)
BAFFLES = {"none": Quantity.exact(0.0), "full": Quantity.exact(1.0)}
HEAVIEST_GAS = 100.0
WATER, NEAR_WATER = 997.0, 50.0
"""Densities, kg m^-3, by which the fluid is called air, water, or a fluid."""
_SOURCES = (
    "air at 20 degrees Celsius near sea level",
    "nearly uniform from the open air (0) to a rigid wall around the board (1)",
)


@dataclass(frozen=True)
class FluidLoading(Effect):
    """The mass of the fluid, between that of the board in the open and that of a board in a rigid wall.

    Nothing of its size is fitted but the baffle's share: potential flow gives it within 20 %.
    """

    aspect_ratio: float = 1.0  # L_x / L_y of the vibrating part, at nominal sizes
    density: Quantity = DEFAULT_DENSITY  # kg m^-3
    baffle: Quantity = UNKNOWN_BAFFLE  # 0 in the open, 1 in a wall
    edge: Outline | None = None  # where the plate ends; None: the whole rectangle

    name: ClassVar[str] = "fluid_loading"
    scope: ClassVar[Scope] = "setup"
    is_of_campaign: ClassVar[bool] = True
    sentence: ClassVar[str] = (
        "The board carries the air or the water around it along, which makes it heavier, most of all in its low modes."
    )

    @classmethod
    def of(cls, board: Board, setup: Setup) -> FluidLoading:
        fluid = setup.fluid
        return cls(
            owner=setup.owner,
            aspect_ratio=aspect_ratio_of(board.nominal(), setup),
            density=fluid.density if fluid and fluid.density else DEFAULT_DENSITY,
            baffle=BAFFLES[fluid.baffle] if fluid and fluid.baffle else UNKNOWN_BAFFLE,
        )

    def in_setup(self, board: Board, setup: Setup) -> FluidLoading:
        """This fluid around the board in another setup, unless that states its own fluid."""
        if setup.fluid is not None:
            return self.of(board, setup)
        return replace(self, owner=setup.owner, aspect_ratio=aspect_ratio_of(board.nominal(), setup))

    @classmethod
    def is_wanted(cls, setup: Setup) -> bool:
        return setup.fluid is not None

    @property
    def fluid(self) -> str:
        if self.density.mean < HEAVIEST_GAS:
            return "air"
        return "water" if abs(self.density.mean - WATER) < NEAR_WATER else "fluid"

    @classmethod
    def is_known(cls, board: Board) -> bool:
        """Always: it is computed from the board, and air is around every one."""
        return True

    def parameters(self) -> tuple[Parameter, ...]:
        """Density of the fluid and share of the baffle; without density there is no fluid, whatever the baffle."""
        flags = self.density is not DEFAULT_DENSITY, self.baffle is not UNKNOWN_BAFFLE
        sources = ("" if is_stated else source for is_stated, source in zip(flags, _SOURCES, strict=True))
        density_source, baffle_source = sources
        return (
            self.parameter("density", self.density, "kg/m^3", 0.0, density_source, f"density of the {self.fluid}"),
            self.parameter("baffle", self.baffle, "1", 0.0, baffle_source),
        )

    def within_outline(self, shaped: Effect) -> FluidLoading:
        return replace(self, edge=shaped.outline())

    def contributions(self) -> tuple[Contribution, ...]:
        """The fluid of a plate in the open and of one in a wall, each with its share; one alone where that is known.

        The mass of the fluid in a volume of the area to the power 3/2, relative to the plate's.
        """

        def weight(values: Values, setup: Setup, is_baffled: bool) -> Floats:
            length_x, length_y = vibrating_lengths(values, setup)
            fluid = (
                self.value(values, "density")
                * np.sqrt(length_x * length_y)
                / (board_density(values) * values["thickness"])
            )
            baffle = self.value(values, "baffle")
            return fluid * (baffle if is_baffled else 1.0 - baffle)

        is_baffle_known = self.baffle.is_exact and self.baffle.mean in (0.0, 1.0)
        cases = (bool(self.baffle.mean),) if is_baffle_known else (False, True)
        return tuple(
            Mass(
                ProjectedTerms(
                    partial(air_mass, aspect_ratio=self.aspect_ratio, is_baffled=is_baffled, outline=self.edge)
                ),
                partial(weight, is_baffled=is_baffled),
            )
            for is_baffled in cases
        )
