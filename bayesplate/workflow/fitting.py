"""One fit, from a prepared board to draws and a summary, with the law that serves; what `fit` and `diagnose` share."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from bayesplate.frequencies.laws import LawName
from bayesplate.plate.board import Board
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.inference import Inference, Problem, infer, pose
from bayesplate.posterior.sampling import Progress, SamplerSettings
from bayesplate.results.draws import Draws, linear_is_enough, linearisation, named_draws
from bayesplate.results.summary import Summary, summarise
from bayesplate.results.versions import versions
from bayesplate.workflow.prepare import Prepared


@dataclass(frozen=True)
class Request:
    """How to fit.

    Attributes
    ----------
    seed : int
    law : "linear", "exact" or None
        None: the linear law where it is good enough.
    robust : bool
    """

    seed: int = 1
    law: LawName | None = None
    robust: bool = False


@dataclass(frozen=True, eq=False)
class Fitted:
    """A converged fit.

    Attributes
    ----------
    prepared : Prepared
    inference : Inference
    draws : Draws
    summary : dict
    """

    prepared: Prepared
    inference: Inference
    draws: Draws
    summary: Summary


Refuse = Callable[[Inference], None]


def with_board(prepared: Prepared, board: Board) -> Prepared:
    """The same card with another model of the board: one more effect, or two labels exchanged."""
    return replace(prepared, board=board)


def posed(prepared: Prepared, request: Request) -> Problem:
    """The problem of a prepared board; see `bayesplate.posterior.inference.pose`."""
    return pose(prepared.board, prepared.prior, law=request.law, robust=request.robust)


def fitted(
    prepared: Prepared,
    problem: Problem,
    request: Request,
    checkpoints: Path | None,
    refuse: Refuse,
    progress: Callable[[Progress], None] | None = None,
) -> Fitted:
    """Sample a problem, and once more under the exact law if the draws show that the linear one does not serve.

    Parameters
    ----------
    prepared : Prepared
    problem : Problem
    request : Request
    checkpoints : Path or None
        Folder of the unfinished run's chunks, one subfolder a law; None keeps none.
    refuse : callable
        Called with an inference that failed the convergence gate; raises.
    progress : callable, optional

    Returns
    -------
    Fitted
    """

    def sampled(under: Problem) -> tuple[Inference, Draws]:
        checkpoint = None if checkpoints is None else checkpoint_in(checkpoints, prepared, under)
        settings = SamplerSettings(seed=request.seed)
        inference = infer(under, settings, checkpoint=checkpoint, progress=progress)
        if not inference.convergence.passed:
            refuse(inference)
        return inference, named_draws(inference, request.seed)

    inference, draws = sampled(problem)
    errors = linearisation(inference, draws)
    if request.law is None and problem.posterior.law == "linear" and not linear_is_enough(inference, draws, errors):
        # The choice was made on a normal approximation; the draws know better.
        inference, draws = sampled(problem.under("exact"))
        errors = linearisation(inference, draws)
    summary = summarise(inference, draws, request.seed, versions(), prepared.card.sha256, errors)
    return Fitted(prepared, inference, draws, summary)


def checkpoint_in(folder: Path, prepared: Prepared, problem: Problem) -> Checkpoint:
    """Where the chunks of a problem under its law are kept."""
    return Checkpoint(folder / problem.posterior.law, fingerprint(prepared, problem))


def fingerprint(prepared: Prepared, problem: Problem) -> str:
    """Hash of everything besides the sampler's settings that decides the draws."""
    prior = {name: repr(density) for name, density in problem.prior.densities.items()}
    identity = {
        "card": prepared.card.sha256,
        "prior": prior,
        "noise": [repr(setup.noise) for setup in problem.board.setups],
        "inputs": {name: repr(quantity) for name, quantity in problem.board.inputs.items()},
        "effects": list(problem.board.effects),
        "forms": [repr(effect) for effect in problem.board.chosen],
        "readings": [repr(setup.readings) for setup in problem.board.setups],
        "attached": [repr(setup.attached) for setup in problem.board.setups],
        "law": problem.posterior.law,
        "law_alone": problem.is_forced,
        "robust": problem.posterior.robust,
        "versions": versions(),
    }
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
