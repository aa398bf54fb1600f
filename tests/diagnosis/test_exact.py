"""The search corrected to the exact law: against quadrature over three constants and a size, where the law is bent."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from made_searches import baseline, candidate, ground_of, one_level, singles, with_modes

from bayesplate.board.material import RIGIDITIES
from bayesplate.diagnosis import sensitivity
from bayesplate.diagnosis.draws import draw_terms
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.search import run_search
from bayesplate.diagnosis.sensitivity import (
    draw_constants,
    draw_exact,
    exact_log_frequencies,
    log_weights_of,
    under_exact_law,
)
from bayesplate.diagnosis.shifts import combine_cells

NOISE = 0.01
BEND = 4.0
N_DRAWS = 20_000


class BentLaw:
    """Frequencies of an effect of one size, bent in the constants: stands for the exact law of a form."""

    models = (None,)

    def __init__(self, form, base, direction):
        self.form, self.base, self.direction = form, base, direction

    def mode_log_frequencies(self, base, log_rigidities, values):
        (size,) = values.values()
        return bent(self.base)(log_rigidities) + np.outer(size, self.direction)


def bent(base):
    """ln f, of second order in ln D."""

    def predict(x):
        away = x - base.log_rigidities
        return base.log_frequency + away @ base.slopes.T - BEND * (away**2) @ base.slopes[::-1].T

    return predict


@pytest.fixture(scope="module")
def found():
    """Two effects that act along directions of their own, and readings of the first."""
    rng = np.random.default_rng(1)
    base = baseline(rng, 6)
    base = with_modes(base, predict=bent(base))
    levels = one_level(base, NOISE)
    candidates = {}
    for name in ("a", "b"):
        direction = 0.02 * rng.standard_normal(6)
        one = candidate(base, name, direction)
        candidates[name] = replace(one, laws=(BentLaw(one.laws[0].form, base, direction),))
    every = singles(base, candidates, levels, 0.2)
    return run_search(ground_of(base, *every, candidates=candidates), 0.015 * rng.standard_normal(6))


def quadrature(found, law):
    """Posterior mean and sd of ln D, and ln of the evidence, on a grid: flat in ln D, half-normal in the size."""
    base = found.ground.baseline
    readings = base.log_frequency + found.residual
    middle, spread = base.log_rigidities, np.linalg.inv(base.slopes.T @ base.slopes / NOISE**2)
    root = np.linalg.cholesky(spread)
    steps = np.linspace(-6.0, 6.0, 33)
    z = np.array(list(product(steps, repeat=3)))
    shift = base.absorption @ found.residual
    x = middle + shift + z @ root.T
    sizes, weights = [0.0], [1.0]
    if law is not None:
        sizes = np.linspace(0.0, 3.0, 41)
        weights = np.exp(-0.5 * sizes**2)
        weights = weights / weights.sum()
    density = np.zeros(len(x))
    for size, weight in zip(sizes, weights, strict=True):
        there = (
            base.possible_modes.predict(x)
            if law is None
            else law.mode_log_frequencies(base, x, {"size": np.full(len(x), size)})
        )
        density += weight * np.exp(-0.5 * np.sum((readings - there) ** 2, axis=1) / NOISE**2)
    mean = density @ x / density.sum()
    return mean, np.sqrt(density @ (x - mean) ** 2 / density.sum()), np.log(density.sum())


@pytest.mark.parametrize("index", [0, 1])
def test_draws_and_evidence_are_those_of_the_bent_law(found, index):
    law = None if index == 0 else found.ground.candidates["a"].laws[0]
    mean, sd, _ = quadrature(found, law)
    exact = draw_exact(found, index, np.random.default_rng(2), N_DRAWS)
    linear = draw_terms(found, index, np.random.default_rng(2), N_DRAWS)
    error = 4.0 / np.sqrt(N_DRAWS / 2.0)  # weights leave about half the draws their worth
    assert np.abs((exact.log_rigidities.mean(axis=0) - mean) / sd).max() < error + 0.02  # cells have a width
    assert np.abs((linear.log_rigidities.mean(axis=0) - mean) / sd).max() > 3.0 * (error + 0.02)  # control


def test_odds_are_those_of_the_bent_law(found):
    exact = under_exact_law(found)
    none, effect = (quadrature(found, law)[2] for law in (None, found.ground.candidates["a"].laws[0]))
    told = exact.log_evidence[1] - exact.log_evidence[0]
    spread = [log_weights_of(found, i, draw_terms(found, i, np.random.default_rng(3), 4000)).std() for i in (0, 1)]
    assert abs(told - (effect - none)) < 4.0 * np.hypot(*spread) / np.sqrt(128) + 0.05
    assert exact.probability.sum() == pytest.approx(1.0)
    assert np.exp(told) == pytest.approx(exact.probability[1] / exact.probability[0] * 0.5 / 0.2)


@pytest.mark.parametrize("off", [np.inf, np.nan])
def test_draws_that_are_no_plate_by_the_exact_law_count_for_nothing(found, off):
    """Where the exact law has no frequency, or an infinite one, whatever sign; where it has none at all, as drawn."""
    base = found.ground.baseline
    limit = base.log_rigidities[0]

    def lacking(x):
        there = bent(base)(x)
        there[x[:, 0] > limit] = off
        return there

    def under(predict):
        ground = replace(found.ground, baseline=with_modes(base, predict=predict), candidates={})
        ground = replace(ground, hypotheses=found.ground.hypotheses[:1])
        return replace(found, ground=ground, log_evidence=found.log_evidence[:1], probability=np.ones(1))

    half = under(lacking)
    drawn = draw_terms(half, 0, np.random.default_rng(2), 400)
    is_lacking = drawn.log_rigidities[:, 0] > limit
    assert 0 < is_lacking.sum() < 400
    np.testing.assert_array_equal(log_weights_of(half, 0, drawn) == -np.inf, is_lacking)
    assert (draw_exact(half, 0, np.random.default_rng(2), 400).log_rigidities[:, 0] <= limit).all()

    none = under(lambda x: np.full((len(x), base.n_modes), off))
    as_drawn = draw_terms(none, 0, np.random.default_rng(2), 800)
    kept = draw_exact(none, 0, np.random.default_rng(2), 400)
    np.testing.assert_array_equal(kept.log_rigidities, as_drawn.log_rigidities[::2])  # of all levels of noise
    assert under_exact_law(none) is None


def test_two_effects_add_at_the_constants_of_a_draw(found):
    base, names = found.ground.baseline, ("a", "b")
    effects = [found.ground.candidates[name] for name in names]
    both = combine_cells(*(one.coarse for one in effects))
    pair = Hypothesis(names, 0.1, both, found.ground.hypotheses[0].noise, base)
    ground = replace(found.ground, hypotheses=(*found.ground.hypotheses, pair))
    with_pair = run_search(ground, found.residual)
    drawn = draw_terms(with_pair, 3, np.random.default_rng(4), 200)
    expected = bent(base)(drawn.log_rigidities)
    for member, one in enumerate(effects):
        cells = np.divmod(drawn.cells, effects[1].coarse.n_cells)[member]
        z = one.coarse.z[cells, 0] + one.coarse.z_slopes[0, 0] * drawn.within[:, member]
        expected = expected + np.maximum(z, 0.0)[:, None] * one.laws[0].direction
    np.testing.assert_allclose(exact_log_frequencies(with_pair, 3, drawn), expected, atol=1e-12)


def test_averages_are_by_the_probabilities_of_the_exact_law(found, monkeypatch):
    """Whatever these are: here all of it with the explanation that the search finds least probable."""
    shares = np.array([0.0, 0.0, 1.0])
    monkeypatch.setattr(sensitivity, "under_exact_law", lambda found: replace(found, probability=shares))
    means = np.array(
        [np.exp(draw_exact(found, i, np.random.default_rng(5), N_DRAWS).log_rigidities).mean(axis=0) for i in range(3)]
    )
    drawn = draw_constants(found, np.random.default_rng(6), N_DRAWS)
    told = np.array([drawn[name].mean() for name in RIGIDITIES])
    errors = np.array([drawn[name].std() for name in RIGIDITIES]) * np.sqrt(4.0 / N_DRAWS)
    assert np.abs((told - shares @ means) / errors).max() < 4.0
    assert np.abs((told - found.probability @ means) / errors).max() > 6.0  # control: those of the search


def test_what_is_improbable_is_corrected_as_no_effect_is(found):
    """Its own weights are not worth their cost, but an uncorrected one would gain on all others."""
    shares = np.array([0.6, 0.399, 0.001])
    evidence = np.log(shares / np.array([one.prior for one in found.ground.hypotheses]))
    exact = under_exact_law(replace(found, log_evidence=evidence, probability=shares))
    corrections = exact.log_evidence - evidence
    assert corrections[2] == pytest.approx(corrections[0], abs=1e-12)
    assert abs(corrections[0]) > 1e-3
    assert abs(corrections[1] - corrections[0]) > 1e-6
