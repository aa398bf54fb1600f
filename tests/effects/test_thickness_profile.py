"""Thickness profile: readings at places, what they leave open, and the mass on the scale."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from effect_plates import hertz, setup_of, values_of
from generator.known_boards import FINNISH, FREE
from made_boards import board_of

from bayesplate.board.board import board_density
from bayesplate.board.quantity import Quantity
from bayesplate.board.random_field import Surface
from bayesplate.commands.prepare import prepare
from bayesplate.effects.field_components import FieldProfile
from bayesplate.effects.thickness_profile import ThicknessProfile
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import full_log_frequencies
from bayesplate.frequencies.system import System
from bayesplate.posterior.laplace import law_tolerance
from bayesplate.posterior.posing import pose


def read_as_on_the_measured_boards():
    x, y = np.tile(np.linspace(0, 1, 5), 2), np.repeat([0.0, 1.0], 5)
    readings = FREE.h + np.array([4, -2, 3, 1, -5, -3, -4, 6, 5, -2]) * 4e-5
    thickness = Quantity.from_readings(readings, 1e-4, x * FREE.L_x, y * FREE.L_y)
    return board_of(ritz.FREE_SPRUCE, [setup_of(FREE)], thickness=thickness)


class FirstOrder(ThicknessProfile):
    """The same without products of components."""

    def _expand_power(self, n):
        return tuple(one for one in super()._expand_power(n) if one.order < 2)


@pytest.mark.parametrize(("kind", "least", "most"), [(ThicknessProfile, 0.0, 0.03), (FirstOrder, 0.5, 3.0)])
def test_the_expansion_against_the_field_itself(kind, least, most):
    """At two standard deviations of all that the readings leave open, cents; its first order alone would not do."""
    board = read_as_on_the_measured_boards()
    effect = ThicknessProfile.of(board, board.setups[0])
    profile, worst = effect.profile, 0.0
    assert (len(profile.components), effect.followed_inputs) == (2, ("thickness",))
    for steps in ((2.0, 2.0, 2.0), (-2.0, 2.0, 2.0), (2.0, -2.0, 2.0)):
        thick = replace(FREE, h=profile.mean + steps[0] * profile.mean_sd)
        parameters = {f"thickness_profile.field_{k}": one for k, one in enumerate(steps[1:], start=1)}
        whole = ThicknessProfile(profile=FieldProfile(added(profile, steps), None, (), thick.h, 0.0))
        apart = hertz(thick, [kind(profile=profile)], parameters, 6) / hertz(thick, [whole], {}, 6)
        worst = max(worst, 1200 * np.abs(np.log2(apart)).max())
    assert least <= worst < most


def times(surface, factor):
    return replace(surface, coefficients=tuple(factor * one for one in surface.coefficients))


def added(profile, steps):
    """The profile moved by steps of what is open."""
    rows = [profile.expected, *(times(one, step) for one, step in zip(profile.uncertain_changes, steps, strict=True))]
    return Surface(profile.expected.degrees, tuple(np.sum([one.coefficients for one in rows], axis=0)))


def test_a_given_mass_is_kept():
    """Stations that crowd where the board is thick: their mean is not the board's, the mass on the scale is."""
    setup = setup_of(FINNISH)
    readings = Quantity.from_readings([3.1e-3, 3.1e-3, 3.1e-3, 2.7e-3], 1e-4, [0.0, 0.01, 0.02, 0.223], [0.05] * 4)
    board = board_of(ritz.FINNISH, [setup], thickness=readings, mass=Quantity.exact(0.036))
    values = board.nominal() | {n: v for n, v in values_of(FINNISH, {}).items() if n.startswith("D_")}
    system = System(setup, (ThicknessProfile.of(board, setup),))

    adjusted = system.effects[0].adjusted(values)
    middle = (np.arange(200) + 0.5) / 200
    h = values["thickness"] * (1.0 + system.effects[0].profile.expected(middle[:, None], middle))

    assert board_density(adjusted) * h.mean() * 0.223 * 0.114 == pytest.approx(0.036, rel=1e-4)
    assert float(values["thickness"]) < 0.00299
    assert ThicknessProfile.is_implied(board)


def with_its_mean():
    """A board whose field goes with its mean alone, and three times as much as the readings say."""
    prepared = prepare("spruce-free-2R", ["thickness_profile"])
    effect = ThicknessProfile.of(prepared.board, prepared.board.setups[0])
    profile = replace(effect.profile, components=(), mean_gain=times(effect.profile.mean_gain, 3.0))
    parameters = tuple(one for one in prepared.board.parameters if not one.is_of_effect)
    board = replace(prepared.board, parameters=parameters, effect_forms=(replace(effect, profile=profile),))
    return pose(board, prepared.prior)


def test_the_exact_law_knows_the_mean_thickness_that_the_field_goes_with():
    problem, z = with_its_mean(), -2.9
    parameters, (model,) = problem.parameters, problem.posterior.models
    theta = problem.centre.copy()
    theta[parameters.first_input + parameters.inputs.index("thickness")] = z
    values = {name: np.ravel(value)[0] for name, value in parameters.values(theta[None, :]).items()}
    apart = model.log_frequencies(values, "exact")[0] - full_log_frequencies(model, values)
    # Almost three standard deviations out, where none of the draws lies that check the law: a factor.
    assert np.abs(cents(apart)).max() <= 3.0 * law_tolerance(problem.board)
