"""Pick measured recordings: `python tests/validation/calibration/run_measured.py --folder recordings`.

The raw hits of a free half-top (2R), its frequency response, and that of another (1R), against peaks that were read off
by another method. The data have no stated licence and are not part of the project: where the folder is absent, this
says so and ends with exit code 0. Otherwise 0: all peaks found within 0.3 % or the listed spread, their signs agree but
for one polarity, and no more than two further peaks are rather modes than not by the recordings; 1: not, with what is
missed; 2: usage. The labels of the listing, which the signs confirm, are to be the likeliest ones. The listing need not
be complete: it is told which of the further ones are modes that the board of the card has. Nor need it be right: where
a listed peak of a frequency response is missed, it is told where fits of one pole have it that share nothing with
`pick`. `--publish` writes the same to a page.
"""

from __future__ import annotations

import argparse
import os
import sys
import tomllib
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from statistics import median
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is imported

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy.optimize import least_squares
from validation.calibration.study import Page

import bayesplate
from bayesplate.recordings.contract import PickedRow
from bayesplate.results.words import percent, probabilities_text

WITHIN, MOST_FURTHER, HIGHEST, RATHER = 3e-3, 2, 1000.0, 0.5
ABOUT = (
    "Hits and frequency responses of two free half-tops of spruce, 2R and 1R, by D. Badiane and others, from the "
    "repository `David-Badiane/Data-driven-characterization-of-spruce-tonewood-plates` on GitHub (companion paper: doi "
    "10.1121/10.0020559). The repository states no licence: the recordings are no part of this project."
)
PAGE = Page(
    "measured-recordings",
    "Peaks picked from measured recordings, against those that another method read off",
    ABOUT,
    target="measured",
)
AT = {"hammer": [(0.020, 0.020)], "sensor": [(0.560, 0.197)]}
"""Where the listing says that hammer and sensor were, m."""
HALF_WIDTHS, DEGREES = (10.0, 15.0, 20.0, 25.0), (1, 2, 3)
"""Of the windows of plain fits, Hz, and of the polynomial for everything else in them."""
EVERY = 2
"""Lines of the responses for each line of their records, as the listing says how they were padded."""


def plain_fits(frequency: np.ndarray, values: np.ndarray, hertz: float) -> list[float]:
    """Where one pole lies that is fitted beside a polynomial to windows about a frequency, Hz: one for each way."""
    found = []
    for half, degree in product(HALF_WIDTHS, DEGREES):
        kept = np.abs(frequency - hertz) <= half
        given = frequency[kept], values[kept], ((frequency[kept] - hertz) / half)[:, None] ** np.arange(degree + 1)
        found.append(float(least_squares(_rest, [hertz, 0.01 * hertz], args=given).x[0]))
    return found


def _rest(pole: np.ndarray, frequency: np.ndarray, values: np.ndarray, powers: np.ndarray) -> np.ndarray:
    """What a pole (frequency and decay rate, Hz) and a polynomial leave of a window."""
    basis = np.column_stack([1.0 / (1j * (frequency - pole[0]) + pole[1]), powers])
    rest = values - basis @ np.linalg.lstsq(basis, values, rcond=None)[0]
    return np.concatenate([rest.real, rest.imag])


