"""An exciter that roved: what is read is the mean of the frequencies over its places, for every estimate and sheet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from generator.known_boards import FIEMME
from made_boards import board_of, setup_of

from bayesplate.board.attached import AttachedItem
from bayesplate.board.quantity import Quantity
from bayesplate.effects import declare
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.estimates.paper import paper_system
from bayesplate.estimates.sheet import sheet
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.system import system_of

READ = ((0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2))
DRIVE = AttachedItem(
    "exciter",
    tuple((x * FIEMME.L_x, y * FIEMME.L_y) for x, y in ((0.2, 0.15), (0.35, 0.4), (0.5, 0.5))),
    Quantity.exact(48e-3),
    Quantity.exact(1.6e-3),
    Quantity.exact(2700.0),
)


def driven(hertz):
    """The clamped board with the exciter, read at these frequencies."""
    setup = replace(setup_of(FIEMME.edges, dict(zip(READ, map(float, hertz), strict=True))), attached=(DRIVE,))
    return declare(replace(board_of(FIEMME, [setup]), effects=("exciter",)))


@pytest.fixture(scope="module")
def perfect():
    """A board whose readings are those of its own model, with the constants that it was made of."""
    board = driven(np.full(len(READ), 100.0))
    values = {**board.nominal(), "D_x": FIEMME.D_x, "D_y": FIEMME.D_y, "D_s": FIEMME.G_xy * FIEMME.h**3 / 3.0}
    values = {name: np.asarray(value) for name, value in values.items()}
    model = setup_model(system_of(board, board.setups[0]), values)
    places = [np.exp(station.log_frequencies(values, "linear")[0]) for station in model.stations]
    return driven(np.mean(places, axis=0)), values, places


def test_the_papers_least_squares_has_the_constants_of_readings_without_noise(perfect):
    board, values, places = perfect
    estimate = weighted_least_squares(board)
    wanted = [float(values[name]) for name in ("D_x", "D_y", "D_s")]

    assert estimate.rigidities == pytest.approx(wanted, rel=1e-6)
    assert paper_system(board, estimate).solve() == pytest.approx(wanted, rel=1e-6)
    assert np.abs(places[0] / places[1] - 1.0).max() > 0.02  # control: the places differ


def test_the_sheet_shows_the_mean_over_the_places(perfect):
    board, values, _ = perfect
    shown = sheet(board, system_of(board, board.setups[0]), values, "as made")
    residuals = {mode.name: mode.residual_cents for mode in shown.modes if mode.measured_hz is not None}

    assert len(residuals) == len(READ)
    assert list(residuals.values()) == pytest.approx([0.0] * len(READ), abs=0.1)
