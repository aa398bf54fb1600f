"""Modes near those of a known plate: against a dense solver, rigid motions and projected masses among them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import ritz
from scipy.linalg import eigh

from bayesplate.modes import nearby
from bayesplate.modes.nearby import BESIDE, modes_nearby
from bayesplate.modes.plate import Weights
from bayesplate.modes.shear import shear_flexible_plate
from bayesplate.modes.solve import solve_class
from bayesplate.modes.thin import thin_plate

N_MODES = 6
WORST = 1e-4
"""Of an eigenvalue, 0.09 cent: less than a reduced-order model may be off by."""


def layer_of_air(line_x, line_y, deflections):
    """A tenth of the board's mass that moves as the plate does on the average of each quarter."""
    at = (np.arange(8) + 0.5) / 8
    along_x, along_y = (line.shapes(at).toarray().reshape(2, 4, -1).mean(axis=1) for line in (line_x, line_y))
    moved = np.einsum("vij,ai,bj->vab", deflections, along_x, along_y).reshape(len(deflections), -1)
    return 0.1 * moved @ moved.T


@cache
def plates():
    """A cantilever, a free plate in two theories, and a free one in air, each with its weights."""
    sheared = Weights(np.array([*ritz.FREE_SPRUCE.unit_weights, 2e4, 1e3]), np.array([1.0, 1e-4, 1e-3]))
    thin = {
        name: Weights(board.unit_weights, np.ones(1))
        for name, board in (("cantilever", ritz.FINNISH), ("free", ritz.FREE_SPRUCE))
    }
    ends = {"cantilever": ritz.FINNISH.ends, "free": ritz.FREE_SPRUCE.ends}
    found = {name: (thin_plate(*ends[name], 8, 8), weights) for name, weights in thin.items()}
    found["shear-flexible"] = shear_flexible_plate(*ends["free"], 8, 8), sheared
    loaded = Weights(thin["free"].stiffness, np.ones(2))
    found["in air"] = found["free"][0].with_projected([layer_of_air]), loaded
    return found


def moved(weights, seed):
    """Weights up to an eighth larger or smaller, each by itself."""
    rng = np.random.default_rng(seed)
    return Weights(*(one * np.exp(rng.uniform(-0.12, 0.12, one.size)) for one in weights))


def alone(block, weights):
    """The elastic eigenvalues by a dense solver."""
    mass = np.tensordot(weights.mass, block.project_masses(np.eye(block.n_dof)), axes=1)
    return eigh(block.stiffness(weights).toarray(), mass, eigvals_only=True)[block.n_rigid :]


def misses(name):
    """How far eigenvalues are from those of a dense solver's, relative: of all classes at three plates."""
    plate, weights = plates()[name]
    found = []
    for block in plate.blocks:
        known = solve_class(block, weights, N_MODES + BESIDE)
        for seed in range(3):
            there = moved(weights, seed)
            modes = modes_nearby(block, there, known, N_MODES)
            mass = np.tensordot(there.mass, block.project_masses(modes.vectors), axes=1)
            np.testing.assert_allclose(mass, np.eye(N_MODES), atol=1e-8)
            found.append(modes.eigenvalues / alone(block, there)[:N_MODES] - 1.0)
    return np.array(found)


@pytest.mark.parametrize("name", ["cantilever", "free", "shear-flexible", "in air"])
def test_modes_nearby_are_those_of_a_dense_solver(name):
    off = misses(name)
    assert np.abs(off).max() < WORST
    assert off.min() > -1e-7


@pytest.mark.parametrize("name", ["free", "shear-flexible"])
def test_the_second_step_takes_most_of_what_the_first_one_leaves(name, monkeypatch):
    """Each takes off what a mode misses by the ratio of its eigenvalue to that of the first mode beyond the known ones.

    That is below a sixth here, and eigenvalues err by its square; a factor of three is for the plates being others.
    """
    twice = np.abs(misses(name)).max()
    monkeypatch.setattr(nearby, "_N_STEPS", nearby._N_STEPS - 1)
    assert twice < 3.0 / 36.0 * np.abs(misses(name)).max()


def test_without_steps_they_are_not(monkeypatch):
    """The known modes alone are off by far more."""
    monkeypatch.setattr(nearby.BandFactor, "solve", lambda self, loads: loads)
    assert np.abs(misses("free")).max() > 10.0 * WORST


def test_weights_of_no_plate_are_told():
    plate, weights = plates()["free"]
    block = plate.blocks[0]
    known = solve_class(block, weights, N_MODES + BESIDE)
    for nothing in (Weights(-weights.stiffness, weights.mass), Weights(weights.stiffness, -weights.mass)):
        with pytest.raises(np.linalg.LinAlgError):
            modes_nearby(block, nothing, known, N_MODES)
