"""A setup with its effects: which plate it is, and what every term of it weighs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.effects import effects_of
from bayesplate.effects.base import Effect, Mass, ProjectedMass, Stiffness, Theory
from bayesplate.frequencies.fabric import fabric_of, over_fields
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
        return _plate(self.setup.ends_x, self.setup.ends_y, self.theory, self._acting, *elements)

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
        stiffness = [one.weight(values, self.setup) for one in added.stiffness]
        masses = [one.weight(values, self.setup) for one in added.masses]
        masses += [one.weight(values, self.setup) for one in added.projected]
        if not stiffness and not masses:
            return base
        shape = np.broadcast_shapes(base.stiffness.shape[:1], *(np.shape(w) for w in (*stiffness, *masses)))
        joined = [
            np.column_stack(
                [np.broadcast_to(own, shape + own.shape[1:]), *(np.broadcast_to(w, shape) for w in further)]
            )
            for own, further in zip(base, (stiffness, masses), strict=True)
        ]
        return Weights(*joined)


class Contributions(NamedTuple):
    """The terms that effects add to the budget of energies, by kind; their weights stand in this order too."""

    stiffness: tuple[Stiffness, ...]
    masses: tuple[Mass, ...]
    projected: tuple[ProjectedMass, ...]


def contributions_of(effects: Sequence[Effect]) -> Contributions:
    """What some effects add, by kind: matrices and weights are both read from this one list."""
    added = [one for effect in effects for one in effect.contributions()]
    return Contributions(
        tuple(one for one in added if isinstance(one, Stiffness)),
        tuple(one for one in added if isinstance(one, Mass)),
        tuple(one for one in added if isinstance(one, ProjectedMass)),
    )


def system_of(board: Board, setup: Setup) -> System:
    """A setup of a board with the board's declared effects."""
    return System(setup, effects_of(board, setup))


def _plate(
    ends_x: Ends, ends_y: Ends, theory: Theory, effects: tuple[Effect, ...], n_x: int, n_y: int
) -> PlateMatrices:
    # Whose sizes they are does not matter to the matrices, so that setups held alike have the same ones.
    shaping = tuple(replace(effect, owner=BOARD) for effect in effects if not _only_projects(effect))
    projected = tuple(one.projection for one in contributions_of(effects).projected)
    return _assembled(ends_x, ends_y, theory, shaping, n_x, n_y).with_projected(projected)


def _only_projects(effect: Effect) -> bool:
    """Whether all that an effect does to a plate is to add projected masses, which need no matrices of their own."""
    is_plain = effect.theory == "thin" and not effect.releases and not effect.turns_grain and effect.outline() is None
    added = effect.contributions()
    return (
        is_plain
        and not effect.variations()
        and all(effect.keeps_symmetry())
        and all(isinstance(one, ProjectedMass) for one in added)
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
    stiffness = tuple(one.matrix(x, y) for one in added.stiffness)
    masses = tuple(one.matrix(x, y) for one in added.masses)
    return assembled_plate(SHEAR_FLEXIBLE if is_sheared else THIN, x, y, stiffness, masses, fabric_of(effects))


def _held(ends: Ends, effects: tuple[Effect, ...]) -> Holds:
    """What the ends still hold where effects have released clamped ones."""
    released = {effect.releases for effect in effects} - {""}
    left: Hold = "clamped"
    if released:
        left = "free" if len(released) == 2 else "supported" if released == {"slope"} else "guided"
    low, high = (left if end == "clamped" else end for end in ends)
    return low, high
