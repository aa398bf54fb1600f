"""Figures of a diagnosis: signatures of the effects, error before and after, and the null control."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.diagnosis.result import Diagnosis, EffectEntry, Histogram, NullControlSummary
from bayesplate.diagnosis.words import MERITS, candidate_names
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREY,
    LIGHT,
    ORANGE,
    SKY,
    SMALL_SIZE,
    VERMILLION,
    Picture,
    draw_heading,
    draw_legend,
    mathtext,
    name_rows,
    panel_with_rows,
    stacked_panels,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_ROW_HEIGHT = 0.34


def signatures_picture(diagnosis: Diagnosis) -> Picture | None:
    """Shift of the modes by each candidate effect, and its visible part; None without candidates."""
    entries = [entry for entry in diagnosis.candidates if isinstance(entry, EffectEntry)]
    effects = [entry for entry in entries if entry.visible_rms_cents is not None]
    if not effects:
        return None
    names = candidate_names(effects)
    figure, panel = panel_with_rows([name[:30] for name in names], row=_ROW_HEIGHT, left=1.75, bottom=0.78)
    rows = np.arange(len(effects))
    raw = np.array([effect.raw_rms_cents or 0.0 for effect in effects])
    visible = np.array([effect.visible_rms_cents for effect in effects])
    panel.barh(rows - 0.18, raw, height=0.32, color=SKY, hatch="///", edgecolor="white", lw=0, label="in all")
    panel.barh(rows + 0.18, visible, height=0.32, color=BLUE, label="visible, after the constants are fitted again")
    for row, effect in zip(rows, effects, strict=True):
        if effect.below_detection_limit:
            panel.text(visible[row], row + 0.18, " lost in noise", fontsize=SMALL_SIZE - 1, va="center", color=DARK)
    panel.set(xlabel="shift of the modes at a usual size, rms cents")
    draw_legend(figure, 1)
    details = "; ".join(
        f"{name} {a:.0f} cents, of which {b:.1f} visible" for name, a, b in zip(names, raw, visible, strict=True)
    )
    caption = (
        "An effect shifts the modes, but most of that shift looks like other constants. Only what is left after the "
        "constants have been fitted again can give it away; the rest goes into the constants unseen."
    )
    return Picture("signatures", "What each effect would do", f"{details}.", caption, figure)


def before_after_picture(diagnosis: Diagnosis) -> Picture | None:
    """Error before and after, and the shift of each constant; None where no effect was added."""
    if not diagnosis.is_refitted:
        return None
    before, after = diagnosis.before, diagnosis.after
    merits = [
        merit
        for merit in MERITS
        if merit.is_rms and (merit.value_of(before) is not None or merit.value_of(after) is not None)
    ]
    shifts = {name: shift.shift_in_sd for name, shift in diagnosis.elastic_shift.items()}
    heights = [_ROW_HEIGHT * len(merits) + 0.1, 0.25 * len(shifts) + 0.1]
    figure, panels = stacked_panels(heights, left=1.75, top=0.3, bottom=0.75, gap=0.85)
    rows = np.arange(len(merits))
    before_style: Any = {"color": GREY, "hatch": "///", "edgecolor": "white", "label": "before"}
    after_style: Any = {"color": BLUE, "label": "after"}
    for offset, errors, style in ((-0.18, before, before_style), (0.18, after, after_style)):
        values = np.array([merit.value_of(errors) for merit in merits], dtype=float)
        panels[0].barh(rows + offset, values, height=0.32, lw=0, **style)
    name_rows(panels[0], [merit.words for merit in merits])
    draw_heading(panels[0], "Error of the frequencies")
    panels[0].set(xlabel="error, rms cents")
    rows, values = np.arange(len(shifts)), np.array(list(shifts.values()))
    panels[1].hlines(rows, 0, values, color=ORANGE, lw=4)
    panels[1].plot(values, rows, "o", color=VERMILLION, mec="black", mew=0.6, ms=6)
    panels[1].axvline(0, color=DARK, lw=0.8)
    reach = max(1.2, 1.15 * float(np.abs(values).max()))
    name_rows(panels[1], [mathtext(name) for name in shifts], parse_math=True)
    draw_heading(panels[1], "Shift of the constants")
    panels[1].set(xlim=(-reach, reach), xlabel="standard deviations")
    draw_legend(figure, 2)
    details = "; ".join(
        f"{merit.words}: {_cents_text(merit.value_of(before))} before, {_cents_text(merit.value_of(after))} after"
        for merit in merits
    )
    shift_texts = "; ".join(f"{name} by {value:+.1f} sd" for name, value in shifts.items())
    alt = f"Error {details}. The constants move: {shift_texts}."
    caption = "The first error mostly falls with whatever effect is added."
    if after.nested_leave_one_out_rms_cents is not None:
        caption += " The last is the honest one: each mode is left out of the search as well as of the fit."
    return Picture("before-after", "Error before and after, and what it does to the constants", alt, caption, figure)


def _cents_text(value: float | None) -> str:
    return "not known" if value is None else f"{value:.1f} cents"


_PANEL_HEIGHT = 1.05
_FEWEST_TICKS, _MOST_TICKS, _MOST_ZEROS = 4, 5, 3


@dataclass(frozen=True)
class _NullStatistic:
    """A statistic on the simulated boards and on this board, and the limit that decides."""

    sets: Histogram
    board: float
    limit: float
    title: str
    axis: str
    format_value: Callable[[float], str] = "{:.3g}".format


def null_picture(diagnosis: Diagnosis) -> Picture | None:
    """Odds that an effect is lacking, and ratio of leave-one-out errors, on simulated boards and on this board."""
    statistics = _null_statistics(diagnosis.null_control)
    if not statistics:
        return None
    figure, panels = stacked_panels([_PANEL_HEIGHT] * len(statistics), top=0.22, gap=0.7, bottom=0.75)
    for panel, statistic in zip(panels, statistics, strict=True):
        _draw_null_histogram(panel, statistic)
    _set_odds_ticks(panels[0])
    draw_legend(figure, 2)
    caption = (
        f"{diagnosis.null_control.n_sets} boards like this one that lack nothing were simulated, and searched as this "
        f"one was. Grey: what came out of them.{' Above, the' if len(statistics) > 1 else ' The'} odds that something "
        "is lacking: beyond the dashed line, where few of them lie, an effect is needed."
    )
    if len(statistics) > 1:
        caption += (
            f" Below, by how much an effect that {sum(statistics[1].sets.counts)} of them were made to choose changes "
            "the error of modes that are left out: a claim needs a smaller ratio than nearly all of them have by "
            "chance."
        )
    alt = "; ".join(
        f"{statistic.axis}: this board {statistic.format_value(statistic.board)}, "
        f"limit {statistic.format_value(statistic.limit)}"
        for statistic in statistics
    )
    return Picture("null-control", "This board among boards that lack nothing", alt, caption, figure)


def _null_statistics(null_control: NullControlSummary) -> list[_NullStatistic]:
    statistics = []
    if null_control.log_odds_of_sets is not None and null_control.log_odds is not None:
        words, axis = "needed beyond", "odds that something is lacking"
        statistics.append(
            _NullStatistic(
                null_control.log_odds_of_sets,
                null_control.log_odds,
                null_control.log_odds_needed,
                words,
                axis,
                _odds_text,
            )
        )
    if (
        null_control.nested_ratio_of_sets
        and null_control.nested_ratio is not None
        and null_control.nested_ratio_to_beat is not None
    ):
        words, axis = "claimed below", "leave-one-out error with the chosen effect over that without"
        statistics.append(
            _NullStatistic(
                null_control.nested_ratio_of_sets,
                null_control.nested_ratio,
                min(null_control.nested_ratio_to_beat, 1.0),  # a rising error is never claimed
                words,
                axis,
            )
        )
    return statistics


def _draw_null_histogram(panel: Axes, statistic: _NullStatistic) -> None:
    counts, edges = statistic.sets.counts, np.array(statistic.sets.edges)
    panel.stairs(counts, edges, fill=True, color=LIGHT, label="simulated boards that lack nothing")
    panel.stairs(counts, edges, color=DARK, lw=0.6)
    panel.axvline(statistic.board, color=BLUE, lw=2.0, label="this board")
    panel.axvline(statistic.limit, color=VERMILLION, lw=1.2, ls="--")
    panel.set_title(f"dashed: {statistic.title}", loc="right", fontsize=SMALL_SIZE, color=VERMILLION)
    panel.set(xlabel=statistic.axis, ylabel="boards", ylim=(0.0, 1.25 * max(counts)))


def _set_odds_ticks(panel: Axes) -> None:
    """Label an axis of natural log odds with odds."""
    low, high = panel.get_xlim()
    decades = np.arange(np.ceil(low / np.log(10.0)), np.floor(high / np.log(10.0)) + 1.0)
    if decades.size >= _FEWEST_TICKS:
        powers = decades[decades % np.ceil(decades.size / _MOST_TICKS) == 0]
        panel.set_xticks(np.log(10.0) * powers, [_decade_odds_text(int(power)) for power in powers])
        return
    odds = np.array([step * power for power in (0.01, 0.1, 1.0, 10.0, 100.0) for step in (1.0, 1.0 / 0.3)])
    odds = odds[(np.log(odds) >= low) & (np.log(odds) <= high)]
    panel.set_xticks(np.log(odds), [f"{ratio:.0f} : 1" if ratio >= 1.0 else f"1 : {1.0 / ratio:.0f}" for ratio in odds])


def _odds_text(log_odds: float) -> str:
    """Odds as a text, for the alternative text, from their natural logarithm."""
    power = abs(log_odds) / np.log(10.0)
    number = f"{10.0**power:.3g}" if power <= _MOST_ZEROS else f"10^{power:.0f}"
    return f"{number} : 1" if log_odds >= 0.0 else f"1 : {number}"


def _decade_odds_text(power: int) -> str:
    """Odds of a power of ten, in digits up to a thousand."""
    number = str(10 ** abs(power)) if abs(power) <= _MOST_ZEROS else f"$10^{{{abs(power)}}}$"
    return f"{number} : 1" if power >= 0 else f"1 : {number}"
