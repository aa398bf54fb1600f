"""Cards of a few boards alike, for tests of batches: the clamped board of the paper with modes a little apart."""

from __future__ import annotations

from pathlib import Path

from bayesplate.board.board import Board

EDGES = '{ x0 = "clamped", x1 = "clamped", y0 = "clamped", y1 = "clamped" }'
HERTZ = {"(0,0)": 57.0, "(0,1)": 100.0, "(1,0)": 130.0, "(1,1)": 162.0, "(0,2)": 170.0, "(1,2)": 224.0}


def card_text(name: str, factor: float = 1.0) -> str:
    """The card of a board whose frequencies are all higher by a factor."""
    text = Board.from_toml("fiemme-spruce-clamped").text.replace('name = "fiemme-spruce-clamped"', f'name = "{name}"')
    for label, hertz in HERTZ.items():
        text = text.replace(f'"{label}" = {hertz:.0f}', f'"{label}" = {hertz * factor:.1f}')
    return text


def write_cards(folder: Path, names: str = "ab", bad: bool = True) -> Path:
    """Boards of one letter each, and a card with a fault and one that is not TOML."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        (folder / f"{name}.toml").write_text(card_text(name, 1.0 + 0.01 * (ord(name) - ord("a"))), encoding="utf-8")
    if bad:
        (folder / "n.toml").write_text(card_text("n").replace("thickness_mm = 3", "thickness_mm = -3"))
        (folder / "m.toml").write_text("format = ")
    return folder


TEMPLATE = f"""
format = 1
name = "template"
[plate]
length_x_mm = 600
length_y_mm = 412
thickness_mm = 3
density_kg_m3 = 399
[material]
poisson_xy = 0.51
[setup]
name = "clamped"
edges = {EDGES}
resolution_hz = 1
"""
