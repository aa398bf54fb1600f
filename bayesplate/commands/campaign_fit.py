"""`fit` of a campaign: each board alone, then the shared parameters, then each board given these."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.board.board import Board
from bayesplate.board.prior import PriorCard
from bayesplate.campaign.boards import FittedBoard
from bayesplate.campaign.claim import judge_left_out_boards
from bayesplate.campaign.common import common_residuals
from bayesplate.campaign.diagnosis import CampaignDiagnosis
from bayesplate.campaign.learning import SharedPosterior, learn_shared
from bayesplate.campaign.population import BoardConstants, Population, find_population, next_board_prior
from bayesplate.campaign.summary import (
    FORMAT,
    CampaignSummary,
    UnconvergedCampaign,
    learning_warnings,
    population_summary,
    shared_numbers,
    shared_tree,
)
from bayesplate.commands.campaign import Campaign
from bayesplate.commands.fitting import FIT_TIME, FitResult, Run, Stages, convergence_error
from bayesplate.commands.printout import Printout, show_campaign_fit
from bayesplate.errors import Fault, InputError, NotConvergedError
from bayesplate.files import catch_write_errors, write_text
from bayesplate.posterior.assessment import assess
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.report.plots import CampaignPlots
from bayesplate.results.archive import to_arviz, write_tree
from bayesplate.results.contract import as_json, json_text
from bayesplate.results.folder import ARCHIVE_FILE, BOARDS_FOLDER, PAGE_FILE, POPULATION_SUFFIX, SUMMARY_FILE
from bayesplate.results.summarise import sampler_health, summarise
from bayesplate.results.summary import versions

SHARED_TIME = 1.0
"""Time of sampling the shared parameters, relative to FIT_TIME."""
_BOARD_STREAM = 17


@dataclass(frozen=True, eq=False, repr=False)
class CampaignFitResult:
    """Result of `fit` for a campaign.

    Attributes
    ----------
    folder : Path or None
        Where its files are; None if none were asked for.
    campaign : Campaign
    summary : CampaignSummary
        What summary.json holds.
    boards : dict of FitResult
        By name: each board, given what all boards tell of the shared parameters.
    alone : dict of FitResult
        By name: each board by itself.
    shared_posterior : SharedPosterior or None
        The posterior of the shared parameters; None where nothing is shared.
    population : Population or None
    """

    folder: Path | None
    campaign: Campaign
    summary: CampaignSummary
    boards: Mapping[str, FitResult]
    alone: Mapping[str, FitResult]
    shared_posterior: SharedPosterior | None
    population: Population | None

    @cached_property
    def prior(self) -> PriorCard | None:
        """Prior card for the next board, from these ones; None where they share no population."""
        if self.population is None:
            return None
        source = f"{len(self.boards)} boards of the campaign {self.campaign.name}"
        rng = np.random.default_rng([self.summary.seed, _BOARD_STREAM])
        return next_board_prior(self.population, f"{self.campaign.name}{POPULATION_SUFFIX}", source, rng)

    @cached_property
    def plot(self) -> CampaignPlots:
        """The figures: `result.plot.shared()`."""
        return CampaignPlots(self.summary)

    def to_arviz(self) -> Any:
        """The draws of what is shared, as in posterior.nc; each board has its own in `boards[NAME].to_arviz()`.

        Raises
        ------
        InputError
            If nothing is shared.
        """
        if self.shared_posterior is None:
            wanted, remedy = "a campaign that shares something", "every board has its own draws: boards[NAME]"
            raise InputError(Fault("to_arviz", wanted, "nothing shared", remedy))
        return to_arviz(shared_tree(self.shared_posterior, self._attributes))

    @property
    def _attributes(self) -> dict[str, str]:
        return {
            "card": self.campaign.card.text,
            "card_sha256": self.summary.card_sha256,
            "versions": json.dumps(as_json(self.summary.versions)),
            "seed": str(self.summary.seed),
        }

    def write(self, folder: Path, *, report: bool = True, diagnosis: CampaignDiagnosis | None = None) -> None:
        """Write summary.json, posterior.nc, the prior card of the next board, pages, and a folder for each board.

        Raises
        ------
        UnwritableError
            If the disk is full or the place is not ours.
        """
        from bayesplate.report.campaign import write_campaign_report

        for name, fit in self.boards.items():
            fit.write(folder / BOARDS_FOLDER / name)
            if report:
                fit.write_page(folder / BOARDS_FOLDER / name)
        if self.prior is not None:
            write_text(folder / f"{self.prior.name}.toml", self.prior.to_toml())
        if self.shared_posterior is not None:
            write_tree(folder / ARCHIVE_FILE, shared_tree(self.shared_posterior, self._attributes))
        write_text(folder / SUMMARY_FILE, json_text(self.summary))
        if report:
            with catch_write_errors(folder / PAGE_FILE):
                write_campaign_report(folder, self.campaign.card.title, self.summary, diagnosis)

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_campaign_fit(self.summary)

    def _repr_html_(self) -> str:
        return self.printout().html(self.campaign.card.title or self.campaign.name)

    def __repr__(self) -> str:
        return repr(self.summary).replace("<CampaignSummary", "<CampaignFitResult", 1)


def fit_campaign(campaign: Campaign, run: Run, *, report: bool) -> CampaignFitResult:
    """Fit a campaign; `bayesplate.fit` says what is raised."""
    with campaign_run(campaign, run, len(campaign.problems) * FIT_TIME + SHARED_TIME):
        result = replace(fit_together(campaign, run), folder=run.path)
    if run.folder is not None:
        result.write(run.folder.path, report=report)
        run.folder.close()
    return result


@contextmanager
def campaign_run(campaign: Campaign, run: Run, remaining_time: float, place: str = "") -> Iterator[None]:
    """A run that begins with each board alone, at a place of the checkpoint; summary.json states a failure."""
    run.open({f"{place}{BOARDS_FOLDER}/{problem.board.name}": problem for problem in campaign.problems}, remaining_time)
    try:
        yield
    except NotConvergedError as error:
        if run.path is not None:
            summary = UnconvergedCampaign(
                FORMAT,
                campaign.name,
                run.seed,
                versions(),
                campaign.card.sha256,
                converged=False,
                warnings=(str(error),),
            )
            write_text(run.path / SUMMARY_FILE, json_text(summary))
        raise


def fit_boards(campaign: Campaign, run: Run, place: str = "") -> dict[str, FitResult]:
    """Fit every board alone, one after another, each with a folder of its own at a place of the checkpoint."""
    names = [problem.board.name for problem in campaign.problems]
    return {
        name: run.fit(problem, f"{place}{BOARDS_FOLDER}/{name}", f"board {name}", subject=f"board {name}")
        for name, problem in zip(names, campaign.problems, strict=True)
    }


def fit_together(campaign: Campaign, run: Run) -> CampaignFitResult:
    """Fit boards and the parameters that they share; nothing is written but checkpoints."""
    alone = fit_boards(campaign, run)
    run.stages.begin("what the boards share", SHARED_TIME)
    shared_posterior, boards, warnings = _fit_shared(campaign, alone, run.seed, run.stages)
    return campaign_result(campaign, alone, boards, shared_posterior, warnings, run.seed)


def campaign_result(
    campaign: Campaign,
    alone: Mapping[str, FitResult],
    boards: Mapping[str, FitResult],
    shared_posterior: SharedPosterior | None,
    warnings: tuple[str, ...],
    seed: int,
) -> CampaignFitResult:
    """The result of fitted boards, with the population of their constants where they share one."""
    population = _population(campaign, boards, shared_posterior, seed)
    summary = _summary(campaign, boards, shared_posterior, population, warnings, seed)
    return CampaignFitResult(None, campaign, summary, boards, alone, shared_posterior, population)


def _fit_shared(
    campaign: Campaign, alone: Mapping[str, FitResult], seed: int, stages: Stages
) -> tuple[SharedPosterior | None, Mapping[str, FitResult], tuple[str, ...]]:
    """The shared parameters, every board given what all boards tell of them, and warnings."""
    if not campaign.shared:
        return None, alone, ()
    members = [FittedBoard(fit.draws, campaign.shared) for fit in alone.values()]
    shared_posterior = learn_shared(members, SamplerSettings(seed=seed), stages.sampled)
    if not shared_posterior.convergence.passed:
        raise convergence_error(shared_posterior.convergence, subject="what the boards share")
    boards, effective = {}, {}
    for i, member in enumerate(shared_posterior.members):
        rng = np.random.default_rng([seed, _BOARD_STREAM, i])
        draws, effective[member.name] = shared_posterior.board(i, rng, seed)
        fit_alone = alone[member.name]
        assessment = assess(draws)
        sha256 = fit_alone.problem.prepared.card.sha256
        summary = summarise(draws, assessment, seed, versions(), sha256)
        boards[member.name] = FitResult(fit_alone.problem, draws, summary)
    return shared_posterior, boards, learning_warnings(shared_posterior, effective)


def _population(
    campaign: Campaign, boards: Mapping[str, FitResult], shared_posterior: SharedPosterior | None, seed: int
) -> Population | None:
    if campaign.population is None:
        return None
    unscattered = [i for i, parameter in enumerate(campaign.shared) if not parameter.scatter]
    common, z = np.zeros((0, 0)), dict.fromkeys(boards)
    if shared_posterior is not None and unscattered:
        common = shared_posterior.combined.moments()[1][np.ix_(unscattered, unscattered)]
        z = {
            member.name: member.conditional.z_of(boards[member.name].draws.flat)[:, unscattered]
            for member in shared_posterior.members
        }
    constants = [BoardConstants.of(fit.draws, z[name]) for name, fit in boards.items()]
    population = find_population(constants, campaign.population, SamplerSettings(seed=seed), common)
    if not population.convergence.passed:
        raise convergence_error(population.convergence, subject="the population of the boards' constants")
    return population


def _summary(
    campaign: Campaign,
    boards: Mapping[str, FitResult],
    shared_posterior: SharedPosterior | None,
    population: Population | None,
    warnings: tuple[str, ...],
    seed: int,
) -> CampaignSummary:
    summaries = {name: fit.summary for name, fit in boards.items()}
    prior = campaign.population
    return CampaignSummary(
        format=FORMAT,
        name=campaign.name,
        seed=seed,
        versions=versions(),
        card_sha256=campaign.card.sha256,
        converged=True,
        shared={} if shared_posterior is None else shared_numbers(shared_posterior, seed),
        left_out_boards={} if shared_posterior is None else judge_left_out_boards(shared_posterior.combined),
        common_residual=common_residuals(summaries, fitted_boards(boards)),
        population=None if population is None or prior is None else population_summary(population, prior.name, seed),
        boards=summaries,
        sampler=None
        if shared_posterior is None
        else sampler_health(shared_posterior.chains, shared_posterior.convergence),
        warnings=warnings,
    )


def fitted_boards(fits: Mapping[str, FitResult]) -> dict[str, Board]:
    return {name: fit.inference.problem.board for name, fit in fits.items()}
