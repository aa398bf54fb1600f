"""What cannot be determined is refused by name, with what would help; what is weakly determined is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, board_of, peaks_of, setup_of

from bayesplate.board.board import Board
from bayesplate.board.material import RIGIDITIES
from bayesplate.board.prior import load_prior
from bayesplate.board.setup import Setup
from bayesplate.commands.prepare import prepare
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.identifiability import (
    identifiability,
    identifiability_remarks,
    require_identifiable,
    require_labels,
)
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.posing import pose


@pytest.fixture(scope="module")
def hertz():
    """Six modes of the paper's cantilever board without noise, by beam orders; its labels begin at (1,0)."""
    return ritz.simulate(ritz.FINNISH, CANTILEVER_LABELS)


def cantilever(hertz, *labels):
    return board_of(ritz.FINNISH, [setup_of(ritz.CANTILEVER, {label: hertz[label] for label in labels})])


def posed(board):
    return pose(board, load_prior("weakly-informative"))


def remarks_of(board):
    """What is said of a board at its estimate, and how well that is known."""
    estimate = weighted_least_squares(board)
    found = identifiability(estimate.sensitivities, estimate.scales)
    return " ".join(identifiability_remarks(board, found)), found


@pytest.mark.parametrize(
    ("n_modes", "words"), [(1, "1 labelled mode for .* 2 more"), (2, "labelled modes for .* 1 more")]
)
def test_fewer_modes_than_constants_are_refused(hertz, n_modes, words):
    with pytest.raises(NotIdentifiableError, match=words) as caught:
        posed(cantilever(hertz, *CANTILEVER_LABELS[:n_modes]))
    assert caught.value.exit_code == 4


def test_a_setup_without_labels_is_refused(hertz):
    board = cantilever(hertz, *CANTILEVER_LABELS)
    bare = replace(board.setups[0], name="bare", readings=(), peaks=peaks_of(50.0, 100.0))
    with pytest.raises(
        NotIdentifiableError, match="'bare' has no labelled mode, and its 2 peaks are none with certainty"
    ):
        require_labels(replace(board, setups=(*board.setups, bare)))


def test_three_modes_that_leave_a_constant_open_name_it_and_what_would_help(hertz):
    """(1,0), (1,1), (2,1) in the paper's labels bend along the grain and twist: nothing bends across it."""
    with pytest.raises(
        NotIdentifiableError, match=r"D_y \(so E_y\).* add a mode that bends across the grain"
    ) as caught:
        posed(cantilever(hertz, (0, 0), (0, 1), (1, 1)))
    message = str(caught.value)
    assert "D_x (so" not in message
    assert "condition number" in message
    _, as_advised = remarks_of(cantilever(hertz, (0, 0), (0, 1), (1, 1), (0, 2)))
    assert as_advised.undetermined_constants() == ()


def test_of_several_setups_each_is_named_with_its_modes(hertz):
    """Two sessions with the same labels: else each label would stand there twice."""
    board = cantilever(hertz, (0, 0), (0, 1), (1, 1))
    (setup,) = board.setups
    unseen = identifiability(np.array([[0.5, 0.0, 0.0], [0.25, 0.0, 0.25], [0.1, 0.0, 0.4]] * 2), np.full(6, 0.01))
    with pytest.raises(NotIdentifiableError) as caught:
        require_identifiable(replace(board, setups=(setup, replace(setup, name="again"))), unseen)
    labels = ", ".join(str(label) for label in setup.labels)
    assert f"the modes {labels} of {setup.name} and {labels} of again determine D_y" in str(caught.value)


def narrow_strip(*labels):
    """A brace of spruce, free, read in modes that bend along the grain."""
    strip = ritz.Plate.from_moduli(12e9, 0.8e9, 0.7e9, 0.4, rho=420.0, h=7e-3, L_x=0.5, L_y=0.02, edges=ritz.ALL_FREE)
    return board_of(strip, [setup_of(ritz.ALL_FREE, dict(ritz.simulate(strip, labels)))])


def test_a_brace_tells_the_constant_along_it_and_is_refused_for_the_others():
    """Each of its modes tells E_x, though the others enter them by a millionth and are open."""
    with pytest.raises(NotIdentifiableError, match=r"D_y \(so E_y\) not at all.*D_s \(so G_xy\) not at all") as caught:
        posed(narrow_strip((2, 0), (3, 0), (4, 0)))
    assert "D_x (so" not in str(caught.value)
    assert "; E_x they tell" in str(caught.value)


def test_of_constants_that_are_open_together_one_at_least_is_named():
    """A direction that no reading sees."""
    unseen = np.array([np.cos(0.7), np.sin(0.7), 0.0])
    seen = 0.5 * (np.eye(3) - np.outer(unseen, unseen))
    found = identifiability(seen, np.full(3, 0.003))
    assert found.undetermined_constants()
    assert (found.errors_beside_known > np.log(2.0) / 1.96).any()


def test_three_modes_that_suffice_leave_nothing_to_check_with(hertz):
    told, found = remarks_of(cantilever(hertz, (0, 0), (0, 1), (0, 2)))
    assert "three modes fix three constants exactly" in told
    assert found.leverages == pytest.approx(np.ones(3), abs=1e-9)
    assert "three modes" not in remarks_of(cantilever(hertz, (0, 0), (0, 1), (0, 2), (1, 1)))[0]


