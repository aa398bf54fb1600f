"""What a component of a field looks like to who holds the board: where there is more of it, and by how much."""

from __future__ import annotations

from bayesplate.board.random_field import Surface

_TOLD = 0.2
"""Share of a surface's mean square from which on one of its polynomials is told."""

_WHERE = {
    (1, 0): ("towards x0", "towards x1"),
    (0, 1): ("towards y0", "towards y1"),
    (2, 0): ("at mid-length", "at both ends"),
    (0, 2): ("along the middle", "along both sides"),
    (1, 1): ("at the corners x0 y1 and x1 y0", "at the corners x0 y0 and x1 y1"),
}
"""Where a polynomial has its highest places, with a negative coefficient and with a positive one."""
_MOST_TOLD = 2


def look(surface: Surface, mean: float, more: str) -> str:
    """Where a surface, a fraction of a mean in m, is high, and its size, in words; `more`: "thicker" or "wider"."""
    terms = sorted(zip(surface.coefficients, surface.degrees, strict=True), key=lambda one: -abs(one[0]))
    told = [(value, degrees) for value, degrees in terms[:_MOST_TOLD] if value**2 >= _TOLD * surface.size**2]
    places = [_WHERE[degrees][value > 0] if degrees in _WHERE else "in waves" for value, degrees in told]
    where = " and ".join(dict.fromkeys(places)) or "in waves"
    return f"at +1 {more} {where}, {1e3 * mean * surface.size:.2g} mm rms"
