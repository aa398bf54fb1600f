"""Recordings with planted modes: are picked frequencies within their standard errors, false peaks as rare as stated?

A free board of the generator, whose plate is another discretisation than the package's, carries a sensor of 0.3 to 2 g
and is hit three times at each of four places, force and acceleration recorded, at 6 kHz for 1.6 s. Damping ratios are
0.3 to 3 %, noise lies 30 to 60 dB below the response, every second board has two modes 1 % apart, every third recording
has hum. A picked mode belongs to the planted one within half a per cent; what belongs to none is false.

The control takes the highest line of each peak, with the rounding error of a line.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import ritz
from generator.ringing import Blow, Ringing, moved, recorded, ringing, with_noise
from numpy.typing import NDArray

from bayesplate.recordings.hits import find_hits, usable_hits
from bayesplate.recordings.picking import HIGHEST, PickedModes, pick_modes
from bayesplate.recordings.signals import Recording
from bayesplate.recordings.spectra import Spectra, decay_spectra

Floats = NDArray[np.float64]
Record = dict[str, Any]

RATE, SECONDS = 6000.0, 1.6
N_PLACES, N_HITS, N_MODES = 4, 3, 26
SENSOR = (0.560, 0.197)
APART = 0.01
"""Relative distance of a close pair."""
NEAR = 0.005
"""Relative distance up to which a picked mode is a planted one."""
LONELY = 0.015
"""Relative distance to the next planted mode from which on a mode has no close neighbour."""
BIAS = 2e-4
WITHIN = {1.0: 0.6827, 2.0: 0.9545}
"""Standard errors, and how many of a hundred errors lie within them."""


def board_of(rng: np.random.Generator, *, has_pair: bool) -> Ringing:
    """A board with its damping, drawn; a pair of its modes is moved together."""
    around = np.exp(0.15 * rng.standard_normal(3))
    plate = ritz.Plate.from_moduli(
        12e9 * around[0], 0.9e9 * around[1], 0.75e9 * around[2], 0.4,
        rho=429.0, h=4.7e-3, L_x=0.580, L_y=0.217, edges=ritz.ALL_FREE,
    )  # fmt: skip
    damping = np.exp(rng.uniform(np.log(0.003), np.log(0.03), N_MODES))
    board = ringing(plate, N_MODES, damping, SENSOR, rng.uniform(0.3e-3, 2e-3))
    if not has_pair:
        return board
    lower = int(rng.integers(2, 14))
    return moved(board, lower + 1, (1.0 + APART) * board.hertz[lower])


def recordings_of(rng: np.random.Generator, board: Ringing, decibels: float, hum: float) -> list[Recording]:
    """Every hit at every place, a recording each."""
    found = []
    for place in range(N_PLACES):
        hammer = rng.uniform(0.02, 0.56), rng.uniform(0.02, 0.20)
        for hit in range(N_HITS):
            blow = Blow(0.02 + rng.uniform(0.0, 1e-3), rng.uniform(0.4e-3, 1.2e-3), rng.uniform(3.0, 8.0))
            force, heard = recorded(board, hammer, SENSOR, [blow], RATE, SECONDS)
            noisy = with_noise(rng, heard, decibels, RATE, hum)
            name = f"place {place + 1} hit {hit + 1}"
            found.append(Recording(name, RATE, noisy, with_noise(rng, force, 40.0, RATE), hammer=hammer, sensor=SENSOR))
    return found


def simulate_one(base_seed: int, index: int) -> Record:
    """One board: errors of its picked modes in standard errors, what was missed, and what is false."""
    rng = np.random.default_rng([base_seed, 16, index])
    board = board_of(rng, has_pair=index % 2 == 1)
    decibels = float(rng.uniform(30.0, 60.0))
    hum = float(10.0 ** (-rng.uniform(20.0, 50.0) / 20.0)) if index % 3 == 0 else 0.0
    recordings = recordings_of(rng, board, decibels, hum)
    started = time.process_time()
    spectra = decay_spectra([(one, usable_hits(find_hits(one))) for one in recordings], HIGHEST)
    picked = pick_modes(spectra)
    seconds = time.process_time() - started
    return {"simulation": index, "decibels": decibels, "seconds": round(seconds, 2)} | judged(board, picked)


def judged(board: Ringing, picked: PickedModes) -> Record:
    """Picked modes against planted ones: each belongs to one at most, the nearest pairs first."""
    truth = board.damped
    likely = picked.likely
    pairs = sorted((abs(mode.hz / hertz - 1.0), i, j) for i, mode in enumerate(likely) for j, hertz in enumerate(truth))
    of_mode: dict[int, int] = {}
    for off, i, j in pairs:
        if off < NEAR and i not in of_mode and j not in of_mode.values():
            of_mode[i] = j
    audible = [j for j, hertz in enumerate(truth) if hertz < HIGHEST]
    modes = []
    for i, j in of_mode.items():
        error = likely[i].hz - truth[j]
        gaps = np.sort(np.abs(truth / truth[j] - 1.0))
        modes.append(
            {
                "z": round(float(error / likely[i].sd_hz), 3),
                "relative": float(error / truth[j]),
                "control": _control(picked.spectra, float(truth[j])),
                "lonely": bool(gaps[1] > LONELY),
                "spurious": round(likely[i].spurious_probability, 4),
            }
        )
    close = [j for j in audible if np.sort(np.abs(truth / truth[j] - 1.0))[1] < LONELY]
    return {
        "modes": modes,
        "false": [round(mode.spurious_probability, 4) for i, mode in enumerate(likely) if i not in of_mode],
        "audible": len(audible),
        "missed": len([j for j in audible if j not in of_mode.values()]),
        "close": len(close),
        "close_missed": len([j for j in close if j not in of_mode.values()]),
    }


def _control(spectra: Spectra, hertz: float) -> float:
    """Error of the highest line near a mode over the rounding error of a line."""
    level = np.sum(np.abs(spectra.values) ** 2, axis=1)
    near = np.abs(spectra.frequency / hertz - 1.0) < NEAR
    if not near.any():
        return 0.0
    spacing = float(spectra.frequency[1] - spectra.frequency[0])
    highest = float(spectra.frequency[near][np.argmax(level[near])])
    return round((highest - hertz) / (spacing / np.sqrt(12.0)), 3)


def told(records: Sequence[Record]) -> list[str]:
    """What came out, line by line."""
    modes = [mode for record in records for mode in record["modes"]]
    lines = [
        f"{len(records)} recordings of {N_PLACES} places and {N_HITS} hits, {sum(r['audible'] for r in records)} modes "
        f"below {HIGHEST:g} Hz; median {np.median([r['seconds'] for r in records]):.1f} s of one core each",
        "",
        f"{'errors within':34s} {'1 standard error':>17s} {'2':>8s}",
        f"{'  as a normal law has it':34s} {100 * WITHIN[1.0]:15.1f} % {100 * WITHIN[2.0]:6.1f} %",
    ]
    for words, some in _kinds(records):
        lines.append(_within(f"  {words}, {len(some)}", [mode["z"] for mode in some]))
    lines.append(_within("control: highest lines", [mode["control"] for mode in modes]))
    told_sd = ", ".join(f"{100 * sd:.1f}" for _, _, sd in _shares(records, "z"))
    lines.append(f"Monte Carlo errors of the shares of all modes: {told_sd} %, by how recordings differ")
    relative = np.array([mode["relative"] for mode in modes])
    bias, se = float(relative.mean()), float(relative.std() / np.sqrt(relative.size))
    n_false = sum(len(record["false"]) for record in records)
    stated = sum(mode["spurious"] for mode in modes) + sum(sum(record["false"]) for record in records)
    lines += [
        "",
        f"bias of the frequencies {100 * bias:+.4f} +- {100 * se:.4f} % (acceptance limit: {100 * BIAS:g} %)",
        f"median error {100 * float(np.median(np.abs(relative))):.4f} %",
        f"false peaks among the likely ones: {n_false}; expected by their probabilities: {stated:.1f}",
        f"modes missed: {sum(r['missed'] for r in records)} of {sum(r['audible'] for r in records)}; of those with a "
        f"neighbour within {100 * LONELY:g} %: {sum(r['close_missed'] for r in records)} of "
        f"{sum(r['close'] for r in records)}",
        "",
        *(f"{'met' if is_met else 'MISSED'}: {words}" for words, is_met in limits(records).items()),
    ]
    return lines


def _shares(records: Sequence[Record], key: str) -> list[tuple[float, float, float]]:
    """For one and for two standard errors: the share wanted, the share within, and its Monte Carlo error.

    The error is that of independent modes or what recordings differ by, whichever is larger: two recordings hardly
    tell how much recordings differ.
    """
    found = []
    for size, wanted in WITHIN.items():
        inside = [np.abs([mode[key] for mode in record["modes"]]) <= size for record in records if record["modes"]]
        share = float(np.mean(np.concatenate(inside)))
        off = np.array([one.sum() - share * one.size for one in inside])
        n_modes = sum(one.size for one in inside)
        independent = float(np.sqrt(wanted * (1.0 - wanted) / n_modes))
        found.append((wanted, share, max(float(np.sqrt(np.sum(off**2))) / n_modes, independent)))
    return found


def _kinds(records: Sequence[Record]) -> list[tuple[str, list[Record]]]:
    every = [(record["decibels"], mode) for record in records for mode in record["modes"]]
    return [
        ("all modes", [mode for _, mode in every]),
        ("without a close neighbour", [mode for _, mode in every if mode["lonely"]]),
        ("with one", [mode for _, mode in every if not mode["lonely"]]),
        ("noise 30 to 40 dB below", [mode for level, mode in every if level < 40.0]),
        ("noise 50 to 60 dB below", [mode for level, mode in every if level >= 50.0]),
    ]


def _within(words: str, errors: Sequence[float]) -> str:
    sizes = np.abs(np.array(errors if len(errors) else [np.nan]))
    return f"{words:34s} {100 * np.mean(sizes <= 1.0):15.1f} % {100 * np.mean(sizes <= 2.0):6.1f} %"


def limits(records: Sequence[Record], key: str = "z") -> dict[str, bool]:
    """Each limit, and whether it is met.

    Three Monte Carlo standard errors are allowed each; those of the shares are taken from how recordings differ, for
    the errors of one recording have much in common.
    """
    relative = np.array([mode["relative"] for record in records for mode in record["modes"]])
    n_false = sum(len(record["false"]) for record in records)
    stated = sum(sum(record["false"]) + sum(mode["spurious"] for mode in record["modes"]) for record in records)
    within = {
        f"within {size:g} standard error{'s' if size > 1.0 else ''} at least as many as a normal law has": share
        >= wanted - 3.0 * sd
        for size, (wanted, share, sd) in zip(WITHIN, _shares(records, key), strict=True)
    }
    return within | {
        f"bias below {100 * BIAS:g} %": bool(abs(relative.mean()) < BIAS),
        "false peaks no more than stated": bool(n_false <= stated + 3.0 * np.sqrt(max(stated, 1.0))),
    }


def is_calibrated(records: Sequence[Record], key: str = "z") -> bool:
    """Whether every one of the limits is met."""
    return all(limits(records, key).values())
