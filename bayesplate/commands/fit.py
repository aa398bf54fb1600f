"""`fit`: a board to the posterior of its constants; files where they are asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from bayesplate.commands.arguments import checked
from bayesplate.commands.campaign import Campaign, problem_or_campaign
from bayesplate.commands.fitting import Fitted, fitted, not_converged, opened
from bayesplate.commands.one_thread import one_thread_each
from bayesplate.commands.options import (
    CARD,
    Effects,
    Force,
    Law,
    OnProgress,
    Out,
    Report,
    Resume,
    Robust,
    Seed,
    SetupFile,
)
from bayesplate.commands.prepare import Card
from bayesplate.commands.problem import Problem
from bayesplate.commands.shown import show_fit
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.files import write_text, writing
from bayesplate.posterior.inference import Inference
from bayesplate.report.plots import FitPlots
from bayesplate.results.archive import write_tree
from bayesplate.results.contract import json_text
from bayesplate.results.folder import ARCHIVE, PAGE, SUMMARY, run_of_its_own
from bayesplate.results.summarise import unconverged_summary
from bayesplate.results.summary import versions

if TYPE_CHECKING:
    from bayesplate.commands.campaign_result import CampaignFitResult


@dataclass(frozen=True, eq=False, repr=False)
class FitResult(Fitted):
    """What a fit leaves, and where.

    Attributes
    ----------
    folder : Path or None
        Where its files are; None if none were asked for.
    """

    folder: Path | None = None

    @cached_property
    def plot(self) -> FitPlots:
        """The figures: `result.plot.constants()`."""
        return FitPlots(self.inference, self.draws, self.summary)

    def __repr__(self) -> str:
        return repr(self.summary).replace("<Summary", "<FitResult", 1)

    def _repr_html_(self) -> str:
        """The tables as a notebook shows them."""
        return show_fit(self.summary).html(self.problem.board.title or self.summary.name)


@one_thread_each()
@run_of_its_own()
@checked()
def fit(
    card: Annotated[Problem | Card | Campaign, CARD],
    *,
    out: Out = None,
    report: Report = True,
    seed: Seed = 1,
    effects: Effects = None,
    law: Law = None,
    robust: Robust = False,
    setup: SetupFile = None,
    force: Force = False,
    resume: Resume = False,
    progress: OnProgress = None,
) -> FitResult | CampaignFitResult:
    """Fit the elastic constants of a board, or of all boards of a campaign and what they share.

    Parameters
    ----------
    card : Problem, str, path, Board or Campaign
        A problem, the name of a shipped board or campaign card, the path of a card, or a board made in Python.
    out : path, optional
        Output folder, for summary.json, posterior.nc, the report and the checkpoints; nothing is written without it.
        Of a campaign it has a folder boards/NAME for each board.
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
    setup : path, optional
        A file with a table [setup] that takes the place of the card's, key by key: what `pick` writes.
    force, resume : bool
        Replace the results in the folder, or continue an interrupted run.
    progress : callable, optional
        Told after every chunk of sampling.

    Returns
    -------
    FitResult or CampaignFitResult
        The latter of a campaign.

    Raises
    ------
    InputError
        If the card or the folder cannot be used, or effects, law, robust or setup are given beside a problem, which
        states them itself; then nothing is written.
    NotIdentifiableError
        If the data leave a constant open; then nothing is written.
    NotConvergedError
        If the sampler fails its gate; summary.json then says so and gives no constants.
    CheckpointError
        If a run cannot be resumed.
    """
    problem = problem_or_campaign(card, effects=effects, law=law, robust=robust, setup=setup)
    if isinstance(problem, Campaign):
        from bayesplate.commands.campaign_fit import fit_campaign  # which writes boards as this file does

        return fit_campaign(problem, out=out, report=report, seed=seed, force=force, resume=resume, progress=progress)
    run = opened(problem, seed, out, force=force, resume=resume)

    def refuse(inference: Inference) -> None:
        refuse_unconverged(inference, seed, problem, run.path)

    found = fitted(problem, seed, run.checkpoints(), refuse, progress)
    result = FitResult(found.problem, found.inference, found.draws, found.summary, run.path)
    if run.folder is not None:
        write_fit(run.folder.path, result)
        if report:
            write_page(run.folder.path, result)
        run.folder.close()
    return result


def write_fit(folder: Path, result: Fitted) -> None:
    """Write summary and archive of a fit into a folder that is there."""
    write_tree(folder / ARCHIVE, result.tree)
    write_text(folder / SUMMARY, json_text(result.summary))


def write_page(folder: Path, result: Fitted, diagnosis: Diagnosis | None = None) -> Path:
    """Write report.html, its figures and tables; with a diagnosis its verdict too."""
    from bayesplate.report.page import write_report

    card = result.problem.prepared.card
    with writing(folder / PAGE):
        return write_report(folder, card, result.inference, result.draws, result.summary, diagnosis)


def refuse_unconverged(inference: Inference, seed: int, problem: Problem, folder: Path | None) -> None:
    """Write the diagnostics of a run that failed the gate, and say so."""
    convergence = inference.convergence
    if folder is not None:
        sha256 = problem.prepared.card.sha256
        summary = unconverged_summary(inference.problem, inference.chains, convergence, seed, versions(), sha256)
        write_text(folder / SUMMARY, json_text(summary))
    raise not_converged(convergence, inference.problem.doubts)
