"""A campaign in summary.json, posterior.nc and its check: the shared numbers, and each board's summary."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesplate.board.material import MODULI
from bayesplate.campaign.boards import FittedBoard
from bayesplate.campaign.claim import LeftOutBoard, refusing_boards
from bayesplate.campaign.combined import FEWEST_POINTS, shared_values
from bayesplate.campaign.common import CommonResidual
from bayesplate.campaign.learning import LARGEST_OFFSET, SharedPosterior
from bayesplate.campaign.population import Population
from bayesplate.campaign.scatter import scatters_of
from bayesplate.effects.words import join_words
from bayesplate.posterior.inference import MOST_DRAWS_A_CHAIN
from bayesplate.posterior.reweighting import FEWEST_WEIGHTED_DRAWS
from bayesplate.posterior.statistics import thin_walker_major
from bayesplate.results.archive import DRAW_DIMENSIONS, build_tree, sample_stats
from bayesplate.results.checking import CheckReport
from bayesplate.results.contract import Elastic, Spread
from bayesplate.results.summary import SamplerHealth, Summary

FORMAT = 1
_LINE = 16
_N_DRAWS = 4000


@dataclass(frozen=True)
class SharedNumber:
    """A number that all boards have in common, or about which their own scatter."""

    all_boards: Spread  # SI, under what all boards teach; where their own scatter, the median of such boards
    scatter: Spread | None  # standard deviation of the logarithm of the boards' own; None where all have the same
    own: Mapping[str, Spread]  # by board: from that board alone
    others: Mapping[str, Spread]  # by board: what all boards but that one say of its own
    prior_source: str  # where the prior comes from; empty if the boards' cards state it


@dataclass(frozen=True)
class PopulationSummary:
    """The distribution of the boards' constants."""

    prior: str  # name of the prior card
    mean: Elastic[Spread]  # Pa, median of the population
    sd_percent: Elastic[Spread]  # standard deviation of ln E in the population, per cent
    next_board: Elastic[Spread]  # Pa, of a board that was not measured yet
    boards: Mapping[str, Elastic[Spread]]  # Pa, each board's constants under the population


@dataclass(frozen=True)
class CampaignRun:
    """What was run, and whether all of it converged."""

    format: int
    name: str
    seed: int
    versions: Mapping[str, str]
    card_sha256: str
    converged: bool


@dataclass(frozen=True)
class UnconvergedCampaign(CampaignRun):
    """The summary of a campaign of which something failed the convergence gate: no constants."""

    warnings: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class CampaignSummary(CampaignRun):
    """The summary of a converged fit of a campaign.

    Attributes
    ----------
    format : int
    name : str
        Of the campaign.
    seed : int
    versions : dict of str
    card_sha256 : str
    converged : bool
    shared : dict of SharedNumber
        By name: "attached_mass.mass", "transverse_shear.G_xz / E_x".
    left_out_boards : dict of LeftOutBoard
        Empty where nothing is shared.
    common_residual : dict of CommonResidual
        By label.
    population : PopulationSummary or None
    boards : dict of Summary
        Each board under what all teach.
    sampler : SamplerHealth or None
        Of what is shared; None where nothing is.
    warnings : tuple of str
    """

    shared: Mapping[str, SharedNumber]
    left_out_boards: Mapping[str, LeftOutBoard]
    common_residual: Mapping[str, CommonResidual]
    population: PopulationSummary | None
    boards: Mapping[str, Summary]
    sampler: SamplerHealth | None
    warnings: tuple[str, ...]

    def __repr__(self) -> str:
        shared = ", ".join(self.shared) or "nothing shared"
        return f"<CampaignSummary of {self.name}: {len(self.boards)} boards; {shared}>"


def shared_numbers(posterior: SharedPosterior, seed: int) -> dict[str, SharedNumber]:
    """The shared numbers from all boards, from each board alone, and from all boards but each."""
    rng = np.random.default_rng([seed, _LINE])
    combined, shared = posterior.combined, posterior.combined.shared
    all_values = shared_values(combined.coordinates, posterior.chains.after_burn_in)
    scatters = {scatter.of.name: Spread.of(all_values[scatter.name], scatter.unit) for scatter in scatters_of(shared)}
    own_values = {member.name: _values_of_board(member, rng) for member in posterior.members}
    taught_values = {
        name: shared_values(shared, combined.draws_from_others(rng, _N_DRAWS, (i,)))
        for i, name in enumerate(combined.names)
    }
    return {
        parameter.name: SharedNumber(
            all_boards=Spread.of(all_values[parameter.name], parameter.unit),
            scatter=scatters.get(parameter.name),
            own={board: Spread.of(values[parameter.name], parameter.unit) for board, values in own_values.items()},
            others={
                board: Spread.of(values[parameter.name], parameter.unit) for board, values in taught_values.items()
            },
            prior_source=parameter.source,
        )
        for parameter in shared
    }


