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
    """What a file states, before anything is assumed; or what it would state, for a card that has none."""

    table: Mapping[str, Any]
    name: str
    folder: Path | None = None  # where the cards stand that it names by a relative path
    read: str = ""  # the text of the file; empty where the table was made otherwise

    @classmethod
    def load(cls, kind: CardKind, name_or_path: str | os.PathLike[str], beside: Path | None = None) -> CardFile:
        """That of a shipped card, or of a path that may start from a folder; raises InputError if it is no table."""
        path = find(kind, name_or_path, beside)
        return cls.of(read_file(path), path.name, path.parent)

    @classmethod
    def of(cls, content: bytes | str, name: str, folder: Path | None = None) -> CardFile:
        """What stands, or might stand, in a file of a name; raises InputError if it is no table."""
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
        """The file."""
        return (self.folder or Path()) / self.name

    @cached_property
    def text(self) -> str:
        """The file as it was read: in UTF-8 it is the bytes that `sha256` is of, whatever the file holds by now."""
        return self.read or toml_text(self.table)

    @cached_property
    def sha256(self) -> str:
        """Hexadecimal SHA-256 of the file's bytes."""
        return sha256(self.text.encode("utf-8")).hexdigest()
