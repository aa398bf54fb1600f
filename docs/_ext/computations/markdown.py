"""Markdown from rows and figures."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

WIDTH = 4.8
"""Inches: on a phone a point of such a figure is about a pixel."""
WORDS = 9.0
BLUE, ORANGE, GREEN, VERMILLION, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "0.6"
"""Okabe and Ito's colours: told apart by every eye."""


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; the first column to the left, numbers to the right."""
    marks = [":--", *["--:"] * (len(columns) - 1)]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (columns, marks, *rows)) + "\n"


def words_table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of words: every column to the left."""
    marks = [":--"] * len(columns)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (columns, marks, *rows)) + "\n"


def figure(drawn: Any, folder: Path, name: str, alt: str) -> str:
    """Save a figure beside the others, and show it."""
    from matplotlib import rc_context

    with rc_context({"svg.hashsalt": "bayesplate"}):
        drawn.savefig(folder / f"{name}.svg", metadata={"Date": None})
    return picture(f"{name}.svg", alt)


def picture(file: str, alt: str) -> str:
    """Show a file of the folder of pictures."""
    return f"```{{image}} /_generated/pictures/{file}\n:alt: {alt}\n:class: computed\n```\n"


def empty_figure(height: float, n_panels: int = 1) -> tuple[Any, Any]:
    """A figure of the usual width, and its panels."""
    from matplotlib import rcParams
    from matplotlib.figure import Figure

    rcParams["svg.fonttype"] = "path"
    drawn = Figure(figsize=(WIDTH, height), layout="constrained")
    panels = drawn.subplots(1, n_panels, sharey=True, squeeze=False)[0]
    for panel in panels:
        panel.tick_params(labelsize=WORDS)
        panel.spines[["top", "right"]].set_visible(False)
    return drawn, panels


def plain(name: str) -> str:
    """The name of an effect in words."""
    return name.replace("_", " ").replace("-", " ")


def signed(value: float, digits: int = 1) -> str:
    """A number with its sign, a real minus, and no negative zero."""
    text = f"{value:+.{digits}f}"
    return text.lstrip("+-") if float(text) == 0 else text.replace("-", "−")
