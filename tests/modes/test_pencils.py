"""Small pencils: against scipy one by one, what condensation and a step leave out, bounds, homogeneity, no material."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from bayesplate.modes.definite import packed
from bayesplate.modes.pencils import (
    condensed_eigenvalues,
    pencil_eigenvalues,
    pencil_modes,
    stepped_eigenvalues,
    stepped_modes,
)

N_DRAWS, R, N_KEPT, N_WANTED, N_RIGID = 5, 40, 14, 8, 2
EIGENVALUES = np.concatenate([np.zeros(N_RIGID), np.arange(1.0, R - N_RIGID + 1.0) ** 2])
"""At the centre, where stiffness and mass are diagonal."""


def coupled(size, seed, with_mass=True):
    """Pencils at that distance from the centre: relative changes of energy; rigid motions have none."""
    rng = np.random.default_rng(seed)
    scale = np.sqrt(EIGENVALUES)
    changes = [(c + np.swapaxes(c, 1, 2)) / np.sqrt(8 * R) for c in rng.standard_normal((2, N_DRAWS, R, R))]
    stiffness = np.diag(EIGENVALUES) + size * scale[:, None] * changes[0] * scale
    return stiffness, np.eye(R) + size * changes[1] if with_mass else None


def exact(stiffness, mass):
    masses = [None] * N_DRAWS if mass is None else mass
    return np.stack([eigh(k, m, eigvals_only=True) for k, m in zip(stiffness, masses, strict=True)])


def lifted(stiffness, mass):
    """What lifts rigid motions off zero, and the stiffness so lifted, packed."""
    of_mass = np.broadcast_to(np.eye(R), stiffness.shape) if mass is None else mass
    shift = stiffness[:, N_RIGID, N_RIGID, None] / of_mass[:, N_RIGID, N_RIGID, None]
    return shift, packed(stiffness + shift[:, :, None] * of_mass)


def stepped(n_steps):
    def eigenvalues(stiffness, mass, n_kept, _):
        shift, triangles = lifted(stiffness, mass)
        return stepped_eigenvalues(triangles, mass, n_kept, n_steps) - shift

    return eigenvalues


CHEAP = {"condensed": condensed_eigenvalues, "one step": stepped(1), "two steps": stepped(2)}


def errors(size, with_mass=True, seed=0, *, way="condensed"):
    """Relative errors of the wanted eigenvalues."""
    stiffness, mass = coupled(size, seed, with_mass)
    wanted = slice(N_RIGID, N_RIGID + N_WANTED)
    found = CHEAP[way](stiffness, mass, N_KEPT, N_RIGID)[:, wanted]
    return found / exact(stiffness, mass)[:, wanted] - 1.0


def test_all_eigenvalues_are_those_of_scipy():
    pencils = coupled(0.2, 3)
    np.testing.assert_allclose(pencil_eigenvalues(*pencils, 1.0), exact(*pencils), rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("way", CHEAP)
@pytest.mark.parametrize("with_mass", [True, False])
def test_eigenvalues_of_few_vectors_are_exact_at_the_centre_and_never_below(with_mass, way):
    assert np.abs(errors(0.0, with_mass, way=way)).max() < 1e-12
    assert errors(0.2, with_mass, way=way).min() > -1e-10


@pytest.mark.parametrize("with_mass", [True, False])
def test_condensation_errs_by_the_fourth_power_of_the_distance(with_mass):
    """Half as far from the centre, a sixteenth of the error, within a factor of two for what comes next.

    The negative control is to cut the others off, which errs by the square.
    """
    wanted, kept = slice(N_RIGID, N_RIGID + N_WANTED), slice(N_KEPT)

    def shares(size):
        stiffness, mass = coupled(size, 0, with_mass)
        cut = exact(stiffness[:, kept, kept], None if mass is None else mass[:, kept, kept])
        return cut[:, wanted] / exact(stiffness, mass)[:, wanted] - 1.0

    assert 8.0 < errors(0.1, with_mass).max() / errors(0.05, with_mass).max() < 32.0
    assert shares(0.1).max() / shares(0.05).max() < 6.0
    assert errors(0.1, with_mass).max() < 0.1 * shares(0.1).max()


@pytest.mark.parametrize(("way", "n_steps"), [("one step", 1), ("two steps", 2)])
@pytest.mark.parametrize("with_mass", [True, False])
def test_a_step_takes_off_what_the_centre_cuts_by_the_ratio_of_wanted_to_cut_modes(with_mass, way, n_steps):
    """Each mode errs by no more than (omega_i / omega_cut)^4 of what it did on the centre's modes, far from it too.

    One step turns a subspace towards a mode by the ratio of eigenvalues, and what a mode errs by goes with the square;
    a factor of three is for the wanted modes of the draws being others than those at the centre. Without the step the
    ratio is one. A second step takes off as much again, but for the shift by the lowest elastic eigenvalue.
    """
    stiffness, mass = coupled(0.6, 0, with_mass)
    wanted, kept = slice(N_RIGID, N_RIGID + N_WANTED), slice(N_KEPT)
    cut = exact(stiffness[:, kept, kept], None if mass is None else mass[:, kept, kept])[:, wanted]
    true = exact(stiffness, mass)[:, wanted]
    left = (errors(0.6, with_mass, way=way) / (cut / true - 1.0)).max(axis=0)

    shifted = EIGENVALUES + EIGENVALUES[N_RIGID]
    bound = 3.0 * (EIGENVALUES[wanted] / EIGENVALUES[N_KEPT]) ** 2
    bound *= (shifted[wanted] / shifted[N_KEPT]) ** (2 * (n_steps - 1))
    assert np.all(left < bound)
    assert np.all(bound < 1.0)


@pytest.mark.parametrize("with_mass", [True, False])
def test_a_second_step_spoils_nothing_where_stiffnesses_lie_seven_orders_apart(with_mass):
    """Each step makes what a vector has of the lowest mode so much larger: without a remedy all would be that mode."""
    far_apart = np.concatenate([np.logspace(0.0, 7.0, N_KEPT), 1e7 * np.arange(2.0, R - N_KEPT + 2.0) ** 2])
    stiffness, mass = coupled(0.3, 5, with_mass)
    scale = np.sqrt(far_apart / np.maximum(EIGENVALUES, 1.0))
    stiffness = scale[:, None] * (stiffness + np.diag(EIGENVALUES < 1.0)) * scale  # without rigid motions
    true = exact(stiffness, mass)[:, :N_KEPT]
    once, twice = (np.abs(stepped(n)(stiffness, mass, N_KEPT, N_RIGID) / true - 1.0).max(axis=0) for n in (1, 2))

    assert np.all(twice < np.maximum(1.1 * once, 1e-6))
    assert twice[-1] < 0.2 * once[-1]


@pytest.mark.parametrize("n_steps", [1, 2])
@pytest.mark.parametrize("with_mass", [True, False])
def test_stepped_modes_have_the_stepped_eigenvalues(with_mass, n_steps):
    stiffness, mass = coupled(0.2, 1, with_mass)
    n = N_RIGID + N_WANTED
    shift, triangles = lifted(stiffness, mass)
    values, vectors = stepped_modes(triangles, mass, N_KEPT, n_steps, n)
    values = values - shift
    across = np.swapaxes(vectors, 1, 2)

    np.testing.assert_allclose(values, stepped(n_steps)(stiffness, mass, N_KEPT, N_RIGID)[:, :n], atol=1e-9)
    of_mass = vectors if mass is None else mass @ vectors
    np.testing.assert_allclose(across @ of_mass, np.broadcast_to(np.eye(n), (N_DRAWS, n, n)), atol=1e-9)
    np.testing.assert_allclose(np.diagonal(across @ stiffness @ vectors, axis1=1, axis2=2), values, atol=1e-8)


@pytest.mark.parametrize("way", CHEAP)
@pytest.mark.parametrize("with_mass", [True, False])
def test_eigenvalues_of_few_vectors_are_homogeneous_in_the_stiffness(with_mass, way):
    stiffness, mass = coupled(0.2, 1, with_mass)
    once, scaled = (CHEAP[way](factor * stiffness, mass, N_KEPT, N_RIGID)[:, N_RIGID:] for factor in (1.0, 2.7))
    np.testing.assert_allclose(scaled, 2.7 * once)


@pytest.mark.parametrize("way", CHEAP)
@pytest.mark.parametrize("with_mass", [True, False])
def test_no_material_is_no_number_and_the_other_draws_stay(with_mass, way):
    stiffness, mass = coupled(0.1, 2, with_mass)
    expected = CHEAP[way](stiffness, mass, N_KEPT, N_RIGID)
    stiffness[1] *= -1.0
    found = CHEAP[way](stiffness, mass, N_KEPT, N_RIGID)
    assert np.isnan(found[1]).all()
    np.testing.assert_allclose(found[[0, 2, 3, 4]], expected[[0, 2, 3, 4]], rtol=1e-12, atol=1e-9)


def test_modes_of_no_material_are_no_numbers_and_those_of_the_other_draws_stay():
    stiffness, mass = coupled(0.1, 2)
    expected = pencil_modes(stiffness, mass, 1.0, N_WANTED)
    stiffness[1] *= -1.0
    for found, before in zip(pencil_modes(stiffness, mass, 1.0, N_WANTED), expected, strict=True):
        assert np.isnan(found[1]).all()
        np.testing.assert_array_equal(np.delete(found, 1, axis=0), np.delete(before, 1, axis=0))
