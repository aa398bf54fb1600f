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
from bayesplate.modes.solve import ClassModes, solve_class

_SPARE = 2
_LOWEST_SHARE = 1e-6
_ACCEPTED_CENTS = 0.1
_STEADY = 0.05


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
    n_rigid : int
        Rigid motions in the basis: the lowest eigenvalues, which are left out.
    shift : float, s^-2
        Keeps the stiffness of rigid motions above zero where several masses ask for a pencil.
    """

    parity: Parity
    stiffness: NDArray[np.float64]
    masses: NDArray[np.float64]
    n_rigid: int = 0
    shift: float = 1.0

    def eigenvalues(self, weights: Weights) -> NDArray[np.float64]:
        """Elastic eigenvalues of many draws, increasing: (n_draws, r - n_rigid) array, s^-2."""
        stiffness = _weighted(weights.stiffness, self.stiffness)
        if not len(self.masses):
            return np.asarray(np.linalg.eigvalsh(stiffness) / weights.mass[:, :1])[:, self.n_rigid :]
        mass = _weighted(weights.mass, self.masses)
        try:
            values = _pencil(stiffness, mass, self.shift)
        except np.linalg.LinAlgError:
            values = np.concatenate([_pencil_or_nan(k, m, self.shift) for k, m in zip(stiffness, mass, strict=True)])
        return np.asarray(values[:, self.n_rigid :])


def _pencil(stiffness: NDArray[np.float64], mass: NDArray[np.float64], shift: float) -> NDArray[np.float64]:
    """Eigenvalues of (n, r, r) pencils, increasing; the stiffness is factorised, for shear strains have no mass."""
    inverse = np.linalg.inv(np.linalg.cholesky(stiffness + shift * mass))
    values = 1.0 / np.linalg.eigvalsh(inverse @ mass @ np.swapaxes(inverse, -1, -2)) - shift
    return np.asarray(values[:, ::-1])


def _pencil_or_nan(stiffness: NDArray[np.float64], mass: NDArray[np.float64], shift: float) -> NDArray[np.float64]:
    """The same of one pencil; not a number where the weights are those of no material."""
    try:
        return _pencil(stiffness[None], mass[None], shift)
    except np.linalg.LinAlgError:
        return np.full((1, len(stiffness)), np.nan)


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
    trained = [solve_class(block, weights, n_modes + _SPARE) for weights in training]
    vectors = [solution.vectors for solution in trained]
    # A second mass lets elastic modes carry some rigid motion; with the board's own alone they are orthogonal to it.
    rigid = trained[0].rigid[:, : block.n_rigid if block.n_masses > 1 else 0]
    solutions = [solve_class(block, weights, n_modes + _SPARE) for weights in held_out]
    exact = np.stack([solution.eigenvalues[:n_modes] for solution in solutions])
    is_steady = _is_steady([*training, *held_out])
    together = Weights(*(np.stack(w) for w in zip(*held_out, strict=True)))
    for n_joined in range(0, len(held_out) // 2 + 1, max(1, len(held_out) // 4)):
        joined = [solution.vectors for solution in solutions[:n_joined]]
        reduced = _project(
            block, rigid, np.concatenate([*vectors, *joined], axis=1), trained[0], training[0], is_steady
        )
        ratios = reduced.eigenvalues(together)[n_joined:, :n_modes] / exact[n_joined:]
        worst = 600.0 * float(np.abs(np.log2(ratios)).max())
        if worst <= _ACCEPTED_CENTS:
            break
    return reduced, worst


def _project(
    block: Block,
    rigid: NDArray[np.float64],
    elastic: NDArray[np.float64],
    centre: ClassModes,
    weights: Weights,
    is_steady: bool,
) -> ReducedBlock:
    """Orthonormalise in energy, dropping directions that the vectors hardly span, and project the terms."""
    vectors = np.concatenate([rigid, elastic], axis=1)
    highest = float(centre.eigenvalues[-1])
    norm = block.stiffness(weights) + highest * block.mass(weights)
    gram = vectors.T @ (norm @ vectors)
    scale = 1.0 / np.sqrt(np.diagonal(gram))
    shares, directions = np.linalg.eigh(scale[:, None] * gram * scale)
    kept = shares > _LOWEST_SHARE * shares[-1]
    basis = (vectors * scale) @ (directions[:, kept] / np.sqrt(shares[kept]))
    masses = block.project_masses(basis)
    if is_steady:
        steady = np.tensordot(weights.mass, masses, axes=1)
        basis = basis @ np.linalg.inv(np.linalg.cholesky(steady)).T
        masses = masses[:0]
    stiffness = block.project(block.terms, basis)
    return ReducedBlock(block.parity, stiffness, masses, rigid.shape[1], float(centre.eigenvalues[0]))


def _is_steady(points: Sequence[Weights]) -> bool:
    """Whether all mass weights stay within a few per cent of those of the first point."""
    first = points[0].mass
    return all(np.all(np.abs(point.mass - first) <= _STEADY * np.abs(first)) for point in points)
