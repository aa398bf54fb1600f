"""The plate on a reduced basis: few vectors hold its modes over a whole region, thousands of times faster than a solve.

The basis holds the modes at the centre and the directions that modes at points around it add, in the order of their
singular values: as many as bring the frequencies within a tolerance at points that were held out. All terms are
projected on it, so that the exact frequencies of a draw are the eigenvalues of a small pencil; its diagonal at the
centre is the linear law.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.plate.beams import Beams
from bayesplate.plate.naming import ModePlace, assign_products, product_fits
from bayesplate.plate.pencils import InverseStep, inverse_step, pencil_modes, pencil_values
from bayesplate.plate.terms import Parity, Weights

SPARE_MODES = 4
"""Modes of a class above the highest wanted mode for which the basis is made too."""
_BATCH_SIZE = 64
"""Draws whose small matrices are held at once: more of them leave the processor's cache."""


@dataclass(frozen=True, eq=False)
class ReducedClass:
    """One symmetry class on few vectors: its modes at the centre, mass-orthonormal there, and vectors beside them."""

    parity: Parity
    stiffness: Floats  # (n_terms, r, r)
    masses: Floats  # (n_masses, r, r)
    n_kept: int  # of the vectors, the first ones: modes at the centre from which those of a draw are found
    products: tuple[Beams, ...]  # of beam functions that name its modes
    parts: Floats  # (r, n_products): components of each vector along these
    squares: Floats  # (r, r): mean products of the vectors' deflections
    coordinate_masses: Floats  # (n_masses, r, r): mass terms of the coordinates beside the plate alone
    n_rigid: int = 0  # rigid motions in the basis: the lowest eigenvalues, which are left out

    def eigenvalues(self, weights: Weights) -> Floats:
        """Elastic eigenvalues of many draws, increasing: (n_draws, n_kept - n_rigid) array, s^-2.

        Not a number at a draw that is no plate.
        """
        return np.concatenate([self._eigenvalues(batch) for batch in _batches(weights)])

    def _eigenvalues(self, weights: Weights) -> Floats:
        step = self._inverse_step(weights)
        values = (pencil_values(step.stiffness, step.mass) - step.shift)[:, self.n_rigid :]
        return np.where(values[:, :1] > 0.0, values, np.nan)

    def modes(self, weights: Weights, n_modes: int) -> tuple[Floats, Floats]:
        """Lowest elastic modes of many draws: (n_draws, n) eigenvalues, s^-2, and (n_draws, r, n) vectors.

        The vectors are combinations of the basis, normalised in the draw's mass. Neither is a number at a draw that is
        no plate.
        """
        values, vectors = zip(*(self._modes(batch, n_modes) for batch in _batches(weights)), strict=True)
        return np.concatenate(values), np.concatenate(vectors)

    def _modes(self, weights: Weights, n_modes: int) -> tuple[Floats, Floats]:
        step = self._inverse_step(weights)
        values, rotations = pencil_modes(step.stiffness, step.mass)
        elastic = slice(self.n_rigid, self.n_rigid + n_modes)
        values, vectors = (values - step.shift)[:, elastic], step.vectors @ rotations[:, :, elastic]
        is_plate = values[:, 0] > 0.0
        return np.where(is_plate[:, None], values, np.nan), np.where(is_plate[:, None, None], vectors, np.nan)

    def _inverse_step(self, weights: Weights) -> InverseStep:
        return inverse_step(
            _sum_terms(weights.stiffness, self.stiffness), self.mass(weights), self.n_kept, self.n_rigid
        )

    def mass(self, weights: Weights) -> Floats:
        """Mass matrices of many draws on the basis: (n_draws, r, r) array."""
        return _sum_terms(weights.mass, self.masses)

    def ranks(self, weights: Weights, n_modes: int, least_correlation: float = 0.0) -> Indices:
        """Rank of the mode that each of `products` names with at least that correlation: (n_draws, n_products).

        From 0; `n_modes` where it names none of the lowest elastic modes, -1 at a draw that is no plate.
        """
        ranks = np.full((len(weights.stiffness), len(self.products)), -1, dtype=np.intp)
        values, vectors = self.modes(weights, n_modes)
        for draw in np.flatnonzero(np.isfinite(values).all(axis=1)):
            ranks[draw] = n_modes
            for mode, (product, correlation) in enumerate(
                assign_products(self._product_fits(weights.mass[draw], vectors[draw]))
            ):
                if correlation >= least_correlation:
                    ranks[draw, product] = mode
        return ranks

    def _product_fits(self, mass: Floats, vectors: Floats) -> Floats:
        """How well each mode of a draw fits each product: (n_modes, n_products) array."""
        forms = np.stack([self.squares, np.tensordot(mass, self.coordinate_masses, axes=1)])
        squares, beside = np.einsum("rm,frs,sm->fm", vectors, forms, vectors, optimize=True)
        return product_fits(vectors.T @ self.parts, squares, 1.0 - beside)

    def energies(self, weights: Weights, n_modes: int) -> tuple[Floats, Floats]:
        """Energies of the lowest modes of one draw by term: (n_modes, n_terms) and (n_modes, n_masses) arrays.

        The ratio of their weighted sums is omega^2 to second order around the draw.
        """
        vectors = self.modes(weights, n_modes)[1][0]
        stiffness, mass = (
            np.einsum("rm,trs,sm->mt", vectors, terms, vectors, optimize=True)
            for terms in (self.stiffness, self.masses)
        )
        return stiffness, mass


