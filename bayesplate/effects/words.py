"""Names of effects in sentences that people read; files keep the names themselves."""

from __future__ import annotations

from collections.abc import Sequence


def effect_name(name: str) -> str:
    return name.replace("_", " ").replace("poisson", "Poisson")


def effect_names(names: Sequence[str], last: str = "and") -> str:
    return join_words([effect_name(name) for name in names], last)


def as_sentence(text: str) -> str:
    """A text with a capital letter at its head, the others as they are."""
    return f"{text[:1].upper()}{text[1:]}"


def join_words(words: Sequence[str], last: str = "and") -> str:
    """A list in prose."""
    return f" {last} ".join([", ".join(words[:-1]), words[-1]]) if len(words) > 1 else "".join(words)
