"""The numbers that decide what a diagnosis says, each from just below and just above, on searches made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_searches import HALF_NORMAL, baseline, candidate, decided, found_among, one_level, singles
from scipy.special import ndtr, ndtri

from bayesplate.board.quantity import Quantity
from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.entries import effect_entry
from bayesplate.diagnosis.search import predictive_p_value
from bayesplate.diagnosis.signatures import Signature, acts_both_ways, look_alikes, signatures
from bayesplate.diagnosis.sizes import size_at_limit
from bayesplate.diagnosis.verdict import rank_explanations
from bayesplate.effects import declare, effects_of
from bayesplate.posterior.posing import pose

NOISE = 0.005
A, B = "density_gradient", "poisson_ratio"
"""Names of effects of the whole board; what they do is made by hand."""


@pytest.fixture(scope="module")
def base():
    return baseline(np.random.default_rng(1))


def found_of(base, directions, probability, residual, prior=HALF_NORMAL, n_cells=33, level=None):
    """A search among single effects of given directions, with given probabilities of none and of each."""
    levels = None if level is None else one_level(base, level)
    made = {name: candidate(base, name, d, prior, n_cells) for name, d in directions.items()}
    return found_among(base, made, singles(base, made, levels), probability, residual)


def entry_of(found):
    """What diagnosis.json says of a candidate."""
    return effect_entry(found, decided(found), rank_explanations(found), found.ground.candidates[A], 0.0)


@pytest.mark.parametrize("index", [0, 1], ids=["the bare model", "the winner"])
def test_the_gate_lets_through_what_chance_gives_in_one_of_twenty_cases(base, index):
    """The same misfit, a little larger and a little smaller: probabilities of 0.049 and 0.051."""
    direction, misfit = 0.02 * np.random.default_rng(2).standard_normal((2, 6))
    found = found_of(base, {A: direction}, [0.9, 0.1] if index == 0 else [0.0, 1.0], misfit)
    scales = np.geomspace(0.01, 10.0, 4000)
    p_values = predictive_p_value(found.ground.hypotheses[index], base, scales[:, None] * misfit)
    for wanted, word in ((0.049, "unexplained"), (0.051, "none needed" if index == 0 else "named")):
        nearest = int(np.argmin(np.abs(p_values - wanted)))
        assert p_values[nearest] == pytest.approx(wanted, abs=9e-4)
        assert decided(replace(found, residual=scales[nearest] * misfit)).word == word


@pytest.mark.parametrize(("beyond", "is_limited"), [(0.0040, True), (0.0062, False)])
@pytest.mark.parametrize("side", [1, -1], ids=["top", "bottom"])
def test_a_size_is_at_its_limit_where_half_a_percent_of_its_prior_lies_beyond(base, side, beyond, is_limited):
    """Readings that tell the size to a hundredth of the prior's width; it is told in the unit of people."""
    prior = Quantity.from_mean(0.4, 0.15, "normal", lower=0.1, upper=0.7)
    z = -side * ndtri(beyond + (1.0 - 2.0 * beyond) * ndtr(-2.0))  # the bounds are two standard deviations off
    direction = np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0][0]
    found = found_of(base, {A: direction}, [0.0, 1.0], np.zeros(6), prior, n_cells=801, level=1e-4)
    one = found.ground.candidates[A]
    found = replace(found, residual=one.fine.shift[int(np.argmin(np.abs(one.fine.z[:, 0] - z)))])
    for unit, factor, told in (("1", 1.0, ""), ("kg", 1000.0, " g")):
        free = replace(one.laws[0].form.free[0], unit=unit)
        law = replace(one.laws[0], form=replace(one.laws[0].form, free=(free,)))
        weighed = replace(found, ground=replace(found.ground, candidates={A: replace(one, laws=(law,))}))
        expected = f"size = {factor * float(prior.value(z)):.3g}{told}"
        assert size_at_limit(weighed, 1) == (expected if is_limited else "")


def test_what_rounding_leaves_of_two_effects_looks_like_nothing(base):
    """Three modes see nothing beside three constants: what is left of a shift is a rounding error, however alike."""
    shift, left = np.full(6, 10.0), np.full(6, 1e-12)
    seen = [Signature(name, {}, shift, left, {}, base.scales, False) for name in (A, B)]

    assert look_alikes(seen) == {A: (), B: ()}


