"""Boards with bare peaks: are the probabilities of their assignments, and the intervals of the constants, right?

A free board has sixteen modes below the cut. Three in ten leave no peak, one peak is of something else, and only the
two lowest peaks have a label. Constants and noise are drawn from the priors that the fit is told, and the generator,
another discretisation, makes the frequencies. Of all pairs of a peak and a mode that are given a probability p, a share
p should be true; intervals of 90 % should hold the truth in 90 of 100 boards. The control takes the most probable
assignment of every peak for sure and is fitted again.

Peaks keep the order of their modes, as the likelihood has it: where the noise exchanges the readings of two modes, each
reading belongs to the mode that has its place in the order. How many were exchanged is told.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from generator.card import card_text
from generator.designs import DESIGNS
from generator.naming import LEAST_CORRELATION, Label, named
from generator.plate import solve
from validation.calibration.planted import NOISE, Settings, drawn, fitted, prior_text

from bayesplate.board.board import Board
from bayesplate.board.material import MODULI
from bayesplate.commands.prepare import PreparedBoard, prepare
from bayesplate.errors import BayesplateError
from bayesplate.estimates.labelling import label_likely_peaks
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.posing import pose
from bayesplate.results.modes import assigned_peaks

N_MODES, MISSED, N_LABELLED = 16, 0.3, 2
SPURIOUS = 1.0 / (1.0 + (1.0 - MISSED) * N_MODES)
EDGES = (0.0, 0.05, 0.2, 0.5, 0.8, 0.95, 1.001)
"""Of bins of probability."""
ALLOWED, COVERED = 4.0, (0.85, 0.95)
"""Standard errors by which a bin of probability may be off; shares of truths that 90 % intervals may hold."""
_SPARE_MODES = 12
_MOST_REDRAWS = 100
Record = dict[str, Any]


def simulate_one(settings: Settings, index: int) -> Record:
    """One board: pairs with their probability and whether they are true, and intervals that hold the truth or not."""
    started = time.perf_counter()
    rng = np.random.default_rng(np.random.SeedSequence([settings.base_seed, 9, index]))
    record: Record = {"simulation": index}
    with tempfile.TemporaryDirectory() as folder:
        try:
            asked, truth, peaks, n_exchanged = _drawn(Path(folder), rng)
            record |= {"exchanged": n_exchanged}
            problem = pose(asked.board, asked.prior)
            draws, attempts = fitted(problem, settings, rng)
            record |= {"pairs": _pairs(draws, peaks), "attempts": attempts}
            record |= {"holds": _holds(draws, truth), "law": draws.problem.posterior.law}
            sure = pose(_as_sure(draws), asked.prior)
            record |= {"control": _holds(fitted(sure, settings, rng)[0], truth)}
        except BayesplateError as error:
            record |= {"error": f"{type(error).__name__}: {error}"}
    return record | {"seconds": round(time.perf_counter() - started, 2)}


def _drawn(
    folder: Path, rng: np.random.Generator
) -> tuple[PreparedBoard, dict[str, float], dict[float, Label | None], int]:
    """A card with peaks, the constants behind it, which mode each peak is, and how many the noise has exchanged.

    The spurious peak is None.
    """
    design = DESIGNS["free-12"]
    (setup,) = design.setups
    (folder / "spread.toml").write_text(prior_text())
    stated = {"noise_percent": NOISE}
    plain = card_text(
        "planted", design, {"free": {(1, 1): 50.0, (2, 0): 70.0}}, noise_cents=0.0, prior="./spread.toml", stated=stated
    )
    for _ in range(_MOST_REDRAWS):
        (folder / "planted.toml").write_text(plain)
        asked = prepare(folder / "planted.toml")
        truth = {name: float(density.sample(rng, 1)[0]) for name, density in asked.prior.constants.items()}
        plate = design.plate(setup, {**truth, "nu_xy": 0.4})
        found = named(solve(plate, (), N_MODES + _SPARE_MODES), plate.edges)
        elastic = {beams: one for beams, one in found.items() if one[0] > 1.0}
        lowest = sorted(elastic, key=lambda beams: elastic[beams][0])[:N_MODES]
        if min(elastic[beams][1] for beams in lowest) < LEAST_CORRELATION:
            continue
        noise = drawn(asked.board.setups[0].noise, rng)
        seen = [beams for beams in lowest if rng.random() > MISSED]
        hertz = [float(elastic[b][0] * np.exp(noise * rng.standard_normal())) for b in seen]
        read = dict(zip(sorted(hertz), seen, strict=True))
        n_exchanged = sum(read[one] != b for one, b in zip(hertz, seen, strict=True))
        peaks: dict[float, Label | None] = dict(read)
        peaks[float(rng.uniform(elastic[lowest[0]][0], elastic[lowest[-1]][0]))] = None
        if len(seen) > N_LABELLED:
            break
    labelled = {beams: hertz for hertz, beams in sorted(read.items())[:N_LABELLED]}
    bare = [hertz for hertz in sorted(peaks) if hertz not in labelled.values()]
    text = card_text("planted", design, {"free": labelled}, noise_cents=0.0, prior="./spread.toml", stated=stated)
    told = f"missed_probability = {MISSED}\nspurious_probability = {SPURIOUS:.4f}\nunlabelled_hz = {bare}\n"
    (folder / "planted.toml").write_text(text.replace("\n[setup.frequencies_hz]", f"{told}\n[setup.frequencies_hz]"))
    return prepare(folder / "planted.toml"), truth, {hertz: peaks[hertz] for hertz in bare}, n_exchanged


def _pairs(draws: Draws, truth: Mapping[float, Label | None]) -> list[list[float]]:
    """Probability of each pair, that with no mode included, and 1 if it is true."""
    found = []
    for peak in assigned_peaks(draws)[0]:
        true = next(beams for hertz, beams in truth.items() if abs(hertz / peak.hz - 1.0) < 1e-9)
        name = "none" if true is None else f"({true[0]},{true[1]})"
        shares = {one.label: one.probability for one in peak.assignments} | {"none": peak.spurious_probability}
        found += [[round(share, 4), float(label == name)] for label, share in shares.items() if share >= 0.005]
    return found


def _holds(draws: Draws, truth: Mapping[str, float]) -> dict[str, bool]:
    """Whether the middle 90 % of each modulus hold the truth."""
    ends = {name: np.quantile(draws.moduli[name], [0.05, 0.95]) for name in MODULI}
    return {name: bool(low <= truth[name] <= high) for name, (low, high) in ends.items()}


def _as_sure(draws: Draws) -> Board:
    """The board where every peak has its most probable label for sure; those that are likeliest none are dropped."""
    problem = draws.problem
    (setup,), (peaks,) = problem.board.setups, problem.posterior.peaks
    assert peaks is not None
    every = draws.mode_log_frequencies[0]
    shares = peaks.probabilities(every.reshape(-1, every.shape[-1])[::20], draws.noise[..., 0].ravel()[::20])
    labelled = label_likely_peaks(setup, peaks, shares, 0.5)
    readings = tuple(replace(reading, confidence=1.0) for reading in labelled.readings)
    return replace(problem.board, setups=(replace(labelled, readings=readings, peaks=()),))


def reliability(
    records: Sequence[Record], edges: Sequence[float] = (0.0, 0.05, 0.2, 0.5, 0.8, 0.95, 1.001)
) -> list[Record]:
    """By bins of probability: pairs, their mean probability, the share that is true, and what it should lie within."""
    pairs = np.array([pair for record in records for pair in record.get("pairs", [])])
    table = []
    for low, high in pairwise(edges):
        inside = pairs[(pairs[:, 0] >= low) & (pairs[:, 0] < high)]
        if not len(inside):
            continue
        mean, true = inside.mean(axis=0)
        sd = float(np.sqrt(np.sum(inside[:, 0] * (1.0 - inside[:, 0]))) / len(inside))
        table.append({"low": low, "high": high, "n": len(inside), "mean": float(mean), "true": float(true), "sd": sd})
    return table


def limits(records: Sequence[Record]) -> dict[str, bool]:
    """What must hold: every bin right within four standard errors, and no interval certainly outside 85 to 95 %."""
    bins = reliability(records)
    held = coverage(records, "holds").values()
    low, high = COVERED
    return {
        f"every bin of probability within {ALLOWED:g} standard errors": all(
            abs(row["true"] - row["mean"]) <= ALLOWED * row["sd"] + 1.0 / row["n"] for row in bins
        ),
        f"intervals of 90 % may hold the truth on {100 * low:g} to {100 * high:g} % of all boards": all(
            _may_be(hits, n, low, high) for hits, n in held
        ),
    }


def is_calibrated(records: Sequence[Record]) -> bool:
    """Whether both limits are met."""
    return all(limits(records).values())


def _may_be(hits: int, n: int, low: float, high: float) -> bool:
    """Whether a share between two is within what chance makes of it, 95 %."""
    from scipy.stats import beta

    at_least = beta.ppf(0.05, hits, n - hits + 1) if hits else 0.0
    at_most = beta.ppf(0.95, hits + 1, n - hits) if hits < n else 1.0
    return bool(at_least <= high and at_most >= low)


def taken_for_sure(records: Sequence[Record]) -> tuple[int, int]:
    """How many labels the control takes for sure, and how many of them are false."""
    sure = [true for record in records for share, true in record.get("pairs", []) if share > 0.5]
    return len(sure), len(sure) - int(sum(sure))


def doubtful(records: Sequence[Record]) -> list[Record]:
    """Boards on which some assignment is in doubt: half a peak or more is expected to be taken wrongly."""
    return [one for one in records if sum(share * (1.0 - share) for share, _ in one.get("pairs", [])) > 0.5]


def coverage(records: Sequence[Record], key: str) -> dict[str, tuple[int, int]]:
    """How many intervals of each modulus hold the truth, and of how many."""
    judged = [record[key] for record in records if key in record]
    return {name: (sum(one[name] for one in judged), len(judged)) for name in MODULI}
