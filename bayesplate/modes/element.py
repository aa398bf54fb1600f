"""The cubic Hermite line element: scikit-fem's four functions and Gauss points, and what is integrated with them.

scikit-fem makes its Hermite functions of powers of the coordinate along the whole line, and on a short element far from
the origin these cancel: half the digits are gone at a hundredth of the length. So the functions are evaluated on the
element from 0 to 1, where their coefficients are whole numbers, and scaled to size.

The unknowns of an element are value and slope at its start, value and slope at its end.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

Products = Mapping[tuple[int, int], Floats]
"""Integrals of products of derivatives over a line, by the orders (i, j) of the two, from 0 to 2: matrices whose row is
the function that is differentiated i times, whose column the one that is differentiated j times."""

ORDERS = tuple((i, j) for i in range(3) for j in range(3))

_POWERS = np.array([[is_slope - order for is_slope in (0, 1, 0, 1)] for order in range(3)])
"""How each derivative of each function goes with the element's length: on a longer one a unit slope rises higher, and a
derivative is taken over a longer way."""


@lru_cache(maxsize=8)
def gauss_rule(n_points: int) -> tuple[Floats, Floats]:
    """Gauss points and weights on [0, 1]: exact for polynomials of degree 2 n_points - 1."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefLine

    points, weights = get_quadrature(RefLine, 2 * n_points - 1)
    return points[0], weights


def gauss_points(starts: Floats, lengths: Floats, n_points: int) -> tuple[Floats, Floats]:
    """Gauss points and weights of elements, on one axis more than their starts and lengths have."""
    points, weights = gauss_rule(n_points)
    return starts[..., None] + lengths[..., None] * points, lengths[..., None] * weights


@lru_cache(maxsize=1)
def _unit_element() -> tuple[Any, Any]:
    from skfem import ElementLineHermite, MappingAffine, MeshLine

    element, mapping = ElementLineHermite(), MappingAffine(MeshLine.init_tensor(np.array([0.0, 1.0])))
    element.gbasis(mapping, np.zeros((1, 1)), 0)  # it finds its powers at the first call, and other threads use it too
    return element, mapping


def hermite_functions(t: Floats, lengths: Floats) -> Floats:
    """The four functions of an element and their first and second derivatives.

    Parameters
    ----------
    t : array
        Points, as fractions of the element.
    lengths : array
        Of the element at each point; broadcasts with `t`.

    Returns
    -------
    (3, 4, ...) array
        By the order of the derivative and by the function.
    """
    element, mapping = _unit_element()
    fields = [element.gbasis(mapping, np.reshape(t, (1, -1)), i)[0] for i in range(4)]
    unit = np.array([[np.reshape(d, np.shape(t)) for d in (u, u.grad, u.hess)] for u in fields])
    return np.swapaxes(unit, 0, 1) * np.asarray(lengths) ** _POWERS.reshape(3, 4, *(1,) * np.ndim(t))


def element_products(nodes: Floats, points: Floats, weights: Floats) -> Floats:
    """Weighted sums over the points of each element of the products of its four functions' derivatives.

    Parameters
    ----------
    nodes : (n_elements + 1,) array
    points : (n_elements, n_points) array
    weights : (..., n_elements, n_points) array

    Returns
    -------
    (..., n_elements, 9, 4, 4) array
        By element, and by the orders of the two derivatives as in `ORDERS`.
    """
    lengths = np.diff(nodes)[:, None]
    functions = np.moveaxis(hermite_functions((points - nodes[:-1, None]) / lengths, lengths), 1, -1)
    both = np.stack([functions[i][..., None] * functions[j][..., None, :] for i, j in ORDERS], axis=-3)
    # Element by element one product of matrices for all weights.
    by_element = np.moveaxis(weights, -2, 0).reshape(len(points), -1, points.shape[-1])
    summed = by_element @ both.reshape(*points.shape, -1)
    return np.moveaxis(summed, 0, 1).reshape(*weights.shape[:-1], *both.shape[2:])


