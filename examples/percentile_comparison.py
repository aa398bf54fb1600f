"""What the spread of the percentile method is worth: on the paper's two boards, and where the truth is known.

The paper estimates the constants from all 42 subsets of six modes, trims them, and gives the mean and the spread of
what is left. Here both of its boards are shown beside their posteriors. Then boards of known constants are simulated on
another mesh than they are fitted on: with plain noise, and with noise and a hidden effect, the transverse shear of the
cantilever board, that a fit by the thin plate leaves out. Bias, spread and coverage say what each error bar is worth.

In plain noise the percentile method is fine: no bias, and a spread as large as the errors are from board to board. Its
size varies by chance with the six readings, so that as an interval it is short, more so at 90 % than at 68 %. With a
hidden effect all 42 subsets share one bias, so their spread does not see it. Nor does a posterior of the wrong model:
its error bar is as wrong. What helps is to declare the effect; declared where there is none, it misleads in turn.

    python examples/percentile_comparison.py figures
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import bayesplate
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, moduli, rigidities
from bayesplate.board.quantity import Quantity
from bayesplate.commands.prepare import prepare
from bayesplate.estimates.least_squares import log_measured
from bayesplate.estimates.paper import PaperSystem, paper_system
from bayesplate.estimates.percentile import percentile_estimate
from bayesplate.estimates.refit import design_matrix, refit
from bayesplate.frequencies.columns import inverse_lambda
from bayesplate.frequencies.system import system_of
from bayesplate.plate.naming import find_named_modes
from bayesplate.plate.shear import shear_flexible_plate
from bayesplate.plate.thin import thin_plate
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.posing import PosedProblem, pose
from bayesplate.posterior.target import Posterior

BOARDS = ("finnish-spruce-cantilever", "fiemme-spruce-clamped")
TRUTH = {"E_x": 10.7e9, "E_y": 0.716e9, "G_xy": 0.50e9}
"""The paper's simulation inputs, Pa."""
NOISE = 0.008
"""Relative sd of a simulated frequency: the median of the default prior for clamped boards."""
SHEAR = ["transverse_shear"]
N_DRAWS = 2000
WIDER, DEGREES = 1.3, 6.0
LEVELS = {"68": (0.16, 0.84), "90": (0.05, 0.95)}
NORMAL = {"68": 1.0, "90": 1.645}


def run(folder: Path | None = None, n_boards: int = 40, seed: int = 1) -> dict[str, Any]:
    """Compare on measured and on simulated boards.

    Parameters
    ----------
    folder : Path, optional
        Where to write a figure of each measured board.
    n_boards : int
        Simulated boards of each kind.
    seed : int

    Returns
    -------
    dict
        measured: by card and modulus, percentile and posterior (mean, sd_percent) and the posterior probability of the
        percentile band. simulated: by case ("noise", "hidden shear"), method and modulus: bias_percent, spread_percent
        of the means over boards, stated_percent (the mean of the sd given), cover_68 and cover_90.
    """
    measured = {card: _measured(card, folder, seed) for card in BOARDS}
    return {"measured": measured, "simulated": simulated(n_boards, seed)}


def _measured(card: str, folder: Path | None, seed: int) -> dict[str, Any]:
    result = bayesplate.fit(card, seed=seed)
    problem = result.inference.problem
    system = paper_system(problem.board, problem.estimate)
    percentile = percentile_estimate(system)
    assert percentile is not None
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        result.plot.percentiles().savefig(folder / f"percentiles-{card}.png", dpi=150)
    rows: dict[str, Any] = {"n_subsets": percentile.n_subsets}
    for name, draws in result.draws.moduli.items():
        mean, sd = percentile.mean[name], percentile.sd[name]
        rows[name] = {
            "percentile": {"mean": mean, "sd_percent": 100 * sd / mean},
            "posterior": {"mean": float(draws.mean()), "sd_percent": float(100 * draws.std() / draws.mean())},
            "within_percentile_band": float(np.mean(np.abs(draws - mean) < sd)),
        }
    return rows


