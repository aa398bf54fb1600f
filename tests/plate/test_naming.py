"""Names of modes: the labels of known boards, names that cannot be told, names that do not exist."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import ritz
from effect_plates import MADE, modes_of, setup_of
from either_theory import assembled, weights_of
from generator.designs import CANTILEVER
from generator.effects import FluidLoading as GeneratorFluid
from generator.exciter import Exciter as GeneratorExciter
from generator.known_boards import DRIVEN
from generator.naming import correlations, named
from generator.plate import Plate
from generator.plate import solve as generated

from bayesplate.board.quantity import Quantity
from bayesplate.effects.drives import Drive
from bayesplate.effects.exciter import Exciter
from bayesplate.effects.fluid_loading import FluidLoading
from bayesplate.labels import HIGHEST_ORDER
from bayesplate.plate.beams import is_rigid, product_coefficients
from bayesplate.plate.mesh import mesh
from bayesplate.plate.naming import CERTAIN_CORRELATION, beam_parts, find_named_modes, name_modes, product_fits
from bayesplate.plate.solve import solve
from bayesplate.plate.terms import Weights
from bayesplate.plate.thin import thin_plate

# Beam products in the order of the frequencies, (0, 0) the lowest beam function of each side.
ORDER = {
    "cantilever": (ritz.FINNISH, [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2)]),
    "clamped": (ritz.FIEMME, [(0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2)]),
    "free": (ritz.FREE_SPRUCE, [(1, 1), (2, 0), (2, 1), (0, 2), (1, 2), (3, 0), (3, 1), (2, 2), (3, 2)]),
}
BOARDS = pytest.mark.parametrize(("board", "order"), ORDER.values(), ids=ORDER)


def prepared(board, shape=None):
    return assembled(board, shape=shape), weights_of(board)


def hertz(found):
    return {beams: np.sqrt(mode.eigenvalue) / (2.0 * np.pi) for beams, mode in found.items()}


@BOARDS
def test_modes_of_known_boards_have_their_names_in_order_and_the_frequencies_of_ritz(board, order):
    """Ritz names its modes by another rule. 0.02 % is the limit of the production mesh."""
    plate, weights = prepared(board)
    names = name_modes(solve(plate, weights, len(order)))

    assert [beams for beams, _ in names] == order
    assert all(correlation >= CERTAIN_CORRELATION for _, correlation in names)
    assert hertz(find_named_modes(plate, weights, order)) == pytest.approx(ritz.simulate(board, order), rel=2e-4)


def test_every_label_is_found_however_many_modes_lie_below_it():
    """On a supported plate, of Navier's frequencies: cubic elements raise k^4 by (k h)^4 / 720, here below 1 %."""
    weights = Weights(np.array([0.1, 9.0, 0.0, 2.0]), np.ones(1))
    plate = thin_plate(("supported", "supported"), ("supported", "supported"), 18, 18)
    wanted = list(product(range(2, 9), repeat=2))

    found = find_named_modes(plate, weights, wanted)

    for i, j in wanted:
        m, n = i + 1, j + 1
        navier = np.pi**4 * (0.1 * m**4 + 9.0 * n**4 + 2.0 * m**2 * n**2)
        assert navier * (1 - 1e-9) <= found[i, j].eigenvalue <= 1.01 * navier


@pytest.mark.parametrize(("end", "ratio", "cents"), [("clamped", 1.02, 6.0), ("free", 4.0, 12.0)])
def test_the_production_mesh_resolves_the_highest_labels(end, ratio, cents):
    """Against twice as many elements, whose own error is sixteen times smaller: what `HIGHEST_ORDER` promises.

    Not exactly alike both ways: there (9,5) and (5,9) are the sum and the difference of two modes, which resemble both.
    """
    bending = np.array([ratio**-0.5, ratio**0.5])
    weights = Weights(np.array([*bending, 0.3 * bending.min(), 1.6]), np.ones(1))
    shape = mesh(weights)
    wanted = [(HIGHEST_ORDER, 2), (2, HIGHEST_ORDER), (HIGHEST_ORDER, 5), (5, HIGHEST_ORDER)]
    coarse, fine = (
        hertz(find_named_modes(thin_plate((end, end), (end, end), n * shape[0], n * shape[1]), weights, wanted))
        for n in (1, 2)
    )

    errors = [1200 * np.log2(coarse[beams] / fine[beams]) for beams in wanted]

    assert 0 < max(errors) < cents


def test_places_lead_to_the_modes_they_name():
    board, order = ORDER["free"]
    plate, weights = prepared(board)
    modes = solve(plate, weights, 12)
    rows = {where: i for i, where in enumerate(zip(modes.parities, modes.ranks, strict=True))}

    for mode in find_named_modes(plate, weights, order).values():
        i = rows[mode.place.parity, mode.place.rank]
        assert mode.eigenvalue == pytest.approx(modes.eigenvalues[i], rel=1e-9)
        np.testing.assert_allclose(mode.stiffness, modes.coefficients[i], atol=1e-7 * modes.coefficients[i].max())
        np.testing.assert_allclose(mode.mass, modes.mass_coefficients[i], rtol=1e-9)


