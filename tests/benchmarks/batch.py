"""Time and memory of many boards: `python tests/benchmarks/batch.py --boards 10 200 --workers 1 2 [--dask]`.

Each run is a process of its own over simulated cards; what it and its workers take of processor time and memory is read
from the system while they run (Linux). Ratios of runs stand beside the limit; the load of the machine is stated, for a
wall time says nothing without it.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

DESIGN = "cantilever-6"
_TICKS = os.sysconf("SC_CLK_TCK")
_MEGABYTE = 1e6


@dataclass(frozen=True)
class Measured:
    """One run: boards, workers, seconds by the clock, processor seconds of all, peak megabytes, load before it."""

    boards: int
    workers: str
    seconds: float
    cpu_parent: float
    cpu_workers: float
    peak_parent: float
    peak_worker: float
    load: float


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
    command = [sys.executable, "-m", "bayesplate.cli", "batch", str(cards), "--out", str(out), "--quiet", "--no-report"]
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
        peak_parent=ended[2].ru_maxrss * 1024 / _MEGABYTE,
        peak_worker=max((peak[pid] for pid in others), default=0.0) / _MEGABYTE,
        load=load,
    )


def _descendants(ancestor: int) -> Iterator[tuple[int, float, float]]:
    """Every process that comes from one: its id, processor seconds, and bytes in memory."""
    page = os.sysconf("SC_PAGE_SIZE")
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
        yield pid, (int(fields[11]) + int(fields[12])) / _TICKS, float(fields[21]) * page


def main() -> None:
    """Measure, print as it comes, and write JSON if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--boards", type=int, nargs="+", default=[10, 40])
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--dask", action="store_true", help="a cluster of two processes as well")
    parser.add_argument("--out", type=Path, help="write JSON to this file too")
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for n in arguments.boards:
            cards = write_cards(folder / f"cards-{n}", n)
            for told, options in _ways(arguments.workers, dask=arguments.dask):
                with options as given:
                    row = measured(cards, folder / f"out-{n}-{told}", given, told)
                rows.append(row)
                print(
                    f"{row.boards:>6} boards, {row.workers:>7}: {row.seconds:8.1f} s, processor {row.cpu_parent:.1f} s "
                    f"here and {row.cpu_workers:.1f} s in workers, peak {row.peak_parent:.0f} MB here and "
                    f"{row.peak_worker:.0f} MB in a worker, load before {row.load:.1f}",
                    flush=True,
                )
            tables = {
                (folder / f"out-{n}-{row.workers}" / "boards.csv").read_bytes() for row in rows if row.boards == n
            }
            print(f"{n:>6} boards: {'the same table' if len(tables) == 1 else 'DIFFERENT TABLES'}")
    if arguments.out is not None:
        arguments.out.write_text(json.dumps([asdict(row) for row in rows], indent=2) + "\n", encoding="utf-8")


def _ways(workers: Sequence[int], *, dask: bool):
    """Ways to compute: a name, and a context that gives the options of the command."""
    from contextlib import contextmanager, nullcontext

    for n in workers:
        yield str(n), nullcontext(["--workers", str(n)])
    if dask:

        @contextmanager
        def cluster():
            from distributed import LocalCluster

            with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as local:
                yield ["--dask", local.scheduler_address]

        yield "dask-2", cluster()


if __name__ == "__main__":
    main()
