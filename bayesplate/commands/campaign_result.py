"""What a fit of a campaign leaves, and the files that it is written to."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.board.prior import PriorCard
from bayesplate.campaign.archive import shared_tree
from bayesplate.campaign.diagnosis import CampaignDiagnosis
from bayesplate.campaign.learning import Learnt
from bayesplate.campaign.population import Population, prior_of
from bayesplate.campaign.summary import (
    CampaignSummary,
)
from bayesplate.commands.campaign import Campaign
from bayesplate.commands.fit import write_fit, write_page
from bayesplate.commands.fitting import Fitted
from bayesplate.commands.shown import show_fit
from bayesplate.errors import Fault, InputError
from bayesplate.files import make_folder, write_text, writing
from bayesplate.report.plots import CampaignPlots
from bayesplate.results.archive import to_arviz, write_tree
from bayesplate.results.contract import as_json, json_text
from bayesplate.results.folder import ARCHIVE, BOARDS, OF_POPULATION, PAGE, SUMMARY

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
    boards : dict of Fitted
        By name: each board under what all teach.
    alone : dict of Fitted
        The same of each board alone.
    learnt : Learnt or None
        What is shared; None where nothing is.
    population : Population or None
    """

    folder: Path | None
    campaign: Campaign
    summary: CampaignSummary
    boards: Mapping[str, Fitted]
    alone: Mapping[str, Fitted]
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

    def write(self, folder: Path) -> None:
        """Write summary.json, posterior.nc, the prior card of the next board, and a folder for each board."""
        for name, one in self.boards.items():
            make_folder(folder / BOARDS / name)
            write_fit(folder / BOARDS / name, one)
        if self.prior is not None:
            write_text(folder / f"{self.prior.name}.toml", self.prior.to_toml())
        if self.learnt is not None:
            write_tree(folder / ARCHIVE, shared_tree(self.learnt, self._attributes))
        write_text(folder / SUMMARY, json_text(self.summary))

    def _repr_html_(self) -> str:
        """The tables as a notebook shows them."""
        return show_fit(self.summary).html(self.campaign.card.title or self.campaign.name)

    def __repr__(self) -> str:
        return repr(self.summary).replace("<CampaignSummary", "<CampaignFitResult", 1)


def write_campaign_pages(folder: Path, result: CampaignFitResult, diagnosis: CampaignDiagnosis | None = None) -> None:
    """Write the page of the campaign, and that of each board in its own folder."""
    from bayesplate.report.campaign import write_campaign_report

    for name, one in result.boards.items():
        write_page(folder / BOARDS / name, one)
    with writing(folder / PAGE):
        write_campaign_report(folder, result.campaign.card.title, result.summary, diagnosis)
