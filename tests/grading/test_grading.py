"""Grading: probabilities against independent integration and draws, figures against their formulas, pairs by hand."""

from __future__ import annotations

import csv
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from bayesplate.board.material import derived_quantities, moduli
from bayesplate.grading.boards import BoardRow
from bayesplate.grading.figures import FIGURES, box_probability, target_thickness
from bayesplate.grading.matching import GradingRequest, grade, proposed_pairs
from bayesplate.grading.tables import MOST_ON_TERMINAL, doubts_sentence, grading_tables, write_grading
from bayesplate.results.contract import JOINT_NAMES, JointMoments

INF = np.inf


@pytest.fixture(scope="module")
def values() -> dict[str, np.ndarray]:
    """Draws of a spruce board whose thickness is known to 1 %, which moves all its moduli together."""
    rng = np.random.default_rng(4)
    n = 40_000
    D = {name: at * np.exp(0.01 * rng.standard_normal(n)) for name, at in (("D_x", 25.0), ("D_y", 2.0), ("D_s", 5.0))}
    thickness = 3e-3 * np.exp(0.01 * rng.standard_normal(n))
    found = moduli(D["D_x"], D["D_y"], D["D_s"], thickness, 0.4)
    density = 440.0 * np.exp(0.02 * rng.standard_normal(n))
    return {**D, **found._asdict(), "density": density, "thickness": thickness}


def test_the_joint_distribution_is_that_of_the_logarithms(values):
    joint = JointMoments.of_values(values)
    logs = np.log([values[name] for name in JOINT_NAMES])

    np.testing.assert_allclose(joint.log_mean, logs.mean(axis=1), rtol=1e-12)
    np.testing.assert_allclose(joint.log_covariance, np.cov(logs), rtol=1e-9, atol=1e-15)


def test_figures_are_what_the_draws_give(values):
    """Mean and sd of each logarithm, exactly: a product of powers is a sum of logarithms."""
    joint = JointMoments.of_values(values)
    mean, covariance = np.array([joint.log_mean]), np.array([joint.log_covariance])
    constants = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], 0.4)
    by_hand = {name: item.values for name, item in derived_quantities(constants, values["density"]).items()} | values

    for name, figure in FIGURES.items():
        log_mean, log_sd = figure.log(mean, covariance)
        assert log_mean[0] == pytest.approx(np.log(by_hand[name]).mean(), abs=1e-12), name
        assert log_sd[0] == pytest.approx(np.log(by_hand[name]).std(ddof=1), rel=1e-6), name
    wanted = values["thickness"] * (20.0 / values["D_x"]) ** (1.0 / 3.0)
    log_mean, log_sd = target_thickness(20.0).log(mean, covariance)
    assert log_mean[0] == pytest.approx(np.log(wanted).mean(), abs=1e-12)
    assert log_sd[0] == pytest.approx(np.log(wanted).std(ddof=1), rel=1e-6)


def test_a_figure_that_is_exact_is_within_limits_or_not_whatever_rounding_leaves_of_its_variance():
    """Thickness by (ln D_s - ln G_xy) / 3 of draws of one thickness: a variance of a few 1e-20 of either sign."""
    mean, covariance = np.array([[0.0], [2.0], [0.0]]), np.array([[[-1e-20]], [[-1e-20]], [[1e-20]]])
    assert box_probability(mean, covariance, np.array([-1.0]), np.array([1.0])) == pytest.approx([1.0, 0.0, 1.0])


BOXES = [
    ([0.0], [[1.0]], [-1.0], [1.0]),
    ([0.3, -0.2], [[1.0, 0.8], [0.8, 2.0]], [-1.0, -INF], [0.5, 0.4]),
    ([0.0, 0.0, 0.0], [[1.0, 0.9, 0.7], [0.9, 1.0, 0.8], [0.7, 0.8, 1.0]], [-0.5] * 3, [0.5] * 3),
    ([3.0, 0.0], [[1.0, -0.5], [-0.5, 1.0]], [-0.5, -0.5], [0.5, 0.5]),
]


@pytest.mark.parametrize(("mean", "covariance", "low", "high"), BOXES)
def test_the_probability_of_a_box_is_that_of_an_independent_integration(mean, covariance, low, high):
    from scipy.stats import multivariate_normal

    low_, high_ = (np.where(np.isinf(end), 40.0 * np.sign(end), end) for end in (low, high))
    expected = multivariate_normal(mean, covariance, seed=1).cdf(high_, lower_limit=low_)
    found = box_probability(np.array([mean]), np.array([covariance]), np.array(low), np.array(high))

    assert found[0] == pytest.approx(expected, abs=1e-3)


