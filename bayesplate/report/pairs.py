"""The corner plot: every pair of the constants, the noise and the inputs that matter most, drawn against each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import PosedProblem
from bayesplate.report.priors import input_words
from bayesplate.report.style import BLACK, POSTERIOR, SMALL, WIDTH, Picture, plain_axes, short
from bayesplate.report.symbols import in_figure, is_symbol
from bayesplate.results.budget import input_shares
from bayesplate.results.words import GPA

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

MOST = 6
"""Columns: more cannot be read on a phone."""

_HELD = (0.5, 0.9)
_BINS, _SMOOTHING = 40, 1.6
_SHOWN = (0.002, 0.998)
_LEFT, _BOTTOM, _TOP, _RIGHT, _GAP = 0.72, 0.72, 0.08, 0.12, 0.07
_STRONG = 0.5
_LARGE = 0.75
_CHARACTERS_AN_INCH = 17
_BRIEF = {
    "length along the grain": "length",
    "length across the grain": "width",
    " profile": "",
    " of transverse shear": "",
    "Poisson ratio ": "",
}


def pairs_picture(problem: PosedProblem, draws: Draws) -> Picture:
    """Draw the pairs.

    Parameters
    ----------
    problem : PosedProblem
    draws : Draws

    Returns
    -------
    Picture
    """
    from matplotlib.figure import Figure

    columns = chosen(problem, draws)
    n = len(columns)
    names = list(columns)
    side = (WIDTH - _LEFT - _RIGHT - (n - 1) * _GAP) / n
    height = _TOP + n * side + (n - 1) * _GAP + _BOTTOM
    figure = Figure(figsize=(WIDTH, height))
    limits = {name: _limits(values) for name, values in columns.items()}
    for i, across in enumerate(names):
        for j, along in enumerate(names[: i + 1]):
            left, bottom = _LEFT + j * (side + _GAP), _BOTTOM + (n - 1 - i) * (side + _GAP)
            panel = figure.add_axes((left / WIDTH, bottom / height, side / WIDTH, side / height))
            plain_axes(panel)
            panel.set_xlim(limits[along])
            if i == j:
                density, bins = np.histogram(columns[along], bins=_BINS, range=limits[along])
                panel.stairs(density, bins, fill=True, color=POSTERIOR, alpha=0.4, lw=0)
                panel.set_yticks([])
                panel.spines["left"].set_visible(False)
            else:
                panel.set_ylim(limits[across])
                _draw_pair(panel, columns[along], columns[across], (limits[along], limits[across]))
            _label(panel, along if i == n - 1 else "", across if j == 0 and i > 0 else "", side)
    strong = _strong(columns)
    told = _told(strong) if strong else "No pair hangs together strongly."
    alt = f"Draws in pairs of {', '.join(name.partition(',')[0] for name in names)}. {told}"
    caption = (
        "Each square shows two quantities at once; the lines hold half and nine tenths of the probability. A slanted "
        "shape means that an error in one would be made up for by the other."
    )
    return Picture("corner", "Which quantities hang together", alt, caption, figure)


def chosen(problem: PosedProblem, draws: Draws) -> dict[str, Floats]:
    """Moduli in GPa, the noise of each setup in %, and the inputs with the largest share in the moduli's variance."""
    columns = {f"{name}, GPa": values.ravel() * GPA for name, values in draws.moduli.items()}
    setups = problem.board.setups
    for i, setup in enumerate(setups[: MOST - len(columns) - 1]):
        columns["noise, %" if len(setups) == 1 else f"noise {setup.name}, %"] = 100.0 * draws.noise[..., i].ravel()
    shares = input_shares(draws)
    largest = {name: max(by_input[name] for by_input in shares.values()) for name in draws.inputs}
    every = {one.name: one for one in problem.board.uncertain if one.is_listed}
    for name in sorted(every, key=lambda one: -largest[one])[: MOST - len(columns)]:
        words, factor, unit = input_words(every[name], problem.board)
        columns[f"{words}, {unit}" if unit else words] = draws.inputs[name].ravel() * factor
    return columns


def _draw_pair(panel: Axes, x: Floats, y: Floats, limits: tuple[tuple[float, float], tuple[float, float]]) -> None:
    """Contours that hold fixed shares of the draws, from a smoothed count."""
    from scipy.ndimage import gaussian_filter

    counts, edges_x, edges_y = np.histogram2d(x, y, bins=_BINS, range=limits)
    density = gaussian_filter(counts, _SMOOTHING)
    ordered = np.sort(density.ravel())[::-1]
    held = np.cumsum(ordered) / ordered.sum()
    levels = sorted({float(ordered[np.searchsorted(held, share)]) for share in _HELD})
    middles_x, middles_y = (edges[:-1] + np.diff(edges) / 2 for edges in (edges_x, edges_y))
    top = float(density.max()) * 1.01
    colours = ["#C7DDED", "#7FB3D6"][-len(levels) :]
    panel.contourf(middles_x, middles_y, density.T, levels=[*levels, top], colors=colours)
    panel.contour(middles_x, middles_y, density.T, levels=levels, colors=BLACK, linewidths=0.7)


def _label(panel: Axes, below: str, beside: str, side: float) -> None:
    """Names at the foot and at the left of the figure only, all in one line."""
    panel.locator_params(nbins=3 if side > _LARGE else 2)
    panel.xaxis.set_label_coords(0.5, -0.42 / side)
    panel.yaxis.set_label_coords(-0.4 / side, 0.5)
    panel.tick_params(labelsize=SMALL - 1.5)
    if below:
        panel.tick_params(axis="x", labelrotation=45)
        text, is_math = _broken(below, side)
        panel.set_xlabel(text, fontsize=SMALL - 1, parse_math=is_math)
    else:
        panel.set_xticklabels([])
    if beside:
        text, is_math = _broken(beside, side)
        panel.set_ylabel(text, fontsize=SMALL - 1, parse_math=is_math)
    elif panel.get_yticks().size:
        panel.set_yticklabels([])


def _broken(name: str, side: float) -> tuple[str, bool]:
    """A name in two lines, below its unit or its effect, each no longer than the panel; whether it is a symbol."""
    for words, brief in _BRIEF.items():
        name = name.replace(words, brief)
    if is_symbol(name):
        return in_figure(name).replace(", ", ",\n"), True
    first, comma, below = name.rpartition(", ") if ", " in name else name.partition(" of ")
    longest = int(_CHARACTERS_AN_INCH * side)
    return f"{short(first, longest)}{',' if comma else ''}\n{short(below, longest)}", False


def _limits(values: Floats) -> tuple[float, float]:
    low, high = np.quantile(values, _SHOWN)
    margin = 0.06 * (high - low)
    return float(low - margin), float(high + margin)


def _strong(columns: dict[str, Floats]) -> list[tuple[str, str, float]]:
    """Pairs whose correlation is strong."""
    names = [name.partition(",")[0] for name in columns]
    matrix = np.atleast_2d(np.corrcoef(np.stack(list(columns.values()))))
    return [
        (names[j], names[i], float(matrix[i, j]))
        for i in range(len(names))
        for j in range(i)
        if abs(matrix[i, j]) > _STRONG
    ]


def _told(pairs: list[tuple[str, str, float]]) -> str:
    return "Correlated: " + "; ".join(f"{one} with {other} ({value:+.2f})" for one, other, value in pairs) + "."
