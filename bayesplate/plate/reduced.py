"""The plate on a reduced basis: few vectors hold its modes over a whole region, thousands of times faster than a solve.

The basis holds the modes at the centre and what those at points around it have beside these, in the order of their
singular values, as many as bring the frequencies within a tolerance at points that were held out. All terms are
projected on it, so that the exact frequencies of a draw are the eigenvalues of a small pencil; its diagonal at the
centre is the linear law.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.plate.beams import Beams
from bayesplate.plate.naming import Place, fits, name_parts
from bayesplate.plate.pencils import pencil_modes, pencil_values, stepped
from bayesplate.plate.terms import Parity, Weights

SPARE = 4
"""Modes above the highest wanted one of a class that the basis is made for too."""
_BATCH = 512
"""Draws whose small matrices are held at once."""


@dataclass(frozen=True, eq=False)
class ReducedClass:
    """One symmetry class on few vectors: its modes at the centre, mass-orthonormal there, and what completes them."""

    parity: Parity
    stiffness: Floats  # (n_terms, r, r)
    masses: Floats  # (n_masses, r, r)
    n_kept: int  # of the vectors, the first ones: modes at the centre from which those of a draw are found
    products: tuple[Beams, ...]  # of beam functions that name its modes
    parts: Floats  # (r, n_products): what each vector has of these
    squares: Floats  # (r, r): mean products of the vectors' deflections
    beside: Floats  # (n_masses, r, r): what each mass term gives to the coordinates beside the plate
    n_rigid: int = 0  # rigid motions in the basis: the lowest eigenvalues, which are left out

    def eigenvalues(self, weights: Weights) -> Floats:
        """Elastic eigenvalues of many draws, increasing: (n_draws, n_kept - n_rigid) array, s^-2.

        Not a number at a draw that is no plate.
        """
        return np.concatenate([self._eigenvalues(part) for part in _batches(weights)])

    def _eigenvalues(self, weights: Weights) -> Floats:
        step = stepped(_weighted(weights.stiffness, self.stiffness), self.mass(weights), self.n_kept, self.n_rigid)
        values = (pencil_values(step.stiffness, step.mass) - step.shift)[:, self.n_rigid :]
        return np.where(values[:, :1] > 0.0, values, np.nan)

    def modes(self, weights: Weights, n_modes: int) -> tuple[Floats, Floats]:
        """Lowest elastic modes of many draws: (n_draws, n) eigenvalues, s^-2, and (n_draws, r, n) vectors.

        The vectors are combinations of the basis, normalised in the draw's mass. Neither is a number at a draw that is
        no plate.
        """
        step = stepped(_weighted(weights.stiffness, self.stiffness), self.mass(weights), self.n_kept, self.n_rigid)
        values, turned = pencil_modes(step.stiffness, step.mass)
        elastic = slice(self.n_rigid, self.n_rigid + n_modes)
        values, vectors = (values - step.shift)[:, elastic], step.vectors @ turned[:, :, elastic]
        is_plate = values[:, 0] > 0.0
        return np.where(is_plate[:, None], values, np.nan), np.where(is_plate[:, None, None], vectors, np.nan)

    def mass(self, weights: Weights) -> Floats:
        """Mass matrices of many draws on the basis: (n_draws, r, r) array."""
        return _weighted(weights.mass, self.masses)

    def ranks(self, weights: Weights, n_modes: int, least: float = 0.0) -> Indices:
        """Rank of the mode that each of `products` names with at least that correlation: (n_draws, n_products).

        From 0; `n_modes` where it names none of the lowest elastic modes, -1 at a draw that is no plate.
        """
        found = np.full((len(weights.stiffness), len(self.products)), -1, dtype=np.intp)
        values, vectors = self.modes(weights, n_modes)
        for draw in np.flatnonzero(np.isfinite(values).all(axis=1)):
            found[draw] = n_modes
            for mode, (product, correlation) in enumerate(name_parts(self._fits(weights.mass[draw], vectors[draw]))):
                if correlation >= least:
                    found[draw, product] = mode
        return found

    def _fits(self, mass: Floats, vectors: Floats) -> Floats:
        """How well each mode of a draw fits each product: (n_modes, n_products) array."""
        forms = np.stack([self.squares, np.tensordot(mass, self.beside, axes=1)])
        squares, beside = np.einsum("rm,frs,sm->fm", vectors, forms, vectors, optimize=True)
        return fits(vectors.T @ self.parts, squares, 1.0 - beside)

    def energies(self, weights: Weights, n_modes: int) -> tuple[Floats, Floats]:
        """What each term has of the lowest modes of one draw: (n_modes, n_terms) and (n_modes, n_masses) arrays.

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

    places: tuple[Place, ...]  # the wanted modes, in the caller's order
    classes: tuple[ReducedClass, ...]
    worst_cents: float  # largest error against full solves that were held out

    def eigenvalues(self, weights: Weights) -> Floats:
        """Eigenvalue of each wanted mode for many draws: (n_draws, n_modes) array, s^-2."""
        values = np.empty((weights.stiffness.shape[0], len(self.places)))
        for own in self.classes:
            columns, ranks = self._of(own)
            values[:, columns] = own.eigenvalues(weights)[:, ranks]
        return values

    def ranks(self, weights: Weights, least: float = 0.0) -> dict[Beams, Indices]:
        """Rank in its class of the mode that each product names with at least that correlation: (n_draws,).

        A product that names none of the lowest modes has the highest rank of all; -1 at a draw that is no plate.
        """
        found: dict[Beams, Indices] = {}
        for own in self.classes:
            n_modes = max(self._of(own)[1]) + 1 + SPARE
            found |= dict(zip(own.products, own.ranks(weights, n_modes, least).T, strict=True))
        return found

    def energies(self, weights: Weights) -> tuple[Floats, Floats]:
        """What each term has of each wanted mode of one draw: (n_modes, n_terms) and (n_modes, n_masses) arrays."""
        stiffness, mass = (np.empty((len(self.places), part.shape[1])) for part in weights)
        for own in self.classes:
            columns, ranks = self._of(own)
            stiffness[columns], mass[columns] = (part[ranks] for part in own.energies(weights, max(ranks) + 1))
        return stiffness, mass

    def _of(self, own: ReducedClass) -> tuple[list[int], list[int]]:
        """Indices of the wanted modes that are of a class, and their ranks there."""
        both = [(i, place.rank) for i, place in enumerate(self.places) if place.parity == own.parity]
        return [i for i, _ in both], [rank for _, rank in both]


def _batches(weights: Weights) -> Iterator[Weights]:
    for start in range(0, max(len(weights.stiffness), 1), _BATCH):
        yield Weights(*(part[start : start + _BATCH] for part in weights))


def _weighted(weights: Floats, terms: Floats) -> Floats:
    """Weighted sums of terms, one (r, r) matrix per draw."""
    n_terms, r, _ = terms.shape
    return (weights @ terms.reshape(n_terms, r * r)).reshape(-1, r, r)
