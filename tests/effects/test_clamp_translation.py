"""Clamps that give way: against the generator, and between the ideal clamp and the guided and the free edge."""

from __future__ import annotations

import generator.effects
import numpy as np
import pytest
from effect_plates import hertz, hertz_apart, setup_of, shifts
from generator.designs import ALL_FREE, CANTILEVER
from generator.known_boards import BEAMS, FIEMME, FINNISH, FREE
from generator.plate import Plate

from bayesplate.effects.clamp_rotation import STIFFEST as STIFFEST_ROTATION
from bayesplate.effects.clamp_rotation import ClampRotation
from bayesplate.effects.clamp_translation import STIFFEST, ClampTranslation

COMPLIANCE = "clamp_translation.compliance"
BOTH = ("clamp_rotation.compliance", COMPLIANCE)


def effect(plate):
    return ClampTranslation.of(None, setup_of(plate))


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize("compliance", [1e-5, 1e-2])
@pytest.mark.parametrize("plate", [FINNISH, FIEMME], ids=["cantilever", "clamped"])
def test_against_the_generator(plate, compliance, is_sheared):
    """All edges share k_T, which the compliance gives with the D and L along x."""
    k = plate.D_x / ((compliance + STIFFEST) * plate.L_x**3)
    apart = hertz_apart(
        plate, [effect(plate)], {COMPLIANCE: compliance}, [generator.effects.ClampTranslation(k)], 9, is_sheared
    )
    assert apart == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize("plate", [FINNISH, FIEMME], ids=["cantilever", "clamped"])
def test_with_a_clamp_that_turns_as_well(plate, is_sheared):
    turn, sink = 1 / 30, 1e-4
    k_turn = plate.D_x / ((turn + STIFFEST_ROTATION) * plate.L_x)
    k_sink = plate.D_x / ((sink + STIFFEST) * plate.L_x**3)
    apart = hertz_apart(
        plate,
        [ClampRotation.of(None, setup_of(plate)), effect(plate)],
        dict(zip(BOTH, (turn, sink), strict=True)),
        [generator.effects.ClampRotation(k_turn), generator.effects.ClampTranslation(k_sink)],
        9,
        is_sheared,
    )
    assert apart == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("plate", [FINNISH, FIEMME], ids=["cantilever", "clamped"])
def test_no_compliance_is_the_ideal_clamp(plate):
    """What is left by `STIFFEST` is a hundredth of the shift at k_T L^3 / D = 1e5, 2-11 cents."""
    ratio = hertz(plate, [effect(plate)], {COMPLIANCE: 0.0}, 6) / hertz(plate, [], {}, 6)
    assert 1200 * np.log2(ratio) == pytest.approx(0.0, abs=0.12)


def test_great_compliance_is_a_guided_beam():
    """A beam that only slides at one end is half a free one of twice its length: beta L = 4.7300 / 2, 10.9956 / 2."""
    beam = Plate(10e9, 10e9, 5e9, 0.0, 500.0, 2e-3, 0.3, 0.01, CANTILEVER)
    omega = np.array([4.7300407, 10.9956078]) ** 2 / 4.0 * np.sqrt(beam.D_x / (beam.rho * beam.h)) / beam.L_x**2
    found = hertz(beam, [effect(beam)], {COMPLIANCE: 1e3}, 8)
    nearest = [found[np.argmin(np.abs(found - f))] for f in omega / (2 * np.pi)]  # beside slides, tilts and twists
    assert nearest == pytest.approx(omega / (2 * np.pi), rel=1e-4)


def test_both_compliances_great_leave_a_free_plate():
    free = Plate(**{**vars(FIEMME), "edges": ALL_FREE})
    effects = [ClampRotation.of(None, setup_of(FIEMME)), effect(FIEMME)]
    found = hertz(FIEMME, effects, dict(zip(BOTH, (1e6, 1e6), strict=True)), 6)
    assert found[:3] == pytest.approx(0.0, abs=0.1)  # shift and turns on springs that are hardly there
    assert found[3:] == pytest.approx(hertz(free, [], {}, 3), rel=1e-4)


def test_sizes_on_the_papers_boards():
    """physics.md 6: -0.2 to -1.3 and -1 to -12 cents.

    Its clamped board has k_T L^3 / D = 1e4 with the D and L of each edge, -22 to -111; with one k_T, that of x, the
    edges along x are stiffer by D_y / D_x (L_x / L_y)^3 = 0.30, and half of the shift remains.
    """
    for ratio, most, least in ((1e5, -1.3, -0.2), (1e4, -12.0, -1.0)):
        found = shifts(FINNISH, [effect(FINNISH)], {COMPLIANCE: 1 / ratio}, BEAMS["cantilever"])
        assert (found.min(), found.max()) == (pytest.approx(most, abs=0.5), pytest.approx(least, abs=0.5))
    clamped = shifts(FIEMME, [effect(FIEMME)], {COMPLIANCE: 1e-4}, BEAMS["clamped"])
    assert clamped.min() > -0.6 * 111
    assert clamped.max() < -0.6 * 22


def test_refused_where_nothing_is_clamped():
    assert ClampTranslation.refusal(None, setup_of(FREE)) == "no edge is clamped"
