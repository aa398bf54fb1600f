"""One fit, from a prepared board to draws and a summary, with the law that serves; what `fit` and `diagnose` share."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from bayesplate.errors import CheckpointError
from bayesplate.frequencies.laws import LawName
from bayesplate.plate.board import Board
from bayesplate.posterior.assessment import assess
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.draws import Draws, named_draws
from bayesplate.posterior.inference import Inference, PosedProblem, infer, pose
from bayesplate.posterior.reweighting import linear_is_enough, linearisation
from bayesplate.posterior.sampling import Progress, SamplerSettings
from bayesplate.results.folder import OutputFolder
from bayesplate.results.summarise import summarise
from bayesplate.results.summary import Summary
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
    summary : Summary
    """

    prepared: Prepared
    inference: Inference
    draws: Draws
    summary: Summary


@dataclass(frozen=True, eq=False)
class Opened:
    """A run that may begin: its problem is posed and its folder open.

    Attributes
    ----------
    prepared : Prepared
    request : Request
    problem : PosedProblem
    folder : OutputFolder or None
        None if nothing is to be written.
    """

    prepared: Prepared
    request: Request
    problem: PosedProblem
    folder: OutputFolder | None

    @property
    def path(self) -> Path | None:
        """Where the files go; None if nothing is to be written."""
        return None if self.folder is None else self.folder.path

    def checkpoints(self, part: str = "") -> Path | None:
        """Where the chunks of the run, or of one of its fits, are kept."""
        return None if self.folder is None else self.folder.checkpoint / part


Refuse = Callable[[Inference], None]


def with_board(prepared: Prepared, board: Board) -> Prepared:
    """The same card with another model of the board: one more effect, or two labels exchanged."""
    return replace(prepared, board=board)


def posed(prepared: Prepared, request: Request) -> PosedProblem:
    """The problem of a prepared board; see `bayesplate.posterior.inference.pose`."""
    return pose(prepared.board, prepared.prior, law=request.law, robust=request.robust)


def opened(
    prepared: Prepared,
    request: Request,
    out: str | os.PathLike[str] | None,
    *,
    write: bool = True,
    force: bool = False,
    resume: bool = False,
    first: str = "",
) -> Opened:
    """Pose the problem of a prepared board and open the folder of its run; whatever is refused is refused before that.

    Parameters
    ----------
    prepared : Prepared
    request : Request
    out : path or None
        Output folder; by default results/NAME.
    write : bool
        False opens none.
    force, resume : bool
        Replace the results in the folder, or continue an interrupted run.
    first : str
        Which of several fits comes first: the subfolder of its checkpoint.

    Returns
    -------
    Opened

    Raises
    ------
    InputError
        If the folder may not be used; then nothing is written, nor with the following.
    NotIdentifiableError
        If the data leave a constant open.
    CheckpointError
        If there is nothing to resume.
    """
    folder = OutputFolder(Path(out) if out is not None else Path("results") / prepared.board.name) if write else None
    if folder is not None:
        folder.require_usable(force=force, resume=resume)
    problem = posed(prepared, request)
    SamplerSettings(seed=request.seed).walkers(problem.parameters.n_dim)
    if folder is not None:
        if resume and not checkpoint_in(folder.checkpoint / first, prepared, problem).exists():
            wanted = f"a saved run under the {problem.posterior.law} law"
            raise CheckpointError(f"{folder.path}: wanted {wanted}, got none to resume (--force runs it anew)")
        folder.open(resume=resume)
    return Opened(prepared, request, problem, folder)


def fitted(
    prepared: Prepared,
    problem: PosedProblem,
    request: Request,
    checkpoints: Path | None,
    refuse: Refuse,
    progress: Callable[[Progress], None] | None = None,
) -> Fitted:
    """Sample a problem, and once more under the exact law if the draws show that the linear one does not serve.

    Parameters
    ----------
    prepared : Prepared
    problem : PosedProblem
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

    def sampled(under: PosedProblem) -> tuple[Inference, Draws]:
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
    assessment = assess(inference, draws, errors)
    summary = summarise(inference, draws, assessment, request.seed, versions(), prepared.card.sha256)
    return Fitted(prepared, inference, draws, summary)


def checkpoint_in(folder: Path, prepared: Prepared, problem: PosedProblem) -> Checkpoint:
    """Where the chunks of a problem under its law are kept."""
    return Checkpoint(folder / problem.posterior.law, fingerprint(prepared, problem))


def fingerprint(prepared: Prepared, problem: PosedProblem) -> str:
    """Hash of everything besides the sampler's settings that decides the draws."""
    prior = {name: repr(density) for name, density in problem.prior.constants.items()}
    identity = {
        "card": prepared.card.sha256,
        "prior": prior,
        "noise": [repr(setup.noise) for setup in problem.board.setups],
        "parameters": [repr(parameter) for parameter in problem.board.parameters],
        "effects": list(problem.board.effects),
        "forms": [repr(effect) for effect in problem.board.chosen],
        "readings": [repr(setup.readings) for setup in problem.board.setups],
        "attached": [repr(setup.attached) for setup in problem.board.setups],
        "law": problem.posterior.law,
        "robust": problem.posterior.robust,
        "versions": versions(),
    }
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
