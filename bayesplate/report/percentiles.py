"""The figure of the percentile method: its estimates from subsets of the modes, its band, and the posterior."""

from __future__ import annotations

from collections.abc import Mapping
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.percentile import PercentileEstimate
from bayesplate.plate.material import MODULI
from bayesplate.report.constants import modulus_title
from bayesplate.report.style import (
    PAPER,
    POSTERIOR,
    SMALL,
    WORDS,
    Picture,
    drawable,
    legend_below,
    plain_axes,
    stacked,
)
from bayesplate.report.symbols import in_figure
from bayesplate.results.words import GPA

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SHOWN = (0.002, 0.998)
_BINS = 60
_MANY, _MANY_MODES = 200, 12


def percentiles_figure(
    title: str, percentile: PercentileEstimate, n_modes: int, moduli: Mapping[str, NDArray[np.float64]]
) -> Figure:
    """Estimates of E_x, E_y and G_xy from every subset of the modes, above the posterior.

    Parameters
    ----------
    title : str
    percentile : PercentileEstimate
    n_modes : int
        Of the board; subsets hold three of them or more.
    moduli : dict of array, Pa
        Draws of each modulus.

    Returns
    -------
    matplotlib.figure.Figure
        Three panels: a dot an estimate, at the height of the number of its modes, solid if the trimming keeps it. What
        lies beyond the panel is drawn as an arrow at its side.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    panels = figure.subplots(1, len(MODULI))
    for panel, name in zip(panels, MODULI, strict=True):
        plain_axes(panel)
        _draw(panel, name, percentile, n_modes, moduli[name])
        panel.set_title(in_figure(name))
    panels[0].set_ylabel("modes in the subset")
    figure.legend(handles=_handles(panels[0]), loc="outside lower center", ncols=4, frameon=False, fontsize=WORDS)
    figure.suptitle(drawable(title), fontsize=11, parse_math=False)
    return figure


def percentiles_picture(
    percentile: PercentileEstimate, n_modes: int, moduli: Mapping[str, NDArray[np.float64]]
) -> Picture:
    """The same below each other, for a page; parameters as of `percentiles_figure`."""
    heights = [min(1.9, 0.5 + 0.24 * (n_modes - 2))] * len(MODULI)
    figure, panels = stacked(heights, left=0.55, top=0.3, bottom=0.95, gap=0.72)
    for panel, name in zip(panels, MODULI, strict=True):
        _draw(panel, name, percentile, n_modes, moduli[name])
        panel.set_title(modulus_title(name), fontsize=WORDS, loc="left", weight="bold")
        panel.set_ylabel("modes used", fontsize=SMALL)
    legend_below(figure, _handles(panels[0]), 2)
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


def _draw(panel: Axes, name: str, percentile: PercentileEstimate, n_modes: int, moduli: NDArray[np.float64]) -> None:
    """One constant: the posterior at the foot, the band, and a dot an estimate."""
    i = MODULI.index(name)
    sizes = np.concatenate([np.full(comb(n_modes, size), size) for size in range(3, n_modes + 1)])
    draws = np.asarray(moduli).ravel() * GPA
    estimates, kept = percentile.estimates[:, i] * GPA, percentile.kept[:, i]
    mean, sd = percentile.mean[name] * GPA, percentile.sd[name] * GPA
    low, high = _limits(draws, estimates[kept], mean, sd)
    density, bins = np.histogram(draws, bins=_BINS, range=(low, high))
    panel.stairs(2.2 * density / density.max(), bins, baseline=0, fill=True, color=POSTERIOR, alpha=0.35)
    if np.isfinite([mean, sd]).all():
        panel.axvspan(mean - sd, mean + sd, color=PAPER, alpha=0.35, lw=0)
    for inside, face in ((kept, "black"), (~kept, "white")):
        panel.scatter(
            estimates[inside], sizes[inside], s=18, facecolor=face, edgecolor="black", lw=0.8, zorder=3,
            rasterized=len(sizes) > _MANY,
        )  # fmt: skip
    _arrows(panel, estimates, sizes, low, high)
    ticks = range(3, n_modes + 1, 1 if n_modes < _MANY_MODES else 2)
    panel.set(xlim=(low, high), ylim=(0, n_modes + 0.7), yticks=ticks)
    panel.set_xlabel("GPa", fontsize=SMALL)


def _handles(panel: Axes) -> list[Any]:
    return [
        panel.scatter([], [], s=18, facecolor="black", edgecolor="black", label="estimate, kept"),
        panel.scatter([], [], s=18, facecolor="white", edgecolor="black", label="estimate, trimmed"),
        panel.fill_between([], [], color=PAPER, alpha=0.35, label="percentile method ± its sd"),
        panel.fill_between([], [], color=POSTERIOR, alpha=0.35, label="posterior"),
    ]


def _limits(draws: NDArray[np.float64], kept: NDArray[np.float64], mean: float, sd: float) -> tuple[float, float]:
    """A range that shows the posterior, the kept estimates and the band, where there is one."""
    seen = np.concatenate([np.quantile(draws, _SHOWN), kept, [mean - 2 * sd, mean + 2 * sd]])
    seen = seen[np.isfinite(seen)]
    margin = 0.05 * (seen.max() - seen.min())
    return float(seen.min() - margin), float(seen.max() + margin)


def _arrows(panel: object, estimates: NDArray[np.float64], sizes: NDArray[np.int_], low: float, high: float) -> None:
    """Marks at the sides for estimates beyond them."""
    for beyond, at, marker in ((estimates < low, low, "<"), (estimates > high, high, ">")):
        for size in np.unique(sizes[beyond]):
            panel.scatter([at], [size], s=22, marker=marker, color="0.45", clip_on=False, zorder=4)  # type: ignore[attr-defined]
