"""Draws of `infer` against posteriors in closed form: 50 data sets with the noise known, 50 with it unknown.

Of each set the mean, the standard deviation and three quantiles of every parameter must lie within four Monte Carlo
errors; of the standardised means of the constants at most one may lie beyond three, and they must look normal. Draws
that are wrong in known ways must differ in every set.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from conjugate import NOISE, closed_form, conjugate, rigidity_prior, sampled, stated, unknown_noise
from numpy.typing import NDArray
from scipy import stats
from statistics_checks import Truth, differences, normal_truth
from validation.calibration.records import Record

KINDS = ("noise known", "noise unknown")
N_SETS = 50
FIRST_SEED = {"noise known": 100, "noise unknown": 1000}
WIDER = 1.15
MOST_BEYOND_THREE, LEAST_KS = 1, 1e-3

Floats = NDArray[np.float64]
Differ = Callable[[Floats, Truth], list[str]]


def check_one(kind: str, index: int) -> Record:
    """One data set: what differs, the standardised means of the constants, and in how much wrong draws differ."""
    seed = FIRST_SEED[kind] + index
    if kind == "noise known":
        board, law, data, mean, covariance = conjugate(seed)
        problem = stated(board, rigidity_prior(), law, mean, covariance)
        truth = normal_truth(mean, np.sqrt(np.diagonal(covariance)))
        without = [normal_without(data, mode) for mode in range(data.size)]
    else:
        problem, truth = unknown_noise(seed)
        without = []
    inference = sampled(problem, seed=index)
    n = truth.mean.size
    draws, ess = inference.chains.pooled[:, :n], inference.convergence.ess[:n]
    swapped = draws[:, [1, 0, *range(2, n)]]
    wrong = {
        "spread 1.15 of itself": len(differences(truth.mean + WIDER * (draws - truth.mean), ess, truth)),
        "D_x and D_y exchanged": len(differences(swapped, ess, truth)),
        **{f"mode {i + 1} left out": len(differences(draws, ess, other)) for i, other in enumerate(without)},
    }
    error = truth.sd / np.sqrt(ess)
    z = ((draws.mean(axis=0) - truth.mean) / error)[:3].tolist()
    return {"kind": kind, "set": index, "ess": float(ess.min()), "differs": differences(draws, ess, truth), "z": z,
            "wrong": wrong}  # fmt: skip


def normal_without(data: Floats, mode: int) -> Truth:
    """The closed form of the readings but one."""
    scales = np.full(data.size, NOISE)
    scales[mode] = np.inf
    mean, covariance = closed_form(data, scales)
    return normal_truth(mean, np.sqrt(np.diagonal(covariance)))


def identity() -> dict[str, Any]:
    """What a file of these records must agree in."""
    return {"format": 1, "part": "oracle", "first_seed": FIRST_SEED, "wider": WIDER}


def judge(records: Sequence[Record]) -> tuple[list[str], bool]:
    """Lines to print, and whether all is well."""
    lines, well = [], True
    for kind in KINDS:
        of_kind = [record for record in records if record["kind"] == kind]
        if len(of_kind) < N_SETS:
            lines.append(f"{kind}: {len(of_kind)} data sets, {N_SETS} are needed to judge")
            well = False
            continue
        z = np.array([one for record in of_kind for one in record["z"]])
        beyond, ks = int(np.sum(np.abs(z) > 3.0)), float(stats.kstest(z, stats.norm.cdf).pvalue)
        told = [sentence for record in of_kind for sentence in record["differs"]]
        is_caught = all(n > 0 for record in of_kind for n in record["wrong"].values())
        is_right = not told and beyond <= MOST_BEYOND_THREE and ks > LEAST_KS
        lines.append(
            f"{kind}, {len(of_kind)} data sets: {len(told)} beyond four Monte Carlo errors; of {z.size} means {beyond} "
            f"beyond three; their normality p {ks:.3f}: {'agree' if is_right else 'DO NOT AGREE'}"
        )
        lines += [f"  {sentence}" for sentence in told]
        lines.append("  wrong draws: " + "; ".join(_caught(of_kind)))
        well &= is_right and is_caught
    return lines, well


def _caught(records: Sequence[Record]) -> list[str]:
    """Of how many sets each kind of wrong draws was found out."""
    names = records[0]["wrong"]
    return [f"{name} {sum(r['wrong'][name] > 0 for r in records)} of {len(records)}" for name in names]
