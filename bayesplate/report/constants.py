"""Two figures of the constants: the posterior beside the older methods, and the percentile method's estimates."""

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
from bayesplate.posterior.inference import Inference
from bayesplate.report.style import (
    PAPER,
    POSTERIOR,
    WEIGHTED,
    WORDS,
    Picture,
    heading,
    hump,
    in_figure,
    legend_below,
    limits,
    plain_axes,
    stacked,
)
from bayesplate.results.summary import Percentile, Summary
from bayesplate.results.words import GPA, STIFFNESS, STIFFNESS_OF_ISOTROPIC, interval, plus_minus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def constants_figure(summary: Summary, moduli: Mapping[str, Floats]) -> Figure:
    """Posterior of E_x, E_y and G_xy side by side, from draws in Pa, with the point estimates that people know."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    panels = figure.subplots(1, 3)
    for panel, name in zip(panels, MODULI, strict=True):
        plain_axes(panel)
        _draw_posterior(panel, name, summary, moduli[name])
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=WORDS)
    figure.suptitle(f"{summary.name}: what {len(summary.modes)} modes tell", fontsize=11)
    return figure


def constants_picture(summary: Summary, moduli: Mapping[str, Floats]) -> Picture:
    """The posterior of each constant below the other, for a page."""
    figure, panels = stacked([0.95] * 3, left=0.2, right=0.2, top=0.3, bottom=0.95, gap=0.72)
    for panel, name in zip(panels, MODULI, strict=True):
        _draw_posterior(panel, name, summary, moduli[name])
    legend_below(figure, 2)
    told = "; ".join(
        f"{name} {plus_minus(entry, GPA)} GPa, nine times in ten {interval(entry, GPA)}"
        for name, entry in summary.elastic.items()
    )
    caption = (
        "How probable each value is, given the readings: the higher, the more probable; the blue bar holds nine "
        "tenths. A mark at the side of a panel is an estimate beyond it."
    )
    return Picture("constants", "The elastic constants", f"Three distributions: {told}.", caption, figure)


def modulus_title(name: str, *, isotropic: bool = False) -> str:
    return f"{in_figure(name)}: {(STIFFNESS_OF_ISOTROPIC if isotropic else STIFFNESS)[name]}"


def _draw_posterior(panel: Axes, name: str, summary: Summary, moduli: Floats) -> None:
    """One constant: its draws, its 90 % interval, and the estimates of the older methods."""
    draws = np.asarray(moduli).ravel() * GPA
    entry = summary.elastic[name]
    estimates = (summary.least_squares[name], summary.weighted_least_squares[name])
    paper, weighted = (None if value is None else value * GPA for value in estimates)
    band = _band(summary.percentile, name)
    ends = limits(draws, [value for value in (paper, weighted, *(band or ())) if value is not None])
    hump(panel, draws, ends)
    panel.plot([entry.q05 * GPA, entry.q95 * GPA], [0.03] * 2, color=POSTERIOR, lw=5, solid_capstyle="butt",
               label="posterior, bar: 90 %")  # fmt: skip
    if band is not None:
        inside = np.clip(band, *ends)
        panel.plot(inside, [0.13] * 2, color="black", lw=6.4, solid_capstyle="butt")  # its rim, to be seen in grey
        panel.plot(inside, [0.13] * 2, color=PAPER, lw=5, solid_capstyle="butt", label="percentile method ± its sd")
    _mark(panel, paper, ends, "paper's least squares", color="#9A6A00", ls=":", lw=2.0)
    _mark(panel, weighted, ends, "weighted least squares", color=WEIGHTED, ls="--", lw=1.2)
    panel.set(xlim=ends, ylim=(0, 1.04), yticks=[], xlabel=f"GPa    ({plus_minus(entry, GPA)})")
    heading(panel, modulus_title(name, isotropic=summary.model.isotropic))
    panel.spines["left"].set_visible(False)


def _mark(panel: Axes, at: float | None, ends: tuple[float, float], label: str, **style: Any) -> None:
    """An estimate as a line; at the side of the panel as an arrow where it lies beyond, nothing where there is none."""
    if at is None:
        return
    if ends[0] <= at <= ends[1]:
        panel.plot([at, at], [0, 1], label=label, **style)
        return
    is_low = at < ends[0]
    panel.plot([], [], label=label, **style)
    panel.plot([ends[not is_low]], [0.5], marker="<" if is_low else ">", color=style["color"], ms=7, clip_on=False)


def _band(percentile: Percentile | None, name: str) -> tuple[float, float] | None:
    """Mean less and plus the percentile method's own spread, GPa; None where it gave none."""
    if percentile is None or (mean := percentile[name].mean) is None:
        return None
    sd = mean * (percentile[name].sd_percent or 0.0) / 100.0
    return (mean - sd) * GPA, (mean + sd) * GPA


