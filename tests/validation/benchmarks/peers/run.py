"""Measure other samplers beside the package, on one posterior: `python tests/validation/benchmarks/peers/run.py`.

Makes an environment for each peer, runs each in processes of its own, and keeps what it measured in a file, so that an
interrupted run goes on where it was. With `--publish` the page is written, if every peer has been measured or told why
not. Exit code 0 whatever the numbers are.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
from dataclasses import asdict
from pathlib import Path

for _library in ("OMP", "OPENBLAS", "MKL"):  # before numpy is imported, and handed on to every peer
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")
_TESTS = str(Path(__file__).resolve().parents[3])
sys.path[0] = _TESTS  # in place of this folder

from validation import measured  # noqa: E402
from validation.benchmarks.peers import environments, measures, statement, trials  # noqa: E402
from validation.benchmarks.peers.density import Density  # noqa: E402
from validation.benchmarks.peers.package import COMMANDS  # noqa: E402
from validation.benchmarks.peers.page import page  # noqa: E402
from validation.benchmarks.peers.registry import PEERS  # noqa: E402
from validation.benchmarks.run import machine  # noqa: E402

PAGE = "peers.md"


def main(arguments: list[str] | None = None) -> None:
    """Measure what is not there yet, print it, and write the page if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--environments", type=Path, default=Path("build/peers"), help="where they are made")
    parser.add_argument("--out", type=Path, help="results, one a line (default: results.jsonl beside the environments)")
    parser.add_argument("--publish", type=Path, help="write peers.md to this folder")
    parser.add_argument("--goal", type=int, default=int(trials.USUAL), help="effective draws of the worst parameter")
    parser.add_argument("--repeats", type=int, default=3, help="seeds; medians count")
    parser.add_argument("--only", nargs="+", default=[], help="words: peers whose name has one of them")
    asked = parser.parse_args(arguments)
    about = machine()  # the load before our own
    folder = asked.environments.resolve()
    path = asked.out or folder / "results.jsonl"
    seeds = list(range(1, asked.repeats + 1))

    file = folder / "problem.json"
    problem = statement.write(file)
    text = file.read_text(encoding="utf-8")
    density = Density.read(file)
    settings = f"{text}{asked.goal}{seeds}"
    there = {result.name: result for result in read(path)}

    def wanted(name: str, fingerprint: str) -> bool:
        is_asked = not asked.only or any(word.lower() in name.lower() for word in asked.only)
        return is_asked and (name not in there or there[name].fingerprint != fingerprint)

    def keep(result: trials.Result) -> None:
        there[result.name] = result
        with path.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(asdict(result)) + "\n")
        print(line(result), flush=True)

    truth = measures.quadrature(density)
    own = fingerprint_of(settings, str(about.get("bayesplate")))
    if any(wanted(name, own) for name in COMMANDS):
        for result in trials.our_own(problem, sys.executable, truth, seeds, own, ""):
            keep(result)
    for peer in PEERS:
        mark = fingerprint_of(settings, repr(peer))
        if not wanted(peer.name, mark):
            continue
        try:
            python = environments.python_of(peer, folder)
            keep(trials.measured(peer, python, file, truth, asked.goal, seeds, mark))
        except environments.Unavailable as error:
            keep(trials.Result(peer.name, mark, missing=str(error)))
    if asked.publish is not None:
        current = whole(there, settings, own)
        if current is None:
            print("not everything has been measured: no page is written")
            return
        content = page(current, PEERS, about, statement.BOARD, asked.goal, len(seeds))
        (asked.publish / PAGE).write_text(content, encoding="utf-8")
        measured.note(asked.publish, "peers")


def fingerprint_of(settings: str, what: str) -> str:
    """A short name of a problem, its settings and one sampler."""
    return hashlib.sha256(f"{settings}{what}".encode()).hexdigest()[:16]


def whole(there: dict[str, trials.Result], settings: str, own: str) -> list[trials.Result] | None:
    """The results of one problem with one set of settings in the order of the page; None if one is not there."""
    marks = dict.fromkeys(COMMANDS, own) | {peer.name: fingerprint_of(settings, repr(peer)) for peer in PEERS}
    found = [there.get(name) for name in marks]
    kept = [one for one, mark in zip(found, marks.values(), strict=True) if one and one.fingerprint == mark]
    return kept if len(kept) == len(marks) else None


def read(path: Path) -> list[trials.Result]:
    """Results of earlier runs, the last of a name last; a line that was cut off is left out."""
    found = []
    for one in path.read_text(encoding="utf-8").splitlines() if path.exists() else []:
        try:
            fields = json.loads(one)
        except json.JSONDecodeError:
            continue
        found.append(trials.Result(**{k: tuple(v) if isinstance(v, list) else v for k, v in fields.items()}))
    return found


def line(result: trials.Result) -> str:
    """What is printed of a result."""
    if result.missing:
        return f"{result.name}: skipped; {result.missing}"
    off = result.difference
    return (
        f"{result.name}: cold {result.cold_time:.2f} s, {result.rate:,.0f} effective draws/s, "
        f"at least {min(result.ess):,.0f} of them, off by {off['mean']:.1f} and {off['sd']:.1f} errors"
    )


if __name__ == "__main__":
    main()
