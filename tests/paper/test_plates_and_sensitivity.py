"""The paper's test plates, computed and inverted with its printed coefficients: exact, and with perturbed frequencies.

The cantilever is shear-flexible, as its finite elements were; the clamped plate is thin.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from paper_rows import COEFFICIENTS, SETUPS, beams_of

from bayesplate.board.material import rigidities
from bayesplate.frequencies.terms import shear_term_weights, term_weights
from bayesplate.plate.mesh import mesh
from bayesplate.plate.naming import find_named_modes
from bayesplate.plate.shear import SHEAR_ELEMENTS_PER_SIDE, shear_flexible_plate
from bayesplate.plate.thin import thin_plate

E_x, E_y, G_xy, NU, DENSITY, THICKNESS = 10.7e9, 0.716e9, 0.50e9, 0.51, 473.9, 3e-3
SIDES = {"cantilever": (0.223, 0.114), "clamped": (0.600, 0.412)}
FACTORS = {1: (1.3, 0.7), 2: (1.0, 0.7), 3: (1.3, 1.0)}

TEST_MODES = {"cantilever": [(1, 0), (1, 1), (2, 1), (2, 2)], "clamped": list(COEFFICIENTS["clamped"])}

# Tables "Sensitivity test": perturbations of the frequencies in per cent, keyed by the label at the head of their
# column, and the printed errors of D_x, D_y, D_s in per cent.
PERTURBED = {
    "cantilever": [(1, 0), (1, 1), (2, 0), (1, 2), (2, 1), (2, 2)],
    "clamped": [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2)],
}
SENSITIVITY = {
    ("cantilever", 1): ([1.8, -1.7, 1.1, -0.73, 1.6, 0.95], [-4.2, 13.0, -3.8]),
    ("cantilever", 2): ([-1.6, 0.76, 1.6, -1.1, -1.4, -2.0], [-3.5, 7.2, 11.0]),
    ("cantilever", 3): ([0.03, -0.1, 1.6, -0.95, 1.3, -1.4], [-6.4, 11.0, 8.6]),
    ("cantilever", 4): ([0.76, 0.89, 0.66, 0.79, 1.7, 1.6], [-3.4, 9.2, -6.0]),
    ("cantilever", 5): ([-0.94, -0.55, 0.026, -0.35, 0.15, -0.92], [-2.4, 9.1, 4.3]),
    ("clamped", 1): ([0.64, 0.51, 0.37, -1.0, 1.6, -0.95], [-2.5, 3.7, 10.6]),
    ("clamped", 2): ([2.0, -1.0, -1.7, -0.86, -1.4, 1.7], [8.3, 8.4, -52.0]),
    ("clamped", 3): ([1.2, 1.4, 2.0, -1.9, -0.65, 0.63], [-1.1, 5.7, -6.9]),
    ("clamped", 4): ([-0.49, -1.2, -1.1, 0.8, 0.98, 1.3], [3.7, 3.3, -30.0]),
    ("clamped", 5): ([0.89, -0.95, -0.2, -1.9, 0.75, -1.6], [-1.1, 5.4, 11.0]),
}


def values_of(name, plate):
    length_x, length_y = SIDES[name]
    factor_x, factor_y = FACTORS[plate]
    constants = rigidities(E_x * factor_x, E_y * factor_y, G_xy, THICKNESS, NU)._asdict()
    return constants | {
        "G_xz": 0.62e9, "G_yz": 0.023e9, "poisson_xy": NU, "density": DENSITY, "thickness": THICKNESS,
        "length_x": length_x, "length_y": length_y,
    }  # fmt: skip


@cache
def computed(name, plate, is_shear_flexible):
    """omega^2 / lambda by label, N m: what the paper calls psi."""
    setup, values = SETUPS[name], values_of(name, plate)
    if is_shear_flexible:
        weights = shear_term_weights(values, setup).at(0)
        matrices = shear_flexible_plate(setup.ends_x, setup.ends_y, *mesh(weights, SHEAR_ELEMENTS_PER_SIDE))
    else:
        weights = term_weights(values, setup).at(0)
        matrices = thin_plate(setup.ends_x, setup.ends_y, *mesh(weights))
    beams = {label: beams_of(name, label) for label in COEFFICIENTS[name]}
    found = find_named_modes(matrices, weights, beams.values())
    area = values["length_x"] * values["length_y"]
    return {label: found[b].eigenvalue * DENSITY * THICKNESS * area**2 for label, b in beams.items()}


def errors(name, plate, labels, perturbation=None, is_shear_flexible=None):
    """100 (D - d) / D of D_x, D_y, D_s, inverted by least squares as in the paper's eq. (13)."""
    psi = computed(name, plate, name == "cantilever" if is_shear_flexible is None else is_shear_flexible)
    factors = [1.0 + (perturbation or {}).get(label, 0.0) / 100.0 for label in labels]
    coefficients = np.array([COEFFICIENTS[name][label] for label in labels])
    measured = np.array([psi[label] * factor**2 for label, factor in zip(labels, factors, strict=True)])
    estimate = np.linalg.lstsq(coefficients, measured)[0]
    values = values_of(name, plate)
    return 100.0 * (1.0 - estimate / [values[constant] for constant in ("D_x", "D_y", "D_s")])


