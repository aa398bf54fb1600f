"""Time and memory of many boards: `python tests/validation/benchmarks/batch.py --out results/batch.jsonl`.

Each run is a process of its own over simulated cards; what it and its workers take of processor time and memory is read
from the system while they run (Linux). Ratios of runs stand beside the limit; the load of the machine is stated, for a
wall time says nothing without it. A run that is in the file already is not made again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.benchmarks.ratios import Ratio
from validation.benchmarks.run import machine
from validation.measured import note

DESIGN = "cantilever-6"
WAYS = {"1": "one worker", "2": "two workers", "dask-2": "a Dask cluster of two processes"}
SPEED = {"2": 1.8, "dask-2": 1.5}
"""How much faster than one worker each way has to be; twice would be ideal."""
FEWEST_FOR_SPEED, FEWEST_FOR_MEMORY = 200, 40
"""Boards from which on time and memory count: with fewer, starting a worker is a part of the time, and what is kept of
boards under way and of their finite elements is not there yet.
"""
HEAD = """# Many boards

Written by `make batch`; do not edit. Simulated cards of one design with constants of their own, six readings each,
through `bayesplate batch`, with the libraries' threads switched off. Two workers can be about twice as fast at
best. The Dask cluster runs without Dask's statistical profiler, whose record in each worker grows with time, whatever
is computed. Different tables are a count: one means that all ways gave the same bytes.
"""
_TICKS = os.sysconf("SC_CLK_TCK")
_MEGABYTE = 1e6


@dataclass(frozen=True)
class Measured:
    """One run: boards, workers, seconds by the clock, processor seconds of all, peak megabytes, load before it, and the
    digest of its table.
    """

    boards: int
    workers: str
    seconds: float
    cpu_parent: float
    cpu_workers: float
    peak_parent: float
    peak_worker: float
    load: float
    table: str


def write_cards(folder: Path, n: int, seed: int = 3) -> Path:
    """Simulated boards of one shape with constants of their own, by the independent generator."""
    from generator.boards import plant
    from generator.designs import DESIGNS

    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True)
    for i in range(n):
        board = plant(rng, DESIGNS[DESIGN], [], 1.0, 5.0, name=f"board-{i:05d}")
        (folder / f"board-{i:05d}.toml").write_text(board.card_text())
    return folder


def measured(cards: Path, out: Path, workers: Sequence[str], told: str) -> Measured:
    """Run the command over a folder of cards, in a session of its own."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "bayesplate", "batch", str(cards), "--out", str(out), "--quiet", "--no-report"]
    load, started = os.getloadavg()[0], time.perf_counter()
    run = subprocess.Popen([*command, *workers], env=environment, start_new_session=True)
    cpu: dict[int, float] = {}
    peak: dict[int, float] = {}
    while not (ended := os.wait4(run.pid, os.WNOHANG))[0]:
        for pid, seconds, bytes_held in _descendants(os.getpid()):
            cpu[pid], peak[pid] = seconds, max(bytes_held, peak.get(pid, 0.0))
        time.sleep(0.1)
    run.returncode = os.waitstatus_to_exitcode(ended[1])
    if run.returncode:
        raise SystemExit(f"the run ended with {run.returncode}")
    taken = time.perf_counter() - started
    others = [pid for pid in cpu if pid != run.pid]
    return Measured(
        boards=len(list(cards.glob("*.toml"))),
        workers=told,
        seconds=taken,
        cpu_parent=ended[2].ru_utime + ended[2].ru_stime,
        cpu_workers=sum(cpu[pid] for pid in others),
        peak_parent=peak.get(run.pid, 0.0) / _MEGABYTE,
        peak_worker=max((peak[pid] for pid in others), default=0.0) / _MEGABYTE,
        load=load,
        table=hashlib.sha256((out / "boards.csv").read_bytes()).hexdigest()[:16],
    )