@dataclass(frozen=True, eq=False)
class ReducedOrderModel:
    """The plate on a basis of few vectors in each class that holds wanted modes."""

    places: tuple[ModePlace, ...]  # the wanted modes, in the caller's order
    classes: tuple[ReducedClass, ...]
    worst_cents: float  # largest error against full solves that were held out

    def eigenvalues(self, weights: Weights) -> Floats:
        """Eigenvalue of each wanted mode for many draws: (n_draws, n_modes) array, s^-2."""
        values = np.empty((weights.stiffness.shape[0], len(self.places)))
        for reduced in self.classes:
            columns, ranks = self._modes_of(reduced)
            values[:, columns] = reduced.eigenvalues(weights)[:, ranks]
        return values

    def ranks(self, weights: Weights, least_correlation: float = 0.0) -> dict[Beams, Indices]:
        """Rank in its class of the mode that each product names with at least that correlation: (n_draws,).

        A product that names none of the lowest modes has the highest rank of all; -1 at a draw that is no plate.
        """
        ranks: dict[Beams, Indices] = {}
        for reduced in self.classes:
            n_modes = max(self._modes_of(reduced)[1]) + 1 + SPARE_MODES
            ranks |= dict(zip(reduced.products, reduced.ranks(weights, n_modes, least_correlation).T, strict=True))
        return ranks

    def energies(self, weights: Weights) -> tuple[Floats, Floats]:
        """Energies of each wanted mode of one draw by term: (n_modes, n_terms) and (n_modes, n_masses) arrays."""
        stiffness, mass = (np.empty((len(self.places), w.shape[1])) for w in weights)
        for reduced in self.classes:
            columns, ranks = self._modes_of(reduced)
            stiffness[columns], mass[columns] = (w[ranks] for w in reduced.energies(weights, max(ranks) + 1))
        return stiffness, mass

    def _modes_of(self, reduced: ReducedClass) -> tuple[list[int], list[int]]:
        """Indices of the wanted modes that are of a class, and their ranks there."""
        modes = [(i, place.rank) for i, place in enumerate(self.places) if place.parity == reduced.parity]
        return [i for i, _ in modes], [rank for _, rank in modes]


def _batches(weights: Weights) -> Iterator[Weights]:
    for start in range(0, max(len(weights.stiffness), 1), _BATCH_SIZE):
        yield Weights(*(term_weights[start : start + _BATCH_SIZE] for term_weights in weights))


def _sum_terms(weights: Floats, terms: Floats) -> Floats:
    """Weighted sums of terms, one (r, r) matrix per draw."""
    n_terms, r, _ = terms.shape
    return (weights @ terms.reshape(n_terms, r * r)).reshape(-1, r, r)
