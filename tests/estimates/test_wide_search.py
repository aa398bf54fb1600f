"""The search of all the prior: its tables against full solves, what it finds against the plate that made the peaks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, board_of, peaks_of, setup_of

from bayesplate.board.material import RIGIDITIES
from bayesplate.board.prior import load_prior
from bayesplate.estimates import wide_search
from bayesplate.estimates.wide_search import NOISES, search_widely
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.system import system_of

PLATE = ritz.FINNISH
HERTZ = [*ritz.simulate(PLATE, CANTILEVER_LABELS).values()]
WIDE = load_prior("weakly-informative")


def board_with(*sessions):
    setups = [
        replace(setup_of(ritz.CANTILEVER, {}, name=f"session-{i}"), peaks=peaks_of(*hertz), missed=0.3)
        for i, hertz in enumerate(sessions)
    ]
    return board_of(PLATE, setups)


@pytest.fixture(scope="module")
def found():
    """Guesses, and the tables on which the last of them rest, of one board in two sessions of slightly other peaks."""
    tables = []
    made = wide_search._SetupModes.table

    def table(self, population, n_nodes):
        tables.append((self, made(self, population, n_nodes), population))
        return tables[-1][1]

    board = board_with(HERTZ, [1.003 * one for one in HERTZ])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wide_search._SetupModes, "table", table)
        guesses = search_widely(board, WIDE, np.random.default_rng(0))
    return board, guesses, tables


def test_the_first_guess_is_the_plate_that_made_the_peaks(found):
    _, guesses, _ = found
    true = np.log([PLATE.D_x, PLATE.D_y, PLATE.D_s])
    sd = guesses[0].log_rigidities.std(axis=0)

    assert np.all(np.abs(np.log(guesses[0].rigidities) - true) < 3.0 * sd)
    assert np.all(sd < 0.05)  # of a prior that is wide by a factor of three and more


def test_tables_err_by_less_than_the_noise(found):
    """At members of the population, against full solves; where they erred by more, the wrong modes were found.

    Sessions that hold the plate alike share them.
    """
    board, _, tables = found
    named = setup_of(ritz.CANTILEVER, dict.fromkeys(CANTILEVER_LABELS, 1.0))
    for (modes, table, population), noise in zip(tables, NOISES, strict=True):
        assert len(modes.peaks) == 2
        ratios = population[:, :2] - population[:, 2:]
        low, high = np.quantile(ratios, [0.1, 0.9], axis=0)
        inner = population[((ratios > low) & (ratios < high)).all(axis=1)][:5]
        of_place = {(place.parity, place.rank): i for i, place in enumerate(modes.reduced.places)}
        for x in inner:
            values = {**board.nominal(), **dict(zip(RIGIDITIES, np.exp(x), strict=True))}
            model = setup_model(system_of(board, named), values)
            tabled = table(x[:2] - x[2:])[0] + 0.5 * x[2]
            there = tabled[[of_place[place.parity, place.rank] for place in model.places]]
            assert np.abs(there - model.mode_log_frequencies(values, "linear")[0]).max() < noise, noise


def test_a_prior_without_a_plate_leaves_nothing_to_guess(monkeypatch):
    monkeypatch.setattr(wide_search, "_log_prior_density", lambda *_: lambda x: np.full(len(x), -np.inf))
    assert search_widely(board_with(HERTZ), WIDE, np.random.default_rng(0)) == []
