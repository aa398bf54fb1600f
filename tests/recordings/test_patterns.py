"""Residues between several places tell modes of one frequency apart, and the polarity of hammer and sensor."""

from __future__ import annotations

import numpy as np
from made_recordings import SENSOR, board

from bayesplate.recordings.patterns import residue_evidence, sign_odds

HAMMERS = ((0.02, 0.02), (0.15, 0.19), (0.29, 0.03), (0.45, 0.11))
N_MODES = 10
PREDICTED = np.stack([board().residues(hammer, SENSOR)[:N_MODES] for hammer in HAMMERS], axis=1)
LARGEST = np.abs(PREDICTED).max(axis=1)
EVERY = np.full((N_MODES, N_MODES), 1.0 / N_MODES)
"""Nothing is known of the labels beforehand."""


def measured(rng: np.random.Generator, polarity: float) -> np.ndarray:
    """The generator's residues in other units, with errors of the places and of each mode's strength."""
    noisy = PREDICTED + 0.03 * LARGEST[:, None] * rng.standard_normal(PREDICTED.shape)
    return polarity * 7.0 * noisy * np.exp(0.1 * rng.standard_normal((N_MODES, 1)))


def test_the_pattern_names_the_mode_and_the_polarity():
    for polarity in (1.0, -1.0):
        found = measured(np.random.default_rng(1), polarity)
        evidence, log_polarity = residue_evidence(found, 0.02 * np.abs(found), PREDICTED, LARGEST, EVERY)

        assert (np.argmax(evidence, axis=1) == np.arange(N_MODES)).all(), polarity
        assert polarity * log_polarity > np.log(100.0)


def test_patterns_of_nothing_name_nothing():
    """The negative control: residues without a pattern speak for no mode as the right ones do for theirs."""
    rng = np.random.default_rng(2)
    sd = 0.02 * np.repeat(LARGEST[:, None], len(HAMMERS), axis=1)
    right, _ = residue_evidence(measured(rng, 1.0), sd, PREDICTED, LARGEST, EVERY)
    random = 7.0 * LARGEST[:, None] * rng.standard_normal(PREDICTED.shape)
    wrong, _ = residue_evidence(random, 0.02 * np.abs(random), PREDICTED, LARGEST, EVERY)

    share = [np.exp(one).max(axis=1) / np.exp(one).sum(axis=1) for one in (right, wrong)]
    assert np.mean(np.argmax(wrong, axis=1) == np.arange(N_MODES)) < 0.5
    assert np.median(share[0]) > 0.9


def test_signs_between_two_places_tell_the_polarity_and_doubtful_ones_nothing():
    one = PREDICTED[:, 0]
    sure = np.eye(N_MODES)

    assert sign_odds(np.sign(one), one, LARGEST, sure) > np.log(100.0)
    assert sign_odds(-np.sign(one), one, LARGEST, sure) < -np.log(100.0)
    assert sign_odds(np.zeros(N_MODES), one, LARGEST, sure) == 0.0
    assert abs(sign_odds(np.sign(one), 1e-6 * one, LARGEST, sure)) < 0.1  # nodal lines everywhere
