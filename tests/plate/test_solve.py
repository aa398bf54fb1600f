"""Modes of a plate by class: all of them, their shapes, energies and symmetries, and what rounding may do to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from dense_pencils import dense, spectrum, whole
from either_theory import G_SPRUCE, SQUARE, SUPPORTS, assembled, solved, weights_of
from limits import meets
from scipy.linalg import eig, eigh

from bayesplate.plate.line import line
from bayesplate.plate.naming import name_modes
from bayesplate.plate.plate import plate_of
from bayesplate.plate.shear import SHEAR_FLEXIBLE, shear_flexible_plate
from bayesplate.plate.solve import solve, solve_classes, solve_up_to
from bayesplate.plate.terms import PointMotion, PointTerm, ProjectedTerms, Weights
from bayesplate.plate.thin import THIN, thin_plate

THEORIES = pytest.mark.parametrize("shear_moduli", [None, G_SPRUCE], ids=["thin", "shear-flexible"])


@THEORIES
def test_energies_are_the_derivatives_of_the_eigenvalues_and_sum_to_them(shear_moduli):
    """Hellmann-Feynman: a share of energy is what the eigenvalue gains from its term, shear and inertia included.

    Of a central difference the rest is of second order in the step, which is small beside the gaps.
    """
    weights, plate = weights_of(ritz.FINNISH, shear_moduli), assembled(ritz.FINNISH, shear_moduli, (12, 12))
    modes = solve(plate, weights, 4)
    step = 1e-3

    def slopes(side):
        own = weights[side]
        for i in range(own.size):
            moved = (own * (1.0 + sign * step * (np.arange(own.size) == i)) for sign in (1.0, -1.0))
            above, below = (
                solve(plate, Weights(*(one if k == side else weights[k] for k in (0, 1))), 4).eigenvalues
                for one in moved
            )
            yield (above - below) / (2.0 * step * modes.eigenvalues)

    shares = modes.coefficients * weights.stiffness / modes.eigenvalues[:, None]
    np.testing.assert_allclose(np.stack(list(slopes(0)), axis=1), shares, atol=1e-5)
    np.testing.assert_allclose(np.stack(list(slopes(1)), axis=1), -modes.mass_coefficients * weights.mass, atol=1e-5)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, rtol=1e-8)
    np.testing.assert_allclose(modes.mass_coefficients @ weights.mass, 1.0, rtol=1e-8)


@pytest.mark.parametrize(("support", "shape"), [("free", (20, 4)), ("cantilever", (8, 8)), ("mixed", (20, 4))])
def test_sparse_solver_finds_the_lowest_modes_of_all_classes(support, shape):
    """Against a dense solver on the whole plate; a long board has nearly all its low modes in two classes."""
    board = replace(SQUARE, edges=SUPPORTS[support], L_x=1.0 if shape[0] == shape[1] else 8.0)
    weights, plate = weights_of(board), thin_plate(*board.ends, *shape)
    dense = {own.parity: spectrum(own, weights)[own.n_rigid :] for own in plate.classes}
    expected = np.sort(np.concatenate(list(dense.values())))[:14]

    modes = solve(plate, weights, 14)

    np.testing.assert_allclose(modes.eigenvalues, expected, rtol=1e-8)
    for parity, rank, eigenvalue in zip(modes.parities, modes.ranks, modes.eigenvalues, strict=True):
        assert dense[parity][rank] == pytest.approx(eigenvalue, rel=1e-8)


@THEORIES
def test_exchanging_the_axes_changes_nothing(shear_moduli):
    """A thin plate to 1e-10; stiff shear costs digits of all eigenvalues. Energies as shares of the whole."""
    board = replace(ritz.FINNISH, edges=SUPPORTS["mixed"])
    turned = None if shear_moduli is None else shear_moduli[::-1]
    modes, other = solved(board, 10, shear_moduli, (10, 8)), solved(board.swapped, 10, turned, (8, 10))
    weights, exchanged = weights_of(board, shear_moduli), weights_of(board.swapped, turned)
    tolerance, of_shares = (1e-10, 1e-10) if shear_moduli is None else (1e-7, 1e-6)

    off = np.abs(other.eigenvalues / modes.eigenvalues - 1.0).max()
    if shear_moduli is None:
        meets("V13", "axes exchanged, eigenvalues", off, at_most=1e-10)
    assert off < tolerance
    stiffness = (modes.coefficients * weights.stiffness).T / modes.eigenvalues
    mass = (modes.mass_coefficients * weights.mass).T
    order = [1, 0, 2, 3, 5, 4][: len(stiffness)], [0, 2, 1][: len(mass)]
    found = (other.coefficients * exchanged.stiffness).T / other.eigenvalues
    np.testing.assert_allclose(found, stiffness[order[0]], atol=of_shares)
    np.testing.assert_allclose((other.mass_coefficients * exchanged.mass).T, mass[order[1]], atol=of_shares)
    assert [(p.y, p.x) for p in other.parities] == list(modes.parities)


def test_eigenvalues_scale_with_stiffness_and_against_mass():
    board = ritz.FINNISH
    weights, plate = weights_of(board), thin_plate(*board.ends, 8, 8)
    scaled = Weights(weights.stiffness * 3.7, weights.mass * 1.9)

    expected = solve(plate, weights, 10).eigenvalues * 3.7 / 1.9

    off = np.abs(solve(plate, scaled, 10).eigenvalues / expected - 1.0).max()
    meets("V13", "stiffness and mass scaled, eigenvalues", off, at_most=1e-10)


@pytest.mark.parametrize("board", [ritz.FINNISH, ritz.FREE_SPRUCE], ids=["cantilever", "free"])
def test_shapes_are_those_of_ritz(board):
    x, y = np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 7)
    expected = ritz.solve(ritz.Ritz(board))

    shapes = solved(board, 6).displacement(x, y)

    for mode, shape in enumerate(shapes):
        other = expected.shape(mode)(x * board.L_x, y * board.L_y)
        correlation = np.sum(shape * other) / np.linalg.norm(shape) / np.linalg.norm(other)
        # One minus the correlation is half the squared error of the shape: 1e-8 is a shape right to 0.015 %.
        assert abs(correlation) > 1 - 1e-8
        # Mass-normalised on the unit square here, on the board there.
        assert np.linalg.norm(shape) == pytest.approx(np.linalg.norm(other) * np.sqrt(board.L_x * board.L_y), rel=2e-4)


@pytest.mark.parametrize("highest", [1e2, 4e4])
def test_all_modes_up_to_an_eigenvalue_are_found(highest):
    """As many as a dense solver counts, however few of them a class is solved for at first; and at least as asked."""
    plate, weights = thin_plate(*SQUARE.ends, 10, 10), weights_of(SQUARE)
    dense = np.sort(np.concatenate([spectrum(own, weights)[own.n_rigid :] for own in plate.classes]))
    expected = dense[: max(3, np.sum(dense <= highest))]

    found = solve_up_to(plate, weights, highest, n_least=3)

    # A square plate has pairs of one frequency: of the third and its like rounding decides which is the higher.
    np.testing.assert_allclose(found.eigenvalues, expected, rtol=1e-7)


def test_of_modes_finer_than_the_mesh_no_more_are_found_than_have_names():
    plate = thin_plate(*SQUARE.ends, 10, 10)

    found = solve_up_to(plate, weights_of(SQUARE), 1e14)

    in_class = {parity: found.rows(parity) for parity in plate.parities}
    assert all(len(rows) <= len(plate.elastic_products[parity]) for parity, rows in in_class.items())
    assert any(len(rows) == len(plate.elastic_products[parity]) for parity, rows in in_class.items())
    assert len(name_modes(found)) == len(found.eigenvalues)


def mean_products(deflections):
    """A mass term of the mean deflections, as a support that moves with the board has."""
    means = deflections.integrals(None)
    return np.outer(means, means)


def stiffer_middle(deflections):
    """A stiffness term of deflections beside one another, as the air of a closed box has."""
    at = np.array([0.2, 0.4, 0.6, 0.8])
    moved = deflections.on(at, at).mean(axis=(1, 2))
    return np.outer(moved, moved)


def test_terms_that_exist_on_deflections_are_on_the_span_of_the_plates_own_modes():
    """Against a dense solver with these terms on all unknowns: modes that the solver took without them lose little."""
    board = ritz.FREE_SPRUCE
    plate = thin_plate(*board.ends, 6, 6).with_terms([ProjectedTerms(stiffer_middle)], [ProjectedTerms(mean_products)])
    bare = weights_of(board)
    weights = Weights(np.array([*bare.stiffness, 0.2 * bare.stiffness[0]]), np.array([*bare.mass, 0.3]))
    dense = {own.parity: eigh(*whole(own, weights), eigvals_only=True)[own.n_rigid :] for own in plate.classes}

    for parity, modes in solve_classes(plate, weights, dict.fromkeys(dense, 4)).items():
        off = modes.eigenvalues / dense[parity][:4] - 1.0
        # Eight spare modes: a Ritz value on them lies above, by less than a tenth of a cent.
        assert off.min() > -1e-8
        assert off.max() < 1e-4
        stiffness, mass = modes.coefficients()
        np.testing.assert_allclose(stiffness @ weights.stiffness, modes.eigenvalues, rtol=1e-8)
        np.testing.assert_allclose(mass @ weights.mass, 1.0, rtol=1e-8)


@pytest.mark.parametrize("assemble", [thin_plate, shear_flexible_plate], ids=["thin", "shear-flexible"])
def test_weights_of_no_plate_are_told(assemble):
    """Not a mode below zero, nor one of a mass that is none."""
    plate = assemble(("clamped", "free"), ("free", "free"), 6, 6)
    n_terms, n_masses = len(plate.stiffness), len(plate.masses)
    nothing = Weights(np.ones(n_terms), -np.ones(n_masses))

    with pytest.raises(np.linalg.LinAlgError):
        solve_classes(plate, nothing, {plate.classes[0].parity: 3})


@pytest.mark.parametrize("projected", [(), (ProjectedTerms(mean_products),)], ids=["board alone", "projected mass"])
def test_free_plate_answers_for_its_rounding_alone(projected):
    """Rigid motions make the factorised matrix nearly singular; no eigenvalue may carry that.

    Weights of the points moved by one unit in the last place move an eigenvalue by that times the largest energy of a
    point against its own, here some 1e8. The control: values taken as the solver gives them at a shift a thousandth of
    this one move by 5e-3.
    """
    side = line(("free", "free"), 8, is_sheared=True, is_split=False)
    plate = plate_of(SHEAR_FLEXIBLE, side, side).with_terms([], projected)
    mass = np.array([1.0, 1e-4, 1e-4, *(0.3 for _ in projected)])
    weights = Weights(np.array([1.0, 0.1, 0.05, 0.3, 4e3, 2e2]), mass)
    modes = solve(plate, weights, 6)
    rng = np.random.default_rng(0)
    moved = replace(
        plate,
        stiffness=tuple(
            (term, grid * (1.0 + np.finfo(float).eps * rng.choice([-1.0, 1.0], grid.shape)))
            for term, grid in plate.stiffness
        ),
    )

    np.testing.assert_allclose(solve(moved, weights, 6).eigenvalues, modes.eigenvalues, rtol=1e-7)
    quotients = (modes.coefficients @ weights.stiffness) / (modes.mass_coefficients @ weights.mass)
    np.testing.assert_allclose(quotients, modes.eigenvalues, rtol=1e-7)


def test_a_mass_below_zero_at_a_place_takes_no_mode_with_it():
    """As where a place is read between others: 2 and -1 % of the board. Against all eigenvalues of the whole pencil.

    What is left out for the solver comes back on the span of its vectors: an error below half of that mass.
    """
    x, y = (line(("clamped", "clamped"), n, is_split=False) for n in (10, 8))
    here, there = (PointMotion(((1.0, at, 0.37),)) for at in (0.31, 0.44))
    places = [PointTerm(((1.0, one, one),)) for one in (here, there)]
    plate = plate_of(THIN, x, y).with_terms([], places)
    weights = Weights(np.array([3e4, 1e4, 3e3, 1e4]), np.array([1.0, 0.02, -0.01]))
    (own,) = plate.classes
    stiffness, mass = dense(own, weights)
    every = eig(stiffness, mass, right=False)
    elastic = np.sort(every[np.isfinite(every) & (every.real > 0.0)].real)
    assert np.linalg.eigvalsh(mass)[0] < 0.0

    found = solve_classes(plate, weights, {own.parity: 12})[own.parity].eigenvalues
    assert found == pytest.approx(elastic[:12], rel=0.005)
