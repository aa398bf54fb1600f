"""The file of a card: its table, its name, and where it was found."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

from bayesplate.board.shelf import CardKind, find
from bayesplate.board.toml import read_file, read_table
from bayesplate.board.writing import toml_text
from bayesplate.errors import plain


@dataclass(frozen=True)
class CardFile:
    """The table of a card, as its file states it, or would state it where there is none."""

    table: Mapping[str, Any]
    name: str
    folder: Path | None = None  # where the cards stand that it names by a relative path
    read: str = ""  # the text of the file; empty where the table was made otherwise

    @classmethod
    def load(cls, kind: CardKind, name_or_path: str | os.PathLike[str], beside: Path | None = None) -> CardFile:
        """A card of the shelf by its name, or of a path; raises InputError if it is no table."""
        path = find(kind, name_or_path, beside)
        return cls.of(read_file(path), path.name, path.parent)

    @classmethod
    def of(cls, content: bytes | str, name: str, folder: Path | None = None) -> CardFile:
        """A card from the content of a file; raises InputError if it is no table."""
        data = content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
        return cls(read_table(data, plain(name)), name, folder, data.decode("utf-8"))

    @property
    def shown(self) -> str:
        """Its name as messages show it."""
        return plain(self.name)

    @property
    def stem(self) -> str:
        """The name that the card must have."""
        return os.path.splitext(self.name)[0]

    @property
    def path(self) -> Path:
        return (self.folder or Path()) / self.name

    @cached_property
    def text(self) -> str:
        """The text of the file as it was read, or the table as TOML; `sha256` is that of its bytes in UTF-8."""
        return self.read or toml_text(self.table)

    @cached_property
    def sha256(self) -> str:
        """Hexadecimal SHA-256 of the file's bytes."""
        return sha256(self.text.encode("utf-8")).hexdigest()
