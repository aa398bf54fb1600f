"""Which modes alone carry a constant or a size under a hypothesis: against the hat matrix of the same regression."""

from __future__ import annotations

import numpy as np
import pytest
from made_searches import baseline, candidate, found_among, singles

from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.folds import find_carrying_modes
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.shifts import combine_cells
from bayesplate.diagnosis.terms import noise_grid

WIDE = Quantity.from_mean(0.0, 1.0, "normal")
N_MODES = 8


@pytest.fixture(scope="module")
def found():
    """Effects that shift one mode each, and one pair; readings with none of them."""
    base = baseline(np.random.default_rng(1), N_MODES, n_inputs=0)
    levels = noise_grid(base.board)
    effects = {name: candidate(base, name, 0.2 * np.eye(N_MODES)[mode], WIDE) for name, mode in (("a", 4), ("b", 6))}
    both = combine_cells(effects["a"].coarse, effects["b"].coarse)
    every = [*singles(base, effects), Hypothesis(("a", "b"), 0.1, both, levels, base)]
    return found_among(base, effects, every, [0.25] * 4, np.zeros(N_MODES))


def hat(found, *modes):
    """Leverages of a regression on the constants and on one mode's own shift each, of prior sd 0.2."""
    base = found.ground.baseline
    own = 0.2 * np.eye(N_MODES)[:, list(modes)]
    weighted = np.hstack([base.slopes, own - base.slopes @ (base.absorption @ own)]) / base.scales[:, None]
    prior = np.diag([0.0] * 3 + [1.0] * len(modes))
    return np.diagonal(weighted @ np.linalg.inv(weighted.T @ weighted + prior) @ weighted.T)


@pytest.mark.parametrize(("index", "modes"), [(0, ()), (1, (4,)), (3, (4, 6))])
def test_they_are_those_of_linear_regression(found, index, modes):
    """Those without the effect are among them: before and after are judged by the same modes."""
    labels = [str(label) for label in found.ground.baseline.board.setups[0].labels]
    wanted = {labels[i] for i in np.flatnonzero((hat(found) > 0.9) | (hat(found, *modes) > 0.9))}
    told = find_carrying_modes(found, index)
    assert {one.label for one in told} == wanted
    assert {labels[mode] for mode in modes} <= wanted
    by_label = {one.label: one for one in told}
    for mode, name in zip(modes, {1: "a", 2: "b", 3: "ab"}.get(index, ""), strict=True):
        assert by_label[labels[mode]].carries == name
        assert by_label[labels[mode]].leverage == pytest.approx(hat(found, *modes)[mode], abs=2e-3)  # width of a cell
