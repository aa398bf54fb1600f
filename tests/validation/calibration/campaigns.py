"""Simulated campaigns by the independent generator: what all boards share, and a sensor that some have, or none.

Where all boards share it, they have a sensor of one mass and shear moduli of their own species, all drawn from the
priors that the cards give them: intervals have to hold them as often as they say. Where three boards have the sensor,
or none, they are thin, and the sensor alone is said to be shared: that must not be claimed.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one campaign a core; before numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from collections.abc import Mapping, Sequence

import numpy as np
from generator.boards import plant
from generator.card import NOISE_FACTOR
from generator.designs import DESIGNS, SHEAR_MEANS
from scipy import stats
from validation.calibration.cases import COMPACT_DENSITY, COMPACT_GYRATION
from validation.calibration.records import Record

from bayesplate.board.quantity import Quantity

NOMINAL = 0.90
KINDS = {"all": "sensor and shear on all boards", "some": "sensor on some boards", "none": "sensor on no board"}
SENSOR_MEDIAN, SENSOR_FACTOR = 1.4e-3, 2.7
"""kg: of the prior that a card without a mass has."""
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

    rng = np.random.default_rng([design.base_seed, list(KINDS).index(kind), number])
    started = time.perf_counter()
    record: Record = {"kind": kind, "campaign": number}
    truth = draw_shared(rng) if kind == "all" else {"attached_mass": {"mass": PLANTED}}
    holders = set(range(design.n_boards)) if kind == "all" else set()
    if kind == "some":
        holders = {int(i) for i in rng.choice(design.n_boards, design.n_with, replace=False)}
    with tempfile.TemporaryDirectory() as folder:
        path = write_campaign(Path(folder), design, rng, truth, holders)
        try:
            found = bayesplate.diagnose(path, seed=1 + number, report=False)
        except bayesplate.BayesplateError as error:
            return record | {"error": f"{type(error).__name__}: {str(error)[:200]}"}
    true = {f"{effect}.{name}": value for effect, values in truth.items() for name, value in values.items()}
    claim = found.diagnosis.conditions
    return record | {
        "truth": true if kind == "all" else None,
        "shared": {
            name: [one.all_boards.q05, one.all_boards.q50, one.all_boards.q95]
            for name, one in found.summary.shared.items()
        },
        "claim": found.diagnosis.claim,
        "gain": claim.gain,
        "standard_error": claim.standard_error,
        "refused_by": list(claim.refused_by),
        "with": sorted(f"board-{i}" for i in holders),
        "warnings": list(found.summary.warnings),
        "seconds": time.perf_counter() - started,
    }


def draw_shared(rng: np.random.Generator) -> dict[str, dict[str, float]]:
    """What all boards share, SI units: the sensor's mass and both shear moduli, from the priors of the cards."""
    mass = SENSOR_MEDIAN * SENSOR_FACTOR ** float(rng.standard_normal())
    moduli = {name: Quantity.from_mean(*moments) for name, moments in SHEAR_MEANS.items()}
    return {
        "attached_mass": {"mass": mass},
        "transverse_shear": {name: float(one.sample(rng, 1)[0]) for name, one in moduli.items()},
    }


def write_campaign(
    folder: Path,
    design: CampaignDesign,
    rng: np.random.Generator,
    truth: Mapping[str, Mapping[str, float]],
    holders: set[int],
) -> Path:
    """The cards of a campaign; the path of the one that names the boards."""
    made = DESIGNS[design.design]
    mass = truth["attached_mass"]["mass"]
    radius = float((4.0 * mass / (np.pi * COMPACT_DENSITY)) ** (1.0 / 3.0) * COMPACT_GYRATION**0.5)
    for i in range(design.n_boards):
        board = plant(
            rng,
            made,
            list(truth) if i in holders else [],
            1.0,
            design.noise_cents,
            name=f"board-{i}",
            sensor=(0.9 * made.L_x, 0.9 * made.L_y),
            fixed={**truth, "attached_mass": {"mass": mass, "rotary_radius": radius}},
            noise_is_drawn=True,
            noise_factor=NOISE_FACTOR,
        )
        (folder / f"board-{i}.toml").write_text(board.card_text())
    boards = ", ".join(f'"./board-{i}.toml"' for i in range(design.n_boards))
    shared = "".join(f'\n[[shared]]\neffect = "{effect}"\n' for effect in truth)
    path = folder / "campaign.toml"
    path.write_text(f'format = 1\nname = "campaign"\nboards = [{boards}]\n{shared}')
    return path


def judge(records: Sequence[Record]) -> tuple[list[str], bool]:
    """Lines to print, and whether all is well."""
    failed = [one for one in records if "error" in one]
    lines = [f"{one['kind']}, campaign {one['campaign']}: {one['error']}" for one in failed]
    well = not failed
    for kind, told in KINDS.items():
        good = [one for one in records if one["kind"] == kind and "error" not in one]
        if not good:
            continue
        n, claims = len(good), sum(one["claim"] for one in good)
        refused = sum(bool(one["refused_by"]) for one in good)
        median = np.median([one["seconds"] for one in good])
        head = f"{told}, {n} campaigns of a median of {median:.0f} s:"
        if kind == "all":
            low, high = stats.binom.ppf([0.5 * LEVEL, 1.0 - 0.5 * LEVEL], n, NOMINAL)
            lines.append(f"{head} claimed {claims} times, refused by a board {refused}")
            for name in good[0]["truth"]:
                held, half = (sum(_holds(one, name, width) for one in good) for width in (1.0, 0.5))
                well &= bool(low <= held <= high)
                wanted = f"wanted {low:.0f} to {high:.0f}"
                lines.append(f"  90 % intervals of {name} hold {held}, {wanted}; of half the width {half}")
            continue
        most = stats.binom.ppf(1.0 - LEVEL, n, 0.05)
        well &= bool(claims <= most)
        lines.append(f"{head} claimed {claims} times, wanted at most {most:.0f}; refused by a board {refused}")
    return lines, well


def _holds(record: Record, name: str, width: float) -> bool:
    """Whether an interval of 90 %, narrowed towards the median, holds the truth."""
    low, middle, high = record["shared"][name]
    return bool(middle - width * (middle - low) <= record["truth"][name] <= middle + width * (high - middle))
