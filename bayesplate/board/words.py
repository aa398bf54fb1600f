"""The words of a card, the rule for names, and how messages show a wrong word or value and its remedy."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from datetime import date, datetime, time

from bayesplate.errors import printable

EDGES = ("x0", "x1", "y0", "y1")
EDGE_WORDS = ("clamped", "supported", "free")
ATTACHED_KINDS = ("accelerometer", "exciter", "shaker", "weight")
BAFFLES = ("none", "full")
MAGNETS = ("free", "held")
EFFECT_NAMES = (
    "transverse_shear",
    "fluid_loading",
    "attached_mass",
    "exciter",
    "warp",
    "clamp_rotation",
    "clamp_translation",
    "support_mass",
    "membrane_tension",
    "support_stiffness",
    "thickness_profile",
    "outline_profile",
    "density_gradient",
    "stiffness_gradient",
    "grain_angle",
    "poisson_ratio",
)
OTHER_EFFECT_NAMES = {"air_loading": "fluid_loading"}
"""Accepted names of effects, each with the library's own name."""

LONGEST_NAME = 80
NAME_RULE = f"A-Z, a-z, 0-9, '.', '_' or '-', beginning with a letter or digit, at most {LONGEST_NAME} characters"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_RESERVED = {"CON", "PRN", "AUX", "NUL", *(f"{port}{n}" for port in ("COM", "LPT") for n in range(10))}
_UNIT = re.compile(r"_(mm|g|kg_m3|hz|gpa|percent|n_m)$")
_LONGEST_SHOWN = 60


def canonical_effect(word: str) -> str:
    """The library's name of an effect from any accepted name; any other word unchanged."""
    return OTHER_EFFECT_NAMES.get(word, word)


def name_complaint(name: str) -> str:
    """Why a name cannot become a file name on every system; empty if it can."""
    if not _NAME.fullmatch(name) or len(name) > LONGEST_NAME or name.endswith("."):
        return NAME_RULE
    if name.split(".")[0].upper() in _RESERVED:
        return "a name that no operating system reserves for a device"
    return ""


def quote_text(text: str) -> str:
    """A text in double quotes, shortened, with control and direction characters made visible."""
    short = text if len(text) <= _LONGEST_SHOWN else text[:_LONGEST_SHOWN] + "..."
    return '"' + printable(short).replace('"', '\\"') + '"'


def show_value(value: object) -> str:
    """A value from a card as a message shows it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return quote_text(value)
    if isinstance(value, int) and value.bit_length() > 200:
        return f"a whole number of {value.bit_length()} bits"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, dict):
        return (
            "an empty table" if not value else "a table with " + _join(printable(str(key)) for key in list(value)[:4])
        )
    if isinstance(value, list):
        return "an empty list" if not value else f"a list of {len(value)}"
    if isinstance(value, datetime | date | time):
        return "a date or time"
    return "nothing" if value is None else type(value).__name__


def _join(words: Iterable[str]) -> str:
    return ", ".join(word[:_LONGEST_SHOWN] for word in words)


def nearest_word(word: str, known_words: Iterable[str]) -> str:
    """The known word nearest to a misspelt one, or an empty text; a missing unit suffix does not count.

    A part that only one known word has stands for it: "shear" for transverse_shear.
    """
    if len(word) > _LONGEST_SHOWN:
        return ""
    candidates: dict[str, str] = {}
    names = list(known_words)
    for name in names:
        candidates.setdefault(_UNIT.sub("", name), name)
        candidates[name] = name
    for spelling in (word, _UNIT.sub("", word)):
        close_matches = difflib.get_close_matches(spelling, candidates, n=1, cutoff=0.6)
        if close_matches:
            return candidates[close_matches[0]]
    word_parts = _name_parts(word)
    matches = [name for name in names if word_parts and word_parts <= _name_parts(name)]
    return matches[0] if len(matches) == 1 else ""


def _name_parts(name: str) -> set[str]:
    return set(re.split(r"[-_ ]+", name.casefold())) - {""}


def did_you_mean(word: str, known_words: Iterable[str]) -> str:
    """A remedy that names the nearest known word; empty if none is near."""
    name = nearest_word(word, known_words)
    return f"did you mean {name}?" if name else ""


def list_words(words: Iterable[str]) -> str:
    """Words in quotes: "a", "b" or "c"."""
    *most, last = (f'"{word}"' for word in words)
    return f"{', '.join(most)} or {last}" if most else last


def setup_places(file: str, names: Sequence[str]) -> list[str]:
    """Place of each setup on a card: "my-board.toml [setup]", 'my-board.toml [[setup]] 2 "free"'."""
    if len(names) == 1:
        return [f"{file} [setup]"]
    return [f'{file} [[setup]] {number} "{name}"' for number, name in enumerate(names, start=1)]
