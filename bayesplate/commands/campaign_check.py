"""`check` of a campaign: every fault of all its cards, or what each board and all together would tell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesplate.campaign.checking import CampaignCheck, CheckedShared
from bayesplate.campaign.given import GivenShared
from bayesplate.campaign.pulls import Pull, moments_before
from bayesplate.campaign.scatter import expected_width
from bayesplate.campaign.shared import Shared
from bayesplate.commands.campaign import Campaign
from bayesplate.commands.check import check_board
from bayesplate.diagnosis.terms import normalised
from bayesplate.posterior.posing import PosedProblem

_N_DRAWS = 4000


def check_campaign(campaign: Campaign) -> CampaignCheck:
    """Check a campaign; `bayesplate.check` says what is raised."""
    campaign.pose()
    population = campaign.population
    return CampaignCheck(
        name=campaign.name,
        title=campaign.card.title,
        shared=_shared(campaign) if campaign.shared else {},
        population=None if population is None else population.name,
        boards={problem.board.name: check_board(problem, candidates=False) for problem in campaign.problems},
    )


def _shared(campaign: Campaign) -> dict[str, CheckedShared]:
    """What normal approximations of the boards' posteriors say of the shared numbers."""
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
    """Standard deviation of each shared number after what some boards say, over that of its prior, bounds kept."""
    before = np.array([moments_before(one.prior)[1] for one in shared])
    precision = np.diag(1.0 / before) + np.sum([one.precision for one in pulls], axis=0)
    return [float(sd) for sd in np.sqrt(np.diagonal(np.linalg.inv(precision)) / before)]


def _pull(posed: PosedProblem, campaign: Campaign) -> Pull:
    theta = np.random.default_rng(0).multivariate_normal(posed.centre, posed.covariance, _N_DRAWS)
    given = GivenShared(posed.posterior, campaign.shared)
    z, log_weights = given.z_of(theta), given.log_reweighting(theta)
    kept = np.isfinite(z).all(axis=1) & np.isfinite(log_weights)
    return Pull.of_draws(z[kept], normalised(log_weights[kept]), [one.prior for one in campaign.shared])