def test_numbers_that_follow_from_one_another_are_no_obstacle():
    """Wave speed follows from stiffness and density: a singular covariance."""
    covariance = np.array([[1.0, 1.0], [1.0, 1.0]])
    found = box_probability(np.zeros((1, 2)), covariance[None], np.array([-1.0, -0.5]), np.array([1.0, 3.0]))

    assert found[0] == pytest.approx(0.8413447 - 0.3085375, abs=1e-3)


def boards(values, factors) -> list[BoardRow]:
    """Boards like one, their moduli multiplied, the third one known ten times less well."""
    joint = JointMoments.of_values(values)
    rows = []
    for i, factor in enumerate(factors):
        mean = np.array(joint.log_mean) + np.log([*factor, *factor, 1.0])
        wider = np.array(joint.log_covariance) * (100.0 if i == 2 else 1.0)
        rows.append(BoardRow(f"b{i}", "fitted", joint=JointMoments(JOINT_NAMES, tuple(mean), tuple(map(tuple, wider)))))
    return [*rows, BoardRow("bad", "refused", "=cmd()")]


def test_pairs_match_with_the_probability_that_draws_give(values):
    """The likeliest first, each board once; the probability as by drawing both boards."""
    rows = boards(values, [(1.0, 1.0, 1.0), (1.06, 0.96, 1.0), (1.0, 1.0, 1.02), (2.0, 1.0, 1.0)])
    graded = grade(rows, GradingRequest())
    a, b = rows[0].joint, rows[1].joint
    rng = np.random.default_rng(1)
    drawn = [rng.multivariate_normal(one.log_mean, one.log_covariance, 200_000)[:, :3] for one in (a, b)]
    expected = np.mean((np.abs(drawn[0] - drawn[1]) <= np.log(1.1)).all(axis=1))

    (pair,) = graded.pairs
    assert (pair.first, pair.second) == (0, 1)
    assert 0.5 < expected < 0.95
    assert pair.probability == pytest.approx(expected, abs=0.004)
    assert graded.partners == {0: (1, pair.probability), 1: (0, pair.probability)}


def test_a_wide_board_matches_less_probably_than_a_near_one_and_tolerance_decides(values):
    rows = boards(values, [(1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.15, 1.0, 1.0)])

    assert [(p.first, p.second) for p in grade(rows, GradingRequest()).pairs][:1] == [(0, 1)]
    assert grade(rows, GradingRequest({"E_x": 0.01})).pairs == ()
    assert len(grade(rows, GradingRequest({"E_x": 100.0})).pairs) == 2
    assert grade(rows, GradingRequest({})).pairs == ()


def test_no_pair_that_may_match_is_passed_over(monkeypatch):
    """The same pairs as by all boards beside all, in small lots that differ much and are known badly.

    A few are integrated together, which changes none of them.
    """
    monkeypatch.setattr("bayesplate.grading.figures._CHUNK_SIZE", 3)
    rng = np.random.default_rng(3)
    width = np.full(2, np.log(1.1))
    least = 1.0
    for _ in range(30):
        mean, root = 0.2 * rng.standard_normal((12, 7)), 0.1 * rng.standard_normal((12, 7, 7))
        covariance = root @ root.transpose(0, 2, 1) / 7.0
        first, second = np.triu_indices(12, 1)
        apart, both = mean[first] - mean[second], covariance[first] + covariance[second]
        found = box_probability(apart[:, :2], both[:, :2, :2], -width, width)
        expected, taken = [], set()
        for i in np.argsort(-found, kind="stable"):
            pair = (int(first[i]), int(second[i]))
            if found[i] >= 0.05 and not taken & set(pair):
                expected.append(pair)
                taken |= set(pair)
                least = min(least, found[i])

        pairs = proposed_pairs(mean, covariance, {"E_x": 10.0, "E_y": 10.0})

        assert [(pair.first, pair.second) for pair in pairs] == expected
    assert least < 0.06


def test_no_two_boards_that_match_are_left_without_a_partner():
    """Of boards that are all alike each has many neighbours that found a partner earlier."""
    rng = np.random.default_rng(1)
    for n in (14, 60, 200):
        mean = 0.03 * rng.standard_normal((n, 7))
        covariance = np.broadcast_to(0.03**2 * np.eye(7), (n, 7, 7))
        pairs = proposed_pairs(mean, covariance, {"E_x": 10.0, "E_y": 10.0})
        left = sorted({*range(n)} - {one for pair in pairs for one in (pair.first, pair.second)})
        width = np.full(2, np.log(1.1))
        for k, one in enumerate(left):
            for other in left[k + 1 :]:
                apart = mean[None, one, :2] - mean[None, other, :2]
                assert box_probability(apart, 2.0 * covariance[:1, :2, :2], -width, width)[0] < 0.05
        assert [pair.probability for pair in pairs] == sorted((pair.probability for pair in pairs), reverse=True)
    assert len(left) < 4


