"""The air that nobody declares: boards that rang in the generator's air, fitted without it."""

from __future__ import annotations

from dataclasses import replace

import made_boards
import numpy as np
import pytest
from effect_plates import setup_of
from generator.effects import FluidLoading
from generator.known_boards import BEAMS, DRIVEN, HALF_TOP, STEEL
from generator.naming import frequencies

from bayesplate.board.attached import DeclaredFluid
from bayesplate.board.material import moduli
from bayesplate.effects import declare
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.estimates.undeclared_air import SMALLEST_RISE, air_sentence, rise_with_air

PLATES = {"clamped": DRIVEN, "half-top": HALF_TOP}


def in_air(plate, beams, density=1.2, isotropic=False):
    """A board read in the open air, and its estimate without any."""
    hertz = frequencies(plate, [FluidLoading(density, 0.0)], beams)[0]
    setup = made_boards.setup_of(plate.edges, hertz, name=setup_of(plate).name)
    board = replace(made_boards.board_of(plate, [setup]), isotropic=isotropic)
    return board, weighted_least_squares(board)


def constants(estimate):
    return np.stack(moduli(*estimate.rigidities, estimate.values["thickness"], estimate.values["poisson_xy"]))


@pytest.mark.parametrize("name", PLATES)
def test_the_rise_takes_a_board_to_its_true_constants(name):
    """To a hundredth: the refit is linear, and a rise of 15 % has a second order of 0.15^2 / 2."""
    plate = PLATES[name]
    board, estimate = in_air(plate, BEAMS[name])
    found = constants(estimate) * (1.0 + rise_with_air(board, estimate))
    # The clamped board tells D_s + 2 nu_xy D_y alone: its G_xy is what the other two leave.
    some = slice(2) if name == "clamped" else slice(3)
    truth = np.array([plate.E_x, plate.E_y, plate.G_xy])
    assert found[some] == pytest.approx(truth[some], rel=0.01)
    assert (constants(estimate)[some] < 0.99 * truth[some]).all()


def test_an_isotropic_board_has_one_constant_to_tell_of():
    board, estimate = in_air(STEEL, BEAMS["steel"], density=30.0, isotropic=True)
    # Air of 1.2 kg/m3 is a twenty-fifth of what it rang in, and nine millimetres of steel hardly feel it.
    rise = rise_with_air(board, estimate)
    assert rise == pytest.approx([rise[0]] * 3)
    assert 0.0 < rise[0] < SMALLEST_RISE
    assert air_sentence(board, estimate) == ""


def test_the_sentence_says_by_how_much_and_what_to_add_but_for_lines_that_the_card_has(monkeypatch):
    """By `effects = []` what a card states is not declared: a fit without it is meant."""
    board, estimate = in_air(HALF_TOP, BEAMS["half-top"])
    E_x, E_y, G_xy = (f"{100.0 * one:+.1f} %" for one in rise_with_air(board, estimate))
    told = air_sentence(board, estimate)
    assert f"E_x {E_x}, E_y {E_y}, G_xy {G_xy}" in told
    assert told.endswith('add to [setup.fluid] the lines density_kg_m3 = 1.2 and baffle = "none"')
    stated = tuple(replace(setup, fluid=DeclaredFluid(1.2, "none")) for setup in board.setups)
    told = air_sentence(replace(board, setups=stated, effects=()), estimate)
    assert told.startswith("what the card states of the air or the water around the board is not declared; with it")
    assert told.endswith("--effects fluid_loading, or fluid_loading among the effects of the card, puts it in")
    thick = tuple(replace(setup, fluid=DeclaredFluid(2.4, "none")) for setup in board.setups)
    once, twice = (rise_with_air(replace(board, setups=each, effects=()), estimate) for each in (stated, thick))
    np.testing.assert_allclose(twice, 2.0 * once, rtol=0.05)
    assert "add to" not in told
    monkeypatch.setattr("bayesplate.estimates.undeclared_air.rise_with_air", lambda *_: np.full(3, 0.1))
    told = air_sentence(replace(board, setups=stated, effects=("transverse_shear",)), estimate)
    assert "--effects transverse_shear,fluid_loading, or" in told
    monkeypatch.undo()
    assert air_sentence(declare(replace(board, effects=("fluid_loading",))), estimate) == ""
