"""The text of a first board card, from a few numbers; what was not given stands there as an example to be replaced."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from bayesplate.board.repeated import CALIPER
from bayesplate.board.words import EDGES
from bayesplate.labels import Label

_EXAMPLE = "# an example: put yours here"
HALF_TOP = {"length_x": 550.0, "length_y": 200.0, "thickness": 2.8}
"""A guitar half-top, mm: stands in for what is not known yet; its density is that of the wood whatever its sizes."""

SPRUCE_DENSITY = 420.0
_AIR = (
    "# The air of the room moves with the board; take these three lines out for frequencies computed without it.",
    "[setup.fluid]",
    "density_kg_m3 = 1.2",
    'baffle = "none"  # "full" for a board that fills the opening of a wall',
)


@dataclass(frozen=True)
class Starter:
    """What somebody knows of a board before its first card."""

    name: str
    title: str = ""
    notes: str = ""
    sizes: Mapping[str, float] = field(default_factory=dict)  # any of length_x, length_y, thickness, mm; mass, g
    edges: Mapping[str, str] = field(default_factory=lambda: dict.fromkeys(EDGES, "free"))
    prior: str = "weakly-informative"
    frequencies: Mapping[str, float] = field(default_factory=dict)  # label to Hz


def starter_text(starter: Starter, examples: Sequence[Label]) -> str:
    """A board card in TOML; the examples, modes of such a board, are lines to be filled in where not measured."""
    edges = ", ".join(f"{edge} = {_quoted(starter.edges[edge])}" for edge in EDGES)
    free_texts = {"title": starter.title, "notes": starter.notes}
    lines = [
        "format = 1",
        f"name = {_quoted(starter.name)}",
        *(f"{key} = {_quoted(text)}" for key, text in free_texts.items() if text),
        "",
        "[plate]  # the whole board; x is along the grain",
        _size(starter, "length_x", "length_x_mm = {:g}"),
        _size(starter, "length_y", "length_y_mm = {:g}"),
        _size(starter, "thickness", f"thickness_mm = {{{{ mean = {{:g}}, sd = {CALIPER:g} }}}}"),
        f"mass_g = {starter.sizes['mass']:g}"
        if "mass" in starter.sizes
        else f"density_kg_m3 = {SPRUCE_DENSITY:g}  # an example: put mass_g here in its place",
        "",
        "[material]",
        f"prior = {_quoted(starter.prior)}",
        "",
        "[setup]",
        f"edges = {{ {edges} }}",
    ]
    if "clamped" in starter.edges.values():
        lines.append("# clamped_mm = { x0 = 30 }  # what the clamp covers, where the plate's length includes it")
    lines.append("# unlabelled_hz = [404, 448.8]  # peaks of which you cannot tell the mode")
    lines += ["", *_AIR]
    lines += ["", '[setup.frequencies_hz]  # "(m,n)": m nodal lines crossed along x, n along y']
    lines += [f"{_quoted(label)} = {hz:g}" for label, hz in starter.frequencies.items()]
    lines += [f'# "{label}" = ' for label in examples if str(label) not in starter.frequencies]
    return "\n".join(lines) + "\n"


def _size(starter: Starter, name: str, form: str) -> str:
    if name in starter.sizes:
        return form.format(starter.sizes[name])
    return f"{form.format(HALF_TOP[name])}  {_EXAMPLE}"


def _quoted(text: str) -> str:
    """A text as TOML writes it, which for these characters is as JSON does."""
    return json.dumps(text, ensure_ascii=False)
