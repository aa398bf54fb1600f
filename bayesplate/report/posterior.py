"""Prior and posterior of every quantity, and the way of each ensemble."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.board.parameter import Parameter, unit_of_people
from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import DISCREPANCY
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.posing import PosedProblem
from bayesplate.report.style import (
    BLACK,
    BLUE,
    GREEN,
    LIGHT,
    ORANGE,
    SMALL,
    VERMILLION,
    WIDTH,
    Picture,
    hump,
    in_figure,
    legend_below,
    limits,
    placed,
    short,
    stacked,
)
from bayesplate.results.words import GPA

if TYPE_CHECKING:
    from matplotlib.axes import Axes


MOST_PANELS = 18
_PANEL, _ROW = (1.95, 0.6), 1.28
_LEFT, _TOP, _BOTTOM, _GAP = 0.15, 0.42, 0.12, 0.3
_N_POINTS = 240
_MARGIN = 0.6
_AS_BEFORE, _MOVED = 1.1, 0.25
_LONGEST = 28


@dataclass(frozen=True, eq=False)
class Compared:
    """A quantity with its draws, (n_draws,), and its prior, in one unit: what a panel shows."""

    name: str
    unit: str
    draws: Floats
    prior: Quantity

    @property
    def told(self) -> str:
        """What the readings made of it: how much narrower, or moved; of what is positive, by its logarithm."""
        is_log = self.prior.kind != "normal"
        draws = np.log(self.draws) if is_log else self.draws
        mean, sd = (np.log(self.prior.median), self.prior.log_sd) if is_log else (self.prior.mean, self.prior.sd)
        factor = sd / draws.std()
        if factor >= _AS_BEFORE:
            return f"{factor:.1f} times narrower" if factor < 10 else f"{factor:.0f} times narrower"
        if abs(draws.mean() - mean) > _MOVED * sd:
            return "moved, as wide as before"
        return "as before: nothing was learned"


def compared(problem: PosedProblem, draws: Draws) -> list[Compared]:
    """Everything that was given a prior and then sampled: constants, noise, uncertain inputs, effects."""
    constants, setups = {**draws.moduli, **draws.rigidities}, problem.board.setups
    units = {name: ("GPa", GPA) if name in MODULI else ("N m", 1.0) for name in constants}
    stated = [(name, *units[name], constants[name], prior) for name, prior in problem.prior.constants.items()]
    for i, setup in enumerate(setups):
        name = "noise" if len(setups) == 1 else f"noise, {setup.name}"
        stated.append((name, "%", 100.0, draws.noise[..., i], setup.noise))
    for one in problem.board.uncertain:
        if one.is_listed:
            words, factor, unit = input_words(one, problem.board)
            stated.append((words, unit, factor, draws.inputs[one.name], one.prior))
    return [
        Compared(name, unit, np.ravel(values) * factor, prior.scaled(factor))
        for name, unit, factor, values, prior in stated
    ]


def input_words(parameter: Parameter, board: Board) -> tuple[str, float, str]:
    """What a parameter is called, the factor from SI, and its unit."""
    factor, unit = (100.0, "%") if parameter.key == DISCREPANCY else unit_of_people(parameter.unit)
    where = f" ({parameter.owner.name})" if parameter.owner.name and len(board.setups) > 1 else ""
    return f"{parameter.words or parameter.key}{where}", factor, unit


def priors_picture(problem: PosedProblem, draws: Draws) -> Picture:
    """Prior and posterior of everything sampled, as far as there is room."""
    from matplotlib.figure import Figure

    quantities = compared(problem, draws)
    shown = quantities[:MOST_PANELS]
    height = _TOP + -(-len(shown) // 2) * _ROW + _BOTTOM
    figure = Figure(figsize=(WIDTH, height))
    for i, one in enumerate(shown):
        row, column = divmod(i, 2)
        left, bottom = _LEFT + column * (_PANEL[0] + _GAP), height - _TOP - row * _ROW - _PANEL[1]
        _draw_both(placed(figure, left, bottom, *_PANEL), one)
    legend_below(figure, 2)
    told = "; ".join(f"{one.name}: {one.told}" for one in shown)
    left_out = f" {len(quantities) - len(shown)} more are not drawn." if len(quantities) > len(shown) else ""
    caption = (
        "Each curve has its own height. A dashed line that runs across the whole panel is a prior much wider than it: "
        "it has little say. Where both look alike, the answer is what was assumed." + left_out
    )
    return Picture("priors", "What was assumed, and what the readings made of it", f"{told}.", caption, figure)


def _draw_both(panel: Axes, one: Compared) -> None:
    """Both densities on the quantity's own axis, each to its own height; how much narrower the second is."""
    low, high = limits(one.draws, margin=_MARGIN)
    ends = (low if one.prior.kind == "normal" else max(low, 0.0), high)
    hump(panel, one.draws, ends, label="after: posterior")
    grid = np.linspace(*ends, _N_POINTS + 1)[1:]
    prior = np.exp(one.prior.log_density(grid))
    panel.plot(grid, prior / (prior.max() or 1.0), color=BLACK, lw=1.2, ls="--", label="before: prior")
    panel.set(xlim=ends, ylim=(0, 1.08), yticks=[])
    panel.spines["left"].set_visible(False)
    panel.locator_params(axis="x", nbins=4)
    is_ours = one.name in (*MODULI, *RIGIDITIES)
    name = in_figure(one.name) if is_ours else short(one.name, _LONGEST - len(one.unit))
    title = f"{name}, {one.unit}" if one.unit else name
    panel.set_title(title, fontsize=SMALL, loc="left", weight="bold", pad=12, parse_math=is_ours)
    panel.text(0.0, 1.04, one.told, transform=panel.transAxes, va="bottom", fontsize=SMALL - 0.5)


_COLOURS = (BLUE, ORANGE, GREEN, VERMILLION)
_MOST_POINTS = 240


def health_picture(inference: Inference) -> Picture:
    """The mean over the walkers of each ensemble, step by step."""
    convergence = inference.convergence
    ways, burn_in = inference.chains.draws.mean(axis=2), inference.chains.burn_in
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
