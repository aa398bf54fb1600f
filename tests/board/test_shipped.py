"""The shipped cards load, mean something possible, and hold the published numbers."""

from __future__ import annotations

import re

import pytest
from stated import frequencies, millimetres, read

from bayesplate.board.board import Board, nominal_mass
from bayesplate.board.campaign import load_campaign
from bayesplate.board.checks import physical_faults
from bayesplate.board.coefficients import load_coefficients
from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup_keys import edge_letters
from bayesplate.board.shelf import card_names, shelf_folder
from bayesplate.commands.prepare import prepare
from bayesplate.labels import Label

FREE = tuple(f"spruce-free-{number}{side}" for number in (1, 2, 3, 4, 5) for side in "LR")
PANELS = ("steel-air-water", "foam-panel-exciter", "acrylic-panel")
CANTILEVER = [(1, 0), (1, 1), (2, 0), (1, 2), (2, 1), (2, 2)]
CLAMPED = [(0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2)]
PAPER = {
    "finnish-spruce-cantilever": (CANTILEVER, (52, 98, 310, 337, 398, 637), (253, 114, 3, 473.9)),
    "paper-cantilever-fe": (CANTILEVER, (51, 100, 315, 336, 394, 629), (253, 114, 3, 473.9)),
    "fiemme-spruce-clamped": (CLAMPED, (57, 100, 130, 162, 170, 224), (600, 412, 3, 399)),
    "paper-clamped-fe": (CLAMPED, (56, 98, 130, 161, 169, 221), (600, 412, 3, 399)),
}
PROFILES = ("support_stiffness", "thickness_profile", "outline_profile")
DECLARED = dict.fromkeys(FREE, PROFILES) | {"spruce-free-2R": PROFILES[:2], "foam-panel-exciter": ("fluid_loading",)}
"""Effects by what a card states: the free boards their support and shape, the foam its air."""


def test_a_shipped_board_is_sound_and_declares_effects_by_what_it_states_alone():
    assert card_names("boards") == tuple(sorted((*PAPER, *FREE, *PANELS, "nemus-D")))
    for name in card_names("boards"):
        card = Board.from_toml(name)

        assert physical_faults(card) == []
        assert (card.effects, card.prior) == ((), "weakly-informative")
        assert card.source
        declared = prepare(name).board.effects
        assert tuple(one for one in declared if one != "exciter") == DECLARED.get(name, ())


def test_the_boards_of_the_paper():
    for name, (labels, hertz, (length, width, thickness, density)) in PAPER.items():
        card = Board.from_toml(name)
        (setup,) = card.setups

        read_hz = {label: quantity.mean for label, quantity in frequencies(setup).items()}
        assert read_hz == dict(zip(labels, hertz, strict=True))
        assert millimetres(card, "length_x", "length_y", "thickness") == (length, width, thickness)
        assert card.inputs["density"].mean == density
        assert card.inputs["poisson_xy"] == Quantity.exact(0.51)
        assert setup.resolution == 1
        table = load_coefficients(setup.table_name)
        free_length = length - sum(1e3 * quantity.mean for quantity in setup.clamped.values())
        assert table.aspect_ratio == pytest.approx(free_length / width)
        assert set(table.table) == set(setup.labels)
        assert (not setup.is_noise_assumed) == name.endswith("-fe")


TABLES = {
    "paper-cantilever": ("CFFF", 223 / 114, CANTILEVER, (3.21, 3.99, 117, 14.4, 124, 134),
                         (0, 0.94, 41.9, 1720, 15.6, 1910), (0, 40.5, 13.6, 155, 328, 1260)),
    "paper-clamped": ("CCCC", 600 / 412, [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2)],
                      (236, 237.5, 1790, 242, 1792, 1799), (1214, 8589, 1652, 31910, 10180, 35250),
                      (146.9, 552.3, 534.9, 1196, 2051, 4469)),
}  # fmt: skip
"""Edges, ratio of the sides, labels, and the columns a, b and c of the paper's tables."""


def test_the_tables_of_the_paper():
    assert card_names("coefficients") == tuple(TABLES)
    for name, (edges, ratio, labels, a, b, c) in TABLES.items():
        card = load_coefficients(name)

        assert card.table == dict(zip(labels, zip(a, b, c, strict=True), strict=True))
        assert edge_letters(card.edges.words) == edges
        assert card.first_label == min(labels)
        assert card.aspect_ratio == pytest.approx(ratio)
    card = load_coefficients("paper-cantilever")
    assert list(card.r_squared.values()) == [1.00, 1.00, 0.999, 0.999, 1.00, 1.00]
    assert (card.training.E_x_gpa, card.training.E_y_gpa, card.training.G_xy_gpa) == (10.7, 0.716, 0.50)
    assert (card.training.G_xz_gpa, card.training.G_yz_gpa, card.training.nu_xy) == (0.62, 0.023, 0.51)


