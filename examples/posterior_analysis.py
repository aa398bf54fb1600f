"""Fit a measured board and look at its posterior.

The cantilevered spruce board of the paper: six modes, rounded to 1 Hz. The script fits it, prints the constants beside
the paper's least squares, and draws the posterior with the percentile method's band. It returns the numbers, so that
they can be tested; with a path it writes the figure there, and with a second one a corner plot of the constants.

    python examples/posterior_analysis.py figure.png corner.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import bayesplate

CARD = "finnish-spruce-cantilever"


def run(
    figure: Path | None = None, card: str = CARD, seed: int = 1, corner: Path | None = None
) -> dict[str, dict[str, float]]:
    """Fit a board and compare.

    Parameters
    ----------
    figure : Path, optional
        Where to write the figure, by its ending as PNG or SVG.
    card : str
    seed : int
    corner : Path, optional
        Where to write a corner plot of the constants, the paper's least squares marked.

    Returns
    -------
    dict
        For each of E_x, E_y, G_xy in GPa: posterior mean and sd, the paper's least squares, and the posterior
        probability that the constant lies within one percentile-method sd of that method's mean.
    """
    result = bayesplate.fit(card, seed=seed)
    summary = result.summary
    numbers = {}
    for name, entry in summary.elastic.items():
        percentile = summary.percentile[name]
        half_width = percentile.mean * percentile.sd_percent / 100
        inside = abs(result.draws.moduli[name] - percentile.mean) < half_width
        numbers[name] = {
            "mean": entry.mean / 1e9,
            "sd": entry.sd / 1e9,
            "least_squares": summary.least_squares[name] / 1e9,
            "within_percentile_band": float(inside.mean()),
        }
    if figure is not None:
        from bayesplate.report.constants import constants_figure

        constants_figure(summary, result.draws.moduli).savefig(figure, dpi=150)
    if corner is not None:
        from bayesplate.report.corner_plot import write_corner_plot

        columns = {f"{name}, GPa": values / 1e9 for name, values in result.draws.moduli.items()}
        marked = {f"{name}, GPa": row["least_squares"] for name, row in numbers.items()}
        write_corner_plot(corner, columns, marked)
    return numbers


if __name__ == "__main__":
    paths = [Path(argument) for argument in sys.argv[1:3]]
    for name, row in run(figure=next(iter(paths), None), corner=next(iter(paths[1:]), None)).items():
        print(
            f"{name:5s} {row['mean']:.3f} ± {row['sd']:.3f} GPa; least squares {row['least_squares']:.3f}; "
            f"{100 * row['within_percentile_band']:.0f} % of the posterior within the percentile method's ± sd"
        )