def simulated(n_boards: int, seed: int) -> dict[str, Any]:
    """Bias, spread and coverage on boards of known constants, without and with a hidden effect."""
    cases = {}
    truths = {"noise": _solved([], thin_plate, 36), "hidden shear": _solved(SHEAR, shear_flexible_plate, 24)}
    problems = {
        "posterior, thin plate": _problem([], truths["noise"]),
        "posterior, shear declared": _problem(SHEAR, truths["hidden shear"]),
    }
    thin = problems["posterior, thin plate"]
    coefficients = paper_system(thin.board, thin.estimate, "sensitivity").coefficients
    for case, frequencies in truths.items():
        rng = np.random.default_rng(seed)
        found: dict[str, list[Any]] = {"percentile": [], **{name: [] for name in problems}}
        for _ in range(n_boards):
            read = frequencies * np.exp(NOISE * rng.standard_normal(frequencies.size))
            found["percentile"].append(_percentile(thin.board, coefficients, read))
            for name, problem in problems.items():
                found[name].append(_posterior(problem, read, rng))
        cases[case] = {name: _scores(rows) for name, rows in found.items()}
    return cases


def _reading(board: Board, frequencies: np.ndarray) -> Board:
    """The board with other frequencies, nothing rounded."""
    setup = board.setups[0]
    readings = tuple(
        replace(reading, frequency=Quantity.exact(float(hertz)))
        for reading, hertz in zip(setup.readings, frequencies, strict=True)
    )
    return replace(board, setups=(replace(setup, readings=readings, resolution=0.0),))


def _problem(effects: list[str], truth: np.ndarray) -> PosedProblem:
    """The fit that all simulated boards share: the exact law, made at the noise-free board."""
    prepared = prepare(BOARDS[0], effects)
    return pose(_reading(prepared.board, truth), prepared.prior, law="exact")


def _solved(effects: list[str], assemble: Any, n_elements: int) -> np.ndarray:
    """Frequencies of the true plate on another mesh than the fit's, Hz."""
    board = prepare(BOARDS[0], effects).board
    (setup,) = board.setups
    h, nu_xy = board.inputs["thickness"].mean, board.inputs["poisson_xy"].mean
    constants = rigidities(TRUTH["E_x"], TRUTH["E_y"], TRUTH["G_xy"], h, nu_xy)
    weights = system_of(board, setup).weights(board.nominal() | constants._asdict()).at(0)
    beams = [reading.beams for reading in setup.readings]
    found = find_named_modes(assemble(setup.ends_x, setup.ends_y, n_elements, n_elements), weights, beams)
    return np.sqrt([found[b].eigenvalue for b in beams]) / (2 * np.pi)


def _percentile(board: Board, coefficients: np.ndarray, read: np.ndarray) -> dict[str, Any]:
    """Mean and intervals of the percentile method, from the thin plate's coefficients."""
    values = board.nominal()
    psi = (2 * np.pi * read) ** 2 * inverse_lambda(values, board.setups[0])
    found = percentile_estimate(PaperSystem(psi, coefficients, values))
    assert found is not None
    return {
        name: {
            "mean": found.mean[name],
            "sd": found.sd[name],
            **{level: found.mean[name] + found.sd[name] * np.array([-z, z]) for level, z in NORMAL.items()},
        }
        for name in MODULI
    }


