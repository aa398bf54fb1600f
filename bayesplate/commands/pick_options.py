"""Arguments of `pick` alone: reader and option of each, and places and masses held against the board of a card."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import inf
from typing import Annotated, Any

import click

from bayesplate.board.board import Board, nominal_mass
from bayesplate.board.checks import faults_of, mass_check, place_checks
from bayesplate.board.values import Key, Refusal, read_items
from bayesplate.board.words import did_you_mean, quote_text
from bayesplate.commands.arguments import (
    is_number,
    is_positive,
    optional_reader,
    read_path,
    refusal_of,
    value_text,
    word_reader,
)
from bayesplate.commands.options import FilePath, Option, path_option
from bayesplate.effects.attached_mass import HEAVIEST_ROVING
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.reading import CHANNELS
from bayesplate.recordings.signals import MOTIONS, Motion, Place


def _places_from_text(context: click.Context, option: click.Parameter, texts: tuple[str, ...]) -> list[Place]:
    """Places "X,Y" in mm as m."""
    places = []
    for text in texts:
        try:
            x, y = (1e-3 * float(coordinate) for coordinate in text.split(","))
        except ValueError:
            raise click.BadParameter(f"wanted X,Y in mm, got {text!r}: {option.opts[0]} 20,20") from None
        places.append((x, y))
    return places


def _mass_from_text(context: click.Context, option: click.Parameter, text: str | None) -> tuple[float, float] | None:
    """A mass "G" or "G,SD" in g as kg."""
    if text is None:
        return None
    try:
        grams, sd = (*(float(number) for number in text.split(",", 1)), 0.0)[:2]
    except ValueError:
        grams, sd = 0.0, 0.0
    if not (0.0 <= sd <= grams < inf and grams > 0.0):
        wanted = "wanted a mass in g, or mass and standard deviation, with decimal points"
        raise click.BadParameter(f"{wanted}, got {text!r}: 0.6 or 0.6,0.1")
    return 1e-3 * grams, 1e-3 * sd


def _pictures_from_text(context: click.Context, option: click.Parameter, texts: tuple[str, ...]) -> dict[float, str]:
    """Pictures "HZ=FILE" by their frequency."""
    pictures = {}
    for text in texts:
        hertz, _, path = text.partition("=")
        try:
            frequency = float(hertz)
        except ValueError:
            raise click.BadParameter(f"wanted HZ=FILE, got {text!r}: --sand 210=sand-210.png") from None
        if frequency in pictures:
            raise click.BadParameter(f"{hertz} Hz is given twice")
        pictures[frequency] = path
    return pictures


def _read_files(value: object) -> object:
    if not isinstance(value, list | tuple) or not value:
        raise refusal_of("a list of one path or more", value, "files=[path]")
    read_items(enumerate(value), read_path)
    return value


def _read_rate(value: object) -> object:
    if not is_positive(value):
        raise refusal_of("samples a second, a positive number", value)
    return value


def _read_mass(value: object) -> object:
    is_pair = isinstance(value, list | tuple) and len(value) == 2 and all(map(is_number, value))
    if not is_pair or not (value[0] > 0.0 and value[1] >= 0.0):  # type: ignore[index]
        raise refusal_of("mass and standard deviation in kg, (0.0006, 0.0001)", value)
    return value


def _read_channels(value: object) -> object:
    """What two channels are, or the number of one."""
    if isinstance(value, str) and value.isdecimal() and int(value) > 0:
        return value
    if value not in CHANNELS:
        hint = did_you_mean(value, CHANNELS) if isinstance(value, str) else ""
        raise refusal_of(f"{', '.join(map(quote_text, CHANNELS))} or the number of one channel", value, hint)
    return value


def _read_pictures(value: object) -> object:
    if not isinstance(value, dict):
        raise refusal_of("a dict of frequencies in Hz and pictures", value, 'sand={210: "210.png"}')
    complaints = []
    for hertz, picture in value.items():
        if not is_positive(hertz):
            complaints += refusal_of("a frequency in Hz", hertz).complaints_below(value_text(hertz))
        try:
            read_path(picture)
        except Refusal as refusal:
            complaints += refusal.complaints_below(value_text(hertz))
    if complaints:
        raise Refusal(*complaints)
    return value


def place_faults(arguments: Mapping[str, Any]) -> Iterator[Fault]:
    """Faults of the places, of which there is none, one for all files or one for each file."""
    files = arguments["files"]
    count = len(files) if isinstance(files, list | tuple) else 1
    for argument in ("hammer", "sensor"):
        places = arguments.get(argument, ())
        if not isinstance(places, list | tuple) or len(places) not in (0, 1, count):
            wanted = f"no place, one for all files, or one for each of {count}"
            yield Fault(argument, wanted, str(len(places)) if isinstance(places, list | tuple) else value_text(places))
            continue
        for number, place in enumerate(places, start=1):
            is_pair = isinstance(place, list | tuple) and len(place) == 2
            remedy = f"{argument}=[(0.02, 0.02)], or --{argument} 20,20 in mm"
            if not is_pair or not all(map(is_number, place)):
                yield Fault(f"{argument} {number}", "a place (x, y) in m", value_text(place), remedy)
    if isinstance(arguments.get("sensor_mass"), list | tuple) and not arguments.get("sensor"):
        yield Fault("sensor_mass", "the place of the sensor beside it", "none", "--sensor X,Y in mm")


def band_faults(arguments: Mapping[str, Any], lowest: float, highest: float) -> Iterator[Fault]:
    """Faults of the band in which modes are looked for, whose ends are by default those given here."""
    low, high = arguments.get("lowest", lowest), arguments.get("highest", highest)
    if not (is_positive(low) and is_positive(high) and 2.0 * low <= high <= 20_000.0):
        wanted = "two frequencies in Hz, the second twice the first or more and at most 20000"
        yield Fault("lowest and highest", wanted, f"{value_text(low)} and {value_text(high)}")


def places_by_file(
    hammer: Sequence[Place], sensor: Sequence[Place], files: Sequence[object]
) -> list[tuple[Place | None, Place | None]]:
    """Hammer and sensor of each file, from none, one, or as many as there are files; None where nothing is known."""
    places_by_argument = [
        [*places] if len(places) > 1 else [places[0] if places else None] * len(files) for places in (hammer, sensor)
    ]
    return list(zip(*places_by_argument, strict=True))


def require_on_board(
    board: Board, hammer: Sequence[Place], sensor: Sequence[Place], sensor_mass: tuple[float, float] | None
) -> None:
    """Refuse places, m, and a mass of the sensor, kg, that a card of a board with one setup could not state."""
    (setup,) = board.setups
    places = {
        argument if len(argument_places) == 1 else f"{argument} {number}": place
        for argument, argument_places in (("hammer", hammer), ("sensor", sensor))
        for number, place in enumerate(argument_places, start=1)
    }
    rows = [*place_checks(board, setup, places)]
    if sensor_mass is not None:
        whole_mass, mass = nominal_mass(board), sensor_mass[0]
        rows.append(mass_check(board, "sensor_mass", mass))
        is_roving = len({*sensor}) > 1
        wanted = f"at most {HEAVIEST_ROVING:.0%} of the board's {1e3 * whole_mass:.4g} g for a sensor that roved"
        is_light = not is_roving or not HEAVIEST_ROVING * whole_mass < mass < whole_mass
        rows.append(("sensor_mass", is_light, wanted, f"{1e3 * mass:g} g", "pick the places apart"))
    faults = faults_of(rows)
    if faults:
        raise InputError(faults)


_CARD_HELP = "Board card with sizes and edges: labels are computed for it."
_CHANNELS_HELP = "Of a file with two channels; also response,force, response,response for stereo, or the number of one."
_MOTION_HELP = "What a response is: acceleration, velocity, displacement, or pressure (a microphone)."

Files = Annotated[Sequence[FilePath], Key(_read_files), path_option("files", nargs=-1, required=True)]
OptionalCard = Annotated[
    FilePath | None, Key(optional_reader(read_path)), Option("--card", metavar="CARD", help=_CARD_HELP)
]
Rate = Annotated[
    float | None,
    Key(optional_reader(_read_rate)),
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
    Key(optional_reader(_read_mass)),
    Option("--sensor-mass", callback=_mass_from_text, metavar="G", help="Of the accelerometer in g, or G,SD."),
]
Channels = Annotated[str, Key(_read_channels), Option("--channels", show_default=True, help=_CHANNELS_HELP)]
MotionWord = Annotated[Motion, Key(word_reader(*MOTIONS)), Option("--motion", show_default=True, help=_MOTION_HELP)]
Polarity = Annotated[
    str | None,
    Key(word_reader("same", "opposite", None)),
    Option("--polarity", help="same or opposite, of force and response (default: found by the labels)."),
]
SweepOption = Annotated[
    str | None,
    Key(optional_reader(read_path)),
    Option("--sweep", metavar="F1,F2,S", help="For recordings of an exponential sweep: its parameters, or its file."),
]
Sand = Annotated[
    Mapping[float, FilePath] | None,
    Key(optional_reader(_read_pictures)),
    Option(
        "--sand",
        multiple=True,
        callback=_pictures_from_text,
        metavar="HZ=FILE",
        help="Picture of sand, cropped to the part that vibrates.",
    ),
]
Lowest = Annotated[float, Option("--lowest", type=float, show_default=True, metavar="HZ")]
Highest = Annotated[float, Option("--highest", type=float, show_default=True, metavar="HZ")]
PickOut = Annotated[
    FilePath | None,
    Key(optional_reader(read_path)),
    path_option("--out", default="results/recordings", show_default=True, help="Output folder."),
]
