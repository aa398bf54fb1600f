"""The report of `check` on a campaign as types: what each board and all together would tell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bayesplate.results.checking import CheckReport


@dataclass(frozen=True)
class CheckedShared:
    """A number that the boards would share."""

    unit: str  # SI; "1" for a ratio
    # prior_q05, prior_q50, prior_q95: quantiles of its prior
    prior_q05: float
    prior_q50: float
    prior_q95: float
    expected_sd: float  # in standard deviations of its prior, from all boards together
    boards: Mapping[str, float]  # the same from each board alone


@dataclass(frozen=True, repr=False)
class CampaignCheck:
    """What a fit of a campaign would do.

    Attributes
    ----------
    name, title : str
    shared : dict of CheckedShared
    population : str or None
        Name of the prior of the population.
    boards : dict of CheckReport
    """

    name: str
    title: str
    shared: Mapping[str, CheckedShared]
    population: str | None
    boards: Mapping[str, CheckReport]

    def __repr__(self) -> str:
        told = ", ".join(f"{name} ({one.expected_sd:.2f} of its prior's sd)" for name, one in self.shared.items())
        return f"<CampaignCheck of {self.name}: {len(self.boards)} boards; {told or 'nothing shared'}>"
