"""Figures of prior and posterior of every quantity, and of the ensembles step by step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.board.parameter import Parameter, display_unit
from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import DISCREPANCY
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.report.style import (
    BLACK,
    BLUE,
    FIGURE_WIDTH,
    GREEN,
    LIGHT,
    ORANGE,
    SMALL_SIZE,
    VERMILLION,
    Picture,
    axis_range,
    draw_density,
    draw_legend,
    mathtext,
    place_panel,
    shorten,
    stacked_panels,
)
from bayesplate.results.words import GPA

if TYPE_CHECKING:
    from matplotlib.axes import Axes


MOST_PANELS = 18
_PANEL, _ROW = (1.95, 0.6), 1.28
_LEFT, _TOP, _BOTTOM, _GAP = 0.15, 0.42, 0.12, 0.3
_N_POINTS = 240
_MARGIN = 0.6
_UNCHANGED_FACTOR, _MOVED_SD = 1.1, 0.25
_LONGEST = 28


@dataclass(frozen=True, eq=False)
class SampledQuantity:
    """A quantity with its draws, (n_draws,), and its prior, in one unit."""

    name: str
    unit: str
    draws: Floats
    prior: Quantity

    @property
    def change_text(self) -> str:
        """How the posterior differs from the prior: narrower or moved; by logarithms for a positive quantity."""
        is_log = self.prior.kind != "normal"
        draws = np.log(self.draws) if is_log else self.draws
        mean, sd = (np.log(self.prior.median), self.prior.log_sd) if is_log else (self.prior.mean, self.prior.sd)
        factor = sd / draws.std()
        if factor >= _UNCHANGED_FACTOR:
            return f"{factor:.1f} times narrower" if factor < 10 else f"{factor:.0f} times narrower"
        if abs(draws.mean() - mean) > _MOVED_SD * sd:
            return "moved, as wide as before"
        return "as before: nothing was learned"


def sampled_quantities(draws: Draws) -> list[SampledQuantity]:
    """All quantities with a prior that were sampled: constants, noise, uncertain inputs, effects."""
    problem = draws.problem
    constants, setups = {**draws.moduli, **draws.rigidities}, problem.board.setups
    units = {name: ("GPa", GPA) if name in MODULI else ("N m", 1.0) for name in constants}
    rows = [(name, *units[name], constants[name], prior) for name, prior in problem.prior.constants.items()]
    for i, setup in enumerate(setups):
        name = "noise" if len(setups) == 1 else f"noise, {setup.name}"
        rows.append((name, "%", 100.0, draws.noise[..., i], setup.noise))
    for parameter in problem.board.uncertain:
        if parameter.is_listed:
            words, factor, unit = input_words(parameter, problem.board)
            rows.append((words, unit, factor, draws.inputs[parameter.name], parameter.prior))
    return [
        SampledQuantity(name, unit, np.ravel(values) * factor, prior.scaled(factor))
        for name, unit, factor, values, prior in rows
    ]


def input_words(parameter: Parameter, board: Board) -> tuple[str, float, str]:
    """Name of a parameter in words, the factor from SI, and its display unit."""
    factor, unit = (100.0, "%") if parameter.key == DISCREPANCY else display_unit(parameter.unit)
    owner = f" ({parameter.owner.name})" if parameter.owner.name and len(board.setups) > 1 else ""
    return f"{parameter.display_name or parameter.key}{owner}", factor, unit


def priors_picture(draws: Draws) -> Picture:
    """Prior and posterior of the sampled quantities, at most `MOST_PANELS` of them."""
    from matplotlib.figure import Figure

    all_quantities = sampled_quantities(draws)
    quantities = all_quantities[:MOST_PANELS]
    height = _TOP + -(-len(quantities) // 2) * _ROW + _BOTTOM
    figure = Figure(figsize=(FIGURE_WIDTH, height))
    for i, quantity in enumerate(quantities):
        row, column = divmod(i, 2)
        left, bottom = _LEFT + column * (_PANEL[0] + _GAP), height - _TOP - row * _ROW - _PANEL[1]
        _draw_densities(place_panel(figure, left, bottom, *_PANEL), quantity)
    draw_legend(figure, 2)
    details = "; ".join(f"{quantity.name}: {quantity.change_text}" for quantity in quantities)
    omission = (
        f" {len(all_quantities) - len(quantities)} more are not drawn." if len(all_quantities) > len(quantities) else ""
    )
    caption = (
        "Each curve has its own height. A dashed line that runs across the whole panel is a prior much wider than it: "
        "it has little say. Where both look alike, the answer is what was assumed." + omission
    )
    return Picture("priors", "What was assumed, and what the readings made of it", f"{details}.", caption, figure)


def _draw_densities(panel: Axes, quantity: SampledQuantity) -> None:
    """Prior and posterior density, each scaled to its own height, and how much narrower the posterior is."""
    low, high = axis_range(quantity.draws, margin=_MARGIN)
    ends = (low if quantity.prior.kind == "normal" else max(low, 0.0), high)
    draw_density(panel, quantity.draws, ends, label="after: posterior")
    grid = np.linspace(*ends, _N_POINTS + 1)[1:]
    prior = np.exp(quantity.prior.log_density(grid))
    panel.plot(grid, prior / (prior.max() or 1.0), color=BLACK, lw=1.2, ls="--", label="before: prior")
    panel.set(xlim=ends, ylim=(0, 1.08), yticks=[])
    panel.spines["left"].set_visible(False)
    panel.locator_params(axis="x", nbins=4)
    is_constant = quantity.name in (*MODULI, *RIGIDITIES)
    name = mathtext(quantity.name) if is_constant else shorten(quantity.name, _LONGEST - len(quantity.unit))
    title = f"{name}, {quantity.unit}" if quantity.unit else name
    panel.set_title(title, fontsize=SMALL_SIZE, loc="left", weight="bold", pad=12, parse_math=is_constant)
    panel.text(0.0, 1.04, quantity.change_text, transform=panel.transAxes, va="bottom", fontsize=SMALL_SIZE - 0.5)


_COLOURS = (BLUE, ORANGE, GREEN, VERMILLION)
_MOST_POINTS = 240


def health_picture(inference: Inference) -> Picture:
    """Mean over the walkers of each ensemble, step by step."""
    convergence = inference.convergence
    ensemble_means, burn_in = inference.chains.draws.mean(axis=2), inference.chains.burn_in
    n_ensembles, n_steps, _ = ensemble_means.shape
    setups = inference.problem.board.setups
    names = [*inference.problem.board.symmetry.free, "noise"]
    noise_title = "noise, %" if len(setups) == 1 else f"noise of setup {setups[0].name}, %"
    figure, panels = stacked_panels([0.68] * len(names), left=0.62, right=0.25, top=0.26, bottom=0.78, gap=0.34)
    steps = np.arange(0, n_steps, max(1, n_steps // _MOST_POINTS))
    for i, (panel, name) in enumerate(zip(panels, names, strict=True)):
        means = np.exp(ensemble_means[:, steps, i]) * (100.0 if name == "noise" else 1.0)
        for k in range(n_ensembles):
            panel.plot(steps, means[k], color=_COLOURS[k % len(_COLOURS)], lw=0.9, label=f"ensemble {k + 1}")
        if burn_in:
            panel.axvspan(0, burn_in, color=LIGHT, lw=0, zorder=0, label="left out: burn-in")
        panel.set(xlim=(0, n_steps), ylim=axis_range(means[:, steps >= burn_in], margin=0.25))
        panel.set_title(
            noise_title if name == "noise" else f"{mathtext(name)}, N m", fontsize=SMALL_SIZE, loc="left", pad=3
        )
        panel.ticklabel_format(axis="y", useOffset=False)
        panel.locator_params(axis="y", nbins=4)
        panel.tick_params(labelbottom=panel is panels[-1])
    panels[-1].set_xlabel("step")
    draw_legend(figure, 3)
    alt = (
        f"{n_ensembles} ensembles over {n_steps} steps. Largest R-hat {convergence.rhat_max:.4f}, smallest effective "
        f"size {convergence.ess_min:.0f}, largest autocorrelation time {convergence.tau_max:.0f} steps."
    )
    caption = (
        "The mean of each ensemble's walkers. Lines that wander in one band, none apart and none drifting, are a good "
        "sign; the numbers below are the test."
    )
    return Picture("sampler", "How the sampler fared", alt, caption, figure)
