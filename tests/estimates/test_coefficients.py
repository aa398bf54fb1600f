"""The three sources of coefficients: each with its provenance, and what sensitivity does with the energy of shear."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesplate.board.attached import AttachedItem
from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak
from bayesplate.board.shelf import shelf_folder
from bayesplate.commands.prepare import prepare
from bayesplate.errors import InputError
from bayesplate.estimates.coefficients import coefficient_faults
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.estimates.paper import paper_system
from bayesplate.estimates.percentile import percentile_estimate
from bayesplate.labels import Label
from bayesplate.posterior.posing import pose
from bayesplate.results.references import references

FINNISH, FIEMME = "finnish-spruce-cantilever", "fiemme-spruce-clamped"


@pytest.fixture(scope="module")
def estimates():
    """Board and weighted estimate of each card, and of one with shear."""
    cards = ((FINNISH, ()), (FIEMME, ()), (FINNISH, ("transverse_shear",)))
    boards = {one: prepare(*one).board for one in cards}
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


def test_a_table_beside_the_card_is_read_once_from_there(estimates, tmp_path, monkeypatch):
    """Wherever the program was started, and whatever becomes of the file; its numbers are those of the shipped one."""
    (shipped,) = prepare(FINNISH).card.setups
    text = (shelf_folder("coefficients") / f"{shipped.published_coefficients.name}.toml").read_text(encoding="utf-8")
    table = tmp_path / "cards" / "mine.toml"
    table.parent.mkdir()
    table.write_text(text.replace('"paper-cantilever"', '"mine"'), encoding="utf-8")
    card = (shelf_folder("boards") / f"{FINNISH}.toml").read_text(encoding="utf-8")
    own = table.with_name(f"{FINNISH}.toml")
    own.write_text(card.replace('"paper-cantilever"', '"./mine.toml"'), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    prepared = prepare(own)
    table.unlink()
    board, estimate = estimates[FINNISH, ()]

    found = paper_system(prepared.board, weighted_least_squares(prepared.board), compared=False)

    np.testing.assert_array_equal(found.coefficients, paper_system(board, estimate, compared=False).coefficients)
    assert "mine" in found.origins[0].sentence
    data = references(prepared.card, prepared.prior, prepared.board)[2]
    assert any(entry.startswith("coefficients mine:") for entry in data.entries)


def test_a_table_must_fit_a_board_made_without_a_card(estimates):
    """The aspect ratio may differ by one per cent, as it does between measured sides and nominal ones."""
    board, _ = estimates[FINNISH, ()]
    width = board.inputs["length_y"]
    close, far = (board.with_priors({"length_y": width.scaled(s)}) for s in (1.0098, 1.0102))
    readings = board.setups[0].readings
    other = replace(readings[0], label=Label(5, 7))
    renamed = replace(far, setups=(replace(board.setups[0], readings=(other, *readings[1:])),))

    assert coefficient_faults(board) == coefficient_faults(close) == []
    assert [fault.wanted for fault in coefficient_faults(far)] == ["a table of aspect ratio 1.936"]
    assert [fault.wanted for fault in coefficient_faults(renamed)][1:] == ["a table with the labels (5,7)"]
    with pytest.raises(InputError, match=r"published_coefficients: wanted a table of aspect ratio 1\.936"):
        pose(far, load_prior("weakly-informative"))


def test_a_board_without_a_table_has_no_published_coefficients(estimates):
    board, estimate = estimates[FIEMME, ()]
    without = replace(board, setups=(replace(board.setups[0], published_coefficients=None),))
    bare = replace(estimate, models=tuple(
        replace(m, system=replace(m.system, setup=without.setups[0])) for m in estimate.models
    ))  # fmt: skip

    assert paper_system(without, bare).origins[0].source == "sensitivity"
    with pytest.raises(InputError, match=r"wanted the name of a table, got nothing \(take --coefficients sensitivity"):
        paper_system(without, bare, "published")


def test_a_table_is_read_in_its_own_names_of_the_modes(estimates):
    """A laboratory that counts a cantilever's modes from (0,0) has the coefficients of one that begins with (1,0)."""
    board, estimate = estimates[FINNISH, ()]
    (setup,) = board.setups
    readings = tuple(replace(one, label=Label(one.label.m - 1, one.label.n)) for one in setup.readings)
    other = replace(board, setups=(replace(setup, first_label=Label(0, 0), readings=readings),))
    models = (replace(m, system=replace(m.system, setup=other.setups[0])) for m in estimate.models)
    here = paper_system(other, replace(estimate, models=tuple(models)), "published", compared=False)
    there = paper_system(board, estimate, "published", compared=False)

    assert coefficient_faults(other) == []
    np.testing.assert_array_equal(here.coefficients, there.coefficients)
    assert list(here.origins[0].r_squared.values()) == list(there.origins[0].r_squared.values())
    assert list(here.origins[0].r_squared) == list(other.setups[0].labels)


