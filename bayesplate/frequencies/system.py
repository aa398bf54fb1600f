"""A setup with its effects: its plate, and the weights of all its terms."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.setup import EdgeConditions, Setup
from bayesplate.effects import effects_of
from bayesplate.effects.base import Contribution, Effect, Mass, Stiffness
from bayesplate.frequencies.fabric import fabric_of, in_plane_field, spread_over_fields
from bayesplate.frequencies.terms import shear_term_weights, term_weights
from bayesplate.plate.line import N_POINTS, N_POINTS_CUT, EndCondition, EndConditions, Line, line
from bayesplate.plate.mesh import ELEMENTS_PER_SIDE, mesh
from bayesplate.plate.plate import Plate, plate_of
from bayesplate.plate.shear import SHEAR_ELEMENTS_PER_SIDE, SHEAR_FLEXIBLE
from bayesplate.plate.terms import Theory, Weights
from bayesplate.plate.thin import THIN

WidthLimits = tuple[Floats, Floats]
"""Where a plate begins and ends along y at some points of its length, (n,) arrays, as fractions of its widest width."""


@dataclass(frozen=True)
class System:
    """A setup and the effects that act in it."""

    setup: Setup
    effects: tuple[Effect, ...] = ()

    @property
    def theory(self) -> Theory:
        """ "thin", or "shear-flexible" if an effect asks for it."""
        return "shear-flexible" if any(e.theory == "shear-flexible" for e in self.effects) else "thin"

    def plate(self, values: Values) -> Plate:
        """The plate on the production mesh for these values."""
        is_sheared = self.theory == "shear-flexible"
        finest = max((effect.refines for effect in self.effects), default=1.0)
        per_side = SHEAR_ELEMENTS_PER_SIDE if is_sheared else round(ELEMENTS_PER_SIDE * finest)
        n_points = N_POINTS if self.shaped is None else N_POINTS_CUT
        symmetry = zip(*((True, True), *(effect.keeps_symmetry() for effect in self._acting_effects)), strict=True)
        x, y = (
            line(ends, n, is_sheared, all(keeps), self._holds(ends), n_points)
            for ends, n, keeps in zip(
                (self.setup.ends_x, self.setup.ends_y),
                mesh(term_weights(values, self.setup).at(0), per_side),
                symmetry,
                strict=True,
            )
        )
        adjusted = self.adjusted(values)
        membrane = in_plane_field(self.effects, adjusted)
        stiffness, masses = (
            [term for contribution in self._contributions(kind) for term in contribution.terms_at(adjusted, membrane)]
            for kind in (Stiffness, Mass)
        )
        return _bare_plate(self.theory, self._acting_effects, x, y).with_terms(stiffness, masses)

    @cached_property
    def stations(self) -> tuple[System, ...]:
        """The system with the roving item at each of its places; itself where nothing roved."""
        return tuple(
            replace(self, effects=effects) for effects in product(*(effect.stations() for effect in self.effects))
        )

    def _contributions(self, kind: type[Contribution]) -> list[Contribution]:
        """Contributions of the effects to the energies: terms and weights are both read from this list."""
        return [
            contribution
            for effect in self._acting_effects
            for contribution in effect.contributions()
            if isinstance(contribution, kind)
        ]

    def _holds(self, ends: EdgeConditions) -> EndConditions:
        """The degrees of freedom that the ends hold, where effects may have released clamped ends."""
        released = {effect.releases for effect in self.effects} - {""}
        released_hold: EndCondition = "clamped"
        if released:
            released_hold = "free" if len(released) == 2 else "supported" if released == {"slope"} else "guided"
        low, high = (released_hold if end == "clamped" else end for end in ends)
        return low, high

    @property
    def shaped(self) -> Effect | None:
        """The effect that gives the plate its outline, where that is not the whole rectangle."""
        return next((effect for effect in self.effects if effect.outline() is not None), None)

    def limits(self, x: Floats) -> WidthLimits | None:
        """Ends of the plate along y at fractions of its length, as fractions of its widest width; None: a rectangle."""
        outline = None if self.shaped is None else self.shaped.outline()
        return None if outline is None else outline(x)

    @cached_property
    def _acting_effects(self) -> tuple[Effect, ...]:
        """The effects as they act within the true outline, where an effect gives one."""
        shaped = self.shaped
        return self.effects if shaped is None else tuple(effect.within_outline(shaped) for effect in self.effects)

    def adjusted(self, values: Values) -> Values:
        """Values for all weights: sizes and density corrected by effects, shear moduli where the plate has them."""
        for effect in self.effects:
            values = effect.adjusted(values)
        return values

    def weights(self, values: Values) -> Weights:
        """Weights of all terms: (n_draws, n_terms) of stiffness and (n_draws, n_masses) of mass."""
        values = self.adjusted(values)
        base = (shear_term_weights if self.theory == "shear-flexible" else term_weights)(values, self.setup)
        base = spread_over_fields(base, self.effects, self.theory, values, self.setup)
        added = (
            [contribution.columns(values, self.setup) for contribution in self._contributions(kind)]
            for kind in (Stiffness, Mass)
        )
        blocks = [[plate_columns, *effect_columns] for plate_columns, effect_columns in zip(base, added, strict=True)]
        n_draws = max(len(block) for kind in blocks for block in kind)
        return Weights(
            *(
                np.concatenate([np.broadcast_to(block, (n_draws, block.shape[1])) for block in kind], axis=1)
                for kind in blocks
            )
        )


def system_of(board: Board, setup: Setup) -> System:
    return System(setup, effects_of(board, setup))


@lru_cache(maxsize=8)
def _bare_plate(theory: Theory, effects: tuple[Effect, ...], x: Line, y: Line) -> Plate:
    """The plate with its own terms only, spread over the fields of the effects."""
    return plate_of(SHEAR_FLEXIBLE if theory == "shear-flexible" else THIN, x, y, fabric_of(effects))