def compared(
    words: str, peaks: Sequence[dict[str, Any]], picked: Sequence[PickedRow], response: np.ndarray | None
) -> tuple[list[str], bool]:
    """Line by line how picked modes agree with listed peaks, and whether they do."""
    likely = [peak for peak in picked if peak.is_likely]
    off = sorted((abs(mode.hz - peak["f_hz"]), i, j) for i, peak in enumerate(peaks) for j, mode in enumerate(likely))
    of_peak: dict[int, int] = {}
    for _, i, j in off:
        if i not in of_peak and j not in of_peak.values():
            of_peak[i] = j
    lines, found, alike = [words], 0, {1: 0, -1: 0}
    for i, peak in enumerate(peaks):
        mode = likely[of_peak[i]] if i in of_peak else None
        reach = max(WITHIN * peak["f_hz"], peak["spread_hz"])
        if mode is None or abs(mode.hz - peak["f_hz"]) > reach:
            nearest = "none" if mode is None else f"{mode.hz:.2f} +- {mode.sd_hz:.2f} Hz"
            lines.append(f"  missed: {peak['f_hz']:.2f} Hz (within {reach:.2f} Hz), nearest {nearest}")
            if response is not None:
                plain = plain_fits(response[:, 0], response[:, 1] + 1j * response[:, 2], peak["f_hz"])
                lines.append(
                    f"    one pole beside a polynomial, {len(plain)} windows and degrees: "
                    f"{min(plain):.2f} to {max(plain):.2f} Hz"
                )
            continue
        found += 1
        if peak["sign"] in "+-" and mode.sign:
            alike[1 if mode.sign == peak["sign"] else -1] += 1
    further = [mode for j, mode in enumerate(likely) if j not in of_peak.values()]
    lines.append(f"  {found} of {len(peaks)} peaks found; signs {max(alike.values())} of {sum(alike.values())} agree")
    modes = [mode for mode in further if mode.mode_probability >= RATHER]
    lines.append(
        f"  median standard error of a frequency: {100 * median(mode.sd_hz / mode.hz for mode in likely):.3f} %"
    )
    lines.append(f"  further peaks that are rather modes than not by the recordings: {len(further)}")
    lines += [
        f"    {mode.hz:.1f} Hz: a mode of the board {percent(mode.mode_probability)}; no mode by the recordings alone "
        f"{percent(mode.spurious_probability)}, among the board's modes {probabilities_text(mode.may_be(2))}"
        for mode in further
    ]
    lines.append(f"  of these, rather modes of the board than not: {len(modes)}")
    stated = {i: peak["label"] for i, peak in enumerate(peaks) if peak["label"] and i in of_peak}
    wrong = [
        f"{peaks[i]['f_hz']:.2f} Hz is {label}, not {top}"
        for i, label in stated.items()
        if (top := next((one.label for one in likely[of_peak[i]].labels), "no mode")) != label
    ]
    lines.append("; ".join([f"  {len(stated) - len(wrong)} of {len(stated)} labels as listed", *wrong]))
    held = {
        f"all peaks found within {100 * WITHIN:.1f} % or the listed spread": found == len(peaks),
        "their signs agree": min(alike.values()) == 0,
        "the labels are those of the listing": not wrong,
        f"{MOST_FURTHER} further peaks at most": len(further) <= MOST_FURTHER,
    }
    lines += [f"  {'met' if is_met else 'MISSED'}: {limit}" for limit, is_met in held.items()]
    return lines, all(held.values())


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, required=True, help="with raw_2R/, the listings and the responses")
    parser.add_argument("--publish", type=Path, help="folder of the page")
    options = parser.parse_args()
    folder = options.folder
    if not folder.is_dir():
        print(f"skipped: no folder {folder}. The measured recordings are no part of the project.")
        return 0
    listed = {
        name: tomllib.loads((folder / f"spruce_free_{name}.toml").read_text(encoding="utf-8"))["peak"]
        for name in ("2R", "1R")
    }
    hits = sorted((folder / "raw_2R").glob("hit_*.csv"))
    every = [
        ("2R, five hits", "2R", hits, 48_000.0),
        ("2R, frequency response", "2R", [folder / "spruce_free_2R_frf.csv"], None),
        ("1R, frequency response", "1R", [folder / "spruce_free_1R_frf.csv"], None),
    ]
    is_right, told = True, []
    for words, name, files, rate in every:
        card = f"spruce-free-{name}"
        picked = bayesplate.pick(files, card=card, rate=rate, highest=HIGHEST, polarity="opposite", **AT).summary
        response = None if rate else np.genfromtxt(files[0], delimiter=",", skip_header=2)[::EVERY]
        lines, agrees = compared(words, listed[name], picked.peaks, response)
        print("\n".join(lines), flush=True)
        is_right, told = is_right and agrees, [*told, *lines, ""]
    if options.publish is not None:
        PAGE.write(options.publish, told[:-1])
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main())
