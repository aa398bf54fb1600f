"""A setup with its effects: which plate it is, and what every term of it weighs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.effects import effects_of
from bayesplate.effects.base import (
    Contribution,
    Effect,
    Mass,
    Masses,
    ProjectedMass,
    ProjectedStiffnesses,
    Stiffness,
    Stiffnesses,
    Theory,
)
from bayesplate.frequencies.fabric import fabric_of, in_plane, over_fields
from bayesplate.frequencies.shear_terms import shear_term_weights
from bayesplate.frequencies.terms import term_weights
from bayesplate.modes.energies import assembled_plate
from bayesplate.modes.hermite import Hold, Holds
from bayesplate.modes.keeping import kept
from bayesplate.modes.line import line
from bayesplate.modes.mesh import ELEMENTS_PER_SIDE, mesh
from bayesplate.modes.plate import PlateMatrices, Weights
from bayesplate.modes.shear import SHEAR_ELEMENTS_PER_SIDE, SHEAR_FLEXIBLE
from bayesplate.modes.thin import THIN
from bayesplate.plate.board import Board, Values
from bayesplate.plate.parameter import BOARD
from bayesplate.plate.setup import Ends, Setup

_MOST_BYTES = 250_000_000
"""Of the matrices that are kept: those of hundreds of bare plates, or of a few with fields and fine meshes."""


_SEVERAL = (Stiffnesses, Masses, ProjectedStiffnesses)
"""Contributions of more than one term."""

Limits = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Where a plate begins and ends along y at some points of its length, (n,) arrays, as fractions of its widest width."""


@dataclass(frozen=True)
class System:
    """A setup and the effects that act in it.

    Attributes
    ----------
    setup : Setup
    effects : tuple of Effect
    """

    setup: Setup
    effects: tuple[Effect, ...] = ()

    @property
    def theory(self) -> Theory:
        """ "thin", or "shear-flexible" if an effect asks for it."""
        return "shear-flexible" if any(e.theory == "shear-flexible" for e in self.effects) else "thin"

    def plate(self, values: Values) -> PlateMatrices:
        """Matrices on the production mesh for these values.

        Parameters
        ----------
        values : dict of float
            D_x, D_y, D_s (N m), the board's inputs and the effects' parameters.
        """
        finest = max((effect.refines for effect in self.effects), default=1.0)
        per_side = SHEAR_ELEMENTS_PER_SIDE if self.theory == "shear-flexible" else round(ELEMENTS_PER_SIDE * finest)
        elements = mesh(term_weights(values, self.setup).at(0), per_side)
        plate = _plate(self.setup.ends_x, self.setup.ends_y, self.theory, self._acting, *elements)
        added = self.contributions
        if not (added.projected_terms or added.projected):
            return plate
        adjusted = self.adjusted(values)
        membrane = in_plane(self.effects, adjusted)
        return plate.with_projected(
            [one.projection for one in added.projected],
            [one.projection(adjusted, membrane) for one in added.projected_terms],
        )

    @cached_property
    def stations(self) -> tuple[System, ...]:
        """The system with what roved at each of its places; itself where nothing did."""
        return tuple(replace(self, effects=each) for each in product(*(effect.stations() for effect in self.effects)))

    @cached_property
    def contributions(self) -> Contributions:
        """The terms that the effects add, by kind."""
        return contributions_of(self._acting)

    @property
    def shaped(self) -> Effect | None:
        """The effect that gives the plate its outline, where that is not the whole rectangle."""
        return next((effect for effect in self.effects if effect.outline() is not None), None)

    def limits(self, x: NDArray[np.float64]) -> Limits | None:
        """Where the plate begins and ends along y at fractions of its length, as fractions of its widest width.

        None where it is a rectangle.
        """
        outline = None if self.shaped is None else self.shaped.outline()
        return None if outline is None else outline(x)

    @cached_property
    def _acting(self) -> tuple[Effect, ...]:
        """The effects as they act on the true outline, where one of them gives it."""
        shaped = self.shaped
        return self.effects if shaped is None else tuple(effect.within(shaped) for effect in self.effects)

    def adjusted(self, values: Values) -> Values:
        """The values as all weights take them: sizes and density corrected, shear moduli where the plate has them."""
        for effect in self.effects:
            values = effect.adjusted(values)
        return values

    def weights(self, values: Values) -> Weights:
        """What every term weighs: (n_draws, n_terms) and (n_draws, n_masses) arrays."""
        values = self.adjusted(values)
        base = (shear_term_weights if self.theory == "shear-flexible" else term_weights)(values, self.setup)
        base = over_fields(base, self.effects, self.theory, values, self.setup)
        added = self.contributions
        if not any(added):
            return base
        columns = [
            [own, *(_columns(one, values, self.setup) for one in further)]
            for own, further in zip(
                base, (added.stiffness + added.projected_terms, added.masses + added.projected), strict=True
            )
        ]
        n_draws = max(len(one) for each in columns for one in each)
        return Weights(
            *(
                np.concatenate([np.broadcast_to(one, (n_draws, one.shape[1])) for one in each], axis=1)
                for each in columns
            )
        )


