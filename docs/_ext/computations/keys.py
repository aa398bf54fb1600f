"""The keys of the files in JSON, from the types that are written: nothing is listed twice."""

from __future__ import annotations

import inspect
import re
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from importlib import import_module
from pathlib import Path

from bayesplate.results.contract import NOT_IN_JSON, ByConstant, Spread
from computations.markdown import words_table

_PLAIN = {float: "number", int: "whole number", str: "text", bool: "true or false", type(None): "null"}


def keys_of(folder: Path, place: str, *elsewhere: str) -> str:
    """The keys of a file: what each holds and what it means, from the type that is written to it.

    Types that another part of the page shows are named after the first, each with the words that lead there.
    """
    told = {_type(one): f"[{title.replace('_', ' ')}](#{anchor})" for one, title, anchor in _triples(elsewhere)}
    return "\n".join(_tables(_type(place), "", told))


def _type(place: str) -> type:
    module, _, name = place.rpartition(".")
    return getattr(import_module(module), name)


def _triples(words: Sequence[str]) -> list[tuple[str, str, str]]:
    return list(zip(words[::3], words[1::3], words[2::3], strict=True))


def _tables(kind: type, place: str, told: dict[type, str]) -> list[str]:
    """Tables of a type and, below it, of what it is made of; each type once."""
    attributes, rows, parts = _attributes(kind), [], []
    for name, hint in _hints(kind).items():
        key = f"{place}{name}{_step(hint)}"
        held, new = [], []
        words = _words(hint, held)
        unit, meaning = attributes.get(name, ("", ""))
        for part in dict.fromkeys(held):
            if part in told:
                words = words.replace("table", f"table, as {told[part]}", 1)
            else:
                told[part] = f"`{key}`"
                new.append(part)
        if not meaning and len(held) == 1:
            meaning = _sentence(held[0])
        rows.append((f"`{name}`", words + f", {unit}" * bool(unit), meaning))
        parts += [(part, key, _sentence(part) if len(held) > 1 else "") for part in new]
    n_told = 3 if any(meaning for *_, meaning in rows) else 2
    lines = [words_table(("key", "holds", "meaning")[:n_told], [row[:n_told] for row in rows])]
    for part, key, which in parts:
        lines += [f"`{key}`{': ' * bool(which)}{which}\n", *_tables(part, f"{key}.", told)]
    return lines


def _hints(kind: type) -> dict[str, object]:
    """The types of the keys; those that a base leaves open as the type closes them."""
    bases = [one for one in getattr(kind, "__orig_bases__", ()) if typing.get_origin(one) is not typing.Generic]
    closed = [typing.get_args(one)[0] for one in bases if typing.get_args(one)]
    hints = typing.get_type_hints(kind)
    written = {one.name: hints[one.name] for one in fields(kind) if one.metadata != NOT_IN_JSON}
    return {name: closed[0] if isinstance(hint, typing.TypeVar) else hint for name, hint in written.items()}


def _step(hint: object) -> str:
    """How one goes on from a key to what is in it."""
    kinds = [typing.get_origin(one) for one in _alternatives(hint)]
    if any(kind in (tuple, list, Sequence) for kind in kinds):
        return "[]"
    is_named = any(kind is Mapping or (inspect.isclass(kind) and issubclass(kind, ByConstant)) for kind in kinds)
    return ".NAME" if is_named else ""


def _alternatives(hint: object) -> tuple[object, ...]:
    return typing.get_args(hint) if isinstance(hint, types.UnionType) else (hint,)


def _words(hint: object, held: list[type]) -> str:
    """What a key of a type holds, in words; types to be shown below are added to those held."""
    words = []
    for one in _alternatives(hint):
        origin, arguments = typing.get_origin(one) or one, typing.get_args(one)
        if one in _PLAIN:
            words.append(_PLAIN[one])
        elif origin is typing.Literal:
            words += [f"`{value}`" for value in arguments]
        elif origin is Mapping:
            words.append(f"by name: {_words(arguments[1], held)}")
        elif origin in (tuple, list, Sequence):
            words.append(f"list of {_words(arguments[0], held)}" if arguments else "empty list")
        elif inspect.isclass(origin) and issubclass(origin, ByConstant) and arguments:
            words.append(f"by constant: {_words(arguments[0], held)}")
        elif one is Spread:
            words.append("[spread](#spread)")
        else:
            held.append(one)
            words.append("table")
    return " or ".join(dict.fromkeys(words))


def _attributes(kind: type) -> dict[str, tuple[str, str]]:
    """Unit and meaning of attributes: of a type and those it extends, from docstrings or comments beside the fields."""
    found: dict[str, tuple[str, str]] = {}
    for one in reversed(kind.__mro__):
        if is_dataclass(one):
            found |= _commented(one)
            _, _, listed = inspect.cleandoc(one.__doc__ or "").partition("Attributes\n----------\n")
            for entry in re.findall(r"^(\w.*(?:\n[ \n].*)*)", listed, flags=re.MULTILINE):
                head, *meaning = entry.splitlines()
                names, _, typed = head.partition(" : ")
                unit = typed.rpartition(", ")[2] if ", " in typed and '"' not in typed and "(" not in typed else ""
                told = unit, " ".join(" ".join(meaning).split()).replace("None", "null")
                found.update(dict.fromkeys((name.strip() for name in names.split(",")), told))
    return found


def _commented(kind: type) -> dict[str, tuple[str, str]]:
    """Unit and meaning of fields from the comments above or behind them: `# Pa, of the next board`.

    One that begins with names of several fields is of all of them: `# q05, q95: ends of the interval`.
    """
    found: dict[str, tuple[str, str]] = {}
    above: list[str] = []
    for line in inspect.getsource(kind).splitlines():
        code, _, behind = line.partition("#")
        if behind and not code.strip():
            above.append(behind.strip())
            continue
        field = re.match(r"    (\w+): ", code)
        comment = behind.strip() or " ".join(above)
        above = []
        if field and comment:
            named = re.match(r"(\w+(?:, \w+)+): ", comment)
            names = named[1].split(", ") if named and field[1] in named[1].split(", ") else [field[1]]
            comment = comment.removeprefix(named[0]) if named and len(names) > 1 else comment
            unit = re.match(r"(Pa|SI|N m), ", comment)
            meaning = comment.removeprefix(unit[0]) if unit else comment
            first = meaning[0] if meaning.startswith(("ln ", "k-hat")) else meaning[0].upper()
            told = unit[1] if unit else "", f"{first}{meaning[1:].removesuffix('.')}.".replace("None", "null")
            found.update(dict.fromkeys(names, told))
    return found


def _sentence(kind: type) -> str:
    """The first line of a type's docstring."""
    text = inspect.cleandoc(kind.__doc__ or "").splitlines()[0]
    return "" if text.startswith(f"{kind.__name__}(") else text.replace("None", "null")
