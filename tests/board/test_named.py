"""What a card names: its prior, its coefficients and its effects, and a campaign its boards."""

from __future__ import annotations

import pytest
from made_campaigns import TWO_BOARDS
from made_isotropic import sheet
from stated import changed, read

import bayesplate
from bayesplate.board.board import Board
from bayesplate.board.campaign import is_campaign, load_campaign
from bayesplate.board.named import load_named_cards
from bayesplate.board.shelf import shelf_folder
from bayesplate.board.words import EFFECT_NAMES
from bayesplate.campaign.population import require_moduli
from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.forms import forms
from bayesplate.effects import implied_effects
from bayesplate.errors import InputError

RESOLUTION = "resolution_hz = 1\n"
HZ = {(2, 0): 144.5, (1, 1): 159.8, (2, 1): 358.1}
EFFECTS = 'effects = ["transverse_shear"]'


def test_cards_that_are_not_there_are_named_at_once():
    own_table = changed(RESOLUTION, RESOLUTION + 'published_coefficients = "paper"\n')
    table_alone = load_named_cards(read(own_table))
    both = load_named_cards(read(changed("poisson_xy = 0.51", 'prior = "spruse"', text=own_table)))
    places = [
        'my-board.toml [material] prior -> "spruse"',
        'my-board.toml [setup] published_coefficients -> "paper"',
    ]

    assert [fault.place for fault in both.faults] == places
    assert [fault.place for fault in table_alone.faults] == places[1:]
    assert (both.prior, both.tables, table_alone.tables) == (None, {}, {})
    assert table_alone.prior is not None


def test_a_board_that_was_read_names_its_cards_still():
    for card in ("fiemme-spruce-clamped", Board.from_toml("fiemme-spruce-clamped")):
        (setup,) = prepare(card).board.setups
        assert setup.published_coefficients.name == "paper-clamped", card


def test_cards_are_found_beside_the_board(tmp_path):
    """Wherever the program was started: a relative path begins at the folder of the board card."""
    text = changed("poisson_xy = 0.51", 'prior = "./mine.toml"')
    text = changed(RESOLUTION, RESOLUTION + 'published_coefficients = "sub/own.toml"\n', text=text)
    (tmp_path / "my-board.toml").write_text(text, encoding="utf-8")
    missing = load_named_cards(Board.from_toml(tmp_path / "my-board.toml"))
    (tmp_path / "sub").mkdir()
    shipped = (("priors", "spruce", "mine.toml", "mine"), ("coefficients", "paper-cantilever", "sub/own.toml", "own"))
    for kind, name, target, own in shipped:
        text = (shelf_folder(kind) / f"{name}.toml").read_text(encoding="utf-8")
        (tmp_path / target).write_text(text.replace(f'name = "{name}"', f'name = "{own}"'), encoding="utf-8")
    found = load_named_cards(Board.from_toml(tmp_path / "my-board.toml"))

    assert [fault.got for fault in missing.faults] == ["no such file", "no such file"]
    assert found.faults == ()
    assert found.prior is not None
    assert (found.prior.name, found.tables["cantilever"].name) == ("mine", "own")


def test_a_prior_of_one_modulus_serves_isotropic_boards_and_one_of_three_the_others():
    prior = bayesplate.PriorCard.from_quantities("metals", {"E": bayesplate.Quantity.from_median(70e9, 2)}, source="-")
    problem = bayesplate.Problem.from_card(sheet(HZ), prior=prior)

    assert list(problem.prior.constants) == ["E_x"]
    assert bayesplate.Problem.from_card(sheet(HZ), prior=problem.prior).prior == problem.prior
    with pytest.raises(InputError, match="wanted a prior of three constants, got metals, which states E alone"):
        bayesplate.Problem.from_card(sheet(HZ, isotropic=False), prior=prior)
    with pytest.raises(InputError, match="wanted a prior card of E_x, E_y, G_xy, got metals, which states E alone"):
        require_moduli(prior, "[population] prior")
    with pytest.raises(InputError, match=r"wanted a prior of E, .* got spruce, .*a card of your own with \[E\]"):
        bayesplate.Problem.from_card(sheet(HZ, prior="spruce"))


