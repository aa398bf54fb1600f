"""The plate on few vectors: its tolerance at points it has not seen, the error it states, draws, names, the tangent."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
import ritz
from dense_pencils import together
from either_theory import cents
from limits import meets

from bayesplate.plate import reduction
from bayesplate.plate.mesh import mesh
from bayesplate.plate.naming import find_named_modes
from bayesplate.plate.reduction import reduced_order_model
from bayesplate.plate.shear import shear_flexible_plate
from bayesplate.plate.solve import solve_classes
from bayesplate.plate.terms import Weights
from bayesplate.plate.thin import thin_plate

WANTED = {
    "cantilever": (ritz.FINNISH, [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2)]),
    "clamped": (ritz.FIEMME, [(0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2)]),
    "free": (ritz.FREE_SPRUCE, [(1, 1), (2, 0), (2, 1), (0, 2), (1, 2), (3, 0), (3, 1), (2, 2), (3, 2)]),
}
HALF_WIDTHS = np.array([0.3, 0.3, 0.24])
"""Of ln(D_x / D_s), ln(D_y / D_s) and nu_xy: three standard deviations of a six-mode fit of one board."""
CORNERS = [np.array(signs) for signs in product((-1.0, 1.0), repeat=3)]


def weights_at(board, point):
    ratio_x, ratio_y, nu_xy = HALF_WIDTHS * point
    moved = replace(board, D_x=board.D_x * np.exp(ratio_x), D_y=board.D_y * np.exp(ratio_y), nu_xy=board.nu_xy + nu_xy)
    return Weights(moved.unit_weights, np.ones(1))


def somewhere(n, seed):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 3))


@cache
def named(name):
    """A plate, and its modes found by name at the centre; laws and full solves are of the same coarse mesh."""
    board, names = WANTED[name]
    centre = weights_at(board, np.zeros(3))
    plate = thin_plate(*board.ends, *mesh(centre, 12))
    return plate, find_named_modes(plate, centre, names)


@cache
def prepared(name, tolerance=0.1):
    """The law for a box around the centre, to a tolerance in cents: that of a careful laboratory."""
    board, _ = WANTED[name]
    plate, found = named(name)
    centre, *corners = (weights_at(board, point) for point in (np.zeros(3), *CORNERS))
    held_out = [weights_at(board, point) for point in somewhere(6, 5)]
    return reduced_order_model(plate, [one.place for one in found.values()], centre, corners, held_out, tolerance)


@cache
def trial(name, n_draws=16):
    """Weights nobody has seen, and full solves there."""
    plate, found = named(name)
    draws = [weights_at(WANTED[name][0], point) for point in somewhere(n_draws, 99)]
    exact = []
    for weights in draws:
        solved = solve_classes(plate, weights, dict.fromkeys((own.parity for own in plate.classes), 8))
        exact.append([solved[mode.place.parity].eigenvalues[mode.place.rank] for mode in found.values()])
    return together(draws), np.array(exact)


@pytest.mark.parametrize("name", WANTED)
def test_frequencies_hold_where_nothing_was_trained(name):
    """Within half a cent of a law that was asked for a tenth of one; a Ritz value on fewer vectors is never below.

    Sixteen other points may hold a worse one than the few that were held out, but not by more than a factor of 3. The
    modes at the centre are the first vectors of the basis, and a step from a mode leaves it where it is.
    """
    draws, exact = trial(name)
    reduced = prepared(name)
    errors = cents(reduced.eigenvalues(draws), exact)
    worst = np.abs(errors).max()
    centre = together([weights_at(WANTED[name][0], np.zeros(3))])
    at_centre = [[mode.eigenvalue for mode in named(name)[1].values()]]

    meets("V11", f"full solves at 16 points, {name}", worst, at_most=0.5, unit="cents")
    meets("V11", f"over the error that the law states, {name}", worst / reduced.worst_cents, at_most=3.0)
    assert errors.min() > -1e-6
    assert reduced.worst_cents <= 0.1
    assert np.abs(cents(reduced.eigenvalues(centre), at_centre)).max() < 1e-5


def test_a_basis_is_no_larger_than_its_tolerance_asks():
    """Another tolerance is another basis: the widest has fewer vectors than the narrowest, which it misses."""
    tolerances = (1e-4, 0.1, 10.0)
    made = [prepared("cantilever", tolerance) for tolerance in tolerances]
    sizes = [sum(own.stiffness.shape[-1] for own in reduced.classes) for reduced in made]

    assert all(reduced.worst_cents <= tolerance for reduced, tolerance in zip(made, tolerances, strict=True))
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] > sizes[-1]
    assert made[-1].worst_cents > 1e-4


def test_reported_error_is_the_true_one_where_the_basis_is_poor():
    """The negative control: trained at the centre alone, the law misses its tolerance and says by how much."""
    board, _ = WANTED["cantilever"]
    plate, found = named("cantilever")
    places = [one.place for one in found.values()]
    centre, outside = weights_at(board, np.zeros(3)), weights_at(board, np.array([1.0, -1.0, 1.0]))
    solved = solve_classes(plate, outside, dict.fromkeys((own.parity for own in plate.classes), 8))
    exact = [solved[p.parity].eigenvalues[p.rank] for p in places]

    reduced = reduced_order_model(plate, places, centre, [], [outside], 0.5)

    assert reduced.worst_cents > 0.5
    errors = np.abs(cents(reduced.eigenvalues(together([outside])), [exact]))
    assert reduced.worst_cents == pytest.approx(errors.max(), rel=1e-6)


@pytest.mark.parametrize(("tolerance", "n_solved"), [(3.0, 1 + 7 + 6), (1e-7, 1 + 14 + 6)])
def test_further_points_are_solved_where_the_first_ones_will_not_do(tolerance, n_solved, monkeypatch):
    """Of fourteen points around the centre half; held-out ones that join the basis no longer check it."""
    board, _ = WANTED["clamped"]
    plate, found = named("clamped")
    around, held_out = (
        [weights_at(board, at) for at in points] for points in ([*CORNERS, *somewhere(6, 1)], somewhere(6, 2))
    )
    solved, checked = [], []

    def counted(plate, weights, n_modes):
        solved.append(weights)
        return solve_classes(plate, weights, n_modes)

    def watched(own, middle, snapshots, checks, *further):
        checked.append((len(snapshots), len(checks)))
        return _reduced(own, middle, snapshots, checks, *further)

    _reduced = reduction._reduce_class
    monkeypatch.setattr(reduction, "solve_classes", counted)
    monkeypatch.setattr(reduction, "_reduce_class", watched)
    places = [one.place for one in found.values()]
    reduced_order_model(plate, places, weights_at(board, np.zeros(3)), around, held_out, tolerance)

    assert len(solved) == n_solved
    few, many = (7, 6), (14 + 3, 3)
    assert list(dict.fromkeys(checked)) == ([few] if n_solved == 14 else [few, (14, 6), many])


def test_modes_of_draws_are_named_as_those_of_full_solves():
    """The rank of every name that is certain at points around."""
    name = "free"
    board, names = WANTED[name]
    plate, found = named(name)
    points = [weights_at(board, point) for point in somewhere(12, 8)]
    nothing = Weights(-points[0].stiffness, points[0].mass)
    ranks = prepared(name).ranks(together([*points, nothing]))
    assert all(of_draws[-1] == -1 for of_draws in ranks.values())
    n_named = 0
    for i, point in enumerate(points):
        places = {beams: one.place for beams, one in find_named_modes(plate, point, names).items()}
        for beams, place in places.items():
            own = [one.place.rank for one in found.values() if one.place.parity == place.parity]
            if place.is_certain and place.rank <= max(own):
                assert ranks[beams][i] == place.rank
                n_named += 1
    assert n_named > 0.9 * len(points) * len(names)


def test_a_heavier_plate_has_the_same_names_as_surely():
    """Water makes a plate ten times as heavy; a shape fits its name whatever the mass it is normalised in."""
    draws, _ = trial("free")
    reduced = prepared("free")

    ranks, heavier = (reduced.ranks(Weights(draws.stiffness, n * draws.mass), 0.75) for n in (1.0, 10.0))

    assert all(np.array_equal(heavier[beams], own) for beams, own in ranks.items())
    assert sum(int(np.sum(own < 8)) for own in ranks.values()) > 0


@pytest.mark.parametrize("n_draws", [0, 513])
def test_many_draws_are_the_draws_one_by_one(n_draws):
    """However many are held at once."""
    draws, _ = trial("free")
    reduced = prepared("free")
    which = np.arange(n_draws) % 16
    one_by_one = np.stack([reduced.eigenvalues(together([draws.at(i)]))[0] for i in range(16)])

    found = reduced.eigenvalues(Weights(draws.stiffness[which], draws.mass[which]))

    np.testing.assert_allclose(found, one_by_one[which], rtol=1e-11)


def test_energies_of_a_draw_sum_to_its_eigenvalue():
    """The sum rule on few vectors: of each wanted mode, in the caller's order."""
    draws, _ = trial("free")
    reduced = prepared("free")

    for i in range(3):
        one = together([draws.at(i)])
        stiffness, mass = reduced.energies(one)
        np.testing.assert_allclose(stiffness @ one.stiffness[0], reduced.eigenvalues(one)[0], rtol=1e-8)
        np.testing.assert_allclose(mass @ one.mass[0], 1.0, rtol=1e-8)


