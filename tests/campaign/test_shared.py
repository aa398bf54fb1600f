"""What boards share: its posterior against a joint run over everything at once, and what boards teach each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_campaigns import MASS
from scipy.linalg import block_diag

from bayesplate.campaign import learning
from bayesplate.campaign.boards import FittedBoard, _log_joint_density
from bayesplate.campaign.claim import judge_left_out_boards, judge_shared_effect, rms_cents, taught_boards
from bayesplate.campaign.learning import learn_shared
from bayesplate.campaign.likelihood import moments
from bayesplate.commands.campaign_diagnose import _without_shared
from bayesplate.commands.campaign_fit import fit_boards
from bayesplate.commands.fitting import Run
from bayesplate.posterior.sampling import SamplerSettings, sample

SHARED = "attached_mass.mass"


def joint_run(members):
    """Draws of every board's own parameters and the shared ones together, and the effective sizes."""
    given = [one.surrogate_conditional(one.inference.surrogate) for one in members]
    shared = members[0].shared
    sizes = [one.own_columns.size for one in given]
    ends = np.cumsum(sizes)

    def log_posterior(theta):
        z = theta[:, ends[-1] :]
        total = np.sum([one.prior.log_prior(z[:, i]) for i, one in enumerate(shared)], axis=0)
        for one, own in zip(given, np.split(theta[:, : ends[-1]], ends[:-1], axis=1), strict=True):
            total = total + one.log_density(own, z)
        return total

    own = [m.draws.flat[:, g.own_columns] for m, g in zip(members, given, strict=True)]
    z = np.concatenate([m.own_sample.z for m in members])
    centre = np.concatenate([each.mean(axis=0) for each in own] + [z.mean(axis=0)])
    covariance = block_diag(*[np.cov(each.T) for each in own], np.atleast_2d(np.cov(z.T)) / len(members))
    chains, convergence = sample(log_posterior, centre, covariance, SamplerSettings(seed=2))
    assert convergence.passed
    return chains.pooled, convergence.ess


def in_errors(draws, reference, ess):
    """Difference of means, and of the logarithms of the sds, in standard errors of the reference.

    That of ln sd is sqrt((kurtosis - 1) / 4 n) of n draws, 1 / sqrt(2 n) only where they are normal: numbers of boards
    that scatter by an unknown width have a kurtosis of about 6.
    """
    sd = reference.std()
    kurtosis = (((reference - reference.mean()) / sd) ** 4).mean()
    spread = abs(np.log(draws.std() / sd)) * np.sqrt(4.0 * ess / (kurtosis - 1.0))
    return abs(draws.mean() - reference.mean()) / sd * np.sqrt(ess), spread


@pytest.mark.slow
def test_the_shared_posterior_is_that_of_a_joint_run(fitted_campaign):
    members = fitted_campaign.shared_posterior.members
    reference, ess = joint_run(members)
    z = fitted_campaign.shared_posterior.chains.pooled[:, 0]
    both = min(ess[-1], fitted_campaign.shared_posterior.convergence.ess[0])

    assert max(in_errors(z, reference[:, -1], both / 2)) < 4.0
    ends = np.cumsum([0, *(one.conditional.own_columns.size for one in members)])
    for i, member in enumerate(members):
        own = fitted_campaign.boards[member.name].draws.flat[:, member.conditional.own_columns]
        for column in range(3):  # ln D_x, ln D_y, ln D_s
            few = min(ess[ends[i] + column], fitted_campaign.boards[member.name].inference.convergence.ess_min)
            assert max(in_errors(own[:, column], reference[:, ends[i] + column], few / 2)) < 4.5


def test_the_truth_is_inside_and_sharing_narrows(fitted_campaign):
    one = fitted_campaign.summary.shared[SHARED]

    assert abs(one.all_boards.mean - MASS) < 3.0 * one.all_boards.sd
    for board, own in one.own.items():
        assert one.all_boards.sd < own.sd
        alone, under_all = fitted_campaign.alone[board].summary, fitted_campaign.boards[board].summary
        assert under_all.elastic.E_x.sd < alone.elastic.E_x.sd
    assert not any(one.refuses for one in fitted_campaign.summary.left_out_boards.values())


def test_what_is_told_of_boards_that_are_left_out(fitted_campaign):
    """Against each board alone, which here has the sensor as well."""
    learnt, alone = fitted_campaign.shared_posterior, fitted_campaign.alone
    members = {name: FittedBoard(one.draws, ()) for name, one in alone.items()}
    taught = taught_boards(learnt, members, 1)

    for i, (told, score) in enumerate(
        zip(taught.values(), judge_left_out_boards(learnt.combined).values(), strict=True)
    ):
        name = learnt.members[i].name
        assert told.log_score_gain == pytest.approx(score.log_score - members[name].own_sample.log_evidence)
        assert told.before_rms_cents == pytest.approx(rms_cents(alone[name].draws))
        assert told.after_rms_cents == pytest.approx(told.before_rms_cents, rel=0.3)
        others = fitted_campaign.summary.shared[SHARED].others[name]
        assert told.others[SHARED].mean == pytest.approx(others.mean, rel=0.05)
        assert (told.p_value, told.refuses) == (score.p_value, False)


