"""Places of hammer and sensor, one for all files or one for each."""

from __future__ import annotations

from collections.abc import Sequence

Place = tuple[float, float]


def given_places(
    hammer: Sequence[Place], sensor: Sequence[Place], files: Sequence[object]
) -> list[tuple[Place | None, Place | None]]:
    """Hammer and sensor of each file, m; None where nothing is known.

    Parameters
    ----------
    hammer, sensor : sequence of (float, float), m
        None, one, or as many as there are files.
    files : sequence
    """
    columns = []
    for given in (hammer, sensor):
        spread = [None] * len(files) if not given else [*given] * len(files) if len(given) == 1 else [*given]
        columns.append(spread)
    return list(zip(*columns, strict=True))
