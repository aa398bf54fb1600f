"""Simulated campaigns: boards with one sensor on all of them, on some, or on none, by the independent generator."""

from __future__ import annotations

import os
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one campaign a core; before numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from collections.abc import Sequence

import numpy as np
from calibration.cases import COMPACT_DENSITY, COMPACT_GYRATION
from calibration.records import Record
from generator.boards import plant
from generator.card import NOISE_FACTOR
from generator.designs import DESIGNS
from scipy import stats

NOMINAL = 0.90
KINDS = ("all", "some", "none")
SENSOR_MEDIAN, SENSOR_FACTOR = 1.4e-3, 2.7
"""kg: of the prior that a card without a mass has; where all boards have the sensor its mass is drawn from it."""
PLANTED = 3e-3
"""kg, on some boards."""
LEVEL = 1e-3
"""Probability with which a fit that is right would leave the bands below."""


@dataclass(frozen=True)
class CampaignDesign:
    """How campaigns are simulated.

    Attributes
    ----------
    n_boards, n_with : int
        Boards, and how many of them have the sensor where some have.
    design : str
        Of the generator.
    noise_cents : float
        Median of what the noise of each board is drawn from.
    base_seed : int
    """

    n_boards: int = 8
    n_with: int = 3
    design: str = "free-12"
    noise_cents: float = 5.0
    base_seed: int = 1


def identity(design: CampaignDesign) -> Record:
    """What records of one file have in common."""
    return {"what": "campaigns", **asdict(design)}


def simulate_one(design: CampaignDesign, kind: str, number: int) -> Record:
    """One campaign from its truth to what is claimed.

    Parameters
    ----------
    design : CampaignDesign
    kind : "all", "some" or "none"
        Which boards have the sensor.
    number : int
        Of the campaign; with kind and seed everything random follows from it.

    Returns
    -------
    dict
    """
    import bayesplate

    rng = np.random.default_rng([design.base_seed, KINDS.index(kind), number])
    started = time.perf_counter()
    record: Record = {"kind": kind, "campaign": number}
    mass = SENSOR_MEDIAN * SENSOR_FACTOR ** float(rng.standard_normal()) if kind == "all" else PLANTED
    holders = set(range(design.n_boards)) if kind == "all" else set()
    if kind == "some":
        holders = {int(i) for i in rng.choice(design.n_boards, design.n_with, replace=False)}
    with tempfile.TemporaryDirectory() as folder:
        path = write_campaign(Path(folder), design, rng, mass, holders)
        try:
            found = bayesplate.diagnose(path, seed=1 + number, report=False)
        except bayesplate.BayesplateError as error:
            return record | {"error": f"{type(error).__name__}: {str(error)[:200]}"}
    shared = found.summary.shared["attached_mass.mass"].all_boards
    claim = found.diagnosis.conditions
    return record | {
        "truth": mass if kind == "all" else None,
        "q05": shared.q05,
        "q50": shared.q50,
        "q95": shared.q95,
        "claim": found.diagnosis.claim,
        "gain": claim.gain,
        "standard_error": claim.standard_error,
        "refused_by": list(claim.refused_by),
        "with": sorted(f"board-{i}" for i in holders),
        "warnings": list(found.summary.warnings),
        "seconds": time.perf_counter() - started,
    }


def write_campaign(
    folder: Path, design: CampaignDesign, rng: np.random.Generator, mass: float, holders: set[int]
) -> Path:
    """The cards of a campaign; the path of the one that names the boards."""
    made = DESIGNS[design.design]
    radius = float((4.0 * mass / (np.pi * COMPACT_DENSITY)) ** (1.0 / 3.0) * COMPACT_GYRATION**0.5)
    for i in range(design.n_boards):
        board = plant(
            rng,
            made,
            ["attached_mass"] if i in holders else [],
            1.0,
            design.noise_cents,
            name=f"board-{i}",
            sensor=(0.9 * made.L_x, 0.9 * made.L_y),
            fixed={"attached_mass": {"mass": mass, "rotary_radius": radius}},
            noise_is_drawn=True,
            noise_factor=NOISE_FACTOR,
        )
        (folder / f"board-{i}.toml").write_text(board.card_text())
    boards = ", ".join(f'"./board-{i}.toml"' for i in range(design.n_boards))
    path = folder / "campaign.toml"
    path.write_text(f'format = 1\nname = "campaign"\nboards = [{boards}]\n\n[[shared]]\neffect = "attached_mass"\n')
    return path


def judge(records: Sequence[Record]) -> tuple[list[str], bool]:
    """Lines to print, and whether all is well."""
    failed = [one for one in records if "error" in one]
    lines = [f"{one['kind']}, campaign {one['campaign']}: {one['error']}" for one in failed]
    well = not failed
    for kind in KINDS:
        good = [one for one in records if one["kind"] == kind and "error" not in one]
        if not good:
            continue
        n, claims = len(good), sum(one["claim"] for one in good)
        if kind == "all":
            held = sum(one["q05"] <= one["truth"] <= one["q95"] for one in good)
            half = sum(
                0.5 * (one["q50"] + one["q05"]) <= one["truth"] <= 0.5 * (one["q50"] + one["q95"]) for one in good
            )
            low, high = stats.binom.ppf([0.5 * LEVEL, 1.0 - 0.5 * LEVEL], n, NOMINAL)
            well &= bool(low <= held <= high)
            wanted = f"wanted {low:.0f} to {high:.0f}"
            lines.append(f"sensor on all boards: 90 % intervals hold {held} of {n} masses, {wanted}")
            lines.append(f"  intervals of half the width: {half}; claimed: {claims}")
            continue
        most = stats.binom.ppf(1.0 - LEVEL, n, 0.05)
        well &= bool(claims <= most)
        where = "some boards" if kind == "some" else "no board"
        refused = sum(bool(one["refused_by"]) for one in good)
        lines.append(f"sensor on {where}: claimed {claims} of {n} times, wanted at most {most:.0f}")
        lines.append(f"  refused by a board: {refused}")
    seconds = [one["seconds"] for one in records if "seconds" in one]
    if seconds:
        lines.append(f"median {np.median(seconds):.0f} s a campaign")
    return lines, well
