"""One line of Hermite elements: its Gauss points, beam functions of the handbooks, even and odd functions of a half."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.plate.beams import N_BEAMS, beam_functions
from bayesplate.plate.line import graded_nodes, line, rigid_degrees

ENDS = [("clamped", "free"), ("supported", "clamped"), ("free", "free")]

# Roots of the beam equations cos k cosh k = +-1 and tan k = tanh k: the two lowest wavenumbers on the unit interval.
BEAM_WAVENUMBERS = {
    ("clamped", "clamped"): (4.7300407449, 7.8532046241),
    ("free", "free"): (4.7300407449, 7.8532046241),
    ("clamped", "free"): (1.8751040687, 4.6940911330),
    ("supported", "supported"): (np.pi, 2.0 * np.pi),
    ("clamped", "supported"): (3.9266023120, 7.0685827456),
    ("supported", "free"): (3.9266023120, 7.0685827456),
}


def test_points_and_weights_are_those_of_gauss_on_each_element():
    """Five points are exact to degree nine and no further; of a half line the integral is that of the whole."""
    whole, half = (line(("free", "free"), 2, is_split=is_split) for is_split in (False, True))

    def error(degree):
        return abs(whole.weights @ whole.points**degree * (degree + 1) - 1.0)

    assert error(9) < 1e-14
    assert error(10) > 1e-9
    assert half.points.max() < 0.5
    assert half.weights @ (half.points - 0.5) ** 2 == pytest.approx(1 / 12, rel=1e-13)


@pytest.mark.parametrize("ends", ENDS)
def test_held_ends_take_their_functions(ends):
    """A clamp holds value and slope, on a shear-flexible plate the value alone; the slope there is the shear strain."""
    whole = line(ends, 5)
    n_clamped, n_supported = ends.count("clamped"), ends.count("supported")

    assert whole.kept(0, is_sheared=False).sum() == 2 * 6 - 2 * n_clamped - n_supported
    assert whole.kept(0, is_sheared=True).sum() == 2 * 6 - n_clamped - n_supported
    assert whole.kept_strain(0).sum() == 2 * 6 - n_clamped
    assert whole.ties() == [
        (2 * node, 2 * node + 1) for node, end in zip((0, 5), ends, strict=True) if end == "clamped"
    ]


def test_what_is_held_may_be_less_than_the_ends_say():
    """A released clamp: its beam functions and rigid motions stay those of a clamped line, its functions do not."""
    free = line(("clamped", "clamped"), 5, held=("free", "guided"))

    assert free.ends == ("clamped", "clamped")
    np.testing.assert_array_equal(np.flatnonzero(~free.kept(0, is_sheared=False)), [2 * 5 + 1])
    assert free.ties() == [(2 * 5, 2 * 5 + 1)]


@pytest.mark.parametrize(("ends", "wavenumbers"), BEAM_WAVENUMBERS.items())
def test_beam_functions_are_orthonormal_and_have_the_wavenumbers_of_the_handbooks(ends, wavenumbers):
    """Rigid motions first, which do not bend; the relative error is about (k / 40)^4 / 2880, at most 5.2e-7 here.

    Rounding of the highest eigenvalue, 9.2e9, over the gap of the lowest, 500, is 4e-9: as much a shape has of others.
    """
    beams = beam_functions(ends)
    bending = beams.integrals(2, 2)
    n_rigid = len(rigid_degrees(ends))
    at_points = beams.side.derivatives[0] @ beams.coefficients

    assert np.all(np.abs(bending[:n_rigid]) < 1e-6)
    np.testing.assert_allclose(bending[n_rigid : n_rigid + 2] ** 0.25, wavenumbers, rtol=1e-6)
    np.testing.assert_allclose((at_points.T * beams.side.weights) @ at_points, np.eye(N_BEAMS), atol=1e-8)


def test_free_line_shifts_before_it_turns():
    points = np.linspace(0.0, 1.0, 5)

    shift, turn = beam_functions(("free", "free")).at(points)[:, :2].T

    np.testing.assert_allclose(shift, 1.0, rtol=1e-12)
    np.testing.assert_allclose(turn, np.sqrt(12.0) * (points - 0.5), atol=1e-12)


@pytest.mark.parametrize(("end", "is_sheared"), [("clamped", True), ("supported", False), ("free", True)])
def test_even_and_odd_functions_of_a_half_are_all_functions_of_the_whole(end, is_sheared):
    """Of the deflection, and of the strain along the side, which is odd where the deflection is even."""
    half, whole = (line((end, end), 6, is_sheared, is_split=is_split) for is_split in (True, False))
    points = np.linspace(0.0, 1.0, 201)

    def are_the_same(parts, expected):
        found = np.hstack([part.toarray() for part in parts])
        ranks = [np.linalg.matrix_rank(one, tol=1e-9) for one in (found, np.hstack([found, expected.toarray()]))]
        return found.shape == expected.shape and ranks == 2 * [expected.shape[1]]

    at = whole.shapes(points)
    deflection = [half.shapes(points, p)[:, half.kept(p, is_sheared)] for p in (0, 1)]
    assert are_the_same(deflection, at[:, whole.kept(0, is_sheared)])
    strain = [half.shapes(points, 1 - p)[:, half.kept_strain(p)] for p in (0, 1)]
    assert are_the_same(strain, at[:, whole.kept_strain(0)])


def test_unlike_ends_or_an_element_across_the_middle_leave_a_whole_line():
    assert line(("free", "free"), 6).is_split
    for ends, n in ((("free", "free"), 5), (("clamped", "free"), 6)):
        assert not line(ends, n).is_split
        assert line(ends, n).share == 1.0


@pytest.mark.parametrize("ends", ENDS)
def test_elements_are_graded_towards_free_ends(ends):
    nodes = graded_nodes(ends, 12)
    n_free = ends.count("free")
    whole = 1.0 / (12 - 2 * n_free)

    assert nodes.size == 13
    assert nodes[0] == 0.0
    assert nodes[-1] == 1.0
    for end, lengths in zip(ends, (np.diff(nodes), np.diff(nodes)[::-1]), strict=True):
        expected = [1 / 16, 3 / 16, 3 / 4] if end == "free" else [1.0, 1.0, 1.0]
        np.testing.assert_allclose(lengths[:3] / whole, expected, rtol=1e-12)
