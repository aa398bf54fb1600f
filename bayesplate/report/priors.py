"""The figure of prior and posterior: what was assumed of each quantity, and what the readings made of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.effects import effects_of, is_effect_parameter
from bayesplate.effects.words import effect_name
from bayesplate.plate.board import Board
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Problem
from bayesplate.quantities import Quantity
from bayesplate.report.style import BLACK, POSTERIOR, SMALL, WIDTH, Picture, legend_below, plain_axes, short

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
INPUT_WORDS = {
    "length_x": ("length along the grain", 1e3, "mm"),
    "length_y": ("length across the grain", 1e3, "mm"),
    "thickness": ("thickness", 1e3, "mm"),
    "mass": ("mass", 1e3, "g"),
    "density": ("density", 1.0, "kg/m³"),
    "poisson_xy": ("Poisson ratio nu_xy", 1.0, ""),
}
"""Name, factor from SI, and unit of the inputs of a card, as people say them."""


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


def compared(problem: Problem, draws: Draws) -> list[Compared]:
    """Everything that was given a prior and then sampled: constants, noise, uncertain inputs, effects."""
    found = []
    unit = {"E_x": ("GPa", 1e-9), "E_y": ("GPa", 1e-9), "G_xy": ("GPa", 1e-9)}
    constants = {**draws.moduli, **draws.rigidities}
    for name, density in problem.prior.densities.items():
        told, factor = unit.get(name, ("N m", 1.0))
        log_density = _scaled(density.log_density, factor)
        prior = (density.log_mean + np.log(factor), density.log_sd)
        found.append(_compared(name, told, constants[name] * factor, log_density, True, prior))
    for i, setup in enumerate(problem.board.setups):
        name = "noise" if len(problem.board.setups) == 1 else f"noise, {setup.name}"
        noise = setup.noise.scaled(100.0)
        prior = (np.log(noise.median), noise.log_sd)
        found.append(_compared(name, "%", 100.0 * draws.noise[..., i], _of(noise), True, prior))
    for name, quantity in problem.board.uncertain_inputs.items():
        words, factor, told = input_words(name, problem.board)
        scaled = quantity.scaled(factor)
        is_log = quantity.kind == "log-normal"
        prior = (np.log(scaled.median), scaled.log_sd) if is_log else (scaled.mean, scaled.sd)
        found.append(_compared(words, told, draws.inputs[name] * factor, _of(scaled), is_log, prior))
    return found


def input_words(name: str, board: Board) -> tuple[str, float, str]:
    """What an input is called, the factor from SI, and its unit; parameters of effects keep their names."""
    if name in INPUT_WORDS:
        return INPUT_WORDS[name]
    if is_effect_parameter(name):
        effect, _, rest = name.partition(".")
        parameter, _, setup = rest.rstrip("]").partition("[")
        where = f" ({setup})" if setup and len(board.setups) > 1 else ""
        factor, unit = people_use(_unit(name, board))
        return f"{parameter} of {effect_name(effect)}{where}", factor, unit
    if name.startswith("clamped_"):
        edge, _, setup = name.removeprefix("clamped_").rstrip("]").partition("[")
        return f"covered by the clamp on {edge} ({setup})", 1e3, "mm"
    return name, 1.0, ""


def people_use(unit: str) -> tuple[float, str]:
    """Factor from an SI unit to the one that people use, and its name."""
    return {"Pa": (1e-9, "GPa"), "m": (1e3, "mm"), "kg": (1e3, "g"), "1": (1.0, "")}.get(unit, (1.0, unit))


def _unit(name: str, board: Board) -> str:
    """SI unit of a parameter of a declared effect."""
    for setup in board.setups:
        for effect in effects_of(board, setup):
            for parameter in effect.parameters():
                if effect.key(parameter.name) == name:
                    return parameter.unit
    return "SI"


def priors_picture(problem: Problem, draws: Draws) -> Picture:
    """Draw prior and posterior of everything sampled.

    Parameters
    ----------
    problem : Problem
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
    panel.set_title(title, fontsize=SMALL, loc="left", weight="bold", pad=12, parse_math=False)
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


def _scaled(log_density: Callable[[Floats], Floats], factor: float) -> Callable[[Floats], Floats]:
    """A density of ln(value in SI) at values in another unit."""
    return lambda value: np.asarray(log_density(np.log(value / factor)))


def _of(quantity: Quantity) -> Callable[[Floats], Floats]:
    return lambda value: np.asarray(quantity.log_prior(quantity.standard(value)))
