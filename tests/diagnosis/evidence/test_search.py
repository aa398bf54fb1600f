"""What the search does with a candidate that has no plate at the ends of its range."""

from __future__ import annotations

import numpy as np

from bayesplate.diagnosis.evidence.search import prepare_search
from bayesplate.diagnosis.shifts.baseline import baseline_of
from bayesplate.diagnosis.shifts.laws import form_law
from bayesplate.posterior.inference import pose
from bayesplate.workflow.prepare import prepare


def test_a_candidate_without_a_plate_is_not_tried_and_the_others_are():
    card = prepare("fiemme-spruce-clamped")
    baseline = baseline_of(pose(card.board, card.prior))

    def solve(at, form):
        if form.effect == "membrane_tension":
            raise np.linalg.LinAlgError
        return form_law(at, form)

    ground = prepare_search(baseline, solve, tried=("membrane_tension", "air_loading"))

    assert list(ground.candidates) == ["air_loading"]
    assert not any("membrane_tension" in one.members for one in ground.hypotheses)
    assert any("air_loading" in one.members for one in ground.hypotheses)
