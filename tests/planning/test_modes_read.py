"""What an effect does between the sizes at which it is solved: a parabola along each, and a line for every term."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesplate.board.quantity import Quantity
from bayesplate.planning import modes_read as home
from bayesplate.planning.beliefs import Belief, FormTerms

N_TERMS = 12
LINEAR, SQUARE = np.array([[0.02, -0.01], [0.003, 0.004]]), np.array([[0.001, 0.002], [-0.001, 0.0]])
"""Of two sizes, on two modes."""
OF_CONSTANTS = 0.05


def exact(sizes, constants):
    return sizes @ LINEAR + sizes**2 @ SQUARE + OF_CONSTANTS * constants[0] * np.ones(2)


@pytest.fixture
def added(monkeypatch):
    """Terms of one constant and two sizes, at which the constant stands by the sizes; and what is added to them."""
    rng = np.random.default_rng(3)
    sizes = rng.normal(0.3, 0.5, (N_TERMS, 2))
    mean = np.column_stack([0.1 + sizes @ [0.2, -0.1], sizes])
    prior = Quantity.from_mean(0.0, 1.0, "normal")
    parameters = tuple(SimpleNamespace(name=name, prior=prior) for name in "ab")
    form = FormTerms(np.arange(N_TERMS), None, ("made",) * 2, parameters, np.array([1, 2]))
    one = Belief(
        members=("made",), words="", probability=1.0, mean=mean, covariance=np.tile(0.01 * np.eye(3), (N_TERMS, 1, 1)),
        noise=np.ones((N_TERMS, 1)), middle=np.zeros((N_TERMS, 0)), wanted=np.zeros((N_TERMS, 0, 3)), forms=(form,),
    )  # fmt: skip
    asked = []

    def solved(known, law, form, sizes, constants):
        asked.append(sizes)
        return exact(sizes, constants)

    monkeypatch.setattr(home, "_beside", solved)
    known = SimpleNamespace(board=SimpleNamespace(symmetry=SimpleNamespace(n=1)))
    shift, slopes = np.zeros((N_TERMS, 2)), np.zeros((N_TERMS, 2, 3))
    home.add_effects(one, known, SimpleNamespace(middle=np.zeros(2)), shift, slopes)
    return mean, shift, slopes, asked


def test_each_term_is_linear_about_its_own_place_on_the_parabola(added):
    mean, shift, slopes, asked = added
    inside = np.all([(one >= np.min(asked, axis=0)) & (one <= np.max(asked, axis=0)) for one in mean[:, 1:]], axis=1)
    expected = shift + np.einsum("tnu,tu->tn", slopes, mean)

    wanted = np.stack([exact(one[1:], one[:1]) for one in mean])
    assert inside.sum() > N_TERMS // 2
    assert expected[inside] == pytest.approx(wanted[inside], abs=1e-12)
    of_constants = OF_CONSTANTS * np.array([[0.2], [-0.1]])
    along = LINEAR + 2.0 * mean[:, 1:, None] * SQUARE + of_constants
    assert slopes[inside][:, :, 1:] == pytest.approx(np.swapaxes(along, 1, 2)[inside], abs=1e-12)
    assert not slopes[:, :, 0].any()


def test_two_solutions_along_each_size_and_one_in_the_middle_are_all_it_takes(added):
    assert len(added[3]) == 5


def test_a_mode_that_is_lost_to_one_side_goes_on_straight_and_what_a_mass_adds_to_it_is_not_told(monkeypatch):
    """One mode and one spot, one size; the mode has lost its name where the effect is large."""
    prior = Quantity.from_mean(0.0, 1.0, "normal")
    form = FormTerms(np.arange(3), None, ("made",), (SimpleNamespace(name="a", prior=prior),), np.array([1]))
    mean = np.column_stack([np.zeros(3), [-0.5, 0.0, 0.5]])
    one = Belief(
        members=("made",), words="", probability=1.0, mean=mean, covariance=np.tile(0.01 * np.eye(2), (3, 1, 1)),
        noise=np.ones((3, 1)), middle=np.zeros((3, 0)), wanted=np.zeros((3, 0, 2)), forms=(form,),
    )  # fmt: skip
    monkeypatch.setattr(home, "_beside", lambda *a: np.full(2, np.nan if a[3][0] > 0.2 else 0.1 * a[3][0]))
    known = SimpleNamespace(board=SimpleNamespace(symmetry=SimpleNamespace(n=1)))
    shift, slopes = np.zeros((3, 2)), np.zeros((3, 2, 2))

    home.add_effects(one, known, SimpleNamespace(middle=np.zeros(1)), shift, slopes)

    assert shift[:, 0] + slopes[:, 0, 1] * mean[:, 1] == pytest.approx(0.1 * np.clip(mean[:, 1], -0.47, 0.47))
    assert np.isnan(shift[:, 1]).all()
