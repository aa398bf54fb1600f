"""Warp and exciters that the independent generator plants: declared on a card, the fit covers what is true."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from generator.boards import PlantedBoard, plant

import bayesplate

NOISE_CENTS = 4.0
CUP = {"cup": 1.2e-3, "bow": 0.0, "twist": 0.0}
DRIVE = {"mass": 20e-3, "places": ((0.15, 0.12),), "coil_mass": 0.8e-3, "suspension": 1000.0, "magnet": "free"}
"""As heavy and as soft that it raises the lowest mode by some twenty cents."""
ENDS = (0.005, 0.995)


def planted(design: str, effect: str, parameters: Mapping[str, Any], *, places_known: bool = True) -> PlantedBoard:
    rng = np.random.default_rng(1)
    return plant(rng, design, [effect], noise_cents=NOISE_CENTS, fixed={effect: parameters}, places_known=places_known)


def on_card(board: PlantedBoard, folder: Path, **stated: str) -> Path:
    card = folder / "planted.toml"
    card.write_text(board.card_text(stated), encoding="utf-8")
    return card


def assert_covers(board: PlantedBoard, card: Path, truths: Mapping[str, float]) -> None:
    """Every constant and every true size lies within its interval of 99 per cent."""
    draws = bayesplate.fit(card).draws
    truths = {**{name: board.truth.constants[name] for name in draws.moduli}, **truths}
    drawn = {**draws.moduli, **draws.inputs}
    outside = {}
    for name, truth in truths.items():
        low, high = np.quantile(drawn[name], ENDS)
        if not low <= truth <= high:
            outside[name] = (low, truth, high)

    assert outside == {}


@pytest.fixture(scope="module")
def warped() -> PlantedBoard:
    return planted("free-12", "warp", CUP)


def test_a_warped_board(warped, tmp_path):
    """Its cup alone raises (2,0) by thirty cents, which is three per cent of E_x."""
    assert warped.shifts()["free"][2, 0] > 5.0 * NOISE_CENTS
    assert_covers(warped, on_card(warped, tmp_path, effects='["warp"]'), {"warp.cup": CUP["cup"]})


@pytest.mark.slow
def test_an_exciter_at_a_known_place(tmp_path):
    board = planted("clamped-9", "exciter", DRIVE)
    assert board.shifts()["clamped"][0, 0] > 5.0 * NOISE_CENTS
    card = on_card(board, tmp_path, effects='["exciter"]', exciter_mass_g="20")
    assert_covers(board, card, {"exciter.suspension[clamped]": DRIVE["suspension"]})


@pytest.mark.slow
def test_an_exciter_of_which_nobody_says_where_it_is(tmp_path):
    """The middle of the board stands for both halves, so that the place is that of the nearest corner's quarter."""
    board = planted("clamped-9", "exciter", DRIVE, places_known=False)
    card = on_card(board, tmp_path, effects='["exciter"]', exciter_mass_g="20")
    ((x, y),) = DRIVE["places"]
    design = board.design
    places = {"exciter.place_x[clamped]": x / design.L_x, "exciter.place_y[clamped]": y / design.L_y}
    assert_covers(board, card, {"exciter.suspension[clamped]": DRIVE["suspension"], **places})


@pytest.mark.slow
def test_a_diagnosis_of_a_warped_board_lists_warp(warped, tmp_path):
    found = bayesplate.diagnose(on_card(warped, tmp_path)).diagnosis
    listed = {entry.name for entry in found.effects} | {
        candidate.name for candidate in found.candidates if not candidate.rejected_because
    }

    assert "warp" in listed
