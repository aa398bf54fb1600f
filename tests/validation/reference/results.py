"""What the reference holds, by part and name: how it is computed, written and read."""

from __future__ import annotations

import json
import math
import multiprocessing
import subprocess
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from validation.reference import boards, plates

import bayesplate

Json = dict[str, Any]

PARTS = ("plates", "boards", "campaigns", "plans")
_DIGITS = 7
"""Of a number: a hundredth of a cent, and of a frequency more than that."""
_WIDEST = 240
"""Of a line that holds all frequencies of a plate."""


def names(part: str, *, long: bool = False) -> list[str]:
    """Names of the results of a part; `long` adds the campaigns that take far more than ten minutes."""
    if part == "plates":
        return list(plates.read_plates())
    if part == "boards":
        return boards.names_of("boards")
    if part == "plans":
        return list(boards.PLANNED)
    return [name for name in boards.names_of("campaigns") if long or name not in boards.LONG]


def _plate(name: str) -> Json:
    return dict(plates.plate_frequencies(name, plates.read_plates()[name]))


_COMPUTE: dict[str, Callable[[str], Json]] = {
    "plates": _plate, "boards": boards.board, "campaigns": boards.campaign, "plans": boards.plan,
}  # fmt: skip


def compute(part: str, name: str) -> Json:
    """One result, rounded; a board, a campaign or a plan in a process of its own, so that no cache saves it time."""
    if part == "plates":
        found = _plate(name)
    else:
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
            found = pool.submit(_COMPUTE[part], name).result()
    return {key: _rounded_under(key, one) for key, one in found.items()}


def make(
    part: str, wanted: Sequence[str], folder: Path, *, resume: bool, told: Callable[[str], None] = print
) -> dict[str, Json]:
    """Compute results and write each as soon as it is there, beside those that the folder holds already.

    Parameters
    ----------
    part : str
    wanted : sequence of str
    folder : Path
    resume : bool
        Skip what the same tree, without changes, has left there.
    told : callable
        Takes a line on each result.

    Returns
    -------
    dict
        Those that were wanted, by name.
    """
    tree, path = present_tree(), folder / f"{part}.json"
    stored = read(path)
    for name in wanted:
        if resume and stored.get(name, {}).get("made_on") == tree and "changes" not in tree:
            continue
        stored[name] = {"made_on": tree, **compute(part, name)}
        write(path, stored)
        told(f"{part} {name}")
    return {name: stored[name] for name in wanted}


def present_tree() -> str:
    """Commit and day of the package that is imported, and whether it was changed since."""
    root = Path(bayesplate.__file__).resolve().parents[1]

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=root, check=True, capture_output=True, text=True).stdout.strip()

    changed = git("status", "--porcelain", "--", "bayesplate", "models")
    return git("log", "-1", "--format=%h %cs") + (" with changes" if changed else "")


def rounded(value: Any) -> Any:
    """A result with as many digits as mean something: errors and times to a hundredth, all else to seven digits."""
    if isinstance(value, Mapping):
        return {key: _rounded_under(key, one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(one) for one in value]
    return _to_digits(value, _DIGITS) if isinstance(value, float) else value


def _rounded_under(key: str, value: Any) -> Any:
    """A value by the key it stands under: what the sampler has drawn has few digits."""
    if not isinstance(value, float):
        return rounded(value)
    if key.endswith(("_cents", "_s")):
        return round(value, 2)
    few = {"sd": 3, "mean": 5, "draws": 2, "constants": 3, "explanations": 3, "entropy_nats": 3}
    if key == "probability_of_none" or key.endswith("_error"):
        return _to_digits(value, 2)
    return _to_digits(value, few.get(key, _DIGITS))


def _to_digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}") if math.isfinite(value) else value


def read(path: Path) -> dict[str, Json]:
    """Results of a part by name; none where there is no such file."""
    found: dict[str, Json] = json.loads(path.read_text()) if path.exists() else {}
    return found


def write(path: Path, results: Mapping[str, Json]) -> None:
    """Write the results of a part, sorted by name, what fits on a line in one line."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_suffix(".draft")
    draft.write_text("\n".join(_lines(dict(sorted(results.items())), "")) + "\n")
    draft.replace(path)


def _lines(value: Any, indent: str) -> Iterable[str]:
    short = json.dumps(value, ensure_ascii=False)
    flat = not isinstance(value, dict) or not any(isinstance(one, dict | list) for one in value.values())
    if not isinstance(value, dict | list) or not value or (flat and len(indent) + len(short) <= _WIDEST):
        return [short]
    ends = "{}" if isinstance(value, dict) else "[]"
    pairs = value.items() if isinstance(value, dict) else ((None, one) for one in value)
    inner: list[str] = []
    for key, one in pairs:
        head, *rest = _lines(one, indent + "  ")
        inner += ["  " + ("" if key is None else f"{json.dumps(key, ensure_ascii=False)}: ") + head]
        inner += ["  " + line for line in rest]
        inner[-1] += ","
    inner[-1] = inner[-1].removesuffix(",")
    return [ends[0], *inner, ends[1]]
