"""Places of hammer and sensor, one for all files or one for each, and what cannot be on the board of a card."""

from __future__ import annotations

from collections.abc import Sequence

from bayesplate.board.board import Board
from bayesplate.board.checks import board_mass, faults_of, lighter_than_the_board, on_the_board
from bayesplate.effects.attached_mass import HEAVIEST_ROVING
from bayesplate.errors import InputError

Place = tuple[float, float]


def given_places(
    hammer: Sequence[Place], sensor: Sequence[Place], files: Sequence[object]
) -> list[tuple[Place | None, Place | None]]:
    """Hammer and sensor of each file, m; None where nothing is known.

    Parameters
    ----------
    hammer, sensor : sequence of (float, float), m
        None, one, or as many as there are files.
    files : sequence
    """
    columns = []
    for given in (hammer, sensor):
        spread = [None] * len(files) if not given else [*given] * len(files) if len(given) == 1 else [*given]
        columns.append(spread)
    return list(zip(*columns, strict=True))


def require_on_board(
    board: Board,
    hammer: Sequence[Place],
    sensor: Sequence[Place],
    sensor_mass: tuple[float, float] | None,
) -> None:
    """Hold places, m, and the mass of the sensor, kg, against a board with one setup.

    Raises
    ------
    InputError
        With everything that the card would be refused for if it stated it.
    """
    (setup,) = board.setups
    places = {
        which if len(given) == 1 else f"{which} {number}": place
        for which, given in (("hammer", hammer), ("sensor", sensor))
        for number, place in enumerate(given, start=1)
    }
    rows = [*on_the_board(board, setup, places)]
    if sensor_mass is not None:
        own, mass = board_mass(board), sensor_mass[0]
        rows.append(lighter_than_the_board(board, "sensor_mass", mass))
        roves = len({*sensor}) > 1
        wanted = f"at most {HEAVIEST_ROVING:.0%} of the board's {1e3 * own:.4g} g for a sensor that roved"
        is_light = not roves or not HEAVIEST_ROVING * own < mass < own
        rows.append(("sensor_mass", is_light, wanted, f"{1e3 * mass:g} g", "pick the places apart"))
    faults = faults_of(rows)
    if faults:
        raise InputError(faults)
