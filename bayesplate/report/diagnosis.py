"""Figures of a diagnosis: what each effect would do, the error before and after, and the null control."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.diagnosis.result import Diagnosis, EffectEntry, Histogram, NullControlSummary
from bayesplate.diagnosis.words import MERITS, names_of
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREY,
    LIGHT,
    ORANGE,
    SKY,
    SMALL,
    VERMILLION,
    Picture,
    heading,
    in_figure,
    in_rows,
    legend_below,
    name_rows,
    stacked,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_ROW = 0.34


def signatures_picture(diagnosis: Diagnosis) -> Picture | None:
    """How much each candidate would shift the modes, and how much of that could be seen; None without candidates."""
    effects = [one for one in diagnosis.candidates if isinstance(one, EffectEntry)]
    shown = [one for one in effects if one.visible_rms_cents is not None]
    if not shown:
        return None
    names = names_of(shown)
    figure, panel = in_rows([name[:30] for name in names], row=_ROW, left=1.75, bottom=0.78)
    rows = np.arange(len(shown))
    raw = np.array([one.raw_rms_cents or 0.0 for one in shown])
    visible = np.array([one.visible_rms_cents for one in shown])
    panel.barh(rows - 0.18, raw, height=0.32, color=SKY, hatch="///", edgecolor="white", lw=0, label="in all")
    panel.barh(rows + 0.18, visible, height=0.32, color=BLUE, label="visible, after the constants are fitted again")
    for row, one in zip(rows, shown, strict=True):
        if one.below_detection_limit:
            panel.text(visible[row], row + 0.18, " lost in noise", fontsize=SMALL - 1, va="center", color=DARK)
    panel.set(xlabel="shift of the modes at a usual size, rms cents")
    legend_below(figure, 1)
    told = "; ".join(
        f"{name} {a:.0f} cents, of which {b:.1f} visible" for name, a, b in zip(names, raw, visible, strict=True)
    )
    caption = (
        "An effect shifts the modes, but most of that shift looks like other constants. Only what is left after the "
        "constants have been fitted again can give it away; the rest goes into the constants unseen."
    )
    return Picture("signatures", "What each effect would do", f"{told}.", caption, figure)


def before_after_picture(diagnosis: Diagnosis) -> Picture | None:
    """Error before and after, and the shift of each constant; None where nothing was added."""
    if not diagnosis.is_refitted:
        return None
    before, after = diagnosis.before, diagnosis.after
    drawn = [one for one in MERITS if one.is_rms and (one.of(before) is not None or one.of(after) is not None)]
    shifts = {name: one.shift_in_sd for name, one in diagnosis.elastic_shift.items()}
    heights = [_ROW * len(drawn) + 0.1, 0.25 * len(shifts) + 0.1]
    figure, panels = stacked(heights, left=1.75, top=0.3, bottom=0.75, gap=0.85)
    rows = np.arange(len(drawn))
    hatched: Any = {"color": GREY, "hatch": "///", "edgecolor": "white", "label": "before"}
    plain: Any = {"color": BLUE, "label": "after"}
    for offset, errors, style in ((-0.18, before, hatched), (0.18, after, plain)):
        values = np.array([one.of(errors) for one in drawn], dtype=float)
        panels[0].barh(rows + offset, values, height=0.32, lw=0, **style)
    name_rows(panels[0], [one.words for one in drawn])
    heading(panels[0], "Error of the frequencies")
    panels[0].set(xlabel="error, rms cents")
    rows, values = np.arange(len(shifts)), np.array(list(shifts.values()))
    panels[1].hlines(rows, 0, values, color=ORANGE, lw=4)
    panels[1].plot(values, rows, "o", color=VERMILLION, mec="black", mew=0.6, ms=6)
    panels[1].axvline(0, color=DARK, lw=0.8)
    reach = max(1.2, 1.15 * float(np.abs(values).max()))
    name_rows(panels[1], [in_figure(name) for name in shifts], parse_math=True)
    heading(panels[1], "Shift of the constants")
    panels[1].set(xlim=(-reach, reach), xlabel="standard deviations")
    legend_below(figure, 2)
    told = "; ".join(f"{one.words}: {_cents(one.of(before))} before, {_cents(one.of(after))} after" for one in drawn)
    moved = "; ".join(f"{name} by {value:+.1f} sd" for name, value in shifts.items())
    alt = f"Error {told}. The constants move: {moved}."
    caption = "The first error falls with any effect that is added."
    if after.nested_leave_one_out_rms_cents is not None:
        caption += " The last is the honest one: each mode is left out of the search as well as of the fit."
    return Picture("before-after", "Error before and after, and what it does to the constants", alt, caption, figure)


def _cents(value: float | None) -> str:
    return "not known" if value is None else f"{value:.1f} cents"


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
        _draw_sets(panel, row)
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


def _draw_sets(panel: Axes, row: _Row) -> None:
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
