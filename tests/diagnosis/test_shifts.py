"""Tables of shifts against boards that are solved in full and fitted again, at sizes that are no points of the grid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from full_refits import full_refit
from made_searches import baseline

from bayesplate.diagnosis import joint, shifts
from bayesplate.diagnosis.laws import FormLaw, form_law
from bayesplate.diagnosis.search import prepare_search, run_search
from bayesplate.diagnosis.shifts import refitted_shifts, tabulate
from bayesplate.diagnosis.signatures import Signature, signatures
from bayesplate.frequencies.laws import cents

CENT = 1.0
FAR = 0.7
"""Change of ln D up to which the reduced law of a form holds: it is trained within three sd of the fit."""
_LIKELY = 2.0


def random_place(form, rng):
    """Standard coordinates of the free parameters: (1, n_parameters) array, within two sd and the bounds."""
    place = []
    for free in form.free:
        bounds = (free.prior.standard(bound) for bound in (free.prior.lower, free.prior.upper))
        low, high = (np.clip(float(bound), -_LIKELY, _LIKELY) for bound in bounds)
        place.append(rng.uniform(low, high))
    return np.array(place).reshape(1, -1)


def on_tangent(table, form, z):
    """The table's shift at a place of the first form: from the nearest cell along its tangents, in half cells."""
    own = np.flatnonzero(table.form == 0)
    n = len(form.free)
    at = table.z[own][:, :n]
    nearest = int(np.argmin(((at - z) ** 2).sum(axis=1)))
    half = [0.5 * np.min(np.diff(np.unique(at[:, i]))) for i in range(n)]
    return table.shift[own[nearest]] + table.slopes[own[nearest], :, :n] @ ((z[0] - at[nearest]) / half)


def test_every_effect_on_the_cantilever_is_as_full_solves_have_it(finnish_few):
    """The first form of each, at a random size."""
    base, rng, shown = finnish_few.ground.baseline, np.random.default_rng(1), 0
    for name, one in finnish_few.ground.candidates.items():
        form = one.laws[0].form
        z = random_place(form, rng)
        sizes = {free.name: float(free.prior.value(z[0, i])) for i, free in enumerate(form.free)}
        exact, moved = full_refit(base, form.board, sizes, 1 / base.scales)
        assert np.abs(moved).max() < FAR, name
        assert np.abs(cents(on_tangent(one.fine, form, z) - exact)).max() < CENT, name
        shown += np.abs(cents(exact)).max() > 5.0 * CENT
    assert shown >= 3  # else the comparison would say nothing


class NoPlate(FormLaw):
    """Frequencies of an effect that leaves no plate whatever its size, as a Poisson ratio beyond what D_y allows."""

    def mode_log_frequencies(self, baseline, log_rigidities, values):
        return np.full((len(log_rigidities), baseline.possible_modes.log_frequency.size), np.nan)


def test_an_effect_that_leaves_no_plate_is_not_tried(finnish_few):
    def solve(base, form):
        laws = {} if form.effect == "poisson_ratio" else finnish_few.ground.candidates[form.effect].laws
        return next((law for law in laws if law.form.detail == form.detail), NoPlate(form, ()))

    pair = ("poisson_ratio", "fluid_loading")
    for tried, left in ((pair, ["fluid_loading"]), (pair[:1], [])):
        found = run_search(prepare_search(finnish_few.ground.baseline, solve, effects=tried))
        assert list(found.ground.candidates) == left
        assert found.probability.sum() == pytest.approx(1.0)


def test_shear_is_too_dear_to_be_solved_with_another(finnish_few):
    """Each such pair takes minutes to solve on a board with many peaks."""
    laws = {name: one.laws[0] for name, one in finnish_few.ground.candidates.items()}
    assert not joint._is_thin(laws["transverse_shear"])
    assert joint._is_thin(laws["clamp_translation"])


def test_the_constants_absorb_nothing_of_what_is_tabulated(finnish_few):
    """To a cent, at sizes up to one sd; beyond, the step that serves the bare board may not settle."""
    base = finnish_few.ground.baseline
    for one in finnish_few.ground.candidates.values():
        kept = np.abs(one.fine.z).max(axis=1, initial=0.0) <= 1.0
        assert np.abs(cents(one.fine.shift[kept] @ base.absorption.T)).max() < CENT


