"""Modal matrices: every stiffness and mass term projected on the modes at the estimate and at points around it.

The eigenvalues of these few small matrices are the exact frequencies to a few hundredths of a cent, thousands of times
faster than a full solve; the diagonal at the centre is the linear law. `ModalMatrices` is checked against full solves
it has not seen when it is built.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.naming import Place
from bayesplate.modes.plate import Block, Parity, PlateMatrices, Weights
from bayesplate.modes.solve import solve_class

_SPARE = 2
_LOWEST_WEIGHT = 1e-8
_ACCEPTED_CENTS = 0.1


@dataclass(frozen=True, eq=False)
class ReducedBlock:
    """One symmetry class on a basis of few vectors, mass-orthonormal.

    Attributes
    ----------
    parity : Parity
    stiffness : (n_terms, r, r) array
        Projected stiffness terms.
    masses : (n_masses, r, r) array
        Projected mass terms; the first, the board's own, is the identity.
    """

    parity: Parity
    stiffness: NDArray[np.float64]
    masses: NDArray[np.float64]

    def eigenvalues(self, weights: Weights) -> NDArray[np.float64]:
        """Elastic eigenvalues of many draws, increasing: (n_draws, r) array, s^-2."""
        stiffness = _weighted(weights.stiffness, self.stiffness)
        if len(self.masses) == 1:
            return np.asarray(np.linalg.eigvalsh(stiffness)) / weights.mass
        inverse = np.linalg.inv(np.linalg.cholesky(_weighted(weights.mass, self.masses)))
        return np.asarray(np.linalg.eigvalsh(inverse @ stiffness @ np.swapaxes(inverse, -1, -2)))


def _weighted(weights: NDArray[np.float64], terms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weighted sums of terms, one (r, r) matrix a draw."""
    n_terms, r, _ = terms.shape
    return (weights @ terms.reshape(n_terms, r * r)).reshape(-1, r, r)


@dataclass(frozen=True, eq=False)
class ModalMatrices:
    """Small matrices of the classes that hold the wanted modes.

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


def modal_matrices(
    plate: PlateMatrices,
    places: Sequence[Place],
    centre: Weights,
    around: Iterable[Weights],
    held_out: Sequence[Weights],
) -> ModalMatrices:
    """Project a plate on its modes at `centre` and `around` it, and check the result at the points `held_out`.

    While the error there exceeds a tenth of a cent, held-out points join the basis, in their order and at most half of
    them. The check is made at those that did not join: they lie as far out as the others, and none was chosen for its
    error, so that it is an honest sample of the error over the region.

    Parameters
    ----------
    plate : PlateMatrices
    places : sequence of Place
        The modes wanted.
    centre : Weights
        At the estimate.
    around, held_out : sequences of Weights
        At least one is held out.

    Returns
    -------
    ModalMatrices
    """
    ranks: dict[Parity, int] = {}
    for place in places:
        ranks[place.parity] = max(ranks.get(place.parity, 0), place.rank + 1)
    training = [centre, *around]
    blocks = []
    worst = 0.0
    for parity, n_modes in ranks.items():
        block, error = _reduce(plate.block(parity), n_modes, training, held_out)
        blocks.append(block)
        worst = max(worst, error)
    return ModalMatrices(tuple(places), tuple(blocks), worst)


def _reduce(
    block: Block, n_modes: int, training: list[Weights], held_out: Sequence[Weights]
) -> tuple[ReducedBlock, float]:
    vectors = [solve_class(block, weights, n_modes + _SPARE).vectors for weights in training]
    solutions = [solve_class(block, weights, n_modes + _SPARE) for weights in held_out]
    exact = np.stack([solution.eigenvalues[:n_modes] for solution in solutions])
    together = Weights(*(np.stack(w) for w in zip(*held_out, strict=True)))
    for n_joined in range(0, len(held_out) // 2 + 1, max(1, len(held_out) // 4)):
        joined = [solution.vectors for solution in solutions[:n_joined]]
        reduced = _project(block, np.concatenate([*vectors, *joined], axis=1))
        ratios = reduced.eigenvalues(together)[n_joined:, :n_modes] / exact[n_joined:]
        worst = 600.0 * float(np.abs(np.log2(ratios)).max())
        if worst <= _ACCEPTED_CENTS:
            break
    return reduced, worst


def _project(block: Block, vectors: NDArray[np.float64]) -> ReducedBlock:
    """Orthonormalise by the Gram matrix, dropping directions that the vectors hardly span, and project the terms."""
    gram = vectors.T @ (block.matrix(block.masses[0]) @ vectors)
    scale = 1.0 / np.sqrt(np.diagonal(gram))
    weights, directions = np.linalg.eigh(scale[:, None] * gram * scale)
    kept = weights > _LOWEST_WEIGHT * weights[-1]
    basis = (vectors * scale) @ (directions[:, kept] / np.sqrt(weights[kept]))

    def projected(terms: NDArray[np.float64]) -> NDArray[np.float64]:
        small = np.stack([basis.T @ (block.matrix(term) @ basis) for term in terms])
        return (small + np.swapaxes(small, -1, -2)) / 2.0

    return ReducedBlock(block.parity, projected(block.terms), projected(block.masses))
