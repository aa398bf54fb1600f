"""The figure of the constants: each posterior beside the paper's least squares and its percentile band."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_GPA = 1e9
_TITLES = {
    "E_x": "E_x: stiffness along the grain",
    "E_y": "E_y: stiffness across the grain",
    "G_xy": "G_xy: shear stiffness",
}
# Okabe and Ito's colours, told apart by colour-blind eyes, and unlike in grey.
POSTERIOR, PAPER, WEIGHTED = "#0072B2", "#E69F00", "#000000"
_BINS = 60


def constants_figure(summary: Mapping[str, Any], moduli: Mapping[str, NDArray[np.float64]]) -> Figure:
    """Posterior of E_x, E_y and G_xy, with the point estimates that people know.

    Parameters
    ----------
    summary : dict
        As in summary.json.
    moduli : dict of array, Pa
        Draws of each modulus.

    Returns
    -------
    matplotlib.figure.Figure
        Three panels, GPa; no state of pyplot is touched.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    panels = figure.subplots(1, 3)
    for panel, (name, title) in zip(panels, _TITLES.items(), strict=True):
        draws = np.asarray(moduli[name]).ravel() / _GPA
        entry = {key: value / _GPA for key, value in summary["elastic"][name].items() if key != "unit"}
        shown = np.quantile(draws, [0.002, 0.998])
        panel.hist(draws, bins=_BINS, range=tuple(shown), density=True, color=POSTERIOR, alpha=0.35, lw=0)
        panel.axvspan(entry["q05"], entry["q95"], ymax=0.04, color=POSTERIOR, lw=0, label="posterior, bar: 90 %")
        percentile = summary["percentile"]
        if percentile is not None and percentile[name]["mean"] is not None:
            mean = percentile[name]["mean"] / _GPA
            sd = mean * (percentile[name]["sd_percent"] or 0.0) / 100.0
            panel.axvspan(mean - sd, mean + sd, ymin=0.06, ymax=0.10, color=PAPER, lw=0)
            panel.plot([], [], color=PAPER, lw=5, label="percentile method ± its sd")
        least_squares = summary["weighted_least_squares"][name] / _GPA
        panel.axvline(least_squares, color=WEIGHTED, ls="--", lw=1.2, label="weighted least squares")
        panel.set_title(title, fontsize=10)
        panel.set_xlabel(f"GPa    ({entry['mean']:.3g} ± {entry['sd']:.2g})")
        panel.set_yticks([])
        panel.spines[["top", "right", "left"]].set_visible(False)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    figure.suptitle(f"{summary['name']}: what {len(summary['modes'])} modes tell", fontsize=11)
    return figure
