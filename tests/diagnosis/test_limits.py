"""The numbers that decide what a diagnosis says, each from just below and just above, on searches made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_searches import HALF_NORMAL, bare, baseline, candidate, decided, found_among, ground_of, one_level, singles
from scipy.optimize import brentq
from scipy.special import ndtr

from bayesplate.board.quantity import Quantity
from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.entries import effect_entry
from bayesplate.diagnosis.search import noise_of_board
from bayesplate.diagnosis.signatures import Signature, acts_both_ways, look_alikes, signatures
from bayesplate.diagnosis.sizes import at_limit
from bayesplate.diagnosis.terms import noise_grid
from bayesplate.diagnosis.verdict import answers
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
    return effect_entry(found, decided(found), answers(found), found.ground.candidates[A], 0.0)


@pytest.mark.parametrize("index", [0, 1], ids=["the bare model", "the winner"])
def test_the_gate_lets_through_what_chance_gives_in_one_of_twenty_cases(base, index):
    """The same misfit, a little larger and a little smaller: probabilities of 0.049 and 0.051."""
    rng = np.random.default_rng(2)
    direction, misfit = 0.02 * rng.standard_normal((2, 6))
    probability = [0.9, 0.1] if index == 0 else [0.0, 1.0]

    def with_misfit(scale):
        return found_of(base, {A: direction}, probability, scale * misfit)

    for wanted, word in ((0.049, "unexplained"), (0.051, "none needed" if index == 0 else "named")):
        scale = brentq(lambda s, w=wanted: with_misfit(s).p_value(index) - w, 1e-3, 10.0, xtol=1e-4)
        assert decided(with_misfit(scale)).word == word


@pytest.mark.parametrize(("beyond", "is_limited"), [(0.0040, True), (0.0062, False)])
@pytest.mark.parametrize("side", ["top", "bottom"])
def test_a_size_is_at_its_limit_where_half_a_percent_of_its_prior_lies_beyond(base, side, beyond, is_limited):
    """Readings that tell the size to a hundredth of the prior's width."""
    prior = Quantity.from_mean(0.4, 0.15, "normal", lower=0.1, upper=0.7)
    low, high = -2.0, 2.0
    whole = ndtr(high) - ndtr(low)
    z = brentq(lambda x: (ndtr(high) - ndtr(x)) / whole - beyond, -2.0, 2.0)
    z = z if side == "top" else -z
    direction = np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0][0]
    found = found_of(base, {A: direction}, [0.0, 1.0], np.zeros(6), prior, n_cells=801, level=1e-4)
    of_a = found.ground.candidates[A].fine
    found = replace(found, residual=of_a.shift[int(np.argmin(np.abs(of_a.z[:, 0] - z)))])

    assert bool(at_limit(found, 1)) is is_limited
    one = found.ground.candidates[A]
    free = replace(one.laws[0].form.free[0], unit="kg")
    law = replace(one.laws[0], form=replace(one.laws[0].form, free=(free,)))
    weighed = replace(found, ground=replace(found.ground, candidates={A: replace(one, laws=(law,))}))
    assert at_limit(weighed, 1) == ("" if not is_limited else f"size = {1000 * float(prior.value(z)):.3g} g")


def test_what_rounding_leaves_of_two_effects_looks_like_nothing(base):
    """Three modes see nothing beside three constants: what is left of a shift is a rounding error, however alike."""
    shift, left = np.full(6, 10.0), np.full(6, 1e-12)
    seen = [Signature(name, {}, shift, left, {}, base.scales, False) for name in (A, B)]

    assert look_alikes(seen) == {A: (), B: ()}


@pytest.mark.parametrize(("likeness", "alike"), [(0.949, False), (0.951, True), (-0.949, False), (-0.951, True)])
@pytest.mark.parametrize("prior", [HALF_NORMAL, Quantity.from_mean(0.0, 1.0, "normal")])
def test_effects_look_alike_from_a_cosine_of_095_on(base, likeness, alike, prior):
    """Of what each leaves visible, with either sign if they may act either way; in `check` and in `diagnose`."""
    either = prior is not HALF_NORMAL
    alike = alike and (either or likeness > 0)
    some = 0.02 * np.random.default_rng(3).standard_normal((2, 6))
    one, other = (shift - base.slopes @ (base.absorbing @ shift) for shift in some)
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
    """Frequencies as if D_x were 4 % lower: who ignores that finds E_x too low, E_x = 12 (D_x - nu^2 D_y) / h^3."""
    found = found_of(base, {A: base.slopes @ [-0.04, 0.0, 0.0]}, [0.1, 0.9], np.zeros(6))
    D_x, D_y, nu = 30.0, 2.0, 0.4
    expected = 100.0 * ((D_x - nu**2 * D_y) / (D_x * np.exp(0.04) - nu**2 * D_y) - 1.0)

    bias = entry_of(found).bias_percent

    assert bias["E_x"] == pytest.approx(expected, rel=1e-6)
    assert expected < -3.9
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
    weight = float(np.sum(((direction - base.slopes @ (base.absorbing @ direction)) / base.scales) ** 2))
    sd = 1.0 / np.sqrt(1.0 + weight)
    mean = 1.2 * weight * sd**2

    told = entry_of(found).amplitude

    cell = 6.0 / 401
    assert sd > 10 * cell
    expected = [mean - 1.645 * sd, mean, mean + 1.645 * sd]
    assert [told.q05, told.q50, told.q95] == pytest.approx(expected, abs=cell)
    assert (told.parameter, told.unit) == ("size", "1")


def test_simulated_nulls_are_rounded_and_have_the_spread_of_the_inputs():
    """Covariance of the sets: noise, a rounding of one Hz (variance 1/12 over f^2), and what the inputs do together."""
    rounded = baseline(np.random.default_rng(1), resolution=1.0, n_inputs=2)
    ground = ground_of(rounded, bare(rounded, noise_grid(rounded.board)))
    (setup,) = rounded.board.setups
    noise = float(setup.noise.median**2 * np.exp(2.0 * setup.noise.log_sd**2))  # mean square of the noise prior
    hertz = np.exp(rounded.log_frequency)
    expected = np.diag(noise + 1.0 / 12.0 / hertz**2) + rounded.input_slopes @ rounded.input_slopes.T

    n_sets = 40_000
    simulated = noise_of_board(ground.baseline, np.random.default_rng(5), n_sets)

    products = np.einsum("ni,nj->nij", simulated, simulated)
    error = products.std(axis=0) / np.sqrt(n_sets)
    assert np.abs((products.mean(axis=0) - expected) / error).max() < 4.5
    without = np.diag(np.full(6, noise))
    assert np.abs((products.mean(axis=0) - without) / error).max() > 15.0  # control: it shows
