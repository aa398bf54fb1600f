"""Exciter: limits, roving, and a place nobody knows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_plates import MADE, setup_of, shifts, values_of
from generator.known_boards import BEAMS, DRIVEN

import bayesplate
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Reading
from bayesplate.effects.drives import Drive, PlaceRange
from bayesplate.effects.exciter import Exciter
from bayesplate.frequencies.model import full_log_frequencies, setup_model
from bayesplate.frequencies.system import System
from bayesplate.labels import Label

COIL, MASS = 1.6e-3, 48e-3
QUARTER, THIRD = (0.25, 0.25), (1.0 / 3.0, 1.0 / 3.0)


def drive(*places, mass=MASS, coil=COIL, resonance=38.6):
    return Drive(*((Quantity.exact(value), "") for value in (mass, coil, resonance)), True, False, places)


def exciter(one):
    setup = setup_of(DRIVEN)
    return Exciter(MADE, (one,), setup.ends_x, setup.ends_y, (1, 2))


def sizes(one, **more):
    """Values of the parameters of a drive."""
    found = {"coil": one.coil[0].mean, "mass": one.mass[0].mean, "resonance": one.suspension[0].mean} | more
    return {f"exciter.{name}": value for name, value in found.items()}


def cents(one, beams, **more):
    return shifts(DRIVEN, [exciter(one)], sizes(one, **more), beams)


def test_on_a_hard_spring_the_magnet_is_a_mass_of_the_board():
    """At resonances far above the modes the whole moves with the board; at none the coil alone does."""
    hard, none = drive(QUARTER, resonance=3000.0), drive(QUARTER, resonance=0.0)
    whole = drive(QUARTER, mass=MASS, coil=0.999 * MASS, resonance=0.0)
    beams = BEAMS["clamped"][:3]
    # A coil of nearly all the mass on no spring: what is left to the magnet by rule, a twentieth, hangs on nothing.
    assert cents(hard, beams) == pytest.approx(cents(whole, beams), abs=1.0)
    light = cents(none, beams, coil=0.0)
    # The mesh of a plate with an exciter is finer than that of the bare one.
    assert light == pytest.approx([0.0] * 3, abs=0.05)


def test_a_drive_that_roved_is_the_mean_of_the_frequencies():
    places = (QUARTER, THIRD, (0.1, 0.4))
    one = drive(*places)
    readings = tuple(Reading(Label(*b), b, Quantity.exact(100.0)) for b in BEAMS["clamped"])
    setup = replace(setup_of(DRIVEN), readings=readings)

    def hertz(*at):
        effect = replace(exciter(drive(*at)), owner=setup.owner)
        model = setup_model(System(setup, (effect,)), values_of(DRIVEN, sizes(one)))
        return np.exp(full_log_frequencies(model, values_of(DRIVEN, sizes(one)))), model

    roved, model = hertz(*places)
    assert len(model.stations) == 3
    assert roved == pytest.approx(np.mean([hertz(place)[0] for place in places], axis=0), rel=1e-9)
    by_law = np.exp(model.log_frequencies(values_of(DRIVEN, sizes(one)), "linear"))[0]
    assert by_law == pytest.approx(roved, rel=1e-9)  # at the point where the law is made it is exact


def test_a_place_that_nobody_knows_is_a_weight():
    """Within 0.3 cents or a hundredth: what a polynomial of eight and nine nodes misses of a squared deflection."""
    beams, (x, y) = BEAMS["clamped"], (0.31, 0.12)
    found = cents(drive(), beams, place_x=x, place_y=y)
    assert found == pytest.approx(cents(drive((x, y)), beams), rel=0.01, abs=0.3)


def test_shares_are_those_of_lagranges_polynomials():
    spot = PlaceRange(0.0, 0.5, 7)
    at = np.array([0.0, 0.11, 0.25, 0.37, 0.5])
    shares = spot.shares(at)
    assert shares.sum(axis=1) == pytest.approx(1.0)
    for degree in range(7):
        assert shares @ spot.nodes**degree == pytest.approx(at**degree, abs=1e-12)
    assert PlaceRange(0.3, 0.3).shares(at) == pytest.approx(np.ones((5, 1)))
    beyond = spot.shares(np.array([-1e17, 1e17]))  # where a proposal may fall, and the prior is zero
    assert beyond == pytest.approx(spot.shares(np.array([0.0, 0.5])))


def test_the_usual_place_is_the_middle_of_where_it_may_be():
    """Not one standard deviation above it, which is the middle of the board, where a drive does most of all."""
    places = [one for one in exciter(drive()).parameters() if one.key.startswith("place")]
    assert [one.nominal for one in places] == [0.25, 0.25]


def test_an_exciter_whose_place_nobody_knows_is_computed_at_gausss_points_of_where_it_may_be():
    setup = bayesplate.Setup.from_frequencies(
        {(1, 1): 134.0, (2, 0): 241.0, (0, 2): 312.0},
        edges={"x0": "clamped", "x1": "free", "y0": "free", "y1": "free"},
        attached=[bayesplate.AttachedItem("exciter", (), 0.048)],
    )
    board = bayesplate.Board.from_numbers("a", length_x=0.5, length_y=0.2, thickness=3e-3, mass=0.12, setups=setup)
    (found,) = Exciter.at_known_size(board, board.setups[0]).drives
    whole, half = (end * (1.0 + np.array([-1.0, 1.0]) / np.sqrt(3.0)) for end in (0.5, 0.25))

    assert np.array(found.places) == pytest.approx(np.array([[x, y] for x in whole for y in half]))
