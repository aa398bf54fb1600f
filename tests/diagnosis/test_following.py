"""Modes followed by their shapes: at a crossing the shape decides, within a class the order, no plate is no number."""

from __future__ import annotations

import numpy as np

from bayesplate.diagnosis.laws import Following
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


def followed(*groups: tuple[int, ...], wanted: tuple[int, ...] = (0, 1, 2)) -> np.ndarray:
    """At the plate itself, where the raised mode has crossed the next one, and at no plate."""
    without = Weights(np.array([[1.0, 0.0]]), np.array([[1.0]]))
    following = Following.of(modes(), without, np.array(wanted), tuple(np.array(group) for group in groups))
    return following.eigenvalues(Weights(np.array([[1.0, 0.0], [1.0, 7.0], [-9.0, 0.0]]), np.ones((3, 1))))


def test_a_mode_that_crosses_another_is_found_by_its_shape():
    found = followed()
    np.testing.assert_allclose(found[:2], [[1.0, 4.0, 9.0], [1.0, 11.0, 9.0]], rtol=1e-12)
    assert np.isnan(found[2]).all()


def test_within_a_class_the_lower_reading_is_the_lower_mode():
    found = followed((1, 2))
    np.testing.assert_allclose(found[:2], [[1.0, 4.0, 9.0], [1.0, 9.0, 11.0]], rtol=1e-12)
    assert np.isnan(found[2]).all()
