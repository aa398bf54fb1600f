"""What is taken for granted where a card says nothing: priors and units of every effect, noise, Poisson ratio.

A change of these changes what people are told, so it is made here as well, with a reason. The numbers are those of the
literature on effects in wooden plates (shear moduli of spruce 0.5-0.75 GPa and 20-40 MPa; a clamp of k_R L / D = 30 and
one with a lining of k_T L^3 / D = 1e4; tensions of 100-400 N/m in clamped boards; air of 1.2 kg/m^3; tapers and density
gradients of 5 per cent end to end, gradients of E_x of 8; grain within 6 degrees; nu_xy of 0.3-0.6; a cup of half a per
cent of the width, a bow of 0.4 of the length, a twist of one of the longer side) and those of data sheets of sensors
and exciters (four exciters of 25 mm: suspensions of 2650-2810 N/m, coils of 1.5-1.7 g).
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, log, pi
from types import SimpleNamespace

import pytest
from effect_plates import board_with
from generator.known_boards import FIEMME, FREE

from bayesplate.board.attached import AttachedItem
from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.forms import forms
from bayesplate.effects import EFFECTS

HALF = (0.0, inf)
ANY = (-inf, inf)
DEGREE = pi / 180.0

PRIORS = {
    ("transverse_shear", "G_xz"): ("Pa", "log-normal", 0.62e9, log(1.5), ANY),
    ("transverse_shear", "G_yz"): ("Pa", "log-normal", 0.030e9, log(1.8), ANY),
    ("clamp_rotation", "compliance"): ("1", "normal", 0.0, 0.04, HALF),
    ("clamp_translation", "compliance"): ("1", "normal", 0.0, 1e-4, HALF),
    ("membrane_tension", "N"): ("N/m", "normal", 0.0, 500.0, HALF),
    ("support_mass", "mass"): ("kg", "log-normal", 8.0, log(3.0), ANY),
    ("support_stiffness", "stiffness"): ("N/m^3", "normal", 0.0, 2e4, HALF),
    ("fluid_loading", "density"): ("kg/m^3", "exact", 1.2, 0.0, ANY),
    ("fluid_loading", "baffle"): ("1", "normal", 0.5, 1.0, (0.0, 1.0)),
    ("thickness_profile", "taper_x"): ("1", "normal", 0.0, 0.05, ANY),
    ("thickness_profile", "taper_y"): ("1", "normal", 0.0, 0.05, ANY),
    ("density_gradient", "gradient"): ("1", "normal", 0.0, 0.05, ANY),
    ("stiffness_gradient", "gradient"): ("1", "normal", 0.0, 0.08, ANY),
    ("warp", "cup"): ("m", "normal", 0.0, 2.06e-3, HALF),
    ("warp", "bow"): ("m", "normal", 0.0, 2.4e-3, ANY),
    ("warp", "twist"): ("m", "normal", 0.0, 6.0e-3, HALF),
    ("exciter", "mass"): ("kg", "log-normal", 50e-3, log(1.6), ANY),
    ("exciter", "coil"): ("kg", "log-normal", 1.6e-3, log(1.3), ANY),
    ("exciter", "suspension"): ("N/m", "log-normal", 2700.0, log(1.5), ANY),
    ("exciter", "place_x"): ("1", "normal", 0.25, 1.0, (0.0, 0.5)),
    ("exciter", "place_y"): ("1", "normal", 0.25, 1.0, (0.0, 0.5)),
    ("grain_angle", "angle"): ("rad", "normal", 0.0, 3.0 * DEGREE, (0.0, 6.0 * DEGREE)),
    ("poisson_ratio", "nu_xy"): ("1", "normal", 0.4, 0.15, (0.0, 0.9)),
}
"""Unit, kind, median, standard deviation (of the logarithm if log-normal) and bounds.

The rises are those of the clamped board, 600 x 412 mm; the place of an exciter on it, one quarter for all four.
"""

RISES = {
    "cup": lambda sizes: 0.005 * sizes["length_y"].mean,
    "bow": lambda sizes: 0.004 * sizes["length_x"].mean,
    "twist": lambda sizes: 0.01 * max(sizes["length_x"].mean, sizes["length_y"].mean),
}
"""Standard deviation of a rise by the sizes of the board, m."""

MASSES = [("accelerometer", 1.4e-3, 2.7), ("shaker", 10e-3, 2.0), ("weight", 5e-3, 3.0)]
"""kg and factor, where the card does not state what a thing weighs."""

FORGOTTEN_SHARE = 0.02
"""Of the board's mass: standard deviation of the half-normal prior of a thing that nobody mentioned."""

