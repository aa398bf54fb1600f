"""Thickness profile: constant and tapered plates, measured stations, the generator, and the sizes of physics.md."""

from __future__ import annotations

from dataclasses import replace

import generator.effects
import numpy as np
import pytest
import ritz
from effect_plates import hertz, hertz_apart, posed, setup_of, shifts, values_of
from generator.known_boards import BEAMS, FIEMME, FINNISH, FREE
from generator.plate import solve as solve_generator
from made_boards import board_of

from bayesplate.effects.part import Part
from bayesplate.effects.stations import Stations
from bayesplate.effects.thickness_profile import ThicknessProfile
from bayesplate.frequencies.system import System
from bayesplate.posterior.laplace import worst_cents
from bayesplate.quantities import Quantity

CORNERS = ((0.0, 0.0, 1.0, 1.0), (0.0, 1.0, 0.0, 1.0))


def taper(x, y=0.0):
    return {"thickness_profile.taper_x": x, "thickness_profile.taper_y": y}


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize("tapers", [(0.05, 0.0), (-0.1, 0.06), (0.4, -0.3)])
@pytest.mark.parametrize("plate", [FINNISH, FIEMME, FREE], ids=["cantilever", "clamped", "free"])
def test_free_tapers_against_the_generator(plate, tapers, is_sheared):
    independent = generator.effects.ThicknessProfile(*tapers)
    apart = hertz_apart(plate, [ThicknessProfile()], taper(*tapers), [independent], 6, is_sheared)
    assert apart == pytest.approx(0.0, abs=0.5)


def test_counts_the_part_under_the_clamp():
    whole = replace(FINNISH, covered=0.03, whole=0.253)
    effect = ThicknessProfile(part_x=Part(0.03 / 0.253, 0.223 / 0.253))
    independent = generator.effects.ThicknessProfile(0.2)
    assert hertz_apart(whole, [effect], taper(0.2), [independent], 6) == pytest.approx(0.0, abs=0.5)


def test_sizes_on_the_papers_cantilever():
    """physics.md 6, printed as whole cents."""
    moved = shifts(FINNISH, [ThicknessProfile()], taper(0.05), BEAMS["cantilever"])
    assert moved == pytest.approx([-54, -23, -13, 7, -6, 1], abs=0.6)


def test_sizes_on_the_papers_clamped_board():
    moved = shifts(FIEMME, [ThicknessProfile()], taper(0.05), BEAMS["clamped"])
    assert np.abs(moved).max() < 0.5


def test_taper_of_a_beam_to_first_order_by_hand():
    """d omega^2 / omega^2 = alpha int s (3 phi''^2 / int phi''^2 - phi^2 / int phi^2), phi of a clamped-free beam."""
    beam = ritz.Side(("clamped", "free"), 1.0, 14)
    points, weights = beam.points, beam.weights
    bent, moved = ((beam.values(points, order) @ beam.beams[:, 0]) ** 2 for order in (2, 0))
    s = points - 0.5
    slope = 3 * np.sum(weights * s * bent) / np.sum(weights * bent) - np.sum(weights * s * moved) / np.sum(
        weights * moved
    )
    narrow = replace(FINNISH, L_y=0.01, nu_xy=0.0)
    found = shifts(narrow, [ThicknessProfile()], taper(0.001), [(0, 0)])[0]
    assert found == pytest.approx(600 / np.log(2) * 0.001 * slope, rel=2e-3)


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
def test_a_uniform_profile_is_the_constant_plate(is_sheared):
    uniform = ThicknessProfile(stations=Stations(*CORNERS, (1.0,) * 4))
    assert hertz_apart(FREE, [uniform], {}, [], 6, is_sheared) == pytest.approx(
        hertz_apart(FREE, [], {}, [], 6, is_sheared), abs=0.01
    )


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
def test_stations_at_the_corners_are_the_taper(is_sheared):
    x, y = CORNERS
    stations = Stations(x, y, tuple(1 + 0.1 * (a - 0.5) + 0.06 * (b - 0.5) for a, b in zip(x, y, strict=True)))
    independent = generator.effects.ThicknessProfile(0.1, 0.06)
    apart = hertz_apart(FREE, [ThicknessProfile(stations=stations)], {}, [independent], 6, is_sheared)
    assert apart == pytest.approx(0.0, abs=0.5)


def test_a_measured_profile_against_the_generator():
    """Readings at ten places, as on the measured free boards; the generator takes the same h(x, y) as a function."""
    x, y = np.tile(np.linspace(0, 1, 5), 2), np.repeat([0.0, 1.0], 5)
    readings = 1.0 + np.array([4, -2, 3, 1, -5, -3, -4, 6, 5, -2]) / 100
    stations = Stations(tuple(x), tuple(y), tuple(readings))
    bent = replace(FREE, thickness=(lambda s, t: stations(s / FREE.L_x, t / FREE.L_y),))
    independent = solve_generator(bent, (), 9, (22, 16)).frequencies[3:]

    cents = 1200 * np.log2(hertz(FREE, [ThicknessProfile(stations=stations)], {}, 6) / independent)

    assert cents == pytest.approx(0.0, abs=0.5)
    assert np.abs(shifts(FREE, [ThicknessProfile(stations=stations)], {}, [(1, 1), (2, 0), (0, 2)])).max() > 3.0


def test_stations_go_through_their_readings_and_on_for_half_a_step():
    row = Stations((0.2, 0.4, 0.8), (0.5, 0.5, 0.5), (1.0, 1.2, 1.0))
    at = np.array([0.0, 0.1, 0.2, 0.3, 0.8, 0.9, 1.0])
    assert row(at, np.full(7, 0.9)) == pytest.approx([0.9, 0.9, 1.0, 1.1, 1.0, 0.95, 0.9])
    plane = Stations((0.1, 0.9, 0.3, 0.6), (0.2, 0.1, 0.9, 0.7), tuple(1 + a - 2 * b for a, b in
                     ((0.1, 0.2), (0.9, 0.1), (0.3, 0.9), (0.6, 0.7))))  # fmt: skip
    assert plane(np.array([0.5]), np.array([0.5])) == pytest.approx(0.5)


def test_a_given_mass_is_kept():
    """Stations that crowd where the board is thick: their mean is not the board's, the mass on the scale is."""
    setup = setup_of(FINNISH)
    readings = Quantity.from_readings([0.0031, 0.0031, 0.0031, 0.0027], 0.0, [0.0, 0.01, 0.02, 0.223], [0.05] * 4)
    board = board_of(ritz.FINNISH, [setup], thickness=readings, mass=Quantity.exact(0.036))
    values = board.nominal() | {n: v for n, v in values_of(FINNISH, {}).items() if n.startswith("D_")}
    system = System(setup, (ThicknessProfile.of(board, setup),))

    adjusted = system.effects[0].adjusted(values)
    x = np.linspace(0, 0.223, 4001)
    h = np.interp(x, readings.at_x, readings.readings)

    assert adjusted["density"] * h.mean() * 0.223 * 0.114 == pytest.approx(0.036, rel=1e-3)
    assert ThicknessProfile.is_implied(board)
    assert system.effects[0].parameters() == ()


@pytest.mark.parametrize("card", ["finnish-spruce-cantilever", "spruce-free-2R"])
def test_reduced_order_model_is_exact(card):
    """The second card has readings at places, the first tapers."""
    assert worst_cents(posed(card, ["thickness_profile"]).posterior.models) < 0.5
