"""Moduli and rigidities: one map is the other's inverse, densities keep their meaning, numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.board.material import MODULI, RIGIDITIES, Moduli, derived_quantities, moduli, rigidities

SPRUCE = Moduli(*(np.asarray(value) for value in (10.7e9, 0.716e9, 0.50e9)))
THICKNESS, NU = 3e-3, 0.51


def test_rigidities_by_hand():
    """E_x = 12, E_y = 3, G = 5 Pa, h = 2 m, nu_xy = 1: nu_yx = 1/4, remainder 3/4, h^3 / 12 = 2/3."""
    assert rigidities(12.0, 3.0, 5.0, 2.0, 1.0) == pytest.approx((32 / 3, 8 / 3, 40 / 3))


def test_moduli_by_hand():
    assert moduli(32 / 3, 8 / 3, 40 / 3, 2.0, 1.0) == pytest.approx((12.0, 3.0, 5.0))


def test_fields_carry_the_names_of_the_constants():
    assert rigidities(*SPRUCE, THICKNESS, NU)._fields == RIGIDITIES
    assert SPRUCE._fields == MODULI


def test_isotropic_plate_has_twist_rigidity_of_twice_one_minus_nu():
    for nu in [-0.5, 0.0, 0.3, 0.5]:
        E = 70e9
        D_x, D_y, D_s = rigidities(E, E, E / (2.0 * (1.0 + nu)), THICKNESS, nu)

        assert D_x == D_y == pytest.approx(E * THICKNESS**3 / (12.0 * (1.0 - nu**2)))
        assert D_s / D_x == pytest.approx(2.0 * (1.0 - nu), rel=1e-14)


@pytest.mark.parametrize("nu", [0.0, 0.51, 1.5, -0.4])
def test_map_of_logarithms_keeps_volumes(nu):
    """A density of ln E, ln G is one of ln D unchanged: the Jacobian determinant is 1 at fixed thickness and nu."""
    centre, step = np.log(rigidities(*SPRUCE, THICKNESS, nu)), 1e-5

    def log_moduli(log_rigidities):
        return np.log(moduli(*np.exp(log_rigidities), THICKNESS, nu))

    columns = [(log_moduli(centre + s) - log_moduli(centre - s)) / (2.0 * step) for s in step * np.eye(3)]

    # Rounding of the logarithms over the step is 1e-10, the step's square times the third derivative about as much.
    assert np.linalg.det(np.column_stack(columns)) == pytest.approx(1.0, abs=1e-8)
    assert (abs(columns[0][1]) > 1e-3) == (nu != 0.0), "the map is no plain shift unless nu is zero"


def test_impossible_poisson_ratio_gives_not_a_number():
    """E_x / E_y = 4, so that nu_xy nu_yx = nu^2 / 4 must stay below one; D_s does not depend on it."""
    for nu, is_real in [(0.0, True), (1.9, True), (-1.9, True), (2.0, False), (2.1, False), (-3, False)]:
        there = rigidities(4.0, 1.0, 1.0, 1.0, nu)
        back = moduli(4.0, 1.0, 1.0, 1.0, nu)

        for constants in (there, back):
            assert np.isfinite(constants[0]) == np.isfinite(constants[1]) == is_real
            assert np.isfinite(constants[2])


def test_only_the_impossible_draws_are_not_numbers():
    found = rigidities(np.full(3, 4.0), np.ones(3), np.ones(3), 1.0, np.array([0.3, 5.0, 0.4]))

    np.testing.assert_array_equal(np.isnan(found.D_x), [False, True, False])


def test_derived_quantities_by_hand():
    """E_x = 16, E_y = 4, G = 2 GPa, rho = 400: speeds are the roots of 40e6 and 10e6."""
    found = derived_quantities(Moduli(*(np.asarray(v) for v in (16e9, 4e9, 2e9))), 400.0)

    assert {name: (float(d.values), d.unit) for name, d in found.items()} == {
        "wave_speed_x": (pytest.approx(6324.5553), "m/s"),
        "wave_speed_y": (pytest.approx(3162.2777), "m/s"),
        "radiation_ratio_x": (pytest.approx(15.811388), "m^4/(kg s)"),
        "radiation_ratio_y": (pytest.approx(7.9056942), "m^4/(kg s)"),
        "impedance_x": (pytest.approx(2529822.1), "kg/(m^2 s)"),
        "impedance_y": (pytest.approx(1264911.1), "kg/(m^2 s)"),
        "specific_stiffness_x": (pytest.approx(40e6), "m^2/s^2"),
        "specific_stiffness_y": (pytest.approx(10e6), "m^2/s^2"),
        "anisotropy": (pytest.approx(4.0), "1"),
        "E_x_over_G_xy": (pytest.approx(8.0), "1"),
        "density": (pytest.approx(400.0), "kg/m^3"),
    }
