"""Properties that vary over the plate: the weights of its Gauss points in integrals of fields within outlines.

Where an outline cuts an element, the part inside is integrated by Gauss points of its own. The product of two cubics is
of degree six, so that any weights within an element can be replaced by seven equivalent ones: they are moved to the
seven Gauss points of the whole element, and every integral over the plate is a sum over the same points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.plate.line import N_POINTS_CUT, Line

Field = Callable[[Floats, Floats], Floats]
"""A factor over the unit square: of points x and y, arrays that broadcast, to an array of their common shape."""

Outline = Callable[[Floats], tuple[Floats, Floats]]
"""Where the plate begins and ends along y, as fractions of its widest width, at points x of [0, 1]."""


@dataclass(frozen=True)
class EdgeStrip:
    """A field on the strip between the plate's outline and a narrower one, and nowhere else."""

    inner: Outline  # nowhere beyond the plate's own
    field: Field | None = None  # None: uniform


TermGroup = Literal["along", "bending", "shear", "mass", "rotary"]
"""Terms of a plate that take the same field; "along" is the bending that the modulus along the grain resists."""

_GHOST_SHARE: dict[TermGroup, float] = {"along": 1e-5, "bending": 1e-5, "shear": 1e-5, "mass": 1e-8, "rotary": 1e-8}
"""Share of the plate's properties that stays outside its outline: too soft to carry anything, and far lighter still."""


@dataclass(frozen=True, eq=False)
class Fabric:
    """How the plate's own properties spread over it, and whether its grain runs at an angle."""

    # fields of each group of terms, each with a weight of its own (None: uniform); a group that is absent is uniform
    fields: Mapping[TermGroup, Sequence[Field | EdgeStrip | None]] = field(default_factory=dict)
    outline: Outline | None = None
    is_turned: bool = False  # terms that couple bending and twist, and the two shear strains, join the plate's own

    def weights(self, groups: Iterable[TermGroup], x: Line, y: Line) -> dict[TermGroup, list[Floats]]:
        """Weights of the plate's Gauss points for each field of each group: (n_x, n_y) arrays.

        The plate outside its outline belongs to the first field, whose weight is positive; others may be negative.
        """
        keys_by_group = {
            group: [
                (factor, _GHOST_SHARE[group] if k == 0 else 0.0)
                for k, factor in enumerate(self.fields.get(group, (None,)))
            ]
            for group in groups
        }
        grids = {key: self._weights(*key, x, y) for key in {key for keys in keys_by_group.values() for key in keys}}
        return {group: [grids[key] for key in keys] for group, keys in keys_by_group.items()}

    def _weights(self, factor: Field | EdgeStrip | None, ghost: float, x: Line, y: Line) -> Floats:
        if isinstance(factor, EdgeStrip):
            if self.outline is None:
                raise ValueError("fields: wanted an outline that a strip lies along, got none")
            return weights_within(x, y, self.outline, factor.field) - weights_within(x, y, factor.inner, factor.field)
        inside = weights_within(x, y, self.outline, factor)
        if self.outline is None or not ghost:
            return inside
        return (1.0 - ghost) * inside + ghost * weights_within(x, y)


UNIFORM = Fabric()
"""The same properties everywhere, the grain along x."""


def term_field_pairs(groups: Sequence[TermGroup], counts: Mapping[TermGroup, int]) -> list[tuple[int, int]]:
    """Pairs of a term's index and the index of one of its fields: all terms with their first field come first.

    `groups` holds the group of each of the plate's own terms, `counts` the number of fields of each group.
    """
    n_fields = max(counts[group] for group in groups)
    return [(term, k) for k in range(n_fields) for term, group in enumerate(groups) if k < counts[group]]


def weights_within(x: Line, y: Line, outline: Outline | None = None, factor: Field | None = None) -> Floats:
    """Weights of the plate's Gauss points, (n_x, n_y), in integrals of a field (None: uniform) within an outline."""
    if outline is None:
        uniform = np.outer(x.weights, y.weights)
        return uniform if factor is None else uniform * factor(x.points[:, None], y.points)
    low, high = (limit[:, None] for limit in outline(x.points))
    starts = np.clip(y.nodes[:-1], low, high)
    lengths = np.clip(y.nodes[1:], low, high) - starts
    points, weights = _gauss_rule()
    cut_points = starts[..., None] + lengths[..., None] * points
    across = lengths[..., None] * weights
    if factor is not None:
        across = across * factor(x.points[:, None, None], cut_points)
    element_lengths = np.diff(y.nodes)[:, None]
    element_weights = _to_gauss_points((cut_points - y.nodes[:-1, None]) / element_lengths, across)
    return np.asarray(x.weights[:, None] * y.share * element_weights.reshape(x.points.size, -1))


def _gauss_rule() -> tuple[Floats, Floats]:
    """Gauss points and weights on [0, 1] of lines that an outline cuts."""
    from skfem.quadrature import get_quadrature
    from skfem.refdom import RefLine

    points, weights = get_quadrature(RefLine, 2 * N_POINTS_CUT - 1)
    return points[0], weights


def _to_gauss_points(t: Floats, weights: Floats) -> Floats:
    """Weights at the Gauss points of an element that integrate polynomials of degree six as `weights` at t do."""
    from numpy.polynomial.legendre import legvander

    degrees = np.arange(N_POINTS_CUT)
    points, gauss_weights = _gauss_rule()
    moments = np.einsum("...g,...gn->...n", weights, legvander(2.0 * t - 1.0, degrees[-1]))
    return np.asarray(gauss_weights * ((2 * degrees + 1) * moments @ legvander(2.0 * points - 1.0, degrees[-1]).T))
