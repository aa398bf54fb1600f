"""The variance budget: components of a field are one row, whatever each of them explains."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, board_of, setup_of

from bayesplate.plate.sessions import with_discrepancies
from bayesplate.quantities import Quantity
from bayesplate.results.budget import budget, input_remarks, input_shares, row_words
from bayesplate.workflow.prepare import prepare

FIELDS = ("thickness_profile.field_1", "thickness_profile.field_2")


@pytest.fixture(scope="module")
def read():
    """A board read at places, and draws whose E_x is explained by two components of its field, 36 % and 25 %."""
    board = prepare("spruce-free-2R", ["thickness_profile"]).board
    columns = np.linalg.qr(np.column_stack([np.ones(400), np.random.default_rng(2).standard_normal((400, 4))]))[0].T[1:]
    log_modulus = 0.6 * columns[0] + 0.5 * columns[1] + np.sqrt(0.39) * columns[2]
    inputs = dict(zip((*FIELDS, "mass"), (columns[0], columns[1] + 0.1 * columns[0], np.exp(columns[3])), strict=True))
    return board, SimpleNamespace(moduli={"E_x": np.exp(log_modulus)}, inputs=inputs)


def test_components_are_one_row(read):
    board, draws = read
    assert {one.name for one in board.uncertain if one.is_component} == set(FIELDS)
    rows = budget(draws, board)["E_x"]
    assert set(rows) == {"mass", "thickness_profile"}
    assert rows["thickness_profile"] == pytest.approx(0.61)
    alone = input_shares(draws)["E_x"]
    assert sum(alone[name] for name in FIELDS) != pytest.approx(0.61, abs=0.02)
    assert rows["mass"] == alone["mass"]


def test_a_row_has_words(read):
    board, draws = read
    assert row_words("thickness_profile", board) == "thickness profile"
    assert row_words("mass", board) == "mass"
    (said,) = input_remarks(draws, board)
    assert said.startswith("61 % of the uncertainty (variance) of E_x comes from the thickness profile: measure it")


def test_discrepancies_of_sessions_are_one_row_and_no_reason_to_measure_better():
    hertz = dict(zip(CANTILEVER_LABELS, (50.0, 98.0, 310.0, 340.0, 480.0, 700.0), strict=True))
    days = [setup_of(ritz.CANTILEVER, hertz, name=name) for name in ("monday", "friday")]
    board = with_discrepancies(board_of(ritz.FINNISH, days, poisson_xy=Quantity.from_mean(0.4, 0.08, "normal")))
    of_modes = [one.name for one in board.uncertain if not one.is_listed]
    columns = np.linalg.qr(np.column_stack([np.ones(400), np.random.default_rng(2).standard_normal((400, 7))]))[0].T[1:]
    log_modulus = 0.6 * columns[0] + 0.5 * columns[1] + 0.1 * columns[6]
    inputs = dict(zip((*of_modes, "poisson_xy"), columns, strict=True))
    draws = SimpleNamespace(moduli={"E_x": np.exp(log_modulus)}, inputs=inputs)

    assert len(of_modes) == 6
    assert set(budget(draws, board)["E_x"]) == {"poisson_xy", "discrepancies of the modes"}
    (said,) = input_remarks(draws, board)
    assert "comes from the discrepancies of the modes, which more sessions do not narrow: read other modes" in said
