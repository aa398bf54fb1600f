"""Figures of a plan: what each proposal is expected to give, and the sheet for the bench."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.board.material import MODULI
from bayesplate.campaign.tables import shared_words
from bayesplate.planning.bench import Bench
from bayesplate.planning.plan import Plan, ProposalEntry
from bayesplate.report.chladni import chladni_sheet
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREEN,
    LIGHT,
    ORANGE,
    SKY,
    SMALL,
    VERMILLION,
    Picture,
    drawable,
    heading,
    in_figure,
    legend_below,
    placed,
)
from bayesplate.results.words import percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST = 10
"""Proposals that are drawn."""
_ROW, _LEFT, _PANEL, _GAP, _TOP, _BOTTOM = 0.56, 3.1, 2.3, 0.35, 0.45, 0.95
_STYLES = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "D"), (VERMILLION, "v"))
_LINE = 46


def gains_picture(plan: Plan) -> Picture:
    """Doubt that goes and intervals that are left, proposal by proposal; of a campaign those of what boards share."""
    from matplotlib.figure import Figure

    shown = plan.proposals[:MOST]
    in_doubt = plan.entropy > 0.0 and len(plan.explanations) > 1
    inner = _ROW * max(len(shown), 1)
    figure = Figure(figsize=(_LEFT + (1 + in_doubt) * (_PANEL + _GAP), _TOP + inner + _BOTTOM))
    for i, draw in enumerate([_doubt, _intervals] if in_doubt else [_intervals]):
        panel = placed(figure, _LEFT + i * (_PANEL + _GAP), _BOTTOM, _PANEL, inner)
        panel.set(ylim=(len(shown) - 0.5, -0.5), yticks=[])
        panel.spines["left"].set_visible(False)
        for row in range(0, len(shown), 2):
            panel.axhspan(row - 0.5, row + 0.5, color=LIGHT, alpha=0.5, lw=0, zorder=0)
        draw(panel, plan, shown)
    first = figure.axes[0]
    for row, one in enumerate(shown):
        first.text(
            -0.03, row, _label(one), transform=first.get_yaxis_transform(), ha="right", va="center",
            fontsize=SMALL - 0.5, linespacing=1.15, parse_math=False,
        )  # fmt: skip
    legend_below(figure, 3)
    told = "; ".join(f"{one.sentence}: {_told(one, plan.entropy)}" for one in shown)
    caption = (
        "The best first. An interval at 50 % is half as wide as now. Doubt at 100 % would be gone: one explanation "
        "would be left."
    )
    return Picture("plan", f"What to measure next: {plan.name}", f"{told}.", caption, figure)


def _doubt(axes: Axes, plan: Plan, shown: Sequence[ProposalEntry]) -> None:
    share = 100.0 / plan.entropy
    values = np.array([share * max(one.gain.explanations or 0.0, 0.0) for one in shown])
    errors = np.array([share * (one.gain.explanations_error or 0.0) for one in shown])
    rows = np.arange(len(shown))
    axes.barh(rows, values, height=0.5, color=SKY, edgecolor="white", zorder=2)
    axes.errorbar(values, rows, xerr=2.0 * errors, fmt="none", ecolor=DARK, elinewidth=1.0, capsize=2, zorder=3)
    axes.set(xlim=(0, 100), xlabel="doubt falls by, %")
    heading(axes, "Telling explanations apart")


def _intervals(axes: Axes, plan: Plan, shown: Sequence[ProposalEntry]) -> None:
    shared = list(shown[0].gain.shared) if shown else []
    names = shared or list(MODULI)
    for i, name in enumerate(names):
        values = [100.0 * (one.gain.shared[name] if shared else getattr(one.gain, name)) for one in shown]
        rows = np.arange(len(shown)) + 0.18 * (i - 0.5 * (len(names) - 1))
        colour, mark = _STYLES[i % len(_STYLES)]
        axes.hlines(rows, values, 100.0, color=colour, lw=1.0, zorder=2)
        words = drawable(shared_words(name)) if shared else in_figure(name)
        axes.plot(values, rows, mark, color=colour, mec="black", mew=0.5, ms=5, zorder=3, label=words)
    axes.set(xlim=(0, 103), xlabel="interval after, % of now")
    axes.axvline(100.0, color=DARK, lw=0.8)
    heading(axes, "What the boards share" if shared else "Narrowing the constants")


def _label(one: ProposalEntry) -> str:
    """The sentence in at most three short lines, and the minutes."""
    lines = textwrap.wrap(drawable(one.sentence), _LINE)
    if len(lines) > 3:
        lines = [*lines[:2], lines[2][: _LINE - 2] + "…"]
    lines[-1] += f" [{one.cost_minutes:g} min]"
    return "\n".join(lines)


def _told(one: ProposalEntry, entropy: float) -> str:
    gain = one.gain
    told = gain.explanations is not None and entropy > 0.0
    doubt = f"doubt falls by {percent((gain.explanations or 0.0) / entropy)}, " if told else ""
    left = ", ".join(f"{name} {percent(getattr(gain, name))}" for name in MODULI)
    return f"{doubt}intervals shrink to {left} of now, in {one.cost_minutes:g} minutes"


def bench_sheet(bench: Bench) -> Figure:
    """The sheet of one way to hold the board: A4 upright, one panel a mode in the order of frequency."""
    return chladni_sheet(bench.sheet, bench.placing)
