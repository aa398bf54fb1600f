"""A fragment, a [setup] in a file of its own, merged into the table of a card."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bayesplate.board.schema import sections_of
from bayesplate.board.setup_keys import DEFAULT_SETUP_NAME, SetupKeys
from bayesplate.board.toml import parse_toml, read_file
from bayesplate.board.words import did_you_mean, quote_text, show_value
from bayesplate.errors import Fault, InputError, printable

_READING_KEYS = ("frequencies_hz", "signs", "label_confidence", "unlabelled_hz", "peaks")
"""Keys of one measurement: a fragment that has any of them replaces all of the card's."""


def merge_fragment(table: Mapping[str, Any], file: str, fragment: str | os.PathLike[str]) -> tuple[dict[str, Any], str]:
    """The table of a card with the [setup] of a fragment in it, and its name in messages; raises InputError.

    The fragment replaces keys of the setup of its name, or of the only setup; one with a new name and edges is added.
    """
    path = Path(fragment)
    name = printable(path.name)
    content = parse_toml(read_file(path), name)
    setup = content.get("setup")
    if not isinstance(setup, dict):
        got = "several [[setup]]" if isinstance(setup, list) else "none" if setup is None else show_value(setup)
        raise InputError(Fault(name, "one table [setup]", got, "bayesplate pick writes one"))
    keys = list(sections_of(SetupKeys)[()])
    faults = [Fault(f"{name} {key}", "nothing but [setup]", "another key") for key in content if key != "setup"]
    faults += [
        Fault(
            f"{name} [setup] {key}",
            f"one of {', '.join(keys)}",
            "an unknown key",
            did_you_mean(key, keys),
        )
        for key in setup
        if key not in keys
    ]
    if faults:
        raise InputError(faults)
    card_setups = table.get("setup", [])
    setups = [
        dict(entry)
        for entry in (card_setups if isinstance(card_setups, list) else [card_setups])
        if isinstance(entry, dict)
    ]
    index = _setup_index(setups, setup, name, file)
    if index is None:
        setups = [{"name": DEFAULT_SETUP_NAME, **entry} for entry in setups] + [dict(setup)]
    else:
        dropped_keys = _READING_KEYS if any(key in setup for key in _READING_KEYS) else ()
        kept_entries = {key: value for key, value in setups[index].items() if key not in dropped_keys}
        setups[index] = kept_entries | setup
    merged_table = {**table, "setup": setups[0] if len(setups) == 1 else setups}
    return merged_table, f"{file} with {name}"


def _setup_index(setups: list[dict[str, Any]], setup: Mapping[str, Any], fragment: str, file: str) -> int | None:
    """Index of the setup that a fragment changes; None if the fragment is a further setup."""
    names = [entry.get("name", DEFAULT_SETUP_NAME) for entry in setups]
    if setup.get("name") in names:
        return names.index(setup["name"])
    if "name" not in setup and len(setups) == 1:
        return 0
    if not setups or ("name" in setup and "edges" in setup):
        return None
    wanted = f"the name of a setup of {file}: {', '.join(quote_text(str(name)) for name in names)}"
    got = show_value(setup["name"]) if "name" in setup else "no name"
    raise InputError(Fault(f"{fragment} [setup] name", wanted, got, "a new setup needs a name and its edges"))
