"""From spectra of decays to picked modes: frequency, damping and residues, each with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.across import average_modes
from bayesplate.recordings.agreement import agreeing_records
from bayesplate.recordings.contract import PickedRow
from bayesplate.recordings.modes_found import Mode, StabilityPath, find_modes, fit_modes, merge_modes
from bayesplate.recordings.plausibility import JudgedMode, ModeVerdict, judge_modes, part_words
from bayesplate.recordings.spectra import Spectra
from bayesplate.recordings.strength import ModeMobility

LOWEST, HIGHEST = 20.0, 1000.0
"""Default band in Hz in which modes are searched."""
_MARGIN = 100.0
"""Hz below and above the band in which modes are searched too: their tails reach into the band."""
_FEWEST_LINES = 5
_MATCH_REACH = 3.0
"""Decay rates within which a mode is taken for the same in a fit without the parts of its peak."""


@dataclass(frozen=True, eq=False)
class PickedModes:
    # in the order of frequency, without signs and labels, including peaks that are likely no mode
    peaks: tuple[PickedRow, ...]
    mobilities: tuple[ModeMobility, ...]
    spectra: Spectra
    paths: tuple[StabilityPath, ...]  # of the search, for the diagram of stability
    lowest: float
    highest: float
    remarks: tuple[str, ...] = ()  # on recordings whose modes differ

    @property
    def likely(self) -> tuple[PickedRow, ...]:
        return tuple(peak for peak in self.peaks if peak.is_likely)

    @property
    def likely_mobilities(self) -> tuple[ModeMobility, ...]:
        return tuple(mobility for mobility, peak in zip(self.mobilities, self.peaks, strict=True) if peak.is_likely)

    def sign(self, mobility: ModeMobility, flips: bool | None) -> str:
        """Sign of a residue; empty without a force, else as of `ModeMobility.sign`."""
        return "" if self.spectra.force is None else mobility.sign(flips)


def pick_modes(spectra: Spectra, lowest: float = LOWEST, highest: float = HIGHEST) -> PickedModes:
    """Modes between two frequencies in Hz.

    Refused where the spectra have hardly a line between the two, as frequency responses that end below, and where most
    recordings have no modes in common.
    """
    n_lines = int(((spectra.frequency >= lowest) & (spectra.frequency <= highest)).sum())
    if n_lines < _FEWEST_LINES:
        place = f"{spectra.file_names[0]} between {lowest:g} and {highest:g} Hz"
        remedy = "--lowest and --highest look elsewhere"
        raise InputError(Fault(place, f"{_FEWEST_LINES} lines or more", str(n_lines), remedy))
    sets = agreeing_records(spectra, lowest, highest)
    searched = [_search_records(spectra.of_records(records), lowest, highest) for records in sets]
    paths = tuple(path for _, set_paths in searched for path in set_paths)
    peaks, remarks = searched[0][0], tuple[str, ...]()
    if len(sets) > 1:
        peak_sets = [[peak for peak in group if peak.verdict.part_of < 0 or peak.is_likely] for group, _ in searched]
        averaged = average_modes(spectra, sets, peak_sets)
        spectra, remarks = averaged.spectra, averaged.remarks
        pairs = zip(judge_modes(spectra, averaged.modes), averaged.spurious, strict=True)
        peaks = [replace(peak, verdict=_raise_doubt(peak.verdict, spurious)) for peak, spurious in pairs]
    peaks = sorted(peaks, key=lambda peak: peak.mode.frequency)
    strongest = max((peak.mobility.strength for peak in peaks if peak.is_likely), default=1.0)
    rows = tuple(_picked_row(peak, strongest) for peak in peaks)
    return PickedModes(rows, tuple(peak.mobility for peak in peaks), spectra, paths, lowest, highest, remarks)


def parts_of_peaks(verdicts: Sequence[ModeVerdict]) -> dict[int, int]:
    """Numbers of the modes that are likely parts of a peak, each with the number of the mode whose peak that is.

    A part of a part is not among them: beside the whole peak it may be a mode.
    """
    part_of = {m: verdict.part_of for m, verdict in enumerate(verdicts) if verdict.spurious > 0.5}
    return {m: peak for m, peak in part_of.items() if peak >= 0 and part_of.get(peak, -1) < 0}


def _search_records(spectra: Spectra, lowest: float, highest: float) -> tuple[list[JudgedMode], list[StabilityPath]]:
    """Peaks of records that show the same modes, parts of peaks included, and the paths of the search."""
    below, above = max(lowest - _MARGIN, min(lowest, LOWEST)), min(highest + _MARGIN, float(spectra.frequency[-1]))
    by_width, paths = find_modes(spectra, below, above)
    modes = fit_modes(spectra, merge_modes(by_width, spectra.spacing), by_width, lowest, highest)
    peaks, parts = _fit_without_parts(spectra, modes, by_width, (lowest, highest))
    return [*peaks, *parts], paths


def _fit_without_parts(
    spectra: Spectra, modes: Sequence[Mode], by_width: list[Floats], band: tuple[float, float]
) -> tuple[list[JudgedMode], list[JudgedMode]]:
    """Modes fitted again without those that are likely parts of the peaks of others; and those parts.

    Parts are left out once only: where a peak is really not simple, its modes come out right only if another mode takes
    up the residual.
    """
    from scipy.optimize import linear_sum_assignment

    judged = judge_modes(spectra, modes)
    part_of = parts_of_peaks([peak.verdict for peak in judged])
    peaks = {m: peak for m, peak in enumerate(judged) if m not in part_of}
    neighbours = [m for m in peaks if any(_overlap(modes[m], modes[k]) for k in part_of)]
    if neighbours:
        kept_modes = list(peaks)
        start = np.array([modes[m].pole for m in kept_modes])
        refitted = judge_modes(spectra, fit_modes(spectra, start, by_width, *band))
        distances = np.abs(start[:, :1] - [peak.mode.frequency for peak in refitted]) / start[:, 1:]
        for i, j in zip(*linear_sum_assignment(np.minimum(distances, _MATCH_REACH)), strict=True):
            if kept_modes[i] in neighbours and distances[i, j] < _MATCH_REACH:
                parts = [judged[k] for k, whole in part_of.items() if whole == kept_modes[i]]
                peaks[kept_modes[i]] = _peak_without_parts(refitted[j], judged[kept_modes[i]], parts)
    words = {k: part_words(peaks[whole].pole[0]) for k, whole in part_of.items()}
    return [*peaks.values()], [replace(judged[k], verdict=judged[k].verdict._replace(kind=words[k])) for k in part_of]


def _overlap(mode: Mode, other: Mode) -> bool:
    """Whether two modes lie within their widths of each other."""
    return abs(mode.frequency - other.frequency) < mode.decay + other.decay


def _peak_without_parts(refitted: JudgedMode, fitted: JudgedMode, parts: Sequence[JudgedMode]) -> JudgedMode:
    """A peak refitted without its parts; `other_fit` becomes the nearest mode or part of the first fit."""
    if not parts:
        return refitted
    modes = (peak.mode for peak in (fitted, *parts))
    nearest = min(modes, key=lambda mode: abs(mode.frequency - refitted.mode.frequency))
    return replace(refitted, other_fit=nearest, doubt=max(part.verdict.spurious for part in parts))


def _raise_doubt(verdict: ModeVerdict, spurious: float) -> ModeVerdict:
    """A verdict with at least this probability of a spurious mode."""
    kind = verdict.kind or "faint" * (spurious > 0.5)
    return verdict._replace(spurious=max(verdict.spurious, spurious), kind=kind)


def _picked_row(peak: JudgedMode, strongest: float) -> PickedRow:
    """The row of a mode averaged over two fits: with a part of its peak as another mode, and without."""
    mode = peak.mode
    frequency, decay = (float(value) for value in peak.pole)
    window = np.hypot(mode.window, peak.split)
    sd, decay_sd = (float(value) for value in np.sqrt(mode.noise**2 + mode.scatter**2 + window**2))
    return PickedRow(
        hz=frequency,
        sd_hz=sd,
        noise_hz=float(mode.noise[0]),
        scatter_hz=float(mode.scatter[0]),
        window_hz=float(window[0]),
        damping_percent=100.0 * decay / frequency,
        damping_sd_percent=100.0 * decay_sd / frequency,
        sign="",
        amplitude=peak.mobility.strength / strongest,
        spurious_probability=peak.verdict.spurious,
        kind=peak.verdict.kind,
        seen=mode.seen,
        alike=peak.mobility.alike,
    )
