"""Figures of the constants: the posterior with the older methods, and the percentile method's estimates."""

from __future__ import annotations

from collections.abc import Mapping
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.board.material import MODULI
from bayesplate.estimates.paper import paper_system
from bayesplate.estimates.percentile import PercentileEstimate, percentile_estimate
from bayesplate.posterior.draws import Draws
from bayesplate.report.style import (
    PAPER_COLOUR,
    POSTERIOR_COLOUR,
    TEXT_SIZE,
    WEIGHTED_COLOUR,
    Picture,
    axis_range,
    draw_density,
    draw_heading,
    draw_legend,
    mathtext,
    plain_axes,
    stacked_panels,
)
from bayesplate.results.summary import Percentile, Summary
from bayesplate.results.words import GPA, STIFFNESS_WORDS, STIFFNESS_WORDS_OF_ISOTROPIC, interval, plus_minus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def constants_figure(summary: Summary, moduli: Mapping[str, Floats]) -> Figure:
    """Posteriors of E_x, E_y and G_xy side by side, from draws in Pa, with the estimates of the older methods."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    panels = figure.subplots(1, 3)
    for panel, name in zip(panels, MODULI, strict=True):
        plain_axes(panel)
        _draw_posterior(panel, name, summary, moduli[name])
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=TEXT_SIZE)
    figure.suptitle(
        f"{summary.name}: what {len(summary.modes)} mode{'s tell' if len(summary.modes) != 1 else ' tells'}",
        fontsize=11,
    )
    return figure


def constants_picture(summary: Summary, moduli: Mapping[str, Floats]) -> Picture:
    """The posteriors of the constants below each other, for a page."""
    figure, panels = stacked_panels([0.95] * 3, left=0.2, right=0.2, top=0.3, bottom=0.95, gap=0.72)
    for panel, name in zip(panels, MODULI, strict=True):
        _draw_posterior(panel, name, summary, moduli[name])
    draw_legend(figure, 2)
    details = "; ".join(
        f"{name} {plus_minus(entry, GPA)} GPa, nine times in ten {interval(entry, GPA)}"
        for name, entry in summary.elastic.items()
    )
    caption = (
        "How probable each value is, given the readings: the higher, the more probable; the blue bar holds nine "
        "tenths. A mark at the side of a panel is an estimate beyond it."
    )
    return Picture("constants", "The elastic constants", f"Three distributions: {details}.", caption, figure)


def modulus_title(name: str, *, isotropic: bool = False) -> str:
    return f"{mathtext(name)}: {(STIFFNESS_WORDS_OF_ISOTROPIC if isotropic else STIFFNESS_WORDS)[name]}"


def _draw_posterior(panel: Axes, name: str, summary: Summary, moduli: Floats) -> None:
    """One constant: its draws, its 90 % interval, and the estimates of the older methods."""
    draws = np.asarray(moduli).ravel() * GPA
    entry = summary.elastic[name]
    estimates = (summary.least_squares[name], summary.weighted_least_squares[name])
    paper, weighted = (None if value is None else value * GPA for value in estimates)
    band = _percentile_band(summary.percentile, name)
    ends = axis_range(draws, [value for value in (paper, weighted, *(band or ())) if value is not None])
    draw_density(panel, draws, ends)
    panel.plot([entry.q05 * GPA, entry.q95 * GPA], [0.03] * 2, color=POSTERIOR_COLOUR, lw=5, solid_capstyle="butt",
               label="posterior, bar: 90 %")  # fmt: skip
    if band is not None:
        drawn_band = np.clip(band, *ends)
        panel.plot(drawn_band, [0.13] * 2, color="black", lw=6.4, solid_capstyle="butt")  # rim, visible in grey print
        panel.plot(
            drawn_band, [0.13] * 2, color=PAPER_COLOUR, lw=5, solid_capstyle="butt", label="percentile method ± its sd"
        )
    _mark_estimate(panel, paper, ends, "paper's least squares", color="#9A6A00", ls=":", lw=2.0)
    _mark_estimate(panel, weighted, ends, "weighted least squares", color=WEIGHTED_COLOUR, ls="--", lw=1.2)
    panel.set(xlim=ends, ylim=(0, 1.04), yticks=[], xlabel=f"GPa    ({plus_minus(entry, GPA)})")
    draw_heading(panel, modulus_title(name, isotropic=summary.model.isotropic))
    panel.spines["left"].set_visible(False)


def _mark_estimate(panel: Axes, value: float | None, ends: tuple[float, float], label: str, **style: Any) -> None:
    """An estimate as a line, or as an arrow at the side of the panel if it lies beyond; nothing for None."""
    if value is None:
        return
    if ends[0] <= value <= ends[1]:
        panel.plot([value, value], [0, 1], label=label, **style)
        return
    is_low = value < ends[0]
    panel.plot([], [], label=label, **style)
    panel.plot([ends[not is_low]], [0.5], marker="<" if is_low else ">", color=style["color"], ms=7, clip_on=False)


def _percentile_band(percentile: Percentile | None, name: str) -> tuple[float, float] | None:
    """Mean minus and plus sd of the percentile method, GPa; None where it has no estimate."""
    if percentile is None or (mean := percentile[name].mean) is None:
        return None
    sd = mean * (percentile[name].sd_percent or 0.0) / 100.0
    return (mean - sd) * GPA, (mean + sd) * GPA


_MANY_ESTIMATES = 200
"""Estimates beyond which they are drawn as pixels."""
MOST_DRAWN_MODES = 12
"""Most modes of the picture of the percentile method: 4017 subsets; more take seconds and are too many to draw."""


def percentiles_pictures(draws: Draws) -> list[Picture]:
    """The picture of the percentile method; empty for a single estimate, for too many, or if none is positive."""
    problem = draws.problem
    system = paper_system(problem.board, problem.estimate, compared=False)
    if system.psi.size > MOST_DRAWN_MODES:
        return []
    estimate = percentile_estimate(system)
    if estimate is None or estimate.n_subsets == 1 or not np.isfinite(list(estimate.mean.values())).all():
        return []
    return [_percentiles_picture(estimate, system.psi.size, draws.moduli, isotropic=problem.board.isotropic)]


def _percentiles_picture(
    percentile: PercentileEstimate, n_modes: int, moduli: Mapping[str, Floats], *, isotropic: bool
) -> Picture:
    """Estimates of each modulus: a dot for each subset of modes, at the height of its number of modes."""
    heights = [min(1.9, 0.5 + 0.24 * (n_modes - 2))] * len(MODULI)
    figure, panels = stacked_panels(heights, left=0.55, top=0.3, bottom=0.95, gap=0.72)
    for panel, name in zip(panels, MODULI, strict=True):
        _draw_estimates(panel, name, percentile, n_modes, moduli[name])
        draw_heading(panel, modulus_title(name, isotropic=isotropic))
        panel.set(ylabel="modes used")
    draw_legend(figure, 2)
    kept_counts = ", ".join(
        f"{int(n)} of {name}" for n, name in zip(percentile.is_kept.sum(axis=0), MODULI, strict=True)
    )
    alt = (
        f"{percentile.n_subsets} least-squares estimates of each constant, one per subset of the modes, of which the "
        f"trimming keeps {kept_counts}; their mean and spread as a band, and the posterior below."
    )
    caption = (
        f"The paper's percentile method: least squares from each of the {percentile.n_subsets} subsets of three modes "
        "or more, the middle ones kept. A mark at the side of a panel stands for estimates beyond it."
    )
    title = f"The {percentile.n_subsets} estimates of the percentile method"
    return Picture("percentiles", title, alt, caption, figure)


def _draw_estimates(panel: Axes, name: str, percentile: PercentileEstimate, n_modes: int, moduli: Floats) -> None:
    """One constant: the posterior at the foot, the percentile band, and a dot per estimate."""
    i = MODULI.index(name)
    sizes = np.concatenate([np.full(comb(n_modes, size), size) for size in range(3, n_modes + 1)])
    draws = np.asarray(moduli).ravel() * GPA
    estimates, is_kept = percentile.estimates[:, i] * GPA, percentile.is_kept[:, i]
    mean, sd = percentile.mean[name] * GPA, percentile.sd[name] * GPA
    band = [mean - sd, mean + sd]
    low, high = ends = axis_range(draws, [*estimates[is_kept], mean - 2 * sd, mean + 2 * sd], reach=np.inf)
    inside = (low <= estimates) & (estimates <= high)
    for selected, face, label in ((is_kept, "black", "estimate, kept"), (~is_kept, "white", "estimate, trimmed")):
        panel.scatter(
            estimates[inside & selected], sizes[inside & selected], s=18, facecolor=face, edgecolor="black", lw=0.8,
            zorder=3, label=label, clip_on=False, rasterized=len(sizes) > _MANY_ESTIMATES,
        )  # fmt: skip
    if np.isfinite(band).all():
        panel.axvspan(*band, color=PAPER_COLOUR, alpha=0.35, lw=0, label="percentile method ± its sd")
    draw_density(panel, draws, ends, 2.2, label="posterior")
    _draw_arrows(panel, estimates, sizes, low, high)
    ticks = range(3, n_modes + 1, 1 if n_modes < MOST_DRAWN_MODES else 2)
    panel.set(xlim=ends, ylim=(0, n_modes + 0.7), yticks=ticks, xlabel="GPa")


def _draw_arrows(panel: Axes, estimates: Floats, sizes: NDArray[np.int_], low: float, high: float) -> None:
    for is_beyond, end, marker in ((estimates < low, low, "<"), (estimates > high, high, ">")):
        for size in np.unique(sizes[is_beyond]):
            panel.scatter([end], [size], s=22, marker=marker, color="0.45", clip_on=False, zorder=4)
