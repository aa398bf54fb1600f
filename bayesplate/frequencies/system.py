"""A setup with its effects: which plate it is, and what every term of it weighs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.setup import Ends, Setup
from bayesplate.effects import effects_of
from bayesplate.effects.base import Contribution, Effect, Mass, Stiffness, Theory
from bayesplate.frequencies.fabric import fabric_of, in_plane, over_fields
from bayesplate.frequencies.terms import shear_term_weights, term_weights
from bayesplate.plate.line import N_POINTS, N_POINTS_CUT, Hold, Holds, Line, line
from bayesplate.plate.mesh import ELEMENTS_PER_SIDE, mesh
from bayesplate.plate.plate import Plate, plate_of
from bayesplate.plate.shear import SHEAR_ELEMENTS_PER_SIDE, SHEAR_FLEXIBLE
from bayesplate.plate.terms import Weights
from bayesplate.plate.thin import THIN

Limits = tuple[Floats, Floats]
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
        symmetry = zip(*((True, True), *(effect.keeps_symmetry() for effect in self._acting)), strict=True)
        x, y = (
            line(ends, n, is_sheared, all(keeps), self._held(ends), n_points)
            for ends, n, keeps in zip(
                (self.setup.ends_x, self.setup.ends_y),
                mesh(term_weights(values, self.setup).at(0), per_side),
                symmetry,
                strict=True,
            )
        )
        adjusted = self.adjusted(values)
        membrane = in_plane(self.effects, adjusted)
        stiffness, masses = (
            [term for one in self._contributions(kind) for term in one.terms_at(adjusted, membrane)]
            for kind in (Stiffness, Mass)
        )
        return _bare(self.theory, self._acting, x, y).with_terms(stiffness, masses)

    @cached_property
    def stations(self) -> tuple[System, ...]:
        """The system with what roved at each of its places; itself where nothing did."""
        return tuple(replace(self, effects=each) for each in product(*(effect.stations() for effect in self.effects)))

    def _contributions(self, kind: type[Contribution]) -> list[Contribution]:
        """What the effects add to the budget of energies: terms and weights are both read from this one list."""
        return [one for effect in self._acting for one in effect.contributions() if isinstance(one, kind)]

    def _held(self, ends: Ends) -> Holds:
        """What the ends still hold where effects have released clamped ones."""
        released = {effect.releases for effect in self.effects} - {""}
        left: Hold = "clamped"
        if released:
            left = "free" if len(released) == 2 else "supported" if released == {"slope"} else "guided"
        low, high = (left if end == "clamped" else end for end in ends)
        return low, high

    @property
    def shaped(self) -> Effect | None:
        """The effect that gives the plate its outline, where that is not the whole rectangle."""
        return next((effect for effect in self.effects if effect.outline() is not None), None)

    def limits(self, x: Floats) -> Limits | None:
        """Ends of the plate along y at fractions of its length, as fractions of its widest width; None: a rectangle."""
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
        added = ([one.columns(values, self.setup) for one in self._contributions(kind)] for kind in (Stiffness, Mass))
        columns = [[own, *further] for own, further in zip(base, added, strict=True)]
        n_draws = max(len(one) for each in columns for one in each)
        return Weights(
            *(
                np.concatenate([np.broadcast_to(one, (n_draws, one.shape[1])) for one in each], axis=1)
                for each in columns
            )
        )


def system_of(board: Board, setup: Setup) -> System:
    return System(setup, effects_of(board, setup))


@lru_cache(maxsize=8)
def _bare(theory: Theory, effects: tuple[Effect, ...], x: Line, y: Line) -> Plate:
    """The plate with its own terms alone, spread over the fields that effects give it."""
    return plate_of(SHEAR_FLEXIBLE if theory == "shear-flexible" else THIN, x, y, fabric_of(effects))
