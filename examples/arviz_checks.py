"""ArviZ on a fit: what its diagnostics say of the draws, the prior and each reading.

`result.to_arviz()` holds the draws as ArviZ works with them, without a file. It computes its own R-hat and effective
sizes, says how much a constant moves when the prior or the likelihood is raised to a power a little above or below one,
and leaves one reading out by weighing the draws. Where a Pareto k exceeds 0.7 the draws cannot stand for a posterior
that has not seen that reading, and their Monte Carlo error is too small as well; with six readings this is common, and
it is why the package refits for its own errors. Beside the weights stands what a refit without the reading gives, where
the other readings determine the constants.

    python examples/arviz_checks.py pareto.png
"""

from __future__ import annotations

import sys
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import bayesplate

with warnings.catch_warnings():
    warnings.simplefilter("ignore", FutureWarning)  # ArviZ 0.23 tells of its version 1
    import arviz

CARD = "fiemme-spruce-clamped"
CONSTANTS = ("E_x", "E_y", "G_xy")
UNRELIABLE = 0.7


def run(figure: Path | None = None, card: str = CARD, seed: int = 1) -> dict[str, Any]:
    """Fit a board and let ArviZ judge.

    Parameters
    ----------
    figure : Path, optional
        Where to write the figure of the Pareto k, by its ending as PNG or SVG.
    card : str
    seed : int

    Returns
    -------
    dict
        rhat_max, ess_min: of the constants by ArviZ, and `own` by the package, of the sampled columns; likelihood,
        constants, noise: sensitivity of each constant to the likelihood, and to the prior of either; by reading:
        pareto_k, leverage, weighed and refitted (ln density of the reading given the others, by ArviZ's weights and by
        refits, with its Monte Carlo error; None where the others leave a constant open), left_out_cents (the package's
        own error); and effective_parameters.
    """
    result = bayesplate.fit(card, seed=seed)
    data = result.to_arviz()
    names = list(CONSTANTS)
    table = arviz.summary(data, var_names=names, round_to=8)
    loo = left_out(data)
    by_reading = loo.elpd_i if hasattr(loo, "elpd_i") else loo.loo_i  # ArviZ 1.x and 0.23
    own = result.summary.sampler
    by_draw = data.log_likelihood["frequency"].values.reshape(-1, len(by_reading))
    labels, modes = result.problem.labels, result.summary.modes
    numbers = {
        "rhat_max": float(table["r_hat"].max()),
        "ess_min": float(table["ess_bulk"].min()),
        "own": {"rhat_max": own.rhat_max, "ess_min": own.ess_min},
        "pareto_k": dict(zip(labels, (float(k) for k in loo.pareto_k), strict=True)),
        "leverage": {label: mode.leverage for label, mode in zip(labels, modes, strict=True)},
        "weighed": {
            label: (float(one), error_of_log_mean(-own_draws, own.ess_min))
            for label, one, own_draws in zip(labels, by_reading, by_draw.T, strict=True)
        },
        "refitted": {label: refitted(result.problem, i, seed) for i, label in enumerate(labels)},
        "left_out_cents": {label: mode.left_out_cents for label, mode in zip(labels, modes, strict=True)},
        "effective_parameters": float(getattr(loo, "p_loo", None) or loo.p),
    }
    for factor in ("likelihood", "constants", "noise"):
        numbers[factor] = sensitivity(data, factor)
    if figure is not None:
        figure_of(numbers["pareto_k"]).savefig(figure, dpi=150)
    return numbers


def left_out(data: Any) -> Any:
    """Leave-one-out by weights; what ArviZ warns of is what the example shows."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return arviz.loo(data, pointwise=True)


def error_of_log_mean(logs: np.ndarray, n_effective: float) -> float:
    """Monte Carlo error of the logarithm of the mean of exp(logs), from so many effective draws."""
    values = np.exp(logs - logs.max())
    return float(values.std() / values.mean() / np.sqrt(n_effective))


def refitted(problem: bayesplate.Problem, index: int, seed: int) -> tuple[float, float] | None:
    """ln density of a reading of a board with one setup, under the posterior of all others, and its Monte Carlo error.

    None if the others leave a constant open.
    """
    (setup,) = problem.board.setups
    others = setup.readings[:index] + setup.readings[index + 1 :]
    try:
        without = bayesplate.fit(replace(problem.board, setups=(replace(setup, readings=others),)), seed=seed)
    except bayesplate.NotIdentifiableError:
        return None
    theta = without.draws.flat
    density = problem.log_likelihood(theta) - without.problem.log_likelihood(theta)
    log_mean = float(np.logaddexp.reduce(density) - np.log(len(density)))
    return log_mean, error_of_log_mean(density, without.summary.sampler.ess_min)


def sensitivity(data: Any, factor: str) -> dict[str, float]:
    """How far the distribution of each constant changes with a power of the likelihood, or of a factor of the prior."""
    names = list(CONSTANTS)
    component, factors = ("likelihood", None) if factor == "likelihood" else ("prior", [factor])
    if "InferenceData" in vars(arviz):
        found = arviz.psens(data, component=component, component_var_names=factors, var_names=names)
        return {name: float(found[name]) for name in names}
    table = arviz.psense_summary(data, var_names=names, prior_var_names=factors)  # ArviZ 1.x
    return {name: float(table.loc[name, component]) for name in names}


def figure_of(pareto_k: dict[str, float]) -> Any:
    """Pareto k of each reading."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.0, 3.0), layout="constrained")
    panel = figure.subplots()
    panel.barh(list(pareto_k), list(pareto_k.values()), color="#0072B2")
    panel.axvline(UNRELIABLE, color="#D55E00", lw=1.5)
    panel.set(xlabel="Pareto k of the reading left out; beyond the line weights do not serve", xlim=(0.0, 1.2))
    panel.invert_yaxis()
    return figure


if __name__ == "__main__":
    found = run(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
    own = found["own"]
    print(f"R-hat {found['rhat_max']:.4f} by ArviZ, {own['rhat_max']:.4f} by the package")
    print(f"effective draws {found['ess_min']:.0f} by ArviZ (thinned), {own['ess_min']:.0f} by the package")
    for constant in CONSTANTS:
        told = ", ".join(f"{factor} {found[factor][constant]:.3f}" for factor in ("likelihood", "constants", "noise"))
        print(f"{constant:5s} sensitivity to the likelihood and to the priors: {told}")
    for label, k in found["pareto_k"].items():
        value, error = found["weighed"][label]
        refit = found["refitted"][label]
        print(
            f"{label} Pareto k {k:.2f}, ln density by weights {value:.3f} ± {error:.3f}, by a refit "
            + ("{:.3f} ± {:.3f}".format(*refit) if refit else "not to be had: the others leave a constant open")
        )
