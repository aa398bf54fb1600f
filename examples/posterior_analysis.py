"""Fit a measured board and look at its posterior.

The cantilevered spruce board of the paper: six modes, rounded to 1 Hz. The script fits it, prints the constants beside
the paper's least squares, and draws the posterior with the percentile method's band. It returns the numbers, so that
they can be tested; with a path it writes the figure there.

    python examples/posterior_analysis.py figure.png
"""

from __future__ import annotations

import sys
from pathlib import Path

import bayesplate

CARD = "finnish-spruce-cantilever"


def run(figure: Path | None = None, card: str = CARD, seed: int = 1) -> dict[str, dict[str, float]]:
    """Fit a board and compare.

    Parameters
    ----------
    figure : Path, optional
        Where to write the figure, by its ending as PNG or SVG.
    card : str
    seed : int

    Returns
    -------
    dict
        For each of E_x, E_y, G_xy in GPa: posterior mean and sd, the paper's least squares, and the posterior
        probability that the constant lies within one percentile-method sd of that method's mean.
    """
    result = bayesplate.fit(card, write=False, seed=seed)
    summary = result.summary
    numbers = {}
    for name, entry in summary["elastic"].items():
        percentile = summary["percentile"][name]
        half_width = percentile["mean"] * percentile["sd_percent"] / 100
        inside = abs(result.draws.moduli[name] - percentile["mean"]) < half_width
        numbers[name] = {
            "mean": entry["mean"] / 1e9,
            "sd": entry["sd"] / 1e9,
            "least_squares": summary["least_squares"][name] / 1e9,
            "within_percentile_band": float(inside.mean()),
        }
    if figure is not None:
        from bayesplate.report.constants import constants_figure

        constants_figure(summary, result.draws.moduli).savefig(figure, dpi=150)
    return numbers


if __name__ == "__main__":
    for name, row in run(Path(sys.argv[1]) if len(sys.argv) > 1 else None).items():
        print(
            f"{name:5s} {row['mean']:.3f} ± {row['sd']:.3f} GPa; least squares {row['least_squares']:.3f}; "
            f"{100 * row['within_percentile_band']:.0f} % of the posterior within the percentile method's ± sd"
        )
