"""What the prior foretells of frequencies, and readings in another unit that are asked about; honest ones are not."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import cycle

import made_boards
import numpy as np
import pytest
import ritz
from generator.effects import TransverseShear
from generator.naming import frequencies
from generator.plate import Plate

from bayesplate.board.board import Board, board_density, make_board
from bayesplate.board.parameter import BOARD_OWNER
from bayesplate.board.prior import PriorCard, load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Reading
from bayesplate.board.setup import Setup
from bayesplate.board.shelf import card_names
from bayesplate.commands.problem import Problem
from bayesplate.errors import InputError, NotIdentifiableError
from bayesplate.estimates.plausibility import (
    _SLACK,
    FASTEST_SOUND,
    SLOWEST_SOUND,
    PriorPredictive,
    prior_predictive,
    require_plausible,
    speed_and_ratio,
)
from bayesplate.estimates.unusual import HEAVIEST_FIBRES, LIGHTEST_WOOD, MOST_ORTHOTROPIC, unusual_sentences
from bayesplate.labels import Label

PRIORS = ("spruce", "weakly-informative")
LABELS = made_boards.FREE_LABELS[:6]
OTHERS = ("steel-air-water", "foam-panel-exciter", "acrylic-panel")
"""Of no wood: frequencies in a wrong unit make another material of them, and nothing is odd about that."""
SIDES = ("length_x", "length_y")


def board_of(name: str, prior: str) -> Board:
    """A shipped board with its density stated: of a mass, wrong lengths would already give an impossible density."""
    board = Board.from_toml(name).assuming(load_prior(prior))
    if "mass" not in board.inputs:
        return board
    stated = Quantity.exact(float(board_density(board.nominal())))
    own = {one.key: one.prior for one in board.parameters if one.owner == BOARD_OWNER and one.key != "mass"}
    return make_board(board.name, own | {"density": stated}, board.setups)


def with_readings(board: Board, change: Callable[[Reading], Reading], **of_setups: Label) -> Board:
    """The same with every reading changed."""
    setups = (replace(one, readings=tuple(map(change, one.readings)), **of_setups) for one in board.setups)
    return replace(board, setups=tuple(setups))


def read_as(board: Board, factor: float) -> Board:
    """The same with every frequency times a factor."""
    return with_readings(board, lambda one: replace(one, frequency=one.frequency.scaled(factor)))


def measured_as(board: Board, factor: float, names: tuple[str, ...]) -> Board:
    """The same with some lengths, and what clamps cover, times a factor."""
    changed = [one for one in board.parameters if one.name in names or one.owner != BOARD_OWNER]
    return board.with_priors({one.name: one.prior.scaled(factor) for one in changed})


def asked(board: Board, prior: str) -> str:
    """The question; empty where none is asked."""
    try:
        require_plausible(board, load_prior(prior), np.random.default_rng(0))
    except (InputError, NotIdentifiableError) as error:
        return str(error)
    return ""


def foretold(board: Board, prior: PriorCard, rng: np.random.Generator) -> PriorPredictive:
    (found,) = prior_predictive(board, prior, rng)
    assert found is not None
    return found


def test_shipped_boards_are_asked_nothing():
    shipped = [name for name in card_names("boards") if name not in OTHERS and Board.from_toml(name).setups[0].readings]
    told = {name: asked(board_of(name, prior), prior) for name, prior in zip(shipped, cycle(PRIORS))}

    assert len(told) > 12
    assert {name: question for name, question in told.items() if question} == {}


@pytest.mark.parametrize(
    ("name", "prior"), [("finnish-spruce-cantilever", "weakly-informative"), ("fiemme-spruce-clamped", "spruce")]
)
def test_units_are_asked_about(name, prior):
    board = board_of(name, prior)
    speed, _ = speed_and_ratio(board)

    for factor in (0.5, 2.0):  # an octave is no unit
        assert asked(read_as(board, factor), prior) == ""
    for factor in (
        1.05 * FASTEST_SOUND / speed,
        1000.0,
        0.95 * SLOWEST_SOUND / speed,
    ):  # whatever the mistake, no material is so
        told = asked(read_as(board, factor), prior)
        assert "wanted those of a material that carries sound at 50 to 15000 m/s" in told, factor
    assert "in rad/s?" in asked(read_as(board, 2 * np.pi), prior)
    assert "in kHz?" in asked(read_as(board, 1e-3), prior)
    assert "are length_x_mm and length_y_mm in cm?" in asked(measured_as(board, 0.1, SIDES), prior)
    assert "is thickness_mm ten times too small" in asked(measured_as(board, 0.1, ("thickness",)), prior)


@pytest.mark.parametrize(
    ("factor", "names", "question"),
    [
        (0.1, (*SIDES, "thickness"), "are all three lengths in cm?"),
        (10.0, ("thickness",), "is thickness_mm ten times too large"),
        # a density from the card: in inches cubed a mass would be refused before, and in thousandths a thickness too
        (1 / 25.4, SIDES, "are length_x_mm and length_y_mm in inches?"),
        (1 / 25.4, (*SIDES, "thickness"), "are all three lengths in inches?"),
        (39.37, ("thickness",), "is thickness_mm in thousandths of an inch?"),
    ],
)
def test_a_prior_that_knows_the_wood_asks_about_every_unit_of_length(factor, names, question):
    assert question in asked(measured_as(board_of("spruce-free-2R", "spruce"), factor, names), "spruce")


def test_a_setup_without_labels_is_asked_nothing():
    board = board_of("spruce-free-2R", "spruce")
    peaks = replace(board.setups[0], name="other", readings=(), peaks=made_boards.peaks_of(50.0, 70.0))

    assert asked(replace(board, setups=(board.setups[0], peaks)), "spruce") == ""


@pytest.mark.parametrize(
    ("E_x", "E_y", "G_xy", "rho"),
    [(0.006, 0.006, 0.0023, 25), (290.0, 6.0, 5.0, 1600)],
    ids=["expanded foam", "carbon fibre"],
)
def test_materials_from_foam_to_carbon_fibre_are_asked_nothing(E_x, E_y, G_xy, rho):
    """The softest and the stiffest that somebody may tap, GPa, by an independent solver; in rad/s the same boards would
    need sound at up to 85 km/s."""
    moduli = (E_x * 1e9, E_y * 1e9, G_xy * 1e9)
    plate = ritz.Plate.from_moduli(*moduli, 0.3, rho=rho, h=4.7e-3, L_x=0.58, L_y=0.217, edges=ritz.ALL_FREE)
    board = made_boards.board_of(plate, [made_boards.setup_of(ritz.ALL_FREE, ritz.simulate(plate, LABELS))])

    assert asked(board, "weakly-informative") == ""
    speed, _ = speed_and_ratio(board)
    assert SLOWEST_SOUND < speed < FASTEST_SOUND
    assert speed == pytest.approx(np.sqrt(E_x * 1e9 / rho), rel=0.1)  # Rayleigh quotients, 1 - nu^2


@pytest.mark.filterwarnings("error")
def test_a_mistake_that_leaves_nothing_of_a_clamped_board_is_none():
    """A tenth of its length is what the clamp covers."""
    edges = {"x0": "clamped", "x1": "free", "y0": "free", "y1": "free"}
    hertz = {"(0,0)": 500.0, "(0,1)": 900.0, "(1,0)": 2900.0}
    setup = Setup.from_frequencies(hertz, edges=edges, clamped={"x0": 0.02})
    board = Board.from_numbers("clamped", length_x=0.2, length_y=0.1, thickness=2e-3, density=450.0, setups=setup)
    with pytest.raises((InputError, NotIdentifiableError), match="frequencies_hz"):
        require_plausible(board, load_prior("spruce"), np.random.default_rng(0))


def test_the_prior_predictive_is_that_of_the_prior():
    """Its median at the prior's medians, by an independent solver; one constant alone spreads ln f by half its own."""
    prior, board = load_prior("spruce"), board_of("spruce-free-2R", "spruce")
    exact = {name: Quantity.exact(quantity.mean) for name, quantity in board.inputs.items()}
    board = board.with_priors(exact)
    found = foretold(board, prior, np.random.default_rng(1))
    labels = [reading.beams for reading in board.setups[0].readings]
    sizes = {name: quantity.mean for name, quantity in exact.items()}
    plate = ritz.Plate.from_moduli(
        *(prior.constants[name].median for name in ("E_x", "E_y", "G_xy")), sizes["poisson_xy"], rho=sizes["density"],
        h=sizes["thickness"], L_x=sizes["length_x"], L_y=sizes["length_y"], edges=ritz.ALL_FREE,
    )  # fmt: skip
    by_label = ritz.simulate(plate, labels)

    for i, label in enumerate(labels):
        # a median of 4000 draws is off by 1.25 sd / sqrt(4000), a Rayleigh quotient too high by a few per cent
        assert -0.02 < found.median[i] - np.log(by_label[label]) < 0.08
    spread = dict(zip(labels, found.spread, strict=True))
    assert spread[2, 0] == pytest.approx(0.5 * np.log(prior.constants["E_x"].factor), rel=0.05)
    assert spread[0, 2] == pytest.approx(0.5 * np.log(prior.constants["E_y"].factor), rel=0.05)
    assert spread[1, 1] == pytest.approx(0.5 * np.log(prior.constants["G_xy"].factor), rel=0.05)