def test_a_training_is_around_the_printed_material_and_has_the_poisson_ratio_of_the_board(estimates):
    """With that of the named table the moduli would be 1 to 2 % off, where the board's own is 0.3."""
    board, _ = estimates[FINNISH, ()]
    other = board.with_priors({"poisson_xy": 0.3})
    estimate = weighted_least_squares(other)
    systems = [paper_system(other, estimate, source) for source in ("sensitivity", "training", "published")]
    one_solve, trained, _ = (np.array(system.moduli(system.solve())) for system in systems)

    (origin,) = systems[1].origins
    np.testing.assert_allclose(trained, one_solve, rtol=0.005)
    assert "those of paper-cantilever" in origin.sentence
    assert min(origin.r_squared.values()) > 0.99, origin.r_squared
    assert "its nu_xy is 0.51, the board's 0.3" in systems[2].origins[0].sentence
    assert "nu_xy" not in paper_system(board, estimates[FINNISH, ()][1]).origins[0].sentence


def test_a_table_says_which_effects_of_the_board_its_plates_lack(estimates):
    board, _ = estimates[FINNISH, ()]
    (setup,) = board.setups
    sensor = AttachedItem("accelerometer", ((0.24, 0.02),), Quantity.exact(0.003))
    loaded = prepare(replace(board, setups=(replace(setup, attached=(sensor,)),))).board
    estimate = weighted_least_squares(loaded)

    for source, told in (("published", True), ("training", True), ("sensitivity", False)):
        (origin,) = paper_system(loaded, estimate, source, compared=False).origins
        assert ("its plates have no attached mass" in origin.sentence) == told
    sheared, estimate = estimates[FINNISH, ("transverse_shear",)]
    assert "have no" not in paper_system(sheared, estimate, compared=False).origins[0].sentence


def test_a_peak_of_a_mode_that_the_table_lacks_is_left_out(estimates):
    """(3,0) of the paper's board at 898 Hz: the fit proposes that label, and the printed table ends at (2,2)."""
    board, _ = estimates[FINNISH, ()]
    (setup,) = board.setups
    peak = Peak(Quantity.exact(898.0))
    with_peak = prepare(replace(board, setups=(replace(setup, peaks=(peak,)),))).board
    problem = pose(with_peak, load_prior("weakly-informative"))
    system = paper_system(problem.board, problem.estimate)
    alone = paper_system(board, estimates[FINNISH, ()][1])

    assert problem.board.setups[0].labels == (*setup.labels, Label(3, 0))
    np.testing.assert_array_equal(system.coefficients, alone.coefficients)
    np.testing.assert_array_equal(system.psi, alone.psi)
    assert system.origins[0].sentence == alone.origins[0].sentence
    assert paper_system(problem.board, problem.estimate, "sensitivity").psi.size == len(setup.labels) + 1


def test_fewer_modes_than_constants_have_no_percentiles(estimates):
    board, estimate = estimates[FINNISH, ()]
    system = paper_system(board, estimate, compared=False)

    assert percentile_estimate(replace(system, psi=system.psi[:2], coefficients=system.coefficients[:2])) is None
