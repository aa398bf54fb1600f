"""The forms of a plate: its terms on the products of its two sides' functions, and their sum element by element.

On such products every strain is known at every Gauss point from one matrix along x and one along y.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.plate.beams import N_BEAMS, Beams, is_rigid
from bayesplate.plate.fields import weights_within
from bayesplate.plate.line import Line
from bayesplate.plate.terms import (
    Derivative,
    EdgeTerm,
    Kinematics,
    Parity,
    PlateTerm,
    PointTerm,
    ProjectedTerms,
    StrainPair,
    Term,
    Weights,
)


@dataclass(frozen=True, eq=False)
class Elements:
    """A weighted sum of terms, element by element: by two fields, (n_elements, 16, 16) arrays; and terms at places."""

    over_plate: Mapping[tuple[str, str], Floats]
    elsewhere: tuple[tuple[EdgeTerm | PointTerm, float], ...]

    @property
    def is_definite(self) -> bool:
        """Whether no product at a place has a negative weight; a place that is interpolated gives some."""
        return all(weight >= 0.0 for term, weight in self.elsewhere if isinstance(term, PointTerm) and term.is_on_plate)

    def without_negative(self) -> Elements:
        """The elements without products at places of negative weight."""
        kept_terms = (
            pair
            for pair in self.elsewhere
            if not (isinstance(pair[0], PointTerm) and pair[0].is_on_plate and pair[1] < 0.0)
        )
        return Elements(self.over_plate, tuple(kept_terms))


@dataclass(frozen=True, eq=False)
class Forms:
    """The terms of a plate on two sides, its own first; an (n_x, n_y) array weighs a term's Gauss points."""

    kinematics: Kinematics
    x: Line
    y: Line
    stiffness: tuple[tuple[Term, Floats | None], ...]
    masses: tuple[tuple[Term, Floats | None], ...]

    def with_terms(self, stiffness: Sequence[Term], masses: Sequence[Term]) -> Self:
        """A plate with further terms, which come after its own."""
        stiff, inert = (
            tuple(
                (term, weights_within(self.x, self.y, term.outline) if isinstance(term, PlateTerm) else None)
                for term in terms
            )
            for terms in (stiffness, masses)
        )
        return replace(self, stiffness=(*self.stiffness, *stiff), masses=(*self.masses, *inert))

    @property
    def parities(self) -> tuple[Parity, ...]:
        """The symmetry classes, the even one first."""
        along_x, along_y = ((0, 1) if side.is_split else (0,) for side in (self.x, self.y))
        return tuple(Parity(i, j) for i in along_x for j in along_y)

    @property
    def n_coordinates(self) -> int:
        places = (term.n_coordinates for term, _ in (*self.stiffness, *self.masses) if isinstance(term, PointTerm))
        return max(places, default=0)

    @property
    def is_projected(self) -> bool:
        return any(isinstance(term, ProjectedTerms) for term, _ in (*self.stiffness, *self.masses))

    def parity(self, beams: Beams) -> Parity:
        """Symmetry class to which a product of beam functions belongs."""
        return Parity(beams[0] % 2 if self.x.is_split else 0, beams[1] % 2 if self.y.is_split else 0)

    @cached_property
    def elastic_products(self) -> dict[Parity, list[Beams]]:
        """Orders of those products of beam functions that bend, by symmetry class."""
        products: dict[Parity, list[Beams]] = {parity: [] for parity in self.parities}
        for beams in np.ndindex(N_BEAMS, N_BEAMS):
            if not is_rigid(beams, self.x.ends, self.y.ends):
                products[self.parity(beams)].append(beams)
        return products

    def elements(self, weights: Weights) -> tuple[Elements, Elements]:
        """Stiffness and mass of one draw, without the terms that exist on given deflections only."""
        return self._elements(self.stiffness, weights.stiffness), self._elements(self.masses, weights.mass)

    def _elements(self, terms: Sequence[tuple[Term, Floats | None]], weights: Floats) -> Elements:
        grids: dict[StrainPair, Floats] = {}
        elsewhere = []
        for (term, grid), weight in zip(weighed_terms(terms), weights, strict=True):
            if isinstance(term, PlateTerm):
                grids[term.strains] = grids.get(term.strains, 0.0) + weight * np.asarray(grid)
            elif not isinstance(term, ProjectedTerms):
                elsewhere.append((term, float(weight)))
        blocks: dict[tuple[str, str], Floats] = {}
        order = self.kinematics.fields.index
        for strains, grid in grids.items():
            for s, t in dict.fromkeys((strains, strains[::-1])):
                for a in self.kinematics.strains[s]:
                    for b in self.kinematics.strains[t]:
                        if order(a.field) <= order(b.field):
                            fields = a.field, b.field
                            blocks[fields] = blocks.get(fields, 0.0) + self._local_integrals(grid, a, b)
        return Elements(blocks, tuple(elsewhere))

    def _local_integrals(self, grid: Floats, a: Derivative, b: Derivative) -> Floats:
        """Integrals of the product of two derivatives on each element's own functions: (n_elements, 16, 16) array."""
        along_x = self.x.local[a.along_x][..., :, None] * self.x.local[b.along_x][..., None, :]
        along_y = self.y.local[a.along_y][..., :, None] * self.y.local[b.along_y][..., None, :]
        (n_x, q_x), (n_y, q_y) = along_x.shape[:2], along_y.shape[:2]
        by_row = grid.reshape(n_x * q_x, n_y, q_y).swapaxes(0, 1) @ along_y.reshape(n_y, q_y, 16)
        integrals = along_x.reshape(n_x, q_x, 16).swapaxes(1, 2) @ by_row.reshape(n_y, n_x, q_x, 16)
        local = integrals.reshape(n_y, n_x, 4, 4, 4, 4).transpose(0, 1, 2, 4, 3, 5)
        return np.asarray(a.factor * b.factor * local.reshape(n_y * n_x, 16, 16))


def weighed_terms(terms: Sequence[tuple[Term, Floats | None]]) -> Iterator[tuple[Term, Floats | None]]:
    """Each term and its grid, once for every weight that the term takes."""
    for term, grid in terms:
        for _ in range(term.n_terms if isinstance(term, ProjectedTerms) else 1):
            yield term, grid