def test_the_distance_is_chi_squared_where_the_prior_holds():
    """Mean n of boards drawn from it, within three standard errors (the slack widens three directions a little)."""
    prior, board = load_prior("spruce"), board_of("spruce-free-2R", "spruce")
    found = foretold(board, prior, np.random.default_rng(1))
    rng = np.random.default_rng(2)
    drawn = foretold(board, prior, rng).draws[:400]
    distances = [found.distance(row + 0.1 * rng.standard_normal(row.size)) for row in drawn]
    n = drawn.shape[1]

    assert np.mean(distances) == pytest.approx(n, abs=3 * np.sqrt(2 * n / 400) + 0.1)


def of_spruce(E_x: float = 11e9, E_y: float = 0.95e9, **sizes: float) -> tuple[ritz.Plate, Board]:
    """A free guitar half-top of known constants by an independent solver, its mass known and its density not."""
    size = {"L_x": 0.55, "L_y": 0.2, "h": 2.8e-3} | sizes
    plate = ritz.Plate.from_moduli(E_x, E_y, 0.67e9, 0.4, rho=406.0, edges=ritz.ALL_FREE, **size)
    setup = made_boards.setup_of(ritz.ALL_FREE, ritz.simulate(plate, made_boards.FREE_LABELS))
    mass = Quantity.exact(plate.rho * plate.h * plate.L_x * plate.L_y)
    return plate, made_boards.board_of(plate, [setup], mass=mass)


