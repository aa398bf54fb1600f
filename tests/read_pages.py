"""Pages as a parser reads them: elements, attributes and text, and everything that a page of ours never has."""

from __future__ import annotations

import re
from html.parser import HTMLParser

from payloads import DIRECTION_MARKS, shown

ALLOWED = {
    "html", "head", "meta", "title", "style", "body", "header", "main", "section", "footer", "h1", "h2", "h3", "p",
    "bdi", "strong", "div", "table", "caption", "thead", "tbody", "tr", "th", "td", "figure", "figcaption", "img",
    "details", "summary", "ul", "li", "i", "sub", "sup", "pre", "a",
}  # fmt: skip
"""Every element that our templates hold; whatever a text could bring in besides is a fault."""
NEVER = {"style", "srcdoc"}
LINK = re.compile(r"boards/[A-Za-z0-9][A-Za-z0-9._-]*/report\.html")
"""The only place that a page of ours leads to: the page of a board beside it."""
OWN = "data:image/svg+xml;base64,"


class Read(HTMLParser):
    """Elements with their attributes, and the text of the page."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.text = ""
        self.source = page
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, {name: value or "" for name, value in attrs}))

    def handle_data(self, data):
        self.text += data.replace("\N{NO-BREAK SPACE}", " ")

    def handle_comment(self, data):
        raise AssertionError(f"a comment: {data}")

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]


def faults(page: Read) -> list[str]:
    """Everything that a page of ours never has."""
    found = [f"element {tag}" for tag, _ in page.elements if tag not in ALLOWED]
    for tag, attributes in page.elements:
        found += [f"{tag} {name}" for name in attributes if name.startswith("on") or name in NEVER]
        source = attributes.get("src", OWN)
        found += [] if source.startswith(OWN) else [f"{tag} asks for {source[:40]}"]
        link = attributes.get("href")
        found += [] if link is None or (tag == "a" and LINK.fullmatch(link)) else [f"{tag} leads to {link[:40]}"]
    found += ["two titles"] if len(page.all("title")) != 1 else []
    return found


def not_as_text(source: str, payload: str, least: int) -> list[str]:
    """What is wrong with a page that is to show a payload literally so many times, and no mark that turns writing."""
    page = Read(source)
    count = " ".join(page.text.split()).count(" ".join(shown(payload).split()))
    marks = [ascii(mark) for mark in DIRECTION_MARKS if mark in source]
    return [*faults(page), *marks, *([] if count >= least else [f"shown {count} times"])]
