"""Air loading: the board carries the air around it along, computed from its size, with or without a baffle."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np

from bayesplate.effects.base import Effect, EffectParameter, Floats, Scope
from bayesplate.modes.air import air_mass
from bayesplate.modes.plate import Projection
from bayesplate.plate.board import Board, Values, density, vibrating_lengths
from bayesplate.plate.setup import Setup
from bayesplate.quantities import Quantity

DEFAULT_DENSITY = Quantity.exact(1.2)
UNKNOWN_BAFFLE = Quantity.from_mean(0.5, 1.0, "normal", lower=0.0, upper=1.0)
BAFFLES = {"none": Quantity.exact(0.0), "full": Quantity.exact(1.0)}
_DENSITY_SOURCE = "air at 20 degrees Celsius near sea level, within 5 %"
_BAFFLE_SOURCE = "nearly uniform from the open air (0) to a rigid wall around the board (1)"


@dataclass(frozen=True)
class AirLoading(Effect):
    """The mass of the air, between that of the board in the open and that of a board in a rigid wall.

    Nothing of its size is fitted but the baffle's share: potential flow gives it within 20 %.

    Attributes
    ----------
    aspect_ratio : float
        L_x / L_y of the vibrating part, at nominal sizes.
    density : Quantity, kg m^-3
    baffle : Quantity
        0 in the open, 1 in a wall.
    """

    aspect_ratio: float = 1.0
    density: Quantity = DEFAULT_DENSITY
    baffle: Quantity = UNKNOWN_BAFFLE

    name: ClassVar[str] = "air_loading"
    scope: ClassVar[Scope] = "setup"
    sentence: ClassVar[str] = "The board carries air along, which makes it heavier, most of all in its low modes."

    @classmethod
    def of(cls, board: Board, setup: Setup) -> AirLoading:
        """The effect with what the setup declares of its air."""
        length_x, length_y = vibrating_lengths(board.nominal(), setup)
        declared = setup.air
        return cls(
            setup_name=setup.name,
            aspect_ratio=float(length_x / length_y),
            density=declared.density if declared and declared.density else DEFAULT_DENSITY,
            baffle=BAFFLES[declared.baffle] if declared and declared.baffle else UNKNOWN_BAFFLE,
        )

    @classmethod
    def is_implied(cls, board: Board) -> bool:
        """Whether a setup of the board declares its air."""
        return any(setup.air is not None for setup in board.setups)

    def parameters(self) -> tuple[EffectParameter, ...]:
        """Density of the air and share of the baffle."""
        return (
            EffectParameter("density", "kg/m^3", self.density, _DENSITY_SOURCE),
            EffectParameter("baffle", "1", self.baffle, _BAFFLE_SOURCE),
        )

    def projected_masses(self) -> tuple[Projection, ...]:
        """The air of a plate in the open and of one in a wall; one of them where the baffle is known."""
        return tuple(partial(air_mass, aspect_ratio=self.aspect_ratio, is_baffled=b) for b, _ in self._shares())

    def mass_weights(self, values: Values, setup: Setup) -> tuple[Floats, ...]:
        """Mass of the air in a volume of the area to the power 3/2, relative to the plate's, shared by the two."""
        length_x, length_y = vibrating_lengths(values, setup)
        air = self.value(values, "density") * np.sqrt(length_x * length_y) / (density(values) * values["thickness"])
        baffle = self.value(values, "baffle")
        return tuple(air * share(baffle) for _, share in self._shares())

    def _shares(self) -> tuple[tuple[bool, Callable[[Floats], Floats]], ...]:
        """Whether there is a wall, and the share of that case."""
        cases: tuple[tuple[bool, Callable[[Floats], Floats]], ...] = ((False, lambda b: 1.0 - b), (True, lambda b: b))
        if self.baffle.is_exact and self.baffle.mean in (0.0, 1.0):
            return (cases[int(self.baffle.mean)],)
        return cases
