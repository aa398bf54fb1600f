"""The Hermite element: its functions and their derivatives, Gauss points, digits far from the origin, loads."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.modes.element import (
    _unit_element,
    assembled,
    element_products,
    function_values,
    gauss_points,
    gauss_rule,
    hermite_functions,
    moved_weights,
)
from bayesplate.modes.hermite import products
from bayesplate.modes.line import line

BENDING = np.array([[12.0, 6.0, -12.0, 6.0], [6.0, 4.0, -6.0, 2.0], [-12.0, -6.0, 12.0, -6.0], [6.0, 2.0, -6.0, 4.0]])
"""Stiffness of a beam of unit length and unit flexural rigidity, of every handbook."""
SHORT = tuple(np.linspace(0.0, 1.0, 101))


@pytest.mark.parametrize("order", range(3))
@pytest.mark.parametrize("length", [1.0, 0.01, 3.0])
def test_functions_reproduce_a_cubic_and_its_derivatives(order, length):
    cubic = np.polynomial.Polynomial([0.3, -1.0, 2.0, 5.0])
    slope = cubic.deriv()
    t = np.array([[0.0, 0.2], [0.7, 1.0]])

    found = np.tensordot([cubic(0), slope(0), cubic(length), slope(length)], hermite_functions(t, length)[order], 1)

    # The cubic is of order one, its terms on the element as large as length^-order.
    np.testing.assert_allclose(found, cubic.deriv(order)(length * t), atol=1e-14 * max(1.0, length**-order) * 40)


def test_an_element_is_whole_before_another_thread_may_have_it():
    """scikit-fem finds the powers of an element at its first call, in places: half of that is another element."""
    _unit_element.cache_clear()
    element, _ = _unit_element()
    before = element._pbasis

    hermite_functions(np.array([0.3]), 1.0)

    assert element.V is not None
    assert element._pbasis is before


@pytest.mark.parametrize("n_points", [2, 4, 6])
def test_gauss_points_are_exact_to_their_degree_and_no_further(n_points):
    points, weights = gauss_points(np.array([0.0, 0.5]), np.array([0.5, 1.5]), n_points)

    def error(degree):
        return abs((weights * points**degree).sum() / (2.0 ** (degree + 1) / (degree + 1)) - 1.0)

    assert gauss_rule(n_points)[0].size == n_points
    assert error(2 * n_points - 1) < 1e-14
    assert error(2 * n_points) > 1e-8


def test_short_element_far_from_the_origin_keeps_its_digits():
    """The negative control: scikit-fem assembled in place keeps ten."""
    from skfem import Basis, BilinearForm, ElementLineHermite, MeshLine

    scales = np.array([1.0, 0.01, 1.0, 0.01])
    by_hand = 1e6 * scales[:, None] * BENDING * scales
    in_place = BilinearForm(lambda u, v, _: u.hess[0][0] * v.hess[0][0]).assemble(
        Basis(MeshLine.init_tensor(np.array(SHORT)), ElementLineHermite(), intorder=6)
    )

    def error(matrix):
        last = matrix[-4:, -4:]
        return np.abs(last - by_hand)[:, 2:].max() / 12e6

    # The ends of the element are rounded to 1e-16, its length of 0.01 to 1e-14.
    assert np.abs(products(SHORT)[2, 2][-2:, -2:] / by_hand[-2:, -2:] - 1.0).max() < 1e-12
    assert error(in_place) > 1e-11


@pytest.mark.parametrize("n_elements", [1, 7])
def test_products_are_those_of_gauss_points_on_each_element(n_elements):
    """Scaled integrals of the unit element, rounded to what they are exactly, against points of every element."""
    nodes = np.linspace(0.0, 1.0, n_elements + 1) ** 2
    direct = assembled(element_products(nodes, *gauss_points(nodes[:-1], np.diff(nodes), 4)))

    for orders, matrix in products(tuple(nodes)).items():
        expected = direct[orders]
        np.testing.assert_allclose(matrix, expected, rtol=1e-10, atol=1e-13 * np.abs(expected).max())


def test_moved_weights_sum_products_of_cubics_and_nothing_of_higher_degree():
    """Points in a corner of the element, of which some weights are negative."""
    rng = np.random.default_rng(3)
    t, weights = 0.9 + 0.1 * rng.uniform(size=(2, 5, 9)), rng.standard_normal((2, 5, 9))
    points, moved = moved_weights(t, weights)

    for degree in range(8):
        wanted = (weights * t**degree).sum(axis=-1)
        error = np.abs((moved * points**degree).sum(axis=-1) - wanted).max()
        assert (error < 1e-13) == (degree < 7)


def test_neighbours_cancel_exactly():
    """The value at a node against its own derivative: half from the left, half from the right, against each other."""
    product = products(SHORT)[0, 1]

    np.testing.assert_array_equal(product.diagonal()[2:-2], 0.0)


def test_values_at_nodes_are_the_unknowns():
    nodes = np.array([0.0, 0.1, 0.5, 1.0])

    np.testing.assert_allclose(function_values(nodes, nodes).toarray(), np.eye(8)[::2], atol=1e-15)


def test_load_vector_integrates_a_cubic():
    free = line(("free", "free"), 3)
    cube = free.interpolate(lambda x: x**3, lambda x: 3 * x**2)

    assert free.integrals @ cube == pytest.approx(1 / 4, rel=1e-13)
    held = line(("clamped", "free"), 3)
    np.testing.assert_array_equal(held.integrals, free.integrals[2:])
