"""Figures of a plan: the expected gain of each proposal, and the bench sheet."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.board.material import MODULI
from bayesplate.campaign.tables import shared_words
from bayesplate.planning.bench import Bench
from bayesplate.planning.plan import Plan, ProposalEntry
from bayesplate.planning.tables import shared_names
from bayesplate.report.chladni import chladni_sheet
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREEN,
    LIGHT,
    ORANGE,
    SKY,
    SMALL_SIZE,
    VERMILLION,
    Picture,
    draw_heading,
    draw_legend,
    drawable_text,
    mathtext,
    place_panel,
)
from bayesplate.results.words import percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST_DRAWN_PROPOSALS = 10
"""Proposals that are drawn."""
_ROW, _LEFT, _PANEL, _GAP, _TOP, _BOTTOM = 0.56, 3.1, 2.3, 0.35, 0.45, 0.95
_STYLES = ((BLUE, "o"), (ORANGE, "s"), (GREEN, "D"), (VERMILLION, "v"))
_LINE_LENGTH = 46


def gains_picture(plan: Plan) -> Picture:
    """Expected fall of doubt and narrowing of intervals by proposal; in a campaign, intervals of shared numbers."""
    from matplotlib.figure import Figure

    proposals = plan.proposals[:MOST_DRAWN_PROPOSALS]
    in_doubt = plan.entropy > 0.0 and len(plan.explanations) > 1
    rows_height = _ROW * max(len(proposals), 1)
    figure = Figure(figsize=(_LEFT + (1 + in_doubt) * (_PANEL + _GAP), _TOP + rows_height + _BOTTOM))
    for i, draw in enumerate([_draw_doubt, _draw_intervals] if in_doubt else [_draw_intervals]):
        panel = place_panel(figure, _LEFT + i * (_PANEL + _GAP), _BOTTOM, _PANEL, rows_height)
        panel.set(ylim=(len(proposals) - 0.5, -0.5), yticks=[])
        panel.spines["left"].set_visible(False)
        for row in range(0, len(proposals), 2):
            panel.axhspan(row - 0.5, row + 0.5, color=LIGHT, alpha=0.5, lw=0, zorder=0)
        draw(panel, plan, proposals)
    first_panel = figure.axes[0]
    for row, proposal in enumerate(proposals):
        first_panel.text(
            -0.03, row, _proposal_label(proposal), transform=first_panel.get_yaxis_transform(), ha="right", va="center",
            fontsize=SMALL_SIZE - 0.5, linespacing=1.15, parse_math=False,
        )  # fmt: skip
    draw_legend(figure, 3)
    details = "; ".join(f"{proposal.sentence}: {_gain_text(proposal, plan.entropy)}" for proposal in proposals)
    caption = (
        "The best first. An interval at 50 % is half as wide as now. Doubt at 100 % would be gone: one explanation "
        "would be left."
    )
    return Picture("plan", f"What to measure next: {plan.name}", f"{details}.", caption, figure)


def _draw_doubt(panel: Axes, plan: Plan, proposals: Sequence[ProposalEntry]) -> None:
    share = 100.0 / plan.entropy
    values = np.array([share * max(proposal.gain.explanations or 0.0, 0.0) for proposal in proposals])
    errors = np.array([share * (proposal.gain.explanations_error or 0.0) for proposal in proposals])
    rows = np.arange(len(proposals))
    panel.barh(rows, values, height=0.5, color=SKY, edgecolor="white", zorder=2)
    panel.errorbar(values, rows, xerr=2.0 * errors, fmt="none", ecolor=DARK, elinewidth=1.0, capsize=2, zorder=3)
    panel.set(xlim=(0, 100), xlabel="doubt falls by, %")
    draw_heading(panel, "Telling explanations apart")


def _draw_intervals(panel: Axes, plan: Plan, proposals: Sequence[ProposalEntry]) -> None:
    shared = shared_names(plan)
    names = shared or MODULI
    for i, name in enumerate(names):
        values = [
            100.0 * (proposal.gain.shared[name] if shared else getattr(proposal.gain, name)) for proposal in proposals
        ]
        rows = np.arange(len(proposals)) + 0.18 * (i - 0.5 * (len(names) - 1))
        colour, marker = _STYLES[i % len(_STYLES)]
        panel.hlines(rows, values, 100.0, color=colour, lw=1.0, zorder=2)
        words = drawable_text(shared_words(name)) if shared else mathtext(name)
        panel.plot(values, rows, marker, color=colour, mec="black", mew=0.5, ms=5, zorder=3, label=words)
    panel.set(xlim=(0, 103), xlabel="interval after, % of now")
    panel.axvline(100.0, color=DARK, lw=0.8)
    draw_heading(panel, "What the boards share" if shared else "Narrowing the constants")


def _proposal_label(proposal: ProposalEntry) -> str:
    """The sentence of a proposal in at most three short lines, with its minutes."""
    lines = textwrap.wrap(drawable_text(proposal.sentence), _LINE_LENGTH)
    if len(lines) > 3:
        lines = [*lines[:2], lines[2][: _LINE_LENGTH - 2] + "…"]
    lines[-1] += f" [{proposal.cost_minutes:g} min]"
    return "\n".join(lines)


def _gain_text(proposal: ProposalEntry, entropy: float) -> str:
    gain = proposal.gain
    has_doubt = gain.explanations is not None and entropy > 0.0
    doubt = f"doubt falls by {percent((gain.explanations or 0.0) / entropy)}, " if has_doubt else ""
    intervals = ", ".join(f"{name} {percent(getattr(gain, name))}" for name in MODULI)
    return f"{doubt}intervals shrink to {intervals} of now, in {proposal.cost_minutes:g} minutes"


def bench_sheet(bench: Bench) -> Figure:
    """The bench sheet of a setup: A4 upright, one panel per mode in the order of frequency."""
    return chladni_sheet(bench.sheet, bench.placing)