def test_pairs_take_memory_in_proportion_to_the_boards(monkeypatch):
    """All beside all would take the square: 2 MB for each figure of five hundred."""
    monkeypatch.setattr("bayesplate.grading.figures._CHUNK_SIZE", 8)
    rng = np.random.default_rng(3)
    mean = 0.1 * rng.standard_normal((500, 7))
    covariance = np.broadcast_to(1e-4 * np.eye(7), (500, 7, 7))

    def peak(n: int) -> int:
        tracemalloc.start()
        try:
            proposed_pairs(mean[:n], covariance[:n], {"E_x": 10.0, "E_y": 10.0})
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(50)  # what is imported and kept

    assert peak(500) < 2.5 * peak(250)


def test_limits_are_met_with_the_share_of_the_draws_that_lie_within(values):
    """Within 1 %: the draws are log-normal but for a small curvature of the moduli."""
    limits = {"E_x": (None, float(np.quantile(values["E_x"], 0.7))), "density": (435.0, 450.0)}
    graded = grade(boards(values, [(1.0, 1.0, 1.0)]), GradingRequest(limits=limits))
    within = {
        "E_x": values["E_x"] <= limits["E_x"][1],
        "density": (values["density"] > 435) & (values["density"] < 450),
    }

    for name, inside in within.items():
        assert graded.limit_probabilities[name][0] == pytest.approx(inside.mean(), abs=0.01)
    assert graded.all_limits_probability[0] == pytest.approx((within["E_x"] & within["density"]).mean(), abs=0.01)


def test_tables_for_people_and_for_sheets(values, tmp_path):
    rows = boards(values, [(1.0 + i / 100, 1.0, 1.0) for i in range(30)])
    graded = grade(rows, GradingRequest(limits={"E_x": (10e9, None)}, rigidity=20.0))
    tables = grading_tables(graded, MOST_ON_TERMINAL)

    assert set(tables) == {"constants", "makers", "limits", "pairs"}
    assert tables["constants"].title.endswith("the first 20 of 30")
    assert "thickness for D_x = 20 N m, mm" in tables["makers"].columns
    assert tables["limits"].columns == ("board", "E_x from 10 GPa")
    write_grading(tmp_path, graded)
    header, *lines = (tmp_path / "grading.csv").read_text().splitlines()
    assert header.startswith("name,E_x_q50,E_x_q05,E_x_q95,")
    assert header.endswith("_thickness_q95,probability_E_x,probability_all_limits,partner,probability_of_match,doubt")
    assert len(lines) == 30
    assert grading_tables(grade(rows[-1:], GradingRequest())) == {}


def test_a_board_in_doubt_is_marked_and_the_last_and_neither_paired_nor_counted(values, tmp_path):
    """The doubtful one is the likeliest partner of the first, and would be the first among those within the limits."""
    same = boards(values, [(1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.04, 1.0, 1.0)])
    limits = {"E_x": (None, 50e9)}
    rows = [replace(same[0], name="z-0"), replace(same[1], name="a-1", doubt="20 Hz too high"), *same[2:4]]
    graded = grade(rows, GradingRequest(limits=limits))
    tables = grading_tables(graded, MOST_ON_TERMINAL)

    assert {p.first for p in graded.pairs} | {p.second for p in graded.pairs} <= {0, 2, 3}
    assert (graded.pairs[0].first, graded.pairs[0].second) == (0, 3)
    assert [row[0] for row in tables["constants"].texts] == ["b3", "z-0", "b2", "a-1 ?"]
    assert tables["constants"].title.endswith("; ? in doubt")
    assert "a-1" not in {row[0].split()[0] for row in tables["limits"].texts}
    assert tables["doubts"].rows == (("a-1", "20 Hz too high"),)
    assert doubts_sentence(graded).startswith("1 board is in doubt")
    write_grading(tmp_path, graded)
    with (tmp_path / "grading.csv").open() as stream:
        assert [row["doubt"] for row in csv.DictReader(stream)] == ["", "20 Hz too high", "", ""]

    every = grade([replace(row, doubt="?") for row in rows], GradingRequest(limits=limits))
    assert "limits" not in grading_tables(every)
    assert every.pairs == ()
    assert doubts_sentence(grade(same, GradingRequest())) == ""
