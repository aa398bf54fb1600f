"""Rows of the labelled modes: every number of a row belongs to the same prediction."""

from __future__ import annotations

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import ritz
from carried_boards import CARRIES, LABEL, five_modes
from made_boards import setup_of
from made_reports import fitted
from made_summaries import SUMMARY

from bayesplate.board.quantity import Quantity
from bayesplate.commands.printout import show_fit
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.report.content import summary_sentences
from bayesplate.results.contract import json_text
from bayesplate.results.modes import _label_origin, mode_rows

HERTZ = {(0, 0): 57.0, (0, 1): Quantity.from_mean(100.0, 0.5)}
SETUP = setup_of(ritz.ALL_CLAMPED, HERTZ, name="bench", resolution=1.0)


@pytest.fixture(scope="module")
def rows():
    """Two modes, the second with its own uncertainty and so not rounded, and skewed draws of both predictions."""
    places = [SimpleNamespace(correlation=value) for value in (0.99, 0.9)]
    posterior = SimpleNamespace(models=[SimpleNamespace(places=places)], readings=(ReadingErrors.of(SETUP),))
    problem = SimpleNamespace(board=SimpleNamespace(setups=(SETUP,)), posterior=posterior)
    rng = np.random.default_rng(1)
    log_frequency = np.log([56.0, 101.0]) + 0.02 * rng.standard_exponential((4, 500, 2))
    draws = SimpleNamespace(log_frequency=log_frequency, problem=problem)
    assessment = SimpleNamespace(left_out=np.log([1.01, np.nan]), leverages=np.array([0.25, 0.75]))
    return mode_rows(draws, assessment), np.exp(log_frequency)


def test_residuals_are_those_of_the_prediction_beside_them(rows):
    made, hertz = rows
    for i, row in enumerate(made):
        predicted = row.predicted_hz
        assert predicted.mean == pytest.approx(hertz[..., i].mean())
        assert row.residual_cents == pytest.approx(1200 * np.log2(row.measured_hz / predicted.mean))
        assert row.residual_interval_cents == pytest.approx(
            (1200 * np.log2(row.measured_hz / predicted.q95), 1200 * np.log2(row.measured_hz / predicted.q05))
        )
        residuals = 1200 * np.log2(row.measured_hz / hertz[..., i])
        low, high = row.residual_interval_cents
        # nine draws in ten lie within; an end between two of 2000 draws may gain or lose one
        assert np.mean((residuals >= low) & (residuals <= high)) == pytest.approx(0.9, abs=2 / 2000)


def test_the_rest_of_a_row_by_hand(rows):
    """57 Hz read to 1 Hz: between 56.5 and 57.5 Hz, 15.26 cents below, 15.12 above; 100 ± 0.5 Hz is not rounded."""
    first, second = rows[0]

    assert first.rounding_cents == pytest.approx((1200 * np.log2(56.5 / 57), 1200 * np.log2(57.5 / 57)))
    assert first.rounding_cents == pytest.approx((-15.26, 15.12), abs=0.01)
    assert second.rounding_cents is None
    assert (first.setup, first.label, first.measured_hz) == ("bench", "(0,0)", 57.0)
    assert first.left_out_cents == pytest.approx(1200 * np.log2(1.01))
    assert second.left_out_cents is None
    assert [(row.leverage, row.label_correlation) for row in (first, second)] == [(0.25, 0.99), (0.75, 0.9)]


@pytest.fixture(scope="module")
def doubtful(tmp_path_factory):
    """A fit of the board of which one mode alone carries a constant, with labels that are nearly sure."""
    card = five_modes(tmp_path_factory.mktemp("five"))
    text = card.read_text(encoding="utf-8")
    card.write_text(text.replace("[setup]\n", "[setup]\nlabel_confidence = 0.95\n", 1), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("bayesplate.results.modes.MOST_DRAWS_OF_LABELS", 10)
        return fitted(str(card)).summary


def test_a_peak_of_a_sure_label_is_predicted_as_its_mode_is(doubtful):
    """The same draws stand behind both tables, also where the probabilities of labels are taken from some."""
    by_label = {mode.label: mode.predicted_hz for mode in doubtful.modes}

    assert len(doubtful.peaks) == len(by_label) == 5
    for peak in doubtful.peaks:
        assert peak.predicted_hz.mean == pytest.approx(by_label[peak.assignments[0].label].mean, rel=1e-12)


def test_a_mode_that_alone_carries_a_constant_is_named_and_left_out_of_the_left_out_error(doubtful):
    (one,) = doubtful.carrying_modes
    assert (one.label, one.carries) == (LABEL, CARRIES)
    assert one.leverage > 0.9 > max(row.leverage for row in doubtful.modes if row.label != LABEL)
    others = [row.left_out_cents for row in doubtful.modes if row.label != LABEL]
    assert doubtful.error.leave_one_out_rms_cents == pytest.approx(np.sqrt(np.mean(np.square(others))))
    (own,) = (row.left_out_cents for row in doubtful.modes if row.label == LABEL)
    assert abs(own) > 3.0 * doubtful.error.leave_one_out_rms_cents  # it would show
    sentence = f"mode {LABEL} alone carries {CARRIES}: it does not count in the leave-one-out error"
    assert sentence in doubtful.identifiability
    assert sentence in show_fit(doubtful).remarks
    assert json.loads(json_text(doubtful))["carrying_modes"][0]["carries"] == CARRIES


def test_where_every_mode_carries_something_alone_it_is_said_that_there_is_no_left_out_error():
    none = replace(SUMMARY.error, leave_one_out_rms_cents=None)
    carrying = replace(SUMMARY, error=none)
    few = replace(carrying, modes=tuple(replace(row, left_out_cents=None) for row in SUMMARY.modes))
    assert (
        "there is no leave-one-out error, for every mode alone carries a constant or a size"
        in show_fit(carrying).closing
    )
    assert "every mode alone carries a constant or a size." in summary_sentences(carrying)[1]
    assert "too few modes to leave one out" in show_fit(few).closing
    assert "too few modes to test it" in summary_sentences(few)[1]


def test_a_label_is_in_doubt_below_a_confidence_of_99_per_cent():
    """`pick` writes 0.999 at most."""
    origins = [_label_origin(confidence) for confidence in (1.0, 0.99, 0.98, 0.0)]
    assert origins == ["card", "card", "doubtful", "proposed"]