def transposed(board: Board) -> Board:
    """The same with every label (m,n) written as (n,m)."""
    return with_readings(board, lambda one: replace(one, label=Label(one.label.n, one.label.m), beams=one.beams[::-1]))


def with_sizes(board: Board, **metres: float) -> Board:
    return board.with_priors({name: Quantity.exact(value) for name, value in metres.items()})


ORIENTATIONS = {
    "lengths": (lambda b: with_sizes(b, length_x=0.2, length_y=0.55), "are length_x_mm and length_y_mm exchanged"),
    "labels": (transposed, "are all labels (m,n) written as (n,m)?"),
    "grain": (
        lambda b: transposed(with_sizes(b, length_x=0.2, length_y=0.55)),
        "is y along the grain in all of the card? x should be",
    ),
}


@pytest.mark.parametrize("case", ORIENTATIONS)
def test_exchanged_lengths_labels_or_grain_are_asked_about(case):
    change, question = ORIENTATIONS[case]
    _, board = of_spruce()

    assert asked(board, "spruce") == asked(board, "weakly-informative") == ""
    with pytest.raises(NotIdentifiableError, match=re.escape(question)):
        require_plausible(change(board), load_prior("spruce"), np.random.default_rng(0))


def one_more(board: Board, more: tuple[int, int], stated: tuple[int, int] = (0, 0)) -> Board:
    """The same where the labels name modes so many higher, whatever the card states for the first."""

    def renamed(one: Reading) -> Reading:
        i, j = one.beams[0] + more[0], one.beams[1] + more[1]
        return replace(one, label=Label(i + stated[0], j + stated[1]), beams=(i, j))

    return with_readings(board, renamed, first_label=Label(*stated))


