"""Weights of a plate's Gauss points: fields of degree three, cuts of an outline, strips, their order."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from bayesplate.plate.fields import EdgeStrip, Fabric, term_field_pairs, weights_within
from bayesplate.plate.line import N_POINTS_CUT, line

FREE = ("free", "free")
X, Y = line(FREE, 7, is_split=False, n_points=N_POINTS_CUT), line(FREE, 5, is_split=False, n_points=N_POINTS_CUT)
LOW, HIGH = Polynomial([0.05, 0.0, 0.2]), Polynomial([0.97, -0.25])
INNER = Polynomial([0.9, -0.25])


def narrowing(x):
    """Cuts through several elements across the plate, and leaves the last one empty over a part of its length."""
    return LOW(x), HIGH(x)


def narrower(x):
    return LOW(x), INNER(x)


def integral(weights, i, j, x=X, y=Y):
    """Of x^i y^j."""
    return x.points**i @ weights @ y.points**j


def by_hand(low, high, i, j):
    """The same between two polynomials in x."""
    inner = (high ** (j + 1) - low ** (j + 1)) / (j + 1) * Polynomial.basis(i)
    return inner.integ()(1.0)


@pytest.mark.parametrize(("i", "j"), [(0, 0), (2, 3)])
def test_a_field_of_degree_three_is_integrated_exactly(i, j):
    """Together with the products of two cubics; the next degree of each is not."""
    x, y = line(FREE, 1), line(FREE, 1)
    weights = weights_within(x, y, factor=lambda x, y: x**i * y**j)

    assert integral(weights, 6, 6, x, y) == pytest.approx(1.0 / (7 + i) / (7 + j), rel=1e-12)
    assert abs(integral(weights, 10 - i, 0, x, y) * 11.0 * (1 + j) - 1.0) > 1e-9


def test_across_a_cut_the_products_of_two_cubics_are_exact_and_no_higher_degree():
    """At each point along x alone: limits to the powers one to seven."""
    weights = weights_within(X, Y, narrowing) / X.weights[:, None]
    for j in range(8):
        expected = (HIGH(X.points) ** (j + 1) - LOW(X.points) ** (j + 1)) / (j + 1)
        is_exact = np.abs(weights @ Y.points**j - expected).max() < 1e-13
        assert is_exact == (j < 7)


@pytest.mark.parametrize("is_split", [(True, False), (False, True)])
def test_half_a_side_holds_the_integral_of_the_whole(is_split):
    """Within an outline that is alike on both sides of both middles."""

    def barrel(x):
        return 0.2 * (2.0 * x - 1.0) ** 2, 1.0 - 0.2 * (2.0 * x - 1.0) ** 2

    x, y = (line(FREE, 6, is_split=one, n_points=N_POINTS_CUT) for one in is_split)

    assert weights_within(x, y, barrel).sum() == pytest.approx(1.0 - 0.4 / 3.0, rel=1e-12)


def test_a_strip_is_what_a_narrower_outline_leaves():
    """Without an outline there is nothing that it lies along."""
    fields = {"mass": [None, EdgeStrip(narrower), EdgeStrip(narrower, lambda x, y: y)]}

    _, strip, moment = Fabric(fields, narrowing).weights(["mass"], X, Y)["mass"]

    assert integral(strip, 0, 0) == pytest.approx(by_hand(INNER, HIGH, 0, 0), rel=1e-12)
    assert integral(strip, 1, 0) == pytest.approx(by_hand(INNER, HIGH, 1, 0), rel=1e-12)
    assert integral(moment, 0, 0) == pytest.approx(by_hand(INNER, HIGH, 0, 1), rel=1e-12)
    with pytest.raises(ValueError, match="wanted an outline"):
        Fabric(fields).weights(["mass"], X, Y)


def test_terms_take_their_first_fields_first():
    """Two terms of three fields and one of one: as the weights of a system are laid out."""
    own = term_field_pairs(("along", "bending", "bending"), {"along": 1, "bending": 3})

    assert own == [(0, 0), (1, 0), (2, 0), (1, 1), (2, 1), (1, 2), (2, 2)]
