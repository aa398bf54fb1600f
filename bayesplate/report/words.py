"""What an effect is, as a page says it."""

from __future__ import annotations

from bayesplate.effects import EFFECTS


def effect_sentence(name: str) -> str:
    """What an effect is, in one plain sentence; empty for a name that the library does not know."""
    return EFFECTS[name].sentence if name in EFFECTS else ""
