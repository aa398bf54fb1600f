"""A parameter of a model: its name and owner, its prior and unit, and the value at which it changes nothing."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from bayesplate.board.quantity import Quantity


@dataclass(frozen=True)
class Owner:
    """What a parameter belongs to: the board, one of its setups, or a group of boards or setups that share it."""

    kind: Literal["board", "setup", "group"] = "board"
    name: str = ""

    @property
    def title(self) -> str:
        """The name under which results list what it owns: "board", or that of the setup or group."""
        return self.name or "board"


BOARD_OWNER = Owner()


def parameter_name(key: str, owner: Owner, effect: str = "") -> str:
    """The name of a parameter wherever it is shown: "clamp_rotation.compliance[cantilever]"; it is never parsed."""
    of_effect = f"{effect}." if effect else ""
    of_owner = f"[{owner.name}]" if owner.name else ""
    return f"{of_effect}{key}{of_owner}"


@dataclass(frozen=True)
class Parameter:
    """A quantity that a model takes: an input of the board, the noise of a setup, a constant, the size of an effect."""

    key: str  # its name among its owner's own parameters, or among those of its effect
    owner: Owner
    prior: Quantity  # SI; sign and range are its bounds, and an exact quantity fixes the parameter
    unit: str  # SI
    neutral_value: float | None = None  # the value at which it changes nothing; None for what every board has
    effect: str = ""  # empty for the board's inputs, constants and noise
    replaces: str = ""  # name of the board's own input whose place it takes
    source: str = ""  # of the prior; empty if the card states it
    display_name: str = ""  # what people call it; empty where that is its key
    description: str = ""  # what a component of an effect does to the board; empty for what has a meaning alone
    typical_value: float | None = None  # a representative size where one standard deviation above the mean is none
    assumed: Quantity | None = field(default=None, compare=False, repr=False)

    @property
    def is_assumed(self) -> bool:
        """Whether the prior is still the very object that was assumed: a stated prior replaces it."""
        return self.prior is self.assumed

    @property
    def name(self) -> str:
        """The name among all parameters of a board."""
        return self.replaces or parameter_name(self.key, self.owner, self.effect)

    @property
    def is_of_effect(self) -> bool:
        """Whether it is the size of an effect, and not one of the board's own inputs."""
        return bool(self.effect) and not self.replaces

    @property
    def is_component(self) -> bool:
        """Whether a budget counts it together with others."""
        return bool(self.description)

    @property
    def is_listed(self) -> bool:
        """Whether results list it alone: a component that belongs to no effect means nothing by itself."""
        return self.is_of_effect or not self.is_component

    @property
    def nominal(self) -> float:
        """A representative size: the median of a log-normal prior, one sd above a normal one if its bounds allow."""
        if self.typical_value is not None and not self.prior.is_exact:
            return self.typical_value
        if self.prior.is_exact or self.prior.kind != "normal":
            return self.prior.median
        return float(np.clip(self.prior.value(1.0), self.prior.lower, self.prior.upper))


_UNITS = {
    "Pa": (1e-9, "GPa"),
    "m": (1e3, "mm"),
    "kg": (1e3, "g"),
    "1": (1.0, ""),
    "rad": (180.0 / np.pi, "degrees"),
}


def display_unit(unit: str) -> tuple[float, str]:
    """Factor from an SI unit to the one that people use, and its name."""
    return _UNITS.get(unit, (1.0, unit))