def _values_of_board(member: FittedBoard, rng: np.random.Generator) -> Mapping[str, np.ndarray]:
    """The shared numbers at draws of a board's own posterior, the campaign's prior in place of the board's."""
    picked_draws = rng.choice(len(member.own_sample.z), size=_N_DRAWS, p=member.own_sample.weights)
    return shared_values(member.shared, member.own_sample.z[picked_draws])


def population_summary(population: Population, prior: str, seed: int) -> PopulationSummary:
    rng = np.random.default_rng([seed, _LINE, 1])
    next_board = population.next_board(rng)
    return PopulationSummary(
        prior=prior,
        mean=_by_constant(np.exp(population.means), "Pa"),
        sd_percent=_by_constant(100.0 * population.sds, "%"),
        next_board=_by_constant(np.exp(next_board), "Pa"),
        boards={
            board.name: _by_constant(np.exp(population.pooled(i, rng)), "Pa")
            for i, board in enumerate(population.boards)
        },
    )


def _by_constant(values: np.ndarray, unit: str) -> Elastic[Spread]:
    return Elastic(**{name: Spread.of(column, unit) for name, column in zip(MODULI, values.T, strict=True)})


def learning_warnings(posterior: SharedPosterior, effective: Mapping[str, float]) -> tuple[str, ...]:
    """Warnings on the shared numbers; `effective` is the number of draws on which each board's posterior rests."""
    warnings = []
    refusing_names = refusing_boards(posterior.combined)
    if refusing_names:
        boards = "board" if len(refusing_names) == 1 else "boards"
        scatter_words = "so little scatter" if scatters_of(posterior.combined.shared) else "one value for all"
        warnings.append(
            f"{boards} {join_words(refusing_names)} {'disagrees' if len(refusing_names) == 1 else 'disagree'} with "
            f"what the others teach: {scatter_words} is not what these boards say"
        )
    if posterior.combined.fewest_points < FEWEST_POINTS:
        warnings.append(
            "what all boards, or all but one, find likely rests on "
            f"{posterior.combined.fewest_points:.0f} points only: the shared intervals are rough"
        )
    offset_names = [
        name
        for name, offset in zip(posterior.combined.names, posterior.offsets, strict=True)
        if offset > LARGEST_OFFSET
    ]
    if offset_names:
        warnings.append(
            f"what {join_words(offset_names)} {'says' if len(offset_names) == 1 else 'say'} of the shared numbers is "
            f"no polynomial of low order in them: the shared means may be off by {max(posterior.offsets):.1f} standard "
            "deviations"
        )
    poor_names = [name for name, n_draws in effective.items() if n_draws < FEWEST_WEIGHTED_DRAWS]
    if poor_names:
        warnings.append(
            f"few draws of {join_words(poor_names)} stand for what all boards teach: their own intervals are rough"
        )
    return tuple(warnings)


@dataclass(frozen=True)
class SharedNumberCheck:
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
    """The check of a campaign before a fit: expected uncertainty of the shared numbers, and each board's check.

    Attributes
    ----------
    name, title : str
    shared : dict of SharedNumberCheck
    population : str or None
        Name of the prior of the population.
    boards : dict of CheckReport
    """

    name: str
    title: str
    shared: Mapping[str, SharedNumberCheck]
    population: str | None
    boards: Mapping[str, CheckReport]

    def __repr__(self) -> str:
        words = ", ".join(
            f"{name} ({number.expected_sd:.2f} of its prior's sd)" for name, number in self.shared.items()
        )
        return f"<CampaignCheck of {self.name}: {len(self.boards)} boards; {words or 'nothing shared'}>"


def archive_name(name: str) -> str:
    """The name of a shared number as a variable: "transverse_shear.G_xz over E_x", because netCDF keeps the slash."""
    return name.replace(" / ", " over ")


def shared_tree(posterior: SharedPosterior, attributes: Mapping[str, str]) -> Any:
    """Draws of shared numbers and scatters, SI, each board's log likelihood of them, the sampler's health: DataTree."""
    chains, convergence, combined = posterior.chains, posterior.convergence, posterior.combined
    thinned = [
        thin_walker_major(draws, chains.burn_in, convergence.tau_max, n_draws_max=MOST_DRAWS_A_CHAIN)
        for draws in (chains.draws, chains.log_prob)
    ]
    z, log_posterior = thinned
    likelihood = combined.log_likelihoods(z.reshape(-1, z.shape[-1])).T.reshape(*z.shape[:2], -1)
    values = shared_values(combined.coordinates, z)
    return build_tree(
        {
            "posterior": {archive_name(name): (DRAW_DIMENSIONS, np.asarray(draws)) for name, draws in values.items()},
            "log_likelihood": {"board": ((*DRAW_DIMENSIONS, "name"), likelihood)},
            "sample_stats": sample_stats(log_posterior, convergence),
        },
        {"name": combined.names, "parameter": [archive_name(coordinate.name) for coordinate in combined.coordinates]},
        attributes,
    )
