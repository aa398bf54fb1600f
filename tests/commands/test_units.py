"""A card whose frequencies or lengths are in another unit, or whose sides or grain are exchanged, is asked about."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from bayesplate.board.shelf import shelf_folder
from bayesplate.cli import main

NAME = "finnish-spruce-cantilever"
EXCHANGED = "are length_x_mm and length_y_mm exchanged? x is along the grain"


def in_other_units(factor: float) -> list[tuple[str, str]]:
    readings = {"(1,0)": 52, "(1,1)": 98, "(2,0)": 310, "(1,2)": 337, "(2,1)": 398, "(2,2)": 637}
    return [(f'"{label}" = {hz}', f'"{label}" = {factor * hz:.3f}') for label, hz in readings.items()]


CASES = {
    "kHz": (in_other_units(1e-3), 3, "(in Hz: 1 kHz is 1000 Hz)"),
    "rad/s": (in_other_units(6.2832), 3, "in rad/s? in Hz they are that over 2 pi = 6.28"),
    "cm": ([("= 253", "= 25.3"), ("= 114", "= 11.4"), ("{ x0 = 30 }", "{ x0 = 3 }")], 3,
           "are length_x_mm and length_y_mm in cm? 1 cm is 10 mm"),
    "exchanged": ([("length_x_mm = 253", "length_x_mm = 114"), ("length_y_mm = 114", "length_y_mm = 253")], 4,
                  EXCHANGED),
}  # fmt: skip


@pytest.mark.parametrize(
    ("command", "case"), [("compare", "kHz"), ("fit", "rad/s"), ("check", "cm"), ("fit", "exchanged")]
)
def test_another_unit_is_asked_about(command: str, case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    changes, code, question = CASES[case]
    monkeypatch.chdir(tmp_path)
    text = (shelf_folder("boards") / f"{NAME}.toml").read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    card = tmp_path / f"{NAME}.toml"
    card.write_text(text, encoding="utf-8")

    result = CliRunner().invoke(main, [command, str(card)])

    assert result.exit_code == code
    assert question in result.stderr
    assert list(tmp_path.iterdir()) == [card]
