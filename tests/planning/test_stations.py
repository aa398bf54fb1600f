"""Ways to hold a board, and what a known mass does, against the independent generator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from generator.effects import AttachedMass
from generator.naming import frequencies
from generator.plate import Plate
from made_boards import setup_of

from bayesplate.board.attached import AttachedItem
from bayesplate.board.board import make_board
from bayesplate.board.material import rigidities
from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import unknown_discrepancy_variance, with_discrepancies
from bayesplate.planning.beliefs import KnownBoard, prior_beliefs
from bayesplate.planning.bench import make_bench
from bayesplate.planning.laws import PLACING_SD, SolvedStation, bare_law, known_mass
from bayesplate.planning.modes_read import station_readings
from bayesplate.planning.stations import new_stations, old_stations

FREE, CLAMPED = (dict.fromkeys(("x0", "x1", "y0", "y1"), word) for word in ("free", "clamped"))
READ = ((1, 1), (2, 0), (2, 1), (0, 2))
SIZES = {"length_x": 0.58, "length_y": 0.217, "thickness": 4.7e-3, "density": 430.0, "poisson_xy": 0.4}
MODULI = {"E_x": 11.5e9, "E_y": 0.9e9, "G_xy": 0.7e9}


def board(edges, beams=READ):
    """A board of the generator's constants, whose readings hardly matter here."""
    setup = setup_of(edges, {one: 50.0 * (i + 1) for i, one in enumerate(beams)})
    return make_board("made", {name: Quantity.exact(value) for name, value in SIZES.items()}, (setup,))


VALUES = {name: np.asarray(value) for name, value in SIZES.items()}
VALUES |= rigidities(*map(np.asarray, MODULI.values()), VALUES["thickness"], VALUES["poisson_xy"])._asdict()
PLATE = Plate(**MODULI, nu_xy=0.4, rho=430.0, h=4.7e-3, L_x=0.58, L_y=0.217, edges=FREE)


def loaded(made, *at):
    """ln of the frequencies of the generator's plate with a known mass at a place, or bare."""
    masses = [AttachedMass(known_mass(made), at)] if at else []
    found, _ = frequencies(PLATE, masses, READ)
    return np.log([found[beams] for beams in READ])


def held_on_days(*names):
    """A board in several sessions that share the departures of its modes from the plate."""
    made = board(FREE)
    return with_discrepancies(replace(made, setups=tuple(replace(made.setups[0], name=name) for name in names)))


def stations(board, values):
    return [*old_stations(board, values), *new_stations(board, values)]


@pytest.fixture(scope="module")
def free():
    return stations(board(FREE), VALUES)


def test_a_free_board_is_proposed_as_a_cantilever_and_no_board_as_what_it_was(free):
    clamped = stations(board(CLAMPED, ((0, 0), (0, 1), (1, 0))), VALUES)

    assert [one.setup.name for one in free] == ["setup", "cantilever"]
    assert free[1].setup.edges == {"x0": "clamped", "x1": "free", "y0": "free", "y1": "free"}
    assert [one.setup.name for one in clamped] == ["setup", "free"]
    assert (free[1].n_old, free[1].spots) == (0, ())


def test_of_a_mode_that_has_lost_its_name_nothing_is_told(free):
    """Neither where it is nor what a known mass adds to it; the others stay as they are."""
    found = SolvedStation.of(free[0], board(FREE), VALUES)
    lost = replace(found, rows=[-1, *found.rows[1:]])

    assert found.log_hertz_and_mass_shifts.shape == (1 + len(free[0].spots), len(free[0].setup.labels))
    assert np.isnan(lost.log_hertz_and_mass_shifts[:, 0]).all()
    np.testing.assert_array_equal(lost.log_hertz_and_mass_shifts[:, 1:], found.log_hertz_and_mass_shifts[:, 1:])


