"""Protocol of an effect: a departure from the ideal plate, with parameters and physical priors.

An effect adds terms to the budget of energies, stiffness or mass; each is one object that holds its matrix and its
weight, so that the two always match. It may also change the plate they are added to: another theory, a released edge,
properties that vary over the plate, a term that is not even about the middle. Everything that an effect can do to a
plate, and everything that the rest of the package must know of it, is a method or a class variable of `Effect`; each
has a default that does nothing. The file of an effect is all that an effect needs.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import ClassVar, Literal

import numpy as np

from bayesplate.arrays import Floats as Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.parameter import BOARD_OWNER, Owner, Parameter, parameter_name
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.plate.fields import EdgeStrip, Field, Outline, TermGroup
from bayesplate.plate.terms import Term, Theory, Weights

Scope = Literal["board", "setup"]
Release = Literal["", "value", "slope"]
"""What clamped edges release in the presence of an effect, whose springs then hold it: nothing, deflection or slope."""
WeightFunction = Callable[[Values, Setup], Floats]
"""Weight of a term at values in a setup: a number or an (n_draws,) array; of several terms with one more axis."""


ContributionTerms = Term | tuple[Term, ...] | Callable[[Values, Field | None], tuple[Term, ...]]
"""A term; several terms with one weight function; or a function that makes these from the values at which the plate is
solved and the field that its in-plane stiffness follows (None: uniform)."""


@dataclass(frozen=True)
class Contribution:
    """Terms that an effect adds to the budget of energies, each with its weight.

    Attributes
    ----------
    weight : Weight
        s^-2 of a stiffness, of a mass a fraction of the vibrating mass.
    """

    terms: ContributionTerms
    weight: WeightFunction

    def terms_at(self, values: Values, in_plane: Field | None) -> tuple[Term, ...]:
        """The terms of a plate that is solved at some values."""
        if callable(self.terms):
            return self.terms(values, in_plane)
        return self.terms if isinstance(self.terms, tuple) else (self.terms,)

    def columns(self, values: Values, setup: Setup) -> Floats:
        """Weights: (n_draws, n_terms) array, of one draw where they are the same in all."""
        weight = np.asarray(self.weight(values, setup))
        return np.atleast_2d(weight if callable(self.terms) or isinstance(self.terms, tuple) else weight[..., None])


class Stiffness(Contribution):
    """Stiffness terms."""


class Mass(Contribution):
    """Mass terms."""


@dataclass(frozen=True)
class Variation:
    """A field over the plate that one of the plate's properties follows, and its weight.

    Attributes
    ----------
    field : Field, EdgeStrip or None
        None is uniform.
    weight : callable or None
        From the values to a number or an (n_draws,) array; None is one.
    order : int
        Order of smallness: an expansion to second order leaves out higher orders, also in products of two variations.
    """

    field: Field | EdgeStrip | None
    weight: Callable[[Values], Floats] | None = None
    order: int = 0


@dataclass(frozen=True)
class EffectForm:
    """One form in which a search may try an effect on a board.

    Attributes
    ----------
    detail : str
        What distinguishes it from the effect's other forms; empty if there are none.
    effects : tuple of Effect
        One per setup in which it acts.
    """

    detail: str
    effects: tuple[Effect, ...]


@dataclass(frozen=True)
class Ratio:
    """A parameter as a multiple of one of the board's own constants.

    Attributes
    ----------
    to : str
        E_x, E_y or G_xy.
    prior : Quantity
        Of the ratio, no unit.
    source : str
        Where the prior comes from.
    """

    to: str
    prior: Quantity
    source: str


@dataclass(frozen=True)
class Effect(ABC):
    """One effect on one setup.

    Attributes
    ----------
    owner : Owner
        Of its parameters: the setup it acts in, the board, or a group that shares them.
    """

    owner: Owner = BOARD_OWNER

    name: ClassVar[str]
    scope: ClassVar[Scope]
    """Whether its parameters belong to the board or to each setup."""
    sentence: ClassVar[str]
    """What it does, for the report."""
    references: ClassVar[tuple[str, ...]] = ()
    """Where its formulas are taken from print."""
    theory: ClassVar[Theory] = "thin"
    releases: ClassVar[Release] = ""
    turns_grain: ClassVar[bool] = False
    is_of_campaign: ClassVar[bool] = False
    """Whether boards of one rig, day or species may have it alike: a search over a campaign tries it as shared."""
    ratios: ClassVar[Mapping[str, Ratio]] = {}
    """Parameters that boards of one species may share as ratios to their own moduli, by key."""
    refines: ClassVar[float] = 1.0
    """Factor on the number of elements per side of a thin plate, where the effect needs a finer mesh."""

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
        return any(map(cls.is_wanted, board.setups))

    @classmethod
    def is_known(cls, board: Board) -> bool:
        """Whether its size on a board is known without a fit: computed, published, or stated by the card.

        What the card states counts as known also where the list of declared effects leaves it out.
        """
        return cls.is_implied(board)

    @classmethod
    def at_known_size(cls, board: Board, setup: Setup) -> Effect | None:
        """The effect as it is computed in a setup without a fit; None if it cannot act there.

        Its sizes stand at the medians of their priors.
        """
        return None if cls.refusal(board, setup) else cls.of(board, setup)

    @classmethod
    def is_wanted(cls, setup: Setup) -> bool:
        """Whether the setup itself states the effect, so that it is a fault if the effect cannot act there."""
        return False

    @classmethod
    def notes(cls, board: Board) -> tuple[str, ...]:
        """Sentences on what a board with its declared effects leaves out of this one, or has only roughly."""
        return ()

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[Effect, ...]:
        """The forms in which a search should try the effect in a setup; none if it cannot act there."""
        return () if cls.refusal(board, setup) else (cls.of(board, setup),)

    @classmethod
    def forms(cls, board: Board) -> tuple[EffectForm, ...]:
        """The forms in which a search should try the effect on a board, each in all setups where it can act."""
        acting = [candidates for setup in board.setups if (candidates := cls.candidates(board, setup))]
        together = zip_longest(*acting)
        rows = (tuple(form or candidates[0] for form, candidates in zip(row, acting, strict=True)) for row in together)
        return tuple(EffectForm(effects[0].detail, effects) for effects in rows)

    @property
    def detail(self) -> str:
        """What distinguishes this form of the effect from its other forms; empty if there are none."""
        return ""

    def in_setup(self, board: Board, setup: Setup) -> Effect | None:
        """The same form of the effect in another setup of the board; None if it cannot act there."""
        if self.refusal(board, setup):
            return None
        return self if self.scope == "board" else replace(self, owner=setup.owner)

    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """The effect's parameters with their priors; `parameter` makes one."""

    def parameter(
        self, key: str, prior: Quantity, unit: str, neutral_value: float, source: str, display_name: str = ""
    ) -> Parameter:
        """A parameter of the effect.

        Parameters
        ----------
        unit : str
            SI.
        neutral_value : float
            The value at which the effect is absent.
        source : str
            Where the prior comes from; empty if the card states it.
        display_name : str
            Its name in reports; empty where that is its key.
        """
        phrase = f"{display_name or key} of {self.name.replace('_', ' ')}"
        return Parameter(key, self.owner, prior, unit, neutral_value, self.name, source=source, display_name=phrase)

    def value(self, values: Values, key: str) -> Floats:
        """Value of a parameter: a number or an (n_draws,) array."""
        return np.asarray(values[self.name_of(key)])

    def name_of(self, key: str) -> str:
        """Name of a parameter among the values of a board."""
        return parameter_name(key, self.owner, self.name)

    def adjusted(self, values: Values) -> Values:
        """The values as all weights take them in the presence of the effect, which may correct sizes and density."""
        return values

    def outline(self) -> Outline | None:
        """The plate's outline where it is not the whole rectangle."""
        return None

    def to_plate(self, x: float, y: float) -> tuple[float, float]:
        """Where on the plate's rectangle a place lies, given and returned as fractions of the vibrating sides.

        x and y are fractions of the nominal sides from the corner of x0 and y0; a place off the plate moves to its rim.
        """
        return x, y

    def from_plate(self, x: float, y: float) -> tuple[float, float]:
        """The inverse of `to_plate`: a place on the plate as fractions of the nominal sides."""
        return x, y

    def within_outline(self, shaped: Effect) -> Effect:
        """The effect on a plate whose outline `shaped` gives: places move onto that plate, terms end at its outline."""
        return self

    def variations(self) -> Mapping[TermGroup, tuple[Variation, ...]]:
        """Fields that the plate's own terms follow instead of being uniform, by group of terms.

        The part of E_x alone follows the fields of "along" where there are any, and those of "bending" otherwise.
        """
        return {}

    @property
    def followed_inputs(self) -> tuple[str, ...]:
        """Inputs of the board that its fields follow: each value of such an input needs a plate of its own."""
        return ()

    def law_points(self) -> tuple[Mapping[str, float], ...]:
        """Further points at which an exact law is made, besides the ends of each parameter: shares of reach by name."""
        return ()

    def stations(self) -> tuple[Effect, ...]:
        """The effect at each place over which it roved: what is read is the mean of the frequencies there."""
        return (self,)

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """Whether the two halves of the plate stay alike along x and along y."""
        return True, True

    def is_own_mirror(self) -> tuple[bool, bool]:
        """Whether the plate is its own mirror image along x and along y."""
        return self.keeps_symmetry()

    def contributions(self) -> tuple[Contribution, ...]:
        """The terms that the effect adds to the budget of energies."""
        return ()

    def reweigh(self, base: Weights, values: Values, setup: Setup) -> Weights:
        """Weights of the plate's own terms in the presence of the effect, linear in them, before they take fields."""
        return base
