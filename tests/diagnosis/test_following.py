"""Modes followed by their shapes: at a crossing the shape decides, within a class the order, no plate is no number."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.diagnosis.laws import FollowedShapes
from bayesplate.plate.reduced import ReducedClass
from bayesplate.plate.terms import Parity, Weights

N = 8
RAISED = 1
"""The mode whose stiffness the second term raises."""


def modes() -> ReducedClass:
    """Modes at 1, 4, 9, ... s^-2, and a term that raises one of them alone."""
    raising = np.zeros((N, N))
    raising[RAISED, RAISED] = 1.0
    stiffness = np.stack([np.diag(np.arange(1.0, N + 1.0) ** 2), raising])
    mass, nothing = np.eye(N)[None], np.zeros((1, N, N))
    return ReducedClass(Parity(0, 0), stiffness, mass, N, (), np.empty((N, 0)), np.eye(N), nothing)


@pytest.mark.parametrize(
    ("groups", "crossed"),
    [
        ((), [1.0, 11.0, 9.0]),  # a mode that crosses another is found by its shape
        (((1, 2),), [1.0, 9.0, 11.0]),  # within a class the lower reading is the lower mode
    ],
)
def test_a_mode_is_followed_at_the_plate_itself_beyond_a_crossing_and_at_no_plate(groups, crossed):
    without = Weights(np.array([[1.0, 0.0]]), np.array([[1.0]]))
    following = FollowedShapes.of(modes(), without, np.array((0, 1, 2)), tuple(np.array(group) for group in groups))
    found = following.eigenvalues(Weights(np.array([[1.0, 0.0], [1.0, 7.0], [-9.0, 0.0]]), np.ones((3, 1))))
    np.testing.assert_allclose(found[:2], [[1.0, 4.0, 9.0], crossed], rtol=1e-12)
    assert np.isnan(found[2]).all()
