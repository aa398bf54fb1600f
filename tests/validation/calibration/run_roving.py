"""Calibrate a roving sensor: `python tests/validation/calibration/run_roving.py --boards 50 --out roving.jsonl`.

Five hits at each of six places of a sensor of half a gram, as the paper measured: at each place the sensor lowers the
modes otherwise. Is each mode picked once, its mean over the places within the standard error, and do the constants of a
fit, in which the sensor roves over the places, hold the true ones? Exit code 0: as stated; 1: not; 2: usage. A run that
was interrupted goes on where it stopped if it is given the same file.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one board a core; before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
import ritz
from generator.ringing import Blow, Ringing, recorded, ringing, with_noise
from validation.calibration.records import Record
from validation.calibration.study import Page, Study, arguments, carry_out, numbered

import bayesplate
from bayesplate.recordings.picking import pick_modes
from bayesplate.recordings.signals import Recording
from bayesplate.recordings.taking import take_spectra

BASE_SEED, RATE, HIGHEST, NEAR = 60, 6000.0, 600.0, 5e-3
SIDES, THICKNESS, DENSITY = (0.580, 0.217), 4.2e-3, 420.0
HAMMER, SENSOR_MASS, N_HITS, N_MODES = (0.02, 0.02), 0.5e-3, 5, 24
PLACES = ((0.97, 0.95), (0.97, 0.05), (0.5, 0.95), (0.03, 0.95), (0.28, 0.9), (0.75, 0.9))
"""Of the sensor, over the sides."""
ABOUT = (
    "The sensor lowers each mode otherwise at each of its places, by up to half a per cent. A mode's frequency is the "
    "mean over the places and its error holds their scatter, so that more errors lie within it than a normal law has."
)
PAGE = Page("roving", "A sensor that roves: is each mode picked once, and do constants hold the truth?", ABOUT)
CARD = """\
format = 1
name = "roved"

[plate]
length_x_mm = {0:g}
length_y_mm = {1:g}
thickness_mm = {2:g}
density_kg_m3 = {3:g}

[material]
poisson_xy = 0.4

[setup]
edges = {{ x0 = "free", x1 = "free", y0 = "free", y1 = "free" }}

[[setup.attached]]
kind = "accelerometer"
mass_g = {4:g}
at_mm = {5}

[setup.frequencies_hz]
{6}
"""


def recordings_of(rng: np.random.Generator, boards: Sequence[Ringing], places: Sequence[Any]) -> list[list[Recording]]:
    """A recording of all hits for each place of the sensor."""
    found = []
    for number, (board, place) in enumerate(zip(boards, places, strict=True)):
        times = [0.1 + 1.5 * hit + rng.uniform(0.0, 1e-3) for hit in range(N_HITS)]
        blows = [Blow(at, rng.uniform(0.4e-3, 1e-3), rng.uniform(3.0, 7.0)) for at in times]
        force, heard = recorded(board, HAMMER, place, blows, RATE, 1.5 * N_HITS + 0.3)
        noisy, struck = with_noise(rng, heard, rng.uniform(35.0, 55.0), RATE), with_noise(rng, force, 45.0, RATE)
        found.append([Recording(f"place {number + 1}", RATE, noisy, struck, hammer=HAMMER, sensor=place)])
    return found


def simulate_one(base_seed: int, index: int) -> Record:
    """One board: errors of its modes and constants in standard errors, what was picked twice, false or not at all."""
    rng = np.random.default_rng([base_seed, index])
    moduli = np.array([12e9, 0.85e9, 0.72e9]) * np.exp(0.15 * rng.standard_normal(3))
    plate = ritz.Plate.from_moduli(
        *moduli, 0.4, rho=DENSITY, h=THICKNESS, L_x=SIDES[0], L_y=SIDES[1], edges=ritz.ALL_FREE
    )
    damping = np.exp(rng.uniform(np.log(0.005), np.log(0.015), N_MODES))
    places = [(SIDES[0] * x, SIDES[1] * y) for x, y in PLACES]
    boards = [ringing(plate, N_MODES, damping, place, SENSOR_MASS) for place in places]
    picked = pick_modes(take_spectra(recordings_of(rng, boards, places), HIGHEST).spectra, 20.0, HIGHEST)
    truth = np.mean([board.damped for board in boards], axis=0)
    names = [f"({m},{n})" for (m, n), _ in boards[0].modes.names()][:N_MODES]
    likely = [mode for mode in picked.likely if mode.hz < 0.98 * HIGHEST]
    nearest = [int(np.argmin(np.abs(truth / mode.hz - 1.0))) for mode in likely]
    off = [mode.hz / truth[k] - 1.0 for mode, k in zip(likely, nearest, strict=True)]
    of_mode = {k: mode for mode, k, far in zip(likely, nearest, off, strict=True) if abs(far) < NEAR}
    readings = "\n".join(
        f'"{names[k]}" = {{ mean = {mode.hz:.6g}, sd = {mode.sd_hz:.3g} }}' for k, mode in sorted(of_mode.items())
    )
    at_mm = [[round(1e3 * x, 3), round(1e3 * y, 3)] for x, y in places]
    card = CARD.format(1e3 * SIDES[0], 1e3 * SIDES[1], 1e3 * THICKNESS, DENSITY, 1e3 * SENSOR_MASS, at_mm, readings)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "roved.toml"
        path.write_text(card, encoding="utf-8")
        elastic = bayesplate.fit(path).summary.elastic
    return {
        "simulation": index,
        "modes": [round(float((mode.hz - truth[k]) / mode.sd_hz), 3) for k, mode in of_mode.items()],
        "constants": [
            round(float((elastic[name].mean - value) / elastic[name].sd), 3)
            for name, value in zip(("E_x", "E_y", "G_xy"), moduli, strict=True)
        ],
        "twice": int(sum(abs(far) < NEAR for far in off)) - len(of_mode),
        "false": int(sum(abs(far) >= NEAR for far in off)),
        "missed": int(np.sum(truth < 0.98 * HIGHEST)) - len(of_mode),
    }


def study(n_boards: int) -> Study:
    """So many boards."""
    return Study(simulate_one, {"format": 1, "seed": BASE_SEED}, numbered(BASE_SEED, n=n_boards), told)


def told(records: Sequence[Record]) -> tuple[list[str], bool]:
    """What came out, line by line, and whether it is as stated."""
    modes, constants = (np.abs(np.concatenate([one[key] for one in records])) for key in ("modes", "constants"))
    twice, false, missed = (sum(one[key] for one in records) for key in ("twice", "false", "missed"))
    # errors of one board have much in common: the limit counts boards
    beyond = sum(max(np.abs(one["constants"])) > 3.0 for one in records)
    lines = [
        f"{len(records)} boards, {modes.size} modes: within 1 standard error {100 * np.mean(modes <= 1):.0f} %, "
        f"2 {100 * np.mean(modes <= 2):.0f} %; picked twice {twice}, false {false}, missed {missed}",
        f"constants within 1 standard deviation {100 * np.mean(constants <= 1):.0f} %, "
        f"2 {100 * np.mean(constants <= 2):.0f} %; boards with a constant beyond 3: {beyond}",
    ]
    return lines, bool(twice == 0 and np.mean(modes <= 2) > 0.9 and beyond <= 0.05 * len(records))


def main() -> int:
    """Run the command."""
    options = arguments(__doc__, 50, "boards").parse_args()
    return carry_out(study(options.n), PAGE, options)


if __name__ == "__main__":
    sys.exit(main())
