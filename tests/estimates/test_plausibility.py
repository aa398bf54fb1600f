"""What the prior foretells of frequencies, and readings in another unit that are asked about; honest ones are not."""

from __future__ import annotations

from dataclasses import replace

import made_boards
import numpy as np
import pytest
import ritz

from bayesplate.cards import card_names, load_board, load_prior
from bayesplate.estimates.plausibility import FASTEST, SLOWEST, plate_speed, prior_predictive, unit_faults
from bayesplate.plate.board import Board, density, made_board
from bayesplate.plate.from_card import board_from_card
from bayesplate.plate.parameter import BOARD
from bayesplate.quantities import Quantity

PRIORS = ("spruce", "weakly-informative")
LABELS = made_boards.FREE_LABELS[:6]
SIDES = ("length_x", "length_y")


def board_of(name: str, prior: str) -> Board:
    """A shipped board with its density stated: of a mass, wrong lengths would already give an impossible density."""
    board = board_from_card(load_board(name), load_prior(prior))
    if "mass" not in board.inputs:
        return board
    stated = Quantity.exact(float(density(board.nominal())))
    own = {one.key: one.prior for one in board.parameters if one.owner == BOARD and one.key != "mass"}
    return made_board(board.name, own | {"density": stated}, board.setups)


def read_as(board: Board, factor: float) -> Board:
    """The same with every frequency times a factor."""
    setups = tuple(
        replace(s, readings=tuple(replace(r, frequency=r.frequency.scaled(factor)) for r in s.readings))
        for s in board.setups
    )
    return replace(board, setups=setups)


def measured_as(board: Board, factor: float, names: tuple[str, ...]) -> Board:
    """The same with some lengths, and what clamps cover, times a factor."""
    changed = [one for one in board.parameters if one.name in names or one.owner != BOARD]
    return board.with_priors({one.name: one.prior.scaled(factor) for one in changed})


def asked(board: Board, prior: str) -> str:
    return " ".join(str(fault) for fault in unit_faults(board, load_prior(prior), np.random.default_rng(0)))


@pytest.mark.parametrize("name", card_names("boards"))
@pytest.mark.parametrize("prior", PRIORS)
def test_shipped_boards_are_asked_nothing_and_units_are_asked_about(name, prior):
    board = board_of(name, prior)

    assert asked(board, prior) == ""
    for factor in (0.5, 2.0):  # an octave is no unit
        assert asked(read_as(board, factor), prior) == ""
    assert "in rad/s?" in asked(read_as(board, 2 * np.pi), prior)
    assert "in kHz?" in asked(read_as(board, 1e-3), prior)
    assert "are length_x_mm and length_y_mm in cm?" in asked(measured_as(board, 0.1, SIDES), prior)
    assert "is thickness_mm ten times too small" in asked(measured_as(board, 0.1, ("thickness",)), prior)


@pytest.mark.parametrize("name", ["spruce-free-2R", "fiemme-spruce-clamped"])
def test_a_prior_that_knows_the_wood_also_asks_about_a_factor_of_ten(name):
    board = board_of(name, "spruce")

    assert "or are all three lengths in cm?" in asked(measured_as(board, 0.1, (*SIDES, "thickness")), "spruce")
    assert "is thickness_mm ten times too large" in asked(measured_as(board, 10.0, ("thickness",)), "spruce")


def test_a_setup_without_labels_is_asked_nothing():
    board = board_of("spruce-free-2R", "spruce")
    peaks = replace(board.setups[0], name="other", readings=(), unlabelled=(50.0, 70.0))

    assert asked(replace(board, setups=(board.setups[0], peaks)), "spruce") == ""


MATERIALS = {
    "expanded foam": (0.006, 0.006, 0.0023, 25),
    "balsa": (2.0, 0.1, 0.12, 120),
    "steel": (210.0, 210.0, 80.0, 7850),
    "carbon fibre": (290.0, 6.0, 5.0, 1600),
}
"""E_x, E_y, G_xy in GPa and density: from the softest to the stiffest that somebody may tap."""


@pytest.mark.parametrize(("E_x", "E_y", "G_xy", "rho"), MATERIALS.values(), ids=MATERIALS)
def test_materials_from_foam_to_carbon_fibre_are_asked_nothing(E_x, E_y, G_xy, rho):
    """By an independent solver; in rad/s the same boards would need sound at up to 85 km/s."""
    moduli = (E_x * 1e9, E_y * 1e9, G_xy * 1e9)
    plate = ritz.Plate.from_moduli(*moduli, 0.3, rho=rho, h=4.7e-3, L_x=0.58, L_y=0.217, edges=ritz.ALL_FREE)
    board = made_boards.board_of(plate, [made_boards.setup_of(ritz.ALL_FREE, ritz.simulate(plate, LABELS))])

    assert asked(board, "weakly-informative") == ""
    assert SLOWEST < plate_speed(board) < FASTEST
    assert plate_speed(board) == pytest.approx(np.sqrt(E_x * 1e9 / rho), rel=0.1)  # Rayleigh quotients, 1 - nu^2


def test_the_prior_predictive_is_that_of_the_prior():
    """Its median at the prior's medians, by an independent solver; one constant alone spreads ln f by half its own."""
    prior, board = load_prior("spruce"), board_of("spruce-free-2R", "spruce")
    exact = {name: Quantity.exact(quantity.mean) for name, quantity in board.inputs.items()}
    board = board.with_priors(exact)
    found = prior_predictive(board, prior, np.random.default_rng(1))
    labels = [reading.beams for reading in board.setups[0].readings]
    sizes = {name: quantity.mean for name, quantity in exact.items()}
    plate = ritz.Plate.from_moduli(
        *(prior.constants[name].median for name in ("E_x", "E_y", "G_xy")), sizes["poisson_xy"], rho=sizes["density"],
        h=sizes["thickness"], L_x=sizes["length_x"], L_y=sizes["length_y"], edges=ritz.ALL_FREE,
    )  # fmt: skip
    by_label = ritz.simulate(plate, labels)

    for i, label in enumerate(labels):
        # a median of 4000 draws is off by 1.25 sd / sqrt(4000), a Rayleigh quotient too high by a few per cent
        assert -0.02 < found.median[i] - np.log(by_label[label]) < 0.08
    spread = dict(zip(labels, found.spread, strict=True))
    assert spread[2, 0] == pytest.approx(0.5 * np.log(prior.constants["E_x"].factor), rel=0.05)
    assert spread[0, 2] == pytest.approx(0.5 * np.log(prior.constants["E_y"].factor), rel=0.05)
    assert spread[1, 1] == pytest.approx(0.5 * np.log(prior.constants["G_xy"].factor), rel=0.05)


def test_the_distance_is_chi_squared_where_the_prior_holds():
    """Mean n of boards drawn from it, within three standard errors (the slack widens three directions a little)."""
    prior, board = load_prior("spruce"), board_of("spruce-free-2R", "spruce")
    found = prior_predictive(board, prior, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    drawn = prior_predictive(board, prior, rng).draws[:400]
    distances = [found.distance(row + 0.1 * rng.standard_normal(row.size)) for row in drawn]
    n = drawn.shape[1]

    assert np.mean(distances) == pytest.approx(n, abs=3 * np.sqrt(2 * n / 400) + 0.1)