def test_the_cells_hold_the_prior(finnish_few):
    """Mean of the size over cells is the prior's, at the accuracy of the middle rule and of a reach of three sd."""
    for one in finnish_few.ground.candidates.values():
        assert (one.fine.weights.sum(), one.coarse.weights.sum()) == pytest.approx((1.0, 1.0))
    one = finnish_few.ground.candidates["clamp_translation"]
    (free,) = one.laws[0].form.free
    for cells, accuracy in ((one.fine, 0.01), (one.coarse, 0.02)):
        mean = float(cells.weights @ free.prior.value(cells.z[:, 0]))
        assert mean == pytest.approx(free.prior.sd * np.sqrt(2 / np.pi), rel=accuracy)


def test_a_side_of_two_cells_is_solved_once_and_is_that_of_a_refit_there(finnish_few, monkeypatch):
    base = finnish_few.ground.baseline
    (law,) = finnish_few.ground.candidates["thickness_profile"].laws
    solved = []
    monkeypatch.setattr(shifts, "refitted_shifts", lambda *call: solved.append(len(call[2])) or refitted_shifts(*call))
    table = tabulate(base, [law], (5, 3, 27))
    assert solved == [3 * 3 + 2 * 3 * 4]  # three cells along each parameter, and four sides around and between them
    for cell in (0, table.n_cells - 1):
        for k in range(2):
            side = table.z_slopes[cell] * (np.arange(2) == k)
            above, below = (refitted_shifts(base, law, table.z[[cell]] + sign * side) for sign in (1.0, -1.0))
            assert table.slopes[cell, :, k] == pytest.approx(0.5 * (above[0] - below[0])[0], abs=1e-9)
            assert table.moved_slopes[cell, :, k] == pytest.approx(0.5 * (above[1] - below[1])[0], abs=1e-9)


def test_a_law_made_for_another_board_serves_once_its_modes_are_placed(finnish_few):
    """The same sizes, constants half as large again: made there with a wide region, placed here."""
    base, own = finnish_few.ground.baseline, finnish_few.ground.candidates["fluid_loading"]
    elsewhere = base.log_rigidities + np.array([0.3, -0.2, 0.1])
    values = {**base.values, **dict(zip(("D_x", "D_y", "D_s"), np.exp(elsewhere), strict=True))}
    far = replace(base, log_rigidities=elsewhere, values=values)
    placed = form_law(far, own.laws[0].form, half_width=0.8).with_modes_of(base)
    assert tabulate(base, [placed]).shift == pytest.approx(own.fine.shift, abs=CENT * np.log(2) / 1200)


def test_signatures_and_tables_tell_the_same_of_every_effect(finnish_few):
    """`check` and `diagnose` show the same numbers, from full solves and from reduced models."""
    ground, problem = finnish_few.ground, finnish_few.problem
    for name, one in ground.candidates.items():
        (here,) = signatures(problem, [name])
        assert one.signature.raw == pytest.approx(here.raw, abs=0.3), name
        assert one.signature.visible == pytest.approx(here.visible, abs=0.3), name
        assert one.signature.bias_percent == pytest.approx(here.bias_percent, abs=0.1), name
        assert one.signature.detection_limit_cents == pytest.approx(here.detection_limit_cents), name


@pytest.mark.parametrize("weights", [(1.0,) * 6, (8.0, 4.0, 1.0, 1.0, 1.0, 0.5)])
def test_a_visible_part_is_never_larger_than_the_whole_shift(weights):
    """In the weights of the fit. By plain squares it can be: who weighs by them sees the fit make things worse."""
    base = baseline(np.random.default_rng(1))
    scales = base.scales * np.array(weights)
    base.__dict__["scales"] = scales  # as a card with an uncertain reading has them
    shifts = 0.02 * np.random.default_rng(2).standard_normal((200, 6))
    parts = [base.refitted_to(shift)[0] for shift in shifts]

    seen = [Signature("", {}, a, b, {}, scales) for a, b in zip(shifts, parts, strict=True)]
    assert all(one.visible_rms <= one.raw_rms for one in seen)
    plain = [np.linalg.norm(b) > np.linalg.norm(a) for a, b in zip(shifts, parts, strict=True)]
    assert any(plain) is (len(set(weights)) > 1)
    two = Signature("", {}, np.array([3.0, 1.0]), np.zeros(2), {}, np.array([1.0, 2.0]))
    assert two.raw_rms == pytest.approx(np.sqrt((9 + 0.25) / 1.25))
