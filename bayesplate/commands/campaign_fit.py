"""`fit` of a campaign: its boards one after another, then what they share, then every board under what all teach."""

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
from bayesplate.campaign.boards import Member
from bayesplate.campaign.claim import left_out
from bayesplate.campaign.common import common_residuals
from bayesplate.campaign.diagnosis import CampaignDiagnosis
from bayesplate.campaign.learning import Learnt, learn
from bayesplate.campaign.population import BoardConstants, Population, find_population, prior_of
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
from bayesplate.commands.fitting import FIT, FitResult, Run, Stages, not_converged
from bayesplate.commands.shown import Shown, show_campaign_fit
from bayesplate.errors import Fault, InputError, NotConvergedError
from bayesplate.files import write_text, writing
from bayesplate.posterior.assessment import assess
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.report.plots import CampaignPlots
from bayesplate.results.archive import to_arviz, write_tree
from bayesplate.results.contract import as_json, json_text
from bayesplate.results.folder import ARCHIVE, BOARDS, OF_POPULATION, PAGE, SUMMARY
from bayesplate.results.summarise import sampler_health, summarise
from bayesplate.results.summary import versions

SHARED = 1.0
"""How long what is shared takes beside a fit."""
_BOARD_LINE = 17


@dataclass(frozen=True, eq=False, repr=False)
class CampaignFitResult:
    """What a fit of a campaign leaves.

    Attributes
    ----------
    folder : Path or None
        Where its files are; None if none were asked for.
    campaign : Campaign
    summary : CampaignSummary
        What summary.json holds.
    boards : dict of FitResult
        By name: each board under what all teach.
    alone : dict of FitResult
        The same of each board alone.
    learnt : Learnt or None
        What is shared; None where nothing is.
    population : Population or None
    """

    folder: Path | None
    campaign: Campaign
    summary: CampaignSummary
    boards: Mapping[str, FitResult]
    alone: Mapping[str, FitResult]
    learnt: Learnt | None
    population: Population | None

    @cached_property
    def prior(self) -> PriorCard | None:
        """What the boards teach of the next one, as a prior card; None where they share no population."""
        if self.population is None:
            return None
        source = f"{len(self.boards)} boards of the campaign {self.campaign.name}"
        rng = np.random.default_rng([self.summary.seed, _BOARD_LINE])
        return prior_of(self.population, f"{self.campaign.name}{OF_POPULATION}", source, rng)

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
        if self.learnt is None:
            wanted, remedy = "a campaign that shares something", "every board has its own draws: boards[NAME]"
            raise InputError(Fault("to_arviz", wanted, "nothing shared", remedy))
        return to_arviz(shared_tree(self.learnt, self._attributes))

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

        for name, one in self.boards.items():
            one.write(folder / BOARDS / name)
            if report:
                one.write_page(folder / BOARDS / name)
        if self.prior is not None:
            write_text(folder / f"{self.prior.name}.toml", self.prior.to_toml())
        if self.learnt is not None:
            write_tree(folder / ARCHIVE, shared_tree(self.learnt, self._attributes))
        write_text(folder / SUMMARY, json_text(self.summary))
        if report:
            with writing(folder / PAGE):
                write_campaign_report(folder, self.campaign.card.title, self.summary, diagnosis)

    def shown(self) -> Shown:
        """Tables and sentences for a person."""
        return show_campaign_fit(self.summary)

    def _repr_html_(self) -> str:
        return self.shown().html(self.campaign.card.title or self.campaign.name)

    def __repr__(self) -> str:
        return repr(self.summary).replace("<CampaignSummary", "<CampaignFitResult", 1)


def fit_campaign(campaign: Campaign, run: Run, *, report: bool) -> CampaignFitResult:
    """Fit a campaign; `bayesplate.fit` says what is raised."""
    with campaign_run(campaign, run, len(campaign.problems) * FIT + SHARED):
        result = replace(fitted_together(campaign, run), folder=run.path)
    if run.folder is not None:
        result.write(run.folder.path, report=report)
        run.folder.close()
    return result


@contextmanager
def campaign_run(campaign: Campaign, run: Run, left: float, place: str = "") -> Iterator[None]:
    """A run that begins with each board alone, at a place of the checkpoint; summary.json tells of a failure."""
    run.open({f"{place}{BOARDS}/{one.board.name}": one for one in campaign.problems}, left)
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
            write_text(run.path / SUMMARY, json_text(summary))
        raise


def fit_boards(campaign: Campaign, run: Run, place: str = "") -> dict[str, FitResult]:
    """Every board alone, one after another, each with a folder of its own at a place of the checkpoint."""
    names = [one.board.name for one in campaign.problems]
    return {
        name: run.fit(one, f"{place}{BOARDS}/{name}", f"board {name}", of=f"board {name}")
        for name, one in zip(names, campaign.problems, strict=True)
    }


def fitted_together(campaign: Campaign, run: Run) -> CampaignFitResult:
    """Fit boards and what they share; nothing is written but checkpoints."""
    alone = fit_boards(campaign, run)
    run.stages.begin("what the boards share", SHARED)
    learnt, boards, warnings = _together(campaign, alone, run.seed, run.stages)
    return summed_up(campaign, alone, boards, learnt, warnings, run.seed)


def summed_up(
    campaign: Campaign,
    alone: Mapping[str, FitResult],
    boards: Mapping[str, FitResult],
    learnt: Learnt | None,
    warnings: tuple[str, ...],
    seed: int,
) -> CampaignFitResult:
    """The result of fitted boards, with the population of their constants where they share one."""
    population = _population(campaign, boards, learnt, seed)
    summary = _summary(campaign, boards, learnt, population, warnings, seed)
    return CampaignFitResult(None, campaign, summary, boards, alone, learnt, population)


def _together(
    campaign: Campaign, alone: Mapping[str, FitResult], seed: int, stages: Stages
) -> tuple[Learnt | None, Mapping[str, FitResult], tuple[str, ...]]:
    """What is shared, every board under what all boards teach, and warnings."""
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
        boards[member.name] = FitResult(before.problem, inference, draws, summary)
    return learnt, boards, learning_warnings(learnt, effective)


def _population(
    campaign: Campaign, boards: Mapping[str, FitResult], learnt: Learnt | None, seed: int
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
    boards: Mapping[str, FitResult],
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
        left_out_boards={} if learnt is None else left_out(learnt.together),
        common_residual=common_residuals(summaries, boards_of(boards)),
        population=None if population is None or prior is None else population_summary(population, prior.name, seed),
        boards=summaries,
        sampler=None if learnt is None else sampler_health(learnt.chains, learnt.convergence),
        warnings=warnings,
    )


def boards_of(found: Mapping[str, FitResult]) -> dict[str, Board]:
    return {name: one.inference.problem.board for name, one in found.items()}
