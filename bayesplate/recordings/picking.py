"""From spectra of decays to picked modes: frequency, damping and residues, each with what is not known of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.across import modes_across
from bayesplate.recordings.agreement import agreeing
from bayesplate.recordings.contract import PickedRow
from bayesplate.recordings.modes_found import Mode, Path, find_modes, fit_modes, joined
from bayesplate.recordings.plausibility import Peak, Verdict, judged, part_words
from bayesplate.recordings.spectra import Spectra
from bayesplate.recordings.strength import Answer

LOWEST, HIGHEST = 20.0, 1000.0
"""Hz between which modes are looked for unless others are given."""
_BEYOND = 100.0
"""Hz below the lowest and above the highest in which modes are looked for too: they reach into the band."""
_FEWEST_LINES = 5
_SAME = 3.0
"""Decay rates within which a mode is found again in a fit without the parts."""


@dataclass(frozen=True, eq=False)
class Picked:
    # in the order of frequency, without signs and labels, those that are likely no mode included
    peaks: tuple[PickedRow, ...]
    answers: tuple[Answer, ...]
    spectra: Spectra
    paths: tuple[Path, ...]  # of the search, for the diagram of stability
    lowest: float
    highest: float
    remarks: tuple[str, ...] = ()  # how recordings differ that do not show quite the same modes

    @property
    def likely(self) -> tuple[PickedRow, ...]:
        return tuple(peak for peak in self.peaks if peak.is_likely)

    @property
    def likely_answers(self) -> tuple[Answer, ...]:
        return tuple(one for one, peak in zip(self.answers, self.peaks, strict=True) if peak.is_likely)

    def sign(self, answer: Answer, flips: bool | None) -> str:
        """Sign of a residue; empty without a force, else as of `Answer.sign`."""
        return "" if self.spectra.force is None else answer.sign(flips)


def pick_modes(spectra: Spectra, lowest: float = LOWEST, highest: float = HIGHEST) -> Picked:
    """Modes between two frequencies in Hz.

    Refused where the spectra have next to nothing between the two, as frequency responses that end below, and where two
    recordings have no modes in common.
    """
    n_lines = int(((spectra.frequency >= lowest) & (spectra.frequency <= highest)).sum())
    if n_lines < _FEWEST_LINES:
        place, wanted = f"{spectra.names[0]} between {lowest:g} and {highest:g} Hz", f"{_FEWEST_LINES} lines or more"
        raise InputError(Fault(place, wanted, str(n_lines), "--lowest and --highest look elsewhere"))
    sets = agreeing(spectra, lowest, highest)
    searched = [_searched(spectra.only(records), lowest, highest) for records in sets]
    paths = tuple(path for _, own in searched for path in own)
    peaks, remarks = searched[0][0], tuple[str, ...]()
    if len(sets) > 1:
        shown = [[one for one in own if one.verdict.part_of < 0 or one.is_likely] for own, _ in searched]
        across = modes_across(spectra, sets, shown)
        spectra, remarks = across.spectra, across.remarks
        both = zip(judged(spectra, across.modes), across.spurious, strict=True)
        peaks = [replace(one, verdict=_at_least(one.verdict, spurious)) for one, spurious in both]
    peaks = sorted(peaks, key=lambda peak: peak.mode.frequency)
    strongest = max((peak.answer.strength for peak in peaks if peak.is_likely), default=1.0)
    rows = tuple(_row(peak, strongest) for peak in peaks)
    return Picked(rows, tuple(peak.answer for peak in peaks), spectra, paths, lowest, highest, remarks)


def whole_peaks(verdicts: Sequence[Verdict]) -> dict[int, int]:
    """Numbers of those modes that are rather parts than modes, each with the number of that which it is a part of.

    What is a part of a part is not among them: beside the whole peak it may be a mode.
    """
    part_of = {m: one.part_of for m, one in enumerate(verdicts) if one.spurious > 0.5}
    return {m: of for m, of in part_of.items() if of >= 0 and part_of.get(of, -1) < 0}


def _searched(spectra: Spectra, lowest: float, highest: float) -> tuple[list[Peak], list[Path]]:
    """Peaks of records that show the same modes, parts of peaks included, and the paths of the search."""
    below, above = max(lowest - _BEYOND, min(lowest, LOWEST)), min(highest + _BEYOND, float(spectra.frequency[-1]))
    by_width, paths = find_modes(spectra, below, above)
    modes = fit_modes(spectra, joined(by_width, spectra.spacing), by_width, lowest, highest)
    kept, parts = _without_parts(spectra, modes, by_width, (lowest, highest))
    return [*kept, *parts], paths


def _without_parts(
    spectra: Spectra, modes: Sequence[Mode], by_width: list[Floats], band: tuple[float, float]
) -> tuple[list[Peak], list[Peak]]:
    """Modes fitted again without those that are rather parts of the peaks of others than modes; and those parts.

    Parts are left out once and not again: where a peak is not simple in earnest, its modes come out right only beside
    something that takes up the rest.
    """
    from scipy.optimize import linear_sum_assignment

    before = judged(spectra, modes)
    leaving = whole_peaks([one.verdict for one in before])
    kept = {m: one for m, one in enumerate(before) if m not in leaving}
    beside = [m for m in kept if any(_overlap(modes[m], modes[k]) for k in leaving)]
    if beside:
        left = list(kept)
        start = np.array([modes[m].pole for m in left])
        again = judged(spectra, fit_modes(spectra, start, by_width, *band))
        apart = np.abs(start[:, :1] - [one.mode.frequency for one in again]) / start[:, 1:]
        for i, new in zip(*linear_sum_assignment(np.minimum(apart, _SAME)), strict=True):
            if left[i] in beside and apart[i, new] < _SAME:
                parts = [before[k] for k, of in leaving.items() if of == left[i]]
                kept[left[i]] = _whole(again[new], before[left[i]], parts)
    words = {k: part_words(kept[of].pole[0]) for k, of in leaving.items()}
    return [*kept.values()], [replace(before[k], verdict=before[k].verdict._replace(kind=words[k])) for k in leaving]


def _overlap(one: Mode, other: Mode) -> bool:
    """Whether two modes lie within their widths of each other."""
    return abs(one.frequency - other.frequency) < one.decay + other.decay


def _whole(now: Peak, before: Peak, parts: Sequence[Peak]) -> Peak:
    """A peak after parts of it were left out, with what it was before: that of the mode and the parts nearest to it."""
    if not parts:
        return now
    every = (one.mode for one in (before, *parts))
    other = min(every, key=lambda one: abs(one.frequency - now.mode.frequency))
    return replace(now, other=other, doubt=max(one.verdict.spurious for one in parts))


def _at_least(verdict: Verdict, spurious: float) -> Verdict:
    """A verdict of no less doubt."""
    kind = verdict.kind or "faint" * (spurious > 0.5)
    return verdict._replace(spurious=max(verdict.spurious, spurious), kind=kind)


def _row(peak: Peak, strongest: float) -> PickedRow:
    """A mode averaged over two fits: with a part of its peak as a mode, and without."""
    mode = peak.mode
    frequency, decay = (float(one) for one in peak.pole)
    window = np.hypot(mode.window, peak.split)
    sd, decay_sd = (float(one) for one in np.sqrt(mode.noise**2 + mode.scatter**2 + window**2))
    return PickedRow(
        hz=frequency,
        sd_hz=sd,
        noise_hz=float(mode.noise[0]),
        scatter_hz=float(mode.scatter[0]),
        window_hz=float(window[0]),
        damping_percent=100.0 * decay / frequency,
        damping_sd_percent=100.0 * decay_sd / frequency,
        sign="",
        amplitude=peak.answer.strength / strongest,
        spurious_probability=peak.verdict.spurious,
        kind=peak.verdict.kind,
        seen=mode.seen,
        alike=peak.answer.alike,
    )