CLAMPED, FREE_BOARD = board_with(FIEMME), board_with(FREE)
DRIVEN = board_with(FIEMME, [AttachedItem("exciter")])
"""The clamped board with an exciter of which nothing is known."""


def told(parameter):
    """Unit and prior of a parameter, as `PRIORS` states them."""
    prior = parameter.prior
    kind = "exact" if prior.is_exact else prior.kind
    sd = prior.log_sd if kind == "log-normal" else prior.sd
    return parameter.unit, kind, prior.median, sd, (prior.lower, prior.upper)


def stated(unit, kind, median, sd, bounds):
    """The same from a table, to the rounding of its numbers."""
    return unit, kind, pytest.approx(median), pytest.approx(sd), pytest.approx(bounds)


def parameters_on(name, board, setup=None):
    effect = EFFECTS[name].of(board, board.setups[0] if setup is None else setup)
    return {parameter.key: parameter for parameter in effect.parameters()}


def test_unit_and_prior_of_every_parameter_of_every_effect():
    """On the first of the boards on which it can act; a thing or a course that was read has those of its own."""
    found = {}
    for name in set(EFFECTS) - {"attached_mass", "outline_profile"}:
        board = next(one for one in (CLAMPED, FREE_BOARD, DRIVEN) if not EFFECTS[name].refusal(one, one.setups[0]))
        found |= {(name, key): told(parameter) for key, parameter in parameters_on(name, board).items()}

    assert found == {which: stated(*row) for which, row in PRIORS.items()}


@pytest.mark.parametrize(("kind", "median", "factor"), MASSES)
def test_mass_of_a_thing_that_the_card_does_not_weigh(kind, median, factor):
    board = board_with(FREE, [AttachedItem(kind, ((0.1, 0.1),))], effects=["attached_mass"])

    found = parameters_on("attached_mass", board)

    assert told(found["mass"]) == stated("kg", "log-normal", median, log(factor), ANY)


def test_mass_of_a_thing_that_nobody_mentioned():
    sd = FORGOTTEN_SHARE * FREE.rho * FREE.h * FREE.L_x * FREE.L_y
    tried = [one for form in EFFECTS["attached_mass"].forms(FREE_BOARD) for one in form.effects]

    assert len(tried) > 1
    for effect in tried:
        (found,) = effect.parameters()
        assert told(found) == stated("kg", "normal", 0.0, sd, HALF)


def test_where_an_exciter_may_be_on_a_board_whose_ends_differ():
    """On a cantilever no half of the length stands for the other; the widths are alike."""
    (clamped,) = DRIVEN.setups
    cantilever = replace(clamped, ends_x=("clamped", "free"), ends_y=("free", "free"))

    found = parameters_on("exciter", DRIVEN, cantilever)

    assert told(found["place_x"]) == stated("1", "normal", 0.5, 2.0, (0.0, 1.0))
    assert told(found["place_y"]) == stated("1", "normal", 0.25, 1.0, (0.0, 0.5))


def test_resonance_in_place_of_a_suspension():
    resonance = Quantity.from_mean(28.3, 0.5)

    found = parameters_on("exciter", board_with(FIEMME, [AttachedItem("exciter", resonance=resonance)]))

    assert "suspension" not in found
    assert (found["resonance"].unit, found["resonance"].prior) == ("Hz", resonance)


@pytest.mark.parametrize("board", [DRIVEN, FREE_BOARD], ids=["driven", "free"])
def test_a_search_keeps_prior_and_unit(board):
    """What it tries is the effect's own parameter, not one of another width or without a unit."""
    seen = set()
    for name, each in forms(board).items():
        for free in (free for form in each for free in form.free if (name, free.key) in PRIORS):
            row = list(PRIORS[name, free.key])
            if name == "warp":
                row[3] = RISES[free.key](board.inputs)
            assert told(free) == stated(*row), (name, free.key)
            seen.add(name)

    assert len(seen) >= 7


CARD = """\
format = 1
name = "b"
[plate]
length_x_mm = 253
length_y_mm = 114
thickness_mm = 3
mass_g = 41
[setup]
edges = {{ x0 = "{}", x1 = "free", y0 = "free", y1 = "free" }}
[setup.frequencies_hz]
"(1,1)" = 98
"""


@pytest.mark.parametrize(("edge", "median"), [("supported", 0.003), ("clamped", 0.008)])
def test_noise_and_poisson_ratio_of_a_card_that_states_neither(edge, median):
    board = Board.from_text(CARD.format(edge), "b")

    for found, row in (
        (board.setups[0].noise, ("log-normal", median, 0.5, ANY)),
        (board.inputs["poisson_xy"], ("normal", 0.4, 0.08, ANY)),
    ):
        assert told(SimpleNamespace(unit="", prior=found)) == stated("", *row)
