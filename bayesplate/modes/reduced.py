"""The reduced-order model: all stiffness and mass terms projected on the modes at the estimate and at points around it.

Its eigenvalues are the exact frequencies to a few hundredths of a cent, thousands of times faster than a full solve;
its diagonal at the centre is the linear law. `bayesplate.modes.reduction` builds it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.definite import packed
from bayesplate.modes.naming import Place, fits, name_parts
from bayesplate.modes.pencils import (
    condensed_eigenvalues,
    pencil_eigenvalues,
    pencil_modes,
    stepped_eigenvalues,
    stepped_modes,
)
from bayesplate.modes.plate import Beams, Parity, Weights
from bayesplate.modes.threads import in_threads

SPARE = 2
"""Modes above the highest wanted one of a class that the basis is made for too."""
WHOLE = 40
"""Vectors up to which a draw's eigenvalues come from the whole small problem; above, with most vectors condensed."""
_BATCH, _SMALL_BATCH = 24, 512
"""Draws whose large or small matrices are held at once, at most: those of a whole posterior would not fit any cache."""


@dataclass(frozen=True, eq=False)
class ReducedBlock:
    """One symmetry class on a basis of few vectors, mass-orthonormal.

    Attributes
    ----------
    parity : Parity
    stiffness : (n_terms, r, r) array
        Projected stiffness terms.
    masses : (n_masses, r, r) array
        Projected mass terms; none where the mass hardly varies over the region and the basis is orthonormal in it.
    parts : (r, n_products) array
        What each vector has of the products of beam functions that name modes.
    products : tuple of (int, int)
        Their orders along x and y.
    n_rigid : int
        Rigid motions in the basis: the lowest eigenvalues, which are left out.
    shift : float, s^-2
        Keeps the stiffness of rigid motions above zero where several masses ask for a pencil.
    n_kept : int
        Where it is not 0, the basis is the block's modes at the centre in the order of their frequencies, and the
        modes of each draw are found from so many of them (`bayesplate.modes.pencils`).
    n_steps : int
        Steps of inverse iteration that they go; where it is 0, they take all others along to first order instead.
    squares : (r, r) array
        Mean products of the vectors' deflections.
    beside : (n_masses, r, r) array
        What each mass term gives to the coordinates beside the plate.
    """

    parity: Parity
    stiffness: NDArray[np.float64]
    masses: NDArray[np.float64]
    parts: NDArray[np.float64]
    products: tuple[Beams, ...]
    n_rigid: int = 0
    shift: float = 1.0
    n_kept: int = 0
    n_steps: int = 0
    squares: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0)))
    beside: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0, 0)))

    def eigenvalues(self, weights: Weights) -> NDArray[np.float64]:
        """Elastic eigenvalues of many draws, increasing: (n_draws, n) array, s^-2.

        All r - n_rigid of them, or n_kept - n_rigid.
        """
        is_large = self.stiffness.shape[-1] > WHOLE
        starts = _starts(len(weights.stiffness)) if is_large else range(0, max(len(weights.stiffness), 1), _SMALL_BATCH)
        parts = [Weights(*(w[start : start + starts.step] for w in weights)) for start in starts]
        found = in_threads(self._eigenvalues, parts) if is_large else [self._eigenvalues(part) for part in parts]
        return np.concatenate(found)

    def _eigenvalues(self, weights: Weights) -> NDArray[np.float64]:
        if self.n_kept and self.n_steps:
            shift, triangles, mass = self._shifted(weights)
            values = stepped_eigenvalues(triangles, mass, self.n_kept, self.n_steps) - shift
        else:
            stiffness = _weighted(weights.stiffness, self.stiffness)
            mass = _weighted(weights.mass, self.masses) if len(self.masses) else None
            if self.n_kept:
                values = condensed_eigenvalues(stiffness, mass, self.n_kept, self.n_rigid)
            elif mass is None:
                values = np.asarray(np.linalg.eigvalsh(stiffness), dtype=np.float64)
            else:
                values = pencil_eigenvalues(stiffness, mass, self.shift)
        values = values[:, self.n_rigid :]
        return np.asarray(values if len(self.masses) else values / weights.mass[:, :1])

    def modes(self, weights: Weights, n_modes: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest elastic modes of many draws: (n_draws, n) eigenvalues, s^-2, and (n_draws, r, n) vectors.

        The vectors are combinations of the basis, normalised in the draw's mass. Neither is a number at a draw that is
        no plate.
        """
        n_wanted = min(n_modes + self.n_rigid, self.stiffness.shape[-1])
        if self.n_kept >= n_wanted and self.n_steps:
            shift, triangles, mass = self._shifted(weights)
            values, vectors = stepped_modes(triangles, mass, self.n_kept, self.n_steps, n_wanted)
            values -= shift
            if not len(self.masses):
                values, vectors = values / weights.mass[:, :1], vectors / np.sqrt(weights.mass[:, :1, None])
        else:
            stiffness = _weighted(weights.stiffness, self.stiffness)
            values, vectors = pencil_modes(stiffness, self.mass(weights), self.shift, n_wanted)
        return values[:, self.n_rigid :], vectors[:, :, self.n_rigid :]

    def _shifted(self, weights: Weights) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64] | None]:
        """What lifts rigid motions off zero at many draws, (n_draws, 1) in s^-2; the stiffness so lifted, packed; mass.

        The shift is the draw's own, so that eigenvalues are homogeneous in the stiffness.
        """
        lowest = self.n_rigid
        stiffness = weights.stiffness @ self.stiffness[:, lowest, lowest, None]
        if not len(self.masses):
            return stiffness, np.hstack([weights.stiffness, stiffness]) @ self._triangles, None
        shift = stiffness / (weights.mass @ self.masses[:, lowest, lowest, None])
        shifted = np.hstack([weights.stiffness, shift * weights.mass]) @ self._triangles
        return shift, shifted, _weighted(weights.mass, self.masses)

    @cached_property
    def _triangles(self) -> NDArray[np.float64]:
        """The stiffness terms and then the masses, packed: (n_terms + n_masses, r (r + 1) / 2) array."""
        masses = self.masses if len(self.masses) else np.eye(self.stiffness.shape[-1])[None]
        return np.concatenate([packed(terms) for terms in (self.stiffness, masses)])

    def ranks(self, weights: Weights, n_modes: int, least: float = 0.0) -> NDArray[np.intp]:
        """Which of the lowest elastic modes each of `products` names, with at least that correlation, at many draws.

        Returns
        -------
        (n_draws, n_products) array of int
            From 0; `n_modes` where it names none of them, -1 at a draw that is no plate.
        """
        found = np.full((len(weights.stiffness), len(self.products)), -1, dtype=np.intp)
        values, vectors = self.modes(weights, n_modes)
        for draw in np.flatnonzero(np.isfinite(values).all(axis=1)):
            found[draw] = n_modes
            for mode, (product, correlation) in enumerate(name_parts(self._fits(weights.mass[draw], vectors[draw]))):
                if correlation >= least:
                    found[draw, product] = mode
        return found

    def _fits(self, mass: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """How well each mode of a draw fits each product: (n_modes, n_products) array."""
        forms = np.stack([self.squares, np.tensordot(mass[: len(self.beside)], self.beside, axes=1)])
        squares, beside = np.einsum("rm,frs,sm->fm", vectors, forms, vectors, optimize=True)
        return fits(vectors.T @ self.parts, squares, 1.0 - beside)

    def energies(self, weights: Weights, n_modes: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What each term has of the lowest modes of one draw: (n_modes, n_terms) and (n_modes, n_masses) arrays.

        The ratio of their weighted sums is omega^2 to second order around the draw.
        """
        vectors = self.modes(weights, n_modes)[1][0].T
        products = (vectors[:, :, None] * vectors[:, None, :]).reshape(len(vectors), -1)
        stiffness = products @ self.stiffness.reshape(len(self.stiffness), -1).T
        if len(self.masses):
            return stiffness, products @ self.masses.reshape(len(self.masses), -1).T
        first = np.eye(weights.mass.shape[1])[:1]
        return stiffness, (vectors**2).sum(axis=1)[:, None] * first

    def mass(self, weights: Weights) -> NDArray[np.float64]:
        """Mass matrices of many draws on the basis: (n_draws, r, r) array."""
        if len(self.masses):
            return _weighted(weights.mass, self.masses)
        return weights.mass[:, :1, None] * np.eye(self.stiffness.shape[-1])


def _starts(n_draws: int) -> range:
    """First draws of batches of equal size, an even number of them: no core waits for another."""
    n_batches = 2 * max(-(-n_draws // (2 * _BATCH)), 1)
    return range(0, max(n_draws, 1), max(-(-n_draws // n_batches), 1))


def _weighted(weights: NDArray[np.float64], terms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weighted sums of terms, one (r, r) matrix per draw."""
    n_terms, r, _ = terms.shape
    return (weights @ terms.reshape(n_terms, r * r)).reshape(-1, r, r)


@dataclass(frozen=True, eq=False)
class ReducedOrderModel:
    """The plate on a basis of few vectors in each class that holds wanted modes.

    Attributes
    ----------
    places : tuple of Place
        The wanted modes, in the caller's order.
    blocks : tuple of ReducedBlock
    worst_cents : float
        Largest error against full solves that were held out when the basis was built.
    """

    places: tuple[Place, ...]
    blocks: tuple[ReducedBlock, ...]
    worst_cents: float

    def eigenvalues(self, weights: Weights) -> NDArray[np.float64]:
        """Eigenvalue of each wanted mode for many draws: (n_draws, n_modes) array, s^-2."""
        values = np.empty((weights.stiffness.shape[0], len(self.places)))
        for block in self.blocks:
            columns = [i for i, place in enumerate(self.places) if place.parity == block.parity]
            values[:, columns] = block.eigenvalues(weights)[:, [self.places[i].rank for i in columns]]
        return values

    def ranks(self, weights: Weights, least: float = 0.0) -> dict[Beams, NDArray[np.intp]]:
        """Rank in its class of the mode that each product of beam functions names, at many draws.

        Parameters
        ----------
        weights : Weights
        least : float
            Correlation of its shape with the product from which on a mode has that name.

        Returns
        -------
        dict of (n_draws,) array of int
            By the orders along x and y; those that name none of the lowest modes have the highest rank of all. -1 at a
            draw that is no plate.
        """
        found: dict[Beams, NDArray[np.intp]] = {}
        for block in self.blocks:
            highest = max(place.rank for place in self.places if place.parity == block.parity)
            found |= dict(zip(block.products, block.ranks(weights, highest + 1 + SPARE, least).T, strict=True))
        return found

    def energies(self, weights: Weights) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What each term has of each wanted mode of one draw: (n_modes, n_terms) and (n_modes, n_masses) arrays."""
        stiffness, mass = (np.empty((len(self.places), part.shape[1])) for part in weights)
        for block in self.blocks:
            columns = [i for i, place in enumerate(self.places) if place.parity == block.parity]
            ranks = [self.places[i].rank for i in columns]
            own = block.energies(weights, max(ranks) + 1)
            stiffness[columns], mass[columns] = (part[ranks] for part in own)
        return stiffness, mass
