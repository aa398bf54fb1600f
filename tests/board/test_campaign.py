"""Campaign cards: what they say, and every fault of one at once."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_campaigns import TWO_BOARDS as CAMPAIGN

from bayesplate.board.board import Board
from bayesplate.board.campaign import is_campaign, load_campaign
from bayesplate.board.shelf import card_names, shelf_folder
from bayesplate.errors import InputError


def written(tmp_path: Path, text: str = CAMPAIGN) -> Path:
    path = tmp_path / "my-campaign.toml"
    path.write_text(text)
    return path


def test_a_campaign_is_read(tmp_path):
    path = written(tmp_path)
    card = load_campaign(path)

    assert card.boards == ("spruce-free-2L", "./my-board.toml")
    assert [(one.effect, one.way) for one in card.shared] == [("attached_mass", "value"), ("transverse_shear", "ratio")]
    assert card.population is not None
    assert card.population.prior == "spruce"
    assert card.board_path("spruce-free-2L") == "spruce-free-2L"
    assert card.board_path("./my-board.toml") == tmp_path / "my-board.toml"
    assert card.text == CAMPAIGN


def test_boards_may_scatter_about_what_they_share_or_share_nothing_and_declare_effects(tmp_path):
    scattered = load_campaign(written(tmp_path, CAMPAIGN.replace('"ratio"', '"ratio"\nscatter_percent = 20')))
    head = CAMPAIGN.split("[[shared]]", maxsplit=1)[0]
    alone = load_campaign(written(tmp_path, head + 'effects = ["support_stiffness"]\n'))

    assert [one.scatter_percent for one in scattered.shared] == [0.0, 20.0]
    assert (alone.shared, alone.population, alone.effects) == ((), None, ("support_stiffness",))


FAULTS = [
    ('name = "my-campaign"', 'name = "other"', 'my-campaign.toml name: wanted "my-campaign"'),
    ('"spruce-free-2L", ', "", "my-campaign.toml boards: wanted at least two boards, got 1"),
    ("./my-board.toml", "spruce-free-2L", "my-campaign.toml boards: wanted each board once"),
    ("./my-board.toml", "my board", "my-campaign.toml boards 2: wanted A-Z, a-z"),
    ('effect = "attached_mass"', 'effect = "attached_mas"', 'my-campaign.toml [[shared]] 1 effect: wanted "transv'),
    ('as = "ratio"', "scatter_percent = 400", "my-campaign.toml [[shared]] 2 scatter_percent: wanted a number from"),
    ('as = "ratio"', 'scatter_percent = "a little"', "[[shared]] 2 scatter_percent: wanted a number"),
    ("transverse_shear", "attached_mass", "my-campaign.toml [[shared]] 2 effect: wanted each effect once"),
    ('as = "ratio"', 'as = "rate"', 'my-campaign.toml [[shared]] 2 as: wanted "value" or "ratio"'),
    ('as = "ratio"', 'like = "ratio"', "my-campaign.toml [[shared]] 2 like: wanted one of effect, as"),
    ('prior = "spruce"', "prior = 3", "my-campaign.toml [population] prior: wanted"),
    ('title = "Two boards"', 'tittle = "Two boards"', "did you mean title?"),
]


def test_a_fault_is_named_with_its_place(tmp_path):
    for old, new, fault in FAULTS:
        assert old in CAMPAIGN
        with pytest.raises(InputError) as refused:
            load_campaign(written(tmp_path, CAMPAIGN.replace(old, new)))

        assert len(refused.value.faults) == 1
        assert fault in str(refused.value)


def test_all_faults_come_at_once(tmp_path):
    spoilt = CAMPAIGN.replace("format = 1", "format = 2").replace('"ratio"', '"rate"').replace('"spruce"', "3")
    with pytest.raises(InputError) as refused:
        load_campaign(written(tmp_path, spoilt))

    assert len(refused.value.faults) == 3


def test_a_campaign_is_told_from_a_board(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = written(tmp_path)

    assert is_campaign(path)
    assert is_campaign("my-campaign.toml")
    assert is_campaign("spruce-half-tops")
    assert not is_campaign("spruce-free-2R")
    assert not is_campaign("nothing-of-that-name")
    assert not is_campaign("nothing.toml")
    assert not is_campaign(shelf_folder("boards") / "spruce-free-2R.toml")
    assert not is_campaign(3)
    with pytest.raises(InputError, match=r"^my-campaign.toml: wanted a board card, got a campaign \(check, fit,"):
        Board.from_toml(path)


def test_a_shipped_campaign_names_boards_that_load():
    for name in card_names("campaigns"):
        card = load_campaign(name)

        assert name not in card_names("boards")
        assert card.title
        for board in card.boards:
            assert Board.from_toml(card.board_path(board)).name == board