class Contributions(NamedTuple):
    """The terms that effects add to the budget of energies, by kind; their weights stand in this order too."""

    stiffness: tuple[Stiffness | Stiffnesses, ...]
    projected_terms: tuple[ProjectedStiffnesses, ...]
    masses: tuple[Mass | Masses, ...]
    projected: tuple[ProjectedMass, ...]


def contributions_of(effects: Sequence[Effect]) -> Contributions:
    """What some effects add, by kind: matrices and weights are both read from this one list."""
    added = [one for effect in effects for one in effect.contributions()]
    return Contributions(
        tuple(one for one in added if isinstance(one, Stiffness | Stiffnesses)),
        tuple(one for one in added if isinstance(one, ProjectedStiffnesses)),
        tuple(one for one in added if isinstance(one, Mass | Masses)),
        tuple(one for one in added if isinstance(one, ProjectedMass)),
    )


def _columns(one: Contribution, values: Values, setup: Setup) -> NDArray[np.float64]:
    """Weights of a contribution: (n_draws, n_terms) array, of one draw where it is the same in all."""
    weight = np.asarray(one.weight(values, setup))
    return np.atleast_2d(weight if isinstance(one, _SEVERAL) else weight[..., None])


def system_of(board: Board, setup: Setup) -> System:
    """A setup of a board with the board's declared effects."""
    return System(setup, effects_of(board, setup))


def _plate(
    ends_x: Ends, ends_y: Ends, theory: Theory, effects: tuple[Effect, ...], n_x: int, n_y: int
) -> PlateMatrices:
    # Whose sizes they are does not matter to the matrices, so that setups held alike have the same ones.
    shaping = tuple(replace(effect, owner=BOARD) for effect in effects if not _only_projects(effect))
    return _assembled(ends_x, ends_y, theory, shaping, n_x, n_y)


def _only_projects(effect: Effect) -> bool:
    """Whether all that an effect does to a plate is to add projected terms, which need no matrices of their own."""
    is_plain = effect.theory == "thin" and not effect.releases and not effect.turns_grain and effect.outline() is None
    added = effect.contributions()
    return (
        is_plain
        and not effect.variations()
        and all(effect.keeps_symmetry())
        and all(isinstance(one, ProjectedMass | ProjectedStiffnesses) for one in added)
    )


def _n_bytes(plate: PlateMatrices) -> int:
    return sum(one.nbytes for b in plate.blocks for one in (b.terms, b.masses, b.indices, b.indptr))


@kept(_MOST_BYTES, _n_bytes)
def _assembled(
    ends_x: Ends, ends_y: Ends, theory: Theory, effects: tuple[Effect, ...], n_x: int, n_y: int
) -> PlateMatrices:
    """The plate's matrices without projected masses: with the air and without, they are the same."""
    is_sheared = theory == "shear-flexible"
    symmetry = [effect.keeps_symmetry() for effect in effects]
    x = line(ends_x, n_x, is_sheared, all(along_x for along_x, _ in symmetry), _held(ends_x, effects))
    y = line(ends_y, n_y, is_sheared, all(along_y for _, along_y in symmetry), _held(ends_y, effects))
    added = contributions_of(effects)
    stiffness = [term for one in added.stiffness for term in one.matrices(x, y)]
    masses = [term for one in added.masses for term in one.matrices(x, y)]
    return assembled_plate(SHEAR_FLEXIBLE if is_sheared else THIN, x, y, stiffness, masses, fabric_of(effects))


def _held(ends: Ends, effects: tuple[Effect, ...]) -> Holds:
    """What the ends still hold where effects have released clamped ones."""
    released = {effect.releases for effect in effects} - {""}
    left: Hold = "clamped"
    if released:
        left = "free" if len(released) == 2 else "supported" if released == {"slope"} else "guided"
    low, high = (left if end == "clamped" else end for end in ends)
    return low, high
