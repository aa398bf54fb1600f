"""Poisson ratio: the generator, the sizes of physics.md, and that every use of the input follows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from effect_plates import setup_of, values_of
from generator.known_boards import BEAMS, FIEMME, FINNISH
from made_boards import board_of

from bayesplate.board.quantity import Quantity
from bayesplate.effects import declare
from bayesplate.effects.poisson_ratio import FREE_POISSON, PoissonRatio
from bayesplate.frequencies.system import System
from bayesplate.plate.naming import find


@pytest.mark.parametrize(
    ("plate", "beams", "lowest", "highest"),
    [(FINNISH, "cantilever", [-5, -3, 5, -14, -5, -9], None), (FIEMME, "clamped", -30, -18)],
    ids=["cantilever", "clamped"],
)
def test_sizes_on_the_papers_boards(plate, beams, lowest, highest):
    """physics.md 6: nu_xy lower by 0.16 at the same E."""
    lower = replace(plate, nu_xy=plate.nu_xy - 0.16)
    both = [values_of(p, {}) for p in (plate, lower)]
    found = _hertz(plate, both[1], BEAMS[beams]) - _hertz(plate, both[0], BEAMS[beams])
    cents = 1200 * found / np.log(2)
    if highest is None:
        assert cents == pytest.approx(lowest, abs=0.7)
    else:
        assert cents.min() > lowest - 0.6
        assert cents.max() < highest + 0.6


def _hertz(plate, values, beams):
    system = System(setup_of(plate), (PoissonRatio(),))
    found = find(system.plate(values), system.weights(values).at(0), beams)
    return 0.5 * np.log([found[b].eigenvalue for b in beams])


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
