"""Print the lock file: name and version of everything that the package and its tests need, as installed here.

    python .ci/lock.py > requirements.lock

What pyproject.toml asks for, its extras and groups included, and what those ask for in turn.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PROJECT = Path(__file__).parents[1] / "pyproject.toml"


def wanted(project: Path = PROJECT) -> list[Requirement]:
    """What pyproject.toml asks for: to run, to build and to test."""
    told = tomllib.loads(project.read_text(encoding="utf-8"))
    extras = told["project"]["optional-dependencies"]
    groups = told["dependency-groups"].values()
    texts = [
        *told["project"]["dependencies"],
        *(one for extra in extras.values() for one in extra),
        *(one for group in groups for one in group if isinstance(one, str)),
    ]
    return [Requirement(text) for text in texts]


def locked(asked: Iterable[Requirement]) -> dict[str, str]:
    """Name and version of what is asked for, and of all that it needs."""
    found: dict[str, str] = {}
    seen: set[tuple[str, frozenset[str]]] = set()
    waiting = list(asked)
    while waiting:
        one = waiting.pop()
        key = canonicalize_name(one.name), frozenset(one.extras)
        if key in seen:
            continue
        seen.add(key)
        try:
            there = distribution(one.name)
        except PackageNotFoundError:
            raise SystemExit(f"{one.name} is not installed: make test installs it") from None
        found[key[0]] = there.version
        for text in there.requires or ():
            needed = Requirement(text)
            for extra in (*one.extras, ""):
                if needed.marker is None or needed.marker.evaluate({"extra": extra}):
                    waiting.append(needed)
                    break
    return found


if __name__ == "__main__":
    sys.stdout.writelines(f"{name}=={version}\n" for name, version in sorted(locked(wanted()).items()))