@pytest.mark.slow
def test_a_sensor_on_all_boards_is_claimed_from_those_left_out(campaign, fitted_campaign):
    before = fit_boards(_without_shared(campaign), Run())
    members = {name: FittedBoard(one.draws, ()) for name, one in before.items()}
    taught = taught_boards(fitted_campaign.shared_posterior, members, 1)

    assert judge_shared_effect(taught).holds
    for name, one in taught.items():
        others = fitted_campaign.summary.shared[SHARED].others[name]
        assert one.log_score_gain > 0.0
        assert one.after_rms_cents < one.before_rms_cents
        assert one.others[SHARED].mean == pytest.approx(others.mean, rel=0.05)


@pytest.mark.parametrize("scatter", [0.0, pytest.param(0.5, marks=pytest.mark.slow)])
def test_a_board_that_is_left_out_has_what_the_others_teach(fitted_campaign, scatter):
    """Its shared number as they teach it; its constants as they go with such numbers."""
    shared = tuple(replace(one, scatter=scatter) for one in fitted_campaign.shared_posterior.combined.shared)
    members = tuple(replace(one, shared=shared) for one in fitted_campaign.shared_posterior.members)
    learnt = learn_shared(members, SamplerSettings(seed=1)) if scatter else fitted_campaign.shared_posterior
    for i, member in enumerate(learnt.members):
        draws = learnt.board_left_out(i, np.random.default_rng(0), 1)
        z = member.conditional.z_of(draws.flat)[:, 0]
        mean, covariance = learnt.combined.moments_from_others((i,))
        n = len(np.unique(z))
        assert abs(z.mean() - mean[0]) < 4.0 * np.sqrt(covariance[0, 0] / n)
        assert z.std() == pytest.approx(np.sqrt(covariance[0, 0]), rel=4.0 / np.sqrt(n))
        alone = member.draws.moduli["E_x"].ravel()
        slope = np.polyfit(member.conditional.z_of(member.draws.flat)[:, 0], np.log(alone), 1)[0]
        expected = np.log(alone).mean() + slope * (mean[0] - member.own_sample.z.mean())
        assert np.log(draws.moduli["E_x"]).mean() == pytest.approx(expected, abs=0.1 * np.log(alone).std())


def test_a_draw_that_ends_where_there_is_no_plate_has_no_weight(fitted_campaign):
    member, drawn = fitted_campaign.shared_posterior.members[0], fitted_campaign.shared_posterior.samples[0]
    z = np.concatenate([[[100.0]], np.full((199, 1), drawn.z.mean())])
    moved = member.moved(drawn, member.log_prior, z, np.random.default_rng(0))
    draws = member.posterior_of(moved, moved.weights, np.random.default_rng(0), 1)

    assert moved.weights[0] == 0.0
    assert moved.weights[1:] == pytest.approx(1.0 / 199)
    assert np.isfinite(rms_cents(draws))


def others_at(member, sds):
    """What others teach so many of a board's own standard deviations off: ln of its density, mean and covariance."""
    mean, covariance = moments(member.own_sample.z, member.own_sample.weights)
    sd = np.sqrt(covariance[0, 0])
    middle, width = mean + sds * sd, 0.1 * sd
    return lambda z: -0.5 * ((z[:, 0] - middle[0]) / width) ** 2, (middle, width**2 * np.eye(1))


def test_a_board_that_others_lead_far_off_is_walked_where_its_law_is_known(fitted_campaign):
    """Five standard deviations off, where its own draws end: as a walk on the law itself."""
    member = fitted_campaign.shared_posterior.members[0]
    others, aim = others_at(member, 5.0)
    drawn = member.sample_anew(others, member.own_sample, aim, 1)
    effective = drawn.effective(drawn.weights)
    assert effective > learning.FEWEST_WEIGHTED_DRAWS
    own = member.conditional.own_columns
    centre, covariance = moments(np.column_stack([drawn.theta[:, own], drawn.z]), drawn.weights)
    chains, convergence = sample(
        _log_joint_density(member.conditional, others), centre, covariance, SamplerSettings(seed=2, n_ensembles=2)
    )
    assert convergence.passed
    for i in range(own.size):
        ours, exact = drawn.theta[:, own[i]], chains.pooled[:, i]
        mean, spread = drawn.weights @ ours, exact.std()
        assert abs(mean - exact.mean()) < 5.0 * spread * np.sqrt(1.0 / effective + 1.0 / convergence.ess_min)


def test_where_no_draw_has_a_density_by_the_law_what_was_there_before_stays(fitted_campaign):
    """A mass of more than all boards that there are: no draw counts as one of many that are equally good."""
    member = fitted_campaign.shared_posterior.members[0]
    others, aim = others_at(member, 80.0)
    found = member.sample_anew(others, member.own_sample, aim, 1)
    assert found is member.own_sample


def test_a_likelihood_that_is_off_its_draws_is_found_again(fitted_campaign):
    """A slope of two standard deviations too much: the board is lost, and learned anew."""
    learnt = fitted_campaign.shared_posterior
    first = learnt.combined.likelihoods[0]
    tilted = replace(first, coefficients=first.coefficients + np.eye(1, first.coefficients.size)[0] * 2.0)
    together = replace(learnt.combined, likelihoods=(tilted, *learnt.combined.likelihoods[1:]))

    assert (learnt.offsets < learning.LARGEST_OFFSET).all()
    assert replace(learnt, combined=together).offsets[0] > learning.LARGEST_OFFSET