@pytest.mark.parametrize(
    ("likeness", "either", "alike"),
    [(0.949, False, False), (0.951, False, True), (-0.951, False, False), (-0.949, True, False), (-0.951, True, True)],
)
def test_effects_look_alike_from_a_cosine_of_095_on(base, likeness, either, alike):
    """Of what each leaves visible, with either sign if they may act either way; in `check` and in `diagnose`."""
    prior = Quantity.from_mean(0.0, 1.0, "normal") if either else HALF_NORMAL
    some = 0.02 * np.random.default_rng(3).standard_normal((2, 6))
    one, other = (shift - base.slopes @ (base.absorption @ shift) for shift in some)
    one = one / np.linalg.norm(one / base.scales)
    other = other - one * np.sum(one * other / base.scales**2)
    other = likeness * one + np.sqrt(1.0 - likeness**2) * other / np.linalg.norm(other / base.scales)
    seen = [Signature(name, {}, d, d, {}, base.scales, either) for name, d in ((A, one), (B, other))]

    assert look_alikes(seen) == {A: (B,) if alike else (), B: (A,) if alike else ()}
    found = found_of(base, {A: one, B: other}, [0.1, 0.5, 0.4], np.zeros(6), prior)
    assert entry_of(found).look_alikes == (B,) * alike


def test_which_effects_may_act_either_way():
    """Shear only lowers, a support only raises, and an angle is even; a gradient has two directions."""
    for name, either in (("density_gradient", True), ("transverse_shear", False), ("grain_angle", False)):
        board = declare(replace(prepare("spruce-free-1L").board, effects=(name,)))
        sizes = [size for one in effects_of(board, board.setups[0]) if one.name == name for size in one.parameters()]
        assert acts_both_ways(sizes) is either


def test_the_bias_of_an_ignored_effect_has_the_sign_of_what_it_hides(base):
    """Frequencies as if D_x were 4 % lower: who ignores that finds E_x too low, E_x = 12 (D_x - nu^2 D_y) / h^3.

    E_y is E_x D_y / D_x.
    """
    found = found_of(base, {A: base.slopes @ [-0.04, 0.0, 0.0]}, [0.1, 0.9], np.zeros(6))
    D_x, D_y, nu = 30.0, 2.0, 0.4
    ratio = (D_x - nu**2 * D_y) / (D_x * np.exp(0.04) - nu**2 * D_y)

    bias = entry_of(found).bias_percent

    assert bias["E_x"] == pytest.approx(100.0 * (ratio - 1.0), rel=1e-6)
    assert bias["E_x"] < -3.9
    assert bias["E_y"] == pytest.approx(100.0 * (ratio * np.exp(0.04) - 1.0), rel=1e-6)
    assert bias["G_xy"] == pytest.approx(0.0, abs=1e-9)


def test_the_bias_in_a_check_is_that_of_the_papers_cantilever():
    """A clamp of k_R L / D = 25: near the -11.6 % of E_x and -4.9 % of G_xy that an independent solver finds for 30."""
    prepared = prepare("finnish-spruce-cantilever")
    (clamp,) = signatures(pose(prepared.board, prepared.prior), ["clamp_rotation"])

    assert clamp.bias_percent["E_x"] == pytest.approx(-11.6 * 30 / 25, rel=0.1)
    assert clamp.bias_percent["G_xy"] == pytest.approx(-4.9 * 30 / 25, rel=0.2)


def test_an_amplitude_has_the_interval_of_ninety_percent(base):
    """One size of a normal prior and normal readings: mean and standard deviation by hand, quantiles 1.645 away."""
    direction = 0.02 * np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0][0]
    prior = Quantity.from_mean(0.0, 1.0, "normal")
    found = found_of(base, {A: direction}, [0.0, 1.0], 1.2 * direction, prior, n_cells=401, level=NOISE)
    # The size seen through what the constants leave of it.
    weight = float(np.sum(((direction - base.slopes @ (base.absorption @ direction)) / base.scales) ** 2))
    sd = 1.0 / np.sqrt(1.0 + weight)
    mean = 1.2 * weight * sd**2

    told = entry_of(found).amplitude

    cell = 6.0 / 401
    assert sd > 10 * cell
    expected = [mean - 1.645 * sd, mean, mean + 1.645 * sd]
    assert [told.q05, told.q50, told.q95] == pytest.approx(expected, abs=cell)
    assert (told.parameter, told.unit) == ("size", "1")