FREE_BOARDS = [
    ("spruce-free-1L", 236.0, 8, 11, {(0, 2): 133.28, (2, 2): 263.02}, 0.7, (3.5, 5.0)),
    ("spruce-free-1R", 248.0, 6, 10, {(1, 1): 55.08, (2, 2): 290.29}, 0.9, (3.5, 5.0)),
    ("spruce-free-2L", 256.0, 9, 7, {(0, 2): 163.29, (4, 1): 455.26}, 0.98, (3.5, 4.5)),
    ("spruce-free-2R", 256.8, 9, 7, {(0, 2): 159.14, (4, 1): 448.79}, 0.98, (3.0, 5.0)),
    ("spruce-free-3L", 235.2, 7, 10, {(1, 2): 178.89, (2, 2): 265.41}, 0.7, (3.5, 5.0)),
    ("spruce-free-3R", 253.2, 6, 11, {(1, 1): 60.35, (2, 2): 292.24}, 0.9, (3.5, 5.0)),
    ("spruce-free-4L", 225.6, 8, 9, {(0, 2): 159.72, (2, 2): 283.93}, 0.98, (3.5, 5.5)),
    ("spruce-free-4R", 211.2, 7, 9, {(1, 2): 198.36, (2, 2): 283.49}, 0.9, (3.0, 6.0)),
    ("spruce-free-5L", 272.8, 8, 10, {(0, 2): 162.87, (2, 2): 292.36}, 0.98, (3.0, 5.0)),
    ("spruce-free-5R", 269.2, 8, 8, {(0, 2): 163.75, (2, 2): 291.12}, 0.98, (3.5, 4.5)),
]
"""Mass (g), numbers of labels and of other peaks, some modes (Hz), confidence, two peaks below the first mode (Hz)."""
PEAKS = {
    "spruce-free-1L": {384.06: (0.145, "+", 0.435), 634.11: (0.1, "-", 0.38), 970.01: (0.195, "-", 0.075)},
    "spruce-free-1R": {369.63: (0.105, "", 0.25), 566.04: (1.085, "-", 0.275), 876.94: (0.295, "", 0.095)},
    "spruce-free-2L": {404.69: (0.155, "", 0.45), 553.65: (1.06, "-", 0.485), 995.35: (0.635, "+", 0.045)},
    "spruce-free-2R": {404.01: (0.175, "+", 0.5), 707.01: (0.1, "+", 0.44), 995.25: (0.53, "+", 0.32)},
    "spruce-free-3L": {361.36: (0.11, "+", 0.835), 397.11: (0.1, "-", 0.895), 936.0: (0.545, "-", 0.32)},
    "spruce-free-3R": {158.94: (1.18, "+", 0.115), 683.31: (0.275, "+", 0.43), 993.05: (0.33, "-", 0.335)},
    "spruce-free-4L": {404.36: (0.13, "-", 0.75), 741.7: (0.735, "+", 0.42), 944.07: (0.25, "-", 0.04)},
    "spruce-free-4R": {368.47: (0.28, "-", 0.035), 712.08: (0.135, "+", 0.085), 993.58: (0.64, "+", 0.165)},
    "spruce-free-5L": {192.38: (0.545, "-", 0.41), 711.51: (0.1, "-", 0.385), 888.22: (0.725, "", 0.11)},
    "spruce-free-5R": {412.63: (0.515, "-", 0.14), 700.29: (0.1, "-", 0.41), 886.95: (0.23, "", 0.1)},
}
"""Some peaks of each board, Hz: sd (Hz), sign and damping (%)."""


def test_the_free_boards():
    """The sd of a peak is half the spread of the fit, at least 0.1 Hz; peaks ascend, and none is a labelled mode."""
    for name, mass, labelled, unlabelled, some, confidence, rigid in FREE_BOARDS:
        card = Board.from_toml(name)
        (setup,) = card.setups
        thickness = card.inputs["thickness"]

        assert 1e3 * nominal_mass(card) == pytest.approx(mass)
        assert (len(setup.readings), len(setup.peaks)) == (labelled, unlabelled)
        assert {reading.confidence for reading in setup.readings} == {confidence}
        assert (setup.bounce.mean - setup.bounce.sd, setup.bounce.mean + setup.bounce.sd) == rigid
        assert {label: frequencies(setup)[Label(*label)].mean for label in some} == some
        assert (setup.resolution, edge_letters(setup.edges)) == (0, "FFFF")
        assert [*map(len, (card.inputs["length_y"].at_x, thickness.at_x, thickness.at_y))] == [5, 10, 10]
        # opposite corners: the residue is positive where m + n is even, whatever the board
        signs = {reading.label: reading.sign for reading in setup.readings}
        assert signs == {label: "+" if sum(label) % 2 == 0 else "-" for label in setup.labels}
        peaks = {one.frequency.mean: (one.frequency.sd, one.sign, round(100 * one.damping, 9)) for one in setup.peaks}
        assert {hertz: peaks[hertz] for hertz in PEAKS[name]} == PEAKS[name]
        assert list(peaks) == sorted(peaks)
        assert min(sd for sd, _, _ in peaks.values()) >= 0.1
        assert not {*setup.measured} & set(peaks)


