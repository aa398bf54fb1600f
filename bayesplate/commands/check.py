"""`check`: every fault of a card, or what would be fitted and what it can identify; nothing is sampled or written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from bayesplate.board.material import MODULI, moduli_of
from bayesplate.campaign.conditional import ConditionalPosterior
from bayesplate.campaign.normal_likelihood import NormalLikelihood, prior_moments
from bayesplate.campaign.scatter import expected_width
from bayesplate.campaign.shared import SharedParameter
from bayesplate.campaign.summary import CampaignCheck, SharedNumberCheck
from bayesplate.commands.arguments import check_arguments
from bayesplate.commands.campaign import Campaign, dispatch_card
from bayesplate.commands.options import CARD, Effects, SetupFile
from bayesplate.commands.prepare import CardSource
from bayesplate.commands.printout import Printout, show_campaign_check, show_check
from bayesplate.commands.problem import Problem
from bayesplate.diagnosis.signatures import INVISIBLE_CHANGES, Signature, look_alikes, signatures
from bayesplate.diagnosis.terms import normalised_weights
from bayesplate.estimates.identifiability import identifiability_remarks
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.posing import PosedProblem
from bayesplate.report.plots import CheckPlots
from bayesplate.results.checking import CheckedEffect, CheckedMode, CheckedSetup, CheckReport
from bayesplate.results.contract import NOT_IN_JSON, Constants, Elastic

_N_DRAWS = 4000
_UNINFORMATIVE_RATIO = 0.9
"""Ratio of the sd of nu after the readings to that before, above which the readings tell nothing of it."""


@dataclass(frozen=True, repr=False)
class CheckResult(CheckReport):
    """Result of `check`: all of `CheckReport`, and the problem.

    Attributes
    ----------
    problem : Problem
        Posed: `fit` takes it as it is.
    """

    problem: Problem = field(metadata=NOT_IN_JSON, compare=False)

    @property
    def summary(self) -> CheckReport:
        """The report itself."""
        return self

    @property
    def plot(self) -> CheckPlots:
        """The figures: `report.plot.shares()`."""
        return CheckPlots(self.problem.posed, self)

    def __repr__(self) -> str:
        return super().__repr__().replace("<CheckReport", "<CheckResult", 1)

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_check(self)

    def _repr_html_(self) -> str:
        return self.printout().html(self.title or self.name)


class CampaignCheckResult(CampaignCheck):
    """Result of `check` for a campaign: all of `CampaignCheck`."""

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_campaign_check(self)

    def _repr_html_(self) -> str:
        return self.printout().html(self.title or self.name)


@check_arguments()
def check(
    card: Annotated[Problem | CardSource | Campaign, CARD],
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
    return dispatch_card(card, _check_board, _check_campaign, effects=effects, setup=setup)


def _check_board(problem: Problem, *, candidates: bool = True) -> CheckResult:
    """Check one board, with the signatures of effects that are not declared if `candidates`."""
    posed = problem.posed
    board = posed.board
    estimate, identifiability = posed.estimate, posed.identifiability
    elastic = moduli_of(estimate.values)
    expected = expected_sd(posed)
    rows = [(setup.name, reading) for setup in board.setups for reading in setup.readings]
    residuals = cents(estimate.residuals)
    correlations = [place.correlation for model in estimate.models for place in model.places]
    return CheckResult(
        name=board.name,
        title=board.title,
        prior=posed.prior.name,
        law=posed.posterior.law,
        setups=tuple(
            CheckedSetup(
                setup.name, setup.edges, len(setup.readings), len(setup.unlabelled), 100.0 * setup.noise.median
            )
            for setup in board.setups
        ),
        uncertain_inputs=tuple(parameter.name for parameter in board.uncertain if parameter.is_listed),
        estimate=Constants(*(float(value) for value in (*elastic, *estimate.rigidities))),
        expected_sd_percent=Elastic(**{name: 100.0 * value for name, value in expected.items()}),
        condition_number=identifiability.condition_number,
        modes=tuple(
            CheckedMode(
                setup=setup,
                label=str(reading.label),
                measured_hz=reading.frequency.mean,
                residual_cents=float(residuals[i]),
                leverage=float(identifiability.leverages[i]),
                share_percent=tuple(round(100.0 * float(share), 1) for share in identifiability.shares[i]),
                label_correlation=correlations[i],
            )
            for i, (setup, reading) in enumerate(rows)
        ),
        in_sample_rms_cents=float(np.sqrt(np.mean(residuals**2))),
        signatures=tuple(_checked_effects(signatures(posed))) if candidates else (),
        invisible=INVISIBLE_CHANGES,
        identifiability=(*identifiability_remarks(board, identifiability), *_poisson_remarks(posed)),
        notes=(*posed.doubts, *board.notes),
        n_doubts=len(posed.doubts),
        problem=problem,
    )


def _poisson_remarks(problem: PosedProblem) -> list[str]:
    """A sentence on how well the modes tell an uncertain Poisson ratio of an isotropic board."""
    names = problem.parameters.inputs
    if not problem.board.isotropic or "poisson_xy" not in names:
        return []
    poisson = problem.board.inputs["poisson_xy"]
    column = problem.parameters.first_input + names.index("poisson_xy")
    share = float(np.sqrt(problem.covariance[column, column]))
    if share > _UNINFORMATIVE_RATIO:
        return [f"the modes tell nothing of nu: it stays at {poisson.mean:g} ± {poisson.sd:.2g}, and E goes with it"]
    return [f"the modes tell nu beside E: to ± {share * poisson.sd:.2g}, from ± {poisson.sd:.2g} before"]


def _checked_effects(effect_signatures: Sequence[Signature]) -> list[CheckedEffect]:
    look_alike_effects = look_alikes(effect_signatures)
    return [
        CheckedEffect(
            effect=signature.effect,
            size=dict(signature.size),
            raw_rms_cents=signature.raw_rms,
            visible_rms_cents=signature.visible_rms,
            below_detection_limit=signature.is_below_detection_limit,
            bias_percent=Elastic(**signature.bias_percent),
            look_alikes=look_alike_effects[signature.effect],
        )
        for signature in effect_signatures
    ]


def expected_sd(problem: PosedProblem) -> dict[str, float]:
    """Relative standard deviation of each modulus in the normal approximation of the posterior."""
    draws = np.random.default_rng(0).multivariate_normal(problem.centre, problem.covariance, _N_DRAWS)
    values = problem.parameters.values(draws)
    constants = moduli_of(values)
    return {name: float(np.nanstd(np.log(v))) for name, v in zip(MODULI, constants, strict=True)}


def _check_campaign(campaign: Campaign) -> CampaignCheckResult:
    """Check each board, and how well all together would determine the shared parameters."""
    campaign.pose()
    population = campaign.population
    return CampaignCheckResult(
        name=campaign.name,
        title=campaign.card.title,
        shared=_checked_shared(campaign) if campaign.shared else {},
        population=None if population is None else population.name,
        boards={problem.board.name: _check_board(problem, candidates=False) for problem in campaign.problems},
    )


def _checked_shared(campaign: Campaign) -> dict[str, SharedNumberCheck]:
    """Shared parameters by normal approximations of the boards' posteriors."""
    likelihoods = {problem.board.name: _normal_likelihood(problem.posed, campaign) for problem in campaign.problems}
    width = expected_width(campaign.shared)
    sds_alone = {name: expected_shared_sds(campaign.shared, [likelihood]) for name, likelihood in likelihoods.items()}
    sds_together = expected_shared_sds(
        campaign.shared, [likelihood.scattered(width) for likelihood in likelihoods.values()]
    )
    return {
        parameter.name: SharedNumberCheck(
            unit=parameter.unit,
            prior_q05=float(parameter.prior.quantile(0.05)),
            prior_q50=float(parameter.prior.quantile(0.5)),
            prior_q95=float(parameter.prior.quantile(0.95)),
            expected_sd=sds_together[i],
            boards={name: sds[i] for name, sds in sds_alone.items()},
        )
        for i, parameter in enumerate(campaign.shared)
    }


def expected_shared_sds(shared: Sequence[SharedParameter], pulls: Sequence[NormalLikelihood]) -> list[float]:
    """Expected sd of each shared parameter over that of its prior, from the likelihoods of some boards, bounds kept."""
    prior_variances = np.array([prior_moments(parameter.prior)[1] for parameter in shared])
    precision = np.diag(1.0 / prior_variances) + np.sum([likelihood.precision for likelihood in pulls], axis=0)
    return [float(sd) for sd in np.sqrt(np.diagonal(np.linalg.inv(precision)) / prior_variances)]


def _normal_likelihood(posed: PosedProblem, campaign: Campaign) -> NormalLikelihood:
    theta = np.random.default_rng(0).multivariate_normal(posed.centre, posed.covariance, _N_DRAWS)
    conditional = ConditionalPosterior(posed.posterior, campaign.shared)
    z, log_weights = conditional.z_of(theta), conditional.log_reweighting(theta)
    finite = np.isfinite(z).all(axis=1) & np.isfinite(log_weights)
    return NormalLikelihood.of_draws(
        z[finite], normalised_weights(log_weights[finite]), [parameter.prior for parameter in campaign.shared]
    )
