"""What is timed: solves, laws, likelihoods and whole commands; each function returns seconds."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import ritz
from made_campaigns import MASS, write_campaign
from numpy.typing import NDArray

from bayesplate.board.board import Board
from bayesplate.board.named import load_named_cards
from bayesplate.board.setup import EdgeConditions
from bayesplate.commands.prepare import prepare, prepare_card
from bayesplate.diagnosis.baseline import baseline_of
from bayesplate.diagnosis.joint import full_search
from bayesplate.frequencies.laws import LawName
from bayesplate.frequencies.terms import term_weights
from bayesplate.libraries import load_arviz
from bayesplate.plate import line
from bayesplate.plate.mesh import mesh
from bayesplate.plate.solve import solve, solve_classes
from bayesplate.plate.terms import Weights
from bayesplate.plate.thin import thin_plate
from bayesplate.posterior.convergence import autocorrelation_times, burn_in_steps
from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import PosedProblem, pose
from bayesplate.posterior.sampling import SamplerSettings

N_MODES = 12
PLAIN_WALKERS, PLAIN_STEPS = 32, 3000


def best(run: Callable[[], object], repeats: int) -> float:
    """Shortest of several runs, s: what the machine does when nothing else disturbs it."""
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        run()
        times.append(time.perf_counter() - started)
    return min(times)


def posed(board: str, law: LawName | None, effects: Sequence[str] | None = None) -> PosedProblem:
    """A shipped board under a law, or the law that serves, ready to be sampled."""
    prepared = prepare(board, effects)
    return pose(prepared.board, prepared.prior, law=law)


def draws(problem: PosedProblem, n_draws: int) -> NDArray[np.float64]:
    """Points where the sampler would ask: a normal approximation of the posterior, (n_draws, n_dim) array."""
    return np.random.default_rng(1).multivariate_normal(problem.centre, problem.covariance, n_draws)


def likelihood(problem: PosedProblem, n_draws: int, repeats: int = 7) -> float:
    """One evaluation of the log likelihood at `n_draws` points together."""
    theta = draws(problem, n_draws)
    together = max(1, 2048 // n_draws)

    def run() -> None:
        for _ in range(together):
            problem.posterior.log_likelihood(theta)

    run()
    return best(run, repeats) / together


def law(problem: PosedProblem, name: LawName, n_draws: int, repeats: int = 7) -> float:
    """The frequencies of the labelled modes alone at `n_draws` points, without noise and readings."""
    values = problem.parameters.values(draws(problem, n_draws))
    (model,) = problem.posterior.models
    return best(lambda: model.log_frequencies(values, name), repeats)


def full_solve(problem: PosedProblem, repeats: int = 7) -> float:
    """The labelled modes of one draw from the matrices of the whole plate, only as many as are needed in each class."""
    (model,) = problem.posterior.models
    values = problem.parameters.values(draws(problem, 1))
    weights = term_weights(values, model.setup).at(0)
    wanted = {place.parity: 0 for place in model.places}
    for place in model.places:
        wanted[place.parity] = max(wanted[place.parity], place.rank + 1)
    return best(lambda: solve_classes(model.plate, weights, wanted), repeats)


def plain_emcee(problem: PosedProblem, seed: int) -> float:
    """Effective draws per second of emcee as it comes: stretch moves, vectorised, one ensemble; burn-in left out of
    the draws and not of the time."""
    import emcee

    n_walkers = max(PLAIN_WALKERS, 2 * problem.parameters.n_dim)
    start = draws(problem, n_walkers)
    sampler = emcee.EnsembleSampler(n_walkers, problem.parameters.n_dim, problem.posterior, vectorize=True)
    state = emcee.State(start, random_state=np.random.RandomState(seed).get_state())

    def run() -> None:
        sampler.run_mcmc(state, PLAIN_STEPS, skip_initial_state_check=True)

    seconds = best(run, 1)
    kept = sampler.get_chain(discard=burn_in_steps(PLAIN_STEPS))
    return float(kept[..., 0].size / autocorrelation_times(kept).max() / seconds)


def our_sampling(problem: PosedProblem, seed: int) -> float:
    """Effective draws per second of the package, by the same measure: surrogate, pilot and judgements of convergence
    count as time, and of a surrogate no more draws than are weighted."""
    load_arviz()  # a library is no part of sampling
    started = time.perf_counter()
    inference = infer(problem, SamplerSettings(seed=seed))
    seconds = time.perf_counter() - started
    n_effective = inference.chains.after_burn_in[..., 0].size / inference.convergence.tau_max
    if inference.surrogate is not None:
        n_effective = min(n_effective, inference.convergence.ess_min)
    return float(n_effective / seconds)


def plate_at_estimate(problem: PosedProblem) -> tuple[EdgeConditions, EdgeConditions, tuple[int, int], Weights]:
    """Edges, mesh and weights of a problem's plate."""
    (model,) = problem.posterior.models
    weights = term_weights(problem.estimate.values, model.setup).at(0)
    return model.setup.ends_x, model.setup.ends_y, mesh(weights), weights


