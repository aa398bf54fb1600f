"""Clamps that turn: against the generator, between the ideal clamp and the support, and in the sizes of physics.md."""

from __future__ import annotations

from dataclasses import replace

import generator.effects
import numpy as np
import pytest
from effect_plates import ALL_SUPPORTED, hertz, hertz_apart, setup_of, shifts
from generator.known_boards import BEAMS, FIEMME, FINNISH, FREE

from bayesplate.effects.clamp_rotation import STIFFEST, ClampRotation

COMPLIANCE = "clamp_rotation.compliance"


def effect(plate):
    return ClampRotation.of(None, setup_of(plate))


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize("compliance", [1e-3, 1 / 3])
@pytest.mark.parametrize("plate", [FINNISH, FIEMME], ids=["cantilever", "clamped"])
def test_against_the_generator(plate, compliance, is_sheared):
    """All edges share k_R, which the compliance gives with the D and L along x."""
    k = plate.D_x / ((compliance + STIFFEST) * plate.L_x)
    apart = hertz_apart(
        plate, [effect(plate)], {COMPLIANCE: compliance}, [generator.effects.ClampRotation(k)], 9, is_sheared
    )
    assert apart == pytest.approx(0.0, abs=0.5)


def test_edges_along_x_alone_take_the_sides_of_y():
    """Clamped at y0 only, the compliance is D_y / (k_R L_y)."""
    plate = replace(FINNISH, edges={"x0": "free", "x1": "free", "y0": "clamped", "y1": "free"})
    k = plate.D_y / (0.05 * plate.L_y)
    apart = hertz_apart(plate, [effect(plate)], {COMPLIANCE: 0.05}, [generator.effects.ClampRotation(k)], 6)
    assert apart == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("plate", [FINNISH, FIEMME], ids=["cantilever", "clamped"])
def test_no_compliance_is_the_ideal_clamp(plate):
    """What is left by `STIFFEST` is a hundredth of the shift at k_R L / D = 1000, 3.5 cents, or of a few times that."""
    ratio = hertz(plate, [effect(plate)], {COMPLIANCE: 0.0}, 6) / hertz(plate, [], {}, 6)
    assert 1200 * np.log2(ratio) == pytest.approx(0.0, abs=0.1)


def test_great_compliance_is_a_support():
    supported = hertz(replace(FIEMME, edges=ALL_SUPPORTED), [], {}, 6)
    assert hertz(FIEMME, [effect(FIEMME)], {COMPLIANCE: 1e6}, 6) == pytest.approx(supported, rel=1e-5)


@pytest.mark.parametrize(
    ("ratio", "most", "least"), [(1000, -3.5, -1.0), (300, -12.0, -3.0), (100, -34.0, -8.0), (30, -109.0, -22.0)]
)
def test_sizes_on_the_papers_cantilever(ratio, most, least):
    """physics.md 6, whose numbers are rounded to half a cent."""
    found = shifts(FINNISH, [effect(FINNISH)], {COMPLIANCE: 1 / ratio}, BEAMS["cantilever"])
    assert (found.min(), found.max()) == (pytest.approx(most, abs=0.6), pytest.approx(least, abs=0.6))


def test_refused_where_nothing_is_clamped():
    assert ClampRotation.refusal(None, setup_of(FREE)) == "no edge is clamped"
    assert ClampRotation.refusal(None, setup_of(FINNISH)) == ""
