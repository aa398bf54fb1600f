"""The figure of the sampler's health: the way of each ensemble, which should wander in one band and not part."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayesplate.posterior.inference import Inference
from bayesplate.report.style import BLUE, GREEN, LIGHT, ORANGE, SMALL, VERMILLION, Picture, legend_below, stacked
from bayesplate.report.symbols import in_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_STYLES = ((BLUE, "-"), (ORANGE, "-"), (GREEN, "-"), (VERMILLION, "-"))
_MOST_POINTS = 240
_SHOWN = (0.001, 0.999)


def health_picture(inference: Inference) -> Picture:
    """Draw the mean over the walkers of each ensemble, step by step.

    Parameters
    ----------
    inference : Inference

    Returns
    -------
    Picture
    """
    chains, convergence = inference.chains, inference.convergence
    n_ensembles, n_steps, _, _ = chains.draws.shape
    names = [*inference.problem.board.symmetry.free, "noise"]
    figure, panels = stacked([0.68] * len(names), left=0.62, right=0.25, top=0.26, bottom=0.78, gap=0.34)
    every = max(1, n_steps // _MOST_POINTS)
    steps = np.arange(0, n_steps, every)
    for i, (panel, name) in enumerate(zip(panels, names, strict=True)):
        means = np.exp(chains.draws[:, ::every, :, i].mean(axis=2)) * (100.0 if name == "noise" else 1.0)
        for k in range(n_ensembles):
            colour, line = _STYLES[k % len(_STYLES)]
            panel.plot(steps, means[k], color=colour, ls=line, lw=0.9, label=f"ensemble {k + 1}")
        if chains.burn_in:
            panel.axvspan(0, chains.burn_in, color=LIGHT, lw=0, zorder=0, label="left out: burn-in")
        settled = means[:, steps >= chains.burn_in]
        label = "noise, %" if name == "noise" else f"{in_figure(name)}, N m"
        _frame(panel, settled, label, n_steps, is_last=panel is panels[-1])
    legend_below(figure, panels[0].get_legend_handles_labels()[0], 3)
    alt = (
        f"{n_ensembles} ensembles over {n_steps} steps. Largest R-hat {convergence.rhat_max:.4f}, smallest effective "
        f"size {convergence.ess_min:.0f}, largest autocorrelation time {convergence.tau_max:.0f} steps."
    )
    caption = (
        "The mean of each ensemble's walkers. Lines that wander in one band, none apart and none drifting, are a good "
        "sign; the numbers below are the test."
    )
    return Picture("sampler", "How the sampler fared", alt, caption, figure)


def _frame(panel: Axes, settled: np.ndarray, label: str, n_steps: int, *, is_last: bool) -> None:
    low, high = np.quantile(settled, _SHOWN)
    margin = 0.25 * (high - low) + 1e-12
    panel.set(xlim=(0, n_steps), ylim=(low - margin, high + margin))
    panel.set_title(label, fontsize=SMALL, loc="left", pad=3)
    panel.ticklabel_format(axis="y", useOffset=False)
    panel.locator_params(axis="y", nbins=4)
    if is_last:
        panel.set_xlabel("step", fontsize=SMALL)
    else:
        panel.set_xticklabels([])
