"""The figure of the percentile method: its estimates from subsets of the modes, its band, and the posterior."""

from __future__ import annotations

from collections.abc import Mapping
from math import comb
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.percentile import PercentileEstimate
from bayesplate.plate.material import MODULI

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_GPA = 1e9
_POSTERIOR, _PAPER = "#0072B2", "#E69F00"
_SHOWN = (0.002, 0.998)
_BINS = 60


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

    sizes = np.concatenate([np.full(comb(n_modes, size), size) for size in range(3, n_modes + 1)])
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    panels = figure.subplots(1, len(MODULI))
    for i, (panel, name) in enumerate(zip(panels, MODULI, strict=True)):
        draws = np.asarray(moduli[name]).ravel() / _GPA
        estimates, kept = percentile.estimates[:, i] / _GPA, percentile.kept[:, i]
        mean, sd = percentile.mean[name] / _GPA, percentile.sd[name] / _GPA
        low, high = _limits(draws, estimates[kept], mean, sd)
        density, bins = np.histogram(draws, bins=_BINS, range=(low, high))
        panel.stairs(2.2 * density / density.max(), bins, baseline=0, fill=True, color=_POSTERIOR, alpha=0.35)
        panel.axvspan(mean - sd, mean + sd, color=_PAPER, alpha=0.35, lw=0)
        for inside, face in ((kept, "black"), (~kept, "white")):
            panel.scatter(estimates[inside], sizes[inside], s=18, facecolor=face, edgecolor="black", lw=0.8, zorder=3)
        _arrows(panel, estimates, sizes, low, high)
        panel.set(xlim=(low, high), ylim=(0, n_modes + 0.7), xlabel="GPa", yticks=range(3, n_modes + 1), title=name)
        panel.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("modes in the subset")
    handles = [
        panels[0].scatter([], [], s=18, facecolor="black", edgecolor="black", label="estimate, kept"),
        panels[0].scatter([], [], s=18, facecolor="white", edgecolor="black", label="estimate, trimmed"),
        panels[0].fill_between([], [], color=_PAPER, alpha=0.35, label="percentile method ± its sd"),
        panels[0].fill_between([], [], color=_POSTERIOR, alpha=0.35, label="posterior"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=9)
    figure.suptitle(title, fontsize=11, parse_math=False)
    return figure


def _limits(draws: NDArray[np.float64], kept: NDArray[np.float64], mean: float, sd: float) -> tuple[float, float]:
    """A range that shows the posterior, the kept estimates and the band."""
    seen = np.concatenate([np.quantile(draws, _SHOWN), kept, [mean - 2 * sd, mean + 2 * sd]])
    margin = 0.05 * (seen.max() - seen.min())
    return float(seen.min() - margin), float(seen.max() + margin)


def _arrows(panel: object, estimates: NDArray[np.float64], sizes: NDArray[np.int_], low: float, high: float) -> None:
    """Marks at the sides for estimates beyond them."""
    for beyond, at, marker in ((estimates < low, low, "<"), (estimates > high, high, ">")):
        for size in np.unique(sizes[beyond]):
            panel.scatter([at], [size], s=22, marker=marker, color="0.45", clip_on=False, zorder=4)  # type: ignore[attr-defined]