@pytest.mark.parametrize(
    ("name", "more", "prior"),
    [
        ("finnish-spruce-cantilever", (1, 0), "weakly-informative"),
        (None, (0, 1), "spruce"),
        (None, (1, 1), "spruce"),
    ],
)
def test_labels_that_count_from_one_are_asked_about_where_the_card_says_otherwise(name, more, prior):
    board = of_spruce()[1] if name is None else board_of(name, prior)

    assert asked(board, prior) == ""
    assert f"then first_label = [{more[0]}, {more[1]}]" in asked(one_more(board, more), prior)
    if more != (1, 1):  # the card says so of the other number alone
        stated = (1 - more[0], 1 - more[1])
        assert "then first_label = [1, 1]" in asked(one_more(board, more, stated), prior)


@pytest.mark.parametrize("case", ["lengths", "grain"])
def test_a_plate_of_no_material_is_refused_under_any_prior_and_no_unit_is_blamed(case):
    """nu_xy nu_yx above 1: such a plate has no frequencies, so there is nothing to be fitted."""
    change, question = ORIENTATIONS[case]
    told = asked(change(of_spruce()[1]), "weakly-informative")

    assert "nu_xy nu_yx is below 1, so E_y below 6.25 E_x" in told
    assert question in told
    assert " cm" not in told
    assert "ten times" not in told


def test_one_reading_that_makes_a_plate_of_no_material_is_asked_about():
    """A decimal place in a mode along the grain: no unit, no exchange, and the others tell what they expect."""
    _, board = of_spruce()
    wrong = next(one for one in read_as(board, 0.1).setups[0].readings if one.beams == (2, 0))
    slipped = with_readings(board, lambda one: wrong if one.beams == wrong.beams else one)
    told = asked(slipped, "weakly-informative")
    assert "nu_xy nu_yx is below 1" in told
    peaks = replace(board.setups[0], name="other", readings=(), peaks=made_boards.peaks_of(50.0, 70.0))
    assert asked(replace(slipped, setups=(slipped.setups[0], peaks)), "weakly-informative") == told
    assert f"is {wrong.label} at {wrong.frequency.mean:.4g} Hz right? the others expect about " in told
    expected = float(told.split("expect about ")[1].split()[0])
    assert expected == pytest.approx(10.0 * wrong.frequency.mean, rel=_SLACK)  # the error that readings are given there
    assert told.count("right?") == 1


def test_a_plate_of_no_material_is_refused_also_where_no_exchange_mends_it():
    """A square plate as stiff both ways, and a Poisson ratio above one: nothing to be exchanged."""
    _, board = of_spruce(20e9, 18e9, L_x=0.3, L_y=0.3)

    assert asked(board, "weakly-informative") == ""
    told = asked(board.with_priors({"poisson_xy": Quantity.exact(1.3)}), "spruce")
    assert told.endswith("(or a smaller poisson_xy)")


@pytest.mark.parametrize(("factor", "size"), [(10.0, "large"), (0.1, "small")])
def test_a_thickness_off_by_ten_is_asked_about_where_the_mass_is_known(factor, size):
    """Its density is then off too, so that the frequencies are by 10^1.5 and not by 10."""
    wrong = with_sizes(of_spruce()[1], thickness=2.8e-3 * factor)

    assert f"is thickness_mm ten times too {size}?" in asked(wrong, "spruce")


LIGHT, HEAVY = (float(load_prior("spruce").density.quantile(np.array(share))) for share in (0.001, 0.999))
OF_BOARDS, OF_METAL = "the prior 'spruce' is of boards of", "any wood or fibre composite"