def test_on_the_mesh_for_other_values_the_sides_serve_again_and_the_modes_are_the_same(free):
    here, there = VALUES, VALUES | {"D_x": 2.0 * VALUES["D_x"]}
    first, own, again = (
        SolvedStation.of(free[0], board(FREE), at, meshed)
        for at, meshed in ((here, None), (there, None), (there, here))
    )
    of_first, of_own, of_again = ((one.modes.plate.x, one.modes.plate.y) for one in (first, own, again))
    assert all(one is other for one, other in zip(of_first, of_again, strict=True))
    assert [side.nodes.size for side in of_own] != [side.nodes.size for side in of_first]
    np.testing.assert_allclose(
        again.log_hertz_and_mass_shifts, own.log_hertz_and_mass_shifts, atol=4e-4
    )  # either mesh is within 0.02 %
    assert np.abs(again.log_hertz_and_mass_shifts - first.log_hertz_and_mass_shifts).max() > 0.1


def test_of_several_sessions_only_the_last_goes_on():
    held, made = held_on_days("monday", "friday", "sunday"), board(FREE)
    held = replace(held, setups=(*held.setups, setup_of(CLAMPED, {(0, 0): 90.0}, name="clamped")))

    assert [one.setup.name for one in stations(held, VALUES) if one.takes_readings(held)] == ["sunday", "clamped"]
    assert all(one.takes_readings(made) for one in stations(made, VALUES))


def test_a_mode_that_no_session_read_departs_from_the_plate_as_one_that_was_read_does():
    """Its discrepancy is no parameter yet, and its variance is what it will be as one."""
    held, made = held_on_days("monday", "friday"), board(FREE)
    station = stations(held, VALUES)[0]
    new = station.setup.readings[station.n_old]
    days = tuple(replace(one, readings=(*one.readings, new)) for one in held.setups)
    read = with_discrepancies(replace(held, setups=days))
    at = read.nominal() | VALUES
    slopes = bare_law(read, next(one for one in old_stations(read, at) if one.takes_readings(read)), at).slopes[0]
    column = 3 + [one.key for one in read.uncertain].index(f"discrepancy {new.label}")

    unknown = unknown_discrepancy_variance(held, station.setup)
    assert unknown[: station.n_old + 1] == pytest.approx([0.0] * station.n_old + [slopes[station.n_old, column] ** 2])
    assert unknown[-1] > 0.003**2
    assert not unknown_discrepancy_variance(made, made.setups[0]).any()


def test_planned_readings_carry_it(monkeypatch):
    monkeypatch.setattr("bayesplate.planning.beliefs._N_PLATES", 2)
    held = held_on_days("monday", "friday")
    believed = prior_beliefs(held, load_prior("spruce"), np.random.default_rng(1))
    (known,) = believed.boards
    law = next(one for one in known.laws if one.station.takes_readings(held))
    last, further = law.station, station_readings(believed, known, law, np.random.default_rng(1)).further
    noise = believed.explanations[0].noise[:, 1] ** 2

    assert further.variance[0] - noise[:, None] == pytest.approx(
        np.tile(unknown_discrepancy_variance(held, last.setup)[last.n_old :], (noise.size, 1))
    )


def test_modes_that_were_read_come_first_and_none_twice(free):
    labels = [(label.m, label.n) for label in free[0].setup.labels]

    assert labels[: len(READ)] == list(READ)
    assert len(labels) == len(set(labels)) == len(READ) + 8
    assert set(labels[len(READ) :]) >= {(1, 2), (3, 0), (3, 1), (2, 2)}


@pytest.fixture(scope="module")
def free_law(free):
    return bare_law(board(FREE), free[0], VALUES)


def test_a_known_mass_shifts_modes_as_the_generator_has_it(free, free_law):
    """Solved among two dozen modes: within two cents and a hundredth of the shift, which is up to 76 cents."""
    made, (station, _) = board(FREE), free
    bare = loaded(made)
    wanted = loaded(made, station.places(made)[-1]) - bare

    added = free_law.solved[len(station.spots), : len(READ)]
    assert np.abs(wanted).max() > 0.02
    assert np.all(np.abs(added - wanted) < 0.01 * np.abs(wanted) + 2.0 * np.log(2.0) / 1200.0)
    assert free_law.middle[: len(READ)] == pytest.approx(bare, abs=1e-3)