def test_a_shear_flexible_plate_is_held_within_its_tolerance_too():
    """Over three masses and six stiffnesses, shear moduli over a factor of two; rigid motions of the free one."""
    board = ritz.FREE_SPRUCE
    mass = np.array([1.0, 1e-4, 1e-3])
    plate = shear_flexible_plate(*board.ends, 8, 8)
    rng = np.random.default_rng(11)

    def at(shares):
        return Weights(
            np.array([*board.unit_weights, 2e4, 1e3]) * np.exp([0.3, 0.3, 0.2, 0.0, 0.7, 0.7] * shares), mass
        )

    names = [(1, 1), (2, 0), (0, 2), (2, 1)]
    places = [one.place for one in find_named_modes(plate, at(np.zeros(6)), names).values()]
    around, held_out, unseen = ([at(s) for s in rng.uniform(-1.0, 1.0, (n, 6))] for n in (16, 6, 10))

    reduced = reduced_order_model(plate, places, at(np.zeros(6)), around, held_out, 1.0)

    exact = []
    for weights in unseen:
        solved = solve_classes(plate, weights, dict.fromkeys({p.parity for p in places}, 6))
        exact.append([solved[p.parity].eigenvalues[p.rank] for p in places])
    assert reduced.worst_cents <= 1.0
    assert np.abs(cents(reduced.eigenvalues(together(unseen)), exact)).max() <= 3.0 * reduced.worst_cents


def test_points_that_are_no_plate_teach_nothing_and_check_nothing():
    """An expansion of fields may be negative at a far corner of the box: the others serve, and one of them has to."""
    board, _ = WANTED["cantilever"]
    plate, modes = named("cantilever")
    centre = weights_at(board, np.zeros(3))
    places = [mode.place for mode in modes.values()]
    near, far, checked = (weights_at(board, at * np.ones(3)) for at in (0.5, -0.5, 0.3))
    nothing = Weights(centre.stiffness, -centre.mass)
    without = reduced_order_model(plate, places, centre, [near, far], [checked], 0.1)
    found = reduced_order_model(plate, places, centre, [near, nothing, far], [nothing, checked], 0.1)
    assert found.worst_cents == pytest.approx(without.worst_cents, rel=1e-3)
    draws = together([near, checked])
    np.testing.assert_allclose(found.eigenvalues(draws), without.eigenvalues(draws), rtol=1e-8)
    with pytest.raises(np.linalg.LinAlgError):
        reduced_order_model(plate, places, centre, [near, far], [nothing], 0.1)