def _posterior(problem: PosedProblem, read: np.ndarray, rng: np.random.Generator) -> dict[str, Any]:
    """Mean and intervals of the posterior, by importance sampling around the weighted fit: boards are many here."""
    board = _reading(problem.board, read)
    posterior = Posterior(board, problem.prior, problem.posterior.models, "exact")
    parameters = posterior.parameters
    scales = np.full(read.size, board.setups[0].noise.median)
    predict = predictor(board, posterior.models, "exact", problem.centre)
    columns = parameters.fitted_columns
    best = refit(predict, log_measured(board), scales, problem.centre[columns], parameters.fitted_bounds)
    misfit = np.sum(((log_measured(board) - predict(best[None, :])[0]) / scales) ** 2) / (read.size - 3)
    widening = np.sqrt(max(1.0, misfit))
    weighted = design_matrix(predict, scales * widening, best)
    covariance = problem.covariance.copy()
    covariance[np.ix_(columns, columns)] = np.linalg.inv(weighted.T @ weighted)
    centre = parameters.theta(
        {name: np.ravel(v)[0] for name, v in parameters.values(_whole(problem, columns, best)).items()},
        np.array([board.setups[0].noise.median * widening**0.5]),
    )
    for n_draws in (N_DRAWS // 2, N_DRAWS):  # the second time from what the first has found
        theta, weights = _weighted_draws(posterior, centre, covariance, n_draws, rng)
        centre, covariance = weights @ theta, np.cov(theta.T, aweights=weights)
    values = parameters.values(theta)
    elastic = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
    rows: dict[str, Any] = {"effective_draws": 1 / np.sum(weights**2)}
    for name, draws in zip(MODULI, elastic, strict=True):
        mean = float(weights @ draws)
        order = np.argsort(draws)
        places = np.cumsum(weights[order])
        intervals = {level: np.interp(ends, places, draws[order]) for level, ends in LEVELS.items()}
        rows[name] = {"mean": mean, "sd": float(np.sqrt(weights @ (draws - mean) ** 2)), **intervals}
    return rows


def _weighted_draws(
    posterior: Posterior, centre: np.ndarray, covariance: np.ndarray, n_draws: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Draws from a Student distribution, with the weights that make them draws of the posterior."""
    factor = WIDER * np.linalg.cholesky(covariance)
    z = rng.standard_normal((n_draws, centre.size)) / np.sqrt(rng.chisquare(DEGREES, (n_draws, 1)) / DEGREES)
    theta = centre + z @ factor.T
    log_proposal = -0.5 * (DEGREES + centre.size) * np.log1p(np.sum(z**2, axis=1) / DEGREES)
    log_weights = posterior(theta) - log_proposal
    weights = np.nan_to_num(np.exp(log_weights - np.nanmax(log_weights)))
    return theta, weights / weights.sum()


def _whole(problem: PosedProblem, columns: np.ndarray, fitted: np.ndarray) -> np.ndarray:
    theta = problem.centre.copy()
    theta[columns] = fitted
    return theta[None, :]


def _scores(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Bias, spread and coverage of a method over the boards, per cent of the truth."""
    scores: dict[str, Any] = {}
    for name, true in TRUTH.items():
        means = np.array([row[name]["mean"] for row in rows])
        cover = {
            f"cover_{level}": float(np.mean([row[name][level][0] <= true <= row[name][level][1] for row in rows]))
            for level in LEVELS
        }
        scores[name] = {
            "bias_percent": float(100 * (means.mean() / true - 1)),
            "spread_percent": float(100 * means.std(ddof=1) / true),
            "stated_percent": float(100 * np.mean([row[name]["sd"] for row in rows]) / true),
            **cover,
        }
    if "effective_draws" in rows[0]:
        scores["fewest_effective_draws"] = float(min(row["effective_draws"] for row in rows))
    return scores


def _print(numbers: dict[str, Any]) -> None:
    for card, rows in numbers["measured"].items():
        print(card)
        for name in MODULI:
            row = rows[name]
            percentile, posterior = row["percentile"], row["posterior"]
            print(
                f"  {name:5s} percentile {percentile['mean'] / 1e9:6.3f} GPa ± {percentile['sd_percent']:4.1f} %;  "
                f"posterior {posterior['mean'] / 1e9:6.3f} ± {posterior['sd_percent']:4.1f} %, of which "
                f"{100 * row['within_percentile_band']:.0f} % within the percentile method's ± sd"
            )
    for case, methods in numbers["simulated"].items():
        print(f"simulated, {case}: bias, spread over boards, stated sd (% of the truth); coverage of 68 and 90 %")
        for method, scores in methods.items():
            for name in MODULI:
                one = scores[name]
                print(
                    f"  {method:26s} {name:5s} {one['bias_percent']:+6.1f} {one['spread_percent']:5.1f} "
                    f"{one['stated_percent']:5.1f}   {100 * one['cover_68']:4.0f} {100 * one['cover_90']:4.0f}"
                )


if __name__ == "__main__":
    _print(run(Path(sys.argv[1]) if len(sys.argv) > 1 else None))
