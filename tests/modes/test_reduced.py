"""The reduced-order model: held-out accuracy, an honest check value, homogeneity, many draws at once, the tangent."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
import ritz
from bars import meets
from scipy.linalg import eigh

from bayesplate.frequencies.laws import ExactLaw, LinearLaw
from bayesplate.modes import reduction
from bayesplate.modes.mesh import mesh
from bayesplate.modes.naming import find
from bayesplate.modes.plate import Parity, Weights
from bayesplate.modes.reduced import WHOLE, ReducedBlock
from bayesplate.modes.reduction import reduced_order_model
from bayesplate.modes.solve import solve_class
from bayesplate.modes.thin import thin_plate

WANTED = {
    "cantilever": (ritz.FINNISH, [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2)]),
    "clamped": (ritz.FIEMME, [(0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2)]),
    "free": (ritz.FREE_SPRUCE, [(1, 1), (2, 0), (2, 1), (0, 2), (1, 2), (3, 0), (3, 1), (2, 2), (3, 2)]),
}
HALF_WIDTHS = np.array([0.3, 0.3, 0.24])
"""Of ln(D_x / D_s), ln(D_y / D_s) and nu_xy: three standard deviations of a six-mode fit of one board."""


def weights_at(board, point):
    ratio_x, ratio_y, nu_xy = HALF_WIDTHS * point
    moved = replace(board, D_x=board.D_x * np.exp(ratio_x), D_y=board.D_y * np.exp(ratio_y), nu_xy=board.nu_xy + nu_xy)
    return Weights(moved.unit_weights, np.ones(1))


def together(weights):
    return Weights(np.stack([w.stiffness for w in weights]), np.stack([w.mass for w in weights]))


def cents(eigenvalues, expected):
    """600 log2: eigenvalues are squares of frequencies."""
    return 600.0 * np.log2(eigenvalues / expected)


@cache
def prepared(name):
    """A plate, its modes found by name at the centre, and the reduced-order model for a box around it."""
    board, names = WANTED[name]
    centre = weights_at(board, np.zeros(3))
    plate = thin_plate(*board.ends, *mesh(centre))
    found = find(plate, centre, names)
    corners = [weights_at(board, np.array(signs)) for signs in product((-1.0, 1.0), repeat=3)]
    held_out = [weights_at(board, p) for p in np.random.default_rng(5).uniform(-1.0, 1.0, (6, 3))]
    places = [found[beams].place for beams in names]
    return plate, found, reduced_order_model(plate, places, centre, corners, held_out)


@cache
def trial(name, n_draws=16):
    """Weights nobody has seen, and full solves there."""
    plate, found, _ = prepared(name)
    points = np.random.default_rng(99).uniform(-1.0, 1.0, (n_draws, 3))
    draws = [weights_at(WANTED[name][0], point) for point in points]
    exact = []
    for weights in draws:
        solved = {b.parity: solve_class(b, weights, 8).eigenvalues for b in plate.blocks}
        exact.append([solved[mode.place.parity][mode.place.rank] for mode in found.values()])
    return together(draws), np.array(exact)


@pytest.mark.parametrize("name", WANTED)
def test_frequencies_hold_within_half_a_cent_where_nothing_was_trained(name):
    draws, exact = trial(name)

    worst = np.abs(cents(prepared(name)[2].eigenvalues(draws), exact)).max()
    meets("V11", f"full solves at 16 points, {name}", worst, at_most=0.5, unit="cents")


@pytest.mark.parametrize("name", WANTED)
def test_reported_error_is_honest(name):
    """Sixteen other points may hold a worse one than the few that were held out, but not by more than a factor of 3."""
    draws, exact = trial(name)
    reduced = prepared(name)[2]

    worst = np.abs(cents(reduced.eigenvalues(draws), exact)).max()

    meets("V11", f"over the error that the law states, {name}", worst / reduced.worst_cents, at_most=3.0)


@pytest.mark.parametrize("n_around", [0, 1])
def test_reported_error_is_the_true_one_where_the_basis_is_poor(n_around, monkeypatch):
    """The negative control: trained at the centre alone, the model fails the bar at a corner and says by how much.

    So it does where what it was trained with lost the modes on the way: plates that judge it are solved by themselves.
    """
    monkeypatch.setattr(reduction, "modes_nearby", lambda block, weights, known, n_modes: known.of(range(n_modes)))
    board, names = WANTED["cantilever"]
    plate, found, _ = prepared("cantilever")
    places = [found[beams].place for beams in names]
    centre, outside = weights_at(board, np.zeros(3)), weights_at(board, np.array([1.0, -1.0, 1.0]))
    exact = [solve_class(plate.block(p.parity), outside, p.rank + 1).eigenvalues[-1] for p in places]

    reduced = reduced_order_model(plate, places, centre, n_around * [outside], [outside])

    assert reduced.worst_cents > 0.5
    errors = np.abs(cents(reduced.eigenvalues(together([outside])), [exact]))
    assert reduced.worst_cents == pytest.approx(errors.max(), rel=1e-6)


def test_a_poor_basis_is_used_in_the_first_way_that_adds_hardly_anything(monkeypatch):
    """Of three ways that are not good enough one adds half a semitone, one a millionth of a frequency, one nothing."""
    board, names = WANTED["cantilever"]
    plate, found, _ = prepared("cantilever")
    centre, outside = weights_at(board, np.zeros(3)), weights_at(board, np.array([1.0, -1.0, 1.0]))

    def three_ways(whole, *_):
        for way, factor in enumerate((2.0 ** (1 / 12), 1.0 + 2e-6, 1.0)):
            yield replace(whole, stiffness=factor * whole.stiffness, shift=way), np.eye(whole.stiffness.shape[-1])

    monkeypatch.setattr(reduction, "_cheapest_first", three_ways)
    reduced = reduced_order_model(plate, [found[beams].place for beams in names], centre, [], [outside])
    assert reduced.worst_cents > reduction.ACCEPTED_CENTS
    taken = [block.shift for block in reduced.blocks]
    assert 1 in taken  # classes whose basis is good enough, or good but for that, take another way
    assert 2 not in taken


@pytest.mark.parametrize("name", WANTED)
def test_model_never_lies_below_the_full_solve(name):
    """A Ritz value on fewer vectors is an upper bound."""
    draws, exact = trial(name)

    assert cents(prepared(name)[2].eigenvalues(draws), exact).min() > -1e-6


@pytest.mark.parametrize("name", WANTED)
def test_model_is_exact_at_the_centre(name):
    _, found, reduced = prepared(name)
    centre = together([weights_at(WANTED[name][0], np.zeros(3))])
    expected = [[mode.eigenvalue for mode in found.values()]]

    # Directions of less than 1e-8 of the basis are dropped, so that even a training point is not met to rounding.
    assert np.abs(cents(reduced.eigenvalues(centre), expected)).max() < 0.01


@pytest.mark.parametrize("name", WANTED)
def test_modes_of_draws_are_named_as_those_of_full_solves(name):
    """The rank of every name that is certain at points around."""
    board, names = WANTED[name]
    plate, found, reduced = prepared(name)
    points = [weights_at(board, p) for p in np.random.default_rng(8).uniform(-1.0, 1.0, (12, 3))]
    nothing = Weights(-points[0].stiffness, points[0].mass)
    ranks = reduced.ranks(together([*points, nothing]))
    assert all(of_draws[-1] == -1 for of_draws in ranks.values())
    n_named = 0
    for i, point in enumerate(points):
        places = {beams: one.place for beams, one in find(plate, point, names).items()}
        for beams, place in places.items():
            own = [one.place.rank for one in found.values() if one.place.parity == place.parity]
            if place.is_certain and place.rank <= max(own):
                assert ranks[beams][i] == place.rank
                n_named += 1
    assert n_named > 0.9 * len(points) * len(names)


@pytest.mark.parametrize("name", WANTED)
def test_a_heavier_plate_has_the_same_names_as_surely(name):
    """Water makes a plate ten times as heavy; a shape fits its name whatever the mass it is normalised in."""
    draws, _ = trial(name)
    reduced = prepared(name)[2]

    ranks, heavier = (reduced.ranks(Weights(draws.stiffness, n * draws.mass), 0.75) for n in (1.0, 10.0))

    assert all(np.array_equal(heavier[beams], own) for beams, own in ranks.items())
    assert sum(int(np.sum(own < 8)) for own in ranks.values()) > 0


@pytest.mark.parametrize("name", WANTED)
def test_eigenvalues_are_homogeneous_of_degree_one_in_the_stiffness(name):
    draws, _ = trial(name)
    reduced = prepared(name)[2]

    scaled = reduced.eigenvalues(Weights(2.7 * draws.stiffness, 1.3 * draws.mass))

    np.testing.assert_allclose(scaled, reduced.eigenvalues(draws) * 2.7 / 1.3, rtol=1e-11)


@pytest.mark.parametrize("name", WANTED)
def test_many_draws_are_the_draws_one_by_one(name):
    draws, _ = trial(name)
    reduced = prepared(name)[2]
    one_by_one = [reduced.eigenvalues(together([draws.at(i)]))[0] for i in range(len(draws.stiffness))]

    np.testing.assert_allclose(reduced.eigenvalues(draws), one_by_one, rtol=1e-12)


@pytest.mark.parametrize("n_draws", [0, 1, 2, 23, 48, 49, 130])
def test_of_a_large_basis_too_however_many_they_are(n_draws):
    """Draws of a basis above `WHOLE` vectors are taken in batches, on all cores."""
    rng = np.random.default_rng(3)
    forms = rng.standard_normal((2, WHOLE + 1, 2 * WHOLE))
    stiffness = forms @ np.swapaxes(forms, 1, 2)
    block = ReducedBlock(Parity(0, 0), stiffness, np.empty((0, WHOLE + 1, WHOLE + 1)), np.zeros((WHOLE + 1, 0)), ())
    weights = rng.uniform(0.5, 2.0, (n_draws, 2))
    found = block.eigenvalues(Weights(weights, np.ones((n_draws, 1))))
    alone = [np.linalg.eigvalsh(np.tensordot(one, stiffness, axes=1)) for one in weights]
    np.testing.assert_allclose(found, np.reshape(alone, (n_draws, WHOLE + 1)), rtol=1e-10)


@pytest.mark.parametrize("n_steps", [1, 2])
@pytest.mark.parametrize("with_masses", [True, False])
@pytest.mark.parametrize("r", [10, 11])
def test_steps_with_all_vectors_kept_find_every_mode_of_each_draw(r, with_masses, n_steps):
    """As scipy does one by one. A rigid motion is in the basis, so that the stiffness alone cannot be factorised."""
    rng = np.random.default_rng(4)
    forms = rng.standard_normal((2, 3, r, 2 * r))
    stiffness, masses = forms @ np.swapaxes(forms, 2, 3)
    stiffness[:, 0], stiffness[:, :, 0] = 0.0, 0.0
    block = ReducedBlock(
        Parity(0, 0),
        stiffness,
        masses if with_masses else np.empty((0, r, r)),
        np.zeros((r, 0)),
        (),
        n_rigid=1,
        n_kept=r,
        n_steps=n_steps,
    )
    weights = Weights(rng.uniform(0.5, 2.0, (4, 3)), rng.uniform(0.5, 2.0, (4, 3 if with_masses else 1)))
    values, vectors = block.modes(weights, r - 1)
    for draw, found in enumerate(block.eigenvalues(weights)):
        one = weights.at(draw)
        whole = np.tensordot(one.stiffness, stiffness, axes=1)
        mass = np.tensordot(one.mass, masses, axes=1) if with_masses else one.mass * np.eye(r)
        expected = eigh(whole, mass, eigvals_only=True)[1:]
        np.testing.assert_allclose(found, expected, rtol=1e-10)
        np.testing.assert_allclose(values[draw], expected, rtol=1e-10)
        np.testing.assert_allclose(vectors[draw].T @ mass @ vectors[draw], np.eye(r - 1), atol=1e-10)
        np.testing.assert_allclose(whole @ vectors[draw], mass @ vectors[draw] * expected, atol=1e-8 * expected[-1])


@pytest.mark.parametrize("name", WANTED)
@pytest.mark.parametrize("term", range(4))
def test_linear_law_is_the_tangent_of_the_exact_law(name, term):
    """By a central difference of the exact law at the centre."""
    board, names = WANTED[name]
    _, found, reduced = prepared(name)
    linear = LinearLaw(np.stack([found[n].stiffness for n in names]), np.stack([found[n].mass for n in names]))
    centre = weights_at(board, np.zeros(3))

    def slope(law, step=1e-3):
        moved = [centre.stiffness * (1.0 + sign * step * np.eye(4)[term]) for sign in (1.0, -1.0)]
        above, below = law.squared(Weights(np.stack(moved), np.ones((2, 1))))
        return (above - below) / (2.0 * step)

    # As shares of the mode's energy; the tolerance is the directions that the basis drops and the step's square.
    eigenvalues = np.array([found[n].eigenvalue for n in names])
    np.testing.assert_allclose(slope(ExactLaw(reduced)) / eigenvalues, slope(linear) / eigenvalues, atol=2e-5)


def test_points_that_are_no_plate_teach_nothing_and_check_nothing():
    """An expansion of fields may be negative at a far corner of the box: the others serve, and one of them has to."""
    board, names = WANTED["cantilever"]
    centre = weights_at(board, np.zeros(3))
    plate = thin_plate(*board.ends, *mesh(centre))
    places = [mode.place for mode in find(plate, centre, names).values()]
    near, far, checked = (weights_at(board, at * np.ones(3)) for at in (0.5, -0.5, 0.3))
    nothing = Weights(centre.stiffness, -centre.mass)
    without = reduced_order_model(plate, places, centre, [near, far], [checked])
    found = reduced_order_model(plate, places, centre, [near, nothing, far], [nothing, checked])
    assert found.worst_cents == pytest.approx(without.worst_cents, rel=1e-3)
    draws = together([near, checked])
    np.testing.assert_allclose(found.eigenvalues(draws), without.eigenvalues(draws), rtol=1e-8)
    with pytest.raises(np.linalg.LinAlgError):
        reduced_order_model(plate, places, centre, [near, far], [nothing])
