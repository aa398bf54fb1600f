"""What is believed now against the search itself: its probabilities after further modes, and its constants."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import made_searches as made
import numpy as np
import pytest

from bayesplate.board.material import RIGIDITIES
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.search import run_search
from bayesplate.diagnosis.terms import noise_grid
from bayesplate.planning.beliefs import Beliefs
from bayesplate.planning.explained import explanation_terms, explanations_of_effects, surviving_explanations
from bayesplate.planning.gains import PlannedReadings, probabilities_after

N_READ, N_MODES = 6, 9
NAMES = ("first", "second")


@pytest.fixture(scope="module")
def boards():
    """A made board of nine modes, and the same of which six were read; one effect is there."""
    rng = np.random.default_rng(11)
    whole = made.baseline(rng, N_MODES)
    directions = {name: 0.012 * rng.standard_normal(N_MODES) for name in NAMES}
    residual = 1.1 * directions["first"] + made.NOISE * rng.standard_normal(N_MODES)
    return {n: found_of(whole, directions, residual, n) for n in (N_READ, N_MODES)}, whole, directions


def found_of(whole, directions, residual, n):
    """A search of the first n modes. Cells of both boards leave the constants where they are, so that they agree."""
    (setup,) = whole.board.setups
    every = replace(
        whole.possible_modes,
        log_frequency=whole.possible_modes.log_frequency[:n], slopes=whole.possible_modes.slopes[:n],
        input_slopes=whole.possible_modes.input_slopes[:n], places=(whole.possible_modes.places[0][:n],),
        predict=lambda x: whole.possible_modes.predict(x)[:, :n],
    )  # fmt: skip
    base = replace(
        whole, board=replace(whole.board, setups=(replace(setup, readings=setup.readings[:n]),)),
        log_readings=(whole.middle + residual)[:n], possible_modes=every, rows=np.arange(n),
    )  # fmt: skip
    candidates = {name: unmoved(made.candidate(base, name, d[:n]), d[:n]) for name, d in directions.items()}
    levels = noise_grid(base.board)
    tables = [(name, one.fine) for name, one in candidates.items()]
    hypotheses = (made.bare(base, levels), *(Hypothesis((name,), 0.25, table, levels, base) for name, table in tables))
    return run_search(made.ground_of(base, *hypotheses, candidates=candidates))


def unmoved(one, direction):
    """A candidate whose table keeps the raw shift: the constants are projected out in any case."""
    table = one.fine
    size = made.HALF_NORMAL.value(table.z[:, 0])
    slope = made.HALF_NORMAL.value(table.z[:, 0] + 0.5 * table.z_slopes[:, 0])
    slope -= made.HALF_NORMAL.value(table.z[:, 0] - 0.5 * table.z_slopes[:, 0])
    raw = replace(
        table, shift=np.outer(size, direction), slopes=(slope[:, None] * direction)[:, :, None],
        moved=np.zeros_like(table.moved), moved_slopes=np.zeros_like(table.moved_slopes),
    )  # fmt: skip
    return replace(one, fine=raw)


def believed(found, effects):
    """What the search leaves to be believed of some effects."""
    explanations = explanation_terms(found, explanations_of_effects(found, effects), np.random.default_rng(1))
    return Beliefs((SimpleNamespace(board=found.ground.baseline.board),), explanations)


def further(beliefs, whole, directions):
    """The last three modes as readings, each term linear about the size that it expects."""
    rows = slice(N_READ, N_MODES)
    shift, slopes, variance = [], [], []
    for one in beliefs.explanations:
        moved = np.zeros((one.n_terms, N_MODES - N_READ))
        along = np.zeros((one.n_terms, N_MODES - N_READ, one.mean.shape[1]))
        along[:, :, : len(RIGIDITIES)] = whole.slopes[rows]
        if one.members:
            z, step = one.mean[:, -1], np.sqrt(one.covariance[:, -1, -1])
            change = made.HALF_NORMAL.value(z + step) - made.HALF_NORMAL.value(z - step)
            slope, direction = change / (2.0 * step), directions[one.members[0]][rows]
            moved = np.outer(made.HALF_NORMAL.value(z) - slope * z, direction)
            along[:, :, -1] = np.outer(slope, direction)
        shift.append(moved)
        slopes.append(along)
        variance.append(np.tile(one.noise**2, (1, N_MODES - N_READ)))
    return PlannedReadings(tuple(shift), tuple(slopes), tuple(variance))


def test_probabilities_now_are_those_of_the_search(boards):
    found = boards[0][N_READ]
    beliefs = believed(found, NAMES)

    by_name = {one.members: one.probability for one in beliefs.explanations}
    assert by_name == pytest.approx(
        {(): found.probability_of_none} | {(name,): found.inclusion(name) for name in NAMES}
    )
    assert beliefs.entropy == pytest.approx(-sum(p * np.log(p) for p in by_name.values()))


def test_after_further_modes_they_are_those_of_a_search_that_has_them(boards):
    """Terms stand for cells and levels, so that a few per cent remain; without the size in them it is off by far."""
    found, whole = boards[0][N_READ], boards[0][N_MODES]
    beliefs = believed(found, NAMES)
    readings = further(beliefs, boards[1], boards[2])
    read = whole.residual[None, N_READ:]

    after = probabilities_after(beliefs, readings, read)[:, 0]

    wanted = [
        whole.probability_of_none if not one.members else whole.inclusion(one.members[0])
        for one in beliefs.explanations
    ]
    assert after == pytest.approx(wanted, abs=0.03)
    without = tuple(np.where(np.arange(one.shape[2]) < len(RIGIDITIES), one, 0.0) for one in readings.slopes)
    control = replace(readings, shift=tuple(np.zeros_like(one) for one in readings.shift), slopes=without)
    assert np.abs(probabilities_after(beliefs, control, read)[:, 0] - wanted).max() > 0.1


def test_moduli_have_the_variance_of_the_weighted_fit_without_an_effect(boards):
    """Their logarithms are those of the rigidities but for constants, where nu_xy hardly matters."""
    found = boards[0][N_READ]
    beliefs = believed(found, ())
    (one,) = beliefs.explanations

    slopes = found.ground.baseline.slopes
    wanted = [np.linalg.inv(slopes.T @ slopes) * noise[0] ** 2 for noise in one.noise]
    drawn = one.target_slopes @ one.covariance @ np.swapaxes(one.target_slopes, 1, 2)
    assert np.diagonal(drawn, axis1=1, axis2=2)[:, 2] == pytest.approx([w[2, 2] for w in wanted], rel=1e-6)


def test_survivors_are_those_within_a_factor_ten_and_no_effect(boards):
    found = boards[0][N_READ]

    def left(none, first, second, rivals=()):
        share = np.array([none, first, second])
        made_up = replace(found, probability=share / share.sum())
        return {one.members for one in surviving_explanations(made_up, rivals)}

    assert left(0.5, 0.4, 0.05) == {(), ("first",), ("second",)}
    assert left(0.5, 0.4, 0.03) == {(), ("first",)}
    assert left(0.2, 0.8, 0.01) == {(), ("first",)}
    assert left(0.01, 0.8, 0.1) == {("first",), ("second",)}
    assert left(0.01, 0.9, 0.01) == {("first",)}
    assert left(0.01, 0.9, 0.01, [("second",)]) == {("first",), ("second",)}


def test_the_readings_at_hand_are_expected_where_the_search_has_them(boards):
    """Given them each term expects the first readings but for what it leaves as noise, whatever the cell."""
    found = boards[0][N_READ]
    read = found.residual + found.ground.baseline.middle
    for one in believed(found, NAMES).explanations:
        expected = one.readings_at_hand.shift + np.einsum("tru,tu->tr", one.readings_at_hand.slopes, one.mean)
        pull = np.einsum("tru,tr->tu", one.readings_at_hand.slopes, (read - expected) / one.noise**2)
        assert list(one.readings_at_hand.reading_index) == list(range(N_READ))
        # normal equations: what is left over does not lean on the constants, whose prior is flat
        assert pull[:, : len(RIGIDITIES)] == pytest.approx(
            0.0, abs=1e-6 * np.abs(read - expected).max() / made.NOISE**2
        )
