"""What a set of ranks says: one row a quantity, and whether the whole may be called calibrated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from validation.calibration.bands import band_p_value, central_coverage, chi2_p_value, coverage_p_value
from validation.calibration.sbc import N_DRAWS

FAMILY_LEVEL = 0.05
"""Chance that a correct code is called miscalibrated: the band of each of n quantities is widened to 1 - 0.05 / n.

Ten bands of 95 % would reject a correct code four times in ten.
"""

COVERAGE_LEVEL = 0.01
"""The same for how often the middle 50 and 90 % of the draws hold the truth, of all quantities together."""
MIDDLES = (0.5, 0.9)

MUTANT_LEVEL = 1e-3

MUTANTS = {
    "likelihood omitted": 40,
    "noise fixed at half": 40,
    "sign of the Poisson ratio flipped": 40,
    "one mode counted twice": 400,
    "spread 0.7 of itself": 96,
    "spread 0.8 of itself": 200,
}
"""Wrong posteriors that must be found out, and how many simulations that takes: see `test_bands` for the spreads. The
mode counted twice was found out in each lot of 333 and of 400 of a run of 1000, not in every lot of 250."""
NOT_COUNTED = {"noise fixed at half": ("noise",), "sign of the Poisson ratio flipped": ("poisson_xy",)}
"""What is wrong by construction; such a mutant has to be found by what follows from it."""


@dataclass(frozen=True)
class Row:
    """Verdict on one quantity.

    Attributes
    ----------
    name : str
    band, chi2 : float
        Chance that ranks of a fit that is right leave the flat line so far, and that of chi-squared.
    mean_rank : float
        0.5 if the fit is right.
    within : tuple of float
        How often the middle 50 and 90 % of the draws hold the truth.
    coverage : float
        The smaller chance of the two that they do it so often or so seldom.
    """

    name: str
    band: float
    chi2: float
    mean_rank: float
    within: tuple[float, ...]
    coverage: float


def rows(ranks: Sequence[Mapping[str, int]]) -> list[Row]:
    """One row a quantity."""
    found = []
    for name in ranks[0]:
        values = np.array([one[name] for one in ranks])
        found.append(
            Row(
                name,
                band_p_value(values, N_DRAWS),
                chi2_p_value(values, N_DRAWS),
                float(values.mean() / N_DRAWS),
                tuple(central_coverage(values, N_DRAWS, middle) for middle in MIDDLES),
                min(coverage_p_value(values, N_DRAWS, middle) for middle in MIDDLES),
            )
        )
    return found


def family_p_value(table: Sequence[Row], leave_out: Sequence[str] = ()) -> float:
    """Bonferroni: the smallest band probability times the number of quantities."""
    counted = [row.band for row in table if row.name not in leave_out]
    return min(1.0, min(counted) * len(counted))


def coverage_family_p_value(table: Sequence[Row]) -> float:
    """Bonferroni: the smallest chance of a coverage times the number of coverages."""
    return min(1.0, min(row.coverage for row in table) * len(MIDDLES) * len(table))


def is_calibrated(table: Sequence[Row]) -> bool:
    """Whether every quantity stays within its band, and intervals hold the truth as often as they say."""
    return family_p_value(table) > FAMILY_LEVEL and coverage_family_p_value(table) > COVERAGE_LEVEL


def family_words(table: Sequence[Row]) -> str:
    """Both as they are printed."""
    return f"family-wise p {family_p_value(table):.3f}, of coverage {coverage_family_p_value(table):.3f}"


def is_caught(mutant: str, table: Sequence[Row]) -> bool:
    """Whether the bands find a mutant out."""
    return family_p_value(table, NOT_COUNTED.get(mutant, ())) < MUTANT_LEVEL


def text(title: str, table: Sequence[Row], n: int) -> str:
    """The table as it is printed."""
    width = max(16, *(len(row.name) for row in table))
    lines = [f"{title}, {n} simulations", f"  {'quantity':{width}} band p  chi2 p  mean rank  in 50 %  in 90 %"]
    for row in table:
        mark = "" if row.band > 0.05 else "  outside its own 95 % band"
        lines.append(
            f"  {row.name:{width}} {row.band:6.4f}  {row.chi2:6.4f}  {row.mean_rank:9.3f}  "
            f"{'  '.join(f'{100 * share:7.1f}' for share in row.within)}{mark}"
        )
    return "\n".join(lines)
