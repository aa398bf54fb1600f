"""Plans on trial in small: made boards without plates, whose gains must come true; and what the trial calls met."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from validation.calibration.plans import WAYS, calibration, is_calibrated, limits, settled, wrongly

from bayesplate.board.material import ORTHOTROPIC
from bayesplate.planning.beliefs import Beliefs, ExplanationTerms, entropy
from bayesplate.planning.gains import PlannedReadings, expected_gain, probabilities_after

N_BOARDS, N_TERMS = 120, 24
NOISE = 0.5


def explanation(rng, members, probability):
    """Terms of an effect of unknown size: what it does to two further readings scatters."""
    return ExplanationTerms(
        members=members, words="", probability=probability, mean=np.zeros((N_TERMS, 4)),
        covariance=np.tile(np.diag([1.0, 1.0, 1.0, 0.1]), (N_TERMS, 1, 1)), noise=np.full((N_TERMS, 1), NOISE),
        middle=np.zeros((N_TERMS, 3)), target_slopes=np.tile(np.eye(3, 4), (N_TERMS, 1, 1)),
    )  # fmt: skip


def board(rng):
    """Two explanations and two readings, the second effect of a size that is drawn."""
    share = rng.uniform(0.2, 0.8)
    beliefs = Beliefs(
        (SimpleNamespace(board=SimpleNamespace(symmetry=ORTHOTROPIC)),),
        (explanation(rng, (), share), explanation(rng, ("made",), 1.0 - share)),
    )
    size = rng.uniform(0.5, 4.0) * np.abs(rng.standard_normal(N_TERMS))
    shift = (np.zeros((N_TERMS, 2)), np.outer(size, rng.standard_normal(2)))
    slopes = tuple(np.tile(0.2 * rng.standard_normal((2, 4)), (N_TERMS, 1, 1)) for _ in range(2))
    return beliefs, PlannedReadings(shift, (slopes[0],) * 2, (np.full((N_TERMS, 2), NOISE**2),) * 2)


def record(rng, index, true_noise):
    """A board whose truth is drawn from what is believed, and read."""
    beliefs, readings = board(rng)
    which = int(rng.random() > beliefs.explanations[0].probability)
    term = int(rng.integers(N_TERMS))
    u = rng.multivariate_normal(np.zeros(4), beliefs.explanations[which].covariance[term])
    read = readings.shift[which][term] + readings.slopes[which][term] @ u + true_noise * rng.standard_normal(2)
    after = probabilities_after(beliefs, readings, read[None])[:, 0]
    told = {
        "expected": expected_gain(beliefs, readings, rng, n_draws=400).explanations,
        "realised": beliefs.entropy - float(entropy(after[:, None])[0]),
        "true": float(after[which]),
        "cost": 1.0,
        "what": "modes",
    }
    return {
        "simulation": index, "boards": 1, "explanations": [[], ["made"]], "before": list(beliefs.probabilities),
        "first": told, "random": told, "listed": told, "next": told,
    }  # fmt: skip


def records(seed, true_noise):
    rng = np.random.default_rng(seed)
    return [record(rng, i, true_noise) for i in range(N_BOARDS)]


def test_expected_gains_come_true():
    found = records(5, NOISE)
    assert is_calibrated(found), calibration(found)
    assert len(calibration(found)) >= 3


def test_those_of_a_noise_taken_for_a_quarter_of_what_it_is_do_not():
    """The negative control: too sure of itself, it settles more than it should, and wrongly."""
    found = records(5, 4.0 * NOISE)
    assert (
        np.mean([wrongly(one, "first") for one in found])
        > 0.1
        > np.mean([wrongly(one, "first") for one in records(5, NOISE)])
    )
    assert not is_calibrated(found)


def made(first, random, listed, following):
    """A record by what is left for the truth."""
    ways = zip(WAYS, (first, random, listed, following), strict=True)
    return {"before": [0.5, 0.5], **{way: {"true": p, "expected": 0.3, "realised": 0.3} for way, p in ways}}


def test_settled_is_ten_times_as_probable_as_the_other():
    one = made(0.92, 0.9, 0.9, 0.08)
    assert [settled(one, way) for way in ("first", "random", "next")] == [True, False, False]
    assert [wrongly(one, way) for way in ("first", "random", "next")] == [False, False, True]


@pytest.mark.parametrize(
    ("settled_of_ten", "met"),
    [
        ((8, 6, 6, 8), [True, True, True]),
        ((8, 7, 6, 8), [False, True, True]),
        ((8, 6, 7, 8), [True, False, True]),
        ((8, 5, 5, 9), [True, True, False]),
        ((5, 8, 8, 1), [False, False, True]),
    ],
)
def test_limits_are_those_of_the_page(settled_of_ten, met):
    counts = [[0.99] * n + [0.5] * (10 - n) for n in settled_of_ten]
    found = limits([made(*each) for each in zip(*counts, strict=True)])
    assert list(found.values())[:3] == met
