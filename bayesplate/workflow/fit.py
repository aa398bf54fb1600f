"""`fit`: a board card to a posterior, and its files."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from bayesplate.diagnosis.wording.diagnosis import Diagnosis
from bayesplate.errors import NotConvergedError
from bayesplate.frequencies.laws import LawName
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.sampling import Progress
from bayesplate.results.folder import ARCHIVE, PAGE, SUMMARY, json_text, run_of_its_own, write_text, writing
from bayesplate.results.store import write_posterior
from bayesplate.results.summarise import unconverged_summary
from bayesplate.results.summary import Summary
from bayesplate.results.versions import versions
from bayesplate.workflow.arguments import require_arguments
from bayesplate.workflow.fitting import Fitted, Request, fitted, opened
from bayesplate.workflow.prepare import Prepared, prepare


@dataclass(frozen=True, eq=False)
class FitResult:
    """What a fit leaves.

    Attributes
    ----------
    folder : Path or None
        Where its files are; None if none were asked for.
    summary : Summary
    inference : Inference
    draws : Draws
    """

    folder: Path | None
    summary: Summary
    inference: Inference
    draws: Draws


@run_of_its_own()
def fit(
    card: str | os.PathLike[str],
    *,
    out: str | os.PathLike[str] | None = None,
    write: bool = True,
    report: bool = True,
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
    report : bool
        Whether to write report.html, its figures and tables beside the numbers.
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
    require_arguments(
        card=card, out=out, write=write, report=report, seed=seed, effects=effects, law=law, robust=robust,
        force=force, resume=resume, progress=progress,
    )  # fmt: skip
    prepared = prepare(card, effects)
    run = opened(prepared, Request(seed, law, robust), out, write=write, force=force, resume=resume)
    if write and report:
        from bayesplate.report.page import load_libraries

        load_libraries()  # while nobody waits for the page yet

    def refuse(inference: Inference) -> None:
        refuse_unconverged(inference, seed, prepared, run.path)

    result = fitted(prepared, run.problem, run.request, run.checkpoints(), refuse, progress)
    if run.folder is not None:
        write_fit(run.folder.path, result)
        if report:
            write_page(run.folder.path, result)
        run.folder.close()
    return FitResult(run.path, result.summary, result.inference, result.draws)


def write_fit(folder: Path, result: Fitted) -> None:
    """Write summary and archive of a fit into a folder that is there."""
    with writing(folder / ARCHIVE):
        write_posterior(folder / ARCHIVE, result.inference, result.draws, result.summary, result.prepared.card_text)
    write_text(folder / SUMMARY, json_text(result.summary))


def write_page(folder: Path, result: Fitted, diagnosis: Diagnosis | None = None) -> Path:
    """Write report.html, its figures and tables; with a diagnosis its verdict too."""
    from bayesplate.report.page import write_report

    card = result.prepared.card
    with writing(folder / PAGE):
        return write_report(folder, card, result.inference, result.draws, result.summary, diagnosis)


def refuse_unconverged(inference: Inference, seed: int, prepared: Prepared, folder: Path | None) -> None:
    """Write the diagnostics of a run that failed the gate, and say so."""
    convergence = inference.convergence
    if folder is not None:
        summary = unconverged_summary(
            inference.problem, inference.chains, convergence, seed, versions(), prepared.card.sha256
        )
        write_text(folder / SUMMARY, json_text(summary))
    raise NotConvergedError(
        "the sampler did not converge, so no constants are given:\n" + "\n".join(convergence.reasons)
    )
