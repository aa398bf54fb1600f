"""Hypotheses: their prior shares, exchanged labels, and what a fold may know of a reading that is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_searches import (
    NOISE,
    bare,
    baseline,
    exchanged,
    ground_of,
    one_level,
    table,
    with_readings,
    with_residual,
)

from bayesplate.board.attached import AttachedItem
from bayesplate.board.quantity import Quantity
from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.folds import nested_leave_one_out
from bayesplate.diagnosis.forms import with_labels_exchanged
from bayesplate.diagnosis.hypotheses import (
    RELABELLING,
    Hypothesis,
    Swap,
    are_stated,
    confusable_labels,
    log_evidences,
    make_hypotheses,
    probabilities,
)
from bayesplate.diagnosis.shifts import combine_cells, no_effect_cells
from bayesplate.diagnosis.terms import noise_grid

CLOSE_PAIR = [(0, 0), (1, 1), (0, 0), (0, 0), (1, 1), (0, 0)]


@pytest.fixture
def base():
    return baseline(np.random.default_rng(1), parities=CLOSE_PAIR, spacing=0.08)


def swap_of(base, first, second, prior=0.5):
    swap = Swap(first, second)
    return Hypothesis((RELABELLING,), prior, no_effect_cells(base.n_modes), one_level(base), swap.applied(base), swap)


def test_prior_shares(base):
    rng = np.random.default_rng(2)
    fine = {name: table(rng) for name in "abc"}
    found = make_hypotheses(base, fine, fine, ["a", "c"])
    kinds = ["swap" if one.swap else len(one.members) for one in found]
    shares = {kind: sum(one.prior for one, other in zip(found, kinds, strict=True) if other == kind) for kind in kinds}
    assert found[0].members == ()
    assert shares == pytest.approx({0: 0.5, 1: 0.3, "swap": 0.1, 2: 0.1})
    assert [one.members for one in found if len(one.members) == 2] == [("a", "c")]
    assert probabilities(found, np.zeros(len(found))) == pytest.approx([one.prior for one in found])


AIR, EXCITER, TENSION = "fluid_loading", "exciter", "membrane_tension"


STATED = [
    ("fiemme-spruce-clamped", (AIR, EXCITER), True),
    ("fiemme-spruce-clamped", (EXCITER, TENSION), False),  # nobody knows of a tension
    ("fiemme-spruce-clamped", ("transverse_shear", AIR), False),  # known, and nothing of them is stated
    ("finnish-spruce-cantilever", (AIR, EXCITER), False),
    ("steel-air-water", ("transverse_shear", AIR), True),
]


def test_known_effects_of_which_the_card_states_one_are_stated():
    for board, pair, expected in STATED:
        assert are_stated(prepare(board).board, pair) is expected


def test_a_stated_pair_has_the_prior_of_a_single_effect(base):
    rng = np.random.default_rng(4)
    (setup,) = base.board.setups
    item = AttachedItem("exciter", (), Quantity.exact(0.048))
    board = replace(base.board, setups=(replace(setup, attached=(item,)),))
    fine = {name: table(rng) for name in (AIR, EXCITER, TENSION)}
    priors = {one.members: one.prior for one in make_hypotheses(replace(base, board=board), fine, fine, list(fine))}
    assert priors[AIR, EXCITER] == priors[AIR,]
    assert priors[AIR, TENSION] == priors[EXCITER, TENSION] == pytest.approx(0.1 / 3)


def test_two_effects_add(base):
    rng = np.random.default_rng(3)
    one, other = table(rng, n_cells=2), table(rng, n_cells=3, n_tangents=2)
    both = combine_cells(one, other)
    assert both.parts == (one, other)
    assert both.weights.sum() == pytest.approx(1.0)
    for i in range(2):
        for j in range(3):
            k = 3 * i + j
            assert both.weights[k] == pytest.approx(one.weights[i] * other.weights[j])
            assert both.shift[k] == pytest.approx(one.shift[i] + other.shift[j])
            assert both.moved[k] == pytest.approx(one.moved[i] + other.moved[j])
            assert both.slopes[k] == pytest.approx(np.hstack([one.slopes[i], other.slopes[j]]))
            assert both.moved_slopes[k] == pytest.approx(np.hstack([one.moved_slopes[i], other.moved_slopes[j]]))


def test_only_close_neighbours_of_different_symmetry_may_be_exchanged(base):
    assert confusable_labels(base) == (Swap(0, 1), Swap(1, 2), Swap(3, 4), Swap(4, 5))
    near, apart = (baseline(np.random.default_rng(1), parities=CLOSE_PAIR, spacing=one) for one in (0.115, 0.125))
    assert len(confusable_labels(near)) == 4
    assert confusable_labels(apart) == ()


def test_neighbours_of_one_class_that_stand_in_the_other_order_may_be_confused(base):
    """The third and fourth readings are of one class: only where they have crossed is there something to exchange."""
    crossed = base.log_frequency[[0, 1, 3, 2, 4, 5]] - base.log_frequency
    assert Swap(3, 2) in confusable_labels(with_residual(base, crossed))


def test_exchanging_twice_changes_nothing_and_once_takes_each_reading_for_the_other_mode(base):
    order = [0, 1, 2, 4, 3, 5]
    swap = Swap(3, 4)
    once = swap.applied(base)
    assert once.middle == pytest.approx(base.middle[order])
    assert once.log_readings is base.log_readings
    assert np.array_equal(swap.applied(once).rows, base.rows)

    labelled = with_readings(base, labels=[(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (2, 0)])
    changed = with_labels_exchanged(labelled.board, 3, 4)
    (before,), (after,) = labelled.board.setups, changed.setups
    assert after.measured == pytest.approx(before.measured)
    assert after.labels == tuple(before.labels[i] for i in order)
    assert [one.beams for one in after.readings] == [before.readings[i].beams for i in order]
    assert with_labels_exchanged(changed, 3, 4) == labelled.board


def test_labels_are_exchanged_in_their_own_setup():
    base = baseline(np.random.default_rng(1), noise=(0.005, 0.005), parities=CLOSE_PAIR, spacing=0.08)
    first, second = with_labels_exchanged(base.board, 3, 4).setups
    assert first == base.board.setups[0]
    assert second.labels == tuple(base.board.setups[1].labels[i] for i in (1, 0, 2))


def test_every_fold_that_can_see_an_exchange_makes_it_and_none_where_labels_are_right(base):
    straight = 1e-4 * np.random.default_rng(6).standard_normal((1, 6))
    swap = swap_of(base, 3, 4)
    ground = ground_of(base, bare(base, noise_grid(base.board)), swap)
    mixed = nested_leave_one_out(ground, exchanged(base, swap.swap, straight.copy()))
    assert (mixed.choices[0, [0, 1, 2, 5]] == 1).all()
    assert mixed.ratio[0] < 0.1
    assert (nested_leave_one_out(ground, straight).choices == 0).all()


def test_a_reading_takes_its_own_error_along_to_the_other_label(base):
    """A doubtful reading and a sharp one exchanged are those of a board on which they stand so from the start."""
    (setup,) = base.board.setups
    readings = list(setup.readings)
    readings[3] = replace(readings[3], frequency=Quantity.from_mean(readings[3].frequency.mean, 4.0, "normal"))
    base = replace(base, board=replace(base.board, setups=(replace(setup, readings=tuple(readings)),)))
    order = [0, 1, 2, 4, 3, 5]
    swapped = [replace(readings[i], frequency=readings[j].frequency) for i, j in enumerate(order)]
    put_right = replace(base, board=replace(base.board, setups=(replace(setup, readings=tuple(swapped)),)))
    swap, none = swap_of(base, 3, 4), bare(put_right, one_level(base))
    mixed = 0.01 * np.random.default_rng(7).standard_normal((2, 6))
    straight = exchanged(base, swap.swap, mixed.copy())
    assert base.own_variance[3] > 10.0 * NOISE**2
    assert put_right.own_variance[[3, 4]] == pytest.approx([0.0, (4.0 / readings[3].frequency.mean) ** 2])
    assert log_evidences((swap,), base, mixed) == pytest.approx(log_evidences((none,), put_right, straight))
    (evidence, errors), (there, expected) = (
        swap.terms.left_out(swap.residual_under_labels(base, mixed)),
        none.terms.left_out(straight),
    )
    assert evidence == pytest.approx(there[order])
    assert errors == pytest.approx(expected[order])
