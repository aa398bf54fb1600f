"""The figure of the percentile method: its estimates from subsets of the modes, its band, and the posterior."""

from __future__ import annotations

from collections.abc import Mapping
from math import comb
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI
from bayesplate.estimates.paper import paper_system
from bayesplate.estimates.percentile import PercentileEstimate, percentile_estimate
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.report.colours import PAPER
from bayesplate.report.constants import modulus_title
from bayesplate.report.style import Picture, heading, hump, legend_below, limits, stacked
from bayesplate.results.words import GPA

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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


def _picture(percentile: PercentileEstimate, n_modes: int, moduli: Mapping[str, NDArray[np.float64]]) -> Picture:
    """Estimates of each modulus, a dot for each subset, at the height of the number of its modes."""
    heights = [min(1.9, 0.5 + 0.24 * (n_modes - 2))] * len(MODULI)
    figure, panels = stacked(heights, left=0.55, top=0.3, bottom=0.95, gap=0.72)
    for panel, name in zip(panels, MODULI, strict=True):
        _draw(panel, name, percentile, n_modes, moduli[name])
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


def _draw(panel: Axes, name: str, percentile: PercentileEstimate, n_modes: int, moduli: NDArray[np.float64]) -> None:
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


def _arrows(panel: Axes, estimates: NDArray[np.float64], sizes: NDArray[np.int_], low: float, high: float) -> None:
    """Marks at the sides for estimates beyond them."""
    for beyond, at, marker in ((estimates < low, low, "<"), (estimates > high, high, ">")):
        for size in np.unique(sizes[beyond]):
            panel.scatter([at], [size], s=22, marker=marker, color="0.45", clip_on=False, zorder=4)
