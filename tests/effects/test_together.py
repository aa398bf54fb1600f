"""Effects together: their order changes nothing, and what adds terms leaves the plate itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import made_boards
import numpy as np
import pytest
from generator.known_boards import FIEMME, FINNISH, FREE
from generator.plate import Plate

import bayesplate.frequencies.system
from bayesplate.board.attached import AttachedItem
from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.effects import EFFECTS, declare, effects_of
from bayesplate.frequencies.system import system_of
from bayesplate.plate.solve import solve

PLATES = {"CFFF": FINNISH, "CCCC": FIEMME, "FFFF": FREE}
N_MODES = 6
COARSE = (4, 4)
"""Elements along x and y: frequencies of one mesh are compared, so a coarse one serves."""
PLACE, DRIVEN_AT = (0.86, 0.34), (0.31, 0.58)

FIELDS = ("density_gradient", "outline_profile", "stiffness_gradient", "thickness_profile")
PROJECTED = {"fluid_loading", "support_mass", "warp"}
"""Effects whose terms exist on given deflections alone."""


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plates on a coarse mesh."""
    monkeypatch.setattr(bayesplate.frequencies.system, "mesh", lambda *_: COARSE)


def board_like(plate: Plate, is_tapered: bool = True) -> Board:
    """A board with a thing and an exciter of a fiftieth of its mass each, and widths at three stations, 1 % apart.

    Its thickness has free tapers, or was read at the same stations.
    """
    mass = Quantity.exact(0.02 * plate.rho * plate.h * plate.L_x * plate.L_y)
    item = AttachedItem("weight", ((PLACE[0] * plate.L_x, PLACE[1] * plate.L_y),), mass)
    drive = AttachedItem("exciter", ((DRIVEN_AT[0] * plate.L_x, DRIVEN_AT[1] * plate.L_y),), mass)
    setup = replace(made_boards.setup_of(plate.edges, {(2, 2): 1.0}), attached=(item, drive))
    widths = tuple(plate.L_y * (1.0 + 0.01 * step) for step in (1.0, 0.0, -1.0))
    at_x = (0.0, 0.5 * plate.L_x, plate.L_x)
    inputs = {"length_y": Quantity(plate.L_y, readings=widths, at_x=at_x)}
    if not is_tapered:
        depths = tuple(plate.h * width / plate.L_y for width in widths)
        inputs["thickness"] = Quantity(plate.h, readings=depths, at_x=at_x, at_y=(0.5 * plate.L_y,) * 3)
    return made_boards.board_of(plate, [setup], **inputs)


def allowed(board: Board) -> list[str]:
    return [name for name, effect in EFFECTS.items() if not effect.refusal(board, board.setups[0])]


def sized(quantity: Quantity) -> float:
    """A usual size of a parameter: the median, or one standard deviation above nothing."""
    if quantity.is_exact or quantity.kind == "log-normal":
        return quantity.median
    return float(np.clip(quantity.value(1.0), quantity.lower, quantity.upper))


def hertz(plate: Plate, board: Board, effects: Sequence[str]) -> np.ndarray:
    """The lowest N_MODES frequencies with effects declared in this order, and those of the magnets beside the board."""
    declared = declare(replace(board, effects=tuple(effects)))
    values = {name: sized(quantity) for name, quantity in declared.inputs.items()}
    values |= {"D_x": plate.D_x, "D_y": plate.D_y, "D_s": plate.G_xy * plate.h**3 / 3.0}
    at = {name: np.asarray(value) for name, value in values.items()}
    system = system_of(declared, declared.setups[0])
    plate_at = system.plate(at)
    squares = solve(plate_at, system.weights(at).at(0), N_MODES + plate_at.n_coordinates).eigenvalues
    return np.sqrt(squares) / (2.0 * np.pi)


BOARDS = {edges: board_like(plate, is_tapered=edges != "CFFF") for edges, plate in PLATES.items()}
TOGETHER = {edges: allowed(board) for edges, board in BOARDS.items()}
ORDER = tuple(PLATES)
PAIRS = {
    edges: [pair for pair in combinations(names, 2) if all(not set(pair) <= set(TOGETHER[e]) for e in before)]
    for (edges, names), before in zip(TOGETHER.items(), (ORDER[:i] for i in range(len(ORDER))), strict=True)
}
"""Every pair on the first of the boards that allows it."""


def test_effects_act_in_the_order_of_the_library_whatever_that_of_the_declaration():
    """Each of them on one of the boards."""
    for edges, board in BOARDS.items():
        for order in (TOGETHER[edges], TOGETHER[edges][::-1]):
            acting = effects_of(replace(board, effects=tuple(order)), board.setups[0])
            assert [one.name for one in acting] == TOGETHER[edges]
    assert set().union(*TOGETHER.values()) == set(EFFECTS)


@pytest.mark.parametrize(
    ("edges", "board", "pairs"),
    [
        pytest.param("CFFF", BOARDS["CFFF"], PAIRS["CFFF"], marks=pytest.mark.slow),
        ("CCCC", BOARDS["CCCC"], PAIRS["CCCC"]),
        ("FFFF", BOARDS["FFFF"], PAIRS["FFFF"]),
        # A free taper is a sum of fields, each of which meets those of the other effect.
        ("CFFF", board_like(FINNISH), list(combinations(FIELDS, 2))),
    ],
    ids=["CFFF", "CCCC", "FFFF", "tapers and another field"],
)
@pytest.mark.usefixtures("coarse")
def test_any_two_effects_can_act_together(edges, board, pairs):
    failed = [pair for pair in pairs if not np.all(hertz(PLATES[edges], board, pair) > 0.0)]
    assert failed == []


@pytest.mark.usefixtures("coarse")
def test_what_adds_terms_alone_leaves_the_plate_itself():
    """Air, a frame that moves, springs, tension and a cup are terms beside the plate's own: its sides stay, and these.

    The warp has no twist here: with one beside a curvature the halves of the board differ, and so do its sides.
    """
    edges = "CCCC"
    untwisted = replace(BOARDS[edges], warp={"twist": Quantity.exact(0.0)})
    plates = {}
    for name in ("", *TOGETHER[edges]):
        declared = declare(replace(untwisted, effects=tuple(filter(None, (name,)))))
        values = declared.nominal() | {"D_x": np.asarray(30.0), "D_y": np.asarray(2.0), "D_s": np.asarray(5.0)}
        plates[name] = system_of(declared, declared.setups[0]).plate(values)
    bare = plates.pop("")
    shared = {
        name for name, plate in plates.items() if (plate.x, plate.y) == (bare.x, bare.y) and has_terms_of(plate, bare)
    }
    terms_alone = PROJECTED | {"membrane_tension", "support_stiffness", "poisson_ratio"}

    assert shared == terms_alone & set(TOGETHER[edges])
    assert {name for name, plate in plates.items() if plate.is_projected} == PROJECTED & set(TOGETHER[edges])
    assert not bare.is_projected


def has_terms_of(plate, bare) -> bool:
    """Whether the first terms of a plate are those of another one."""
    both = [*zip(plate.stiffness, bare.stiffness, strict=False), *zip(plate.masses, bare.masses, strict=False)]
    return all(a[0] == b[0] and np.array_equal(a[1], b[1]) for a, b in both)
