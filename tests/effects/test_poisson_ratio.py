"""Poisson ratio: the generator, the sizes of physics.md, and that every use of the input follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from effect_plates import setup_of, values_of
from generator.known_boards import BEAMS, FINNISH
from made_boards import board_of

from bayesplate.board.quantity import Quantity
from bayesplate.effects import declare
from bayesplate.effects.poisson_ratio import FREE_POISSON, PoissonRatio
from bayesplate.frequencies.system import System
from bayesplate.plate.naming import find


def test_sizes_on_the_papers_cantilever():
    """physics.md 6: nu_xy lower by 0.16 at the same E."""
    before, after = (_log_hertz(replace(FINNISH, nu_xy=FINNISH.nu_xy - less)) for less in (0.0, 0.16))
    assert 1200 * (after - before) / np.log(2) == pytest.approx([-5, -3, 5, -14, -5, -9], abs=0.7)


def _log_hertz(plate):
    system, values = System(setup_of(plate), (PoissonRatio(),)), values_of(plate, {})
    found = find(system.plate(values), system.weights(values).at(0), BEAMS["cantilever"])
    return 0.5 * np.log([found[b].eigenvalue for b in BEAMS["cantilever"]])


def test_declared_it_is_the_boards_own_input():
    """One value, in the weights and in E from D."""
    board = board_of(ritz.FINNISH, [setup_of(FINNISH)])
    declared = declare(replace(board, effects=("poisson_ratio",)))

    assert declared.uncertain_inputs == {"poisson_xy": FREE_POISSON}
    assert declare(declared).parameters[:-1] == declared.parameters[:-1]
    assert [one.name for one in PoissonRatio().parameters()] == ["poisson_xy"]


@pytest.mark.parametrize("nu_xy", [-0.01, 0.91])
def test_range_is_physical(nu_xy):
    assert FREE_POISSON.log_prior(FREE_POISSON.standard(nu_xy)) == -np.inf


def test_no_candidate_where_the_ratio_is_uncertain_already():
    board = board_of(ritz.FINNISH, [setup_of(FINNISH)])
    uncertain = board.with_priors({"poisson_xy": Quantity.from_mean(0.4, 0.08, "normal")})
    assert not PoissonRatio.refusal(board, board.setups[0])
    assert "already uncertain" in PoissonRatio.refusal(uncertain, board.setups[0])
