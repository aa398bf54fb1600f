"""The terms of a plate against plain sums over points of it, and against closed forms of loaded and sprung beams."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from bayesplate.plate.fields import Fabric, term_field_pairs
from bayesplate.plate.line import N_POINTS_CUT, line
from bayesplate.plate.plate import plate_of
from bayesplate.plate.shear import SHEAR_FLEXIBLE
from bayesplate.plate.solve import solve
from bayesplate.plate.terms import EdgeTerm, PlateTerm, PointMotion, PointTerm, Weights
from bayesplate.plate.thin import THIN

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
    """Cuts through two elements at either edge, and leaves the outer ones empty over a part of their length."""
    return 0.05 + 0.3 * x**2, 0.97 - 0.3 * x


def gauss(starts, lengths, n):
    """Points and weights of each of some intervals: (n_intervals, n) arrays."""
    at, weights = np.polynomial.legendre.leggauss(n)
    return starts[:, None] + lengths[:, None] * (at + 1.0) / 2.0, lengths[:, None] * weights / 2.0


def cubics(t, h):
    """The four cubics of an element of length h and their derivatives at shares t of it: (3, 4, n_points) array."""
    values = [1 - 3 * t**2 + 2 * t**3, h * (t - 2 * t**2 + t**3), 3 * t**2 - 2 * t**3, h * (t**3 - t**2)]
    slopes = [(6 * t**2 - 6 * t) / h, 1 - 4 * t + 3 * t**2, (6 * t - 6 * t**2) / h, 3 * t**2 - 2 * t]
    bends = [(12 * t - 6) / h**2, (6 * t - 4) / h, (6 - 12 * t) / h**2, (6 * t - 2) / h]
    return np.array([values, slopes, bends])


def derivatives(nodes, points):
    """Of all functions of a free line at points: (3, n_points, n_unknowns) array."""
    element = np.clip(np.searchsorted(nodes, points) - 1, 0, nodes.size - 2)
    lengths = np.diff(nodes)[element]
    found = np.zeros((3, points.size, 2 * nodes.size))
    local = cubics((points - nodes[element]) / lengths, lengths)
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
    """The plate's points along x, and for each all elements across, cut at the outline; with their weights."""
    found = []
    for at_x, ahead in zip(*(one.ravel() for one in gauss(x[:-1], np.diff(x), N_POINTS_CUT)), strict=True):
        low, high = (0.0, 1.0) if outline is None else (float(limit) for limit in outline(at_x))
        cuts = np.clip(y, low, high)
        at_y, across = (one.ravel() for one in gauss(cuts[:-1], np.diff(cuts), N_POINTS_CUT))
        found.append(np.stack([np.full(at_y.size, at_x), at_y, ahead * across]))
    return np.concatenate(found, axis=1)


@pytest.mark.parametrize("outline", [None, narrowing], ids=["rectangle", "outline"])
@pytest.mark.parametrize("kinematics", [THIN, SHEAR_FLEXIBLE], ids=["thin", "shear-flexible"])
def test_terms_are_sums_over_points(kinematics, outline):
    """Two fields of each group, grain at an angle, and every kind of further term: as many forms, all symmetric."""
    is_sheared = kinematics is SHEAR_FLEXIBLE
    x, y = (line(FREE, n, is_sheared, is_split=False, n_points=N_POINTS_CUT) for n in (3, 4))
    fields = {group: [None, bump] for group in GROUPS} | {"mass": [None, bump, ripple]}
    # A mass at one place, and one that goes with how far two places move apart.
    places = PointMotion(((1.0, 0.3, 0.8), (-1.0, 0.3, 0.1)))
    further = (
        PlateTerm(("slope_x", "slope_y"), outline),
        EdgeTerm(0, (True, False), "turn_x"),
        EdgeTerm(1, (True, True), "turn_y"),
    )
    plate = plate_of(kinematics, x, y, Fabric(fields, outline, is_turned=True)).with_terms(
        further, [PointTerm(((1.0, places, places),))]
    )
    (own,) = plate.classes

    sums = Sums(x.nodes, y.nodes, kinematics.fields)
    at_x, at_y, weights = points_within(x.nodes, y.nodes, outline)
    whole = points_within(x.nodes, y.nodes, None)

    def own_term(term, factor, ghost):
        values = 1.0 if factor is None else factor(at_x, at_y)
        inside = sums.integral(*term, at_x, at_y, values * weights)
        if outline is None or factor is not None:
            return inside
        return (1.0 - ghost) * inside + ghost * sums.integral(*term, *whole)

    terms = [*BENDING, *SHEARS, *COUPLING, (2, SHEAR_X, SHEAR_Y)] if is_sheared else [*BENDING, *COUPLING]
    groups = kinematics.groups(True)
    counts = {group: len(one) for group, one in fields.items()}
    expected = [own_term(terms[i], fields[groups[0][i]][k], 1e-5) for i, k in term_field_pairs(groups[0], counts)]
    slopes = ((1.0, "w", 1, 0),), ((1.0, "w", 0, 1),)
    expected.append(sums.integral(2, *slopes, at_x, at_y, weights))
    (along, in_x), (across, in_y) = ([one.ravel() for one in gauss(s[:-1], np.diff(s), 6)] for s in (x.nodes, y.nodes))
    expected.append(sums.integral(1, TURN_X, TURN_X, np.zeros_like(across), across, in_y))
    expected.append(sum(sums.integral(1, TURN_Y, TURN_Y, along, np.full_like(along, end), in_x) for end in (0.0, 1.0)))
    masses = [MASS, *(ROTARY if is_sheared else [])]
    inert = [own_term(masses[i], fields[groups[1][i]][k], 1e-8) for i, k in term_field_pairs(groups[1], counts)]
    at_places = sums.strain(DEFLECTION, np.array([0.3, 0.3]), np.array([0.8, 0.1]))
    inert.append(np.outer(*2 * [at_places[0] - at_places[1]]))

    unit = np.eye(own.n_dof)
    for found, wanted in ((own.project_stiffness(unit), expected), (own.project_masses(unit), inert)):
        assert len(found) == len(wanted)
        for one, other in zip(found, wanted, strict=True):
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-10 * np.abs(other).max())