def moved_weights(t: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Weights at seven points of an element that sum the product of two cubics as given ones do at points elsewhere.

    Its degree is six, so that no more can be told of weights anywhere than seven numbers an element.

    Parameters
    ----------
    t : (..., n_points) array
        Points, as fractions of the element.
    weights : (..., n_points) array

    Returns
    -------
    points : (7,) array
        As fractions of the element.
    weights : (..., 7) array
    """
    from numpy.polynomial.legendre import legvander

    degrees = np.arange(7)
    points, own = gauss_rule(degrees.size)
    moments = np.einsum("...g,...gn->...n", weights, legvander(2.0 * t - 1.0, degrees[-1]))
    return points, own * ((2 * degrees + 1) * moments @ legvander(2.0 * points - 1.0, degrees[-1]).T)


def uniform_products(lengths: Floats) -> Floats:
    """Integrals over whole elements of given lengths: (n_elements, 9, 4, 4) array."""
    # The product of two cubics is of degree six.
    points, weights = gauss_rule(4)
    unit = element_products(np.array([0.0, 1.0]), points[None], weights[None])
    # Multiples of 1 / 420 all of them; rounded to these, neighbours cancel exactly and no rounding error is stored.
    unit = np.rint(420.0 * unit) / 420.0
    powers = np.stack([1 + _POWERS[i][:, None] + _POWERS[j] for i, j in ORDERS])
    return np.asarray(unit * lengths[:, None, None, None] ** powers)


@dataclass(frozen=True, eq=False)
class LineProducts(Products):
    """Integrals on the functions of the free line, of which the entries within elements are kept.

    Attributes
    ----------
    n_elements : int
    stored : (9, n_stored) array
        By the orders of the two derivatives as in `ORDERS`.
    """

    n_elements: int
    stored: Floats

    def __getitem__(self, orders: tuple[int, int]) -> Floats:
        """The matrix of two orders, (n_unknowns, n_unknowns)."""
        n = 2 * (self.n_elements + 1)
        matrix = np.zeros(n * n)
        matrix[line_places(self.n_elements)] = self.stored[ORDERS.index(orders)]
        return matrix.reshape(n, n)

    def __iter__(self) -> Iterator[tuple[int, int]]:
        return iter(ORDERS)

    def __len__(self) -> int:
        return len(ORDERS)

    def times(self, share: float) -> LineProducts:
        """So many times as much of each."""
        return LineProducts(self.n_elements, share * self.stored)


def assembled(local: Floats) -> LineProducts:
    """Element matrices (n_elements, 9, 4, 4) summed on the functions of the free line."""
    return each_assembled(local[None])[0]


def each_assembled(local: Floats) -> list[LineProducts]:
    """The same of each of (n, n_elements, 9, 4, 4)."""
    n_elements = local.shape[1]
    places, stored_at = _line_pattern(n_elements)
    values = np.moveaxis(local, 2, 1).reshape(-1, stored_at.size)
    at = np.arange(len(values))[:, None] * places.size + stored_at
    stored: Floats = np.bincount(at.ravel(), values.ravel(), len(values) * places.size).astype(np.float64)
    return [LineProducts(n_elements, one) for one in stored.reshape(-1, len(ORDERS), places.size)]


def line_places(n_elements: int) -> NDArray[np.intp]:
    """Places of a line's matrices, row by row, that hold anything: (n_stored,) array."""
    return _line_pattern(n_elements)[0]


@lru_cache(maxsize=32)
def _line_pattern(n_elements: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Places of a line's matrices that hold anything, and which of these each entry of its element matrices has."""
    unknowns = 2 * np.arange(n_elements)[:, None] + np.arange(4)
    places = (np.repeat(unknowns, 4, axis=1) * 2 * (n_elements + 1) + np.tile(unknowns, 4)).ravel()
    kept, stored_at = np.unique(places, return_inverse=True)
    return kept, stored_at


def function_values(nodes: Floats, points: Floats) -> Any:
    """Values of all functions of the free line at points of it: (n_points, n_unknowns) sparse array."""
    from scipy.sparse import coo_array

    element = np.clip(np.searchsorted(nodes, points, side="right") - 1, 0, nodes.size - 2)
    lengths = np.diff(nodes)[element]
    values = hermite_functions((points - nodes[element]) / lengths, lengths)[0]
    rows = np.broadcast_to(np.arange(points.size), values.shape)
    columns = 2 * element + np.arange(4)[:, None]
    shape = (points.size, 2 * nodes.size)
    return coo_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape).tocsr()
