"""`fit` of a campaign: its boards one after another, then what they share, then every board under what all teach."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from bayesplate.board.board import Board
from bayesplate.campaign.boards import Member
from bayesplate.campaign.common import common_residuals
from bayesplate.campaign.learning import Learnt, learn
from bayesplate.campaign.population import BoardConstants, Population, find_population
from bayesplate.campaign.summary import (
    FORMAT,
    CampaignSummary,
    UnconvergedCampaign,
    learning_warnings,
    left_out_boards,
    population_summary,
    shared_numbers,
)
from bayesplate.commands.campaign import Campaign
from bayesplate.commands.campaign_result import CampaignFitResult, write_campaign_pages
from bayesplate.commands.fitting import Fitted, fitted, not_converged
from bayesplate.commands.stages import Stages
from bayesplate.errors import CheckpointError, NotConvergedError
from bayesplate.files import write_text
from bayesplate.posterior.assessment import assess
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.sampling import Progress, SamplerSettings
from bayesplate.results.contract import json_text
from bayesplate.results.folder import BOARDS, SUMMARY, OutputFolder
from bayesplate.results.summarise import sampler_health, summarise
from bayesplate.results.summary import versions

_FIT, _SHARED = 3.0, 1.0
"""How long a board and what is shared take beside each other."""
_BOARD_LINE = 17


def fit_campaign(
    campaign: Campaign,
    *,
    out: str | os.PathLike[str] | None = None,
    report: bool = True,
    seed: int = 1,
    force: bool = False,
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> CampaignFitResult:
    """Fit a campaign; `bayesplate.fit` says what the arguments mean and what is raised."""
    folder = None if out is None else OutputFolder(Path(out))
    if folder is not None:
        folder.require_usable(force=force, resume=resume)
    stages = Stages(progress, len(campaign.problems) * _FIT + _SHARED)
    campaign.pose()
    for problem in campaign.problems:
        SamplerSettings(seed=seed).walkers(problem.posed.parameters.n_dim)
    if folder is not None:
        open_folder(folder, resume=resume)
    with telling_failure(folder, campaign, seed):
        result = fitted_together(campaign, seed, None if folder is None else folder.checkpoint, stages)
    if folder is not None:
        result = replace(result, folder=folder.path)
        result.write(folder.path)
        if report:
            write_campaign_pages(folder.path, result)
        folder.close()
    return result


def open_folder(folder: OutputFolder, *, resume: bool) -> None:
    """Open the folder of a campaign's run.

    Raises
    ------
    CheckpointError
        If there is nothing to resume.
    """
    if resume and not folder.has_checkpoint:
        raise CheckpointError(f"{folder.path}: wanted a saved run, got none to resume (--force runs it anew)")
    folder.open(resume=resume)


@contextmanager
def telling_failure(folder: OutputFolder | None, campaign: Campaign, seed: int) -> Iterator[None]:
    """Where something does not converge, summary.json says so."""
    try:
        yield
    except NotConvergedError as error:
        if folder is not None:
            summary = UnconvergedCampaign(
                FORMAT, campaign.name, seed, versions(), campaign.card.sha256, converged=False, warnings=(str(error),)
            )
            write_text(folder.path / SUMMARY, json_text(summary))
        raise


def fit_boards(campaign: Campaign, seed: int, checkpoints: Path | None, stages: Stages) -> dict[str, Fitted]:
    """Every board alone, one after another.

    Parameters
    ----------
    checkpoints : Path or None
        Folder of the unfinished run's chunks, one subfolder per board; None keeps none.
    stages : Stages
        Told of each board.
    """
    found = {}
    for problem in campaign.problems:
        name = problem.board.name
        stages.begin(f"board {name}", _FIT)
        own = None if checkpoints is None else checkpoints / BOARDS / name
        found[name] = fitted(problem, seed, own, _refusing(name), stages.sampled)
    return found


def fitted_together(campaign: Campaign, seed: int, checkpoints: Path | None, stages: Stages) -> CampaignFitResult:
    """Boards and what they share, nothing written but checkpoints; parameters as of `fit_boards`."""
    alone = fit_boards(campaign, seed, checkpoints, stages)
    stages.begin("what the boards share", _SHARED)
    learnt, boards, warnings = _together(campaign, alone, seed, stages)
    return summed_up(campaign, alone, boards, learnt, warnings, seed)


def summed_up(
    campaign: Campaign,
    alone: Mapping[str, Fitted],
    boards: Mapping[str, Fitted],
    learnt: Learnt | None,
    warnings: tuple[str, ...],
    seed: int,
) -> CampaignFitResult:
    """The result of boards that are fitted, with the population of their constants where they share one."""
    population = _population(campaign, boards, learnt, seed)
    summary = _summary(campaign, boards, learnt, population, warnings, seed)
    return CampaignFitResult(None, campaign, summary, boards, alone, learnt, population)


def _together(
    campaign: Campaign, alone: Mapping[str, Fitted], seed: int, stages: Stages
) -> tuple[Learnt | None, Mapping[str, Fitted], tuple[str, ...]]:
    """What is shared, every board under what all teach, and what a reader must know of it."""
    if not campaign.shared:
        return None, alone, ()
    members = [Member(one.inference, one.draws, campaign.shared) for one in alone.values()]
    learnt = learn(members, SamplerSettings(seed=seed), stages.sampled)
    if not learnt.convergence.passed:
        raise not_converged(learnt.convergence, of="what the boards share")
    boards, effective = {}, {}
    for i, member in enumerate(learnt.members):
        rng = np.random.default_rng([seed, _BOARD_LINE, i])
        inference, draws, effective[member.name] = learnt.board(i, rng, seed)
        before = alone[member.name]
        assessment = assess(inference, draws)
        sha256 = before.problem.prepared.card.sha256
        summary = summarise(inference, draws, assessment, seed, versions(), sha256)
        boards[member.name] = Fitted(before.problem, inference, draws, summary)
    return learnt, boards, learning_warnings(learnt, effective)


def _population(
    campaign: Campaign, boards: Mapping[str, Fitted], learnt: Learnt | None, seed: int
) -> Population | None:
    if campaign.population is None:
        return None
    same = [i for i, one in enumerate(campaign.shared) if not one.scatter]
    common, z = np.zeros((0, 0)), dict.fromkeys(boards)
    if learnt is not None and same:
        common = learnt.together.moments()[1][np.ix_(same, same)]
        z = {one.name: one.given.z_of(boards[one.name].draws.flat)[:, same] for one in learnt.members}
    constants = [BoardConstants.of(one.inference, one.draws, z[name]) for name, one in boards.items()]
    population = find_population(constants, campaign.population, SamplerSettings(seed=seed), common)
    if not population.convergence.passed:
        raise not_converged(population.convergence, of="the population of the boards' constants")
    return population


def _summary(
    campaign: Campaign,
    boards: Mapping[str, Fitted],
    learnt: Learnt | None,
    population: Population | None,
    warnings: tuple[str, ...],
    seed: int,
) -> CampaignSummary:
    summaries = {name: one.summary for name, one in boards.items()}
    prior = campaign.population
    return CampaignSummary(
        format=FORMAT,
        name=campaign.name,
        seed=seed,
        versions=versions(),
        card_sha256=campaign.card.sha256,
        converged=True,
        shared={} if learnt is None else shared_numbers(learnt, seed),
        left_out_boards={} if learnt is None else left_out_boards(learnt),
        common_residual=common_residuals(summaries, boards_of(boards)),
        population=None if population is None or prior is None else population_summary(population, prior.name, seed),
        boards=summaries,
        sampler=None if learnt is None else sampler_health(learnt.chains, learnt.convergence),
        warnings=warnings,
    )


def boards_of(found: Mapping[str, Fitted]) -> dict[str, Board]:
    """The boards that were fitted, by name."""
    return {name: one.inference.problem.board for name, one in found.items()}


def _refusing(name: str) -> Callable[[Inference], None]:
    def refuse(inference: Inference) -> None:
        raise not_converged(inference.convergence, inference.problem.doubts, of=f"board {name}")

    return refuse
