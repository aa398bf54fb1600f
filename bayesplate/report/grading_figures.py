"""Figures of many boards: sorted by each constant, density and wave speed, what meets a specification, pairs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.plate.material import MODULI
from bayesplate.report.constants import modulus_title
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    SKY,
    SMALL,
    VERMILLION,
    WORDS,
    Picture,
    drawable,
    legend_below,
    moved_apart,
    short,
    stacked,
)
from bayesplate.report.symbols import in_figure
from bayesplate.results.grading import Grading
from bayesplate.results.grading_table import best_first, marked
from bayesplate.results.log_figures import FIGURES
from bayesplate.results.words import percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

MOST_NAMED = 30
"""Boards up to which each has a row with its name; more are drawn in the order of their size, without names."""
_ROW, _CROWD, _LEFT, _LONGEST = 0.2, 1.6, 1.75, 24
_MOST_PAIRS, _MOST_LABELLED, _MOST_BARS = 15, 12, 60
_ASIDE, _ABOVE, _LINE = 8.0, 3.0, SMALL + 2.0
"""Points from a point to its name, beside and above its bar, and from one name to the next."""
_MOST_VECTORS = 1000
"""Boards up to which a figure draws each as lines; more would make a page of many megabytes."""
_NINETY = 1.645
_COLOURS = {"E_x": (BLUE, "o"), "E_y": (ORANGE, "D"), "G_xy": (GREEN, "s")}


def every_grading_picture(graded: Grading) -> dict[str, list[Picture]]:
    """The figures of the page, by the place where they stand; none where no board was fitted."""
    if not graded.names:
        return {"constants": [], "makers": [], "limits": [], "pairs": []}
    return {
        "constants": [sorted_picture(graded)],
        "makers": [speed_picture(graded)],
        "limits": [] if graded.meets_all is None or not len(graded.trusted) else [limits_picture(graded)],
        "pairs": [pairs_picture(graded)] if graded.pairs else [],
    }


def sorted_picture(graded: Grading) -> Picture:
    """The boards sorted by each constant, the largest on top, with their 90 % intervals."""
    n = len(graded.names)
    is_named, as_pixels = n <= MOST_NAMED, n > _MOST_VECTORS
    height = _ROW * n + 0.1 if is_named else _CROWD
    figure, panels = stacked([height] * 3, left=_LEFT if is_named else 0.75, top=0.3, bottom=0.5, gap=0.75)
    told = []
    for panel, name in zip(panels, MODULI, strict=True):
        middle, low, high = graded.spread(FIGURES[name])
        order = np.argsort(-middle, kind="stable")
        _limit_band(panel, graded, name)
        rows = np.arange(n)
        panel.hlines(rows, low[order], high[order], color=BLUE if is_named else SKY, lw=1.8 if is_named else 0.8,
                     rasterized=as_pixels)  # fmt: skip
        panel.plot(middle[order], rows, "o", color=BLUE, mec="black", mew=0.5 if is_named else 0.0,
                   ms=5 if is_named else 1.5, zorder=3, rasterized=as_pixels)  # fmt: skip
        if is_named:
            _named_rows(panel, [_shown(graded, i) for i in order])
        else:
            panel.set(ylim=(n - 0.5, -0.5), ylabel="rank")
            panel.yaxis.label.set_fontsize(SMALL)
            panel.grid(axis="x", color="0.9", lw=0.6)
        panel.locator_params(axis="x", nbins=6)
        panel.set_title(modulus_title(name), fontsize=WORDS, loc="left", weight="bold")
        panel.set_xlabel(f"GPa{'; shaded: the specification' if name in graded.request.limits else ''}", fontsize=SMALL)
        told.append(f"{name} from {middle.min():.3g} to {middle.max():.3g} GPa, half of the boards above "
                    f"{np.median(middle):.3g}")  # fmt: skip
    caption = "Dot: median. Bar: 90 % interval. Where the bars of two boards overlap, their order is not sure."
    if len(graded.trusted) < n:
        caption += " Boards with a question mark are in doubt." if is_named else " Boards in doubt are among them."
    return Picture("boards-sorted", "The boards, sorted", f"{n} boards. {'; '.join(told)}.", caption, figure)


def speed_picture(graded: Grading) -> Picture:
    """Density against the wave speed along the grain, with lines of equal radiation ratio."""
    figure, (panel,) = stacked([3.0], left=0.75, bottom=0.6)
    density, speed = graded.spread(FIGURES["density"]), graded.spread(FIGURES["wave_speed_x"])
    is_crowd = len(graded.names) > _MOST_BARS
    bars: dict[str, Any] = {} if is_crowd else {"xerr": _ends(density), "yerr": _ends(speed)}
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
        _name_points(panel, density[0], speed[0], [_shown(graded, i) for i in range(len(density[0]))])
    panel.set_xlabel("density, kg/m³", fontsize=SMALL)
    panel.set_ylabel("wave speed along the grain, m/s", fontsize=SMALL)
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
    """A name beside each point, on the side with more room, moved apart where names would overlap."""
    panel.set(xlim=panel.get_xlim(), ylim=panel.get_ylim())  # which do not change any more
    height = panel.get_window_extent().height * 72.0 / panel.figure.dpi
    order = np.argsort(y)
    low, high = panel.get_ylim()
    wanted = (y[order] - low) / (high - low) + _ABOVE / height
    right = x > 0.5 * (x.min() + x.max())
    for i, up in zip(order, (moved_apart(wanted, _LINE / height) - wanted) * height + _ABOVE, strict=True):
        panel.annotate(
            names[i], (x[i], y[i]), (-_ASIDE if right[i] else _ASIDE, up), textcoords="offset points", fontsize=SMALL,
            ha="right" if right[i] else "left", parse_math=False,
            arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.5, "shrinkA": 0.0, "shrinkB": 3.0},
        )  # fmt: skip


def limits_picture(graded: Grading) -> Picture:
    """How probably the boards meet all limits, the most probable first; without those in doubt."""
    assert graded.meets_all is not None
    order = best_first(graded)[: len(graded.trusted)]
    is_named = len(order) <= MOST_NAMED
    values = 100.0 * graded.meets_all[order]
    figure, (panel,) = stacked([_ROW * len(order) + 0.1 if is_named else _CROWD], left=_LEFT, bottom=0.5)
    if is_named:
        colours = [GREEN if value >= 90.0 else VERMILLION if value < 10.0 else SKY for value in values]
        panel.barh(np.arange(len(order)), values, height=0.65, color=colours, edgecolor="black", lw=0.5)
        _named_rows(panel, [_shown(graded, i) for i in order])
    else:
        panel.plot(values, np.arange(1, len(order) + 1), color=BLUE, lw=1.6)
        panel.set(ylim=(len(order), 0))
        panel.set_ylabel("boards, the likeliest on top", fontsize=SMALL)
        panel.grid(axis="x", color="0.9", lw=0.6)
    panel.set_xlim(0, 100)
    panel.axvline(90, color=DARK, lw=0.8, ls="--")
    panel.set_xlabel("probability that the board meets all limits, %", fontsize=SMALL)
    n_sure = int((graded.meets_all[order] >= 0.9).sum())
    alt = f"{n_sure} of {len(order)} boards meet all limits with 90 % or more."
    caption = f"{alt}{' Green: 90 % and more; red: less than 10 %.' if is_named else ''}"
    return Picture("limits", "Which boards meet the specification", alt, caption, figure)


def pairs_picture(graded: Grading) -> Picture:
    """The proposed pairs: by how much the constants of the partner differ, and the tolerance."""
    shown = graded.pairs[:_MOST_PAIRS]
    names = [name for name in MODULI if name in graded.request.match_percent] or list(MODULI)
    figure, (panel,) = stacked([0.42 * len(shown) + 0.1], left=_LEFT, right=0.5, bottom=0.8)
    for row, pair in enumerate(shown):
        both = [pair.first, pair.second]
        for step, name in zip(np.linspace(-0.22, 0.22, len(names)), names, strict=True):
            mean, sd = FIGURES[name].log(graded.log_mean[both], graded.triangles[both])
            apart, spread = float(mean[1] - mean[0]), _NINETY * float(np.sqrt((sd**2).sum()))
            low, middle, high = (100.0 * np.expm1(apart + at * spread) for at in (-1.0, 0.0, 1.0))
            colour, marker = _COLOURS[name]
            panel.hlines(row + step, low, high, color=colour, lw=1.6)
            panel.plot(middle, row + step, marker, color=colour, mec="black", mew=0.5, ms=4.5)
    widths = sorted({graded.request.match_percent.get(name, 0.0) for name in names})
    for width in widths:
        panel.axvspan(-100.0 * width / (100.0 + width), width, color=LIGHT, zorder=0)
    panel.axvline(0, color=DARK, lw=0.8)
    titles = [
        f"{short(drawable(graded.names[p.first]), _LONGEST)}\n{short(drawable(graded.names[p.second]), _LONGEST)}"
        for p in shown
    ]
    _named_rows(panel, titles)
    for row, pair in enumerate(shown):
        panel.annotate(percent(pair.probability), (1.02, row), xycoords=("axes fraction", "data"), ha="left",
                       va="center", fontsize=SMALL, weight="bold", annotation_clip=False)  # fmt: skip
    panel.set_xlabel("constants of the partner over the board's, %", fontsize=SMALL)
    legend_below(figure, [_handle(*_COLOURS[name], in_figure(name)) for name in names], 3)
    alt = "; ".join(f"{graded.names[p.first]} and {graded.names[p.second]} {percent(p.probability)}" for p in shown)
    caption = "Grey: within the tolerance. Bars: 90 % intervals. A pair matches where all its bars lie in the grey."
    return Picture("pairs", "Pairs that may match", f"Probabilities: {alt}.", caption, figure)


def _shown(graded: Grading, place: int) -> str:
    """The name of a board, as far as it has room, with its mark."""
    name = graded.names[place]
    return short(drawable(name), _LONGEST) + marked(graded, place).removeprefix(name)


def _ends(spread: tuple[Floats, Floats, Floats]) -> Floats:
    middle, low, high = spread
    return np.stack([middle - low, high - middle])


def _lines_of_equal_ratio(panel: Axes, ratios: Floats) -> None:
    """Straight lines through the origin, a few between the least and the greatest ratio."""
    left, right = panel.get_xlim()
    low, high = panel.get_ylim()
    step = max(1.0, float(np.ceil((ratios.max() - ratios.min()) / 4.0)))
    for ratio in np.arange(np.floor(ratios.min()), np.ceil(ratios.max()) + step, step):
        panel.plot([left, right], [ratio * left, ratio * right], color=LIGHT, lw=1.0, zorder=1)
        x = min(right, high / ratio)
        if low < ratio * x <= high * 1.0001 and left < x:
            panel.annotate(f"{ratio:.0f}", (x, ratio * x), (-2, -1), textcoords="offset points", ha="right", va="top",
                           fontsize=SMALL, color=GREY)  # fmt: skip
    panel.set(xlim=(left, right), ylim=(low, high))


def _limit_band(panel: Axes, graded: Grading, name: str) -> None:
    """What a specification allows of a constant, shaded."""
    if name in graded.request.limits:
        low, high = graded.request.limits[name]
        factor = FIGURES[name].per_unit
        middle = graded.spread(FIGURES[name])[0]
        panel.axvspan(
            0.9 * middle.min() if low is None else low / factor,
            1.1 * middle.max() if high is None else high / factor,
            color=LIGHT,
            zorder=0,
        )


def _named_rows(panel: Axes, names: Sequence[str]) -> None:
    """A row for each name, the first on top."""
    panel.set(ylim=(len(names) - 0.5, -0.5))
    panel.set_yticks(range(len(names)), names, fontsize=SMALL, parse_math=False)
    panel.tick_params(axis="y", length=0)
    panel.spines["left"].set_visible(False)
    panel.grid(axis="x", color="0.9", lw=0.6)
    panel.set_axisbelow(True)


def _handle(color: Any, marker: str, label: str) -> Any:
    from matplotlib.lines import Line2D

    return Line2D([], [], color=color, marker=marker, mec="black", mew=0.5, ms=4.5, lw=1.6, label=label)
