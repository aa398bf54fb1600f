"""Planted boards: clear labels, the stated noise, cards that the package reads, nothing taken from the package."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

import numpy as np
import pytest

from bayesplate.board.board import Board
from bayesplate.board.checks import physical_faults
from generator.boards import plant
from generator.card import told
from generator.designs import DESIGNS
from generator.naming import named
from generator.plate import solve
from generator.recipes import RECIPES

FOLDER = Path(__file__).parent


@pytest.fixture
def rng() -> np.random.Generator:
    """A seeded generator."""
    return np.random.default_rng(20)


@pytest.mark.parametrize("name", ["clamped-9", "cantilever-6-free-6"])
def test_every_effect_of_a_design_moves_its_labelled_modes(name, rng: np.random.Generator) -> None:
    """By 1 to 150 cents rms at nominal size, air on the light clamped board most; the package reads every card.

    Warp and exciter come from wide priors: over two boards. The designs have every kind of edge between them.
    """
    design = DESIGNS[name]
    for effect, n in [*((e, 1) for e in (*design.drawn, *design.drawn_outside)), ("warp", 2), ("exciter", 2)]:
        boards = [plant(rng, design, [effect]) for _ in range(n)]
        shifts = [cents for board in boards for setup in board.shifts().values() for cents in setup.values()]
        card = boards[0].card_text()

        assert list(boards[0].truth.effects) == [effect]
        assert len(shifts) == n * sum(len(setup.beams) for setup in design.setups)
        assert 1.0 < np.sqrt(np.mean(np.square(shifts))) < 150.0, effect
        assert "warp_mm" not in card
        assert not list(physical_faults(Board.from_text(card, "planted.toml")))


def test_labels_are_the_lowest_modes_of_the_nominal_cantilever() -> None:
    design = DESIGNS["cantilever-9"]
    setup = design.setups[0]
    plate = design.plate(setup, {"E_x": 11.5e9, "E_y": 0.9e9, "G_xy": 0.7e9, "nu_xy": 0.4})
    names = named(solve(plate, (), 16), plate.edges)
    lowest = sorted(names, key=lambda beams: names[beams][0])[:9]

    assert sorted(lowest) == sorted(setup.beams)
    assert setup.label((0, 2)) == (1, 2)


def test_noise_is_what_the_truth_says(rng: np.random.Generator) -> None:
    """Mean square of 40 boards' residuals within four of its standard errors; without noise there are none."""
    noise = 7.0
    residuals = []
    for _ in range(40):
        board = plant(rng, "cantilever-6", [], noise_cents=noise)
        read, exact = board.readings["cantilever"], board.exact["cantilever"]
        residuals += [1200.0 * np.log2(read[label] / exact[label]) for label in exact]
    n = len(residuals)

    assert np.mean(np.square(residuals)) / noise**2 == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / n))
    assert np.mean(residuals) == pytest.approx(0.0, abs=4.0 * noise / np.sqrt(n))
    quiet = plant(rng, "cantilever-6", [], noise_cents=0.0)
    assert quiet.readings == quiet.exact
    assert all(shift == 0.0 for shift in quiet.shifts()["cantilever"].values())


def test_a_drawn_noise_is_log_normal_about_the_one_stated(rng: np.random.Generator) -> None:
    """Mean and variance of ln noise over 30 boards of two setups within four standard errors; no card tells it."""
    boards = [
        plant(rng, "cantilever-6-free-6", [], noise_cents=5.0, noise_factor=1.65, noise_is_drawn=True)
        for _ in range(30)
    ]
    levels = np.array([[board.truth.drawn_noise[name] for name in ("cantilever", "free")] for board in boards])
    z = np.log(levels / 5.0) / np.log(1.65)

    assert z.mean() == pytest.approx(0.0, abs=4.0 / np.sqrt(z.size))
    assert np.mean(z**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / z.size))
    assert np.corrcoef(z.T)[0, 1] == pytest.approx(0.0, abs=4.0 / np.sqrt(len(z)))
    scatter = [
        1200.0 * np.log2(hz / board.exact[name][label]) / board.truth.drawn_noise[name]
        for board in boards
        for name, readings in board.readings.items()
        for label, hz in readings.items()
    ]
    assert np.mean(np.square(scatter)) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / len(scatter)))
    cards = [tomllib.loads(board.card_text()) for board in boards]
    assert {setup["noise_percent"]["median"] for card in cards for setup in card["setup"]} == {0.289229}
    assert plant(rng, "cantilever-6", []).truth.drawn_noise == {}


