"""Small pencils: against scipy one by one; what a step from few vectors leaves out, bounds, homogeneity, no plate."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from bayesplate.plate.pencils import pencil_modes, pencil_values
from bayesplate.plate.reduced import ReducedClass
from bayesplate.plate.terms import Parity, Weights

N_DRAWS, R, N_KEPT, N_WANTED, N_RIGID = 5, 40, 14, 8, 2
EIGENVALUES = np.concatenate([np.zeros(N_RIGID), np.arange(1.0, R - N_RIGID + 1.0) ** 2])
"""At the centre, where stiffness and mass are diagonal."""
WANTED = slice(N_RIGID, N_RIGID + N_WANTED)


def coupled(size, seed=0):
    """Pencils at that distance from the centre: relative changes of energy; rigid motions have none."""
    rng = np.random.default_rng(seed)
    scale = np.sqrt(EIGENVALUES)
    changes = [(c + np.swapaxes(c, 1, 2)) / np.sqrt(8 * R) for c in rng.standard_normal((2, N_DRAWS, R, R))]
    return np.diag(EIGENVALUES) + size * scale[:, None] * changes[0] * scale, np.eye(R) + size * changes[1]


def exact(stiffness, mass):
    return np.stack([eigh(k, m, eigvals_only=True) for k, m in zip(stiffness, mass, strict=True)])


def a_class(stiffness, mass, n_kept):
    """A class of which each draw is one term of stiffness and one of mass, and the weights that tell them apart."""
    n, r, _ = stiffness.shape
    nothing = np.zeros((r, 0))
    own = ReducedClass(
        Parity(0, 0), stiffness, mass, n_kept, (), nothing, np.zeros((r, r)), np.zeros((n, r, r)), N_RIGID
    )
    return own, Weights(np.eye(n), np.eye(n))


def stepped(stiffness, mass, n_kept=N_KEPT):
    """Elastic eigenvalues on few vectors."""
    own, weights = a_class(stiffness, mass, n_kept)
    return own.eigenvalues(weights)


def errors(size):
    """Relative errors of the wanted eigenvalues."""
    return stepped(*coupled(size))[:, :N_WANTED] / exact(*coupled(size))[:, WANTED] - 1.0


def test_all_eigenvalues_and_vectors_are_those_of_scipy():
    stiffness, mass = coupled(0.2, 3)
    values, vectors = pencil_modes(stiffness, mass)

    for found in (values, pencil_values(stiffness, mass)):
        np.testing.assert_allclose(found, exact(stiffness, mass), rtol=1e-10, atol=1e-9)
    across = np.swapaxes(vectors, 1, 2)
    np.testing.assert_allclose(across @ mass @ vectors, np.broadcast_to(np.eye(R), mass.shape), atol=1e-12)
    np.testing.assert_allclose(stiffness @ vectors, mass @ vectors * values[:, None], atol=1e-8)


@pytest.mark.parametrize("function", [pencil_values, lambda *pencil: pencil_modes(*pencil)[0]])
def test_no_positive_mass_is_no_number_and_the_other_draws_stay(function):
    stiffness, mass = coupled(0.1, 2)
    expected = function(stiffness, mass)
    mass[1] *= -1.0
    mass[3, 0, 0] = 0.0

    found = function(stiffness, mass)

    assert np.isnan(found[[1, 3]]).all()
    np.testing.assert_allclose(found[[0, 2, 4]], expected[[0, 2, 4]], rtol=1e-12, atol=1e-12)


def test_a_mass_that_is_singular_but_for_rounding_is_no_number():
    """Of its least eigenvalue rounding decides whether it is positive, and otherwise whether there is a factor."""
    rng = np.random.default_rng(0)
    turned = np.linalg.qr(rng.standard_normal((2000, 6, 6)))[0]
    mass = (turned * np.r_[1e-16, np.ones(5)]) @ np.swapaxes(turned, 1, 2)
    mass[0] = np.eye(6)

    found = pencil_values(np.broadcast_to(np.eye(6), mass.shape), mass)

    np.testing.assert_allclose(found[0], 1.0)
    assert np.isnan(found[1:]).all()


@pytest.mark.parametrize("n_kept", [N_KEPT, R])
@pytest.mark.parametrize("spoilt", [0, 1], ids=["stiffness", "mass"])
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_weights_of_no_plate_give_no_numbers_and_the_other_draws_stay(n_kept, spoilt, value):
    """A sampler or a search may ask for any plate; LAPACK refuses all matrices for one of them."""
    own, weights = a_class(*coupled(0.1, 2), n_kept)
    expected = own.eigenvalues(weights), *own.modes(weights, N_WANTED)
    weights[spoilt][1, 1] = value

    with np.errstate(invalid="ignore"):
        every = own.eigenvalues(weights), *own.modes(weights, N_WANTED)

    for found, before in zip(every, expected, strict=True):
        assert np.isnan(found[1]).all()
        np.testing.assert_allclose(found[[0, 2, 3, 4]], before[[0, 2, 3, 4]], rtol=1e-9, atol=1e-9)


def test_eigenvalues_are_exact_on_all_vectors_or_where_nothing_couples_and_on_few_never_below():
    stiffness, mass = coupled(0.6)

    np.testing.assert_allclose(stepped(stiffness, mass, R), exact(stiffness, mass)[:, N_RIGID:], rtol=1e-9)
    np.testing.assert_allclose(errors(0.0), 0.0, atol=1e-12)
    assert errors(0.6).min() > -1e-10


def test_a_step_takes_off_what_the_centre_cuts_by_the_ratio_of_wanted_to_cut_modes():
    """Each mode errs by no more than (omega_i / omega_cut)^4 of what it did on the centre's modes, far from it too.

    A step turns a subspace towards a mode by the ratio of eigenvalues, and what a mode errs by goes with the square; a
    factor of three is for the wanted modes of the draws being others than those at the centre. Without the step the
    ratio is one.
    """
    stiffness, mass = coupled(0.6)
    kept = slice(N_KEPT)
    cut = exact(stiffness[:, kept, kept], mass[:, kept, kept])[:, WANTED] / exact(stiffness, mass)[:, WANTED] - 1.0
    shifted = EIGENVALUES + EIGENVALUES[N_RIGID]
    bound = 3.0 * (shifted[WANTED] / shifted[N_KEPT]) ** 2

    assert np.all((errors(0.6) / cut).max(axis=0) < bound)
    assert np.all(bound < 1.0)


def test_modes_have_the_eigenvalues_and_are_normalised_in_the_mass_of_each_draw():
    stiffness, mass = coupled(0.2, 1)
    own, weights = a_class(stiffness, mass, N_KEPT)

    values, vectors = own.modes(weights, N_WANTED)

    np.testing.assert_allclose(values, own.eigenvalues(weights)[:, :N_WANTED], rtol=1e-9)
    across = np.swapaxes(vectors, 1, 2)
    unit = np.broadcast_to(np.eye(N_WANTED), (N_DRAWS, N_WANTED, N_WANTED))
    np.testing.assert_allclose(across @ mass @ vectors, unit, atol=1e-9)
    np.testing.assert_allclose(across @ stiffness @ vectors, unit * values[:, None], atol=1e-8)


def test_eigenvalues_are_homogeneous_in_the_stiffness_and_against_the_mass():
    stiffness, mass = coupled(0.2, 1)
    np.testing.assert_allclose(stepped(2.7 * stiffness, 1.3 * mass), 2.7 / 1.3 * stepped(stiffness, mass), rtol=1e-9)
