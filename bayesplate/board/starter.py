"""The text of a first board card from a few numbers; missing numbers stand there as examples to be replaced."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bayesplate.board.repeated import CALIPER
from bayesplate.board.words import EDGES
from bayesplate.board.writing import toml_value
from bayesplate.labels import Label

_EXAMPLE_COMMENT = "# an example: put yours here"
HALF_TOP = {"length_x": 550.0, "length_y": 200.0, "thickness": 2.8}
"""Sizes of a guitar half-top, mm, as examples; its density is that of the wood whatever the sizes."""

SPRUCE_DENSITY = 420.0
_AIR_LINES = (
    "# The air of the room moves with the board; take these three lines out for frequencies computed without it.",
    "[setup.fluid]",
    "density_kg_m3 = 1.2",
    'baffle = "none"  # "full" for a board that fills the opening of a wall',
)


def starter_text(
    name: str,
    sizes: Mapping[str, float],  # any of length_x, length_y, thickness, mm; mass, g
    edges: Mapping[str, str],
    prior: str,
    frequencies: Mapping[str, float],  # label to Hz
    examples: Sequence[Label],  # modes of such a board: lines to be filled in for those not measured
    **texts: str,
) -> str:
    """A board card in TOML; `texts` stand above its tables."""
    words = ", ".join(f"{edge} = {toml_value(edges[edge])}" for edge in EDGES)
    lines = [
        "format = 1",
        f"name = {toml_value(name)}",
        *(f"{key} = {toml_value(text)}" for key, text in texts.items() if text),
        "",
        "[plate]  # the whole board; x is along the grain",
        _size_line(sizes, "length_x", "length_x_mm = {}"),
        _size_line(sizes, "length_y", "length_y_mm = {}"),
        _size_line(sizes, "thickness", f"thickness_mm = {{{{ mean = {{}}, sd = {CALIPER:g} }}}}"),
        f"mass_g = {_shortest(sizes['mass'])}"
        if "mass" in sizes
        else f"density_kg_m3 = {SPRUCE_DENSITY:g}  # an example: put mass_g here in its place",
        "",
        "[material]",
        f"prior = {toml_value(prior)}",
        "",
        "[setup]",
        f"edges = {{ {words} }}",
    ]
    if "clamped" in edges.values():
        lines.append("# clamped_mm = { x0 = 30 }  # what the clamp covers, where the plate's length includes it")
    lines.append("# unlabelled_hz = [404, 448.8]  # peaks of which you cannot tell the mode")
    lines += ["", *_AIR_LINES]
    lines += ["", '[setup.frequencies_hz]  # "(m,n)": m nodal lines crossed along x, n along y']
    lines += [f"{toml_value(label)} = {_shortest(hz)}" for label, hz in frequencies.items()]
    lines += [f'# "{label}" = ' for label in examples if str(label) not in frequencies]
    return "\n".join(lines) + "\n"


def _size_line(sizes: Mapping[str, float], name: str, form: str) -> str:
    if name in sizes:
        return form.format(_shortest(sizes[name]))
    return f"{form.format(_shortest(HALF_TOP[name]))}  {_EXAMPLE_COMMENT}"


def _shortest(number: float) -> str:
    """All digits of a number, without a point where it is whole."""
    return toml_value(int(number) if float(number).is_integer() else float(number))
