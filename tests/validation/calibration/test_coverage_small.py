"""Coverage of planted effects: its arithmetic, and a few boards that show the road from the prior to the interval."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from generator.designs import DESIGNS, MEDIANS
from scipy import stats
from validation.calibration.cases import CASES, effect_of
from validation.calibration.coverage import NOMINAL, Count, counts, holds, judge, study
from validation.calibration.planted import (
    Settings,
    cover_one,
    draw_truth,
    fitted,
    identity,
    intervals,
    prepared,
    unread,
)
from validation.calibration.records import read_done

from bayesplate.commands.prepare import prepare
from bayesplate.effects import EFFECTS
from bayesplate.posterior.posing import pose

SHORT = Settings(n_ensembles=2, n_walkers=12, gate_taus=10.0, ess_min=100.0)
EFFECT_NAMES = ("membrane_tension", "clamp_rotation")
FREE_TOO, PLACE = "clamp_rotation, board free too", (0.1, 0.1)


@pytest.fixture(scope="module")
def boards():
    """One board with each of two effects, by a sampler that stops early."""
    return [cover_one(SHORT, effect, 0) for effect in EFFECT_NAMES]


def test_a_board_gives_an_interval_for_everything_that_was_drawn(boards):
    for effect, record in zip(EFFECT_NAMES, boards, strict=True):
        assert "error" not in record
        found = record["quantities"]
        (own,) = (name for name in found if name.startswith(f"{effect}."))
        assert set(found) == {"E_x", "E_y", "G_xy", "poisson_xy", "noise", own}
        assert found[own]["narrowing"] < 0.7  # the readings tell it
        for name, interval in found.items():
            assert interval["q05"] < interval["q50"] < interval["q95"], name


def test_the_truth_of_a_few_boards_lies_where_their_intervals_say(boards):
    """Each within the central interval that twelve right ones leave once in a thousand; so many of 90 % as are due.

    Intervals of a third of the width would not pass.
    """
    intervals = [one for record in boards for one in record["quantities"].values()]
    n, level = len(intervals), 1e-3
    widths = stats.norm.isf(0.5 * level / n) / (2.0 * stats.norm.isf(0.05))  # in widths of the 90 % interval
    off = np.array([abs(one["truth"] - one["q50"]) / (one["q95"] - one["q05"]) for one in intervals])
    assert n == 12
    assert widths == pytest.approx(3.93 / 3.29, abs=0.01)
    assert off.max() < widths
    assert sum(map(holds, intervals)) >= stats.binom.ppf(level, n, NOMINAL)
    assert np.sum(off < 0.5 / 3) < stats.binom.ppf(level, n, NOMINAL)


@pytest.mark.parametrize("name", CASES)
def test_the_truth_of_every_case_can_be_drawn(name, tmp_path):
    design = DESIGNS[CASES[name].design]
    truth = draw_truth(name, prepared(tmp_path, name, unread(design), PLACE), PLACE, np.random.default_rng(1))
    read = [hertz for one in truth.hertz.values() for hertz in one.values()]
    assert len(read) == sum(len(setup.beams) for setup in design.setups)
    assert min(read) > 0


def test_an_interrupted_run_goes_on(boards, tmp_path):
    out = tmp_path / "coverage.jsonl"
    lines = [json.dumps(identity(SHORT)), *(json.dumps(record) for record in boards)]
    out.write_text("\n".join(lines) + "\n" + lines[-1][:50])  # killed while it wrote another
    assert study(SHORT, EFFECT_NAMES, 1).run(out, 1, quiet=True) == boards
    with pytest.raises(SystemExit, match="made with another design"):
        read_done(out, identity(Settings()))


def test_truth_and_card_share_their_priors(tmp_path):
    """Every effect with a parameter has a case; its card leaves all of them, nu_xy and the noise uncertain."""
    assert set(map(effect_of, CASES)) == set(EFFECTS) - {"outline_profile"}  # which is read, and has no parameter
    for name, case in CASES.items():
        board = prepared(tmp_path, name, unread(DESIGNS[case.design]), (0.1, 0.1))
        declared = EFFECTS[effect_of(name)].of(board.board, board.board.setups[0])
        keys = {parameter.name for parameter in declared.parameters()}
        clamped = {f"{other}[{board.board.setups[0].name}]" for other in case.others}
        assert set(board.board.uncertain_inputs) == keys | {"poisson_xy"} | clamped
        assert {n: (d.median, d.factor) for n, d in board.prior.constants.items()} == {
            n: (pytest.approx(median), pytest.approx(factor)) for n, (median, factor) in MEDIANS.items()
        }
        assert board.board.setups[0].noise.median == pytest.approx(0.003)


def made(n, width=1.0, rng_seed=0):
    """Records of an exact posterior: truth standard normal about the reading, of intervals so many times as wide."""
    rng = np.random.default_rng(rng_seed)
    ends = 1.6448536 * width
    records = []
    for i in range(n):
        effect = EFFECT_NAMES[i % 2]
        main = f"{effect}.{CASES[effect].main}[made]"
        quantities = {}
        for name in ("E_x", "E_y", "G_xy", main):
            truth = float(rng.standard_normal())
            quantities[name] = {"truth": truth, "q05": -ends, "q50": 0.0, "q95": ends, "narrowing": 0.5}
        facts = {"seconds": 1.0, "law": "exact", "attempts": 1, "redraws": 0}
        records.append({"effect": effect, "board": i // 2, "quantities": quantities, **facts})
    return records


def test_a_right_fit_is_found_right():
    lines, well = judge(made(200))
    assert well, "\n".join(lines)
    assert lines[-1].startswith("covered: 90 % intervals hold the truth of effect")


@pytest.mark.parametrize("width", [0.75, 1.4], ids=["too narrow", "too wide"])
def test_a_wrong_width_is_caught(width):
    """Of 400 boards: 78 and 98 % are held instead of 90, seven and five binomial errors off."""
    lines, well = judge(made(400, width))
    assert not well
    assert any("OUTSIDE" in line for line in lines)


def test_a_board_without_draws_is_not_passed_over():
    lines, well = judge([*made(200), {"effect": EFFECT_NAMES[0], "board": 100, "error": "NotConvergedError: short"}])
    assert not well
    assert any("NotConvergedError" in line for line in lines)


def test_pooled_boards_count_once_and_are_held_to_84_to_95_percent():
    table = {(count.effect, count.name): count for count in counts(made(200))}
    assert all(table["pooled", name].n == 200 for name in ("effect", "E_x", "E_y", "G_xy"))
    assert [Count("pooled", "effect", held, 200).is_within(1e-9) for held in (167, 168, 190, 191)] == [
        False, True, True, False,
    ]  # fmt: skip
    assert Count("pooled", "effect", 180, 200).band(0.05) == (171, 188)  # binomial quantiles, from a printed table


@pytest.mark.slow
def test_a_board_held_free_as_well_tells_a_soft_clamp_from_one_that_covers_more(tmp_path):
    """Either lowers what the clamp reads; of the cantilever alone E_x, the grip and its give stay open together."""
    rng = np.random.default_rng(1)
    both = prepared(tmp_path, FREE_TOO, unread(DESIGNS[CASES[FREE_TOO].design]), PLACE)
    truth = draw_truth(FREE_TOO, both, PLACE, rng)
    both = prepared(tmp_path, FREE_TOO, truth.hertz, PLACE)
    card = tmp_path / "planted.toml"
    card.write_text("[[setup]]".join(card.read_text().split("[[setup]]")[:2]))
    found = []
    for asked in (both, prepare(card)):
        _, draws, _ = fitted(pose(asked.board, asked.prior), replace(SHORT, n_ensembles=4, n_walkers=32), rng)
        found.append(intervals(asked.board, truth, draws))
    for name in ("clamped_x0[cantilever]", "clamp_rotation.compliance[cantilever]", "E_x"):
        with_free, alone = ({"width": one[name]["q95"] - one[name]["q05"], **one[name]} for one in found)
        assert abs(with_free["truth"] - with_free["q50"]) < with_free["width"]  # 3.3 standard deviations
        assert with_free["width"] < {"E_x": 0.4}.get(name, 0.85) * alone["width"], name
    assert found[1]["clamped_x0[cantilever]"]["narrowing"] > 0.85  # nothing learned of it
