"""The three sources of coefficients: each with its provenance, and what sensitivity does with the energy of shear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesplate.errors import InputError
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.estimates.paper import paper_system
from bayesplate.workflow.prepare import prepare

FINNISH, FIEMME = "finnish-spruce-cantilever", "fiemme-spruce-clamped"


@pytest.fixture(scope="module")
def estimates():
    """Board and weighted estimate of each card, thin and with shear."""
    boards = {(card, e): prepare(card, e).board for card in (FINNISH, FIEMME) for e in ((), ("transverse_shear",))}
    return {key: (board, weighted_least_squares(board)) for key, board in boards.items()}


@pytest.mark.parametrize(
    ("card", "theory", "near", "far"), [(FINNISH, "shear-flexible", 3, 20), (FIEMME, "thin", 4, 8)]
)
def test_the_theory_of_a_printed_table_is_found_out(estimates, card, theory, near, far):
    """The cantilever table contains shear, the clamped one is thin; three printed digits are 1 to 3 cents."""
    board, estimate = estimates[card, ()]
    (origin,) = paper_system(board, estimate).origins
    said = [float(word) for word in origin.sentence.replace(" cents", "").split() if word.replace(".", "").isdigit()]
    by_theory = dict(zip(("thin", "shear-flexible"), said[-2:], strict=True))

    assert (origin.source, origin.theory) == ("published", theory)
    assert by_theory.pop(theory) < near
    assert min(by_theory.values()) > far


def test_training_around_the_printed_material_gives_the_printed_table(estimates):
    """Clamped: a and b within 1 %, as in `tests/paper/test_training.py`, here through a board's card."""
    board, estimate = estimates[FIEMME, ()]
    printed, trained = (paper_system(board, estimate, source) for source in ("published", "training"))

    np.testing.assert_allclose(trained.coefficients[:, :2], printed.coefficients[:, :2], rtol=0.01)
    (origin,) = trained.origins
    assert "those of paper-clamped" in origin.sentence
    assert min(origin.r_squared.values()) > 0.999


@pytest.mark.parametrize("effects", [(), ("transverse_shear",)], ids=["thin", "shear"])
def test_sensitivity_inverts_its_own_plate(estimates, effects):
    """Frequencies of the plate itself give its constants back: the energy of shear is not taken for stiffness."""
    board, estimate = estimates[FINNISH, effects]
    predicted = np.exp(np.log(board.setups[0].measured) - estimate.residuals)
    readings = tuple(
        replace(r, frequency=replace(r.frequency, mean=f))
        for r, f in zip(board.setups[0].readings, predicted, strict=True)
    )
    own = replace(board, setups=(replace(board.setups[0], readings=readings),))

    system = paper_system(own, estimate, "sensitivity")

    np.testing.assert_allclose(system.solve(), estimate.rigidities, rtol=1e-6)
    assert system.origins[0].rest.any() == bool(effects)


def test_a_board_without_a_table_has_no_published_coefficients(estimates):
    board, estimate = estimates[FIEMME, ()]
    without = replace(board, setups=(replace(board.setups[0], published_coefficients=None),))
    bare = replace(estimate, models=tuple(
        replace(m, system=replace(m.system, setup=without.setups[0])) for m in estimate.models
    ))  # fmt: skip

    assert paper_system(without, bare).origins[0].source == "sensitivity"
    with pytest.raises(InputError, match=r"wanted the name of a table, got nothing \(take --coefficients sensitivity"):
        paper_system(without, bare, "published")
