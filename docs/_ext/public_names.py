"""The directive `public-names`: every name of `bayesplate.__all__`, documented."""

from __future__ import annotations

import re
from typing import Any, get_origin

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective

import bayesplate


def setup(app: Any) -> dict[str, Any]:
    """Add the directive."""
    app.add_directive("public-names", PublicNames)
    app.connect("autodoc-skip-member", _skip_aliases)
    app.connect("autodoc-process-docstring", _bars_are_bars)
    return {"parallel_read_safe": True}


def _skip_aliases(app: Any, kind: str, name: str, item: object, skip: bool, options: Any) -> bool | None:
    """Leave out aliases of types, which would be taken for classes of other libraries."""
    return True if get_origin(item) is not None else None


def _bars_are_bars(app: Any, kind: str, name: str, item: object, options: Any, lines: list[str]) -> None:
    """Keep the bars of an absolute value from being read as markup."""
    lines[:] = [re.sub(r"(?<!`)\|([^|`]+)\|(?!`)", r"\\|\1\\|", line) for line in lines]


class PublicNames(SphinxDirective):
    """Every name, of a class with what belongs to it."""

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
    """The directive of a name."""
    if not isinstance(item, type):
        return [f".. autofunction:: bayesplate.{name}"]
    if issubclass(item, Exception):
        return [f".. autoexception:: bayesplate.{name}"]
    return [f".. autoclass:: bayesplate.{name}", "   :members:", "   :inherited-members: BaseModel"]
