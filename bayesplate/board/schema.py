"""Tables are validated by a model, and everything that does not fit becomes a fault with its place."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Annotated, Any, Literal, TypeVar, get_args, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo

from bayesplate.board.shelf import CardFile
from bayesplate.board.values import Complaint, Key, Refusal, Text, read_format, read_name
from bayesplate.board.words import did_you_mean, name_complaint, quote_text, show_value
from bayesplate.errors import Fault, InputError

MOST_FAULTS = 50
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]{1,60}")
KeyPath = tuple[str, ...]


class Section(BaseModel):
    """A part of a card: frozen, and unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class BaseCard(Section):
    """The keys that the cards of all kinds have."""

    format: Annotated[Literal[1], Key(read_format)] = Field(description="1")
    name: Annotated[str, Key(read_name)] = Field(description="the name of the file without .toml")
    title: Text = ""


CardModel = TypeVar("CardModel", bound=BaseCard)


def validate_card(
    model: type[CardModel],
    card: CardFile,
    faults_of: Callable[[Mapping[str, Any], str], Iterable[Fault]] = lambda table, file: (),
    context: Mapping[str, Any] | None = None,
    file: str = "",
) -> CardModel:
    """A card from the table of its file; raises InputError with every fault at once.

    `faults_of` returns the faults between keys, from the raw table and the file's name in messages.
    """
    table, file = card.table, file or card.display_name
    faults = [*_name_faults(table, file, card.stem), *faults_of(table, file)]
    try:
        valid_card = model.model_validate(table, context={"card": card, **(context or {})})
    except ValidationError as error:
        details = error.errors(include_url=False)
        faults += [fault for detail in details[:MOST_FAULTS] for fault in _error_faults(model, table, file, detail)]
        n_unlisted = len(details) - MOST_FAULTS
    else:
        if not faults:
            return valid_card
        n_unlisted = 0
    n_unlisted = max(n_unlisted, 0) + len(faults[MOST_FAULTS:])
    listed_faults = faults[:MOST_FAULTS]
    if n_unlisted:
        listed_faults.append(Fault(file, "a card without faults", f"{n_unlisted} more faults, not listed"))
    raise InputError(listed_faults)


def fault_place(file: str, table: Mapping[str, Any], path: Sequence[str | int]) -> str:
    """Place of a value: 'my-board.toml [plate] thickness_mm', 'my-board.toml [[setup]] 2 "free" edges.x0'."""
    if not path:
        return file
    head, *rest = path
    value = table.get(str(head))
    number = rest[0] if rest else None
    if isinstance(value, list) and isinstance(number, int) and any(isinstance(entry, dict) for entry in value):
        rest = rest[1:]
        entry = value[number] if number < len(value) else None
        name = entry.get("name") if isinstance(entry, dict) else None
        text = f"{file} [[{head}]] {number + 1}" + (f" {quote_text(name)}" if isinstance(name, str) else "")
    elif isinstance(value, dict):
        rest = rest[1:] if rest and isinstance(rest[0], int) else rest
        text = f"{file} [{_shown_key(str(head))}]"
    else:
        text = f"{file} {_shown_key(str(head))}"
    separator = " "
    for part in rest:
        text += f" {part + 1}" if isinstance(part, int) else separator + _shown_key(part)
        separator = " " if isinstance(part, int) else "."
    return text


def _shown_key(key: str) -> str:
    return key if _BARE_KEY.fullmatch(key) else quote_text(key)


def _error_faults(model: type[Section], table: Mapping[str, Any], file: str, detail: Any) -> Iterator[Fault]:
    """The faults behind one error of pydantic."""
    inside: tuple[str | int, ...] = detail["loc"]
    for complaint in _error_complaints(model, inside, detail):
        yield Fault(
            fault_place(file, table, (*inside, *complaint.path)), complaint.wanted, complaint.got, complaint.remedy
        )


def _error_complaints(model: type[Section], path: tuple[str | int, ...], detail: Any) -> Sequence[Complaint]:
    error = detail.get("ctx", {}).get("error")
    if isinstance(error, Refusal):
        return error.complaints
    sections = sections_of(model)
    keys = tuple(part for part in path if isinstance(part, str))
    if detail["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        return (_unknown_key(keys, sections),)
    if detail["type"] == "missing":
        return (Complaint(sections[keys[:-1]][keys[-1]], "nothing"),)
    if detail["type"] == "too_long":
        return (Complaint(f"at most {detail['ctx']['max_length']} tables", str(len(detail["input"]))),)
    wants_tables = detail["type"] in ("tuple_type", "list_type")
    wanted = f"tables below [[{'.'.join(keys)}]], in double brackets" if wants_tables else "a table"
    return (Complaint(wanted, show_value(detail["input"])),)


def _unknown_key(keys: KeyPath, sections: Mapping[KeyPath, Mapping[str, str]]) -> Complaint:
    *outer, key = keys
    known_keys = sections[tuple(outer)]
    remedy = did_you_mean(key, known_keys)
    home_section = next((path for path, section_keys in sections.items() if key in section_keys), None)
    if not remedy and home_section is not None:
        remedy = f"it belongs in [{'.'.join(home_section)}]" if home_section else "it belongs above the first table"
    return Complaint(f"one of {', '.join(known_keys)}", "an unknown key", remedy)


@cache
def sections_of(model: Any) -> dict[KeyPath, dict[str, str]]:
    """The sections of a card model: key path to known keys, each with a description of what is wanted."""
    sections: dict[KeyPath, dict[str, str]] = {(): {}}
    for name, field in _model_fields(model).items():
        key = field.alias or name
        sections[()][key] = field.description or "a value"
        for inner in _inner_models(field.annotation):
            for path, keys in sections_of(inner).items():
                sections[(key, *path)] = keys
    return sections


def _model_fields(model: Any) -> dict[str, FieldInfo]:
    """The fields of a pydantic model, or of a dataclass that pydantic reads."""
    if issubclass(model, BaseModel):
        return model.model_fields
    hints = get_type_hints(model, include_extras=True)
    return {name: FieldInfo.from_annotation(hints[name]) for name in model.__dataclass_fields__}


def _inner_models(annotation: Any) -> Iterator[type]:
    if hasattr(annotation, "__pydantic_config__") or hasattr(annotation, "model_fields"):
        yield annotation
    for part in get_args(annotation):
        yield from _inner_models(part)


def _name_faults(table: Mapping[str, Any], file: str, stem: str) -> list[Fault]:
    """The name of a card must be the name of its file."""
    name = table.get("name")
    if not isinstance(name, str) or name == stem:
        return []
    complaint = name_complaint(stem)
    if complaint:
        remedy = "rename the file" + ("" if name_complaint(name) else f" to {name}.toml")
        return [Fault(file, complaint, quote_text(stem), remedy)]
    return [Fault(f"{file} name", f"{quote_text(stem)}, the name of the file", quote_text(name))]