def test_the_former_name_of_an_effect_is_accepted_wherever_one_is_named():
    assert "air_loading" not in EFFECT_NAMES
    assert read(changed("transverse_shear", "air_loading")).effects == ("fluid_loading",)
    found = bayesplate.Problem.from_card("finnish-spruce-cantilever", effects=["air_loading"])
    assert found.prepared.board.effects == ("fluid_loading",)
    assert found.prepared.board.without(["air_loading"]).effects == ()
    with pytest.raises(InputError, match="effects: wanted a list of names, got 'air_loading'"):
        found.prepared.board.without("air_loading")
    with pytest.raises(InputError, match='effects 2: wanted each name once, got "fluid_loading" again'):
        bayesplate.Problem.from_card("finnish-spruce-cantilever", effects=["fluid_loading", "air_loading"])


def test_an_empty_list_of_effects_declares_nothing_not_even_what_is_implied():
    """As `--effects none` does: what is stated stays a candidate, with the size that is stated."""
    none, silent = read(changed(EFFECTS, "effects = []")), read(changed(EFFECTS, ""))
    assert prepare(silent).board.effects == ("fluid_loading", "attached_mass")
    prepared = prepare(none)
    assert prepared.board.effects == ()
    assert "fluid_loading" in forms(prepared.board)
    assert "\neffects = []\n" in none.to_toml()
    assert prepare(prepared.board).board.effects == ()
    taken = prepare(silent, effects=[]).board
    assert (taken.effects, prepare(taken).board.effects) == ((), ())
    assert prepare(none, effects=["grain_angle"]).board.effects == ("grain_angle",)

    for given, implied in [(None, ("support_stiffness",)), ([], ()), (["warp"], ("support_stiffness",))]:
        board = sheet(HZ, effects=given, setups=bayesplate.Setup.from_frequencies(HZ, edges="free", bounce=5.0))
        assert (board.has_implied_effects, implied_effects(board)) == (bool(implied), implied)


def test_a_campaign_names_its_boards_and_what_they_share(tmp_path):
    path = tmp_path / "my-campaign.toml"
    path.write_text(TWO_BOARDS, encoding="utf-8")
    card = load_campaign(path)

    assert card.boards == ("spruce-free-2L", "./my-board.toml")
    assert [(one.effect, one.way) for one in card.shared] == [("attached_mass", "value"), ("transverse_shear", "ratio")]
    assert card.population is not None
    assert card.population.prior == "spruce"
    assert card.board_path("spruce-free-2L") == "spruce-free-2L"
    assert card.board_path("./my-board.toml") == tmp_path / "my-board.toml"
    assert card.text == TWO_BOARDS
    path.write_text(TWO_BOARDS.replace('"ratio"', '"ratio"\nscatter_percent = 20'), encoding="utf-8")
    assert [one.scatter_percent for one in load_campaign(path).shared] == [0.0, 20.0]
    path.write_text(TWO_BOARDS.partition("[[shared]]")[0] + 'effects = ["support_stiffness"]\n', encoding="utf-8")
    alone = load_campaign(path)
    assert (alone.shared, alone.population, alone.effects) == ((), None, ("support_stiffness",))


def test_a_campaign_is_told_from_a_board(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "my-campaign.toml"
    path.write_text(TWO_BOARDS, encoding="utf-8")

    for campaign in (path, "my-campaign.toml", "spruce-half-tops"):
        assert is_campaign(campaign), campaign
    board = shelf_folder("boards") / "spruce-free-2R.toml"
    for other in ("spruce-free-2R", "nothing-of-that-name", "nothing.toml", board, 3):
        assert not is_campaign(other), other
    with pytest.raises(InputError, match=r"^my-campaign.toml: wanted a board card, got a campaign \(check, fit,"):
        Board.from_toml(path)


def test_a_population_of_three_constants_takes_no_isotropic_board(tmp_path):
    for i in (1, 2):
        text = sheet({label: hz * (1.0 + 0.001 * i) for label, hz in HZ.items()}).to_toml()
        (tmp_path / f"board-{i}.toml").write_text(text.replace('"sheet"', f'"board-{i}"'))
    path = tmp_path / "together.toml"
    head = 'format = 1\nname = "together"\nboards = ["./board-1.toml", "./board-2.toml"]\n'
    path.write_text(head + '[population]\nprior = "spruce"\n')

    with pytest.raises(InputError, match="wanted boards of three constants, got board-1, board-2, whose E_y and G_xy"):
        bayesplate.Campaign.from_card(path)
    path.write_text(head)
    assert len(bayesplate.Campaign.from_card(path).problems) == 2
