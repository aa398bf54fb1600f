"""The example on the percentile method: the printed table, and what its spread is worth where the truth is known."""

from __future__ import annotations

import numpy as np
import pytest

N_BOARDS = 24
# The paper's table of results: means in Pa, sds in per cent; 310 Hz here, 311 there moves them by up to 0.4.
PRINTED = {
    "finnish-spruce-cantilever": {"E_x": (13.0e9, 2.8), "E_y": (702e6, 2.2), "G_xy": (668e6, 4.1)},
    "fiemme-spruce-clamped": {"E_x": (10.4e9, 1.73), "E_y": (1003e6, 3.7), "G_xy": (530e6, 14)},
}
# Exact re-solves with an independent solver: what ignored shear does to the constants of a cantilever, per cent.
BIAS = {"E_x": -0.9, "E_y": -4.4, "G_xy": -6.7}
POSTERIOR, DECLARED = "posterior, thin plate", "posterior, shear declared"


@pytest.fixture(scope="module")
def numbers(load, tmp_path_factory):
    folder = tmp_path_factory.mktemp("percentile")
    found = load("percentile_comparison").run(folder, n_boards=N_BOARDS)
    assert sorted(path.name for path in folder.iterdir()) == [f"percentiles-{card}.png" for card in sorted(PRINTED)]
    return found


def cover(scores, level):
    """Coverage over the three constants together, and its standard error if the boards alone were independent."""
    share = np.mean([scores[name][f"cover_{level}"] for name in BIAS])
    return share, np.sqrt(int(level) / 100 * (1 - int(level) / 100) / N_BOARDS)


def test_the_printed_table(numbers):
    for card, printed in PRINTED.items():
        rows = numbers["measured"][card]
        assert rows["n_subsets"] == 42
        for name, (mean, sd_percent) in printed.items():
            assert rows[name]["percentile"]["mean"] == pytest.approx(mean, rel=0.008), (card, name)
            assert rows[name]["percentile"]["sd_percent"] == pytest.approx(sd_percent, abs=0.5), (card, name)


@pytest.mark.parametrize("method", ["percentile", POSTERIOR])
def test_plain_noise_leaves_no_bias_and_an_honest_spread_and_a_hidden_effect_is_not_seen(numbers, method):
    """Within four standard errors of the mean; the stated sd within a third of the spread over boards.

    The bias by the hidden effect is the one of exact re-solves, to 1.5 points; the 68 % intervals hold the truth in a
    third of cases.
    """
    plain, hidden = (numbers["simulated"][case][method] for case in ("noise", "hidden shear"))

    for name, bias in BIAS.items():
        one = plain[name]
        assert abs(one["bias_percent"]) < 4 * one["spread_percent"] / np.sqrt(N_BOARDS), name
        assert one["stated_percent"] == pytest.approx(one["spread_percent"], rel=0.4), name
        assert hidden[name]["bias_percent"] == pytest.approx(bias, abs=1.5), name
    assert max(hidden[name]["cover_68"] for name in ("E_y", "G_xy")) < 0.4


def test_as_an_interval_the_spread_is_short_and_the_posterior_is_not(numbers):
    """As so few boards can tell: short of 90 % by more than two standard errors, of 68 % by some."""
    by_method = numbers["simulated"]["noise"]
    for level, n_errors in (("68", 0), ("90", 2)):
        percentile, error = cover(by_method["percentile"], level)
        posterior, _ = cover(by_method[POSTERIOR], level)

        assert 0.4 < percentile < int(level) / 100 - n_errors * error, level
        assert abs(posterior - int(level) / 100) < 2 * error, level


def test_declaring_the_effect_helps_only_where_it_is(numbers):
    """The negative control: declared on boards without shear, it is the bias of the opposite sign.

    Importance sampling leaves enough draws.
    """
    present, absent = (numbers["simulated"][case][DECLARED] for case in ("hidden shear", "noise"))
    share, error = cover(present, "68")

    assert all(abs(present[n]["bias_percent"]) < 4 * present[n]["spread_percent"] / np.sqrt(N_BOARDS) for n in BIAS)
    assert abs(share - 0.68) < 2 * error
    assert absent["G_xy"]["bias_percent"] == pytest.approx(-BIAS["G_xy"], abs=1.5)
    assert absent["G_xy"]["cover_90"] < 0.5
    for methods in numbers["simulated"].values():
        assert min(methods[name]["fewest_effective_draws"] for name in (POSTERIOR, DECLARED)) > 200
