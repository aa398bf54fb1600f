"""probeye with its emcee solver: a forward model of ln f, its Gaussian likelihood exchanged for one of intervals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from validation.benchmarks.peers import session
from validation.benchmarks.peers.density import Density

N_WALKERS = 20
NAMES = ("log_E_x", "log_E_y", "log_G_xy", "log_noise")
FEWEST_INITIAL = 1500
"""Steps before those that are kept: the solver starts its walkers all over the prior."""


def prepared(density: Density, variant: str) -> Callable[[int, int], session.Draws]:
    """Sampler of so many steps."""
    from probeye.definition.distribution import Normal
    from probeye.definition.forward_model import ForwardModelBase
    from probeye.definition.inverse_problem import InverseProblem
    from probeye.definition.likelihood_model import GaussianLikelihoodModel
    from probeye.definition.sensor import Sensor
    from probeye.inference.emcee.solver import EmceeSolver

    class Plate(ForwardModelBase):
        """ln f of the modes."""

        def interface(self) -> None:
            self.parameters = list(NAMES[:3])
            self.input_sensors = []
            self.output_sensors = [Sensor("log_frequency", std_model=NAMES[3])]

        def response(self, inp: dict) -> dict:
            x = np.array([[inp[name] for name in NAMES[:3]] + [0.0]])
            return {"log_frequency": density.log_frequency(density.theta(x))[0]}

    def log_likelihood(response: np.ndarray, residuals: np.ndarray, parameters: dict) -> float:
        found = float(density.log_interval(response, np.exp(parameters[NAMES[3]])).sum())
        return -np.inf if np.isnan(found) else found

    problem = InverseProblem("six frequencies of a board", print_header=False)
    for name, mean, sd in zip(NAMES, density.prior_mean, density.prior_sd, strict=True):
        problem.add_parameter(name, prior=Normal(mean=float(mean), std=float(sd)))
    readings = 0.5 * (density.log_low + density.log_high)
    problem.add_experiment("readings", sensor_data={"log_frequency": readings})
    problem.add_forward_model(Plate("plate"), experiments="readings")
    problem.add_likelihood_model(GaussianLikelihoodModel(experiment_name="readings", model_error="additive"))

    def sample(size: int, seed: int) -> session.Draws:
        solver = EmceeSolver(problem, seed=seed, show_progress=False)
        (model,) = solver.problem.likelihood_models.values()
        model.loglike = log_likelihood
        initial = max(FEWEST_INITIAL, size // 6)
        solver.run(n_walkers=N_WALKERS, n_steps=size, n_initial_steps=initial)
        chain = solver.raw_results.get_chain()
        return density.theta(chain.reshape(-1, len(NAMES))).reshape(chain.shape), None

    return sample


if __name__ == "__main__":
    session.run(prepared)
