"""The directive `computed`: Markdown that a function of `computations` returns while the documentation is built.

    ```{computed} visible_parts
    ```

Every number, table and figure of the prose comes in by it; a function gets the folder for its pictures.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.util.docutils import SphinxDirective

PICTURES = "_generated/pictures"
LISTING = ("long_checks",)
"""Functions that list files, among which new ones may be: their pages are read with every build."""


def setup(app: Any) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("computed", Computed)
    return {"parallel_read_safe": False}


class Computed(SphinxDirective):
    """What a function of `computations` returns, as Markdown in place; words after its name are its arguments."""

    required_arguments = 1
    optional_arguments = 9

    def run(self) -> list[nodes.Node]:
        """Call the function and parse what it returns."""
        import computations

        folder = Path(self.env.srcdir) / PICTURES
        folder.mkdir(parents=True, exist_ok=True)
        name, *arguments = self.arguments
        text = getattr(computations, name)(folder, *arguments)
        self.env.note_dependency(computations.__file__)
        if name in LISTING:
            self.env.note_reread()
        place = nodes.Element()
        self.state.nested_parse(StringList(text.splitlines(), f"computed {name}"), self.content_offset, place)
        return place.children
