"""Figures to files: complete or absent, and the same bytes for the same figure."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DOTS_PER_INCH = 200


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure by the ending of its path, PNG or SVG, without a time stamp.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    path : Path
    """
    from matplotlib import rc_context

    ending = path.suffix.removeprefix(".")
    metadata = {"Date": None} if ending == "svg" else {}
    partial = path.with_name(path.name + ".partial")
    try:
        with rc_context({"svg.hashsalt": "bayesplate"}):
            figure.savefig(partial, format=ending, dpi=_DOTS_PER_INCH, metadata=metadata)
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)
