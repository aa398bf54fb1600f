"""Declarations that cannot be: refused by the command line with place, wanted, got and reason, and nothing written."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_cli import CARD, assert_refused, invoke, spoiled

from bayesplate.commands.prepare import prepare
from bayesplate.errors import InputError
from bayesplate.frequencies.system import system_of

Change = tuple[str, str]

FREE = 'edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }'
CANTILEVER = (FREE, 'edges = { x0 = "clamped", x1 = "free", y0 = "free", y1 = "free" }')
CLAMPED = (FREE, FREE.replace("free", "clamped"))
CLAMPED_LABEL = ('"(1,1)" = 150', '"(0,0)" = 900')
PLACE = "at_mm = [200, 20]"
NO_ITEM = ('[[setup.attached]]\nkind = "accelerometer"\nat_mm = [200, 20]\n', "")


def declaring(*effects: str) -> Change:
    """A card's list of effects."""
    return 'name = "my-board"', 'name = "my-board"\neffects = [' + ", ".join(f'"{effect}"' for effect in effects) + "]"


def refused(effect: str, reason: str) -> str:
    """The one line about an effect that can act nowhere on the board."""
    end = f"got {reason} (leave {effect} out of the effects)"
    return f"my-board.toml effects: wanted a board on which {effect} can act, {end}"


def item(*lines: str) -> Change:
    """More about the attached sensor."""
    return PLACE, "\n".join([PLACE, *lines])


NO_CLAMP = "no edge is clamped"
NO_FRAME = "no two opposite edges are held, so there is no frame that would only shift"
NO_PULL = "no two opposite edges are held, so nothing can stretch the board"
NO_WIDTHS = "the card gives no widths at stations: length_y_mm = { readings = [..], at_x_mm = [..] }"
ROVED = "something above 2% of the board roved: give each place a setup of its own"
WIDTHS = ("length_y_mm = 114", "length_y_mm = { readings = [114, 110], at_x_mm = [0, 253] }")
OFF_BOARD = (
    "my-board.toml [setup] attached 1 at_mm: wanted a place on the free part of the board, x 0 to 253 mm, "
    "y 0 to 114 mm, got [300, 20] (from the corner of x0 and y0 of the whole board)"
)
TOO_HEAVY = "my-board.toml [setup] attached 1 mass_g: wanted less than the board's own 41 g, got 50 g"

CASES: dict[str, tuple[list[Change], list[str]]] = {
    "a clamp that turns on a free board": ([declaring("clamp_rotation")], [refused("clamp_rotation", NO_CLAMP)]),
    "a frame around a cantilever": ([declaring("support_mass"), CANTILEVER], [refused("support_mass", NO_FRAME)]),
    "foam under a clamped board": (
        [declaring("support_stiffness"), CLAMPED, CLAMPED_LABEL],
        [refused("support_stiffness", "an edge is held, so the board does not lie or hang on anything else")],
    ),
    "an outline between clamps": (
        [declaring("outline_profile"), WIDTHS, CLAMPED, CLAMPED_LABEL],
        [refused("outline_profile", "neither y0 nor y1 is free, and a held edge is straight")],
    ),
    "a Poisson ratio that is free already": (
        [declaring("poisson_ratio"), ("poisson_xy = 0.4", "poisson_xy = { mean = 0.4, sd = 0.1 }")],
        [refused("poisson_ratio", "poisson_xy is already uncertain (0.4 ± 0.1) and so part of every fit")],
    ),
    "nothing attached": (
        [declaring("attached_mass"), NO_ITEM],
        [refused("attached_mass", "no [[setup.attached]] says what is fixed to the board and where")],
    ),
    "a sensor of unknown mass that roved over a light board": (
        [declaring("attached_mass"), (PLACE, "at_mm = [[200, 20], [20, 20]]")], [refused("attached_mass", ROVED)],
    ),
    "all at once": (
        [declaring("clamp_rotation", "membrane_tension", "grain_angle", "outline_profile"),
         (PLACE, "at_mm = [300, 20]\nmass_g = 50")],
        [OFF_BOARD, TOO_HEAVY, refused("clamp_rotation", NO_CLAMP), refused("membrane_tension", NO_PULL),
         refused("outline_profile", NO_WIDTHS)],
    ),
}  # fmt: skip


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_refused_with_the_reason():
    for changes, lines in CASES.values():
        Path("my-board.toml").write_text(spoiled(*changes), encoding="utf-8")
        result = invoke("fit", "my-board.toml")

        assert result.exit_code == 3
        assert result.stderr.splitlines() == lines
        assert result.stdout == ""
        assert [path.name for path in Path().iterdir()] == ["my-board.toml"]


def test_the_same_by_the_option():
    Path("my-board.toml").write_text(CARD, encoding="utf-8")
    result = invoke("fit", "my-board.toml", "--effects", "support_mass,clamp_rotation")

    assert result.exit_code == 3
    assert result.stderr.splitlines() == [refused("support_mass", NO_FRAME), refused("clamp_rotation", NO_CLAMP)]
    assert not Path("results").exists()


SECOND = """
[[setup]]
name = "roved"
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }
[setup.frequencies_hz]
"(1,1)" = 150
[[setup.attached]]
kind = "accelerometer"
mass_g = 3
at_mm = [[200, 20], [20, 20]]
"""


def test_a_setup_whose_own_statement_cannot_be_computed_is_not_passed_over():
    """Although the effect can act in the other; declared effects replaced, what the card states no longer counts."""
    first = spoiled(("[setup]\n", "[[setup]]\n"), item("mass_g = 0.3"))
    Path("my-board.toml").write_text(first + SECOND, encoding="utf-8")
    line = f'my-board.toml [[setup]] 2 "roved": wanted a setup in which attached_mass can act, got {ROVED}'

    assert_refused("check", "my-board.toml", [line])
    assert invoke("check", "my-board.toml", "--effects", "none").exit_code == 0


@pytest.mark.parametrize(
    ("effect", "changes"),
    [
        ("clamp_rotation", [CANTILEVER]),
        ("membrane_tension", [CLAMPED, CLAMPED_LABEL]),
        ("attached_mass", []),
        ("outline_profile", [WIDTHS]),
    ],
)
def test_the_possible_is_not_refused(effect, changes):
    """Control: the same declarations where they can act are part of the model."""
    Path("my-board.toml").write_text(spoiled(declaring(effect), *changes), encoding="utf-8")
    board = prepare("my-board.toml").board

    assert board.effects == (effect,)
    assert [one.name for one in system_of(board, board.setups[0]).effects] == [effect]


@pytest.mark.parametrize(("mass", "is_rough"), [(0.081, False), (0.083, True), (0.81, True)])
def test_what_roved_is_said_to_be_rough(mass, is_rough):
    """From 0.2 % of the board of 41 g on, 0.082 g; above 2 % it is refused."""
    Path("my-board.toml").write_text(
        spoiled((PLACE, f"at_mm = [[200, 20], [20, 20]]\nmass_g = {mass}")), encoding="utf-8"
    )
    said = [note for note in prepare("my-board.toml").board.notes if "roved" in note]

    assert len(said) == is_rough
    assert not is_rough or f"weighs {100.0 * mass / 41.0:.1f} % of the board" in said[0]
    Path("my-board.toml").write_text(spoiled((PLACE, "at_mm = [[200, 20], [20, 20]]\nmass_g = 0.83")))
    with pytest.raises(InputError, match="above 2% of the board roved"):
        prepare("my-board.toml")
