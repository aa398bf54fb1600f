"""Attached things: against the generator, a beam with a tip mass, first order that fails, what a card declares."""

from __future__ import annotations

from dataclasses import replace

import generator.effects
import made_boards
import numpy as np
import pytest
import ritz
import scipy.optimize
from deflected import power
from effect_plates import MADE, hertz, hertz_apart, modes_of, setup_of, shifts
from generator.designs import ALL_FREE
from generator.known_boards import BEAMS, FIEMME, FINNISH, FREE
from generator.plate import Plate
from generator.plate import solve as solve_generator

from bayesplate.board.attached import AttachedItem
from bayesplate.board.quantity import Quantity
from bayesplate.effects.attached_items import Item, base_diameter
from bayesplate.effects.attached_mass import HEAVIEST_ROVING, AttachedMass
from bayesplate.plate.line import line
from bayesplate.plate.plate import plate_of
from bayesplate.plate.thin import THIN

MASS = "attached_mass.mass"
AS_FREE = replace(ritz.FINNISH, edges=ALL_FREE)
FREE_BEAMS = [(1, 1), (2, 0), (2, 1), (0, 2), (1, 2), (3, 0), (3, 1), (2, 2)]


def at(*places, radius=(0.0, 0.0)):
    """A thing at places, fractions of the sides."""
    return AttachedMass(MADE, (Item(Quantity.exact(1e-3), "", places, radius),))


def on(plate, place, mass, radius=0.0):
    """The generator's."""
    return generator.effects.AttachedMass(mass, ((place[0] * plate.L_x, place[1] * plate.L_y),), radius)


def independent(plate, generator):
    """Nine frequencies without end: a point mass leaves an error of the square of the polynomials' number."""
    n_rigid = 3 if plate is FREE else 0
    few, many = (solve_generator(plate, generator, 9 + n_rigid, (n, n)).frequencies[n_rigid:] for n in (18, 24))
    return many + (many - few) / ((24 / 18) ** 2 - 1)


def weight(plate):
    return plate.rho * plate.h * plate.L_x * plate.L_y


PLACED = [(FINNISH, (0.9, 0.75)), (FIEMME, (0.35, 0.3)), (FREE, (0.97, 0.91))]


@pytest.mark.parametrize("share", [0.005, 0.03, 0.1])
@pytest.mark.parametrize(("plate", "place"), PLACED, ids=["cantilever", "clamped", "free"])
def test_against_the_generator(plate, place, share):
    """Up to a tenth of the board, which is far beyond what a sensor weighs."""
    mass = share * weight(plate)
    ratio = hertz(plate, [at(place)], {MASS: mass}, 9) / independent(plate, [on(plate, place, mass)])
    assert 1200 * np.log2(ratio) == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize(("plate", "place"), PLACED, ids=["cantilever", "clamped", "free"])
def test_on_a_shear_flexible_plate(plate, place):
    """Where a heavier point would sink in without limit on finer meshes, in both computations."""
    mass = 0.01 * weight(plate)
    apart = hertz_apart(plate, [at(place)], {MASS: mass}, [on(plate, place, mass)], 9, is_sheared=True)
    assert apart == pytest.approx(0.0, abs=0.5)


def test_rotary_inertia_of_a_compact_solid():
    """w = x + 2 y tilts by 1 and 2: 5 J, J of a cylinder as high as wide about a diameter of its base.

    That is m (R^2 / 4 + H^2 / 3) = m d^2 (1/16 + 1/3), and d^3 = 4 m / (5000 pi).
    """
    board, setup = board_with(replace(KNOWN, mass=Quantity.exact(20e-3)), effects=("attached_mass",), plate=AS_FREE)
    effect = AttachedMass.of(board, setup)
    x, y = (line(("free", "free"), n, is_split=False) for n in (8, 6))
    field = AS_FREE.L_x * np.outer(power(x, 1), power(y, 0)) + 2 * AS_FREE.L_y * np.outer(power(x, 0), power(y, 1))
    values = board.nominal() | {"attached_mass.mass[setup]": np.asarray(20e-3)}
    added = effect.contributions()
    (own,) = plate_of(THIN, x, y).with_terms([], [one.terms for one in added]).classes
    energies = own.energies(field.reshape(-1, 1))[1][0, 1:] * [one.weight(values, setup) for one in added]
    total = AS_FREE.rho * AS_FREE.h * AS_FREE.L_x * AS_FREE.L_y * sum(energies)
    diameter = (4 * 20e-3 / (5000 * np.pi)) ** (1 / 3)
    deflection = 0.2007 + 2 * 0.0855
    assert base_diameter(20e-3) == pytest.approx(diameter)
    assert total == pytest.approx(20e-3 * (deflection**2 + 5 * diameter**2 * (1 / 16 + 1 / 3)), rel=1e-9)