def test_a_known_mass_off_its_place_adds_as_much_more_or_less_as_the_independent_solver_says(free, free_law):
    """Near a nodal line a millimetre changes much of a small shift, in a belly hardly any of a large one."""
    made, (station, _) = board(FREE), free
    x, y = station.places(made)[-1]
    wide = 3.0 * PLACING_SD
    along = loaded(made, (x + wide, y)) - loaded(made, (x - wide, y))
    across = loaded(made, (x, y + wide)) - loaded(made, (x, y - wide))

    off_place = free_law.mass_shift_sd[-1, : len(READ)]
    assert off_place == pytest.approx(np.hypot(along, across) / 6.0, rel=0.1)
    relative = off_place / np.abs(free_law.solved[len(station.spots), : len(READ)])
    assert relative.max() > 2.0 * relative.min()


def test_a_mode_on_whose_nodal_line_the_sensor_stands_is_not_looked_for():
    """In the middle of the width it sees none with an odd number of lines across; a weight there sees nothing."""
    made = board(FREE)

    def labels(kind, elsewhere=False):
        item = AttachedItem(kind, ((0.1, 0.5 * SIZES["length_y"]),), Quantity.exact(1e-6))
        found = stations(replace(made, setups=(replace(made.setups[0], attached=(item,)),)), VALUES)
        return [one.label for one in found[elsewhere].setup.readings[0 if elsewhere else len(READ) :]]

    assert all(one.n % 2 == 0 for one in labels("accelerometer"))
    assert any(one.n % 2 for one in labels("weight"))
    assert any(one.n % 2 for one in labels("accelerometer", elsewhere=True))  # it is put where it sees them


def test_the_sheet_shows_every_mode_that_is_to_be_found_and_the_sensor_alone_as_one(free):
    """Also the highest that are looked at, where a board was read up to the twentieth."""
    beams = [(one.label.m, one.label.n) for one in free[0].setup.readings]
    beams = [(one.label.m, one.label.n) for one in stations(board(FREE, beams), VALUES)[0].setup.readings]
    weight = AttachedItem("weight", ((0.29, 0.1),), Quantity.exact(1e-6))
    read = board(FREE, beams)
    read = replace(read, setups=(replace(read.setups[0], attached=(weight,)),))
    station = stations(read, VALUES)[0]
    rows = range(station.n_old, len(station.setup.readings))
    law = bare_law(read, station, VALUES)
    ends = law.solved[0, list(rows), None] + np.array([-0.01, 0.0, 0.01])
    known_board = KnownBoard(read, VALUES, (law,), np.eye(3))
    bench = make_bench(known_board, law, rows, ends, "").entry
    loaded = make_bench(known_board, law, rows, ends, "", spot=1)

    assert len(beams) == 20
    assert {one.label for one in bench.modes} == {str(station.setup.labels[i]) for i in rows}
    assert bench.added_mass == ""
    (x, y), grams = station.places(read)[1], 1e3 * known_mass(read)
    assert loaded.entry.added_mass == f"{grams:g} g at x = {1e3 * x:.0f}, y = {1e3 * y:.0f} mm"
    assert loaded.sheet.basis.endswith(f"with {loaded.entry.added_mass}")
    assert bench.sensor_mm != (290, 100)


@pytest.mark.parametrize(("place", "stays"), [((0.57, 0.21), True), ((0.57, 0.1085), False)])
def test_where_the_board_is_held_otherwise_the_sensor_stays_if_it_sees_every_mode(place, stays):
    """In the middle of the width it sees no mode with an odd number of lines across."""
    sensor = AttachedItem("accelerometer", (place,), Quantity.exact(1e-6))
    read = board(FREE)
    read = replace(read, setups=(replace(read.setups[0], attached=(sensor,)),))
    (station,) = new_stations(read, VALUES)
    law = bare_law(read, station, VALUES)
    rows = range(len(station.setup.readings))
    ends = law.solved[0, list(rows), None] + np.array([-0.01, 0.0, 0.01])
    bench = make_bench(KnownBoard(read, VALUES, (law,), np.eye(3)), law, rows, ends, "").entry

    assert (bench.sensor_mm == tuple(round(1e3 * x) for x in place)) == stays
    assert min(mode.seen for mode in bench.modes) > 0.1
