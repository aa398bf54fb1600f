"""What is left over on all boards alike: how often chance is called clear of zero, and what is done next."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesplate.board.material import ORTHOTROPIC, RIGIDITIES
from bayesplate.board.setup import Setup
from bayesplate.campaign.claim import SharedClaim
from bayesplate.campaign.common import CLEAR_BELOW, _pool_residuals, common_residuals, modes_clear_of_zero
from bayesplate.campaign.diagnosis import next_step, pooled_rms
from bayesplate.campaign.search import CampaignExplanation

N_MODES, N_CAMPAIGNS = 12, 400


def noise(rng, n_boards, offset=0.0):
    """Residuals of every mode of boards that have nothing in common but what is added to the first mode.

    Some modes are missed more than others by a factor; the noise of a board is what all of them tell.
    """
    scale = rng.uniform(3.0, 8.0, n_boards)
    of_modes = np.exp(0.4 * rng.standard_normal(N_MODES))
    residuals = scale[:, None] * of_modes * rng.standard_normal((n_boards, N_MODES))
    residuals[:, 0] += offset
    n_spare = N_MODES - len(RIGIDITIES)
    told = np.sqrt((residuals**2).sum(axis=1) / n_spare)
    return {
        f"({mode},0)": _pool_residuals(
            {f"board {i}": (residuals[i, mode], told[i]) for i in range(n_boards)}, n_boards * n_spare
        )
        for mode in range(N_MODES)
    }


@pytest.mark.parametrize("n_boards", [2, 6])
def test_chance_is_seldom_called_clear_of_zero(n_boards):
    """In one campaign of twenty at most; two errors for each mode call it so in many: the negative control."""
    rng = np.random.default_rng(n_boards)
    campaigns = [noise(rng, n_boards) for _ in range(N_CAMPAIGNS)]
    found = np.mean([bool(modes_clear_of_zero(one)) for one in campaigns])
    each = np.mean([any(abs(m.mean_cents) > 2.0 * m.error_cents for m in one.values()) for one in campaigns])

    assert CLEAR_BELOW == 0.05
    assert found < CLEAR_BELOW + 3.0 * np.sqrt(CLEAR_BELOW / N_CAMPAIGNS)
    assert each > 0.15


def test_an_error_has_the_freedom_of_what_it_is_of():
    """Alike on both boards, it is of the noise, which all their residuals tell; apart, of the scatter between two."""
    alike, apart = (_pool_residuals({"a": (10.0, 5.0), "b": (far, 5.0)}, 18) for far in (11.0, 40.0))

    assert alike.error_cents == pytest.approx(5.0 / np.sqrt(2.0))
    assert (alike.degrees_of_freedom, apart.degrees_of_freedom) == (19, 1)
    assert apart.error_cents == pytest.approx(15.0)


def test_what_all_boards_have_is_clear_of_zero():
    common = noise(np.random.default_rng(1), 6, offset=30.0)

    assert modes_clear_of_zero(common) == ["(0,0)"]
    assert next_step(noise(np.random.default_rng(1), 6), None, 6, is_declared=True) == ""
    for is_declared, told in ((True, "of a card that names nothing shared searches for"), (False, ", for one board")):
        step = next_step(common, None, 6, is_declared=is_declared)
        assert step.startswith("modes (0,0) are off alike on all boards")
        assert told in step


@pytest.mark.parametrize(
    ("refused", "told"),
    [
        (("a",), "measure a again, or take it out of the campaign: it disagrees with the others"),
        (("a", "b"), "measure a and b again, or take them out of the campaign: they disagree with the others"),
        (("a", "b", "c"), "measure a, b and c again: they do not agree on what they share"),
    ],
)
def test_boards_that_refuse_are_to_be_measured_again(refused, told):
    assert next_step({}, SharedClaim(1.0, 1.0, refused, 0, holds=False), 3, is_declared=True) == told


@pytest.mark.parametrize(
    ("board", "where", "each"),
    [("", "the campaign's card", ", for each board one of its own,"), ("a", "the card of a", ", and")],
)
def test_what_boards_have_of_their_own_is_to_be_declared(board, where, each):
    best = CampaignExplanation("one board" if board else "own", ("support_stiffness",), board, 0.0, 0.9)
    nothing = CampaignExplanation("none", (), "", 0.0, 0.04)
    step = next_step({}, None, 6, is_declared=False, verdict="unexplained", explanations=[nothing, best])

    start = f"declare support stiffness on {where}, support_stiffness in its effects beside those that it has{each}"
    assert step.startswith(start)
    assert next_step({}, None, 6, is_declared=False, verdict="none needed", explanations=[best]) == ""


def test_pooled_errors_count_every_mode_once():
    assert pooled_rms({"a": 3.0, "b": 6.0}, {"a": 3, "b": 1}) == pytest.approx(np.sqrt((27.0 + 36.0) / 4.0))


def read(edges, labels, first=(0, 0), name="setup"):
    """What a board with one setup leaves over, 10 cents on each mode, and the board."""
    setup = Setup.from_frequencies(dict.fromkeys(labels, 100.0), edges=edges, first_label=first, name=name)
    rows = tuple(SimpleNamespace(setup=name, label=label, residual_cents=10.0) for label in labels)
    summary = SimpleNamespace(modes=rows, noise={name: SimpleNamespace(q50=0.003)})
    return summary, SimpleNamespace(setup=lambda _: setup, symmetry=ORTHOTROPIC)


def pooled_of(**boards):
    summaries, there = ({name: one[i] for name, one in boards.items()} for i in (0, 1))
    return {key: tuple(one.boards) for key, one in common_residuals(summaries, there).items()}


def test_a_mode_is_one_where_setups_have_one_name_and_are_held_alike_wherever_labels_begin():
    """Setups have one name where a card gives none: (1,1) of a free plate is no mode of a clamped one."""
    one, both, free = ("(1,1)",), ("(1,1)", "(2,1)"), read("free", ("(1,1)",))
    from_one = read("free", ("(2,2)", "(3,2)"), first=(1, 1))

    assert pooled_of(a=read("free", both), b=read("clamped", both), c=free) == {"FFFF (1,1)": ("a", "c")}
    assert pooled_of(a=read("free", both), b=from_one) == {"(1,1)": ("a", "b"), "(2,1)": ("a", "b")}
    assert pooled_of(a=free, b=free, c=read("free", one, name="hung")) == {"setup (1,1)": ("a", "b")}
