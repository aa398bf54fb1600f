"""A page for each folder of the package, written before the build: every module in it, with its documented names."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any, get_origin

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective

import bayesplate

PACKAGE = Path(bayesplate.__file__).parent
ROAD = (
    "board", "plate", "effects", "frequencies", "estimates", "posterior", "results", "grading", "diagnosis",
    "campaign", "planning", "recordings", "report", "commands",
)  # fmt: skip
"""In the order in which a card passes through them; what is not there yet gets no page."""

LONGEST = 300
"""Characters of a table that is still shown as the value of its name."""

SENTENCES = {
    "board": "What lies on the bench, in SI units, read from cards with every fault at once and written to them.",
    "plate": "How an ideal plate rings.",
    "effects": "What an ideal plate lacks.",
    "frequencies": "From constants, sizes and effects to frequencies.",
    "estimates": "Least squares, the paper's methods, and what can be identified.",
    "posterior": "Likelihood, sampling and the convergence gate.",
    "results": "Summaries, tables, the archive of draws, references.",
    "grading": "Many boards: rows, sorting, matching.",
    "diagnosis": "Which effect a residual speaks of.",
    "campaign": "What several boards share.",
    "planning": "What to measure next.",
    "recordings": "Recordings to frequencies.",
    "report": "Figures and the page of a report.",
    "commands": "One file a command, from the card to the files.",
}


def setup(app: Any) -> dict[str, Any]:
    """Write the pages when a build begins."""
    app.add_directive("public-names", PublicNames)
    app.connect("builder-inited", _write_pages)
    app.connect("autodoc-skip-member", _skip_aliases)
    app.connect("autodoc-process-docstring", _bars_are_bars)
    return {"parallel_read_safe": True}


def _skip_aliases(app: Any, kind: str, name: str, item: object, skip: bool, options: Any) -> bool | None:
    """Leave out aliases of types, which would be taken for classes of other libraries, and whole tables of objects."""
    return True if get_origin(item) is not None or (len(repr(item)) > LONGEST and isinstance(item, dict)) else None


def _bars_are_bars(app: Any, kind: str, name: str, item: object, options: Any, lines: list[str]) -> None:
    """Keep the bars of an absolute value from being read as markup."""
    lines[:] = [re.sub(r"(?<!`)\|([^|`]+)\|(?!`)", r"\\|\1\\|", line) for line in lines]


class PublicNames(SphinxDirective):
    """Every name of `bayesplate.__all__`, documented."""

    def run(self) -> list[nodes.Node]:
        """One entry a name."""
        lines = []
        for name in bayesplate.__all__:
            lines += [*_entry(name, getattr(bayesplate, name)), ""]
        fence = ["```{eval-rst}", *lines, "```"]
        place = nodes.Element()
        self.state.nested_parse(StringList(fence, "public names"), self.content_offset, place)
        return place.children


def _entry(name: str, item: object) -> list[str]:
    """The directive of a name; of a class with what belongs to it."""
    if not isinstance(item, type):
        return [f".. autofunction:: bayesplate.{name}", "   :no-index:"]
    if issubclass(item, Exception):
        return [f".. autoexception:: bayesplate.{name}"]
    return [f".. autoclass:: bayesplate.{name}", "   :members:", "   :inherited-members: BaseModel"]


def _write_pages(app: Any) -> None:
    folder = Path(app.srcdir) / "api" / "rooms"
    folder.mkdir(parents=True, exist_ok=True)
    rooms = [room for room in ROAD if (PACKAGE / room).is_dir()]
    pages = {**{room: _page(room) for room in rooms}, "base": _base()}
    for old in folder.glob("*.rst"):
        if old.stem not in pages:
            old.unlink()
    for name, text in pages.items():
        path = folder / f"{name}.rst"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def _page(room: str) -> str:
    modules = sorted(path for path in (PACKAGE / room).rglob("*.py") if _caption(path))
    title = room
    return "\n".join([title, "=" * len(title), "", SENTENCES[room], "", *(_module(path) for path in modules)])


def _base() -> str:
    title = "errors, labels"
    modules = [PACKAGE / f"{name}.py" for name in ("errors", "labels")]
    return "\n".join([title, "=" * len(title), "", *(_module(path) for path in modules)])


def _module(path: Path) -> str:
    name = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
    title = name.partition(".")[2]
    return f"{title}\n{'-' * len(title)}\n\n.. automodule:: {name}\n   :members:\n   :ignore-module-all:\n"


def _caption(path: Path) -> str:
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