def _descendants(ancestor: int) -> Iterator[tuple[int, float, float]]:
    """Every process that comes from one: its id, processor seconds, and the most bytes of memory it held so far."""
    found: dict[int, list[str]] = {}
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                found[int(folder.name)] = (folder / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
    family = {ancestor}
    while more := {pid for pid, fields in found.items() if int(fields[1]) in family} - family:
        family |= more
    for pid in family - {ancestor}:
        fields = found[pid]
        yield pid, (int(fields[11]) + int(fields[12])) / _TICKS, _most_memory(pid)


def _most_memory(pid: int) -> float:
    """Peak of a process since its program began, bytes: what it held as a copy of its parent is not counted."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((1024.0 * float(line.split()[1]) for line in lines if line.startswith("VmHWM:")), 0.0)


def main() -> None:
    """Measure what is not measured yet, print it as it comes, and write the page if asked to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--boards", type=int, nargs="+", default=[10, 50, 200])
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--dask", action="store_true", help="a cluster of two processes as well")
    parser.add_argument("--many", type=int, help="so many boards as well, by the largest number of workers alone")
    parser.add_argument("--out", type=Path, required=True, help="JSON lines; gone on with if it exists")
    parser.add_argument("--publish", type=Path, help="folder of the page")
    arguments = parser.parse_args()
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    rows = [Measured(**json.loads(line)) for line in _lines(arguments.out)]
    wanted = [(n, way) for n in arguments.boards for way in _ways(arguments.workers, dask=arguments.dask)]
    if arguments.many:
        wanted += [(arguments.many, way) for way in _ways([max(arguments.workers)], dask=False)]
    for n, (told, options) in wanted:
        row = next((row for row in rows if (row.boards, row.workers) == (n, told)), None)
        if row is None:
            with tempfile.TemporaryDirectory() as name, options as given:
                row = measured(write_cards(Path(name) / "cards", n), Path(name) / "out", given, told)
            rows.append(row)
            with arguments.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(row)) + "\n")
        print(
            f"{row.boards:>6} boards, {row.workers:>7}: {row.seconds:8.1f} s, processor {row.cpu_parent:.1f} s "
            f"here and {row.cpu_workers:.1f} s in workers, peak {row.peak_parent:.0f} MB here and "
            f"{row.peak_worker:.0f} MB in a worker, load before {row.load:.1f}",
            flush=True,
        )
    for ratio in ratios(rows):
        print(ratio.row)
    if arguments.publish is not None:
        arguments.publish.mkdir(parents=True, exist_ok=True)
        (arguments.publish / "batch.md").write_text(page(rows), encoding="utf-8")
        note(arguments.publish, "batch")


GROWTH: tuple[tuple[str, int, float, Callable[[Measured], float]], ...] = (
    ("memory of the command", FEWEST_FOR_MEMORY, 1.1, lambda row: row.peak_parent),
    ("memory of a worker", FEWEST_FOR_MEMORY, 1.1, lambda row: row.peak_worker),
    ("time of a board", FEWEST_FOR_SPEED, 1.2, lambda row: row.seconds / row.boards),
)
"""What must hardly grow with the number of boards: from how many on it counts, the limit, and what it is of a run."""


def _lines(path: Path) -> list[str]:
    return path.read_text(encoding="utf-8").splitlines() if path.exists() else []


def ratios(rows: Sequence[Measured]) -> Iterator[Ratio]:
    """What is asked of the runs, as far as they were made: each ratio with its limit."""
    by_way = {(row.boards, row.workers): row for row in rows}
    counts = sorted({row.boards for row in rows})
    for n in counts:
        for told, limit in SPEED.items():
            if n >= FEWEST_FOR_SPEED and {(n, "1"), (n, told)} <= set(by_way):
                faster = by_way[n, "1"].seconds / by_way[n, told].seconds
                yield Ratio(f"speed beside one worker, {n:,} boards, {WAYS[told]}", faster, limit, at_least=True)
    for told, words in WAYS.items():
        for what, fewest, limit, of in GROWTH:
            own = [by_way[n, told] for n in counts if n >= fewest and (n, told) in by_way]
            if len(own) > 1:
                few, many = own[0], own[-1]
                named = f"{what}, {many.boards:,} boards beside {few.boards:,}, {words}"
                yield Ratio(named, of(many) / of(few), limit, at_least=False)
    for n in counts:
        own = [row.table for row in rows if row.boards == n]
        if len(own) > 1:
            yield Ratio(
                f"different tables of {n:,} boards, computed in {len(own)} ways", len(set(own)), 1.0, at_least=False
            )


def page(rows: Sequence[Measured]) -> str:
    """The page of the runs and their ratios."""
    lines = [
        HEAD,
        "| what | ratio or count | limit | |",
        "|---|---:|---:|---|",
        *(ratio.row for ratio in ratios(rows)),
        "",
    ]
    lines += ["| boards | computed by | s | s per board | processor, s | memory, MB | of a worker, MB | load before |"]
    lines += ["|---:|---|---:|---:|---:|---:|---:|---:|"]
    for row in sorted(rows, key=lambda row: (row.boards, row.workers)):
        lines.append(
            f"| {row.boards:,} | {WAYS[row.workers]} | {row.seconds:.1f} | {row.seconds / row.boards:.2f} | "
            f"{row.cpu_parent + row.cpu_workers:.0f} | {row.peak_parent:.0f} | {row.peak_worker:.0f} | {row.load:.1f} |"
        )
    about = ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in machine().items() if key != "load_average")
    return "\n".join([*lines, "", f"Measured with {about}.", ""])


def _ways(workers: Sequence[int], *, dask: bool):
    """Ways to compute: a name, and a context that gives the options of the command."""
    from contextlib import contextmanager, nullcontext

    for n in workers:
        yield str(n), nullcontext(["--workers", str(n)])
    if dask:

        @contextmanager
        def cluster():
            import dask
            from distributed import LocalCluster

            with (
                dask.config.set({"distributed.worker.profile.enabled": False}),
                LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as local,
            ):
                yield ["--dask", local.scheduler_address]

        yield "dask-2", cluster()


if __name__ == "__main__":
    main()
