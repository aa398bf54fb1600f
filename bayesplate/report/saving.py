"""Figures as files: complete or absent, and the same bytes whatever matplotlib style the user has set."""

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
FileEnding = Literal["png", "svg"]
_PNG_COMPRESSION = 3
"""Compression level of PNG, 0 to 9; higher levels take long and save little."""


_DRAWING_LOCK = RLock()


@contextmanager
def matplotlib_defaults() -> Iterator[None]:
    """Draw and write figures with matplotlib's default settings; a decorator or a context.

    matplotlib reads settings from the working folder and the user's home, and a notebook changes them. They belong to
    the whole process, so threads draw one after another.
    """
    from matplotlib import rc_context, rcdefaults, rcParams

    with _DRAWING_LOCK, rc_context():
        rcdefaults()
        rcParams["svg.hashsalt"] = "bayesplate"  # names inside an SVG follow from its content
        yield


@matplotlib_defaults()
def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure by the ending of its path, PNG or SVG, without a time stamp."""
    write_bytes(path, _figure_bytes(figure, path.suffix.removeprefix("."), {}))


def save_pictures(pictures: Iterable[Picture], folder: Path, ending: FileEnding) -> dict[str, bytes]:
    """Write pictures with title and alternative text; returns their content by name. Needs `matplotlib_defaults`."""
    contents = {}
    for picture in pictures:
        texts = {"Title": picture.title, "Description": picture.alt}
        contents[picture.name] = _figure_bytes(picture.figure, ending, texts)
        write_bytes(folder / f"{picture.name}.{ending}", contents[picture.name])
    return contents


def _figure_bytes(figure: Figure, ending: str, texts: Mapping[str, str]) -> bytes:
    """A figure as PNG or SVG without a time stamp."""
    metadata: dict[str, str | None] = {**texts, **({"Date": None} if ending == "svg" else {})}
    packing: Any = {"pil_kwargs": {"compress_level": _PNG_COMPRESSION}} if ending == "png" else {}
    stream = BytesIO()
    figure.savefig(stream, format=ending, dpi=DOTS_PER_INCH, metadata=metadata, **packing)
    return stream.getvalue()