def test_names_are_marked_as_uncertain_where_two_modes_veer():
    """Raising D_x drives (1,0) of the cantilever through (0,2); between them neither shape is one product or the other.

    The correlations are those of Ritz to 0.002, so they are the plate's own and not the mesh's.
    """
    names = [(1, 0), (0, 2)]
    ranks, certain = [], []
    for factor in (1.0, 1.11, 1.3):
        board = replace(ritz.FINNISH, D_x=factor * ritz.FINNISH.D_x)
        found = find_named_modes(*prepared(board), names)
        expected = dict(ritz.solve(ritz.Ritz(board)).names())
        assert {n: found[n].place.correlation for n in names} == pytest.approx(
            {n: expected[n] for n in names}, abs=0.002
        )
        ranks.append([found[name].place.rank for name in names])
        certain.append([found[name].place.is_certain for name in names])

    assert ranks[0] == [1, 2]
    assert ranks[2] == [2, 1]
    assert certain == [[True, True], [False, False], [True, True]]


@pytest.mark.parametrize("seed", range(2))
def test_no_two_names_share_a_mode(seed):
    """Over the range of woods and side ratios, veerings included."""
    rng = np.random.default_rng(seed)
    ends_x, ends_y = (tuple(str(end) for end in rng.choice(["clamped", "supported", "free"], 2)) for _ in "xy")
    d_x, d_y, side_ratio = np.exp(rng.uniform(np.log([3.0, 0.1, 0.8]), np.log([25.0, 0.8, 2.5])))
    weights = Weights(np.array([d_x / side_ratio**2, d_y * side_ratio**2, 0.4 * d_y, 1.0]), np.ones(1))
    names = [beams for beams in product(range(3), range(3)) if not is_rigid(beams, ends_x, ends_y)]

    found = find_named_modes(thin_plate(ends_x, ends_y, 12, 12), weights, names)

    assert list(found) == names
    places = [(mode.place.parity, mode.place.rank) for mode in found.values()]
    assert len(set(places)) == len(places)


@pytest.mark.parametrize(
    ("board", "known", "beams"),
    [
        (ritz.FREE_SPRUCE, (1, 1), (0, 0)),
        (ritz.FREE_SPRUCE, (1, 1), (0, 1)),
        (ritz.FIEMME, (0, 0), (40, 0)),
        (ritz.FIEMME, (0, 0), (15, 15)),
    ],
    ids=["shift", "turn", "no such product", "beyond the mesh"],
)
def test_a_name_that_no_resolved_mode_has_is_refused(board, known, beams):
    with pytest.raises(KeyError, match=rf"\({beams[0]}, {beams[1]}\)"):
        find_named_modes(*prepared(board, (8, 8)), [known, beams])


def test_beam_products_bound_the_lowest_mode_from_above():
    """Their Rayleigh quotients are the start of every estimate: above the lowest mode, and near it."""
    board, order = ORDER["clamped"]
    plate, weights = prepared(board)
    quotients = np.tensordot(weights.stiffness, product_coefficients(*board.ends), axes=1)
    lowest = find_named_modes(plate, weights, order[:1])[order[0]].eigenvalue

    assert lowest <= quotients[order[0]] < 1.2 * lowest


STRIP = Plate.isotropic(70e9, 0.33, 2700.0, 2e-3, 0.300, 0.100, CANTILEVER)


def test_names_in_water_are_as_sure_as_in_air():
    """The water on this strip weighs up to fifty times what the strip does, and changes its shapes hardly."""
    fluid = FluidLoading(MADE, STRIP.L_x / STRIP.L_y)
    found = name_modes(modes_of(STRIP, [fluid], {"fluid_loading.density": 997.0, "fluid_loading.baffle": 0.0}, 5))
    independent = named(generated(STRIP, [GeneratorFluid(997.0)], 8), CANTILEVER)

    assert {(0, 0), (0, 1), (1, 0)} < {beams for beams, _ in found}
    # The package's water is made of fewer panels, which moves shapes by less than a hundredth.
    assert dict(found) == pytest.approx({beams: independent[beams][1] for beams, _ in found}, abs=0.01)
    assert min(fit for _, fit in found) > 0.9


def test_a_magnet_that_bounces_takes_no_name_from_the_board():
    """Of a heavy drive in the middle of a clamped board the magnet's mode has the better shape of the two."""
    middle = (0.5, 0.5)
    drive = Drive(*((Quantity.exact(value), "") for value in (48e-3, 1.6e-3, 38.6)), True, False, (middle,))
    setup = setup_of(DRIVEN)
    effect = Exciter(MADE, (drive,), setup.ends_x, setup.ends_y, (1, 2))
    sizes = {"exciter.mass": 48e-3, "exciter.coil": 1.6e-3, "exciter.resonance": 38.6}
    modes = modes_of(DRIVEN, [effect], sizes, 2)
    at = ((0.5 * DRIVEN.L_x, 0.5 * DRIVEN.L_y),)
    independent = generated(DRIVEN, [GeneratorExciter.at_resonance(38.6, 48e-3, at)], 8)
    table = correlations(independent, ("clamped",) * 4)[:2, 0]
    (parity,) = set(modes.parities[:2])
    both = modes.by_class[parity].at_ranks([0, 1])
    parts, squares = beam_parts(both.symmetry_class, both.vectors)
    column = both.symmetry_class.plate.elastic_products[parity].index((0, 0))
    own, whole = (
        product_fits(parts[:, [column]], np.diagonal(squares), share) for share in (both.on_plate, np.ones(2))
    )

    # A point force converges slowly on the generator's polynomials.
    assert np.abs(own[:, 0]) == pytest.approx(table, abs=0.01)
    assert np.abs(whole[0, 0]) > np.abs(whole[1, 0]), "by shape alone the magnet's mode would be the board's"
    assert np.abs(own[0, 0]) < np.abs(own[1, 0])
