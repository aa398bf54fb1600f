"""The paper's training of twenty-five plates: its coefficients, its R^2, and what its figure of MAC matrices shows."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from paper_rows import COEFFICIENTS, SETUPS, beams_of, paper_coefficients

from bayesplate.errors import NotIdentifiableError
from bayesplate.plate import training
from bayesplate.plate.naming import find_named_modes
from bayesplate.plate.thin import thin_plate
from bayesplate.plate.training import REFERENCE_FACTORS, TrainingConstants, train, training_weights

CANTILEVER = (SETUPS["cantilever"].ends_x, SETUPS["cantilever"].ends_y, 223 / 114, 3 / 223)
CLAMPED = (SETUPS["clamped"].ends_x, SETUPS["clamped"].ends_y, 150 / 103, 3 / 600)
CONSTANTS = TrainingConstants(E_x=10.7e9, E_y=0.716e9, G_xy=0.50e9, nu_xy=0.51, G_xz=0.62e9, G_yz=0.023e9)
MIDDLE = np.array([5.44, 0.364, 1.0])  # p, q, 1 of the plate in the middle of the set

CANTILEVER_TABLE, CLAMPED_TABLE = COEFFICIENTS["cantilever"], COEFFICIENTS["clamped"]
VEERING = {(2, 0), (1, 2)}


beams = partial(beams_of, "cantilever")


def plane(mode):
    return np.array([mode.a, mode.b, mode.c])


def found_in_the_middle(board, products):
    """a, b, c by the energy shares of one solve of the plate in the middle of the set."""
    ends_x, ends_y, aspect_ratio, _ = board
    found = find_named_modes(
        thin_plate(ends_x, ends_y, 16, 16), training_weights(*board[2:], CONSTANTS, "thin"), products
    )
    stiffness = np.stack([found[product].stiffness for product in products])
    return paper_coefficients(stiffness, aspect_ratio, CONSTANTS.nu_xy)


def plate_of(training, factors):
    return next(plate for plate in training.plates if plate.factors == factors)


@pytest.fixture(scope="module")
def cantilever():
    return train(*CANTILEVER, CONSTANTS, "shear-flexible", [beams(label) for label in CANTILEVER_TABLE])


@pytest.fixture(scope="module")
def thin_cantilever():
    return train(*CANTILEVER, CONSTANTS, "thin", [beams(label) for label in CANTILEVER_TABLE])


@pytest.fixture(scope="module")
def clamped():
    return train(*CLAMPED, CONSTANTS, "thin", list(CLAMPED_TABLE))


def assert_printed(mode, printed):
    """a and c to 1 % or a unit of the last digit, b to what 0.2 % of omega_bar^2 allows: it is the smallest share."""
    assert (mode.a, mode.c) == pytest.approx((printed[0], printed[2]), rel=0.01, abs=0.005)
    assert abs(mode.b - printed[1]) * MIDDLE[1] < 0.002 * plane(mode) @ MIDDLE


def test_cantilever_coefficients_are_the_printed_ones(cantilever):
    for label in CANTILEVER_TABLE.keys() - VEERING:
        mode = cantilever.modes[beams(label)]
        assert_printed(mode, CANTILEVER_TABLE[label])
        assert mode.n_plates == 25


def test_veering_modes_lie_on_the_printed_planes(cantilever):
    """Their coefficients depend on which plates are discarded; their planes agree to 0.6 % wherever recognised."""
    for label in VEERING:
        mode = cantilever.modes[beams(label)]
        points = np.array([[p.p, p.q, 1.0] for p in cantilever.plates if beams(label) in p.matches])

        assert 3 <= mode.n_plates == len(points) < 25
        np.testing.assert_allclose(points @ plane(mode), points @ CANTILEVER_TABLE[label], rtol=0.006)


def test_thin_plates_do_not_give_the_cantilever_table(thin_cantilever):
    """The printed cantilever has transverse shear in it: without, (2,2) is 7 % stiffer along and 14 % across."""
    mode = thin_cantilever.modes[beams((2, 2))]

    with pytest.raises(AssertionError):
        assert_printed(mode, CANTILEVER_TABLE[2, 2])
    assert mode.a / CANTILEVER_TABLE[2, 2][0] == pytest.approx(1.07, abs=0.01)
    assert mode.b / CANTILEVER_TABLE[2, 2][1] == pytest.approx(1.14, abs=0.01)


def test_clamped_coefficients_are_the_printed_ones_and_the_energy_shares_of_one_solve(clamped):
    """Clamped modes hardly change their shapes, so that chord and tangent agree to 0.15 %."""
    found = found_in_the_middle(CLAMPED, CLAMPED_TABLE)
    for label, share in zip(CLAMPED_TABLE, found, strict=True):
        mode, (a, b, c) = clamped.modes[label], CLAMPED_TABLE[label]
        assert (mode.a, mode.b) == pytest.approx((a, b), rel=0.01), label
        assert mode.c == pytest.approx(c, rel=0.035), label
        np.testing.assert_allclose(plane(mode), share, rtol=1.5e-3)


def test_non_negativity_hides_a_negative_share(thin_cantilever):
    """More E_y lowers the lowest mode of a cantilever, by way of nu_yx: b = -0.34. The fit can only answer zero."""
    (share,) = found_in_the_middle(CANTILEVER, [(0, 0)])

    assert share[1] == pytest.approx(-0.34, abs=0.05)
    assert thin_cantilever.modes[0, 0].b == 0.0


def test_planes_explain_the_frequencies(cantilever, clamped):
    for modes in (cantilever.modes.values(), clamped.modes.values()):
        assert all(0.999 <= mode.r_squared <= 1.0 for mode in modes)
        assert len({mode.r_squared for mode in modes}) == 6


def test_plates_cover_the_printed_ranges(cantilever):
    """4.3 < p < 6.6 and 0.28 < q < 0.45."""
    p, q = (np.array([getattr(plate, name) for plate in cantilever.plates]) for name in "pq")

    assert len({plate.factors for plate in cantilever.plates}) == 25
    assert 4.3 < p.min() < p.max() < 6.6
    assert 0.28 < q.min() < q.max() < 0.45
    reference = plate_of(cantilever, REFERENCE_FACTORS)
    assert (reference.p, reference.q) == pytest.approx((4.36, 0.29), abs=0.005)
    np.testing.assert_allclose(reference.mac[:, :6], np.eye(6), atol=1e-3)  # it recognises itself


def test_modes_cross_where_the_figure_says(cantilever):
    """At p = 4.36, q = 0.40 mode (2,1) has come below (1,2); the paper keeps nu_yx fixed, so its p is 0.03 lower."""
    reference, crossed = plate_of(cantilever, REFERENCE_FACTORS), plate_of(cantilever, (0.8, 1.1))

    assert (crossed.p, crossed.q) == pytest.approx((4.36, 0.40), abs=0.03)
    assert (reference.matches[beams((1, 2))], reference.matches[beams((2, 1))]) == (3, 4)
    assert (crossed.matches[beams((1, 2))], crossed.matches[beams((2, 1))]) == (4, 3)


def test_modes_are_ambiguous_where_the_figure_says(cantilever):
    """At p = 6.53, q = 0.29 (2,0) and (1,2) are mixtures of their references; the others are what they were."""
    plate = plate_of(cantilever, (1.2, 0.8))
    rows = [list(CANTILEVER_TABLE).index(label) for label in VEERING]

    assert (plate.p, plate.q) == pytest.approx((6.53, 0.29), abs=0.04)
    assert set(plate.matches) == {beams(label) for label in CANTILEVER_TABLE if label not in VEERING}
    assert np.all((plate.mac[np.ix_(rows, [2, 3])] > 0.2) & (plate.mac[np.ix_(rows, [2, 3])] < 0.8))


def test_a_mode_no_plate_shows_is_refused(monkeypatch):
    monkeypatch.setattr(training, "LOWEST_MAC", 1.01)

    with pytest.raises(NotIdentifiableError, match=r"\(0, 0\): recognised in 0 of 25 training plates"):
        train(*CLAMPED, CONSTANTS, "thin", [(0, 0)])


def test_shear_needs_its_moduli():
    without = TrainingConstants(E_x=10.7e9, E_y=0.716e9, G_xy=0.50e9, nu_xy=0.51)

    with pytest.raises(ValueError, match="needs G_xz and G_yz"):
        training_weights(223 / 114, 3 / 223, without, "shear-flexible")
