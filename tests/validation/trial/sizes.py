"""Errors of recovered sizes, relative to how far the effect is from not being there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping


def errors(found: Iterable[Mapping[str, float]]) -> list[float]:
    """|median of the posterior - truth| over |truth - value without the effect|."""
    return [abs(one["q50"] - one["truth"]) / abs(one["truth"] - one["nothing"]) for one in found]
