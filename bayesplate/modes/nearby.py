"""Modes of a plate near one whose modes are known: two steps of inverse iteration with all of them at once.

A reduced-order model is trained at dozens of plates that differ little from the one in the middle. Its modes and a few
beyond span those of the others but for some per cent; each step X -> K^-1 M X takes a great part of what they miss, of
the lower ones nearly all (subspace iteration: Bathe and Wilson, Numerical Methods in Finite Element Analysis, 1976,
chapter 12). The Ritz vectors after two steps are the modes to some hundred-thousandths of their eigenvalues, in a third
of the time of a solution from nothing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.banded import BandFactor
from bayesplate.modes.plate import Block, Weights
from bayesplate.modes.solve import ClassModes, class_modes, shift_below

Floats = NDArray[np.float64]

BESIDE = 8
"""Modes beyond the wanted ones that the known plate should have."""
_N_STEPS = 2
_SPANNED = 1e-12
"""Share of the direction that vectors span most, below which they hardly span one."""


def modes_nearby(block: Block, weights: Weights, known: ClassModes, n_modes: int) -> ClassModes:
    """Lowest `n_modes` elastic modes of one class, from those of a plate that differs little.

    Parameters
    ----------
    block : Block
    weights : Weights
        Of one draw.
    known : ClassModes
        The lowest modes at other weights, `BESIDE` more than wanted.
    n_modes : int

    Returns
    -------
    ClassModes
        Eigenvalues are Ritz values, never below those of `bayesplate.modes.solve.solve_class`.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the weights are those of no plate.
    """
    pencil = np.stack([block.stored_stiffness(weights), weights.mass[: len(block.masses)] @ block.masses])
    shift = shift_below(block, *(stored[block.diagonal] for stored in pencil))
    factor = _factor(block, pencil[0] - shift * pencil[1])
    vectors = np.concatenate([known.rigid, known.vectors], axis=1)
    loads = block.times(pencil[1:], vectors)[0]
    for _ in range(_N_STEPS):
        loads = _without_rigid(loads, vectors[:, : block.n_rigid])
        values, vectors, loads = _ritz(block, weights, pencil, factor.solve(loads))
    return class_modes(block, weights, values[: block.n_rigid + n_modes], vectors)


def _factor(block: Block, stored: Floats) -> Any:
    """What solves equations with a matrix of the class; a coordinate beside the plate reaches all over any band."""
    if not block.n_beside:
        return BandFactor(block.band, stored)
    from scipy.sparse.linalg import splu

    options = {"SymmetricMode": True}
    return splu(block.matrix(stored), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def _without_rigid(loads: Floats, rigid: Floats) -> Floats:
    """The loads, those of rigid motions first, less what the others have of these: (n_dof, n) array.

    The span is the same, but no step amplifies a common part a million times and leaves vectors hardly different.
    """
    n = rigid.shape[1]
    shares = np.linalg.solve(rigid.T @ loads[:, :n], rigid.T @ loads[:, n:])
    return np.concatenate([loads[:, :n], loads[:, n:] - loads[:, :n] @ shares], axis=1)


def _ritz(block: Block, weights: Weights, pencil: Floats, vectors: Floats) -> tuple[Floats, Floats, Floats]:
    """Modes on the span of some vectors: eigenvalues, (n_dof, n) vectors, and the sparse mass times these."""
    stiff, inert = block.times(pencil, vectors)
    stiffness, mass = vectors.T @ stiff + block.further_stiffness(weights, vectors), vectors.T @ inert
    if block.projected:
        mass = np.tensordot(weights.mass, block.project_masses(vectors), axes=1)
    if not (np.diagonal(mass) > 0.0).all():
        raise np.linalg.LinAlgError("the mass is not positive definite")
    scale = 1.0 / np.sqrt(np.diagonal(mass))
    shares, directions = np.linalg.eigh(scale[:, None] * mass * scale)
    spanned = shares > _SPANNED * shares[-1]
    one = (scale[:, None] * directions[:, spanned]) / np.sqrt(shares[spanned])
    values, turned = np.linalg.eigh(one.T @ stiffness @ one)
    found = one @ turned
    return values, vectors @ found, inert @ found
