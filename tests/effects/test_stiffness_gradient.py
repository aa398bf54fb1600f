"""Stiffness gradient: the generator, a beam worked out by hand, and the gradient beside other fields."""

from __future__ import annotations

from dataclasses import replace

import generator.effects
import numpy as np
import pytest
from effect_plates import hertz_apart, modes_of, shifts
from generator.known_boards import FIEMME, FINNISH, FREE

from bayesplate.effects.grain_angle import GrainAngle
from bayesplate.effects.part import Part
from bayesplate.effects.stiffness_gradient import StiffnessGradient
from bayesplate.effects.thickness_profile import ThicknessProfile

GRADIENT = "stiffness_gradient.gradient"
BEAM_ROOTS = (1.8751041, 4.6940911)
"""Of cos b cosh b = -1."""


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize("gradient", [-0.2])
@pytest.mark.parametrize("plate", [FINNISH, FREE, FIEMME], ids=["cantilever", "free", "clamped"])
def test_against_the_generator(plate, gradient, is_sheared):
    """There D_y falls where E_x grows, by a hundredth of its gradient: 0.4 cents at the largest of these."""
    independent = generator.effects.StiffnessGradient(gradient)
    apart = hertz_apart(plate, [StiffnessGradient()], {GRADIENT: gradient}, [independent], 6, is_sheared)
    assert apart == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("plate", [FINNISH, FREE], ids=["cantilever", "free"])
def test_against_the_generator_where_nothing_else_holds_the_modulus(plate):
    """Without a Poisson ratio E_x is in D_x alone, and a huge gradient is as exact as a small one."""
    plain = replace(plate, nu_xy=0.0)
    independent = generator.effects.StiffnessGradient(0.6)
    apart = hertz_apart(plain, [StiffnessGradient()], {GRADIENT: 0.6}, [independent], 6)
    assert apart == pytest.approx(0.0, abs=0.1)


def test_the_part_of_the_other_modulus_in_the_stiffness_along_the_grain_stays():
    """Modes that bend along the grain; with nu_xy = 0.9 nu_xy^2 D_y is 4 % of D_x, and of the shift."""
    stout = replace(FINNISH, nu_xy=0.9)
    independent = generator.effects.StiffnessGradient(0.3)
    apart = hertz_apart(stout, [StiffnessGradient()], {GRADIENT: 0.3}, [independent], 3)
    assert apart[[0, 2]] == pytest.approx(0.0, abs=0.5)


def test_counts_the_part_under_the_clamp():
    """The mean is that of the whole board, 30 mm of it covered."""
    whole = replace(FINNISH, covered=0.03, whole=0.253)
    effect = StiffnessGradient(part=Part(0.03 / 0.253, 0.223 / 0.253))
    independent = generator.effects.StiffnessGradient(0.2)
    assert hertz_apart(whole, [effect], {GRADIENT: 0.2}, [independent], 6) == pytest.approx(0.0, abs=0.5)


def test_a_clamped_free_beam_to_first_order():
    """omega^2 changes by g times the mean of s - 1/2, weighted with the squared curvature of the beam."""
    s = np.linspace(0.0, 1.0, 20001)
    expected = []
    for b in BEAM_ROOTS:
        ratio = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
        curvature = np.cosh(b * s) + np.cos(b * s) - ratio * (np.sinh(b * s) + np.sin(b * s))
        expected.append(600.0 / np.log(2.0) * 1e-3 * np.average(s - 0.5, weights=curvature**2))
    plain = replace(FINNISH, nu_xy=0.0)
    moved = shifts(plain, [StiffnessGradient()], {GRADIENT: 1e-3}, [(0, 0), (1, 0)])
    assert moved == pytest.approx(expected, rel=2e-3)


PARAMETERS = {GRADIENT: 0.6, "grain_angle.angle": 0.1}
TAPERS = {"thickness_profile.taper_x": 0.1, "thickness_profile.taper_y": 0.05}


@pytest.mark.parametrize(
    ("is_tapered", "is_sheared"),
    [
        pytest.param(False, False, id="flat-thin"),
        pytest.param(True, False, id="tapered-thin"),
        pytest.param(False, True, id="flat-shear-flexible"),
        pytest.param(True, True, id="tapered-shear-flexible", marks=pytest.mark.slow),
    ],
)
def test_turns_with_the_grain_and_joins_a_taper(is_tapered, is_sheared):
    """What grows is the modulus along the grain, wherever that runs, on a board that is thicker at one end.

    With shear the generator's polynomials err by a tenth of a cent.
    """
    effects, planted = (
        [StiffnessGradient(), GrainAngle()],
        [generator.effects.StiffnessGradient(0.6), generator.effects.GrainAngle(0.1)],
    )
    if is_tapered:
        effects, planted = [ThicknessProfile(), *effects], [generator.effects.ThicknessProfile(0.1, 0.05), *planted]
    plain = replace(FINNISH, nu_xy=0.0)
    apart = hertz_apart(plain, effects, PARAMETERS | TAPERS, planted, 6, is_sheared)
    assert apart == pytest.approx(0.0, abs=0.2 if is_sheared else 0.1)


def test_a_rectangle_alike_at_both_ends_does_not_know_the_sign():
    up, down = (modes_of(FIEMME, [StiffnessGradient()], {GRADIENT: g}, 6).eigenvalues for g in (0.3, -0.3))
    np.testing.assert_allclose(up, down, rtol=1e-8)