def test_rounded_readings_are_stated_and_can_be_told_apart(rng: np.random.Generator) -> None:
    """To 8 Hz modes often meet; those boards are drawn again, and the package reads the rest."""
    draws = []
    for _ in range(12):
        board = plant(rng, "cantilever-9", [], resolution=8.0)
        card = board.card_text()
        read, exact = board.readings["cantilever"], board.exact["cantilever"]
        draws.append(board.n_draws)

        assert tomllib.loads(card)["setup"][0]["resolution_hz"] == 8
        assert all(hz % 8.0 == 0.0 for hz in read.values())
        assert all(abs(hz - exact[label]) < 4.0 + 0.02 * exact[label] for label, hz in read.items())
        assert not list(physical_faults(Board.from_text(card, "planted.toml")))
    assert max(draws) > 1


def test_card_says_what_a_laboratory_would_know(rng: np.random.Generator) -> None:
    board = plant(rng, "cantilever-6-free-6", ["attached_mass", "outline_profile"], noise_cents=5.0, n_places=2)
    card = tomllib.loads(board.card_text())
    cantilever, free = card["setup"]

    assert cantilever["clamped_mm"] == {"x0": 30}
    assert "resolution_hz" not in cantilever
    assert cantilever["noise_percent"] == {"median": pytest.approx(0.28923, rel=1e-4), "factor": 1.65}
    assert len(free["attached"][0]["at_mm"]) == 2
    assert "mass_g" not in free["attached"][0]
    assert card["plate"]["length_y_mm"]["at_x_mm"] == [0, 126.5, 253]
    assert card["material"]["poisson_xy"] == 0.4
    assert free["frequencies_hz"]["(1,1)"] == pytest.approx(board.readings["free"][1, 1], rel=1e-8)


def test_air_and_an_exciter_keep_their_physical_size_unless_told(rng: np.random.Generator) -> None:
    physical, doubled = (
        plant(rng, "free-12", ["fluid_loading"], 2.0, scale_known=scale).truth.effects["fluid_loading"]["density"]
        for scale in (False, True)
    )
    small, large = (
        plant(rng, "clamped-9-driven", ["exciter"], 2.0, scale_known=scale).truth.effects["exciter"]["mass"]
        for scale in (False, True)
    )

    assert physical == pytest.approx(1.2, rel=0.04)
    assert doubled == pytest.approx(2.4, rel=0.04)
    assert (small, large) == pytest.approx((48e-3, 96e-3))


@pytest.mark.parametrize(
    ("effect", "words"),
    [("support_mass", "one that acts on cantilever-6, got support_mass"), ("gravity", "one of .*, got gravity")],
)
def test_an_effect_that_cannot_act_or_is_unknown_is_refused(effect: str, words: str, rng: np.random.Generator) -> None:
    with pytest.raises(ValueError, match=f"wanted {words}"):
        plant(rng, "cantilever-6", [effect])


def test_nothing_comes_from_the_package() -> None:
    """Only the tests may import it, to read the cards."""
    for file in FOLDER.glob("*.py"):
        if file.name.startswith("test_"):
            continue
        for node in ast.walk(ast.parse(file.read_text())):
            names = (
                [a.name for a in node.names] if isinstance(node, ast.Import) else [getattr(node, "module", "") or ""]
            )
            assert not any(name.split(".")[0] == "bayesplate" for name in names), file.name


def test_every_recipe_has_a_design() -> None:
    """All but two are drawn; an outline is measured, and warp planted by name."""
    drawn = {effect for design in DESIGNS.values() for effect in (*design.drawn, *design.drawn_outside)}

    assert set(RECIPES) - drawn == {"outline_profile", "warp"}


def test_card_states_what_scales_and_a_straightedge_say(rng: np.random.Generator) -> None:
    board = plant(
        rng, "clamped-9", ["attached_mass", "exciter", "warp"], n_places=2, fixed={"exciter": {"magnet": "held"}}
    )
    text = board.card_text(told(board.truth.effects) | {"fluid": '{ density_kg_m3 = 1.2, baffle = "none" }'})
    card = tomllib.loads(text)
    warp, drive = (board.truth.effects[effect] for effect in ("warp", "exciter"))
    sensor, exciter = card["setup"][0]["attached"]

    assert card["plate"]["warp_mm"] == {name: pytest.approx(1e3 * value, rel=1e-5) for name, value in warp.items()}
    assert list(warp) == ["cup", "bow", "twist"]
    assert warp["cup"] > 0.0 < warp["twist"]
    assert sensor["kind"] == "accelerometer"
    assert "mass_g" not in sensor
    assert exciter == {
        "kind": "exciter",
        "mass_g": 48,
        "coil_mass_g": pytest.approx(1e3 * drive["coil_mass"], rel=1e-5),
        "suspension_n_per_m": pytest.approx(drive["suspension"], rel=1e-5),
        "magnet": "held",
        "at_mm": [[pytest.approx(1e3 * x, rel=1e-5), pytest.approx(1e3 * y, rel=1e-5)] for x, y in drive["places"]],
    }
    assert len(exciter["at_mm"]) == len(sensor["at_mm"]) == 2
    assert card["setup"][0]["fluid"] == {"density_kg_m3": 1.2, "baffle": "none"}
    assert not list(physical_faults(Board.from_text(text, "planted.toml")))
