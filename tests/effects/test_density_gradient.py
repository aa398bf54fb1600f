"""Density gradient: the generator, the sizes of physics.md, and the total mass."""

from __future__ import annotations

from dataclasses import replace

import generator.effects
import numpy as np
import pytest
from effect_plates import hertz_apart, modes_of, shifts
from generator.known_boards import BEAMS, FIEMME, FINNISH, FREE

from bayesplate.effects.density_gradient import DensityGradient
from bayesplate.effects.part import Part

GRADIENT = "density_gradient.gradient"


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize("gradient", [0.6])
@pytest.mark.parametrize("plate", [FINNISH, FREE], ids=["cantilever", "free"])
def test_against_the_generator(plate, gradient, is_sheared):
    independent = generator.effects.DensityGradient(gradient)
    apart = hertz_apart(plate, [DensityGradient()], {GRADIENT: gradient}, [independent], 6, is_sheared)
    assert apart == pytest.approx(0.0, abs=0.5)


def test_counts_the_part_under_the_clamp():
    """The mean is that of the whole board, 30 mm of it covered."""
    whole = replace(FINNISH, covered=0.03, whole=0.253)
    effect = DensityGradient(part=Part(0.03 / 0.253, 0.223 / 0.253))
    independent = generator.effects.DensityGradient(0.3)
    assert hertz_apart(whole, [effect], {GRADIENT: 0.3}, [independent], 6) == pytest.approx(0.0, abs=0.5)


def test_sizes_on_the_papers_cantilever():
    """physics.md 6, printed as whole cents."""
    moved = shifts(FINNISH, [DensityGradient()], {GRADIENT: 0.05}, BEAMS["cantilever"])
    assert moved == pytest.approx([-13, -12, -5, -10, -4, -4], abs=0.6)


def test_a_rectangle_alike_at_both_ends_does_not_know_the_sign():
    up, down = (modes_of(FIEMME, [DensityGradient()], {GRADIENT: g}, 6).eigenvalues for g in (0.3, -0.3))
    np.testing.assert_allclose(up, down, rtol=1e-8)