_MANY = 200
"""Estimates from which on they are drawn as pixels."""
MOST_MODES = 12
"""4017 subsets; with more modes the estimates are too many to be drawn, and take seconds."""


def percentiles_pictures(inference: Inference, draws: Draws) -> list[Picture]:
    """The picture of the percentile method; none of one estimate, of too many, or where none is positive."""
    problem = inference.problem
    system = paper_system(problem.board, problem.estimate, compared=False)
    if system.psi.size > MOST_MODES:
        return []
    estimate = percentile_estimate(system)
    if estimate is None or estimate.n_subsets == 1 or not np.isfinite(list(estimate.mean.values())).all():
        return []
    return [_picture(estimate, system.psi.size, draws.moduli)]


def _picture(percentile: PercentileEstimate, n_modes: int, moduli: Mapping[str, Floats]) -> Picture:
    """Estimates of each modulus, a dot for each subset, at the height of the number of its modes."""
    heights = [min(1.9, 0.5 + 0.24 * (n_modes - 2))] * len(MODULI)
    figure, panels = stacked(heights, left=0.55, top=0.3, bottom=0.95, gap=0.72)
    for panel, name in zip(panels, MODULI, strict=True):
        _draw_estimates(panel, name, percentile, n_modes, moduli[name])
        heading(panel, modulus_title(name))
        panel.set(ylabel="modes used")
    legend_below(figure, 2)
    kept = ", ".join(f"{int(n)} of {name}" for n, name in zip(percentile.kept.sum(axis=0), MODULI, strict=True))
    alt = (
        f"{percentile.n_subsets} least-squares estimates of each constant, one per subset of the modes, of which the "
        f"trimming keeps {kept}; their mean and spread as a band, and the posterior below."
    )
    caption = (
        f"The paper's percentile method: least squares from each of the {percentile.n_subsets} subsets of three modes "
        "or more, the middle ones kept. A mark at the side of a panel stands for estimates beyond it."
    )
    title = f"The {percentile.n_subsets} estimates of the percentile method"
    return Picture("percentiles", title, alt, caption, figure)


def _draw_estimates(panel: Axes, name: str, percentile: PercentileEstimate, n_modes: int, moduli: Floats) -> None:
    """One constant: the posterior at the foot, the band, and a dot an estimate."""
    i = MODULI.index(name)
    sizes = np.concatenate([np.full(comb(n_modes, size), size) for size in range(3, n_modes + 1)])
    draws = np.asarray(moduli).ravel() * GPA
    estimates, kept = percentile.estimates[:, i] * GPA, percentile.kept[:, i]
    mean, sd = percentile.mean[name] * GPA, percentile.sd[name] * GPA
    band = [mean - sd, mean + sd]
    low, high = ends = limits(draws, [*estimates[kept], mean - 2 * sd, mean + 2 * sd], reach=np.inf)
    inside = (low <= estimates) & (estimates <= high)
    for which, face, label in ((kept, "black", "estimate, kept"), (~kept, "white", "estimate, trimmed")):
        panel.scatter(
            estimates[inside & which], sizes[inside & which], s=18, facecolor=face, edgecolor="black", lw=0.8, zorder=3,
            label=label, clip_on=False, rasterized=len(sizes) > _MANY,
        )  # fmt: skip
    if np.isfinite(band).all():
        panel.axvspan(*band, color=PAPER, alpha=0.35, lw=0, label="percentile method ± its sd")
    hump(panel, draws, ends, 2.2, label="posterior")
    _arrows(panel, estimates, sizes, low, high)
    ticks = range(3, n_modes + 1, 1 if n_modes < MOST_MODES else 2)
    panel.set(xlim=ends, ylim=(0, n_modes + 0.7), yticks=ticks, xlabel="GPa")


def _arrows(panel: Axes, estimates: Floats, sizes: NDArray[np.int_], low: float, high: float) -> None:
    for beyond, at, marker in ((estimates < low, low, "<"), (estimates > high, high, ">")):
        for size in np.unique(sizes[beyond]):
            panel.scatter([at], [size], s=22, marker=marker, color="0.45", clip_on=False, zorder=4)
