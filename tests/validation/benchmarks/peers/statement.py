"""A board as one JSON file that any sampler can be given, and the check that it says what the package samples."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from validation.benchmarks import timing
from validation.benchmarks.peers.density import Density

from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.posterior.posing import PosedProblem

BOARD = "fiemme-spruce-clamped"
TOLERANCE = 1e-8
N_POINTS = 200


def posed() -> PosedProblem:
    """The paper's board whose six readings are sampled, under the law that serves it: the linear one."""
    return timing.posed(BOARD, None)


def stated(problem: PosedProblem) -> dict[str, object]:
    """Everything that the log posterior of a board needs, of plain numbers.

    Raises
    ------
    ValueError
        If the board has what the file cannot say: uncertain inputs, several setups, readings that are not rounded.
    """
    posterior = problem.posterior
    if posterior.law != "linear" or posterior.robust or posterior.parameters.inputs or len(posterior.models) != 1:
        raise ValueError("wanted one setup, the linear law, normal errors and exact inputs")
    (readings,), (model,), (noise,) = posterior.readings, posterior.models, posterior.parameters.noises
    if posterior.peaks != (None,) or not readings.rounded.all() or set(posterior.priors) != set(MODULI):
        raise ValueError("wanted rounded readings with sure labels, and priors of the moduli")
    values = posterior.parameters.values(np.zeros((1, posterior.parameters.n_dim)))
    unit = np.eye(3)
    rigidities = {name: unit[i] for i, name in enumerate(RIGIDITIES)}
    per_rigidity = model.linear.squared(model.system.weights({**values, **rigidities}))
    quantities = {**posterior.priors, "noise": noise.prior}
    return {
        "board": problem.board.name,
        "parameters": list(posterior.parameters.names),
        "thickness_m": float(values["thickness"]),
        "poisson_xy": float(values["poisson_xy"]),
        "squared_per_rigidity": per_rigidity.T.tolist(),
        "readings_hz": readings.frequency.tolist(),
        "resolution_hz": readings.resolution.tolist(),
        "priors": {
            name: {"log_median": float(np.log(one.median)), "log_sd": one.log_sd} for name, one in quantities.items()
        },
        "centre": problem.centre.tolist(),
        "covariance": problem.covariance.tolist(),
    }


def deviation(problem: PosedProblem, content: dict[str, object], n_points: int = N_POINTS) -> float:
    """The largest difference of two log posteriors, the package's and that of the file, but for a constant.

    At random points about the estimate, four times as wide as the posterior, where far tails and places without a
    material are met.
    """
    rng = np.random.default_rng(7)
    theta = rng.multivariate_normal(problem.centre, 16.0 * problem.covariance, n_points)
    theta[: n_points // 10, :2] += [-6.0, 6.0]  # nu_xy nu_yx > 1: no material
    ours, theirs = problem.posterior(theta), Density.of(content).log_posterior(theta)
    finite = np.isfinite(ours)
    if (finite != np.isfinite(theirs)).any():
        return float("inf")
    differences = ours[finite] - theirs[finite]
    return float(np.ptp(differences))


def write(path: Path) -> PosedProblem:
    """Write the file of the board, and return its problem.

    Raises
    ------
    ValueError
        If the file does not say what the package samples.
    """
    problem = posed()
    content = stated(problem)
    off = deviation(problem, content)
    if not off < TOLERANCE:
        raise ValueError(f"the file's log posterior differs from the package's by {off:g}")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return problem
