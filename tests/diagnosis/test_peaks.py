"""Peaks as each hypothesis takes them: evidence against the sum over all assignments, labels against planted ones."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from made_searches import NOISE, bare, baseline, candidate, ground_of, one_level
from scipy.special import logsumexp
from scipy.stats import norm

from bayesplate.diagnosis import peaks
from bayesplate.diagnosis.baseline import Baseline, PossibleModes
from bayesplate.diagnosis.folds import log_score, log_score_gains, nested_leave_one_out
from bayesplate.diagnosis.hypotheses import Hypothesis, confusable_labels
from bayesplate.diagnosis.peaks import log_likelihood_summed, with_own_labels
from bayesplate.diagnosis.search import run_search
from bayesplate.diagnosis.shifts import no_effect_cells
from bayesplate.frequencies.model import OtherMode, SetupModel
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.system import System
from bayesplate.plate.naming import ModePlace
from bayesplate.plate.terms import Parity

PLACE = ModePlace(Parity(0, 0), 0, 1.0)
N_MODES = 9
READ = [0, 1, 2, 4, 5, 7]
"""Modes that left a peak; the last one of the others lies far above the highest."""
MISSED, SPURIOUS = 0.2, 0.02


def peaked(rng, readings, labels=READ, confidence=(0.0,) * 6, spacing=0.3) -> Baseline:
    """A baseline of nine modes, whose readings (ln f) have labels that the card does not state."""
    whole = baseline(rng, N_MODES, spacing=spacing)
    order = [*labels, *(i for i in range(N_MODES) if i not in labels)]
    board = baseline(rng, len(labels)).board
    (setup,) = board.setups
    told = tuple(
        replace(one, frequency=type(one.frequency).exact(float(np.exp(at))), confidence=known, beams=(2 + i, 0))
        for i, (one, at, known) in enumerate(zip(setup.readings, readings, confidence, strict=True))
    )
    setup = replace(setup, readings=told, missed=MISSED, spurious=SPURIOUS)
    others = tuple(OtherMode(PLACE, (20 + i, 0)) for i in range(N_MODES - len(labels)))
    model = SetupModel(System(setup), None, (PLACE,) * len(labels), None, other_modes=others)
    every = PossibleModes(
        log_frequency=whole.log_frequency[order],
        slopes=whole.slopes[order],
        input_slopes=whole.input_slopes[order],
        places=((PLACE,) * N_MODES,),
        inputs=np.zeros(0),
        peaks=(PeakLikelihood.of(model),),
        predict=lambda x: whole.possible_modes.predict(x)[:, order],
    )
    return Baseline(
        board=replace(board, setups=(setup,)),
        values=whole.values,
        log_rigidities=whole.log_rigidities,
        log_readings=np.asarray(readings),
        possible_modes=every,
        rows=np.arange(len(labels)),
        symmetry=whole.symmetry,
    )


def enumerated(base: Baseline) -> float:
    """ln of the evidence of no effect at a known noise, flat in the constants: over all sets of rising pairs."""
    every, readings = base.possible_modes, base.residual + base.log_frequency
    peaks = np.argsort(readings)
    modes = np.argsort(every.log_frequency)[:-1]  # the last one is above all peaks
    logs = []
    for n in range(4, len(peaks) + 1):
        for rows in combinations(peaks, n):
            for columns in combinations(modes, n):
                x, y = every.slopes[list(columns)], readings[list(rows)] - every.log_frequency[list(columns)]
                precision = x.T @ x / NOISE**2
                off = y - x @ np.linalg.solve(precision, x.T @ y / NOISE**2)
                fit = -0.5 * off @ off / NOISE**2 - 0.5 * (n - 3) * np.log(2.0 * np.pi) - n * np.log(NOISE)
                fit -= 0.5 * np.linalg.slogdet(precision)[1]
                known = n * np.log((1.0 - SPURIOUS) * (1.0 - MISSED)) + (len(modes) - n) * np.log(MISSED)
                known += sum(
                    np.log(len(peaks) * SPURIOUS) + readings[i] - readings.max() for i in peaks if i not in rows
                )
                logs.append(fit + known)
    return float(logsumexp(logs))


def noisy(rng, spoilt=0.0, **stated):
    """Readings of the planted modes with noise; the third one off by so much."""
    middle = baseline(np.random.default_rng(3), N_MODES).log_frequency[READ]
    readings = middle + NOISE * rng.standard_normal(len(READ))
    readings[2] += spoilt
    return peaked(np.random.default_rng(3), readings, **stated)


SPOILT = [(0.0, 0.02, 0.02), (0.3, 0.02, 0.02), (0.05, 1.5, 0.1), (0.2, 1.5, 0.1)]
"""By how much the third peak is off, and by how much the sum may be below and above: between two modes it is a lower
bound, off by a nat or so, for ways to take the peak that no draw comes near are not in the sum."""


@pytest.mark.parametrize(("spoilt", "below", "above"), SPOILT)
def test_the_evidence_is_summed_over_all_assignments(spoilt, below, above):
    """Whatever the labels on the board say; a search by these alone is off."""
    base = noisy(np.random.default_rng(5), spoilt)
    ground = ground_of(base, with_every(bare(base, one_level(base))))
    by_labels, found = (run_search(one).log_evidence[0] for one in (ground, with_own_labels(ground)))
    expected = enumerated(base)
    assert expected - below < found < expected + above
    assert abs(by_labels - expected) > 4.0  # control


def with_every(none):
    """No effect on any of the nine modes."""
    return replace(none, table=no_effect_cells(N_MODES))


def planted():
    """A board whose third peak is the fourth mode, moved down by an effect to where the third one is expected."""
    rng = np.random.default_rng(11)
    direction = 0.02 * rng.standard_normal(N_MODES)
    direction[3] = -0.3
    labels = [0, 1, 2, 4, 5, 7]
    truth = [0, 1, 3, 4, 5, 7]
    whole = baseline(np.random.default_rng(3), N_MODES)
    readings = (whole.log_frequency + direction)[truth] + 0.3 * NOISE * rng.standard_normal(6)
    base = peaked(np.random.default_rng(3), readings, labels)
    order = [*labels, *(i for i in range(N_MODES) if i not in labels)]
    one = candidate(replace_all(base), "a", direction[order])
    levels = one_level(base)
    none = bare(base, levels)
    hypotheses = (with_every(none), Hypothesis(("a",), 0.5, one.fine, levels, base))
    return ground_of(base, *hypotheses, candidates={"a": one}), [*range(2), order.index(3), 3, 4, 5]


def replace_all(base: Baseline) -> Baseline:
    """A baseline of all modes, for an effect that acts on all of them."""
    return replace(
        base,
        board=baseline(np.random.default_rng(3), N_MODES).board,
        log_readings=base.possible_modes.log_frequency,
        possible_modes=replace(base.possible_modes, peaks=(None,)),
        rows=np.arange(N_MODES),
    )


def test_each_hypothesis_has_the_labels_that_it_makes_likely():
    ground, truth = planted()
    found = with_own_labels(ground)
    assert found.hypotheses[1].baseline.rows.tolist() == truth
    assert found.hypotheses[0].baseline.rows[2] != truth[2]


def test_labels_are_those_of_the_weighted_draws_whichever_way_estimates_most(monkeypatch):
    """Every way to label estimates the same sum: the largest estimate may be that of the worst draws."""
    ground, truth = planted()
    one, base = ground.hypotheses[1], ground.baseline
    ways = [one.labelled(base, np.array(truth)), one.labelled(base, base.rows)]
    honest = peaks._sum_labellings(ground, ways)
    estimates = iter([0.0, honest.log_labels + 40.0])
    monkeypatch.setattr(peaks, "log_mean", lambda _: next(estimates))
    monkeypatch.setattr(peaks, "_LARGEST_DROP", 1e3)
    assert peaks._sum_labellings(ground, ways).baseline.rows.tolist() == honest.baseline.rows.tolist() == truth


def test_certain_labels_leave_the_hypotheses_alone():
    base = baseline(np.random.default_rng(1), 6)
    ground = ground_of(base, bare(base, one_level(base)))
    assert with_own_labels(ground) is ground


def test_a_reading_that_is_no_mode_is_left_out_of_folds():
    base = noisy(np.random.default_rng(5))
    none = bare(base, one_level(base))
    rows = np.where(np.arange(6) == 2, -1, base.rows)
    without = replace(with_every(none), members=("a",)).labelled(base, rows)
    ground = ground_of(base, none, without)
    folded = nested_leave_one_out(ground, base.residual[None, :], -np.inf)
    assert np.isnan(folded.after[0]).tolist() == [False, False, True, False, False, False]
    kept = np.arange(6) != 2
    rms = [np.sqrt(np.mean(part[0, kept] ** 2)) for part in (folded.after, folded.before)]
    assert folded.ratio[0] == pytest.approx(rms[0] / rms[1])
    gains = log_score_gains(ground, base.residual, np.array([0, 0, 1, 0, 0, 0]))
    alone = np.log(6 * SPURIOUS) + base.log_readings[2] - base.log_readings.max()
    given_the_others = log_score(ground, 0, base.residual, carrying_readings=np.flatnonzero(kept))
    assert gains[2] == pytest.approx(alone - given_the_others)
    assert log_score_gains(ground, base.residual, np.zeros(6, dtype=int))[2] == 0.0


@pytest.mark.parametrize("confidence", [0.0, 0.9])
def test_labels_are_exchanged_only_where_all_are_certain(confidence):
    """Elsewhere the sum over assignments does it, and two exchanges would be one explanation."""
    near = baseline(np.random.default_rng(3), N_MODES, spacing=0.05, parities=[(i % 2, 0) for i in range(N_MODES)])
    assert len(confusable_labels(near)) > 1
    doubted = peaked(np.random.default_rng(3), near.log_frequency[READ], confidence=(confidence,) * 6, spacing=0.05)
    assert not confusable_labels(doubted)


def test_the_sum_counts_sure_readings_once():
    """Readings whose label is certain enter with their own density, the others by their assignments."""
    base = noisy(np.random.default_rng(5), confidence=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    noise = np.full((3, 1), NOISE)
    there = base.possible_modes.log_frequency + 0.003 * np.random.default_rng(2).standard_normal((3, N_MODES))
    sure = norm.logpdf(base.log_readings[0], there[:, 0], NOISE)
    others = base.possible_modes.peaks[0].log_likelihood(there, noise[:, 0])
    assert np.abs(sure).min() > 1.0
    assert log_likelihood_summed(base, there, noise) == pytest.approx(sure + others)
