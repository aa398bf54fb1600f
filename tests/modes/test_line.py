"""One line of Hermite elements: exact for cubics, beam functions of the handbooks, even and odd parts."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from bayesplate.modes.line import line, rigid_degrees

ENDS = list(product(("clamped", "supported", "free"), repeat=2))

# Roots of the beam equations cos k cosh k = +-1 and tan k = tanh k: the two lowest wavenumbers on the unit interval.
BEAM_WAVENUMBERS = {
    ("clamped", "clamped"): (4.7300407449, 7.8532046241),
    ("free", "free"): (4.7300407449, 7.8532046241),
    ("clamped", "free"): (1.8751040687, 4.6940911330),
    ("supported", "supported"): (np.pi, 2.0 * np.pi),
    ("clamped", "supported"): (3.9266023120, 7.0685827456),
    ("supported", "free"): (3.9266023120, 7.0685827456),
}

# Integrals over [0, 1] of x^2 against x^3, by hand; "mixed" has the second derivative of the row.
SQUARE_AGAINST_CUBE = [("mass", 1 / 6), ("slope", 3 / 2), ("bending", 6.0), ("mixed", 1 / 2)]


@pytest.mark.parametrize(("name", "by_hand"), SQUARE_AGAINST_CUBE)
def test_integrals_of_cubics_are_exact(name, by_hand):
    free = line(("free", "free"), 3)
    square = free.interpolate(lambda x: x**2, lambda x: 2 * x)
    cube = free.interpolate(lambda x: x**3, lambda x: 3 * x**2)

    assert square @ getattr(free, name) @ cube == pytest.approx(by_hand, rel=1e-12)


def test_mixed_integral_has_the_second_derivative_on_its_row():
    free = line(("free", "free"), 3)
    square = free.interpolate(lambda x: x**2, lambda x: 2 * x)
    cube = free.interpolate(lambda x: x**3, lambda x: 3 * x**2)

    assert cube @ free.mixed @ square == pytest.approx(3 / 2, rel=1e-12)


def test_shapes_evaluate_a_cubic_exactly():
    free = line(("free", "free"), 4)
    points = np.array([0.0, 0.1, 0.33, 0.5, 0.91, 1.0])

    values = free.shapes(points) @ free.interpolate(lambda x: 1 - x + x**3, lambda x: -1 + 3 * x**2)

    np.testing.assert_allclose(values, 1 - points + points**3, rtol=1e-12)


@pytest.mark.parametrize("ends", ENDS)
def test_held_ends_take_their_unknowns(ends):
    n_held = sum({"clamped": 2, "supported": 1, "free": 0}[end] for end in ends)

    assert line(ends, 5).n_dof == 2 * 6 - n_held


@pytest.mark.parametrize(("ends", "wavenumbers"), BEAM_WAVENUMBERS.items())
def test_beam_functions_have_the_wavenumbers_of_the_handbooks(ends, wavenumbers):
    # The relative error of a wavenumber is about (k / 32)^4 / 2880, at most 1.3e-6 here.
    bending, _, _ = line(ends, 32).beam_energies
    n_rigid = len(rigid_degrees(ends))

    np.testing.assert_allclose(bending[n_rigid : n_rigid + 2] ** 0.25, wavenumbers, rtol=2e-6)


@pytest.mark.parametrize("ends", ENDS)
def test_rigid_motions_come_first_and_do_not_bend(ends):
    held = line(ends, 8)
    bending, _, _ = held.beam_energies
    n_rigid = len(rigid_degrees(ends))

    # The lowest elastic eigenvalue of any line is that of the clamped-free one, 1.8751^4 = 12.36.
    assert np.all(np.abs(bending[:n_rigid]) < 1e-6)
    assert bending[n_rigid] > 12.0


def test_free_line_shifts_before_it_turns():
    free = line(("free", "free"), 8)
    points = np.linspace(0.0, 1.0, 5)

    shift, turn = (free.shapes(points) @ free.beams[:, :2]).T

    np.testing.assert_allclose(shift, 1.0, rtol=1e-12)
    np.testing.assert_allclose(turn, np.sqrt(12.0) * (points - 0.5), atol=1e-12)


@pytest.mark.parametrize("ends", ENDS)
def test_beam_functions_are_orthonormal(ends):
    held = line(ends, 10)

    np.testing.assert_allclose(held.beams.T @ held.mass @ held.beams, np.eye(held.beams.shape[1]), atol=1e-9)


@pytest.mark.parametrize("end", ["clamped", "supported", "free"])
def test_parts_are_the_even_and_the_odd_functions(end):
    held = line((end, end), 5)
    points = np.linspace(0.0, 0.5, 7)
    even, odd = held.parts

    together = np.hstack([even.toarray(), odd.toarray()])
    np.testing.assert_allclose(together.T @ together, np.eye(held.n_dof), atol=1e-14)
    for part, sign in ((even, 1.0), (odd, -1.0)):
        left, right = held.shapes(points) @ part, held.shapes(1.0 - points) @ part
        np.testing.assert_allclose(right.toarray(), sign * left.toarray(), atol=1e-12)


@pytest.mark.parametrize("ends", [ends for ends in ENDS if ends[0] != ends[1]])
def test_unlike_ends_leave_one_part(ends):
    held = line(ends, 5)

    assert not held.is_symmetric
    np.testing.assert_array_equal(held.parts[0].toarray(), np.eye(held.n_dof))
