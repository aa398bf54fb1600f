"""Figures to files: complete or absent, and the same bytes whatever style the user has set for figures of his own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any, Literal

from bayesplate.files import write_bytes
from bayesplate.report.style import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 200
Ending = Literal["png", "svg"]
_PACKING = 3
"""Of PNG, 0 to 9: beyond this it takes long and saves little."""


_drawing = RLock()


@contextmanager
def drawing() -> Iterator[None]:
    """Figures made and written here look as matplotlib comes; to be put above a function, or a context.

    matplotlib reads its settings from the working folder and the home of the user, and a notebook changes them. They
    are those of a whole process, so that threads draw one after another.
    """
    from matplotlib import rc_context, rcdefaults, rcParams

    with _drawing, rc_context():
        rcdefaults()
        rcParams["svg.hashsalt"] = "bayesplate"  # names inside an SVG follow from its content
        yield


@drawing()
def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure by the ending of its path, PNG or SVG, without a time stamp."""
    write_bytes(path, _bytes_of(figure, path.suffix.removeprefix("."), {}))


def save_pictures(pictures: Iterable[Picture], folder: Path, ending: Ending) -> dict[str, bytes]:
    """Write pictures, made while `drawing`, with title and alternative text inside; returns their content by name."""
    written = {}
    for picture in pictures:
        told = {"Title": picture.title, "Description": picture.alt}
        written[picture.name] = _bytes_of(picture.figure, ending, told)
        write_bytes(folder / f"{picture.name}.{ending}", written[picture.name])
    return written


def _bytes_of(figure: Figure, ending: str, told: Mapping[str, str]) -> bytes:
    """A figure as PNG or SVG without a time stamp."""
    metadata: dict[str, str | None] = {**told, **({"Date": None} if ending == "svg" else {})}
    packing: Any = {"pil_kwargs": {"compress_level": _PACKING}} if ending == "png" else {}
    stream = BytesIO()
    figure.savefig(stream, format=ending, dpi=DOTS_PER_INCH, metadata=metadata, **packing)
    return stream.getvalue()
