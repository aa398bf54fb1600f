"""Arguments of `pick` alone: reader and option of each, and places and masses held against the board of a card."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf
from typing import Annotated, Any

import click

from bayesplate.board.board import Board
from bayesplate.board.checks import board_mass, faults_of, lighter_than_the_board, on_the_board
from bayesplate.board.values import Key, Refusal, read_each
from bayesplate.board.words import did_you_mean, quoted
from bayesplate.commands.arguments import is_number, is_positive, or_none, read_path, refused, value_shown, word
from bayesplate.commands.options import FilePath, Option, path_option
from bayesplate.effects.attached_mass import HEAVIEST_ROVING
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.reading import CHANNELS
from bayesplate.recordings.signals import MOTIONS, Motion

Place = tuple[float, float]


def _places_from_text(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> list[Place]:
    """Places "X,Y" in mm as m."""
    found = []
    for text in given:
        try:
            x, y = (1e-3 * float(part) for part in text.split(","))
        except ValueError:
            raise click.BadParameter(f"wanted X,Y in mm, got {text!r}: {option.opts[0]} 20,20") from None
        found.append((x, y))
    return found


def _mass_from_text(context: click.Context, option: click.Parameter, given: str | None) -> tuple[float, float] | None:
    """A mass "G" or "G,SD" in g as kg."""
    if given is None:
        return None
    try:
        grams, sd = (*(float(part) for part in given.split(",", 1)), 0.0)[:2]
    except ValueError:
        grams, sd = 0.0, 0.0
    if not (0.0 <= sd <= grams < inf and grams > 0.0):
        wanted = "wanted a mass in g, or mass and standard deviation, with decimal points"
        raise click.BadParameter(f"{wanted}, got {given!r}: 0.6 or 0.6,0.1")
    return 1e-3 * grams, 1e-3 * sd


def _pictures_from_text(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[float, str]:
    """Pictures "HZ=FILE" by their frequency."""
    found = {}
    for text in given:
        hertz, _, path = text.partition("=")
        try:
            found[float(hertz)] = path
        except ValueError:
            raise click.BadParameter(f"wanted HZ=FILE, got {text!r}: --sand 210=sand-210.png") from None
    return found


def _read_files(value: object) -> object:
    if not isinstance(value, list | tuple) or not value:
        raise refused("a list of one path or more", value, "files=[path]")
    read_each(enumerate(value), read_path)
    return value


def _read_rate(value: object) -> object:
    if not is_positive(value):
        raise refused("samples a second, a positive number", value)
    return value


def _read_mass(value: object) -> object:
    is_pair = isinstance(value, list | tuple) and len(value) == 2 and all(map(is_number, value))
    if not is_pair or not (value[0] > 0.0 and value[1] >= 0.0):  # type: ignore[index]
        raise refused("mass and standard deviation in kg, (0.0006, 0.0001)", value)
    return value


def _read_channels(value: object) -> object:
    """What two channels are, or the number of one."""
    if isinstance(value, str) and value.isdecimal() and int(value) > 0:
        return value
    if value not in CHANNELS:
        near = did_you_mean(value, CHANNELS) if isinstance(value, str) else ""
        raise refused(f"{', '.join(map(quoted, CHANNELS))} or the number of one channel", value, near)
    return value


def _read_pictures(value: object) -> object:
    if not isinstance(value, dict):
        raise refused("a dict of frequencies in Hz and pictures", value, 'sand={210: "210.png"}')
    wrong = []
    for hertz, picture in value.items():
        if not is_positive(hertz):
            wrong += refused("a frequency in Hz", hertz).inside(value_shown(hertz))
        try:
            read_path(picture)
        except Refusal as refusal:
            wrong += refusal.inside(value_shown(hertz))
    if wrong:
        raise Refusal(*wrong)
    return value


def places_beside_files(given: Mapping[str, Any]) -> Iterator[Fault]:
    """What is wrong with places, of which there is none, one for all files or one for each."""
    files = given["files"]
    count = len(files) if isinstance(files, list | tuple) else 1
    for which in ("hammer", "sensor"):
        places = given.get(which, ())
        if not isinstance(places, list | tuple) or len(places) not in (0, 1, count):
            wanted = f"no place, one for all files, or one for each of {count}"
            yield Fault(which, wanted, str(len(places)) if isinstance(places, list | tuple) else value_shown(places))
            continue
        for number, place in enumerate(places, start=1):
            is_pair = isinstance(place, list | tuple) and len(place) == 2
            if not is_pair or not all(map(is_number, place)):
                yield Fault(f"{which} {number}", "a place (x, y) in m", value_shown(place), "hammer=[(0.02, 0.02)]")


def band(given: Mapping[str, Any], lowest: float, highest: float) -> Iterator[Fault]:
    """What is wrong with the band in which modes are looked for, from the ends that hold if none is given."""
    low, high = given.get("lowest", lowest), given.get("highest", highest)
    if not (is_positive(low) and is_positive(high) and 2.0 * low <= high <= 20_000.0):
        wanted = "two frequencies in Hz, the second twice the first or more and at most 20000"
        yield Fault("lowest and highest", wanted, f"{value_shown(low)} and {value_shown(high)}")


def given_places(
    hammer: Sequence[Place], sensor: Sequence[Place], files: Sequence[object]
) -> list[tuple[Place | None, Place | None]]:
    """Hammer and sensor of each file, from none, one, or as many as there are files; None where nothing is known."""
    every = [[*given] if len(given) > 1 else [given[0] if given else None] * len(files) for given in (hammer, sensor)]
    return list(zip(*every, strict=True))


def require_on_board(
    board: Board, hammer: Sequence[Place], sensor: Sequence[Place], sensor_mass: tuple[float, float] | None
) -> None:
    """Refuse places, m, and a mass of the sensor, kg, that a card of a board with one setup could not state."""
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


_OF_CARD = "Board card with sizes and edges: labels are computed for it."
_OF_CHANNELS = "Of a file with two channels; also response,force, response,response for stereo, or the number of one."
_OF_MOTION = "What a response is: acceleration, velocity, displacement, or pressure (a microphone)."

Files = Annotated[Sequence[FilePath], Key(_read_files), path_option("files", nargs=-1, required=True)]
CardOrNone = Annotated[FilePath | None, Key(or_none(read_path)), Option("--card", metavar="CARD", help=_OF_CARD)]
Rate = Annotated[
    float | None,
    Key(or_none(_read_rate)),
    Option("--rate", type=float, metavar="HZ", help="Samples per second, where a file does not say it."),
]
Hammer = Annotated[
    Sequence[Place],
    Option(
        "--hammer",
        multiple=True,
        callback=_places_from_text,
        metavar="X,Y",
        help="Where it was hit, mm; once, or per file.",
    ),
]
Sensor = Annotated[
    Sequence[Place],
    Option(
        "--sensor", multiple=True, callback=_places_from_text, metavar="X,Y", help="Where the sensor was, mm; likewise."
    ),
]
SensorMass = Annotated[
    tuple[float, float] | None,
    Key(or_none(_read_mass)),
    Option("--sensor-mass", callback=_mass_from_text, metavar="G", help="Of the accelerometer in g, or G,SD."),
]
Channels = Annotated[str, Key(_read_channels), Option("--channels", show_default=True, help=_OF_CHANNELS)]
MotionWord = Annotated[Motion, Key(word(*MOTIONS)), Option("--motion", show_default=True, help=_OF_MOTION)]
Polarity = Annotated[
    str | None,
    Key(word("same", "opposite")),
    Option("--polarity", help="same or opposite, of force and response (default: found by the labels)."),
]
SweepOption = Annotated[
    str | None,
    Key(or_none(read_path)),
    Option("--sweep", metavar="F1,F2,S", help="For recordings of an exponential sweep: its parameters, or its file."),
]
Sand = Annotated[
    Mapping[float, FilePath] | None,
    Key(or_none(_read_pictures)),
    Option(
        "--sand",
        multiple=True,
        callback=_pictures_from_text,
        metavar="HZ=FILE",
        help="Picture of sand, cropped to the board.",
    ),
]
Lowest = Annotated[float, Option("--lowest", type=float, show_default=True, metavar="HZ")]
Highest = Annotated[float, Option("--highest", type=float, show_default=True, metavar="HZ")]
OutOfPick = Annotated[
    FilePath | None,
    Key(or_none(read_path)),
    path_option("--out", default="results/recordings", show_default=True, help="Output folder."),
]