def test_the_panels():
    air, water = Board.from_toml("steel-air-water").setups
    added = [(frequencies(air)[label].mean / frequencies(water)[label].mean) ** 2 - 1 for label in air.labels]
    assert [round(share, 3) for share in added] == [0.663, 0.533, 0.488, 0.573, 0.480]
    for name, count in (("foam-panel-exciter", 7), ("acrylic-panel", 10)):
        card = Board.from_toml(name)
        (setup,) = card.setups
        assert len(setup.labels) == count
        assert all(label.m % 2 == label.n % 2 == 0 for label in setup.labels)
        (exciter,) = setup.attached
        assert exciter.places == ((card.inputs["length_x"].mean / 2, card.inputs["length_y"].mean / 2),)
        assert exciter.suspension is not None
        assert exciter.suspension.mean == pytest.approx(1000 / 0.37, abs=1.0)
        assert exciter.magnet == "held"
    (setup,) = Board.from_toml("fiemme-spruce-clamped").setups
    (exciter,) = setup.attached
    assert exciter.mass is not None
    assert (exciter.kind, exciter.places, exciter.mass.mean) == ("exciter", (), 0.048)


def test_the_board_of_three_sessions():
    """Peaks alone; each of the six spreads by the per cent of the source, largest less smallest over the mean."""
    card = Board.from_toml("nemus-D")
    sessions = [list(setup.unlabelled) for setup in card.setups]
    spread = [100 * (max(hertz) - min(hertz)) / (sum(hertz) / 3) for hertz in zip(*sessions, strict=True)]

    assert [setup.name for setup in card.setups] == ["session-1", "session-2", "session-3"]
    assert {edge_letters(setup.edges) for setup in card.setups} == {"CFFF"}
    assert [round(percent, 1) for percent in spread] == [2.4, 2.4, 2.0, 0.9, 2.0, 1.0]
    assert all(not setup.readings for setup in card.setups)


def test_the_campaigns_name_boards_that_load():
    for name in card_names("campaigns"):
        card = load_campaign(name)

        assert name not in card_names("boards")
        assert card.title
        assert set(card.boards) <= set(card_names("boards"))
    aside, every = load_campaign("spruce-half-tops-set-aside"), load_campaign("spruce-half-tops-all")
    assert (aside.boards, every.boards) == (FREE[6:], FREE)
    assert (aside.shared, every.shared, aside.effects, every.effects) == ((), (), (), ())
    assert "24 November 2026" in aside.title


def test_a_shipped_prior_names_its_sources_and_that_by_default_knows_neither_axes_nor_material():
    assert card_names("priors") == ("spruce", "weakly-informative")
    for name in card_names("priors"):
        card = load_prior(name)
        assert list(card.constants) == ["E_x", "E_y", "G_xy"]
        assert all(card.sources.values())
    card = load_prior("weakly-informative")
    assert set(card.constants.values()) == {Quantity.from_median(3e9, 10)}
    low, high = card.for_board(True).constants["E_x"].quantile([0.025, 0.975])
    assert 0.004e9 < low < 0.005e9  # from foam
    assert 500e9 < high < 600e9  # to ceramics


def readme_examples() -> list[str]:
    text = (shelf_folder("boards").parent / "README.md").read_text(encoding="utf-8")
    return re.findall(r"```toml\n(.*?)```", text, re.DOTALL)


def test_the_examples_of_the_readme_are_cards(tmp_path):
    board, profile, sections, setups, prior, table, campaign = readme_examples()

    assert physical_faults(read(board)) == []
    more = sections.replace('"(1,1)" = "+"', '"(1,0)" = "+"').replace("at_mm = [20, 20]", "at_mm = [60, 20]")
    assert physical_faults(read(board + more)) == []
    narrow = re.sub(r"length_y_mm = 114.*\nthickness_mm = .*\n", profile.replace("580", "250"), board)
    assert read(narrow).inputs["thickness"].has_profile
    two = read(board[: board.index("[setup]")] + setups)
    assert [setup.name for setup in two.setups] == ["clamped", "free"]
    (tmp_path / "my-prior.toml").write_text(prior, encoding="utf-8")
    assert load_prior(tmp_path / "my-prior.toml").noise_percent is not None
    (tmp_path / "my-table.toml").write_text(table, encoding="utf-8")
    assert len(load_coefficients(tmp_path / "my-table.toml").table) == 3
    (tmp_path / "my-campaign.toml").write_text(campaign, encoding="utf-8")
    assert load_campaign(tmp_path / "my-campaign.toml").boards == ("spruce-free-4L", "./my-board.toml")
