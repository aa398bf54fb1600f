"""The shipped cards load, mean something possible, and hold the published numbers."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from stated import frequencies, millimetres

from bayesplate.board.board import Board
from bayesplate.board.campaign import load_campaign
from bayesplate.board.checks import board_mass, physical_faults
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


def test_the_shelf():
    assert card_names("boards") == tuple(sorted((*PAPER, *FREE, *PANELS, "nemus-D")))
    assert card_names("priors") == ("spruce", "weakly-informative")
    assert card_names("coefficients") == ("paper-cantilever", "paper-clamped")


PROFILES = ("support_stiffness", "thickness_profile", "outline_profile")
DECLARED = dict.fromkeys(FREE, PROFILES) | {"spruce-free-2R": PROFILES[:2], "foam-panel-exciter": ("fluid_loading",)}
"""Effects by what a card states: the free boards their support and shape, the foam its air."""


def test_a_shipped_board_is_sound_and_declares_effects_by_what_it_states_alone():
    for name in card_names("boards"):
        card = Board.from_toml(name)

        assert physical_faults(card) == []
        assert card.effects == ()
        assert card.prior == "weakly-informative"
        assert card.source
        declared = prepare(name).board.effects
        assert tuple(one for one in declared if one != "exciter") == DECLARED.get(name, ())


def test_the_boards_of_the_paper():
    for name, (labels, hertz, (length, width, thickness, density)) in PAPER.items():
        card = Board.from_toml(name)
        (setup,) = card.setups

        assert {label: quantity.mean for label, quantity in frequencies(setup).items()} == dict(
            zip(labels, hertz, strict=True)
        )
        assert millimetres(card, "length_x", "length_y", "thickness") == (length, width, thickness)
        assert card.inputs["density"].mean == density
        assert card.inputs["poisson_xy"] == Quantity.exact(0.51)
        assert setup.resolution == 1
        table = load_coefficients(setup.table_name)
        free_length = length - sum(1e3 * quantity.mean for quantity in setup.clamped.values())
        assert table.aspect_ratio == pytest.approx(free_length / width)
        assert set(table.table) == set(setup.labels)
        assert (not setup.is_noise_assumed) == name.endswith("-fe")


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


def test_the_free_boards():
    for name, mass, labelled, unlabelled, some, confidence, rigid in FREE_BOARDS:
        card = Board.from_toml(name)
        (setup,) = card.setups

        assert 1e3 * board_mass(card) == pytest.approx(mass)
        assert (len(setup.readings), len(setup.peaks)) == (labelled, unlabelled)
        assert {reading.confidence for reading in setup.readings} == {confidence}
        assert (setup.bounce.mean - setup.bounce.sd, setup.bounce.mean + setup.bounce.sd) == rigid
        assert {label: frequencies(setup)[Label(*label)].mean for label in some} == some
        assert setup.resolution == 0
        assert edge_letters(setup.edges) == "FFFF"
        assert len(card.inputs["length_y"].at_x) == 5
        thickness = card.inputs["thickness"]
        assert len(thickness.at_x) == len(thickness.at_y) == 10
        # opposite corners: the residue is positive where m + n is even, whatever the board
        signs = {reading.label: reading.sign for reading in setup.readings}
        assert signs == {label: "+" if sum(label) % 2 == 0 else "-" for label in setup.labels}


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


def test_peaks_of_the_free_boards():
    """The sd is half the spread of the fit, and at least 0.1 Hz; the peaks ascend, and none is a labelled mode."""
    for name in FREE:
        (setup,) = Board.from_toml(name).setups
        read = {
            peak.frequency.mean: (peak.frequency.sd, peak.sign, round(100 * peak.damping, 9)) for peak in setup.peaks
        }

        assert {hertz: read[hertz] for hertz in PEAKS[name]} == PEAKS[name]
        assert list(read) == sorted(read)
        assert min(sd for sd, _, _ in read.values()) >= 0.1
        assert not {*setup.measured} & set(read)


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


def test_the_campaigns_of_the_half_tops():
    aside, every = load_campaign("spruce-half-tops-set-aside"), load_campaign("spruce-half-tops-all")
    assert (aside.boards, every.boards) == (FREE[6:], FREE)
    assert (aside.shared, every.shared, aside.effects, every.effects) == ((), (), (), ())
    assert "24 November 2026" in aside.title


def test_the_board_of_three_sessions():
    """Peaks alone; each of the six spreads by the per cent of the source, largest less smallest over the mean."""
    card = Board.from_toml("nemus-D")
    sessions = [list(setup.unlabelled) for setup in card.setups]
    spread = [100 * (max(hertz) - min(hertz)) / (sum(hertz) / 3) for hertz in zip(*sessions, strict=True)]

    assert [setup.name for setup in card.setups] == ["session-1", "session-2", "session-3"]
    assert {edge_letters(setup.edges) for setup in card.setups} == {"CFFF"}
    assert [round(percent, 1) for percent in spread] == [2.4, 2.4, 2.0, 0.9, 2.0, 1.0]
    assert all(not setup.readings for setup in card.setups)


def test_a_shipped_prior_names_its_sources():
    for name in card_names("priors"):
        card = load_prior(name)

        assert list(card.constants) == ["E_x", "E_y", "G_xy"]
        assert all(card.sources.values())


def readme_examples() -> list[str]:
    text = (shelf_folder("boards").parent / "README.md").read_text(encoding="utf-8")
    return re.findall(r"```toml\n(.*?)```", text, re.DOTALL)


def test_the_examples_of_the_readme_are_cards(tmp_path):
    board, profile, sections, setups, prior, table, campaign = readme_examples()

    card = Board.from_text(board, "my-board")
    assert physical_faults(card) == []
    more = sections.replace('"(1,1)" = "+"', '"(1,0)" = "+"').replace("at_mm = [20, 20]", "at_mm = [60, 20]")
    assert physical_faults(Board.from_text(board + more, "my-board")) == []
    narrow = re.sub(r"length_y_mm = 114.*\nthickness_mm = .*\n", profile.replace("580", "250"), board)
    assert Board.from_text(narrow, "my-board").inputs["thickness"].has_profile
    two = Board.from_text(board[: board.index("[setup]")] + setups, "my-board")
    assert [setup.name for setup in two.setups] == ["clamped", "free"]
    (tmp_path / "my-prior.toml").write_text(prior, encoding="utf-8")
    assert load_prior(tmp_path / "my-prior.toml").noise_percent is not None
    (tmp_path / "my-table.toml").write_text(table, encoding="utf-8")
    assert len(load_coefficients(tmp_path / "my-table.toml").table) == 3
    (tmp_path / "my-campaign.toml").write_text(campaign, encoding="utf-8")
    assert load_campaign(tmp_path / "my-campaign.toml").boards == ("spruce-free-2L", "./my-board.toml")


def test_reading_cards_imports_no_heavy_library():
    code = (
        "import sys, bayesplate.board.named; "
        "print([name for name in ('scipy.stats', 'arviz', 'matplotlib', 'emcee', 'skfem') if name in sys.modules])"
    )
    place = Path(__file__).parents[2]
    result = subprocess.run([sys.executable, "-c", code], cwd=place, capture_output=True, text=True, check=True)

    assert result.stdout.strip() == "[]"