def assembly(problem: PosedProblem, repeats: int = 5) -> float:
    """Matrices of a plate that was never assembled before in this process, its libraries imported."""
    ends_x, ends_y, (n_x, n_y), weights = plate_at_estimate(problem)

    def run() -> None:
        thin_plate.cache_clear()
        line.line.cache_clear()
        plate = thin_plate(ends_x, ends_y, n_x, n_y)
        elements = plate.elements(weights)
        for own in plate.classes:
            own.pencil(elements)

    return best(run, repeats)


def finite_differences(n_points: int, n_modes: int, repeats: int = 5) -> float:
    """The lowest modes of a supported plate of so many points a side: the stencil of thirteen points and shift-invert,
    as MAGPIE solves a plate (https://github.com/Nemus-Project/magpie-python), whose building is left out."""
    from scipy.sparse import diags_array, eye_array, kron
    from scipy.sparse.linalg import eigs

    line_of = diags_array([np.ones(n_points - 1), np.full(n_points, -2.0), np.ones(n_points - 1)], offsets=[-1, 0, 1])
    laplacian = kron(line_of, eye_array(n_points)) + kron(eye_array(n_points), line_of)
    biharmonic = (laplacian @ laplacian).tocsc()
    return best(lambda: eigs(biharmonic, k=n_modes, sigma=0.0, which="LR"), repeats)


def to_accuracy(plate: ritz.Plate, error: float) -> tuple[float, float]:
    """The lowest twelve modes of a plate to a relative error, each way on the least that has it: seconds of the finite
    elements, matrices included, and of the Ritz method in Legendre polynomials, which is independent of them.

    Of plates without a singular corner the most polynomials give them to some 1e-8.
    """
    reference = ritz.frequencies(plate, N_MODES, n=26)
    weights = Weights(plate.unit_weights, np.ones(1))

    def elements(per_side: int) -> NDArray[np.float64]:
        line.line.cache_clear()
        thin_plate.cache_clear()
        found = solve(thin_plate(*plate.ends, *mesh(weights, per_side)), weights, N_MODES)
        return np.sqrt(found.eigenvalues) / (2.0 * np.pi)

    def polynomials(n: int) -> NDArray[np.float64]:
        return ritz.frequencies(plate, N_MODES, n=n)

    def time_of(solved: Callable[[int], NDArray[np.float64]], sizes: Sequence[int]) -> float:
        size = next(size for size in sizes if np.abs(np.log(solved(size) / reference)).max() <= error)
        return best(lambda: solved(size), 5)

    return time_of(elements, range(8, 81, 2)), time_of(polynomials, range(8, 26))


