"""The variance budget: components of a field are one row, whatever each of them explains."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, board_of, setup_of

from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import with_discrepancies
from bayesplate.commands.prepare import prepare
from bayesplate.results.budget import budget, input_remarks, input_shares, row_words

FIELDS = ("thickness_profile.field_1", "thickness_profile.field_2")


def orthogonal(n):
    """Columns of 400 draws without a mean that are not correlated, and of one size."""
    random = np.random.default_rng(2).standard_normal((400, n))
    return np.linalg.qr(np.column_stack([np.ones(400), random]))[0].T[1:]


def test_components_of_a_field_are_one_row_with_words():
    """Of draws whose E_x is explained by two components of the thickness, 36 % and 25 %."""
    board = prepare("spruce-free-2R", ["thickness_profile"]).board
    columns = orthogonal(4)
    log_modulus = 0.6 * columns[0] + 0.5 * columns[1] + np.sqrt(0.39) * columns[2]
    inputs = dict(zip((*FIELDS, "mass"), (columns[0], columns[1] + 0.1 * columns[0], np.exp(columns[3])), strict=True))
    draws = SimpleNamespace(moduli={"E_x": np.exp(log_modulus)}, inputs=inputs)
    rows, alone = budget(draws, board)["E_x"], input_shares(draws)["E_x"]

    assert {one.name for one in board.uncertain if one.is_component} == set(FIELDS)
    assert set(rows) == {"mass", "thickness_profile"}
    assert rows["thickness_profile"] == pytest.approx(0.61)
    assert sum(alone[name] for name in FIELDS) == pytest.approx(0.61)
    assert rows["mass"] == alone["mass"]
    assert [row_words(row, board) for row in ("thickness_profile", "mass")] == ["thickness profile", "mass"]
    (said,) = input_remarks(draws, board)
    assert said.startswith("61 % of the uncertainty (variance) of E_x comes from the thickness profile: measure it")


def test_discrepancies_of_sessions_are_one_row_and_no_reason_to_measure_better():
    hertz = dict(zip(CANTILEVER_LABELS, (50.0, 98.0, 310.0, 340.0, 480.0, 700.0), strict=True))
    days = [setup_of(ritz.CANTILEVER, hertz, name=name) for name in ("monday", "friday")]
    board = with_discrepancies(board_of(ritz.FINNISH, days, poisson_xy=Quantity.from_mean(0.4, 0.08, "normal")))
    of_modes = [one.name for one in board.uncertain if not one.is_listed]
    columns = orthogonal(7)
    log_modulus = 0.6 * columns[0] + 0.5 * columns[1] + 0.1 * columns[6]
    inputs = dict(zip((*of_modes, "poisson_xy"), columns, strict=True))
    draws = SimpleNamespace(moduli={"E_x": np.exp(log_modulus)}, inputs=inputs)

    assert len(of_modes) == 6
    assert set(budget(draws, board)["E_x"]) == {"poisson_xy", "discrepancies of the modes"}
    (said,) = input_remarks(draws, board)
    assert "comes from the discrepancies of the modes, which more sessions do not narrow: read other modes" in said


def drawn(correlation, n=40_000):
    """Draws of ln E_x = -3 thickness + support + readings, where the readings have left the two inputs correlated."""
    rng = np.random.default_rng(5)
    covariance = [[1e-4, correlation * 2e-4], [correlation * 2e-4, 4e-4]]
    thickness, support = rng.multivariate_normal([1.0, 0.0], covariance, n).T
    log_modulus = -3.0 * thickness + support + 0.01 * rng.standard_normal(n)
    return SimpleNamespace(moduli={"E_x": np.exp(log_modulus)}, inputs={"thickness": thickness, "support": support})


def test_shares_and_what_the_readings_leave_add_up_to_the_variance():
    """The control is the squared correlation with each input itself: together more than there is, or less."""
    for correlation in [0.0, 0.9]:
        draws = drawn(correlation)
        shares, log_modulus = input_shares(draws)["E_x"], np.log(draws.moduli["E_x"])
        left = 1e-4 / log_modulus.var()
        error = 4.0 * np.sqrt(2.0 / log_modulus.size)
        assert sum(shares.values()) + left == pytest.approx(1.0, abs=error)
        alone = sum(np.corrcoef(log_modulus, column)[0, 1] ** 2 for column in draws.inputs.values())
        assert (alone + left == pytest.approx(1.0, abs=error)) == (correlation == 0.0)


def test_an_input_that_were_known_would_take_its_share_off():
    """Of inputs that the readings do not tell of: nine of fourteen parts of the variance are the thickness'."""
    draws = drawn(0.0)
    log_modulus, thickness = np.log(draws.moduli["E_x"]), draws.inputs["thickness"]
    without = log_modulus + 3.0 * (thickness - 1.0)
    error = 4.0 * np.sqrt(2.0 / log_modulus.size)
    share = input_shares(draws)["E_x"]["thickness"]
    assert share == pytest.approx(9.0 / 14.0, abs=error)
    assert 1.0 - without.var() / log_modulus.var() == pytest.approx(share, abs=error)
