"""What an effect does between the sizes at which it is solved: a parabola along each, and a line for every term."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesplate.board.quantity import Quantity
from bayesplate.planning import modes_read as home
from bayesplate.planning.beliefs import ExplanationTerms, FormTerms

N_TERMS = 12
LINEAR, SQUARE = np.array([[0.02, -0.01], [0.003, 0.004]]), np.array([[0.001, 0.002], [-0.001, 0.0]])
"""Of two sizes, on two modes."""
OF_CONSTANTS = 0.05


def exact(sizes, constants):
    return sizes @ LINEAR + sizes**2 @ SQUARE + OF_CONSTANTS * constants[0] * np.ones(2)


def with_effect(monkeypatch, mean, solved):
    """Terms of one constant and some sizes of an effect, which is solved as given; shift and slopes of two rows."""
    n_terms, n_u = mean.shape
    prior = Quantity.from_mean(0.0, 1.0, "normal")
    parameters = tuple(SimpleNamespace(name=f"size {i}", prior=prior) for i in range(1, n_u))
    form = FormTerms(np.arange(n_terms), None, ("made",) * (n_u - 1), parameters, np.arange(1, n_u))
    one = ExplanationTerms(
        members=("made",), words="", probability=1.0, mean=mean, noise=np.ones((n_terms, 1)),
        covariance=np.tile(0.01 * np.eye(n_u), (n_terms, 1, 1)), middle=np.zeros((n_terms, 0)),
        target_slopes=np.zeros((n_terms, 0, n_u)), forms=(form,),
    )  # fmt: skip
    monkeypatch.setattr(home, "_form_shift", solved)
    known = SimpleNamespace(board=SimpleNamespace(symmetry=SimpleNamespace(n=1)))
    return one, known, np.zeros((n_terms, 2)), np.zeros((n_terms, 2, n_u))


def test_the_parabola_goes_through_both_sides_and_is_a_line_where_there_is_one():
    sides = np.array([-0.5, 2.0])
    pair = np.stack([0.3 * sides + 0.1 * sides**2, -1.0 * sides], axis=1)
    linear, square = home.parabola_through(sides, pair.copy(), 2)
    np.testing.assert_allclose([linear, square], [[0.3, -1.0], [0.1, 0.0]], atol=1e-12)

    at_bound = home.parabola_through(np.array([0.0, 2.0]), np.array([[0.0, 0.0], [0.4, -2.0]]), 2)
    np.testing.assert_allclose(at_bound, [[0.2, -1.0], [0.0, 0.0]], atol=1e-12)
    lost = home.parabola_through(sides, np.array([[np.nan, np.nan], [0.4, -2.0]]), 1)
    np.testing.assert_allclose(lost, [[0.2, np.nan], [0.0, np.nan]], atol=1e-12)
    np.testing.assert_array_equal(home.parabola_through(np.zeros(2), pair, 2), np.zeros((2, 2)))


def test_each_term_is_linear_about_its_own_place_on_the_parabola(monkeypatch):
    """The constant stands by the sizes there; two solutions along each size and one in the middle are all it takes."""
    sizes, asked = np.random.default_rng(3).normal(0.3, 0.5, (N_TERMS, 2)), []
    mean = np.column_stack([0.1 + sizes @ [0.2, -0.1], sizes])

    def solved(known, law, form, sizes, constants):
        asked.append(sizes)
        return exact(sizes, constants)

    one, known, shift, slopes = with_effect(monkeypatch, mean, solved)
    home.add_effects(one, known, SimpleNamespace(middle=np.zeros(2)), shift, slopes)
    inside = np.all([(one >= np.min(asked, axis=0)) & (one <= np.max(asked, axis=0)) for one in sizes], axis=1)
    expected = shift + np.einsum("tnu,tu->tn", slopes, mean)

    wanted = np.stack([exact(one[1:], one[:1]) for one in mean])
    assert len(asked) == 5
    assert inside.sum() > N_TERMS // 2
    assert expected[inside] == pytest.approx(wanted[inside], abs=1e-12)
    of_constants = OF_CONSTANTS * np.array([[0.2], [-0.1]])
    along = LINEAR + 2.0 * sizes[:, :, None] * SQUARE + of_constants
    assert slopes[inside][:, :, 1:] == pytest.approx(np.swapaxes(along, 1, 2)[inside], abs=1e-12)
    assert not slopes[:, :, 0].any()


def test_a_mode_that_is_lost_to_one_side_goes_on_straight_and_what_a_mass_adds_to_it_is_not_told(monkeypatch):
    """One mode and one spot, one size; the mode has lost its name where the effect is large."""
    mean = np.column_stack([np.zeros(3), [-0.5, 0.0, 0.5]])

    def solved(known, law, form, sizes, constants):
        return np.full(2, np.nan if sizes[0] > 0.2 else 0.1 * sizes[0])

    one, known, shift, slopes = with_effect(monkeypatch, mean, solved)
    home.add_effects(one, known, SimpleNamespace(middle=np.zeros(1)), shift, slopes)

    assert shift[:, 0] + slopes[:, 0, 1] * mean[:, 1] == pytest.approx(0.1 * np.clip(mean[:, 1], -0.47, 0.47))
    assert np.isnan(shift[:, 1]).all()
