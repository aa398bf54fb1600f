"""A fragment of a card, its [setup], and the card that the two make together."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bayesplate.board.schema import sections_of
from bayesplate.board.setup_keys import DEFAULT_SETUP_NAME, SetupKeys
from bayesplate.board.toml import read_file, read_table
from bayesplate.board.words import did_you_mean, quoted, shown
from bayesplate.errors import Fault, InputError, plain

_READINGS = ("frequencies_hz", "signs", "label_confidence", "unlabelled_hz", "peaks")
"""What was measured together: a fragment that has any of them replaces all that the card says of them."""


def merged(table: Mapping[str, Any], file: str, fragment: str | os.PathLike[str]) -> tuple[dict[str, Any], str]:
    """The table of a card with the [setup] of a fragment in it, and what to call it in messages; raises InputError.

    It replaces the setup of its name, or the only one, key by key; one with a new name and edges joins them.
    """
    path = Path(fragment)
    named = plain(path.name)
    read = read_table(read_file(path), named)
    own = read.get("setup")
    if not isinstance(own, dict):
        got = "several [[setup]]" if isinstance(own, list) else "none" if own is None else shown(own)
        raise InputError(Fault(named, "one table [setup]", got, "bayesplate pick writes one"))
    known = list(sections_of(SetupKeys)[()])
    faults = [Fault(f"{named} {key}", "nothing but [setup]", "another key") for key in read if key != "setup"]
    faults += [
        Fault(f"{named} [setup] {key}", f"one of {', '.join(known)}", "an unknown key", did_you_mean(key, known))
        for key in own
        if key not in known
    ]
    if faults:
        raise InputError(faults)
    stated = table.get("setup", {})
    setups = [dict(one) for one in (stated if isinstance(stated, list) else [stated]) if isinstance(one, dict)]
    at = _which(setups, own, named, file)
    if at is None:
        setups = [{"name": DEFAULT_SETUP_NAME, **one} for one in setups] + [dict(own)]
    else:
        dropped = _READINGS if any(key in own for key in _READINGS) else ()
        kept = {key: value for key, value in setups[at].items() if key not in dropped}
        setups[at] = kept | own
    whole = {**table, "setup": setups[0] if len(setups) == 1 else setups}
    return whole, f"{file} with {named}"


def _which(setups: list[dict[str, Any]], own: Mapping[str, Any], named: str, file: str) -> int | None:
    """The setup that a fragment goes into; None if it is one more."""
    names = [one.get("name", DEFAULT_SETUP_NAME) for one in setups]
    if own.get("name") in names:
        return names.index(own["name"])
    if "name" not in own and len(setups) == 1:
        return 0
    if "name" in own and "edges" in own:
        return None
    wanted = f"the name of a setup of {file}: {', '.join(quoted(str(name)) for name in names)}"
    got = shown(own["name"]) if "name" in own else "no name"
    raise InputError(Fault(f"{named} [setup] name", wanted, got, "a new setup needs a name and its edges"))
