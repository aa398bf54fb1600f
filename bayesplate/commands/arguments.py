"""Arguments of the Python functions, held to the same rules as a card: every fault at once, before any work."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from numbers import Integral, Real
from typing import TypeGuard, get_args

import numpy as np

from bayesplate.board.board import Board
from bayesplate.board.campaign import CampaignCard
from bayesplate.board.prior import PriorCard
from bayesplate.board.words import EFFECT_NAMES, OTHER_EFFECT_NAMES, did_you_mean, effect_named, quoted, shown
from bayesplate.commands.batch_grading import grading_faults
from bayesplate.commands.prepare import Prepared
from bayesplate.diagnosis.null_control import BY_CHANCE, FALSE_ALARMS
from bayesplate.errors import Fault, InputError
from bayesplate.estimates.coefficients import CoefficientSource
from bayesplate.frequencies.laws import LawName
from bayesplate.grading.storage import TableKind
from bayesplate.planning.gains import GOALS
from bayesplate.planning.proposals import Costs
from bayesplate.recordings.reading import CHANNELS
from bayesplate.recordings.signals import MOTIONS

Check = Callable[[str, object], Iterator[Fault]]

FEWEST_NULL = math.ceil(1.0 / min(BY_CHANCE, FALSE_ALARMS)) - 1
"""Among n simulated boards the one at hand is first by chance in a share of 1 / (n + 1), which is to be that small."""


def require_arguments(**given: object) -> None:
    """Check arguments by their names.

    Parameters
    ----------
    **given
        Any of those of `_CHECKS`.

    Raises
    ------
    InputError
        With every argument that cannot be used, and with arguments that contradict each other.
    """
    faults = [fault for name, value in given.items() for fault in _CHECKS[name](name, value)]
    if given.get("force") is True and given.get("resume") is True:
        faults.append(Fault("force and resume", "one of them", "both", "force starts anew and resume continues"))
    if given.get("resume") is True and given.get("out", ...) is None:
        faults.append(Fault("resume", "the folder of the run that is continued, as out", "no out"))
    if faults:
        raise InputError(faults)


def _card(name: str, value: object) -> Iterator[Fault]:
    if isinstance(value, Board) or isinstance(getattr(value, "prepared", None), Prepared):
        return
    if isinstance(getattr(value, "card", None), CampaignCard):
        return
    for fault in _path(name, value):
        yield replace(fault, wanted="a name, a path, a Board or a Problem")


def _prior(name: str, value: object) -> Iterator[Fault]:
    if value is not None and not isinstance(value, PriorCard):
        for fault in _path(name, value):
            yield replace(fault, wanted="a name, a path or a PriorCard")


def _board(name: str, value: object) -> Iterator[Fault]:
    if not isinstance(value, Board):
        yield Fault(name, "a Board", _shown(value))


def _prior_card(name: str, value: object) -> Iterator[Fault]:
    if not isinstance(value, PriorCard):
        yield Fault(name, "a PriorCard", _shown(value))


def _request(name: str, value: object) -> Iterator[Fault]:
    """What a fit is asked for: its own entries, checked as the arguments of that name are."""
    for key in ("seed", "effects", "law", "robust"):
        if not hasattr(value, key):
            yield Fault(name, "a FitRequest", _shown(value))
            return
        yield from _CHECKS[key](f"{name} {key}", getattr(value, key))


def _workers(name: str, value: object) -> Iterator[Fault]:
    if value is not None:
        yield from _whole(1)(name, value)


def _table(name: str, value: object) -> Iterator[Fault]:
    if value not in get_args(TableKind):
        yield Fault(name, " or ".join(map(quoted, get_args(TableKind))), _shown(value))


def _path(name: str, value: object) -> Iterator[Fault]:
    if not isinstance(value, str | os.PathLike):
        yield Fault(name, "a name or a path", _shown(value))
    elif not os.fspath(value):
        yield Fault(name, "a name or a path", "an empty text")
    elif "\0" in str(value):
        yield Fault(name, "a name or a path", _shown(str(value)))


def _path_or_none(name: str, value: object) -> Iterator[Fault]:
    if value is not None:
        yield from _path(name, value)


def _whole(least: int) -> Check:
    def check(name: str, value: object) -> Iterator[Fault]:
        if isinstance(value, bool | np.bool_) or not isinstance(value, Integral) or value < least:
            yield Fault(name, f"a whole number from {least} on", _shown(value))

    return check


def _switch(name: str, value: object) -> Iterator[Fault]:
    if not isinstance(value, bool):
        yield Fault(name, "True or False", _shown(value))


def _word(words: tuple[str, ...]) -> Check:
    def check(name: str, value: object) -> Iterator[Fault]:
        if value is not None and value not in words:
            near = did_you_mean(value, words) if isinstance(value, str) else ""
            yield Fault(name, f"{', '.join(map(quoted, words))} or None", _shown(value), near)

    return check


def _callable(name: str, value: object) -> Iterator[Fault]:
    if value is not None and not callable(value):
        yield Fault(name, "a function or None", _shown(value))


def _costs(name: str, value: object) -> Iterator[Fault]:
    if value is None:
        return
    if not isinstance(value, Mapping):
        yield Fault(name, f"minutes by class: {', '.join(Costs.names())}", _shown(value))
        return
    for key, minutes in value.items():
        if key not in Costs.names():
            near = did_you_mean(key, Costs.names()) if isinstance(key, str) else ""
            yield Fault(f"{name} {key}", f"one of {', '.join(Costs.names())}", _shown(key), near)
        elif isinstance(minutes, bool) or not isinstance(minutes, Real) or not 0.0 < float(minutes) < math.inf:
            yield Fault(f"{name} {key}", "a positive number of minutes", _shown(minutes))


def _effects(name: str, value: object) -> Iterator[Fault]:
    if value is None:
        return
    if not isinstance(value, list | tuple):
        remedy = f'{name}=["{value}"]' if value in (*EFFECT_NAMES, *OTHER_EFFECT_NAMES) else ""
        yield Fault(name, "a list of names of effects", _shown(value), remedy)
        return
    known = [effect_named(one) if isinstance(one, str) else one for one in value]
    for number, effect in enumerate(known, start=1):
        if effect not in EFFECT_NAMES:
            near = did_you_mean(effect, EFFECT_NAMES) if isinstance(effect, str) else ""
            yield Fault(f"{name} {number}", f"one of {', '.join(EFFECT_NAMES)}", _shown(effect), near)
        elif effect in known[: number - 1]:
            yield Fault(f"{name} {number}", "each name once", f"{quoted(effect)} again")


def _between(name: str, value: object) -> Iterator[Fault]:
    yield from _effects(name, value)
    if isinstance(value, list | tuple) and not value:
        yield Fault(name, "one name of an effect or more, or None", "an empty list")


def _files(name: str, value: object) -> Iterator[Fault]:
    if isinstance(value, str | os.PathLike) or not isinstance(value, list | tuple) or not value:
        yield Fault(name, "a list of one path or more", _shown(value), "files=[path]")
        return
    for number, one in enumerate(value, start=1):
        yield from _path(f"{name} {number}", one)


def _rate(name: str, value: object) -> Iterator[Fault]:
    if value is not None and not _is_positive(value):
        yield Fault(name, "samples a second, a positive number", _shown(value))


def _band(name: str, value: object) -> Iterator[Fault]:
    assert isinstance(value, tuple)
    if not (_is_positive(value[0]) and _is_positive(value[1]) and 2.0 * value[0] <= value[1] <= 20_000.0):
        wanted = "two frequencies in Hz, the second twice the first or more and at most 20000"
        yield Fault("lowest and highest", wanted, f"{_shown(value[0])} and {_shown(value[1])}")


def _given_places(name: str, value: object) -> Iterator[Fault]:
    assert isinstance(value, tuple)
    *both, count = value
    for which, given in zip(("hammer", "sensor"), both, strict=True):
        if not isinstance(given, list | tuple) or len(given) not in (0, 1, count):
            wanted = f"no place, one for all files, or one for each of {count}"
            yield Fault(which, wanted, str(len(given)) if isinstance(given, list | tuple) else _shown(given))
            continue
        for number, place in enumerate(given, start=1):
            is_pair = isinstance(place, list | tuple) and len(place) == 2
            if not is_pair or not all(_is_number(one) for one in place):
                yield Fault(f"{which} {number}", "a place (x, y) in m", _shown(place), "hammer=[(0.02, 0.02)]")


def _sensor_mass(name: str, value: object) -> Iterator[Fault]:
    if value is None:
        return
    is_pair = isinstance(value, list | tuple) and len(value) == 2 and all(_is_number(one) for one in value)
    if not is_pair or not (value[0] > 0.0 and value[1] >= 0.0):  # type: ignore[index]
        yield Fault(name, "mass and standard deviation in kg, (0.0006, 0.0001)", _shown(value))


def _sand(name: str, value: object) -> Iterator[Fault]:
    if value is None:
        return
    if not isinstance(value, dict):
        yield Fault(name, "a dict of frequencies in Hz and pictures", _shown(value), 'sand={210: "210.png"}')
        return
    for hertz, picture in value.items():
        if not _is_positive(hertz):
            yield Fault(f"{name} {_shown(hertz)}", "a frequency in Hz", _shown(hertz))
        yield from _path(f"{name} {_shown(hertz)}", picture)


def _channels(name: str, value: object) -> Iterator[Fault]:
    """What two channels are, or the number of one."""
    if not (isinstance(value, str) and value.isdecimal() and int(value) > 0):
        yield from _word(CHANNELS)(name, value)


def _is_number(value: object) -> TypeGuard[float]:
    is_truth = isinstance(value, bool | np.bool_)
    return not is_truth and isinstance(value, Real) and bool(np.isfinite(float(value)))


def _is_positive(value: object) -> TypeGuard[float]:
    return _is_number(value) and value > 0.0


def _shown(value: object) -> str:
    return repr(value) if value is None or isinstance(value, bool) else shown(value)


_CHECKS: dict[str, Check] = {
    "card": _card,
    "prior": _prior,
    "out": _path_or_none,
    "setup": _path_or_none,
    "seed": _whole(0),
    "n_null": _whole(FEWEST_NULL),
    "effects": _effects,
    "law": _word(get_args(LawName)),
    "coefficients": _word(get_args(CoefficientSource)),
    **dict.fromkeys(("robust", "report", "force", "resume"), _switch),
    "progress": _callable,
    "files": _files,
    "card_or_none": _path_or_none,
    "rate": _rate,
    "places": _given_places,
    "sensor_mass": _sensor_mass,
    "channels": _channels,
    "motion": _word(MOTIONS),
    "polarity": _word(("same", "opposite")),
    "band": _band,
    "sand": _sand,
    "goal": _word(GOALS),
    "costs": _costs,
    "between": _between,
    "board": _board,
    "prior_card": _prior_card,
    "request": _request,
    **dict.fromkeys(("source", "out_folder"), _path),
    **dict.fromkeys(("template", "dask"), _path_or_none),
    "workers": _workers,
    "table": _table,
    "grading": grading_faults,
    "folders": _switch,
}
