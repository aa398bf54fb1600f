"""The figure of the sampler's health: the way of each ensemble, which should wander in one band and not part."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.posterior.inference import Inference
from bayesplate.report.style import (
    BLUE,
    GREEN,
    LIGHT,
    ORANGE,
    SMALL,
    VERMILLION,
    Picture,
    in_figure,
    legend_below,
    limits,
    stacked,
)

_COLOURS = (BLUE, ORANGE, GREEN, VERMILLION)
_MOST_POINTS = 240


def health_picture(inference: Inference) -> Picture:
    """The mean over the walkers of each ensemble, step by step."""
    convergence = inference.convergence
    ways, burn_in = _ways(inference)
    n_ensembles, n_steps, _ = ways.shape
    names = [*inference.problem.board.symmetry.free, "noise"]
    figure, panels = stacked([0.68] * len(names), left=0.62, right=0.25, top=0.26, bottom=0.78, gap=0.34)
    steps = np.arange(0, n_steps, max(1, n_steps // _MOST_POINTS))
    for i, (panel, name) in enumerate(zip(panels, names, strict=True)):
        means = np.exp(ways[:, steps, i]) * (100.0 if name == "noise" else 1.0)
        for k in range(n_ensembles):
            panel.plot(steps, means[k], color=_COLOURS[k % len(_COLOURS)], lw=0.9, label=f"ensemble {k + 1}")
        if burn_in:
            panel.axvspan(0, burn_in, color=LIGHT, lw=0, zorder=0, label="left out: burn-in")
        panel.set(xlim=(0, n_steps), ylim=limits(means[:, steps >= burn_in], margin=0.25))
        panel.set_title("noise, %" if name == "noise" else f"{in_figure(name)}, N m", fontsize=SMALL, loc="left", pad=3)
        panel.ticklabel_format(axis="y", useOffset=False)
        panel.locator_params(axis="y", nbins=4)
        panel.tick_params(labelbottom=panel is panels[-1])
    panels[-1].set_xlabel("step")
    legend_below(figure, 3)
    alt = (
        f"{n_ensembles} ensembles over {n_steps} steps. Largest R-hat {convergence.rhat_max:.4f}, smallest effective "
        f"size {convergence.ess_min:.0f}, largest autocorrelation time {convergence.tau_max:.0f} steps."
    )
    caption = (
        "The mean of each ensemble's walkers. Lines that wander in one band, none apart and none drifting, are a good "
        "sign; the numbers below are the test."
    )
    return Picture("sampler", "How the sampler fared", alt, caption, figure)


def _ways(inference: Inference) -> tuple[NDArray[np.float64], int]:
    """Mean over the walkers of each ensemble, step by step, (n_ensembles, n_steps, n_dim), and the steps of burn-in."""
    return inference.chains.draws.mean(axis=2), inference.chains.burn_in