STIFF = 1e7
"""Bending along y and twist beside bending along x: the plate is a beam, but for a deflection of one part in that."""
N_ALONG = 20


def square(*places, beside=-1):
    """A term: the square of deflections at places, or of how far a coordinate moves against them."""
    amount = PointMotion(places, beside)
    return PointTerm(((1.0, amount, amount),))


def bent(b):
    """Zero at the wavenumbers of a cantilever beam."""
    return 1 + np.cos(b) * np.cosh(b)


def pulled(b):
    """Zero at the wavenumbers of a beam clamped and supported."""
    return np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b)


CANTILEVER = ("clamped", "free")
TIP = (1.0, 1.0, 0.3)
BEAMS = {
    "a mass at the tip, twice that of the beam": (
        CANTILEVER, [], [(square(TIP), 2.0)], lambda b: bent(b) + 2.0 * b * pulled(b),
    ),
    "a mass on a spring at the tip, of a mode of its own": (
        CANTILEVER, [(square((-1.0, 1.0, 0.3), beside=0), 100.0)], [(square(beside=0), 0.1)],
        lambda b: (1 - b**4 * 0.1 / 100.0) * bent(b) + 0.1 * b * pulled(b),
    ),
    "a spring along the free edge": (
        CANTILEVER, [(EdgeTerm(0, (False, True), "w"), 100.0)], [], lambda b: b**3 * bent(b) - 100.0 * pulled(b),
    ),
    "a rotational spring along a supported edge": (
        ("supported", "supported"), [(EdgeTerm(0, (True, False), "slope_x"), 1.0)], [],
        lambda b: 2 * b * np.sin(b) * np.sinh(b) - pulled(b),
    ),
}  # fmt: skip
"""Ends of a beam, its further stiffnesses and masses with their weights, and what is zero at its wavenumbers b."""


@pytest.mark.parametrize(("ends", "stiffness", "masses", "equation"), BEAMS.values(), ids=BEAMS)
def test_a_loaded_or_sprung_beam_has_the_wavenumbers_of_its_equation(ends, stiffness, masses, equation):
    """A plate that is a beam along x of unit length and unit stiffness: omega^2 is b^4.

    Cubic elements of length h raise b by (b h)^4 / 2880; the plate's own give at a place leaves a millionth.
    """
    at = np.linspace(0.3, 11.0, 500)
    brackets = [(a, b) for a, b in pairwise(at) if equation(a) * equation(b) < 0.0]
    expected = np.array([brentq(equation, *ends_of_root) for ends_of_root in brackets[:3]])
    plate = plate_of(THIN, line(ends, N_ALONG, is_split=False), line(FREE, 4, is_split=False))
    loaded = plate.with_terms([term for term, _ in stiffness], [term for term, _ in masses])
    stiff = np.array([1.0, STIFF, 0.0, STIFF, *(weight for _, weight in stiffness)])
    inert = np.array([1.0, *(weight for _, weight in masses)])

    found = solve(loaded, Weights(stiff, inert), 3).eigenvalues ** 0.25

    assert np.all(np.abs(found / expected - 1.0) < 1.1 * (expected / N_ALONG) ** 4 / 2880 + 1e-6)


def test_products_of_two_amounts_are_the_square_of_their_sum():
    """(z - w)^2 as one square, and as z^2 - 2 z w + w^2: a spring either way."""
    rise, place = PointMotion(coordinate=0), PointMotion(((1.0, 0.7, 0.2),))
    stretched = square((-1.0, 0.7, 0.2), beside=0)
    apart = PointTerm(((1.0, rise, rise), (-2.0, rise, place), (1.0, place, place)))
    (own,) = plate_of(THIN, line(FREE, 3), line(FREE, 3)).with_terms([stretched, apart], []).classes

    one, other = own.project_stiffness(np.eye(own.n_dof))[-2:]

    np.testing.assert_allclose(one, other, atol=1e-13)
    assert one[-1, -1] == 1.0


def test_springs_along_both_edges_are_those_along_each():
    """On a plate whose halves are alike, solved by its classes, and on the whole of it."""
    found = []
    for is_split in (True, False):
        x, y = (line(FREE, 6, is_split=is_split) for _ in "xy")
        both = [EdgeTerm(0, (True, True), "w"), EdgeTerm(1, (True, True), "slope_y")]
        weights = Weights(np.array([1.0, 0.7, 0.2, 0.9, 30.0, 2.0]), np.ones(1))
        found.append(solve(plate_of(THIN, x, y).with_terms(both, []), weights, 10).eigenvalues)

    # Springs hold the plate, but its classes still count the rigid motions of a free one.
    np.testing.assert_allclose(*found, rtol=1e-8)
