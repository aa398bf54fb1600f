"""Labels proposed for bare peaks: the assignment against enumeration, and boards by an independent solver."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import made_boards
import numpy as np
import pytest
import ritz

from bayesplate.board.board import Board
from bayesplate.board.material import moduli
from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak
from bayesplate.estimates import proposals as proposed
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.estimates.proposals import UNUSUAL, probabilities, proposals
from bayesplate.labels import Label

PLATE = ritz.Plate.from_moduli(10e9, 0.8e9, 0.75e9, 0.4, rho=430.0, h=3e-3, L_x=0.55, L_y=0.2, edges=ritz.ALL_FREE)
LABELS = ((1, 1), (2, 0), (2, 1), (0, 2), (1, 2), (3, 0), (3, 1), (2, 2))
MISSING = (0, 2)
MISSED, SPURIOUS = 0.3, 0.1
"""As a card states them, other than by default."""


def board_of(peaks: list[float]) -> Board:
    setup = replace(made_boards.setup_of(ritz.ALL_FREE, {}), peaks=made_boards.peaks_of(*peaks))
    return made_boards.board_of(PLATE, [setup])


@pytest.fixture(scope="module")
def found():
    """Seven of the lowest eight modes, with noise, in no order, under the prior of the wood."""
    hertz = ritz.simulate(PLATE, [label for label in LABELS if label != MISSING])
    noisy = made_boards.with_noise(hertz, 0.003, np.random.default_rng(5))
    truth = tuple(Label(*label) for label in sorted(noisy, key=noisy.__getitem__))
    return truth, proposals(board_of(list(noisy.values())), load_prior("spruce"), np.random.default_rng(1))


def test_the_labels_of_a_free_board_are_found_though_a_mode_was_missed(found):
    truth, ways = found

    assert ways[0].labels == truth
    assert ways[0].probability > 0.9
    assert sum(one.probability for one in ways) == pytest.approx(1.0)
    assert [one.probability for one in ways] == sorted((one.probability for one in ways), reverse=True)


def test_the_most_probable_board_holds_its_peaks_as_readings(found):
    truth, ways = found
    (setup,) = ways[0].board.setups

    assert tuple(reading.label for reading in setup.readings) == truth
    assert setup.peaks == ()


def test_probabilities_of_a_peak_are_those_of_the_ways_that_give_it_a_label(found):
    truth, ways = found
    for i in range(len(truth)):
        shares = probabilities(ways, i)
        assert sum(shares.values()) == pytest.approx(1.0)
        for label, share in shares.items():
            assert share == pytest.approx(sum(one.probability for one in ways if one.labels[i] == label))


def test_the_weight_of_a_way_holds_the_prior_at_its_estimate_and_what_is_unusual(found, monkeypatch):
    _, ways = found
    estimate = weighted_least_squares(ways[0].board)
    D_x, D_y, D_s = estimate.rigidities
    elastic = moduli(D_x, D_y, D_s, estimate.values["thickness"], estimate.values["poisson_xy"])
    modes = [(float(np.log(r.frequency.mean)), r.label) for r in ways[0].board.setups[0].readings]
    spruce, weak = load_prior("spruce"), load_prior("weakly-informative")

    def weight(prior):
        return proposed._log_weight(ways[0].board, estimate, ways[0].labels, modes, prior)

    def density(prior):
        return sum(
            float(one.log_density_of_log(np.log(elastic._asdict()[name]))) for name, one in prior.constants.items()
        )

    assert weight(spruce) - weight(weak) == pytest.approx(density(spruce) - density(weak))
    usual, ratio = weight(weak), float(elastic.E_x / elastic.E_y)
    monkeypatch.setattr(proposed, "MOST_ORTHOTROPIC", 1.01 * ratio)
    assert weight(weak) == usual
    monkeypatch.setattr(proposed, "MOST_ORTHOTROPIC", 0.99 * ratio)
    assert weight(weak) - usual == pytest.approx(np.log(UNUSUAL))
    assert UNUSUAL < 0.05


def test_modes_of_orders_that_no_card_may_state_have_no_label(found, monkeypatch):
    """A board with a peak so high was refused for a label that the search had given it itself."""
    _, ways = found
    estimate = weighted_least_squares(ways[0].board)
    monkeypatch.setattr(proposed, "HIGHEST_INDEX", 99)
    bold = [label for _, label in proposed._modes_at(ways[0].board, estimate, 2200.0)]
    monkeypatch.undo()
    labels = [label for _, label in proposed._modes_at(ways[0].board, estimate, 2200.0)]

    assert (12, 0) in bold
    assert labels == [None if label is None or max(label) > 11 else label for label in bold]


def test_three_peaks_and_boards_with_a_label_are_left_alone():
    prior, rng = load_prior("spruce"), np.random.default_rng(1)
    labelled = made_boards.setup_of(ritz.ALL_FREE, {(1, 1): 35.0, (2, 0): 50.0})
    with_label = made_boards.board_of(PLATE, [replace(labelled, peaks=made_boards.peaks_of(86.0, 111.0, 129.0, 139.0))])

    assert proposals(board_of([35.0, 50.0, 86.0]), prior, rng) == []
    assert proposals(with_label, prior, rng) == []


def cost_of(pairs: list[tuple[int, int]], peaks: np.ndarray, modes: np.ndarray, sd: float) -> float:
    """-ln of the probability of one assignment, as the module's docstring words it."""
    used = max((j for _, j in pairs), default=-1) + 1
    gaps = sum(
        0.5 * ((peaks[i] - modes[j]) / sd) ** 2 + np.log(sd * np.sqrt(2 * np.pi)) - np.log(1 - MISSED) for i, j in pairs
    )
    return gaps - (used - len(pairs)) * np.log(MISSED) - (peaks.size - len(pairs)) * np.log(SPURIOUS)