@pytest.mark.parametrize("plate", FACTORS)
@pytest.mark.parametrize("name", SETUPS)
def test_printed_coefficients_recover_the_test_plates(name, plate):
    """The paper prints errors of 1.2 % at most (cantilever) and 0.9 % (clamped); here 1.3 %."""
    assert np.abs(errors(name, plate, TEST_MODES[name])).max() < 1.3


def test_printed_coefficients_do_not_fit_a_thin_cantilever():
    """They hold its shear: inverting thin plates with them overrates D_y by a fifth."""
    assert errors("cantilever", 1, TEST_MODES["cantilever"], is_shear_flexible=False)[1] == pytest.approx(-20, abs=2)


@pytest.mark.parametrize(("name", "test"), SENSITIVITY, ids=str)
def test_perturbed_frequencies_give_the_printed_errors(name, test):
    """All six modes of plate 1: within 1.4 points of errors that reach 13 points (cantilever) and 52 (clamped).

    Most of the difference is a Poisson ratio kept fixed: against D_x and D_y computed with nu_yx of the training plate,
    0.8 % larger, within 0.45 and 1 points. The paper nowhere says so, but p = 4.36 at q = 0.40 in its figure of MAC
    matrices is the same reading.
    """
    perturbation, printed = SENSITIVITY[name, test]
    labels = PERTURBED[name]
    factor_x, factor_y = FACTORS[1]
    kept, own = (1.0 - NU**2 * E_y * ratio / E_x for ratio in (1.0, factor_y / factor_x))

    found = errors(name, 1, labels, dict(zip(labels, perturbation, strict=True)))
    against_kept = 100.0 - (100.0 - found) * [kept / own, kept / own, 1.0]

    np.testing.assert_allclose(found, printed, atol=1.3 if name == "cantilever" else 1.4)
    np.testing.assert_allclose(against_kept, printed, atol=0.45 if name == "cantilever" else 1.0)


def test_perturbations_are_keyed_by_label():
    """The clamped tables list modes in different orders: with (0,2) and (1,1) exchanged D_s is 24 points off."""
    perturbation, printed = SENSITIVITY["clamped", 1]
    misread = dict(zip([(0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2)], perturbation, strict=True))

    assert np.abs(errors("clamped", 1, PERTURBED["clamped"], misread) - printed).max() > 20.0


def test_weights_of_draws_are_those_of_each_draw():
    """Whichever of the constants comes in draws, the others are repeated."""
    setup, values = SETUPS["cantilever"], values_of("cantilever", 1)
    G_yz = np.array([0.01e9, 0.023e9, 10e9])

    together = shear_term_weights({**values, "G_yz": G_yz}, setup)

    assert together.stiffness.shape == (3, 6)
    assert together.mass.shape == (3, 3)
    for i, modulus in enumerate(G_yz):
        alone = shear_term_weights({**values, "G_yz": modulus}, setup)
        np.testing.assert_allclose(together.stiffness[i], alone.stiffness[0], rtol=1e-14)
        np.testing.assert_allclose(together.mass[i], alone.mass[0], rtol=1e-14)
    # By hand: kappa G / (rho L^2), and h^2 / (12 L^2).
    np.testing.assert_allclose(together.stiffness[1, 4:], [2.19233e7, 3.11209e6], rtol=1e-4)
    np.testing.assert_allclose(together.mass[1], [1.0, 1.50817e-5, 5.77101e-5], rtol=1e-4)