def test_a_mode_that_carries_a_constant_alone_is_named(hertz):
    board = cantilever(hertz, (0, 0), (0, 1), (1, 0), (1, 1), (0, 2))
    told, found = remarks_of(board)
    labels = board.setups[0].labels
    named = [label for label in labels if f"mode {label} alone carries" in told]
    assert named == [one for one, leverage in zip(labels, found.leverages, strict=True) if leverage > 0.9]
    assert (0, 2) in named
    assert (0, 0) not in named


@pytest.mark.parametrize(("name", "told"), [("fiemme-spruce-clamped", True), ("finnish-spruce-cantilever", False)])
def test_a_fully_clamped_board_is_told_what_it_sees(name, told):
    sentences, _ = remarks_of(prepare(name).board)
    assert ("only D_s + 2 nu_xy D_y is seen" in sentences) == told
    assert "G_xy" in sentences or not told


@pytest.mark.parametrize(
    ("edges", "told"),
    [
        (("clamped", "supported", "supported", "clamped"), True),
        (("supported",) * 4, True),
        (("clamped", "free", "supported", "supported"), False),
    ],
)
def test_a_board_with_every_edge_held_is_told_what_it_sees(edges, told):
    """What is told is what the frequencies do: they stay where D_s + 2 nu_xy D_y stays, or not."""
    labels = [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0)]
    hertz = dict(zip(labels, (100, 150, 200, 260, 230), strict=True))
    setup = Setup.from_frequencies(hertz, edges=dict(zip(("x0", "x1", "y0", "y1"), edges, strict=True)))
    board = Board.from_numbers(
        "held", length_x=0.25, length_y=0.18, thickness=0.003, density=450, poisson_xy=0.2, setups=setup
    )
    system = system_of(board, setup)
    values = board.nominal() | dict(zip(RIGIDITIES, np.array([27.0, 3.0, 10.0]), strict=True))
    other = values | {"poisson_xy": np.asarray(0.5), "D_s": np.asarray(10.0 - 2 * (0.5 - 0.2) * 3.0)}
    here, there = ([mode.frequency for mode in spectrum(system, one, 6)[1]] for one in (values, other))
    sentences = " ".join(identifiability_remarks(board, identifiability(0.5 * np.eye(5, 3), np.full(5, 0.01))))

    assert (float(np.abs(1200.0 * np.log2(np.divide(there, here))).max()) < 1e-6) == told
    assert ("is held all round: only D_s + 2 nu_xy D_y is seen" in sentences) == told


def test_a_free_session_tells_what_a_clamped_one_does_not():
    clamped = Setup.from_frequencies({(0, 0): 300, (1, 0): 400, (0, 1): 500}, edges="clamped", name="clamped")
    free = Setup.from_frequencies({(1, 1): 90, (2, 0): 240, (0, 2): 200}, edges="free", name="free")
    board = Board.from_numbers(
        "both", length_x=0.25, length_y=0.18, thickness=0.003, density=450, setups=[clamped, free]
    )
    found = identifiability(0.5 * np.eye(6, 3), np.full(6, 0.01))

    assert "G_xy depends on nu_xy" not in " ".join(identifiability_remarks(board, found))
    alone = replace(board, setups=(clamped,))
    assert "setup clamped is clamped all round" in " ".join(identifiability_remarks(alone, found))


def test_leverages_and_errors_are_those_of_linear_regression():
    rng = np.random.default_rng(1)
    sensitivities, scales = rng.uniform(0, 0.5, (7, 3)), rng.uniform(0.002, 0.01, 7)
    weighted = sensitivities / scales[:, None]
    found = identifiability(sensitivities, scales)
    inverse = np.linalg.inv(weighted.T @ weighted)
    assert found.covariance == pytest.approx(inverse, rel=1e-9)
    assert found.leverages == pytest.approx(np.diagonal(weighted @ inverse @ weighted.T), rel=1e-9)
    assert found.leverages.sum() == pytest.approx(3.0)
    assert found.condition_number == pytest.approx(np.linalg.cond(weighted))
    assert found.undetermined_constants() == ()


@pytest.mark.parametrize(("factor", "blind"), [(1.9, ()), (2.1, ("D_s",))])
def test_blind_is_what_stays_within_no_factor_of_two(factor, blind):
    """Three modes, each of one constant: the 95 % interval of D_s is the estimate times and over the factor."""
    scales = np.array([0.01, 0.01, 0.5 * np.log(factor) / 1.959964])
    assert identifiability(0.5 * np.eye(3), scales).undetermined_constants() == blind


def test_a_direction_that_no_mode_sees_is_infinitely_uncertain():
    sensitivities = np.array([[0.5, 0, 0], [0.25, 0, 0.25], [0.1, 0, 0.4], [0.3, 0, 0.2]])
    found = identifiability(sensitivities, np.full(4, 0.01))
    assert found.condition_number == np.inf
    assert np.isinf(found.standard_errors).all()
    assert found.leverages.sum() == pytest.approx(2.0)
