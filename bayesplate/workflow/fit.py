"""`fit`: a board card to a posterior, and its files."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from bayesplate.errors import CheckpointError, NotConvergedError
from bayesplate.frequencies.laws import LawName
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.inference import Inference, Problem, infer, pose
from bayesplate.posterior.sampling import Progress, SamplerSettings
from bayesplate.results.draws import Draws, linear_is_enough, named_draws
from bayesplate.results.folder import ARCHIVE, SUMMARY, OutputFolder, json_text, write_text
from bayesplate.results.store import write_posterior
from bayesplate.results.summary import Summary, summarise, unconverged_summary
from bayesplate.results.versions import versions
from bayesplate.workflow.prepare import Prepared, prepare


@dataclass(frozen=True, eq=False)
class FitResult:
    """What a fit leaves.

    Attributes
    ----------
    folder : Path or None
        Where its files are; None if none were asked for.
    summary : dict
        As in summary.json.
    inference : Inference
    draws : Draws
    """

    folder: Path | None
    summary: Summary
    inference: Inference
    draws: Draws


def fit(
    card: str | os.PathLike[str],
    *,
    out: str | os.PathLike[str] | None = None,
    write: bool = True,
    seed: int = 1,
    effects: Sequence[str] | None = None,
    law: LawName | None = None,
    robust: bool = False,
    force: bool = False,
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> FitResult:
    """Fit the elastic constants of a board.

    Parameters
    ----------
    card : str or path
        Name of a shipped board card, or a path.
    out : path, optional
        Output folder; by default results/NAME.
    write : bool
        False writes nothing: no files, no checkpoints.
    seed : int
        Everything random follows from it.
    effects : sequence of str, optional
        Declared effects in place of the card's.
    law : "linear" or "exact", optional
        By default the linear law where it is good enough.
    robust : bool
        Student's distribution for the noise.
    force, resume : bool
        Replace the results in the folder, or continue an interrupted run.
    progress : callable, optional
        Told after every chunk of sampling.

    Returns
    -------
    FitResult

    Raises
    ------
    InputError
        If the card or the folder cannot be used; then nothing is written.
    NotIdentifiableError
        If the data leave a constant open; then nothing is written.
    NotConvergedError
        If the sampler fails its gate; summary.json then says so and gives no constants.
    CheckpointError
        If a run cannot be resumed.
    """
    prepared = prepare(card, effects)
    folder = OutputFolder(Path(out) if out is not None else Path("results") / prepared.board.name) if write else None
    if folder is not None:
        folder.require_usable(force=force, resume=resume)
    problem = pose(prepared.board, prepared.prior, law=law, robust=robust)
    settings = SamplerSettings(seed=seed)
    settings.walkers(problem.parameters.n_dim)

    def checkpoint_of(under: Problem) -> Checkpoint | None:
        if folder is None:
            return None
        return Checkpoint(folder.checkpoint / under.posterior.law, fingerprint(prepared, under))

    if folder is not None:
        saved = checkpoint_of(problem)
        if resume and saved is not None and not saved.exists():
            wanted = f"a saved run under the {problem.posterior.law} law"
            raise CheckpointError(f"{folder.path}: wanted {wanted}, got none to resume (--force runs it anew)")
        folder.open(resume=resume)

    def sampled(under: Problem) -> tuple[Inference, Draws]:
        inference = infer(under, settings, checkpoint=checkpoint_of(under), progress=progress)
        if not inference.convergence.passed:
            _refuse(inference, seed, prepared, folder)
        return inference, named_draws(inference, seed)

    inference, draws = sampled(problem)
    if law is None and problem.posterior.law == "linear" and not linear_is_enough(inference, draws):
        # The choice was made on a normal approximation; the draws know better.
        inference, draws = sampled(problem.under("exact"))
    summary = summarise(inference, draws, seed, versions(), prepared.card.sha256)
    if folder is not None:
        write_posterior(folder.path / ARCHIVE, inference, draws, summary, prepared.card_text)
        write_text(folder.path / SUMMARY, json_text(summary))
        folder.close()
    return FitResult(None if folder is None else folder.path, summary, inference, draws)


def fingerprint(prepared: Prepared, problem: Problem) -> str:
    """Hash of everything besides the sampler's settings that decides the draws."""
    prior = {name: repr(density) for name, density in problem.prior.densities.items()}
    identity = {
        "card": prepared.card.sha256,
        "prior": prior,
        "noise": [repr(setup.noise) for setup in problem.board.setups],
        "inputs": {name: repr(quantity) for name, quantity in problem.board.inputs.items()},
        "effects": list(problem.board.effects),
        "law": problem.posterior.law,
        "robust": problem.posterior.robust,
        "versions": versions(),
    }
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()


def _refuse(inference: Inference, seed: int, prepared: Prepared, folder: OutputFolder | None) -> None:
    """Write the diagnostics of a run that failed the gate, and say so."""
    convergence = inference.convergence
    if folder is not None:
        summary = unconverged_summary(
            inference.problem, inference.chains, convergence, seed, versions(), prepared.card.sha256
        )
        write_text(folder.path / SUMMARY, json_text(summary))
    raise NotConvergedError(
        "the sampler did not converge, so no constants are given:\n" + "\n".join(convergence.reasons)
    )
