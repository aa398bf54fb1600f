"""One setup: how the board is held, and what was read there; SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayesplate.cards import CoefficientCard
from bayesplate.labels import Label
from bayesplate.plate.parameter import Owner, Parameter, shown_name
from bayesplate.quantities import Quantity

End = Literal["clamped", "supported", "free"]
Ends = tuple[End, End]
EDGES = ("x0", "x1", "y0", "y1")
NO_OFFSET = Label(0, 0)
DEFAULT_NOISE = Quantity.from_median(0.003, np.exp(0.5))
CLAMPED_NOISE = Quantity.from_median(0.008, np.exp(0.5))
"""Relative noise of a frequency: free boards settle at 0.24-0.30 %; re-clamping one board spreads it by 1-2.4 %."""


@dataclass(frozen=True)
class Reading:
    """A measured frequency of a named mode.

    Attributes
    ----------
    label : Label
        This laboratory's label.
    beams : tuple of int
        Orders of the beam functions along x and y, from 0: the label less `Setup.first_label`.
    frequency : Quantity, Hz
    sign : str
        Sign of the residue between hammer and sensor, "+" or "-"; empty if not known.
    """

    label: Label
    beams: tuple[int, int]
    frequency: Quantity
    sign: str = ""


@dataclass(frozen=True)
class AttachedItem:
    """Something fixed to the board: its places in m from the corner x = y = 0, and its mass in kg where known."""

    kind: str
    places: tuple[tuple[float, float], ...]
    mass: Quantity | None = None


@dataclass(frozen=True)
class DeclaredAir:
    """Air that the card declares: its density in kg m^-3 and baffle ("none" or "full"), each None if not stated."""

    density: Quantity | None = None
    baffle: str | None = None


@dataclass(frozen=True)
class Setup:
    """How the board is held, and what was read.

    Attributes
    ----------
    name : str
    ends_x, ends_y : tuple of str
        Conditions at (x0, x1) and (y0, y1).
    clamped : dict of Quantity, m
        What a clamp covers, by edge.
    readings : tuple of Reading
    resolution : float, Hz
        Readings that are plain numbers are rounded to this; 0 if not rounded.
    unlabelled : tuple of float, Hz
    noise : Quantity
        Relative noise of a frequency (log-normal).
    first_label : Label
    published_coefficients : CoefficientCard or None
        Table of the paper's least squares and percentile method, and of nothing else.
    attached : tuple of AttachedItem
    hammer : tuple of float or None, m
    air : DeclaredAir or None
        None: not declared.
    """

    name: str
    ends_x: Ends
    ends_y: Ends
    readings: tuple[Reading, ...]
    noise: Quantity
    clamped: Mapping[str, Quantity] = field(default_factory=dict)
    resolution: float = 0.0
    unlabelled: tuple[float, ...] = ()
    first_label: Label = NO_OFFSET
    published_coefficients: CoefficientCard | None = None
    attached: tuple[AttachedItem, ...] = ()
    hammer: tuple[float, float] | None = None
    air: DeclaredAir | None = None

    @property
    def edges(self) -> dict[str, str]:
        """Condition of each edge."""
        return dict(zip(EDGES, self.ends_x + self.ends_y, strict=True))

    @property
    def labels(self) -> tuple[Label, ...]:
        """Labels of the readings, in their order."""
        return tuple(reading.label for reading in self.readings)

    @property
    def measured(self) -> NDArray[np.float64]:
        """Measured frequencies: (n_modes,) array, Hz."""
        return np.array([reading.frequency.mean for reading in self.readings])

    @property
    def relative_sd(self) -> NDArray[np.float64]:
        """Relative uncertainty of each reading itself, apart from the noise: (n_modes,) array."""
        return np.array([reading.frequency.sd / reading.frequency.mean for reading in self.readings])

    @property
    def owner(self) -> Owner:
        """The owner of the setup's parameters."""
        return Owner("setup", self.name)

    @property
    def is_free(self) -> bool:
        """Whether no edge is held."""
        return {*self.ends_x, *self.ends_y} == {"free"}

    @property
    def noise_parameter(self) -> Parameter:
        """The relative noise of a frequency as a parameter."""
        return Parameter("noise", self.owner, self.noise, "1", words="noise")

    @property
    def clamped_parameters(self) -> tuple[Parameter, ...]:
        """What the clamps cover, one parameter per clamped edge for which the card states it."""
        return tuple(
            Parameter(f"clamped_{edge}", self.owner, length, "m", words=f"covered by the clamp on {edge}")
            for edge, length in self.clamped.items()
        )

    def input_name(self, edge: str) -> str:
        """Name of the clamped length of an edge among the board's inputs."""
        return shown_name(f"clamped_{edge}", self.owner)
