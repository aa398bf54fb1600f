"""What an effect is: something the ideal plate lacks, with parameters, physical priors, and a place in the problem.

An effect adds terms to the budget of energies: stiffness, mass, or both, each with a weight that its parameters set.
It may also change the plate they are added to: another theory, a released edge, a term that is not even about the
middle. Everything that an effect can do to a plate is a method of `Effect`; each has a default that does nothing.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.fields import Field, Group, Outline
from bayesplate.modes.line import Line
from bayesplate.modes.plate import KronSum, Projection, Term, Weights
from bayesplate.plate.board import Board, Values
from bayesplate.plate.setup import Setup
from bayesplate.quantities import Quantity

Scope = Literal["board", "setup"]
Theory = Literal["thin", "shear-flexible"]
Release = Literal["", "value", "slope"]
"""What clamped edges let go in the presence of an effect, whose springs then hold it: nothing, deflection or slope."""
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect.

    Attributes
    ----------
    name : str
    unit : str
        SI.
    prior : Quantity
        Physical: sign and range are its bounds. An exact quantity fixes the parameter.
    source : str
        Where the prior comes from.
    """

    name: str
    unit: str
    prior: Quantity
    source: str

    @property
    def nominal(self) -> float:
        """A representative size: the median of a log-normal prior, one sd above a normal one if its bounds allow."""
        if self.prior.is_exact or self.prior.kind == "log-normal":
            return self.prior.median
        return float(np.clip(self.prior.value(1.0), self.prior.lower, self.prior.upper))


@dataclass(frozen=True)
class Effect(ABC):
    """One effect on one setup.

    Attributes
    ----------
    setup_name : str
        The setup it acts in; empty for an effect whose parameters belong to the board.
    """

    setup_name: str = ""

    name: ClassVar[str]
    scope: ClassVar[Scope]
    sentence: ClassVar[str]
    theory: ClassVar[Theory] = "thin"
    releases: ClassVar[Release] = ""
    turns_grain: ClassVar[bool] = False
    refines: ClassVar[float] = 1.0
    """Factor on the elements a side of a thin plate, for what its mesh would show."""

    @classmethod
    @abstractmethod
    def of(cls, board: Board, setup: Setup) -> Effect:
        """The effect as it acts in a setup of a board."""

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        """Why the effect cannot act in a setup; empty if it can."""
        return ""

    @classmethod
    def is_implied(cls, board: Board) -> bool:
        """Whether the card declares the effect by what it states: a mass, the air, readings with places."""
        return False

    @classmethod
    def is_wanted(cls, setup: Setup) -> bool:
        """Whether the setup itself states the effect, so that it is a fault if the effect cannot act there."""
        return False

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[Effect, ...]:
        """The forms in which a search should try the effect in a setup; none if it cannot act there."""
        return () if cls.refusal(board, setup) else (cls.of(board, setup),)

    @abstractmethod
    def parameters(self) -> tuple[EffectParameter, ...]:
        """The effect's parameters with their priors."""

    def key(self, parameter: str) -> str:
        """Name of a parameter among the values of a board."""
        place = f"[{self.setup_name}]" if self.scope == "setup" else ""
        return f"{self.name}.{parameter}{place}"

    def value(self, values: Values, parameter: str) -> Floats:
        """Value of a parameter: a number or an (n_draws,) array."""
        return np.asarray(values[self.key(parameter)])

    def adjusted(self, values: Values) -> Values:
        """The values as all weights take them in the presence of the effect, which may correct sizes and density."""
        return values

    def outline(self) -> Outline | None:
        """The plate's outline where it is not the whole rectangle."""
        return None

    def fields(self) -> Mapping[Group, tuple[Field | None, ...]]:
        """Fields that the plate's own terms take instead of being uniform (None is uniform), by group of terms."""
        return {}

    def field_weights(self, values: Values) -> Mapping[Group, tuple[Floats, ...]]:
        """Factor on the weight of the plate's own terms for each field; empty where each is one."""
        return {}

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """Whether the two halves of the plate stay alike along x and along y."""
        return True, True

    def stiffness(self, x: Line, y: Line) -> tuple[Term, ...]:
        """Stiffness terms."""
        return ()

    def masses(self, x: Line, y: Line) -> tuple[KronSum, ...]:
        """Mass terms on the deflection."""
        return ()

    def projected_masses(self) -> tuple[Projection, ...]:
        """Mass terms that have no sparse matrix."""
        return ()

    def stiffness_weights(self, values: Values, setup: Setup) -> tuple[Floats, ...]:
        """Weight of each stiffness term, s^-2: numbers or (n_draws,) arrays."""
        return ()

    def mass_weights(self, values: Values, setup: Setup) -> tuple[Floats, ...]:
        """Weight of each mass term, sparse ones first, as fractions of the vibrating mass."""
        return ()

    def reweigh(self, base: Weights, values: Values, setup: Setup) -> Weights:
        """Weights of the plate's own terms in the presence of the effect, before they spread over fields."""
        return base
