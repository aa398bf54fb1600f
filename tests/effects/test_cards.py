"""Which effects a board refuses, which its card implies, and in which forms a search tries them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from effect_plates import ALL_SUPPORTED, board_with, setup_of
from generator.known_boards import FIEMME, FINNISH, FREE, HALF_TOP, STEEL

from bayesplate.board.attached import AttachedItem, DeclaredFluid
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Reading
from bayesplate.commands.prepare import prepare
from bayesplate.effects import EFFECTS, declare, effect_faults, implied_effects, notes
from bayesplate.effects.grain_angle import GrainAngle
from bayesplate.effects.membrane_tension import MembraneTension
from bayesplate.effects.poisson_ratio import FREE_POISSON, PoissonRatio
from bayesplate.labels import Label

KNOWN = AttachedItem("accelerometer", ((0.2007, 0.0855),), Quantity.from_mean(0.6e-3, 0.1e-3))
UNKNOWN = AttachedItem("weight", ((0.2, 0.01), (0.1, 0.1)))
ANYWHERE = AttachedItem("accelerometer")
DRIVEN = [AttachedItem("exciter", ((0.1, 0.1),), 0.05), AttachedItem("exciter")]
WIDTHS = {"length_y": Quantity.from_readings([0.2, 0.21], 0, [0.0, 0.5])}
LEVEL = {"thickness": Quantity.from_readings([4.7e-3] * 4, 1e-6, [0.0, 0.2, 0.4, 0.58], [0.0, 0.2, 0.0, 0.2])}
CURVED = {"thickness": Quantity.from_readings([3e-3, 3.4e-3, 3e-3], 1e-5, [0.0, 0.1, 0.2], [0.05] * 3)}
CUPPED = {"cup": Quantity.exact(0.8e-3), "twist": Quantity.exact(0.0)}
MASS = ("attached_mass",)
NOTHING_FIXED = "no [[setup.attached]] says what is fixed to the board and where"

REFUSALS = [
    ("clamp_rotation", board_with(FREE), "no edge is clamped"),
    ("clamp_rotation", board_with(FINNISH), ""),
    ("clamp_translation", board_with(FREE), "no edge is clamped"),
    ("clamp_translation", board_with(FIEMME), ""),
    ("membrane_tension", board_with(FINNISH), "nothing can stretch"),
    ("membrane_tension", board_with(FIEMME), ""),
    ("support_mass", board_with(FINNISH), "no frame"),
    ("support_mass", board_with(FIEMME), ""),
    ("support_stiffness", board_with(replace(FIEMME, edges=ALL_SUPPORTED)), "an edge is held"),
    ("support_stiffness", board_with(FREE), ""),
    ("attached_mass", board_with(FINNISH), NOTHING_FIXED),
    ("attached_mass", board_with(FINNISH, [ANYWHERE]), NOTHING_FIXED),
    ("attached_mass", board_with(FINNISH, DRIVEN), NOTHING_FIXED),
    ("attached_mass", board_with(FINNISH, [KNOWN]), ""),
    (
        "attached_mass",
        board_with(FINNISH, [replace(UNKNOWN, mass=Quantity.exact(2e-3))]),
        "above 2% of the board roved",
    ),
    ("exciter", board_with(FINNISH, [KNOWN]), 'no [[setup.attached]] of kind = "exciter"'),
    ("exciter", board_with(FINNISH, DRIVEN), ""),
    ("outline_profile", board_with(FREE), "no widths at stations"),
    ("outline_profile", board_with(FIEMME, **WIDTHS), "a held edge is straight"),
    ("outline_profile", board_with(FREE, **WIDTHS), ""),
    ("poisson_ratio", board_with(FINNISH, poisson_xy=Quantity.from_mean(0.4, 0.08, "normal")), "already uncertain"),
    ("poisson_ratio", board_with(FINNISH), ""),
    ("warp", board_with(replace(STEEL, h=0.06)), "thick"),
    ("warp", board_with(HALF_TOP), ""),
]


@pytest.mark.parametrize(("name", "board", "words"), REFUSALS)
def test_what_a_board_refuses(name, board, words):
    found = EFFECTS[name].refusal(board, board.setups[0])
    assert words in found
    assert bool(found) == bool(words)


IMPLIED = [
    (board_with(FREE), ()),
    (board_with(FINNISH, [KNOWN, UNKNOWN]), ("attached_mass",)),
    (board_with(FINNISH, [UNKNOWN]), ()),
    (board_with(FINNISH, DRIVEN), ("exciter",)),  # an exciter is no point mass
    (board_with(FINNISH, DRIVEN[1:]), ()),
    (board_with(FREE, fluid=DeclaredFluid(Quantity.exact(1.1), "full")), ("fluid_loading",)),
    (board_with(FREE, bounce=Quantity.exact(5.0)), ("support_stiffness",)),
    (board_with(FREE, **WIDTHS), ("outline_profile",)),
    (board_with(FREE, **LEVEL), ()),
    (board_with(FINNISH, **CURVED), ("thickness_profile",)),
    (board_with(HALF_TOP, warp=CUPPED), ("warp",)),
]


@pytest.mark.parametrize(("board", "names"), IMPLIED)
def test_what_a_card_implies(board, names):
    assert implied_effects(board) == names
    assert implied_effects(replace(board, has_implied_effects=False)) == ()


def test_what_a_setup_states_and_cannot_have_is_a_fault_there():
    """The bounce of a board that is held: the effect stays implied, so that it is told."""
    board = board_with(FINNISH, bounce=Quantity.exact(5.0))
    assert implied_effects(board) == ("support_stiffness",)
    (fault,) = effect_faults(replace(board, effects=("support_stiffness",)))
    assert str(fault).startswith("made.toml [setup]: wanted a setup in which support_stiffness can act, got an edge")


def test_a_declared_poisson_ratio_is_the_boards_own_input():
    """One value, in the weights and in E from D."""
    declared = declare(board_with(FINNISH, effects=["poisson_ratio"]))

    assert declared.uncertain_inputs == {"poisson_xy": FREE_POISSON}
    assert declare(declared).parameters[:-1] == declared.parameters[:-1]
    assert [one.name for one in PoissonRatio().parameters()] == ["poisson_xy"]


@pytest.mark.parametrize(
    ("name", "board"),
    [
        ("thickness_profile", board_with(FREE, **LEVEL, effects=["thickness_profile"])),
        ("outline_profile", prepare("spruce-free-2R", ["outline_profile"]).board),
    ],
)
def test_readings_that_are_alike_leave_a_rectangle_of_one_thickness(name, board):
    effect = EFFECTS[name].of(board, board.setups[0])
    assert (effect.outline(), effect.parameters(), effect.variations()) == (None, (), {})
    assert effect.keeps_symmetry() == (True, True)
    assert not EFFECTS[name].is_implied(board)
    assert EFFECTS[name].candidates(board, board.setups[0]) == ()
    assert any(f"support no {name}" in one for one in notes(board))


@pytest.mark.parametrize(("spring", "swings"), [(2700.0, False), (60e3, True)])
def test_a_held_magnet_leaves_a_free_board_s_motions_without_bending_the_lowest(spring, swings):
    """On 60 kN/m a board of 0.25 kg rises and falls at 78 Hz, above (1,1): it would be taken for that mode."""
    held = AttachedItem("exciter", ((0.29, 0.1),), suspension=Quantity.exact(spring), magnet="held")
    board = board_with(FREE, [held])
    lowest = Reading(Label(1, 1), (1, 1), Quantity.exact(55.0))
    refused = EFFECTS["exciter"].refusal(board, replace(board.setups[0], readings=(lowest,)))
    assert ("swings on the spring of its held magnet at" in refused) == swings
    clamped = board_with(FINNISH, [held])
    assert EFFECTS["exciter"].refusal(clamped, clamped.setups[0]) == ""


def test_it_is_said_of_an_item_without_a_mass_that_it_is_fitted_or_left_out():
    """Beside an item of known mass, which declares the effect."""
    told = notes(replace(board_with(FINNISH, [KNOWN, replace(UNKNOWN, places=((0.1, 0.1),)), ANYWHERE]), effects=MASS))
    assert sum("the weight in setup 'made' has no mass on the card: it is fitted" in one for one in told) == 1
    assert sum("the accelerometer in setup 'made' has no mass on the card: without a place" in one for one in told) == 1
    assert not any("no mass on the card" in one for one in notes(replace(board_with(FINNISH, [KNOWN]), effects=MASS)))


BOTH = ["from x towards y", "from x away from y"]
CORNER, MIDDLE = (0.97, 0.91), (0.97, 0.5)
CLAMPED = {"x0": "clamped", "y0": "clamped"}


def loaded(place, *effects, **edges):
    """A thing at a place of the free board; a taper that nothing was read of may as well be the mirrored one."""
    item = AttachedItem("weight", ((place[0] * FREE.L_x, place[1] * FREE.L_y),), Quantity.exact(3e-3))
    return board_with(replace(FREE, edges=FREE.edges | edges), [item], effects=("attached_mass", *effects))


def driven(*places, mass=None):
    """The free board with an exciter that roved over places."""
    on_board = tuple((x * FREE.L_x, y * FREE.L_y) for x, y in places)
    return board_with(FREE, [AttachedItem("exciter", on_board, mass)], effects=["exciter"])


FORMS = [
    ("warp", board_with(HALF_TOP), [""]),
    ("warp", board_with(replace(STEEL, h=0.06)), []),
    ("grain_angle", loaded(CORNER, "thickness_profile"), BOTH),
    ("grain_angle", loaded(MIDDLE, "thickness_profile"), [""]),
    ("grain_angle", loaded(MIDDLE, "thickness_profile", **CLAMPED), BOTH),
    ("grain_angle", driven(CORNER), BOTH),
    ("grain_angle", driven(MIDDLE), [""]),
    ("grain_angle", driven(MIDDLE, mass=Quantity.exact(0.05)), [""]),
    ("grain_angle", driven(CORNER, (0.97, 0.09)), [""]),
    ("grain_angle", driven(), BOTH),  # mirror places count once, so that the other sign is another board
    ("grain_angle", prepare("spruce-free-1R").board, BOTH),  # its readings say that the thickness varies
    ("grain_angle", prepare("spruce-free-1R", []).board, [""]),
    ("grain_angle", prepare("fiemme-spruce-clamped").board, [""]),
]


@pytest.mark.parametrize(("name", "board", "details"), FORMS)
def test_forms_in_which_a_search_tries_an_effect(name, board, details):
    assert [one.detail for one in EFFECTS[name].forms(board)] == details


def test_it_is_said_where_the_sign_of_a_grain_angle_counts_and_one_alone_is_tried():
    def is_told(board):
        return any("sign of the grain angle" in one for one in notes(board))

    at_corner = loaded(CORNER, "grain_angle")
    assert is_told(at_corner)
    assert not is_told(loaded(MIDDLE, "grain_angle"))
    assert not is_told(loaded(CORNER))
    assert not is_told(replace(at_corner, effect_forms=GrainAngle.forms(at_corner)[-1].effects))


@pytest.mark.parametrize(
    ("held", "axes"),
    [
        (["all"], [("", ["both"]), ("along x", ["x"]), ("along y", ["y"])]),
        (["y"], [("along y", ["y"])]),
        (["y", "none", "all"], [("", ["y", "both"]), ("along x", ["x"]), ("along y", ["y", "y"])]),
    ],
)
def test_setups_that_are_held_otherwise_are_stretched_along_the_same_side(held, axes):
    """Each form once."""
    edges = {"all": {}, "y": {"x1": "free"}, "none": {"x1": "free", "y1": "free"}}
    setups = [setup_of(replace(FIEMME, edges=FIEMME.edges | edges[one])) for one in held]
    setups = [replace(one, name=str(i)) for i, one in enumerate(setups)]
    forms = MembraneTension.forms(SimpleNamespace(setups=setups))
    assert [(form.detail, [effect.axis for effect in form.effects]) for form in forms] == axes
