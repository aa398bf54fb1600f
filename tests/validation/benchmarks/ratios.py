"""The ratios of the benchmark page, all measured in one run, each with the limit beside it.

A time depends on the machine; what one way costs beside another hardly does. Sampling is compared with emcee as it
comes, on the same density in the same process; whole commands are counted in units of a process that runs it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import ritz
from validation import measured
from validation.benchmarks import timing

LINEAR_BOARD, EXACT_BOARD = "fiemme-spruce-clamped", "finnish-spruce-cantilever"
WITH_EFFECTS = ("spruce-free-2R", ("transverse_shear", "attached_mass"))
SEEDS = (1, 2, 3)
BATCH = 4096
FEW_BOARDS, MANY_BOARDS = 5, 100
FEW_MODES, MANY_MODES = 6, 12
FEW_CANDIDATES = ("attached_mass", "poisson_ratio", "grain_angle")
ACCURACY = 1e-4
EFFECTIVE, POINTS_A_SIDE = 4000, 100
"""Draws of a posterior that is sampled with one solve each, and the grid of MAGPIE's own examples."""

HEAD = """# Benchmarks

Written by `make benchmarks`; do not edit. Every ratio is of two things that were measured in one run on one thread. The
unit of cold times is a process of its own that poses a clamped board with five parameters and samples its linear law
with emcee as it comes (stretch moves, vectorised, {walkers} walkers, {steps} steps). Effective draws are those of the
parameter that has fewest, by emcee's autocorrelation time; the median of {seeds} seeds counts, and the time
includes the surrogate, the pilot and every judgement of convergence. Emcee walks here on the package's own posterior;
beside other samplers, on a page of its own, it is given a density in NumPy, and its ratio there is another one.

| what | ratio | limit | |
|---|---:|---:|---|
"""


@dataclass(frozen=True)
class Ratio:
    """One measured ratio and its limit, a least or a greatest."""

    what: str
    measured: float
    limit: float
    at_least: bool

    @property
    def row(self) -> str:
        """The row of the table."""
        met = self.measured >= self.limit if self.at_least else self.measured <= self.limit
        sign = "at least" if self.at_least else "at most"
        return f"| {self.what} | {self.measured:,.3g} | {sign} {self.limit:,g} | {'met' if met else 'missed'} |"


def ratios(repeats: int) -> Iterator[Ratio]:
    """Every ratio, the quick ones first."""
    exact = timing.posed(EXACT_BOARD, "exact")
    solve = timing.full_solve(exact)
    for law, limit in (("linear", 2000.0), ("exact", 100.0)):
        per_draw = timing.law(exact, law, BATCH) / BATCH
        yield Ratio(f"full solves in the time of one, {law} law per draw", solve / per_draw, limit, at_least=True)
    for name, plate in (("clamped", ritz.FIEMME), ("free", ritz.FREE_SPRUCE)):
        ours, theirs = timing.to_accuracy(plate, ACCURACY)
        what = f"twelve modes within {100 * ACCURACY:g} % from nothing, {name}"
        what += ", beside Ritz in Legendre polynomials, whose best case it is"
        yield Ratio(what, ours / theirs, 1.0, at_least=False)
    board, effects = WITH_EFFECTS
    sampled = {
        f"linear law, {LINEAR_BOARD}": (timing.posed(LINEAR_BOARD, "linear"), 10.0),
        f"exact law, {EXACT_BOARD}": (timing.posed(EXACT_BOARD, None), 5.0),
        f"exact law alone (`--exact`), {EXACT_BOARD}": (exact, 5.0),
        f"exact law, {board} with {' and '.join(effects)}": (timing.posed(board, None, effects), 5.0),
    }
    for what, (problem, limit) in sampled.items():
        ours = median(timing.our_sampling(problem, seed) for seed in SEEDS)
        plain = median(timing.plain_emcee(problem, seed) for seed in SEEDS)
        yield Ratio(f"effective draws per second beside plain emcee, {what}", ours / plain, limit, at_least=True)
    unit = timing.unit(repeats)
    solves = EFFECTIVE * timing.finite_differences(POINTS_A_SIDE, FEW_MODES)
    what = f"{EFFECTIVE:,} solves by finite differences on {POINTS_A_SIDE} x {POINTS_A_SIDE} points, one per effective "
    what += f"draw, in cold processes `fit {LINEAR_BOARD}`"
    yield Ratio(what, solves / timing.whole_fit(LINEAR_BOARD, repeats=repeats), 1.0, at_least=True)
    options = ("--no-report",)
    for name, limit, more, words in (
        (LINEAR_BOARD, 1.2, options, ""),
        (EXACT_BOARD, 1.6, options, ""),
        (
            board,
            4.0,
            (*options, "--effects", ",".join(effects)),
            "; the limit was set before its unlabelled peaks took part in the fit",
        ),
    ):
        cold = timing.whole_fit(name, *more, repeats=repeats)
        shown = " ".join(("fit", name, *more))
        yield Ratio(f"cold process in units, `{shown}`{words}", cold / unit, limit, at_least=False)
    cold = timing.whole_fit(EXACT_BOARD, *options, repeats=repeats, what="diagnose")
    yield Ratio(f"cold process in units, `diagnose {EXACT_BOARD} --no-report`", cold / unit, 8.0, at_least=False)
    n_few, few = timing.search(MANY_MODES, FEW_CANDIDATES)
    n_all, every = timing.search(MANY_MODES)
    what = f"search for effects, cost of one of {n_all} candidates, beside one of {n_few}"
    yield Ratio(what, (every / n_all) / (few / n_few), 1.5, at_least=False)
    what = f"search for effects, {n_all} candidates, {MANY_MODES} modes beside {FEW_MODES}"
    yield Ratio(what, every / timing.search(FEW_MODES)[1], MANY_MODES / FEW_MODES, at_least=False)

    (alone, few), (_, many) = timing.boards(FEW_BOARDS), timing.boards(MANY_BOARDS)
    what = f"campaign of {FEW_BOARDS} simulated boards, in fits of one"
    yield Ratio(what, few / (alone / FEW_BOARDS), 8.0, at_least=False)
    what = f"cost of a board in a campaign of {MANY_BOARDS}, beside one of {FEW_BOARDS}"
    yield Ratio(what, (many / MANY_BOARDS) / (few / FEW_BOARDS), 1.2, at_least=False)


def publish(rows: list[Ratio], about: dict[str, object], folder: Path) -> None:
    """Write the page."""
    head = HEAD.format(walkers=timing.PLAIN_WALKERS, steps=timing.PLAIN_STEPS, seeds=len(SEEDS))
    foot = ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in about.items())
    text = head + "\n".join(row.row for row in rows) + f"\n\nMeasured with {foot}.\n"
    (folder / "benchmarks.md").write_text(text, encoding="utf-8")
    measured.note(folder, "benchmarks")