def test_sensor_that_turns_against_the_generator():
    """3 g, 9.1 mm wide, with a radius of gyration of 5.7 mm, 20 mm from the corner of a free guitar top."""
    mass, place = 3e-3, (0.966, 0.908)
    diameter = float(base_diameter(mass))
    turning = at(place, radius=(0.5 * diameter / FREE.L_x, 0.5 * diameter / FREE.L_y))
    exact = independent(FREE, [on(FREE, place, mass, diameter * np.sqrt(1 / 16 + 1 / 3))])
    assert 1200 * np.log2(hertz(FREE, [turning], {MASS: mass}, 9) / exact) == pytest.approx(0.0, abs=0.5)
    assert np.abs(1200 * np.log2(hertz(FREE, [at(place)], {MASS: mass}, 9) / exact)).max() > 1  # control: it matters


@pytest.mark.parametrize("ratio", [1e-4, 0.03, 0.3])
def test_mass_at_the_end_of_a_free_beam(ratio):
    """The beam's own equation; for a tiny mass omega^2 falls by 4 m / M."""
    beam = Plate(10e9, 10e9, 5e9, 0.0, 500.0, 2e-3, 0.3, 0.01, ALL_FREE)

    def tip(b):
        """No moment at the end and EI w''' = -m omega^2 w, b = beta L."""
        c, s, C, S = np.cos(b), np.sin(b), np.cosh(b), np.sinh(b)
        return (C - c) * (C - c + ratio * b * (S + s)) - (S - s) * (S + s + ratio * b * (C + c))

    root = scipy.optimize.brentq(tip, 3.5, 4.74)
    bare, loaded = (hertz(beam, e, {MASS: ratio * weight(beam)}, 1)[0] for e in ([], [at((1.0, 0.5))]))
    assert (loaded / bare) ** 2 == pytest.approx((root / 4.7300407) ** 4, rel=1e-4)
    if ratio < 1e-3:
        assert (loaded / bare) ** 2 - 1 == pytest.approx(-4 * ratio, rel=2e-3)


def test_size_on_the_papers_cantilever():
    """physics.md 6: 0.6 g near a free corner."""
    found = shifts(FINNISH, [at((0.9, 0.75))], {MASS: 0.6e-3}, BEAMS["cantilever"])
    assert found == pytest.approx([-42, -28, -16, 0, -17, -1], abs=0.6)


def test_first_order_fails_for_three_percent():
    """-m phi^2 of the bare modes against the full solve, with a sensor 3 mm from a corner.

    Modes are too low by up to more than twice, and one has the wrong sign: neighbours of the mode take its place.
    """
    place, mass = (0.97, 0.03), 0.03 * weight(FINNISH)
    exact = shifts(FINNISH, [at(place)], {MASS: mass}, BEAMS["cantilever"])
    bare = modes_of(FINNISH, [], {}, 6)  # in the order of BEAMS
    moved = bare.displacement(*np.array(place)[:, None])[:, 0, 0]  # of unit mass for a board of mass one
    first = -600 / np.log(2) * 0.03 * moved**2
    overshoot = first / exact - 1
    assert overshoot.max() > 1.2
    assert np.any(first * exact < 0)
    none, tiny = (hertz(FINNISH, [at(place)], {MASS: m}, 6) for m in (0.0, 1e-4 * mass))  # on one mesh
    assert 1200 * np.log2(tiny / none) == pytest.approx(1e-4 * first, rel=0.01)  # control: there it is right


@pytest.mark.parametrize(
    ("plate", "share", "beams", "worst"),
    [
        (FINNISH, 0.6e-3 / 36.1e-3, BEAMS["cantilever"], 2.5),
        (FREE, 0.012, FREE_BEAMS, 2.5),
        (FIEMME, HEAVIEST_ROVING, BEAMS["clamped"], 6.0),
    ],
    ids=["cantilever", "free", "clamped"],
)
def test_roving_mass_against_the_mean_of_its_frequencies(plate, share, beams, worst):
    """The mean of the mass terms is right to first order; beyond it errs, and a heavy thing may not rove."""
    places = [tuple(p) for p in np.random.default_rng(0).uniform((0.2, 0.05), (0.95, 0.95), (6, 2))]

    def errors(mass):
        each = [shifts(plate, [at(place)], {MASS: mass}, beams) for place in places]
        return shifts(plate, [at(*places)], {MASS: mass}, beams) - 1200 * np.log2(
            np.mean(2 ** (np.array(each) / 1200), axis=0)
        )

    nominal, tenth = (np.abs(errors(factor * share * weight(plate))).max() for factor in (1.0, 0.1))
    assert nominal < worst
    assert tenth < nominal / 40  # second order: a hundredth