def test_the_cheapest_assignment_is_that_of_enumeration():
    rng = np.random.default_rng(2)
    setup = replace(made_boards.setup_of(ritz.ALL_FREE, {}), missed=MISSED, spurious=SPURIOUS)
    for _ in range(30):
        n_peaks, n_modes, sd = int(rng.integers(1, 5)), 6, 0.05
        peaks, modes = np.sort(rng.uniform(0, 1, n_peaks)), np.sort(rng.uniform(0, 1, n_modes))
        ways = {
            tuple(zip(some, others, strict=True))
            for k in range(n_peaks + 1)
            for some in combinations(range(n_peaks), k)
            for others in combinations(range(n_modes), k)
        }
        best = min(ways, key=lambda pairs: cost_of(list(pairs), peaks, modes, sd))
        cost, picked = proposed._align(setup, peaks, modes[None], sd)

        assert cost[0] == pytest.approx(cost_of(list(best), peaks, modes, sd))
        assert tuple((i, j) for i, j in enumerate(picked[0]) if j >= 0) == best


def test_a_peak_that_is_no_mode_is_left_alone_sooner_where_the_card_expects_such(found):
    """Weights of the same labels: by the logarithm of the ratio of the stated probabilities for each peak left out."""
    truth, ways = found
    labels = (*truth[:-1], None)
    weights = []
    for spurious in (0.02, 0.2):
        setup = replace(ways[0].board.setups[0], spurious=spurious)
        board = replace(ways[0].board, setups=(setup,))
        estimate = weighted_least_squares(board)
        modes = proposed._modes_at(board, estimate, max(setup.measured))
        weights.append(proposed._log_weight(board, estimate, labels, modes, load_prior("spruce")))

    assert weights[1] - weights[0] == pytest.approx(np.log(10.0))


def test_a_peak_takes_along_what_is_known_of_it():
    """As a reading its uncertainty and its sign, without a label all of it, whatever the order of the peaks."""
    high = Peak(Quantity.from_mean(86.0, 0.3), "-", damping=0.01)
    low = Peak(Quantity.from_mean(35.0, 0.1), "+")
    board = made_boards.board_of(PLATE, [replace(made_boards.setup_of(ritz.ALL_FREE, {}), peaks=(high, low))])
    (setup,) = proposed._labelled(board, board.setups[0], (Label(1, 1), None)).setups

    assert [(one.label, one.frequency, one.sign) for one in setup.readings] == [(Label(1, 1), low.frequency, "+")]
    assert setup.peaks == (high,)
