"""One line of Hermite elements: beam functions of the handbooks, halves, and elements graded towards free ends."""

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
