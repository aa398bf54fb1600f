"""The matrices of a plate whose properties vary within an outline, against plain sums over points of it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from bayesplate.modes.element import gauss_points, hermite_functions
from bayesplate.modes.energies import assembled_plate
from bayesplate.modes.fields import Fabric, layout
from bayesplate.modes.line import line
from bayesplate.modes.plate import EdgeTurn
from bayesplate.modes.shear import SHEAR_FLEXIBLE
from bayesplate.modes.thin import THIN, within_outline

FREE = ("free", "free")
GROUPS = ("along", "bending", "shear", "mass", "rotary")

# By field: factor, unknowns, derivatives along x and y. A thin plate has the deflection alone.
BEND_X = ((1.0, "w", 2, 0), (-1.0, "g_x", 1, 0))
BEND_Y = ((1.0, "w", 0, 2), (-1.0, "g_y", 0, 1))
TWIST = ((1.0, "w", 1, 1), (-0.5, "g_x", 0, 1), (-0.5, "g_y", 1, 0))
SHEAR_X, SHEAR_Y = ((1.0, "g_x", 0, 0),), ((1.0, "g_y", 0, 0),)
TURN_X = ((1.0, "w", 1, 0), (-1.0, "g_x", 0, 0))
TURN_Y = ((1.0, "w", 0, 1), (-1.0, "g_y", 0, 0))
DEFLECTION = ((1.0, "w", 0, 0),)
# Times two where two strains differ, as in 2 w_xx w_yy and 4 w_xx w_xy.
BENDING = [(1, BEND_X, BEND_X), (1, BEND_Y, BEND_Y), (2, BEND_X, BEND_Y), (1, TWIST, TWIST)]
COUPLING = [(4, BEND_X, TWIST), (4, BEND_Y, TWIST)]
SHEARS = [(1, SHEAR_X, SHEAR_X), (1, SHEAR_Y, SHEAR_Y)]
MASS, ROTARY = (1, DEFLECTION, DEFLECTION), [(1, TURN_X, TURN_X), (1, TURN_Y, TURN_Y)]


def bump(x, y):
    return np.exp(x * y) + 0.3 * np.sin(3.0 * x + y)


def ripple(x, y):
    return np.cos(2.0 * x - 3.0 * y)


def narrowing(x):
    """Cuts through several elements across the plate, and leaves the last one empty over a part of its length."""
    return 0.05 + 0.2 * x**2, 0.97 - 0.25 * x


def derivatives(side, points):
    """Of all functions of a free line at points: (3, n_points, n_unknowns) array."""
    element = np.clip(np.searchsorted(side.nodes, points) - 1, 0, side.n_elements - 1)
    lengths = np.diff(side.nodes)[element]
    found = np.zeros((3, points.size, 2 * side.nodes.size))
    local = hermite_functions((points - side.nodes[element]) / lengths, lengths)
    for i in range(4):
        found[:, np.arange(points.size), 2 * element + i] = local[:, i]
    return found


class Sums:
    """Sums of products of strains over weighted points, one by one."""

    def __init__(self, x, y, names):
        self.x, self.y, self.names = x, y, names

    def strain(self, terms, at_x, at_y):
        along, across = derivatives(self.x, at_x), derivatives(self.y, at_y)
        n = along.shape[2] * across.shape[2]
        found = np.zeros((at_x.size, len(self.names), n))
        for factor, name, i, j in terms:
            if name in self.names:
                both = along[i][:, :, None] * across[j][:, None, :]
                found[:, self.names.index(name)] += factor * both.reshape(-1, n)
        return found.reshape(at_x.size, -1)

    def integral(self, factor, first, second, at_x, at_y, weights):
        one, other = (self.strain(terms, at_x, at_y) for terms in (first, second))
        product = factor * one.T @ (weights[:, None] * other)
        return (product + product.T) / 2.0


def points_within(x, y, outline):
    """Gauss points of all elements, cut at the outline across the plate, and their weights."""
    found = []
    for at_x, ahead in zip(*(one.ravel() for one in gauss_points(x.nodes[:-1], np.diff(x.nodes), 6)), strict=True):
        low, high = (0.0, 1.0) if outline is None else (float(limit) for limit in outline(at_x))
        for start, end in zip(y.nodes[:-1], y.nodes[1:], strict=True):
            start, end = np.clip([start, end], low, high)
            at_y, across = gauss_points(np.array(start), np.array(end - start), 6)
            found.append(np.stack([np.full(6, at_x), at_y, ahead * across]))
    return np.concatenate(found, axis=1)


@pytest.mark.parametrize("outline", [None, narrowing], ids=["rectangle", "outline"])
@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
def test_terms_are_sums_over_points(is_sheared, outline):
    """Two fields of each group, grain at an angle, and every kind of further term: as many matrices, all symmetric."""
    x, y = (line(FREE, n, is_sheared, is_split=False) for n in (7, 5))
    field = {group: [None, bump] for group in GROUPS} | {"mass": [None, bump, ripple]}
    fabric = Fabric(fields=field, outline=outline, is_turned=True)
    further = within_outline(x, y, (0, 0), (0, 0), outline), EdgeTurn(0, (True, False)), EdgeTurn(1, (True, True))
    # A mass at one place, and one that couples unknowns far from one another.
    rows = (x.shapes(np.array([0.3])), y.shapes(np.array([0.8])) - y.shapes(np.array([0.1])))
    at_a_place = tuple(csr_array(row.T @ row) for row in rows)
    plate = assembled_plate(SHEAR_FLEXIBLE if is_sheared else THIN, x, y, further, ((at_a_place,),), fabric)
    (block,) = plate.blocks

    sums = Sums(x, y, ["w", "g_x", "g_y"] if is_sheared else ["w"])
    at_x, at_y, weights = points_within(x, y, outline)
    whole = points_within(x, y, None)

    def own(term, group, factor, ghost):
        values = 1.0 if factor is None else factor(at_x, at_y)
        inside = sums.integral(*term, at_x, at_y, values * weights)
        if outline is None or factor is not None:
            return inside
        return (1.0 - ghost) * inside + ghost * sums.integral(*term, *whole)

    terms = [*BENDING, *SHEARS, *COUPLING, (2, SHEAR_X, SHEAR_Y)] if is_sheared else [*BENDING, *COUPLING]
    groups = (SHEAR_FLEXIBLE if is_sheared else THIN).groups(True)
    counts = {group: len(one) for group, one in field.items()}
    expected = [own(terms[i], groups[0][i], field[groups[0][i]][k], 1e-5) for i, k in layout(groups[0], counts)]
    expected.append(sums.integral(1, DEFLECTION, DEFLECTION, at_x, at_y, weights))
    along, across = (np.stack([one.ravel() for one in gauss_points(s.nodes[:-1], np.diff(s.nodes), 6)]) for s in (x, y))
    expected.append(sums.integral(1, TURN_X, TURN_X, np.zeros_like(across[0]), *across))
    expected.append(
        sum(sums.integral(1, TURN_Y, TURN_Y, along[0], np.full_like(along[0], end), along[1]) for end in (0.0, 1.0))
    )
    masses = [MASS, *(ROTARY if is_sheared else [])]
    inert = [own(masses[i], groups[1][i], field[groups[1][i]][k], 1e-8) for i, k in layout(groups[1], counts)]
    place = np.zeros_like(inert[0])
    n = x.n_dof * y.n_dof
    place[:n, :n] = np.kron(*(one.toarray() for one in at_a_place))
    inert.append(place)

    for found, wanted in ((block.terms, expected), (block.masses, inert)):
        assert len(found) == len(wanted)
        for values, matrix in zip(found, wanted, strict=True):
            np.testing.assert_allclose(
                block.matrix(values).toarray(), matrix, rtol=0, atol=1e-10 * np.abs(matrix).max()
            )
