"""The figure of prior and posterior: what was assumed of each quantity, and what the readings made of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.plate.board import Board
from bayesplate.plate.material import MODULI, RIGIDITIES
from bayesplate.plate.parameter import Parameter, unit_of_people
from bayesplate.plate.sessions import DISCREPANCY
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import PosedProblem
from bayesplate.quantities import Quantity
from bayesplate.report.style import BLACK, POSTERIOR, SMALL, WIDTH, Picture, legend_below, plain_axes, short
from bayesplate.report.symbols import in_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

MOST_PANELS = 18
_N_COLUMNS = 2
_PANEL, _ROW = (1.95, 0.6), 1.28
_LEFT, _TOP, _BOTTOM, _GAP = 0.15, 0.42, 0.32, 0.3
_BINS, _N_POINTS = 40, 240
_SHOWN = (0.001, 0.999)
_BEYOND = 1.2
_AS_BEFORE, _MOVED = 1.1, 0.25
_LONGEST = 30


@dataclass(frozen=True, eq=False)
class Compared:
    """A quantity with its prior and its draws: what a panel shows.

    Attributes
    ----------
    name, unit : str
    draws : (n_draws,) array
    log_density : callable
        Logarithm of the prior density at values in the same unit, up to a constant.
    is_logarithmic : bool
        Whether the density is one of the logarithm.
    prior_mean, prior_sd, posterior_mean, posterior_sd : float
        Of the logarithm, or of the quantity itself where it is not positive by nature.
    """

    name: str
    unit: str
    draws: Floats
    log_density: Callable[[Floats], Floats]
    is_logarithmic: bool
    prior_mean: float
    prior_sd: float
    posterior_mean: float
    posterior_sd: float

    @property
    def told(self) -> str:
        """What the readings made of it: how much narrower, or whether it was at least moved."""
        factor = self.prior_sd / self.posterior_sd
        if factor >= _AS_BEFORE:
            return f"{factor:.1f} times narrower" if factor < 10 else f"{factor:.0f} times narrower"
        if abs(self.posterior_mean - self.prior_mean) > _MOVED * self.prior_sd:
            return "moved, as wide as before"
        return "as before: nothing was learned"


def compared(problem: PosedProblem, draws: Draws) -> list[Compared]:
    """Everything that was given a prior and then sampled: constants, noise, uncertain inputs, effects."""
    found = []
    unit = {"E_x": ("GPa", 1e-9), "E_y": ("GPa", 1e-9), "G_xy": ("GPa", 1e-9)}
    constants = {**draws.moduli, **draws.rigidities}
    for name, stated in problem.prior.constants.items():
        told, factor = unit.get(name, ("N m", 1.0))
        prior = (np.log(factor * stated.median), stated.log_sd)
        found.append(_compared(name, told, constants[name] * factor, _of(stated.scaled(factor)), True, prior))
    for i, setup in enumerate(problem.board.setups):
        name = "noise" if len(problem.board.setups) == 1 else f"noise, {setup.name}"
        noise = setup.noise.scaled(100.0)
        prior = (np.log(noise.median), noise.log_sd)
        found.append(_compared(name, "%", 100.0 * draws.noise[..., i], _of(noise), True, prior))
    for one in filter(lambda one: one.is_listed, problem.board.uncertain):
        words, factor, told = input_words(one, problem.board)
        scaled = one.prior.scaled(factor)
        is_log = scaled.kind != "normal"
        prior = (np.log(scaled.median), scaled.log_sd) if is_log else (scaled.mean, scaled.sd)
        found.append(_compared(words, told, draws.inputs[one.name] * factor, _of(scaled), is_log, prior))
    return found


def input_words(parameter: Parameter, board: Board) -> tuple[str, float, str]:
    """What a parameter is called, the factor from SI, and its unit."""
    factor, unit = (100.0, "%") if parameter.key == DISCREPANCY else unit_of_people(parameter.unit)
    where = f" ({parameter.owner.name})" if parameter.owner.name and len(board.setups) > 1 else ""
    return f"{parameter.words or parameter.key}{where}", factor, unit


def priors_picture(problem: PosedProblem, draws: Draws) -> Picture:
    """Draw prior and posterior of everything sampled.

    Parameters
    ----------
    problem : PosedProblem
    draws : Draws

    Returns
    -------
    Picture
    """
    from matplotlib.figure import Figure

    quantities = compared(problem, draws)
    shown = quantities[:MOST_PANELS]
    n_rows = -(-len(shown) // _N_COLUMNS)
    height = _TOP + n_rows * _ROW + _BOTTOM - 0.2
    figure = Figure(figsize=(WIDTH, height))
    for i, one in enumerate(shown):
        row, column = divmod(i, _N_COLUMNS)
        left, bottom = _LEFT + column * (_PANEL[0] + _GAP), height - _TOP - row * _ROW - _PANEL[1]
        panel = figure.add_axes((left / WIDTH, bottom / height, _PANEL[0] / WIDTH, _PANEL[1] / height))
        plain_axes(panel)
        _draw(panel, one)
        if i == 0:
            handles = panel.get_legend_handles_labels()[0]
    legend_below(figure, handles, 2)
    told = "; ".join(f"{one.name}: {one.told}" for one in shown)
    left_out = f" {len(quantities) - len(shown)} more are not drawn." if len(quantities) > len(shown) else ""
    caption = (
        "Each curve has its own height. A dashed line that runs across the whole panel is a prior much wider than it: "
        "it has little say. Where both look alike, the answer is what was assumed." + left_out
    )
    return Picture("priors", "What was assumed, and what the readings made of it", f"{told}.", caption, figure)


def _draw(panel: Axes, one: Compared) -> None:
    """Both densities on the quantity's own axis, each to its own height; how much narrower the second is."""
    low, high = np.quantile(one.draws, _SHOWN)
    reach = _BEYOND * (high - low) / 2
    ends = (max(low - reach, 0.0) if one.is_logarithmic else low - reach, high + reach)
    density, bins = np.histogram(one.draws, bins=_BINS, range=ends)
    panel.stairs(density / density.max(), bins, fill=True, color=POSTERIOR, alpha=0.4, lw=0, label="after: posterior")
    grid = np.linspace(*ends, _N_POINTS + 1)[1:]
    prior = one.log_density(grid) - (np.log(grid) if one.is_logarithmic else 0.0)
    peak = np.max(prior[np.isfinite(prior)]) if np.isfinite(prior).any() else 0.0
    panel.plot(grid, np.exp(prior - peak), color=BLACK, lw=1.2, ls="--", label="before: prior")
    panel.set(xlim=ends, ylim=(0, 1.08), yticks=[])
    panel.spines["left"].set_visible(False)
    panel.locator_params(axis="x", nbins=4)
    title = short(f"{one.name}, {one.unit}" if one.unit else one.name, _LONGEST)
    is_ours = one.name in (*MODULI, *RIGIDITIES)
    title = in_figure(title) if is_ours else title
    panel.set_title(title, fontsize=SMALL, loc="left", weight="bold", pad=12, parse_math=is_ours)
    panel.text(0.0, 1.04, one.told, transform=panel.transAxes, va="bottom", fontsize=SMALL - 0.5)


def _compared(
    name: str,
    unit: str,
    draws: Floats,
    log_density: Callable[[Floats], Floats],
    is_log: bool,
    prior: tuple[float, float],
) -> Compared:
    flat = np.asarray(draws).ravel()
    values = np.log(flat) if is_log else flat
    mean, sd = (float(number) for number in prior)
    return Compared(name, unit, flat, log_density, is_log, mean, sd, float(values.mean()), float(values.std()))


def _of(quantity: Quantity) -> Callable[[Floats], Floats]:
    """The density of what the panel draws: of the logarithm of a positive quantity, of the other ones themselves."""
    if quantity.kind == "normal":
        return quantity.log_density
    return lambda value: quantity.log_density_of_log(np.log(value))
