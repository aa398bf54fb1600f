"""What a card says of what is around a board and on it: fluid, support, warp, exciter; and other names of an effect."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import bayesplate
from bayesplate.board.board import Board
from bayesplate.board.campaign import load_campaign
from bayesplate.board.checks import physical_faults, remarks
from bayesplate.board.quantity import Quantity
from bayesplate.board.words import EFFECT_NAMES
from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.forms import forms
from bayesplate.effects import implied_effects
from bayesplate.errors import InputError

FLUID = '[setup.fluid]\ndensity_kg_m3 = 1.2\nbaffle = "none"\n'
PLATE, ITEM = "mass_g = 41.0", 'kind = "accelerometer"\nmass_g = { mean = 0.6, sd = 0.1 }\nat_mm = [200, 20]'
SETUP = "my-board.toml [setup] "


def read(text):
    return Board.from_text(text, "my-board")


def told(text):
    """Every fault of a card: of its writing, or else of its meaning."""
    try:
        card = Board.from_text(text, "my-board")
    except InputError as error:
        return [str(fault) for fault in error.faults]
    return [str(fault) for fault in physical_faults(card)]


def test_fluid_and_air_mean_the_same(spoiled):
    air, fluid = (spoiled(FLUID, FLUID.replace("fluid", name)) for name in ("air", "fluid"))
    assert read(air).setups == read(fluid).setups
    assert read(air).setups[0].fluid == bayesplate.DeclaredFluid(1.2, "none")


def test_water_is_a_fluid_and_nothing_heavier(spoiled):
    assert read(spoiled("= 1.2", "= 997")).setups[0].fluid.density == Quantity.exact(997.0)
    assert told(spoiled("= 1.2", "= 2000")) == []
    (fault,) = told(spoiled("= 1.2", "= 2001"))
    assert fault.startswith(SETUP + "fluid.density_kg_m3: wanted a number from 1e-06 to 2000 kg/m3, got 2001")


def test_fluid_and_air_in_one_setup_are_refused(spoiled):
    (fault,) = told(spoiled(FLUID, FLUID + "[setup.air]\n"))
    assert fault == SETUP + "air: wanted [setup.fluid] alone, which means the same, got both (leave [setup.air] out)"


def test_warp_is_read_in_mm_with_cup_and_twist_from_zero_on(spoiled):
    warp = "warp_mm = { cup = { mean = 0.8, sd = 2 }, bow = [-1.0, -1.2], twist = 0 }"
    found = read(spoiled(PLATE, f"{PLATE}\n{warp}")).warp
    assert found["cup"] == Quantity.from_mean(0.8, 2.0, "normal", lower=0.0).scaled(1e-3)
    assert found["bow"] == Quantity.from_readings([-1.0, -1.2], kind="normal").scaled(1e-3)
    assert found["twist"] == Quantity.exact(0.0)
    assert read(spoiled(PLATE, PLATE)).warp == {}


WARPS = {
    "cup = -0.8": "cup: wanted a number from 0 to 1000 mm, got -0.8 (seen from below every warp has the other sign, "
    "and turning the board over changes nothing)",
    "twist = { mean = -1, sd = 1 }": "twist.mean: wanted a number from 0 to 1000 mm, got -1 (seen from below every",
    "bow = 26": "bow: wanted at most a tenth of the side, 25.3 mm, got 26 mm",
    "cup = 12": "cup: wanted at most a tenth of the side, 11.4 mm, got 12 mm",
    "twist = 26": "twist: wanted at most a tenth of the side, 25.3 mm, got 26 mm",
    "cupp = 1": "cupp: wanted one of cup, bow, twist, got an unknown key (did you mean cup?)",
}


def test_what_no_board_is_warped_by(spoiled):
    for warp, wanted in WARPS.items():
        (fault,) = told(spoiled(PLATE, f"{PLATE}\nwarp_mm = {{ {warp} }}"))
        assert fault.startswith("my-board.toml [plate] warp_mm." + wanted)


def test_readings_of_a_warp_that_are_all_alike_are_rounded_to_a_feeler_gauge(spoiled):
    card = Board.from_text(spoiled(PLATE, f"{PLATE}\nwarp_mm = {{ cup = [0.8, 0.8], bow = [1.0, 1.1] }}"), "my-board")
    assert card.warp["cup"].sd == pytest.approx(1e-4 / 12**0.5)
    assert any("taken as rounded, cup to 0.1 mm; " in one for one in remarks(card, ()))


def test_warp_is_a_table(spoiled):
    (fault,) = told(spoiled(PLATE, f"{PLATE}\nwarp_mm = 1"))
    assert fault == "my-board.toml [plate] warp_mm: wanted a table of cup, bow and twist, { cup = 0.8 }, got 1"


def test_a_bounce_is_below_every_mode(spoiled):
    def with_bounce(hz):
        return spoiled(FLUID, f"{FLUID}\n[setup.support]\nbounce_hz = {hz}\n")

    assert read(with_bounce("[3.5, 5.0]")).setups[0].bounce == Quantity.from_readings([3.5, 5.0])
    (fault,) = told(with_bounce("52"))
    assert fault.startswith(SETUP + "support.bounce_hz: wanted less than the lowest mode, 52 Hz, got 52 Hz (the peak")
    (fault,) = told(with_bounce("-1"))
    assert fault == SETUP + "support.bounce_hz: wanted a positive number, got -1"


def exciter(*keys):
    return "\n".join(('kind = "exciter"', *keys))


def test_an_exciter_and_its_parts(spoiled):
    keys = ("mass_g = 48", "coil_mass_g = 1.6", "suspension_n_per_m = { mean = 2700, sd = 300 }", 'magnet = "held"')
    (found,) = read(spoiled(ITEM, exciter(*keys))).setups[0].attached
    suspension = Quantity.from_mean(2700.0, 300.0)
    assert found == bayesplate.AttachedItem("exciter", (), 0.048, 1.6e-3, suspension, None, "held")
    (bare,) = read(spoiled(ITEM, exciter("at_mm = [100, 50]", "resonance_hz = 28.3"))).setups[0].attached
    assert bare == bayesplate.AttachedItem("exciter", ((0.1, 0.05),), resonance=28.3)


EXCITERS = {
    (exciter("suspension_n_per_m = 2700", "resonance_hz = 28"), "resonance_hz: wanted one of suspension_n_per_m and"),
    (exciter("mass_g = 48", "coil_mass_g = 48"), "coil_mass_g: wanted less than the whole exciter's 48 g, got 48 g"),
    (exciter('magnet = "loose"'), 'magnet: wanted "free" or "held", got "loose"'),
    (exciter("at_mm = []"), "at_mm: wanted a place [x, y] in mm, got an empty list"),
    (ITEM + "\ncoil_mass_g = 0.1", 'coil_mass_g: wanted it on an exciter only, got a thing of kind "accelerometer"'),
    (ITEM + "\nresonance_hz = 28", "resonance_hz: wanted it on an exciter only"),
    (ITEM + "\nsuspension_n_per_m = 28", "suspension_n_per_m: wanted it on an exciter only"),
    (ITEM + '\nmagnet = "free"', "magnet: wanted it on an exciter only"),
    (ITEM.replace("\nat_mm = [200, 20]", ""), "at_mm: wanted a place, because the mass is declared, got nothing"),
}


def test_what_no_exciter_is_and_nothing_else_has(spoiled):
    for item, wanted in sorted(EXCITERS):
        (fault,) = told(spoiled(ITEM, item))
        assert fault.startswith(f"{SETUP}attached 1 {wanted}")


def test_from_numbers_takes_all_of_it():
    setup = bayesplate.Setup.from_frequencies(
        {"(1,1)": 134.0}, edges="free", fluid=bayesplate.DeclaredFluid(997.0), bounce=[3.5, 5.0],
        attached=[bayesplate.AttachedItem("exciter", mass=0.048)],
    )  # fmt: skip
    sizes = {"length_x": 0.253, "length_y": 0.114, "thickness": 3e-3, "mass": 0.041, "setups": setup}
    board = bayesplate.Board.from_numbers("my-board", warp={"bow": -1e-3, "cup": [8e-4, 9e-4]}, **sizes)
    assert board.warp["cup"].lower == 0.0
    again = read(board.to_toml())
    assert again.setups == board.setups
    assert again.warp["bow"] == board.warp["bow"]
    assert again.warp["cup"].readings == pytest.approx(board.warp["cup"].readings, rel=1e-12)
    with pytest.raises(InputError, match="my-board warp: wanted one of cup, bow, twist, got cub"):
        bayesplate.Board.from_numbers("my-board", warp={"cub": 1e-3}, **sizes)
    with pytest.raises(InputError, match="my-board warp: wanted a dict of heights"):
        bayesplate.Board.from_numbers("my-board", warp=1e-3, **sizes)
    negative = bayesplate.Board.from_numbers("my-board", warp={"twist": -1e-3}, **sizes)
    with pytest.raises(InputError, match=re.escape("warp_mm.twist: wanted a number from 0 to 1000 mm, got -1")):
        bayesplate.check(negative)


def test_the_former_name_of_an_effect_is_accepted_wherever_one_is_named(spoiled, tmp_path):
    assert "air_loading" not in EFFECT_NAMES
    assert read(spoiled('["transverse_shear"]', '["air_loading"]')).effects == ("fluid_loading",)
    (fault,) = told(spoiled('["transverse_shear"]', '["air_loading", "fluid_loading"]'))
    assert fault == 'my-board.toml effects: wanted each name once, got "fluid_loading" twice'
    found = bayesplate.Problem.from_card("finnish-spruce-cantilever", effects=["air_loading"])
    assert found.prepared.board.effects == ("fluid_loading",)
    assert found.prepared.board.without(["air_loading"]).effects == ()
    with pytest.raises(InputError, match='effects 2: wanted each name once, got "fluid_loading" again'):
        bayesplate.Problem.from_card("finnish-spruce-cantilever", effects=["fluid_loading", "air_loading"])
    path = Path(tmp_path / "two.toml")
    boards = 'format = 1\nname = "two"\nboards = ["spruce-free-2L", "spruce-free-2R"]\neffects = ["air_loading"]\n'
    path.write_text(boards + '[[shared]]\neffect = "air_loading"\n', encoding="utf-8")
    campaign = load_campaign(path)
    assert (campaign.effects, campaign.shared[0].effect) == (("fluid_loading",), "fluid_loading")
    path.write_text(boards + '[[shared]]\neffect = "air_loading"\n[[shared]]\neffect = "fluid_loading"\n')
    with pytest.raises(InputError, match='wanted each effect once, got "fluid_loading" again'):
        load_campaign(path)


def test_an_empty_list_of_effects_declares_nothing_not_even_what_is_implied(spoiled):
    """As `--effects none` does: what is stated stays a candidate, with the size that is stated."""
    stated, none = 'effects = ["transverse_shear"]', read(spoiled('effects = ["transverse_shear"]', "effects = []"))
    implied = ("fluid_loading", "attached_mass")
    assert prepare(read(spoiled(stated, ""))).board.effects == implied
    prepared = prepare(none)
    assert prepared.board.effects == ()
    assert "fluid_loading" in forms(prepared.board)
    assert "\neffects = []\n" in none.to_toml()
    assert prepare(prepared.board).board.effects == ()
    taken = prepare(read(spoiled(stated, "")), effects=[]).board
    assert (taken.effects, prepare(taken).board.effects) == ((), ())
    assert prepare(none, effects=["grain_angle"]).board.effects == ("grain_angle",)


def test_an_empty_list_of_effects_in_python_is_that_of_a_card():
    setup = bayesplate.Setup.from_frequencies({"(1,1)": 134.0}, edges="free", bounce=5.0)
    sizes = {"length_x": 0.253, "length_y": 0.114, "thickness": 3e-3, "mass": 0.041, "setups": setup}
    boards = [bayesplate.Board.from_numbers("my-board", effects=given, **sizes) for given in (None, [], ["warp"])]
    assert [one.implies for one in boards] == [True, False, True]
    assert [implied_effects(one) for one in boards] == [("support_stiffness",), (), ("support_stiffness",)]
