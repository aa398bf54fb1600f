"""Properties that vary over the plate: integrals weighted with a field, over the rectangle or a narrower outline.

A field f(x, y) and an outline make a `Measure`: the integral of f times a product of derivatives, as a short sum of
products of one matrix along x and one along y. Singular values tell how short: a field that is a product costs one,
a smooth one a few.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.element import LineProducts, each_assembled, element_products, gauss_points, moved_weights
from bayesplate.modes.hermite import products
from bayesplate.modes.line import Line

Floats = NDArray[np.float64]

Field = Callable[[Floats, Floats], Floats]
"""A factor over the unit square: of points x and y, arrays that broadcast, to an array of their common shape.

Fields that are equal are integrated once: a dataclass compares by what it holds, a function only with itself."""

Outline = Callable[[Floats], tuple[Floats, Floats]]
"""Where the plate begins and ends along y, as fractions of its widest width, at points x of [0, 1]."""


@dataclass(frozen=True)
class EdgeStrip:
    """A field on the strip between the plate's outline and a narrower one, and nowhere else.

    Attributes
    ----------
    inner : Outline
        Nowhere beyond the plate's own.
    field : Field or None
        None is uniform.
    """

    inner: Outline
    field: Field | None = None


Group = Literal["along", "bending", "shear", "mass", "rotary"]
"""Terms of a plate that take the same field; "along" is the bending that the modulus along the grain resists."""

Measure = tuple[tuple[LineProducts, LineProducts], ...]
"""Integrals along x and along y by orders of derivatives, on the functions of the free lines; summed over the pairs."""

Nodes = tuple[float, ...]

_N_KEPT = 128
"""Measures that are kept: candidates of a search share those of the fields that the board has anyway."""
_POINTS = 6
"""Gauss points per element: a product of two cubics with a field of degree five is exact."""
_NEGLIGIBLE = 1e-13

_GHOST: dict[Group, float] = {"along": 1e-5, "bending": 1e-5, "shear": 1e-5, "mass": 1e-8, "rotary": 1e-8}
"""What is left of the plate outside its outline: soft enough to carry nothing, far lighter still than it is soft."""


@dataclass(frozen=True, eq=False)
class Fabric:
    """How the plate's own properties spread over it, and whether its grain runs at an angle.

    Attributes
    ----------
    fields : mapping
        Fields that the terms of each group take, each with a weight of its own (None: uniform); absent: uniform alone.
    outline : Outline or None
    is_turned : bool
        Whether terms that couple bending and twist, and the two shear strains, join the plate's own.
    """

    fields: Mapping[Group, Sequence[Field | EdgeStrip | None]] = field(default_factory=dict)
    outline: Outline | None = None
    is_turned: bool = False

    def measures(self, groups: Iterable[Group], x: Line, y: Line) -> dict[Group, list[Measure]]:
        """The measures of each group's terms, in the order of its fields; a field of two groups is integrated once.

        The plate outside its outline belongs to the first field, whose weight is above zero; that of others may not be.
        """
        fields = {group: self.fields.get(group, (None,)) for group in groups}
        taken = {group: [(one, 0.0 if k else _GHOST[group]) for k, one in enumerate(fields[group])] for group in groups}
        made = {each: self._measure(*each, x, y) for each in {each for pairs in taken.values() for each in pairs}}
        return {group: [made[each] for each in pairs] for group, pairs in taken.items()}

    def inside(self, x: Line, y: Line) -> Measure:
        """The uniform measure of the plate itself, with nothing outside its outline."""
        return self._measure(None, 0.0, x, y)

    def _measure(self, factor: Field | EdgeStrip | None, ghost: float, x: Line, y: Line) -> Measure:
        nodes = tuple(x.nodes), tuple(y.nodes)
        if isinstance(factor, EdgeStrip):
            return self._strip(factor, *nodes)
        uniform = (products(nodes[0]), products(nodes[1]))
        if self.outline is not None:
            inside = _inside(*nodes, factor, self.outline)
            if not ghost:
                return inside
            rest = uniform[0].times(ghost), uniform[1]
            return (*((along_x.times(1.0 - ghost), along_y) for along_x, along_y in inside), rest)
        return (uniform,) if factor is None else _over_rectangle(*nodes, factor)

    def _strip(self, strip: EdgeStrip, nodes_x: Nodes, nodes_y: Nodes) -> Measure:
        if self.outline is None:
            raise ValueError("fields: wanted an outline that a strip lies along, got none")
        both = ((1.0, self.outline), (-1.0, strip.inner))
        inside = ((sign, _inside(nodes_x, nodes_y, strip.field, outline)) for sign, outline in both)
        return tuple((along_x.times(sign), along_y) for sign, measure in inside for along_x, along_y in measure)


UNIFORM = Fabric()
"""The same properties everywhere, the grain along x."""


def layout(groups: Sequence[Group], counts: Mapping[Group, int]) -> list[tuple[int, int]]:
    """Which of the plate's own terms takes which field: every term with its first field first, then with the others.

    Parameters
    ----------
    groups : sequence of str
        Group of each of the plate's own terms.
    counts : mapping
        Number of fields of each group.

    Returns
    -------
    list of (int, int)
        Index of the term and of the field.
    """
    most = max(counts[group] for group in groups)
    return [(term, k) for k in range(most) for term, group in enumerate(groups) if k < counts[group]]


@lru_cache(maxsize=_N_KEPT)
def _over_rectangle(nodes_x: Nodes, nodes_y: Nodes, factor: Field) -> Measure:
    """Integrals of a field: a sum of products, one for each singular value of the field that counts."""
    x, y = np.array(nodes_x), np.array(nodes_y)
    (at_x, ahead), (at_y, across) = (gauss_points(nodes[:-1], np.diff(nodes), _POINTS) for nodes in (x, y))
    left, right = _products_of(factor(at_x.reshape(-1, 1), at_y.ravel()))
    along_x = element_products(x, at_x, ahead * left.reshape(-1, *at_x.shape))
    along_y = element_products(y, at_y, across * right.reshape(-1, *at_y.shape))
    return tuple(zip(each_assembled(along_x), each_assembled(along_y), strict=True))


@lru_cache(maxsize=_N_KEPT)
def _inside(nodes_x: Nodes, nodes_y: Nodes, factor: Field | None, outline: Outline) -> Measure:
    """Integrals of a field within an outline, from the integrals across the plate at every point along it."""
    x, y = np.array(nodes_x), np.array(nodes_y)
    at_x, ahead = gauss_points(x[:-1], np.diff(x), _POINTS)
    low, high = (limit[..., None] for limit in outline(at_x))
    # Elements across the plate, cut at its outline: (elements along x, points, elements across).
    starts = np.clip(y[:-1], low, high)
    at_y, across = gauss_points(starts, np.clip(y[1:], low, high) - starts, _POINTS)
    if factor is not None:
        across = across * factor(at_x[..., None, None], at_y)
    lengths = np.diff(y)[:, None]
    points, moved = moved_weights((at_y - y[:-1, None]) / lengths, across)
    # Every element counts alike: what an outline leaves of a small one is small, and must not drown in rounding.
    scales = np.abs(moved).max(axis=(0, 1, 3))[:, None]
    scales[scales == 0.0] = 1.0
    left, right = _products_of((moved / scales).reshape(at_x.size, -1))
    along_x = element_products(x, at_x, ahead * left.reshape(-1, *at_x.shape))
    along_y = element_products(y, y[:-1, None] + lengths * points, scales * right.reshape(-1, *moved.shape[2:]))
    return tuple(zip(each_assembled(along_x), each_assembled(along_y), strict=True))


def _products_of(matrix: Floats) -> tuple[Floats, Floats]:
    """A matrix as a sum of products of a column and a row, as many as singular values count: both a row for each."""
    # The columns are those of the triangle alone, which is small where there are many more points across than along.
    columns, values, _ = np.linalg.svd(np.asarray(np.linalg.qr(matrix.T, mode="r")).T, full_matrices=False)
    left = columns[:, values > _NEGLIGIBLE * values[0]].T
    return left, left @ matrix
