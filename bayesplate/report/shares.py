"""The figure of what each mode tells: its energy by constant, and how much the fit leans on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesplate.estimates.identifiability import Identifiability
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    ORANGE,
    SMALL,
    WORDS,
    Picture,
    in_figure,
    in_rows,
    legend_below,
    short,
)
from bayesplate.results.checking import CheckedMode, CheckReport
from bayesplate.results.modes import ModeRow
from bayesplate.results.summary import Summary
from bayesplate.results.words import mode_name

_STYLES = {
    "E_x": (BLUE, "", "bending along the grain, E_x"),
    "E_y": (ORANGE, "////", "bending across it, E_y"),
    "G_xy": (GREEN, "..", "twisting, G_xy"),
    "effects": (GREY, "xx", "effects"),
}
_OF_ISOTROPIC = {"E_x": (BLUE, "", "bending along x"), "E_y": (ORANGE, "////", "bending along y")}
_ROW = 0.27


def shares_picture(summary: Summary | CheckReport, found: Identifiability) -> Picture:
    """The energy of each mode by constant; what was found belongs to the modes of the summary."""
    modes: Sequence[ModeRow | CheckedMode] = summary.modes
    several = len({mode.setup for mode in modes}) > 1
    names = [mode_name(mode.label, short(mode.setup, 14), several=several) for mode in modes]
    left = 0.62 if not several else min(1.6, 0.3 + 0.075 * max(len(name) for name in names))
    shares = np.column_stack([found.shares, 1.0 - found.shares.sum(axis=1)])
    if np.abs(shares[:, 3]).max() < 0.005:
        shares = shares[:, :3]
    figure, panel = in_rows(names, row=_ROW, size=WORDS, left=left, right=0.75, top=0.28, bottom=0.98)
    rows = np.arange(len(modes))
    start = np.zeros(len(modes))
    styles = _STYLES | (_OF_ISOTROPIC if found.symmetry.is_isotropic else {})
    for share, (colour, hatch, label) in zip(shares.T, styles.values(), strict=False):
        wide = np.maximum(share, 0.0)
        panel.barh(
            rows, 100 * wide, left=100 * start, height=0.72, color=colour, hatch=hatch, edgecolor="white", lw=0.6,
            label=in_figure(label),
        )  # fmt: skip
        start = start + wide
    for row, words in [(-0.85, "leverage"), *((row, f"{one.leverage:.2f}") for row, one in enumerate(modes))]:
        panel.text(102, row, words, fontsize=SMALL, va="center", color=DARK, clip_on=False)
    panel.set(xlim=(0, 100), xlabel="energy of the mode, %")
    legend_below(figure, 2)
    return Picture("shares", "What each mode tells", _alt(names, found), _CAPTION, figure)


_CAPTION = (
    "A constant is well known if some mode has most of its energy in it. Leverage says how much of a mode's own "
    "reading stands in its prediction: near 1, nothing checks that reading."
)


def _alt(names: list[str], found: Identifiability) -> str:
    """The best witness of each constant."""
    told = []
    for constant, column in zip(("E_x", "E_y", "G_xy"), found.shares.T, strict=True):
        best = int(np.argmax(column))
        told.append(f"{constant}: most in mode {names[best]} with {min(100 * column[best], 100):.0f} %")
    return "Share of each constant in the energy of each mode. " + "; ".join(told) + "."
