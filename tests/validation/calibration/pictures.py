"""Ranks as a picture: how far the distribution of each quantity is from the uniform one, and the band for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from validation.calibration.bands import band, band_p_value
from validation.calibration.records import Record
from validation.calibration.sbc import N_DRAWS
from validation.calibration.table import FAMILY_LEVEL, NOT_COUNTED

from bayesplate.report.style import (
    BLACK,
    BLUE,
    GREEN,
    LIGHT,
    ORANGE,
    PURPLE,
    SKY,
    SMALL_SIZE,
    TEXT_SIZE,
    VERMILLION,
    plain_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PRODUCTION = "production"
ALT = (
    "For each quantity the share of truths below a rank, less the share expected, and for wrong posteriors, dashed; "
    "in grey the band that all lines of a right one stay in together 19 times of 20"
)
_COLOURS = (VERMILLION, ORANGE, GREEN, PURPLE, SKY, BLACK)

Ranks = Sequence[Mapping[str, int]]


def draw(records: Sequence[Record], path: Path) -> None:
    """Draw what a part found, a panel per board where it has several; nothing where it has no ranks."""
    from matplotlib.figure import Figure

    good = [record for record in records if "ranks" in record]
    boards = list(dict.fromkeys(record.get("board", "") for record in good))
    if not good:
        return
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    for panel, board in zip(figure.subplots(1, len(boards), squeeze=False, sharey=True)[0], boards, strict=True):
        _panel(panel, [record["ranks"] for record in good if record.get("board", "") == board])
        panel.set_title(board, fontsize=TEXT_SIZE)
    figure.axes[0].set_ylabel("share of truths below it,\nless the expected one", fontsize=SMALL_SIZE)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=1, fontsize=SMALL_SIZE, frameon=False)
    figure.savefig(path, dpi=150, metadata={"Software": None})


def _panel(panel: Axes, every: Sequence[Mapping[str, Mapping[str, int]]]) -> None:
    production = [one[PRODUCTION] for one in every]
    shares = np.arange(1, N_DRAWS + 1) / (N_DRAWS + 1)
    names = list(production[0])
    low, high = band(len(production), N_DRAWS, FAMILY_LEVEL / len(names))
    panel.fill_between(shares, low - shares, high - shares, color=LIGHT, label="band for all lines together, 95 %")
    for name in names:
        told = f"each of {len(names)} quantities, {len(production)} simulations" if name == names[0] else None
        panel.plot(shares, _distribution(production, name) - shares, color=BLUE, lw=0.8, label=told)
    mutants = dict.fromkeys(kind for one in every for kind in one if kind != PRODUCTION)
    for kind, colour in zip(mutants, _COLOURS, strict=False):
        ranks = [one[kind] for one in every if kind in one]
        worst = min((name for name in ranks[0] if name not in NOT_COUNTED.get(kind, ())), key=lambda n: _p(ranks, n))
        told = f"{kind}: the quantity that tells most, {len(ranks)} simulations"
        panel.plot(shares, _distribution(ranks, worst) - shares, color=colour, lw=1.0, ls="--", label=told)
    reach = 2.5 * float(np.max(high - shares))
    panel.set(xlim=(0.0, 1.0), ylim=(-reach, reach))
    panel.set_xlabel("rank of the truth among the draws, share", fontsize=SMALL_SIZE)
    plain_axes(panel)


def _distribution(ranks: Ranks, name: str) -> NDArray[np.float64]:
    """Share of truths with a rank below each of 1 to N_DRAWS: (N_DRAWS,) array."""
    counts = np.bincount([one[name] for one in ranks], minlength=N_DRAWS + 1)
    return np.asarray(counts.cumsum()[:-1] / len(ranks))


def _p(ranks: Ranks, name: str) -> float:
    return band_p_value(np.array([one[name] for one in ranks]), N_DRAWS)
