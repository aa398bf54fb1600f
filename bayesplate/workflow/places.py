"""Places of hammer and sensor, one for all files or one for each, and what cannot be on the board of a card."""

from __future__ import annotations

from collections.abc import Sequence

from bayesplate.board.board_card import BoardCard
from bayesplate.board.physical import off_the_board, plate_mass_g, too_heavy
from bayesplate.effects.attached_mass import HEAVIEST_ROVING
from bayesplate.errors import Fault, InputError

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
    card: BoardCard,
    hammer: Sequence[Place],
    sensor: Sequence[Place],
    sensor_mass: tuple[float, float] | None,
) -> None:
    """Hold places, m, and the mass of the sensor, kg, against a card with one setup.

    Raises
    ------
    InputError
        With everything that the card would be refused for if it stated it.
    """
    (setup,) = card.setups
    millimetres = {
        which if len(given) == 1 else f"{which} {number}": (round(1e3 * x, 6), round(1e3 * y, 6))
        for which, given in (("hammer", hammer), ("sensor", sensor))
        for number, (x, y) in enumerate(given, start=1)
    }
    faults = [*off_the_board(card, setup, millimetres)]
    if sensor_mass is not None:
        grams, board = 1e3 * sensor_mass[0], plate_mass_g(card)
        heavy = [*too_heavy(card, "sensor_mass", grams)]
        if not heavy and len({*sensor}) > 1 and grams > HEAVIEST_ROVING * board:
            wanted = f"at most {HEAVIEST_ROVING:.0%} of the board's {board:.4g} g for a sensor that roved"
            heavy = [Fault("sensor_mass", wanted, f"{grams:g} g", "pick the places apart")]
        faults += heavy
    if faults:
        raise InputError(faults)