def search(n_modes: int, tried: Sequence[str] | None = None) -> tuple[int, float]:
    """Candidates of a search on a simulated free board of so many modes, which lacks nothing; processor time, s."""
    from generator.boards import plant
    from generator.designs import DESIGNS

    text = plant(np.random.default_rng(1), DESIGNS["free-12"], [], 1.0, 5.0, name="free").card_text()
    card = Board.from_text(text, "free")
    prepared = prepare_card(card, load_named_cards(card), [])
    (setup,) = prepared.board.setups
    board = replace(prepared.board, setups=(replace(setup, readings=setup.readings[:n_modes]),))
    baseline = baseline_of(pose(board, prepared.prior))
    ground, _ = full_search(baseline, tried)  # what it assembles is there for the runs that count
    return len(ground.candidates), min(_processor_time(lambda: full_search(baseline, tried)) for _ in range(2))


def twelve_modes(problem: PosedProblem, repeats: int = 7) -> float:
    """The lowest twelve modes from matrices that are there."""
    ends_x, ends_y, (n_x, n_y), weights = plate_at_estimate(problem)
    plate = thin_plate(ends_x, ends_y, n_x, n_y)
    return best(lambda: solve(plate, weights, N_MODES), repeats)


def command(*arguments: str, repeats: int = 1) -> float:
    """A whole command in a process of its own, from nothing to its exit, with one thread."""
    program = [sys.executable, "-m", "bayesplate", *arguments]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    return best(lambda: subprocess.run(program, check=True, capture_output=True, env=environment), repeats)


_AFTER_SAMPLING = """
import sys, time
from bayesplate.commands import fitting
from bayesplate.commands.fit import fit

infer = fitting.infer

def timed(*arguments, **options):
    global ended
    inference = infer(*arguments, **options)
    ended = time.perf_counter()
    return inference

fitting.infer = timed
fit(sys.argv[1], out=sys.argv[2])
print(time.perf_counter() - ended)
"""


def boards(n_boards: int) -> tuple[float, float]:
    """Time of fits of so many simulated boards with one accelerometer, s: each by itself, and all as a campaign."""
    import bayesplate

    with tempfile.TemporaryDirectory() as folder:
        path = write_campaign(Path(folder), (MASS,) * n_boards, population="")
        cards = [str(path.parent / f"board-{i}.toml") for i in range(n_boards)]
        alone = _processor_time(lambda: [bayesplate.fit(card, effects=["attached_mass"]) for card in cards])
        return alone, _processor_time(lambda: bayesplate.fit(str(path)))


def _processor_time(run: Callable[[], object]) -> float:
    start = time.process_time()
    run()
    return time.process_time() - start


def after_sampling(board: str, repeats: int = 1) -> float:
    """From the sampler's last step to the last file of `fit`: summary, archive, report with its figures, tables."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    times = []
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            program = [sys.executable, "-c", _AFTER_SAMPLING, board, str(Path(folder) / "out")]
            done = subprocess.run(program, check=True, capture_output=True, text=True, env=environment)
        times.append(float(done.stdout))
    return min(times)


def whole_fit(board: str, *options: str, repeats: int = 1, what: str = "fit") -> float:
    """`bayesplate fit` (or another command) of a shipped board, cold."""
    with tempfile.TemporaryDirectory() as folder:
        return command(what, board, *options, "--force", "--out", str(Path(folder) / "out"), repeats=repeats)


_PLAIN = """
from validation.benchmarks import timing

timing.plain_emcee(timing.posed("fiemme-spruce-clamped", "linear", ["poisson_ratio"]), seed=1)
"""


def unit(repeats: int = 1) -> float:
    """The unit of cold times: a process that poses a board of five parameters and samples it with plain emcee."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    paths = [str(Path(__file__).resolve().parents[2]), *filter(None, [environment.get("PYTHONPATH")])]
    environment["PYTHONPATH"] = os.pathsep.join(paths)
    program = [sys.executable, "-c", _PLAIN]
    return best(lambda: subprocess.run(program, check=True, capture_output=True, env=environment), repeats)
