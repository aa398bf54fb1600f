"""`check`: every fault of a card, or what would be fitted and what it can identify; nothing is sampled or written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from bayesplate.board.material import MODULI, moduli
from bayesplate.campaign.given import GivenShared
from bayesplate.campaign.pulls import Pull, moments_before
from bayesplate.campaign.scatter import expected_width
from bayesplate.campaign.shared import Shared
from bayesplate.campaign.summary import CampaignCheck, CheckedShared
from bayesplate.commands.arguments import checked
from bayesplate.commands.campaign import Campaign, by_kind
from bayesplate.commands.options import CARD, Effects, SetupFile
from bayesplate.commands.prepare import Card
from bayesplate.commands.problem import Problem
from bayesplate.commands.shown import Shown, show_campaign_check, show_check
from bayesplate.diagnosis.signatures import INVISIBLE, Signature, look_alikes, signatures
from bayesplate.diagnosis.terms import normalised
from bayesplate.estimates.identifiability import remarks
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.posing import PosedProblem
from bayesplate.report.plots import CheckPlots
from bayesplate.results.checking import CheckedEffect, CheckedMode, CheckedSetup, CheckReport
from bayesplate.results.contract import NOT_IN_JSON, Constants, Elastic

_N_DRAWS = 4000
_HARDLY_NARROWER = 0.9
"""Uncertainty of nu after the readings over that before from which on they are said to tell nothing of it."""


@dataclass(frozen=True, repr=False)
class CheckResult(CheckReport):
    """What a check leaves: all of `CheckReport`, and the problem behind it.

    Attributes
    ----------
    problem : Problem
        Posed: `fit` takes it as it is.
    """

    problem: Problem = field(metadata=NOT_IN_JSON, compare=False)

    @property
    def summary(self) -> CheckReport:
        """What the check found: the report itself."""
        return self

    @property
    def plot(self) -> CheckPlots:
        """The figures: `report.plot.shares()`."""
        return CheckPlots(self.problem.posed, self)

    def __repr__(self) -> str:
        return super().__repr__().replace("<CheckReport", "<CheckResult", 1)

    def shown(self) -> Shown:
        """Tables and sentences for a person."""
        return show_check(self)

    def _repr_html_(self) -> str:
        return self.shown().html(self.title or self.name)


class CampaignCheckResult(CampaignCheck):
    """What a check of a campaign leaves: all of `CampaignCheck`."""

    def shown(self) -> Shown:
        """Tables and sentences for a person."""
        return show_campaign_check(self)

    def _repr_html_(self) -> str:
        return self.shown().html(self.title or self.name)


@checked()
def check(
    card: Annotated[Problem | Card | Campaign, CARD],
    *,
    effects: Effects = None,
    setup: SetupFile = None,
) -> CheckResult | CampaignCheck:
    """Say what would be fitted, and what it can identify; nothing is sampled or written.

    Parameters
    ----------
    card : Problem, str, path, Board or Campaign
        A problem, the name of a shipped board or campaign card, the path of a card, or a board made in Python.
    effects : sequence of str, optional
    setup : path, optional
        A file with a table [setup] that takes the place of the card's, key by key: what `pick` writes.

    Returns
    -------
    CheckResult or CampaignCheck
        The latter of a campaign.

    Raises
    ------
    InputError, NotIdentifiableError
        As `fit` would.
    """
    return by_kind(card, _check_board, _check_campaign, effects=effects, setup=setup)


def _check_board(given: Problem, *, candidates: bool = True) -> CheckResult:
    """Check one board, without signatures of effects that are not declared if there are to be no candidates."""
    problem = given.posed
    board = problem.board
    estimate, found = problem.estimate, problem.identifiability
    D_x, D_y, D_s = estimate.rigidities
    elastic = moduli(D_x, D_y, D_s, estimate.values["thickness"], estimate.values["poisson_xy"])
    expected = expected_sd(problem)
    rows = [(setup.name, reading) for setup in board.setups for reading in setup.readings]
    residuals = cents(estimate.residuals)
    correlations = [place.correlation for model in estimate.models for place in model.places]
    return CheckResult(
        name=board.name,
        title=board.title,
        prior=problem.prior.name,
        law=problem.posterior.law,
        setups=tuple(
            CheckedSetup(
                setup.name, setup.edges, len(setup.readings), len(setup.unlabelled), 100.0 * setup.noise.median
            )
            for setup in board.setups
        ),
        uncertain_inputs=tuple(one.name for one in board.uncertain if one.is_listed),
        estimate=Constants(*(float(value) for value in (*elastic, *estimate.rigidities))),
        expected_sd_percent=Elastic(**{name: 100.0 * value for name, value in expected.items()}),
        condition_number=found.condition_number,
        modes=tuple(
            CheckedMode(
                setup=setup,
                label=str(reading.label),
                measured_hz=reading.frequency.mean,
                residual_cents=float(residuals[i]),
                leverage=float(found.leverages[i]),
                share_percent=tuple(round(100.0 * float(share), 1) for share in found.shares[i]),
                label_correlation=correlations[i],
            )
            for i, (setup, reading) in enumerate(rows)
        ),
        in_sample_rms_cents=float(np.sqrt(np.mean(residuals**2))),
        signatures=tuple(_effects(signatures(problem))) if candidates else (),
        invisible=INVISIBLE,
        identifiability=(*remarks(board, found), *_of_poisson(problem)),
        notes=(*problem.doubts, *board.notes),
        n_doubts=len(problem.doubts),
        problem=given,
    )


def _of_poisson(problem: PosedProblem) -> list[str]:
    """A sentence on how well the modes tell an uncertain Poisson ratio of an isotropic board."""
    names = problem.parameters.inputs
    if not problem.board.isotropic or "poisson_xy" not in names:
        return []
    stated = problem.board.inputs["poisson_xy"]
    column = problem.parameters.first_input + names.index("poisson_xy")
    share = float(np.sqrt(problem.covariance[column, column]))
    if share > _HARDLY_NARROWER:
        return [f"the modes tell nothing of nu: it stays at {stated.mean:g} ± {stated.sd:.2g}, and E goes with it"]
    return [f"the modes tell nu beside E: to ± {share * stated.sd:.2g}, from ± {stated.sd:.2g} before"]


def _effects(found: Sequence[Signature]) -> list[CheckedEffect]:
    alike = look_alikes(found)
    return [
        CheckedEffect(
            effect=one.effect,
            size=dict(one.size),
            raw_rms_cents=one.raw_rms,
            visible_rms_cents=one.visible_rms,
            below_detection_limit=one.is_below_detection_limit,
            bias_percent=Elastic(**one.bias_percent),
            look_alikes=alike[one.effect],
        )
        for one in found
    ]


def expected_sd(problem: PosedProblem) -> dict[str, float]:
    """Relative standard deviation of each modulus in the normal approximation of the posterior."""
    draws = np.random.default_rng(0).multivariate_normal(problem.centre, problem.covariance, _N_DRAWS)
    values = problem.parameters.values(draws)
    constants = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
    return {name: float(np.nanstd(np.log(v))) for name, v in zip(MODULI, constants, strict=True)}


def _check_campaign(campaign: Campaign) -> CampaignCheckResult:
    """Check each board, and what all together would tell of shared numbers."""
    campaign.pose()
    population = campaign.population
    return CampaignCheckResult(
        name=campaign.name,
        title=campaign.card.title,
        shared=_shared(campaign) if campaign.shared else {},
        population=None if population is None else population.name,
        boards={problem.board.name: _check_board(problem, candidates=False) for problem in campaign.problems},
    )


def _shared(campaign: Campaign) -> dict[str, CheckedShared]:
    """Shared numbers by normal approximations of the boards' posteriors."""
    pulls = {one.board.name: _pull(one.posed, campaign) for one in campaign.problems}
    width = expected_width(campaign.shared)
    alone = {name: expected_sds(campaign.shared, [pull]) for name, pull in pulls.items()}
    every = expected_sds(campaign.shared, [one.scattered(width) for one in pulls.values()])
    return {
        one.name: CheckedShared(
            unit=one.unit,
            prior_q05=float(one.prior.quantile(0.05)),
            prior_q50=float(one.prior.quantile(0.5)),
            prior_q95=float(one.prior.quantile(0.95)),
            expected_sd=every[i],
            boards={name: each[i] for name, each in alone.items()},
        )
        for i, one in enumerate(campaign.shared)
    }


def expected_sds(shared: Sequence[Shared], pulls: Sequence[Pull]) -> list[float]:
    """Expected sd of each shared number over that of its prior, from the pulls of some boards, bounds kept."""
    before = np.array([moments_before(one.prior)[1] for one in shared])
    precision = np.diag(1.0 / before) + np.sum([one.precision for one in pulls], axis=0)
    return [float(sd) for sd in np.sqrt(np.diagonal(np.linalg.inv(precision)) / before)]


def _pull(posed: PosedProblem, campaign: Campaign) -> Pull:
    theta = np.random.default_rng(0).multivariate_normal(posed.centre, posed.covariance, _N_DRAWS)
    given = GivenShared(posed.posterior, campaign.shared)
    z, log_weights = given.z_of(theta), given.log_reweighting(theta)
    kept = np.isfinite(z).all(axis=1) & np.isfinite(log_weights)
    return Pull.of_draws(z[kept], normalised(log_weights[kept]), [one.prior for one in campaign.shared])
