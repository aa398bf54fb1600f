"""The figure of the null control: where the board stands among simulated boards that lack nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.diagnosis.result import Diagnosis, Histogram, NullControlSummary
from bayesplate.report.colours import BLUE, DARK, LIGHT, VERMILLION
from bayesplate.report.style import SMALL, Picture, legend_below, stacked

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_HEIGHT = 1.05
_FEWEST_TICKS, _MOST_TICKS, _MOST_ZEROS = 4, 5, 3


@dataclass(frozen=True)
class _Row:
    """What simulated boards gave, what this one gives, and the limit between."""

    sets: Histogram
    board: float
    limit: float
    words: str
    axis: str
    shown: Callable[[float], str] = "{:.3g}".format


def null_picture(diagnosis: Diagnosis) -> Picture | None:
    """The odds that something is lacking and the error with what is chosen, on simulated boards and on this one."""
    rows = _rows(diagnosis.null_control)
    if not rows:
        return None
    figure, panels = stacked([_HEIGHT] * len(rows), top=0.22, gap=0.7, bottom=0.75)
    for panel, row in zip(panels, rows, strict=True):
        _draw(panel, row)
    _as_odds(panels[0])
    legend_below(figure, 2)
    caption = (
        f"{diagnosis.null_control.n_sets} boards like this one that lack nothing were simulated, and searched as this "
        f"one was. Grey: what came out of them.{' Above, the' if len(rows) > 1 else ' The'} odds that something is "
        "lacking: beyond the dashed line, where few of them lie, an effect is needed."
    )
    if len(rows) > 1:
        caption += (
            f" Below, by how much an effect that {sum(rows[1].sets.counts)} of them were made to choose changes the "
            "error of modes that are left out: a claim needs a smaller ratio than nearly all of them have by chance."
        )
    alt = "; ".join(f"{row.axis}: this board {row.shown(row.board)}, limit {row.shown(row.limit)}" for row in rows)
    return Picture("null-control", "This board among boards that lack nothing", alt, caption, figure)


def _rows(null: NullControlSummary) -> list[_Row]:
    found = []
    if null.log_odds_of_sets is not None and null.log_odds is not None:
        words, axis = "needed beyond", "odds that something is lacking"
        found.append(_Row(null.log_odds_of_sets, null.log_odds, null.log_odds_needed, words, axis, _odds))
    if null.nested_ratio_of_sets and null.nested_ratio is not None and null.nested_ratio_to_beat is not None:
        words, axis = "claimed below", "left-out error with the chosen effect over that without"
        found.append(_Row(null.nested_ratio_of_sets, null.nested_ratio, null.nested_ratio_to_beat, words, axis))
    return found


def _draw(panel: Axes, row: _Row) -> None:
    counts, edges = row.sets.counts, np.array(row.sets.edges)
    panel.stairs(counts, edges, fill=True, color=LIGHT, label="simulated boards that lack nothing")
    panel.stairs(counts, edges, color=DARK, lw=0.6)
    panel.axvline(row.board, color=BLUE, lw=2.0, label="this board")
    panel.axvline(row.limit, color=VERMILLION, lw=1.2, ls="--")
    panel.set_title(f"dashed: {row.words}", loc="right", fontsize=SMALL, color=VERMILLION)
    panel.set(xlabel=row.axis, ylabel="boards", ylim=(0.0, 1.25 * max(counts)))


def _as_odds(panel: Axes) -> None:
    """Natural logarithms as people read odds."""
    low, high = panel.get_xlim()
    decades = np.arange(np.ceil(low / np.log(10.0)), np.floor(high / np.log(10.0)) + 1.0)
    if decades.size >= _FEWEST_TICKS:
        marked = decades[decades % np.ceil(decades.size / _MOST_TICKS) == 0]
        panel.set_xticks(np.log(10.0) * marked, [_odds_of_ten(int(power)) for power in marked])
        return
    odds = np.array([one * power for power in (0.01, 0.1, 1.0, 10.0, 100.0) for one in (1.0, 1.0 / 0.3)])
    odds = odds[(np.log(odds) >= low) & (np.log(odds) <= high)]
    panel.set_xticks(np.log(odds), [f"{one:.0f} : 1" if one >= 1.0 else f"1 : {1.0 / one:.0f}" for one in odds])


def _odds(log_odds: float) -> str:
    """Odds in words for those who do not see the axis, from their natural logarithm."""
    power = abs(log_odds) / np.log(10.0)
    number = f"{10.0**power:.3g}" if power <= _MOST_ZEROS else f"10^{power:.0f}"
    return f"{number} : 1" if log_odds >= 0.0 else f"1 : {number}"


def _odds_of_ten(power: int) -> str:
    """A power of ten as odds: in figures as far as they are read at a glance."""
    number = str(10 ** abs(power)) if abs(power) <= _MOST_ZEROS else f"$10^{{{abs(power)}}}$"
    return f"{number} : 1" if power >= 0 else f"1 : {number}"
