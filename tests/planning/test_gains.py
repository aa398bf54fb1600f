"""Expected gains against closed forms: information, shrinkage, and the entropy between normal explanations."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from bayesplate.board.material import MODULI, ORTHOTROPIC
from bayesplate.planning.beliefs import Beliefs, ExplanationTerms
from bayesplate.planning.gains import GOALS, PlannedReadings, expected_gain, join_readings, probabilities_after

SIGMA = 0.3


def explanation(mean=0.0, probability=1.0, variance=(4.0, 1.0, 0.25), n_terms=1, words="made"):
    """The three constants themselves, normal about a mean of the first one."""
    means = np.zeros((n_terms, 3))
    means[:, 0] = mean
    return ExplanationTerms(
        members=(words,), words=words, probability=probability, mean=means,
        covariance=np.tile(np.diag(variance), (n_terms, 1, 1)), noise=np.full((n_terms, 1), SIGMA),
        middle=np.zeros((n_terms, 3)), target_slopes=np.tile(np.eye(3), (n_terms, 1, 1)),
    )  # fmt: skip


def beliefs(*explanations):
    return Beliefs((SimpleNamespace(board=SimpleNamespace(symmetry=ORTHOTROPIC)),), explanations)


def reading(of, row, variance=SIGMA**2, shift=0.0):
    """One reading that sees the constants along a row."""
    return PlannedReadings(
        tuple(np.full((one.n_terms, 1), shift) for one in of.explanations),
        tuple(np.tile(np.array([row], dtype=float), (one.n_terms, 1, 1)) for one in of.explanations),
        tuple(np.full((one.n_terms, 1), variance) for one in of.explanations),
    )


def test_what_is_linear_and_normal_is_exact():
    """E_x of variance 4 read with variance 0.09 keeps 1 / (1/4 + 1/0.09); the other two keep theirs."""
    now = beliefs(explanation())

    gain = expected_gain(now, reading(now, [1, 0, 0]), np.random.default_rng(1))

    after = 1.0 / (1.0 / 4.0 + 1.0 / SIGMA**2)
    assert gain.E_x == pytest.approx(np.sqrt(after / 4.0), rel=1e-10)
    assert (gain.E_y, gain.G_xy) == (pytest.approx(1.0), pytest.approx(1.0))
    assert gain.information == pytest.approx(0.5 * np.log(4.0 / after), rel=1e-10)
    assert gain.constants == pytest.approx(gain.information / 3.0, rel=1e-10)
    assert (gain.constants_error, gain.explanations, gain.explanations_error) == (0.0, None, None)


def test_readings_together_have_half_the_log_determinant_of_what_all_say():
    now = beliefs(explanation())
    rows = np.array([[1.0, 0.5, 0.0], [0.2, 1.0, 0.3], [0.4, 0.0, 1.0]])

    gain = expected_gain(now, join_readings([reading(now, row) for row in rows]), np.random.default_rng(1))

    prior = np.diag([1 / 4.0, 1.0, 4.0])
    told = prior + rows.T @ rows / SIGMA**2
    assert gain.information == pytest.approx(0.5 * (np.linalg.slogdet(told)[1] - np.linalg.slogdet(prior)[1]))


def drop_by_quadrature(distance, share):
    """Expected drop of the entropy between two normals of unit variance that far apart, by Gauss and Hermite."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(80)
    weights = weights / weights.sum()
    left = 0.0
    for p, middle in ((share, 0.0), (1.0 - share, distance)):
        y = middle + nodes
        logs = np.stack([np.log(share) - 0.5 * y**2, np.log(1.0 - share) - 0.5 * (y - distance) ** 2])
        after = np.exp(logs - np.logaddexp(*logs))
        left += p * weights @ -(after * np.log(np.maximum(after, 1e-300))).sum(axis=0)
    return -(share * np.log(share) + (1 - share) * np.log(1 - share)) - left


@pytest.mark.parametrize(("distance", "share"), [(2.0, 0.8), (4.0, 0.3)])
def test_drop_of_the_entropy_is_that_of_quadrature(distance, share):
    """And half the distance is not: the control."""
    variance = (0.36, 1e-8, 1e-8)  # with a noise of 0.64 the reading has unit variance
    now = beliefs(explanation(0.0, share, variance), explanation(distance, 1.0 - share, variance))
    one = reading(now, [1, 0, 0], 0.64)

    gain = expected_gain(now, one, np.random.default_rng(3), n_draws=6000)

    assert abs(gain.explanations - drop_by_quadrature(distance, share)) < 4.0 * gain.explanations_error
    assert abs(gain.explanations - drop_by_quadrature(0.5 * distance, share)) > 8.0 * gain.explanations_error


def test_explanations_that_expect_the_same_are_not_told_apart_and_distant_ones_for_sure():
    now = beliefs(explanation(0.0, 0.4), explanation(0.0, 0.6))
    alike = expected_gain(now, reading(now, [0, 1, 0]), np.random.default_rng(1))
    far = beliefs(explanation(0.0, 0.4), explanation(100.0, 0.6))
    apart = expected_gain(far, reading(far, [1, 0, 0]), np.random.default_rng(1))

    assert alike.explanations == pytest.approx(0.0, abs=1e-12)
    assert apart.explanations == pytest.approx(far.entropy, abs=1e-12)
    # half the spread of E_x lies between the two, and goes as well
    assert apart.E_x == pytest.approx(0.3 / np.sqrt(4.0 + 0.24 * 100.0**2), rel=0.02)


def test_probabilities_after_a_reading_follow_the_two_densities():
    """Of other middles and widths: an explanation that expects more scatter pays for it."""
    narrow, wide = ((sd**2 - SIGMA**2, 1.0, 1.0) for sd in (1.0, 3.0))
    now = beliefs(explanation(0.0, 0.3, narrow), explanation(3.0, 0.7, wide))
    read = np.array([[0.0], [3.0], [1.5]])

    after = probabilities_after(now, reading(now, [1, 0, 0]), read)

    joint = np.array([[0.3], [0.7]]) * norm.pdf(read[:, 0], [[0.0], [3.0]], [[1.0], [3.0]])
    assert after == pytest.approx(joint / joint.sum(axis=0))


def test_a_score_is_what_was_asked_for():
    """Of a board the doubt and the mean of all three; where boards share something, the mean of that."""
    now = beliefs(explanation(0.0, 0.5), explanation(3.0, 0.5))
    one, rng = reading(now, [1, 0.5, 0]), np.random.default_rng
    found = {goal: expected_gain(now, one, rng(1), goal) for goal in (*GOALS, None)}

    for name in MODULI:
        assert found[name].score == pytest.approx(-np.log(getattr(found[name], name)))
    assert found["constants"].score == found["constants"].constants
    assert found["constants"].constants == pytest.approx(np.mean([found[name].score for name in MODULI]))
    assert found["explanations"].score == found["explanations"].explanations
    assert found[None].score == pytest.approx(found["explanations"].score + found["constants"].score)
    shared = replace(now, shared=("one",), explanations=tuple(with_one_more(each) for each in now.explanations))
    gain = expected_gain(shared, one, rng(1), None, 4.0)
    assert gain.score == pytest.approx(gain.explanations - np.log(gain.shared["one"]))
    assert gain.score_per_minute == pytest.approx(gain.score / 4.0)


def with_one_more(one):
    """The same with the first constant, under another name, before the three."""
    return replace(one, middle=one.middle[:, [0, 0, 1, 2]], target_slopes=one.target_slopes[:, [0, 0, 1, 2]])