def metal(ratio: float) -> dict[str, float]:
    """Constants as stiff as a metal's, one way more than the other."""
    return {"E_x": 70e9, "E_y": 70e9 / ratio}


@pytest.mark.parametrize(
    ("prior", "constants", "rho", "words", "is_told"),
    [
        ("spruce", {}, None, " ", False),  # not a word
        ("spruce", {"E_x": 40e9}, None, "E_x comes out as 40 GPa, expected were", True),
        (
            "spruce",
            {"E_y": 11e9 / (1.02 * MOST_ORTHOTROPIC)},
            None,
            "times as large as E_y, more than in any wood",
            True,
        ),
        ("spruce", {"E_y": 11e9 / (0.98 * MOST_ORTHOTROPIC)}, None, "times as large as E_y", False),
        ("spruce", {"E_y": 22e9}, None, "E_y comes out 2 times as large as E_x: is x along the grain?", True),
        ("spruce", {}, 0.99 * LIGHT, OF_BOARDS, True),
        ("spruce", {}, 1.01 * LIGHT, OF_BOARDS, False),
        ("spruce", {}, 0.99 * HEAVY, OF_BOARDS, False),
        ("spruce", {}, 1.01 * HEAVY, OF_BOARDS, True),
        ("weakly-informative", {}, 0.98 * LIGHTEST_WOOD, "lighter than balsa", True),
        ("weakly-informative", {}, 1.02 * LIGHTEST_WOOD, "lighter than balsa", False),
        ("weakly-informative", metal(2.04), 1.02 * HEAVIEST_FIBRES, OF_METAL, True),
        ("weakly-informative", metal(1 / 2.04), 0.98 * HEAVIEST_FIBRES, OF_METAL, False),
        ("weakly-informative", metal(1.96), 1.02 * HEAVIEST_FIBRES, OF_METAL, False),
        ("weakly-informative", metal(1 / 1.96), 1.02 * HEAVIEST_FIBRES, OF_METAL, False),
        ("weakly-informative", metal(1 / 5.0), 4.0 * HEAVIEST_FIBRES, OF_METAL, True),
    ],
)
def test_what_is_unusual_is_told_and_what_is_usual_is_not(prior, constants, rho, words, is_told):
    plate, board = of_spruce(**constants)
    if rho is not None:
        board = board.with_priors({"mass": Quantity.exact(rho * plate.L_x * plate.L_y * plate.h)})
    told = " ".join(unusual_sentences(board, load_prior(prior), np.array([plate.D_x, plate.D_y, plate.D_s])))

    assert (words in told) is is_told


SANDWICH = """
format = 1
name = "sandwich"
effects = ["transverse_shear"]
plate = { length_x_mm = 500, length_y_mm = 300, thickness_mm = 10, density_kg_m3 = 200 }
material.poisson_xy = 0.3

[setup]
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }

[setup.frequencies_hz]
"""


@pytest.mark.slow
def test_constants_are_judged_where_the_shear_moduli_have_moved():
    """A soft core, ten times as soft along as the spruces that the effect's own prior is of, equally stiff both ways.

    Least squares at the middle of that prior find it 1.5 times as stiff across as along.
    """
    plate = Plate(8e9, 8e9, 3e9, 0.3, 200.0, 0.01, 0.5, 0.3, ritz.ALL_FREE)
    labels = ((1, 1), (0, 2), (2, 0), (1, 2), (2, 1), (3, 0), (0, 3), (2, 2))
    hertz, _ = frequencies(plate, [TransverseShear(100e6, 100e6)], labels)
    rng = np.random.default_rng(1)
    read = made_boards.with_noise(hertz, 0.0008, rng)
    card = SANDWICH + "\n".join(f'"({m},{n})" = {one:.4f}' for (m, n), one in read.items())
    posed = Problem.from_card(Board.from_text(card, "sandwich")).posed
    values = posed.parameters.values_at(posed.centre)
    prior = posed.prior

    assert unusual_sentences(posed.board, prior, posed.estimate.rigidities) != ()
    assert values["D_x"] == pytest.approx(values["D_y"], rel=0.02)
    assert posed.doubts == ()
