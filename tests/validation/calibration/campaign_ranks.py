"""Ranks of the truth in a campaign: what boards share among draws from all of them, and a board under what all teach.

Each board has constants, sizes and a noise of its own from their priors, and all of them one stiffness of the threads
that they hang from. One linear law is both the truth and the fit, so that nothing but the likelihoods that boards give,
their product and the samplers can be wrong. A campaign in which every board counts twice has to be found out.
"""

from __future__ import annotations

import time
from dataclasses import asdict

import numpy as np
from validation.calibration.records import Record
from validation.calibration.sbc import MOST_STEPS, held_out, random_lines, ranked, ranked_draws, ranks_among
from validation.calibration.truths import Design, Truth, draw_truth, make_problem, reference

from bayesplate.board.parameter import Parameter
from bayesplate.campaign.boards import FittedBoard
from bayesplate.campaign.combined import CombinedBoards, sample_shared
from bayesplate.campaign.learning import SharedPosterior, learn_shared
from bayesplate.campaign.shared import SharedParameter
from bayesplate.errors import BayesplateError
from bayesplate.posterior.convergence import Convergence, Gate
from bayesplate.posterior.draws import named_draws
from bayesplate.posterior.inference import infer
from bayesplate.posterior.sampling import Chains, SamplerSettings

DESIGN = Design(law="fixed-linear", resolution=0.0, effect="support_stiffness")
N_BOARDS = 3
ESS_OF_A_BOARD = 2000
"""Independent draws of a board alone: some hundreds are left where the other boards have told what is shared."""
TWICE = "every board counted twice"
"""A wrong campaign that is to be found out."""


def of_boards() -> Parameter:
    """The parameter of each board that is the same of all."""
    (found,) = (one for one in reference(DESIGN).board.parameters if one.is_of_effect)
    return found


def shared() -> SharedParameter:
    """The number that all boards have in common."""
    one = of_boards()
    return SharedParameter(one.effect, one.key, one.prior, one.unit)


def draw(rng: np.random.Generator) -> list[Truth]:
    """A truth for each board, what is shared being that of the first one."""
    first = draw_truth(DESIGN, rng)
    given = {of_boards().name: first.values[of_boards().name]}
    return [first, *(draw_truth(DESIGN, rng, given) for _ in range(N_BOARDS - 1))]


def settings(rng: np.random.Generator, gate: Gate | None = None) -> SamplerSettings:
    """Of one run, its seed drawn."""
    chosen = {} if gate is None else {"gate": gate, "n_ensembles": DESIGN.n_ensembles, "n_walkers": DESIGN.n_walkers}
    return SamplerSettings(seed=int(rng.integers(2**31)), max_steps=MOST_STEPS, **chosen)


def learnt_from(truths: list[Truth], rng: np.random.Generator) -> SharedPosterior:
    """Every board fitted alone, and what they teach together."""
    members, gate = [], Gate(tau_count_min=DESIGN.gate_taus, ess_min=ESS_OF_A_BOARD)
    for truth in truths:
        inference = infer(make_problem(DESIGN, truth), settings(rng, gate))
        _require(inference.convergence)
        members.append(FittedBoard(named_draws(inference, int(rng.integers(2**31))), (shared(),)))
    learnt = learn_shared(members, settings(rng))
    _require(learnt.convergence)
    return learnt


def repeated(learnt: SharedPosterior, times: int, rng: np.random.Generator) -> Chains:
    """What is shared by so many times as many boards, each of them there as often."""
    once = learnt.combined
    often = CombinedBoards.of(
        once.shared, once.names * times, once.likelihoods * times, once.normal_likelihoods * times
    )
    chains, convergence = sample_shared(often, settings(rng))
    _require(convergence)
    return chains


def rank_of_shared(chains: Chains, truth: Truth, rng: np.random.Generator) -> int:
    """Rank of what is shared among as many draws as are ranked."""
    true = float(shared().prior.standard(np.asarray(truth.values[of_boards().name])))
    return int(np.sum(ranked_draws(chains.pooled, rng)[:, 0] < true))


def _require(convergence: Convergence) -> None:
    if not convergence.passed:
        raise BayesplateError("; ".join(convergence.reasons))


def simulate_one(index: int, times: int = 2) -> Record:
    """One campaign: the ranks of what is shared and of its first board, and of what is shared by the mutant.

    Parameters
    ----------
    index : int
        Seeds everything random, together with the design's seed.
    times : int
        How often the mutant counts every board.
    """
    started = time.perf_counter()
    for_truth, for_draws, for_mutants = random_lines(DESIGN.base_seed, 13, index)
    record: Record = {"simulation": index}
    try:
        truths = draw(for_truth)
        learnt = learnt_from(truths, for_draws)
        draws, effective = learnt.board(0, for_draws, int(for_draws.integers(2**31)))
        unread = held_out(DESIGN, draws.problem)
        own = ranks_among(draws.problem, truths[0], ranked_draws(draws.flat, for_draws), unread)
        ranks = {"production": {**own, "shared": rank_of_shared(learnt.chains, truths[0], for_draws)}}
        often = repeated(learnt, times, for_mutants)
        ranks[TWICE] = {"shared": rank_of_shared(often, truths[0], for_mutants)}
    except BayesplateError as error:
        return record | {"error": f"{type(error).__name__}: {error}"}
    of_board = {"effective": round(effective), "astray": round(float(learnt.offsets.max()), 2)}
    return record | ranked(ranks, started) | of_board


def identity() -> Record:
    """What a file of ranks must agree in before more are added to it."""
    return {"format": 1, "what": "campaign", "boards": N_BOARDS, "design": asdict(DESIGN)}