def test_symmetry_that_the_places_keep():
    assert at((0.5, 0.5)).keeps_symmetry() == (True, True)
    assert at((0.9, 0.5)).keeps_symmetry() == (False, True)
    assert at((0.9, 0.3), (0.1, 0.3)).keeps_symmetry() == (True, False)
    mirrored = at((0.9, 0.3), (0.1, 0.3))
    mass = 0.02 * weight(FREE)
    unsplit = AttachedMass(MADE, (replace(mirrored.items[0], places=((0.9, 0.3), (0.1, 0.3 + 1e-5))),))
    assert hertz(FREE, [mirrored], {MASS: mass}, 6) == pytest.approx(hertz(FREE, [unsplit], {MASS: mass}, 6), rel=1e-5)


def board_with(*attached, plate=ritz.FINNISH, effects=()):
    """A board whose vibrating part begins 30 mm from its end x0, with things attached."""
    setup = made_boards.setup_of(plate.edges, {(0, 0): 1.0}, clamped={"x0": Quantity.exact(0.03)})
    board = made_boards.board_of(plate, [replace(setup, attached=attached)])
    return replace(board, effects=effects), board.setups[0]


KNOWN = AttachedItem("accelerometer", ((0.2307, 0.0855),), Quantity.from_mean(0.6e-3, 0.1e-3))
UNKNOWN = AttachedItem("weight", ((0.2, 0.01), (0.1, 0.1)))


def test_what_a_card_declares():
    """A mass declares its thing; the others join if the card lists the effect; places count from the whole board."""
    board, setup = board_with(KNOWN, UNKNOWN)
    assert AttachedMass.is_implied(board)
    (item,) = AttachedMass.of(board, setup).items
    assert item.mass is KNOWN.mass
    assert item.places[0] == pytest.approx((0.9, 0.75))
    listed = AttachedMass.of(replace(board, effects=("attached_mass",)), setup)
    assert [p.key for p in listed.parameters()] == ["mass_1", "mass_2"]
    assert not AttachedMass.is_implied(board_with(UNKNOWN)[0])


def test_candidates_of_a_search():
    """Each thing of unknown mass; where nothing is said, a few places off the clamp, none the mirror of another."""
    (candidate,) = AttachedMass.candidates(*board_with(KNOWN, UNKNOWN))
    assert [len(item.places) for item in candidate.items] == [1, 2]
    assert AttachedMass.candidates(*board_with(KNOWN)) == ()
    board, _ = board_with()
    tried = [form.effects[0].items[0].places[0] for form in AttachedMass.forms(board)]
    assert len(tried) == 12
    assert min(x for x, _ in tried) == pytest.approx(0.25)
    assert max(y for _, y in tried) == 0.5


def test_refusals():
    assert "no [[setup.attached]]" in AttachedMass.refusal(*board_with())
    assert AttachedMass.refusal(*board_with(KNOWN)) == ""
    heavy = replace(UNKNOWN, mass=Quantity.exact(2e-3))
    assert "above 2% of the board roved" in AttachedMass.refusal(*board_with(heavy))
    assert setup_of(FREE).attached == ()


def test_an_exciter_is_no_point_mass():
    """Its magnet hangs on a spring: with a mass or without, it neither implies the effect nor forbids a search."""
    board, setup = board_with(AttachedItem("exciter", ((0.1, 0.1),), 0.05), AttachedItem("exciter"))
    assert not AttachedMass.is_implied(board)
    assert "no [[setup.attached]]" in AttachedMass.refusal(board, setup)
    tried = [form.detail for form in AttachedMass.forms(board)]
    assert tried == [form.detail for form in AttachedMass.forms(board_with()[0])]


def test_a_thing_that_is_somewhere_is_tried_at_the_likely_places():
    """With the prior of its kind, where a forgotten one would be; declared, it has to be somewhere."""
    board, setup = board_with(AttachedItem("accelerometer"))
    forms, forgotten = AttachedMass.forms(board), AttachedMass.forms(board_with()[0])
    assert [form.detail for form in forms] == [form.detail for form in forgotten]
    assert [form.effects[0].items[0].mass.median for form in forms] == pytest.approx([1.4e-3] * len(forms))
    assert "no [[setup.attached]] says what is fixed to the board and where" in AttachedMass.refusal(board, setup)
    beside, setup = board_with(KNOWN, AttachedItem("weight"))
    assert [item.mass for item in AttachedMass.of(replace(beside, effects=("attached_mass",)), setup).items] == [
        KNOWN.mass
    ]
    assert [len(one.items) for one in AttachedMass.candidates(beside, setup)] == [2] * len(forgotten)
