"""`fit`: a board or a campaign to the posterior of its constants; files where they are asked for."""

from __future__ import annotations

from typing import Annotated

from bayesplate.commands.arguments import check_arguments
from bayesplate.commands.campaign import Campaign, dispatch_card
from bayesplate.commands.campaign_fit import CampaignFitResult, fit_campaign
from bayesplate.commands.fitting import FitResult, Run, fit_problem
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
from bayesplate.commands.prepare import CardSource
from bayesplate.commands.problem import Problem
from bayesplate.results.folder import hold_output_folders


@hold_output_folders()
@check_arguments()
def fit(
    card: Annotated[Problem | CardSource | Campaign, CARD],
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
        Called after every chunk of sampling.

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
    run = Run(seed, out, force=force, resume=resume, progress=progress)
    return dispatch_card(
        card,
        lambda problem: fit_problem(problem, run, report=report),
        lambda campaign: fit_campaign(campaign, run, report=report),
        effects=effects,
        law=law,
        robust=robust,
        setup=setup,
    )
