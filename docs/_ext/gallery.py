"""The gallery of examples: taken from `examples` as they are, run as their docstrings say, shown with what they write.

The gallery wants a title with a line below it and literal blocks that are marked; the examples are written for readers
of the code. So it is built from copies with such docstrings: an example that is added needs nothing to be picked up.
"""

from __future__ import annotations

import ast
import re
import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst

HERE = Path(__file__).resolve().parents[1]
EXAMPLES = HERE.parent / "examples"
COPIES = HERE / "_generated" / "examples"
WRITTEN = HERE / "_generated" / "gallery"
HEADER = """\
.. _examples:

Examples
========

Scripts that return their numbers and write their figures where they are told to. The figures and the printed lines come
from running them while these pages were built; an example that takes longer than that is shown only.
"""
_USAGE = re.compile(r"^ +python examples/\S+\.py(.*)$", re.MULTILINE)


def setup(app: Any) -> dict[str, Any]:
    """Copy the examples before the gallery looks for them."""
    app.connect("config-inited", _copy, priority=1)
    return {"parallel_read_safe": True}


def _copy(app: Any, config: Any) -> None:
    COPIES.mkdir(parents=True, exist_ok=True)
    wanted = {path.name: for_gallery(path.read_text(encoding="utf-8")) for path in EXAMPLES.glob("*.py")}
    wanted["GALLERY_HEADER.rst"] = HEADER
    for old in COPIES.iterdir():
        if old.name not in wanted and old.suffix == ".py":
            old.unlink()
    for name, text in wanted.items():
        path = COPIES / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def for_gallery(source: str) -> str:
    """A script whose docstring has a line below its title, up to a colon, and marks before its indented blocks."""
    docstring = ast.get_docstring(ast.parse(source), clean=False) or ""
    title, _, rest = docstring.strip().partition("\n")
    title, _, further = title.rstrip(".").partition(": ")
    first = f"\n*{further[0].upper()}{further[1:]}.*\n" if further else ""
    marked = re.sub(r"\n\n(?= {4}\S)", "\n\n::\n\n", rest)
    return source.replace(docstring, f"\n{title}\n{'=' * len(title)}\n{first}{marked.rstrip()}\n", 1)


def arguments_of(gallery_conf: dict[str, Any], script_vars: dict[str, Any]) -> list[str]:
    """Arguments of the line `python examples/NAME.py ...` in an example, with places in a folder of its own."""
    script = Path(script_vars["src_file"])
    usage = _USAGE.search(ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or "")
    folder = WRITTEN / script.stem
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    arguments = usage[1].split() if usage else []
    return [argument if argument.startswith("-") else str(folder / argument) for argument in arguments]


def _get_sg_image_scraper() -> Any:
    return pictures_written


def pictures_written(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Pictures that an example has written as its own, not those of a report, each shown once."""
    script = Path(block_vars["src_file"])
    shown = block_vars.setdefault("pictures_shown", set())
    found = sorted((WRITTEN / script.stem).rglob("*.png"))
    paths = [path for path in found if not (path.parents[1] / "report.html").exists()]
    copies = []
    for path in paths:
        if path not in shown:
            copy = next(block_vars["image_path_iterator"])
            shutil.copy(path, copy)
            shown.add(path)
            copies.append(copy)
    return figure_rst(copies, gallery_conf["src_dir"], f"figure written by {script.name}")
