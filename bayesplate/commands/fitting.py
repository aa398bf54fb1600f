"""One fit, from a problem to draws and a summary, with the law that serves; what `fit` and `diagnose` share."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from bayesplate.board.board import Board
from bayesplate.commands.problem import Problem
from bayesplate.errors import CheckpointError, NotConvergedError
from bayesplate.posterior.assessment import assess
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference, infer
from bayesplate.posterior.likely_labels import with_likely_labels
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.reweighting import linear_is_enough, linearisation
from bayesplate.posterior.sampling import Progress, SamplerSettings
from bayesplate.results.archive import attributes_of, posterior_tree, to_arviz
from bayesplate.results.folder import OutputFolder
from bayesplate.results.summarise import summarise
from bayesplate.results.summary import Summary, versions


@dataclass(frozen=True, eq=False)
class Fitted:
    """A converged fit.

    Attributes
    ----------
    inference : Inference
        Chains and the verdict of the convergence gate.
    draws : Draws
        The thinned posterior by name.
    summary : Summary
        What summary.json holds: constants, modes, errors, the sampler's health.
    """

    problem: Problem
    inference: Inference
    draws: Draws
    summary: Summary

    @cached_property
    def tree(self) -> Any:
        """The draws as posterior.nc holds them: an xarray.DataTree."""
        attributes = attributes_of(self.inference, self.summary, self.problem.prepared.card_text)
        return posterior_tree(self.inference, self.draws, attributes)

    def to_arviz(self) -> Any:
        """The draws as ArviZ works with them: InferenceData in ArviZ 0.23, DataTree in 1.x; as in posterior.nc.

        Returns
        -------
        arviz.InferenceData or xarray.DataTree
        """
        return to_arviz(self.tree)


@dataclass(frozen=True, eq=False)
class Opened:
    """A run that may begin: its problem is posed and its folder open.

    Attributes
    ----------
    folder : OutputFolder or None
        None if nothing is to be written.
    """

    problem: Problem
    seed: int
    folder: OutputFolder | None

    @property
    def path(self) -> Path | None:
        """Where the files go; None if nothing is to be written."""
        return None if self.folder is None else self.folder.path

    def checkpoints(self, part: str = "") -> Path | None:
        """Where the chunks of the run, or of one of its fits, are kept."""
        return None if self.folder is None else self.folder.checkpoint / part


Refuse = Callable[[Inference], None]


def with_board(problem: Problem, board: Board) -> Problem:
    """The same card with another model of the board: one more effect, or two labels exchanged."""
    return replace(problem, prepared=replace(problem.prepared, board=board))


def opened(
    problem: Problem,
    seed: int,
    out: str | os.PathLike[str] | None,
    *,
    force: bool = False,
    resume: bool = False,
    first: str = "",
) -> Opened:
    """Pose a problem and open the folder of its run; whatever is refused is refused before that.

    Parameters
    ----------
    out : path or None
        Output folder; None writes nothing.
    force, resume : bool
        Replace the results in the folder, or continue an interrupted run.
    first : str
        Which of several fits comes first: the subfolder of its checkpoint.

    Raises
    ------
    InputError
        If the folder may not be used; then nothing is written, nor with the following.
    NotIdentifiableError
        If the data leave a constant open.
    CheckpointError
        If there is nothing to resume.
    """
    folder = None if out is None else OutputFolder(Path(out))
    if folder is not None:
        folder.require_usable(force=force, resume=resume)
    posed = problem.posed
    SamplerSettings(seed=seed).walkers(posed.parameters.n_dim)
    if folder is not None:
        if resume and not checkpoint_in(folder.checkpoint / first, problem, posed).exists():
            wanted = f"a saved run under the {posed.posterior.law} law"
            raise CheckpointError(f"{folder.path}: wanted {wanted}, got none to resume (--force runs it anew)")
        folder.open(resume=resume)
    return Opened(problem, seed, folder)


def fitted(
    problem: Problem,
    seed: int,
    checkpoints: Path | None,
    refuse: Refuse,
    progress: Callable[[Progress], None] | None = None,
) -> Fitted:
    """Sample a problem, and once more under the exact law if the draws show that the linear one does not serve.

    Parameters
    ----------
    checkpoints : Path or None
        Folder of the unfinished run's chunks, one subfolder per law; None keeps none.
    refuse : callable
        Called with an inference that failed the convergence gate; raises.
    """

    def sampled(under: PosedProblem) -> tuple[Inference, Draws]:
        checkpoint = None if checkpoints is None else checkpoint_in(checkpoints, problem, under)
        inference = infer(under, SamplerSettings(seed=seed), checkpoint=checkpoint, progress=progress)
        if not inference.convergence.passed:
            refuse(inference)
        return with_likely_labels(inference, seed)

    inference, draws = sampled(problem.posed)
    errors = linearisation(inference, draws)
    is_linear = problem.law == "linear"
    if problem.asked_law is None and is_linear and not linear_is_enough(inference, draws, errors):
        # The choice was made on a normal approximation; the draws know better.
        inference, draws = sampled(problem.posed.under("exact"))
        errors = linearisation(inference, draws)
    assessment = assess(inference, draws, errors)
    summary = summarise(inference, draws, assessment, seed, versions(), problem.prepared.card.sha256)
    return Fitted(problem, inference, draws, summary)


def not_converged(
    convergence: Convergence, doubts: Sequence[str] = (), *, of: str = "", so: str = "no constants are given"
) -> NotConvergedError:
    """The error of draws that failed the gate.

    Parameters
    ----------
    doubts : sequence of str
        What is unusual about the board that they are of: the likeliest cause.
    of : str
        What was sampled, where a run samples more than one board.
    so : str
        What follows.
    """
    what = f"the sampler did not converge{f' for {of}' if of else ''}, so {so}:"
    return NotConvergedError("\n".join((what, *convergence.reasons, *(f"A likely cause: {doubt}" for doubt in doubts))))


def checkpoint_in(folder: Path, problem: Problem, posed: PosedProblem) -> Checkpoint:
    """Where the chunks of a problem under the law of that posing are kept."""
    return Checkpoint(folder / posed.posterior.law, fingerprint(problem, posed))


def fingerprint(problem: Problem, posed: PosedProblem) -> str:
    """Hash of everything besides the sampler's settings that decides the draws."""
    prior = {name: repr(density) for name, density in posed.prior.constants.items()}
    identity = {
        "card": problem.prepared.card.sha256,
        "prior": prior,
        "noise": [repr(setup.noise) for setup in posed.board.setups],
        "parameters": [repr(parameter) for parameter in posed.board.parameters],
        "effects": list(posed.board.effects),
        "forms": [repr(effect) for effect in posed.board.chosen],
        "readings": [repr(setup.readings) for setup in posed.board.setups],
        "peaks": [repr((setup.peaks, setup.missed, setup.spurious)) for setup in posed.board.setups],
        "attached": [repr(setup.attached) for setup in posed.board.setups],
        "law": posed.posterior.law,
        "law_alone": posed.is_forced,
        "robust": posed.posterior.robust,
        "versions": versions(),
    }
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
