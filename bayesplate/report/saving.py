"""Figures to files: complete or absent, and the same bytes for the same figure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from bayesplate.report.style import Picture
from bayesplate.results.folder import write_bytes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 200
Ending = Literal["png", "svg"]
_PACKING = 3
"""Of PNG, 0 to 9: beyond this it takes long and saves little."""


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure by the ending of its path, PNG or SVG, without a time stamp.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    path : Path
    """
    with _salted():
        write_bytes(path, _bytes_of(figure, path.suffix.removeprefix("."), {}))


def save_pictures(pictures: Iterable[Picture], folder: Path, ending: Ending) -> dict[str, bytes]:
    """Write pictures as PNG or SVG files, title and alternative text inside.

    Parameters
    ----------
    pictures : iterable of Picture
    folder : Path
        Must be there.
    ending : "png" or "svg"

    Returns
    -------
    dict of bytes
        The content of each file, by the picture's name.
    """
    written = {}
    with _salted():
        for picture in pictures:
            told = {"Title": picture.title, "Description": picture.alt}
            written[picture.name] = _bytes_of(picture.figure, ending, told)
            write_bytes(folder / f"{picture.name}.{ending}", written[picture.name])
    return written


@contextmanager
def _salted() -> Iterator[None]:
    """Names inside an SVG follow from its content; entered once for many figures, because entering takes its time."""
    from matplotlib import rc_context

    with rc_context({"svg.hashsalt": "bayesplate"}):
        yield


def _bytes_of(figure: Figure, ending: str, told: Mapping[str, str]) -> bytes:
    """A figure as PNG or SVG without a time stamp."""
    metadata: dict[str, str | None] = {**told, **({"Date": None} if ending == "svg" else {})}
    packing: Any = {"pil_kwargs": {"compress_level": _PACKING}} if ending == "png" else {}
    stream = BytesIO()
    figure.savefig(stream, format=ending, dpi=DOTS_PER_INCH, metadata=metadata, **packing)
    return stream.getvalue()
