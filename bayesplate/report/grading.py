"""grading.html: boards sorted by their constants, makers' figures, limits of a specification, matching pairs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.material import MODULI
from bayesplate.grading.boards import BatchSummary
from bayesplate.grading.figures import FIGURES, limit_text
from bayesplate.grading.matching import HALF_WIDTH_90, LEAST_MATCH_PROBABILITY, TARGET_THICKNESS, Grading
from bayesplate.grading.tables import MOST_LISTED, doubts_sentence, grading_tables, marked_name, rank_boards
from bayesplate.report.constants import modulus_title
from bayesplate.report.page import render_page, save_page
from bayesplate.report.saving import matplotlib_defaults
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    SKY,
    SMALL_SIZE,
    VERMILLION,
    Picture,
    draw_heading,
    draw_legend,
    draw_whisker,
    drawable_text,
    legend_entry,
    mathtext,
    name_rows,
    panel_with_rows,
    separate_places,
    shorten,
    stacked_panels,
)
from bayesplate.results.folder import GRADING_PAGE, PAGE_FILE
from bayesplate.results.tables import Table
from bayesplate.results.words import percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes


MOST_NAMED_ROWS = 30
"""Most boards that are drawn in named rows; more are drawn by rank, without names."""
_ROW, _CROWD_HEIGHT, _LONGEST = 0.2, 1.6, 24
_LEFT, _LEFT_OF_LETTER, _LEFT_OF_CROWD = 1.75, 0.1, 0.75
"""Inches at the left of a panel: at most for names, for each letter of a name, and for an axis of ranks."""
_MOST_PAIRS, _MOST_LABELLED, _MOST_BARS = 15, 12, 60
_NAME_OFFSET, _NAME_RISE, _NAME_LINE = 8.0, 3.0, SMALL_SIZE + 2.0
"""Typographic points: offset of a name beside and above its data point, and distance of two names."""
_MOST_VECTORS = 1000
"""Most boards that are drawn as vectors; more would make a page of many megabytes."""
_STYLES = {"E_x": (BLUE, "o"), "E_y": (ORANGE, "D"), "G_xy": (GREEN, "s"), "density": (DARK, "^")}


def grading_pictures(graded: Grading) -> dict[str, list[Picture]]:
    if not graded.names:
        return {"constants": [], "makers": [], "limits": [], "pairs": []}
    return {
        "constants": [sorted_picture(graded)],
        "makers": [speed_picture(graded)],
        "limits": [] if graded.all_limits_probability is None or not len(graded.trusted) else [limits_picture(graded)],
        "pairs": [pairs_picture(graded)] if graded.pairs else [],
    }


def sorted_picture(graded: Grading) -> Picture:
    """The boards sorted by each constant, the largest on top, with their 90 % intervals."""
    n = len(graded.names)
    is_named = n <= MOST_NAMED_ROWS
    height = _ROW * n + 0.1 if is_named else _CROWD_HEIGHT
    left = _name_margin(_drawn_name(graded, i) for i in range(n)) if is_named else _LEFT_OF_CROWD
    figure, panels = stacked_panels([height] * 3, left=left, top=0.3, bottom=0.5, gap=0.75)
    details = []
    for panel, name in zip(panels, MODULI, strict=True):
        median, low, high = graded.spread(FIGURES[name])
        order = np.argsort(-median, kind="stable")
        _limit_band(panel, graded, name)
        ends = low[order], median[order], high[order]
        if is_named:
            name_rows(panel, [_drawn_name(graded, i) for i in order])
            draw_whisker(panel, np.arange(n), ends, BLUE)
        else:
            _draw_crowd(panel, ends)
        panel.locator_params(axis="x", nbins=6)
        draw_heading(panel, modulus_title(name))
        panel.set(xlabel=f"GPa{'; shaded: the specification' if name in graded.request.limits else ''}")
        details.append(f"{name} from {median.min():.3g} to {median.max():.3g} GPa, half of the boards above "
                       f"{np.median(median):.3g}")  # fmt: skip
    caption = "Dot: median. Bar: 90 % interval. Where the bars of two boards overlap, their order is not sure."
    if len(graded.trusted) < n:
        caption += " Boards with a question mark are in doubt." if is_named else " Boards in doubt are among them."
    return Picture("boards-sorted", "The boards, sorted", f"{n} boards. {'; '.join(details)}.", caption, figure)


def _draw_crowd(panel: Axes, ends: tuple[Floats, Floats, Floats]) -> None:
    low, median, high = ends
    ranks, as_pixels = np.arange(len(median)), len(median) > _MOST_VECTORS
    panel.hlines(ranks, low, high, color=SKY, lw=0.8, rasterized=as_pixels)
    panel.plot(median, ranks, "o", color=BLUE, ms=1.5, mew=0.0, zorder=3, rasterized=as_pixels)
    panel.set(ylim=(len(median) - 0.5, -0.5), ylabel="rank")
    panel.grid(axis="x", color="0.9", lw=0.6)


def speed_picture(graded: Grading) -> Picture:
    """Density against the wave speed along the grain, with lines of equal radiation ratio."""
    figure, (panel,) = stacked_panels([3.0], left=0.75, bottom=0.6)
    density, speed = graded.spread(FIGURES["density"]), graded.spread(FIGURES["wave_speed_x"])
    is_crowd = len(graded.names) > _MOST_BARS
    bars: dict[str, Any] = {} if is_crowd else {"xerr": _error_bars(density), "yerr": _error_bars(speed)}
    panel.errorbar(
        density[0], speed[0], **bars, fmt="o", color=BLUE, mec="black", mew=0.5, ms=4,
        elinewidth=0.9, ecolor=GREY, zorder=3,
        rasterized=len(graded.names) > _MOST_VECTORS,
    )  # fmt: skip
    width = max(float(np.ptp(density[0])), 0.05 * float(density[0].mean()))
    middle = 0.5 * float(density[0].min() + density[0].max())
    panel.set_xlim(middle - 0.65 * width, middle + 0.65 * width)
    _lines_of_equal_ratio(panel, speed[0] / density[0])
    if len(graded.names) <= _MOST_LABELLED:
        _name_points(panel, density[0], speed[0], [_drawn_name(graded, i) for i in range(len(density[0]))])
    panel.set(xlabel="density, kg/m³", ylabel="wave speed along the grain, m/s")
    ratio = speed[0] / density[0]
    alt = (
        f"Density {density[0].min():.0f} to {density[0].max():.0f} kg/m³, wave speed {speed[0].min():.0f} to "
        f"{speed[0].max():.0f} m/s, radiation ratio {ratio.min():.1f} to {ratio.max():.1f} m⁴/(kg s)."
    )
    caption = (
        "Light and stiff boards are at the upper left. Grey lines: equal radiation ratio, wave speed over density."
        + ("" if is_crowd else " Bars: 90 % intervals.")
    )
    return Picture("density-speed", "Light and stiff", alt, caption, figure)


def _name_points(panel: Axes, x: Floats, y: Floats, names: Sequence[str]) -> None:
    """A name beside each data point, on the side with more room; names that would overlap are moved apart."""
    panel.set(xlim=panel.get_xlim(), ylim=panel.get_ylim())  # fixed from here on
    height = panel.get_window_extent().height * 72.0 / panel.figure.dpi
    order = np.argsort(y)
    low, high = panel.get_ylim()
    places = (y[order] - low) / (high - low) + _NAME_RISE / height
    right = x > 0.5 * (x.min() + x.max())
    for i, rise in zip(
        order, (separate_places(places, _NAME_LINE / height) - places) * height + _NAME_RISE, strict=True
    ):
        panel.annotate(
            names[i], (x[i], y[i]), (-_NAME_OFFSET if right[i] else _NAME_OFFSET, rise), textcoords="offset points",
            fontsize=SMALL_SIZE, ha="right" if right[i] else "left", parse_math=False,
            arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.5, "shrinkA": 0.0, "shrinkB": 3.0},
        )  # fmt: skip


def limits_picture(graded: Grading) -> Picture:
    """Probability that each board meets all limits, the most probable first, without boards in doubt."""
    assert graded.all_limits_probability is not None
    order = rank_boards(graded)[: len(graded.trusted)]
    is_named = len(order) <= MOST_NAMED_ROWS
    values = 100.0 * graded.all_limits_probability[order]
    left = _name_margin(_drawn_name(graded, i) for i in order) if is_named else _LEFT_OF_CROWD
    figure, (panel,) = stacked_panels([_ROW * len(order) + 0.1 if is_named else _CROWD_HEIGHT], left=left, bottom=0.5)
    if is_named:
        colours = [GREEN if value >= 90.0 else VERMILLION if value < 10.0 else SKY for value in values]
        panel.barh(np.arange(len(order)), values, height=0.65, color=colours, edgecolor="black", lw=0.5)
        name_rows(panel, [_drawn_name(graded, i) for i in order])
    else:
        panel.plot(values, np.arange(1, len(order) + 1), color=BLUE, lw=1.6)
        panel.set(ylim=(len(order), 0), ylabel="boards, the likeliest on top")
        panel.grid(axis="x", color="0.9", lw=0.6)
    panel.set(xlim=(0, 100), xlabel="probability that the board meets all limits, %")
    panel.axvline(90, color=DARK, lw=0.8, ls="--")
    n_sure = int((graded.all_limits_probability[order] >= 0.9).sum())
    alt = f"{n_sure} of {len(order)} boards meet all limits with 90 % or more."
    caption = f"{alt}{' Green: 90 % and more; blue: 10 to 90 %; red: less than 10 %.' if is_named else ''}"
    return Picture("limits", "Which boards meet the specification", alt, caption, figure)


def pairs_picture(graded: Grading) -> Picture:
    """The proposed pairs: differences of their constants, and the tolerance."""
    pairs = graded.pairs[:_MOST_PAIRS]
    tolerances = graded.request.match_percent
    names = list(tolerances)
    steps = np.linspace(-0.22, 0.22, len(names)) if len(names) > 1 else np.zeros(1)
    pair_names = [
        [shorten(drawable_text(graded.names[i]), _LONGEST) for i in (pair.first, pair.second)] for pair in pairs
    ]
    left = _name_margin(name for board_names in pair_names for name in board_names)
    figure, panel = panel_with_rows(
        ["\n".join(board_names) for board_names in pair_names], row=0.42, left=left, right=0.5, bottom=0.8
    )
    for row, pair in enumerate(pairs):
        boards = [pair.first, pair.second]
        for step, name in zip(steps, names, strict=True):
            width = tolerances[name]
            panel.barh(row + step, width + 100.0 * width / (100.0 + width), left=-100.0 * width / (100.0 + width),
                       height=0.42 / len(names), color=LIGHT, zorder=0)  # fmt: skip
            mean, sd = graded.log(FIGURES[name], boards)
            log_ratio, spread = float(mean[1] - mean[0]), HALF_WIDTH_90 * float(np.sqrt((sd**2).sum()))
            ends = 100.0 * np.expm1(log_ratio + spread * np.array([-1.0, 0.0, 1.0]))
            draw_whisker(panel, row + step, tuple(ends), *_STYLES[name])
        panel.annotate(str(percent(pair.probability)), (1.02, row), xycoords=("axes fraction", "data"), ha="left",
                       va="center", fontsize=SMALL_SIZE, weight="bold", annotation_clip=False)  # fmt: skip
    panel.axvline(0, color=DARK, lw=0.8)
    panel.set(xlabel="value of the partner over the board's, %")
    draw_legend(figure, 3, *(legend_entry(mathtext(name), *_STYLES[name]) for name in names))
    alt = "; ".join(f"{graded.names[p.first]} and {graded.names[p.second]} {percent(p.probability)}" for p in pairs)
    caption = "Grey: within the tolerance. Bars: 90 % intervals. A pair matches where its values lie in the grey."
    return Picture("pairs", "Pairs that may match", f"Probabilities: {alt}.", caption, figure)


def _name_margin(names: Iterable[str]) -> float:
    """Inches that names need at the left of a panel."""
    return min(_LEFT, _LEFT_OF_LETTER * max(4, 2 + max(map(len, names))))


def _drawn_name(graded: Grading, place: int) -> str:
    """The name of a board, shortened, with its mark of doubt."""
    name = graded.names[place]
    return shorten(drawable_text(name), _LONGEST) + marked_name(graded, place).removeprefix(name)


def _error_bars(spread: tuple[Floats, Floats, Floats]) -> Floats:
    median, low, high = spread
    return np.stack([median - low, high - median])


def _lines_of_equal_ratio(panel: Axes, ratios: Floats) -> None:
    """Lines of equal radiation ratio, a few between the least and the greatest."""
    left, right = panel.get_xlim()
    low, high = panel.get_ylim()
    step = max(1.0, float(np.ceil((ratios.max() - ratios.min()) / 4.0)))
    for ratio in np.arange(max(np.floor(ratios.min()), step), np.ceil(ratios.max()) + step, step):
        panel.plot([left, right], [ratio * left, ratio * right], color=LIGHT, lw=1.0, zorder=1)
        x = min(right, high / ratio)
        if low < ratio * x <= high * 1.0001 and left < x:
            panel.annotate(f"{ratio:.0f}", (x, ratio * x), (-2, -1), textcoords="offset points", ha="right", va="top",
                           fontsize=SMALL_SIZE, color=GREY)  # fmt: skip
    panel.set(xlim=(left, right), ylim=(low, high))


def _limit_band(panel: Axes, graded: Grading, name: str) -> None:
    if name in graded.request.limits:
        low, high = graded.request.limits[name]
        factor = FIGURES[name].per_unit
        medians = graded.spread(FIGURES[name])[0]
        panel.axvspan(
            0.9 * medians.min() if low is None else low / factor,
            1.1 * medians.max() if high is None else high / factor,
            color=LIGHT,
            zorder=0,
        )


_TABLES = ("constants", "makers", "limits", "pairs", "doubts")


@matplotlib_defaults()
def write_grading_page(folder: Path, graded: Grading, summary: BatchSummary, *, has_pages: bool) -> Path:
    """Write the page and its figures as PNG and SVG; `has_pages`: each board has its own page in boards/NAME."""
    tables: dict[str, Table | None] = {**dict.fromkeys(_TABLES), **grading_tables(graded)}
    pages = [
        (marked_name(graded, i), f"boards/{graded.names[i]}/{PAGE_FILE}") for i in rank_boards(graded)[:MOST_LISTED]
    ]
    return save_page(
        folder / GRADING_PAGE,
        grading_pictures(graded),
        lambda pictures: render_page(
            "grading.html",
            title=f"{summary.n_fitted} boards, graded",
            sentences=grading_sentences(graded, summary),
            failures=failures_table(summary),
            pictures=pictures,
            tables=tables,
            matching=matching_sentence(graded),
            has_target=TARGET_THICKNESS in graded.request.figures,
            links=pages if has_pages else [],
        ),
    )


def grading_sentences(graded: Grading, summary: BatchSummary) -> tuple[str, ...]:
    sentences = [f"{summary.n_fitted} of {summary.n_boards} boards were fitted."]
    if graded.all_limits_probability is not None and graded.names:
        meets = graded.all_limits_probability[graded.trusted]
        limits = ", ".join(limit_text(name, limit) for name, limit in graded.request.limits.items())
        n_sure, n_maybe = int((meets >= 0.9).sum()), int((meets >= 0.5).sum())
        sentences.append(
            f"{limits}: met with 90 % or more by {n_sure} of the boards, with 50 % or more by {n_maybe}; "
            f"{float(meets.sum()):.1f} are to be expected."
        )
    if graded.pairs:
        best = graded.pairs[0]
        first, second = graded.names[best.first], graded.names[best.second]
        sentences.append(
            f"Pairs proposed: {len(graded.pairs)}; the likeliest match is {first} with {second}, "
            f"{percent(best.probability)}."
        )
    in_doubt = doubts_sentence(graded)
    return (*sentences, f"{in_doubt}.") if in_doubt else tuple(sentences)


def matching_sentence(graded: Grading) -> str:
    within = ", ".join(f"{name} to within {value:g} %" for name, value in graded.request.match_percent.items())
    return (
        f"Two boards match where they agree in {within}, all at once. The errors of two boards are taken to be "
        f"independent. The likeliest pair is taken first, then the likeliest of the boards that are left; pairs below "
        f"{percent(LEAST_MATCH_PROBABILITY)} are not proposed."
    )


def failures_table(summary: BatchSummary) -> Table | None:
    """The boards that were not fitted, with the reason; None where all were."""
    if not summary.failed:
        return None
    listed = summary.failed[:MOST_LISTED]
    excerpt = "" if len(listed) == len(summary.failed) else f", the first {MOST_LISTED} of {len(summary.failed)}"
    rows = tuple((failure.name, failure.outcome, failure.message) for failure in listed)
    return Table(f"Why{excerpt}", ("board", "outcome", "message"), rows)
