"""The symbols of the constants as figures and pages set them: E_x becomes an E with a lowered x."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from markupsafe import Markup

_SYMBOL = re.compile(r"\b(E|G|D|L|nu)_(xy|xz|yz|x|y|s)\b")
_POWER = re.compile(r"(?<=[a-z])\^(-?\d)")
_TOGETHER = re.compile(r"(?<=[\d±]) (?=[±%])|(?<=±) (?=\d)")
_LETTERS = {"nu": ("ν", r"\nu")}


def in_figure(text: str) -> str:
    """A text of ours with its symbols as matplotlib's mathematics; a user's text must not come here."""
    return _SYMBOL.sub(lambda found: f"${_LETTERS.get(found[1], ('', found[1]))[1]}_{{{found[2]}}}$", text)


def is_symbol(name: str) -> bool:
    """Whether a name, its unit aside, is a symbol of ours and nothing else: such a text holds nothing of a user's."""
    return _SYMBOL.fullmatch(name.partition(",")[0]) is not None


def in_page(text: str) -> Markup:
    """A text as HTML, escaped: symbols with lowered indices, units with raised powers, 1.0 ± 0.1 in one line."""
    from markupsafe import Markup, escape

    together = _TOGETHER.sub("\N{NO-BREAK SPACE}", str(escape(text)))
    lowered = _SYMBOL.sub(
        lambda found: f"<i>{_LETTERS.get(found[1], (found[1],))[0]}</i><sub>{found[2]}</sub>", together
    )
    return Markup(_POWER.sub(r"<sup>\1</sup>", lowered))  # what was escaped, and tags of our own
