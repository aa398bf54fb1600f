"""Modes of recordings that differ: the modes of each recording by itself are matched and averaged.

A board that was laid down anew, held elsewhere, or that carries its sensor at another place has the same modes at
slightly different frequencies, mostly all higher or all lower. So all frequencies of a recording are first shifted onto
those of a reference recording, then its modes are matched one to one. The mean of a mode over recordings has the error
of a random effect: recordings scatter by more than their own errors, and a mode that few of them show is given the
scatter of the other modes.

Reference
---------
DerSimonian and Laird, Meta-analysis in clinical trials, Controlled Clinical Trials 7, 1986.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.modes_found import Mode
from bayesplate.recordings.plausibility import JudgedMode
from bayesplate.recordings.spectra import Spectra

MatchedPeaks = dict[int, JudgedMode]
"""The peaks of one mode, by the number of the set of records that shows them."""

_OFFSETS = np.arange(-0.05, 0.0501, 5e-4)
"""Common relative shifts of all frequencies of a recording that are tried."""
_NEAR_SHIFT, _SAME_SHIFT, _LEAST_SHIFT = 3e-3, 9e-3, 5e-4
"""Relative differences of two modes after the common shift: at which they count half as a match, up to which they tell
the usual difference, and the least that this is taken for."""
_USUAL_SHARE, _REACH, _DAMPING_REACH = 0.8, 4.0, 0.7
"""Quantile of the differences that is the usual one; two modes are matched up to this many times the usual difference,
and this share of the damping ratio, apart."""
_FEWEST_MODES, _MOST_REFERENCES = 3, 5
"""Likely modes by which a recording can be judged, and how many of the recordings with most modes are tried as the
reference."""
_ONE_BOARD_SHIFT = 0.02
"""Difference in frequency up to which one board may change from day to day, with the air or where it is held."""
_NOTED_SHIFT = 1e-3
"""Relative difference of a recording from the others from which on a remark names it."""
_MOST_NAMED = 4
_OTHERS_WEIGHT = 2.0
"""Degrees of freedom for which the common scatter of all modes counts beside the scatter of a single mode."""


class AveragedModes(NamedTuple):
    """Modes of several sets of records, and the spectra without recordings that have other modes than the rest."""

    modes: list[Mode]
    spurious: list[float]
    """Of each mode: the probability that it is none, in the set of records that shows it best."""
    spectra: Spectra
    remarks: tuple[str, ...]


def average_modes(
    spectra: Spectra, sets: Sequence[Indices], judged_modes: Sequence[Sequence[JudgedMode]]
) -> AveragedModes:
    """Modes of all records from the peaks that each set of records shows by itself.

    Refused where half of the recordings or more have other modes than the rest.
    """
    names = [_set_name(spectra, records) for records in sets]
    hertz = [np.array([peak.pole[0] for peak in peaks if peak.is_likely]) for peaks in judged_modes]
    first, offsets, n_common = _best_reference(hertz)
    strange_sets = [
        k
        for k, frequencies in enumerate(hertz)
        if frequencies.size >= _FEWEST_MODES and 2 * n_common[k] < frequencies.size
    ]
    reasons = {k: f"{n_common[k]} of {hertz[k].size} modes are those of {names[first]}" for k in strange_sets}
    if 2 * len(strange_sets) >= len(sets):
        raise InputError(
            [Fault(names[k], "a recording of the same board", reasons[k], "pick it apart") for k in strange_sets]
        )
    kept_sets = [k for k in range(len(sets)) if k not in strange_sets]
    groups = _match_peaks([judged_modes[k] for k in kept_sets], [offsets[k] for k in kept_sets], kept_sets.index(first))
    kept_spectra = spectra.of_records(np.concatenate([sets[k] for k in kept_sets]))
    modes = _average_groups(kept_spectra, groups, [sets[k].size for k in kept_sets])
    remarks = [f"{names[k]} left out: {reasons[k]} (is it of the same board?)" for k in strange_sets]
    are_hits = not all(_is_whole_file(spectra, sets[k]) for k in kept_sets)
    n_left_out = spectra.n_records - sum(records.size for records in sets)
    searched = f"each of the {len(sets)} clearest" if n_left_out else "each"
    noun = "hits" if are_hits else "recordings"
    remarks.append(_difference_remark([names[k] for k in kept_sets], groups, noun, searched))
    spurious = [min(peak.verdict.spurious for peak in group.values()) for group in groups]
    return AveragedModes(modes, spurious, kept_spectra, tuple(remarks))


def _set_name(spectra: Spectra, records: Indices) -> str:
    """Name of a set of records: the file if the set is all of it, else the hit."""
    name, hit = spectra.file_names[records[0]], spectra.hits[records[0]]
    return name if _is_whole_file(spectra, records) else f"{name} hit {hit}"


def _is_whole_file(spectra: Spectra, records: Indices) -> bool:
    return records.size == np.sum(spectra.files == spectra.files[records[0]])


def _best_reference(hertz: Sequence[Floats]) -> tuple[int, list[float], list[int]]:
    """The reference that shares most modes with the others; relative offset of each recording, and modes in common."""
    fullest = sorted(range(len(hertz)), key=lambda k: -hertz[k].size)[:_MOST_REFERENCES]
    trials = [(k, [_relative_offset(frequencies, hertz[k]) for frequencies in hertz]) for k in fullest]
    first, matches = max(trials, key=lambda trial: sum(common for _, common in trial[1]))
    return first, [offset for offset, _ in matches], [common for _, common in matches]


def _relative_offset(hertz: Floats, reference: Floats) -> tuple[float, int]:
    """Common relative offset of a recording's modes from the reference, and how many are then modes of both."""
    if not hertz.size or not reference.size:
        return 0.0, 0
    differences = np.abs(np.log(hertz)[None, :, None] - _OFFSETS[:, None, None] - np.log(reference)).min(axis=2)
    likeness = np.sum(np.exp(-np.log(2.0) * (differences / _NEAR_SHIFT) ** 2), axis=1) - np.abs(_OFFSETS)
    best = int(np.argmax(likeness))
    return float(_OFFSETS[best]), int(np.sum(differences[best] < 2.0 * _NEAR_SHIFT))


def _match_peaks(
    peaks_by_set: Sequence[Sequence[JudgedMode]], offsets: Sequence[float], reference: int
) -> list[MatchedPeaks]:
    """The peaks of all sets in groups, one for each mode, in the order of frequency."""
    from scipy.optimize import linear_sum_assignment

    groups: list[MatchedPeaks] = [{reference: peak} for peak in peaks_by_set[reference]]
    for k, peaks in enumerate(peaks_by_set):
        if k == reference or not peaks:
            continue
        if not groups:
            groups = [{k: peak} for peak in peaks]
            continue
        logs = np.log([peak.pole[0] for peak in peaks]) - offsets[k]
        group_logs = np.array(
            [np.mean([np.log(peak.pole[0]) - offsets[i] for i, peak in group.items()]) for group in groups]
        )
        distances = np.abs(logs[:, None] - group_logs)
        nearest = distances.min(axis=1)[[peak.is_likely for peak in peaks]]
        close = nearest[nearest < _SAME_SHIFT]
        usual = max(float(np.quantile(close, _USUAL_SHARE)) if close.size else 0.0, _LEAST_SHIFT)
        reach = _REACH * usual + _DAMPING_REACH * np.array([peak.pole[1] / peak.pole[0] for peak in peaks])
        pairs = zip(*linear_sum_assignment(np.minimum(distances / reach[:, None], 1.0)), strict=True)
        group_of_row = {row: column for row, column in pairs if distances[row, column] < reach[row]}
        for row, peak in enumerate(peaks):
            if row in group_of_row:
                groups[group_of_row[row]][k] = peak
            else:
                groups.append({k: peak})
    return sorted(groups, key=lambda group: float(np.mean([peak.pole[0] for peak in group.values()])))


def _average_groups(spectra: Spectra, groups: Sequence[MatchedPeaks], sizes: Sequence[int]) -> list[Mode]:
    """Each group as a mode of all records: hits are averaged within each file, then files."""
    ends = np.cumsum(sizes)
    files = spectra.files[ends - 1]
    by_file = [
        [[_pole_estimate(peak) for k, peak in group.items() if files[k] == file] for file in np.unique(files)]
        for group in groups
    ]
    within = _common_variance([estimates for mode_files in by_file for estimates in mode_files])
    means = [[_weighted_mean(estimates, within) for estimates in mode_files if estimates] for mode_files in by_file]
    among = _common_variance(means)
    modes = []
    for group, file_means in zip(groups, means, strict=True):
        logs, noise, window, total = _weighted_mean(file_means, among)
        pole = np.exp(logs)
        residues, residue_sd = np.zeros(ends[-1], dtype=complex), spectra.noise * pole[1]
        for k, peak in group.items():
            residues[ends[k] - sizes[k] : ends[k]] = peak.mode.residues
            residue_sd[ends[k] - sizes[k] : ends[k]] = peak.mode.residue_sd
        modes.append(
            Mode(
                frequency=float(pole[0]),
                decay=float(pole[1]),
                noise=pole * np.sqrt(noise),
                scatter=pole * np.sqrt(np.maximum(total - noise - window, 0.0)),
                window=pole * np.sqrt(window),
                residues=residues,
                residue_sd=residue_sd,
                expected=len(sizes) * min(peak.mode.expected for peak in group.values()),
                seen=sum(peak.mode.seen for peak in group.values()) / len(sizes),
            )
        )
    return modes


def _pole_estimate(peak: JudgedMode) -> Floats:
    """Logarithms of frequency and decay rate; their variances by noise, by choice of lines, in all: (4, 2) array."""
    noise, window = peak.mode.noise**2, peak.mode.window**2 + peak.split**2
    scale = peak.pole**-2
    return np.stack([np.log(peak.pole), noise * scale, window * scale, (noise + window + peak.mode.scatter**2) * scale])


def _excess_variance(estimates: Sequence[Floats]) -> Floats:
    """Variance between estimates beyond their own: (2,) array."""
    stacked = np.array(estimates)
    return np.maximum(np.var(stacked[:, 0], axis=0, ddof=1) - stacked[:, 3].mean(axis=0), 0.0)


def _common_variance(estimates_by_mode: Sequence[Sequence[Floats]]) -> Floats:
    """Variance between estimates beyond their own, averaged over all modes that have several: (2,) array."""
    scatters = [
        (len(estimates) - 1.0, _excess_variance(estimates)) for estimates in estimates_by_mode if len(estimates) > 1
    ]
    total = sum(n_free for n_free, _ in scatters)
    return np.asarray(sum(n_free * excess for n_free, excess in scatters) / total) if scatters else np.zeros(2)


def _weighted_mean(estimates: Sequence[Floats], common: Floats) -> Floats:
    """The mean of estimates with its variances, their scatter included: (4, 2) array."""
    stacked, n_free = np.array(estimates), len(estimates) - 1.0
    own_excess = _excess_variance(estimates) if n_free else np.zeros(2)
    weights = 1.0 / (
        stacked[:, 3] + (_OTHERS_WEIGHT * common + n_free * own_excess) / (_OTHERS_WEIGHT + n_free) + 1e-300
    )
    total = weights.sum(axis=0)
    shares = weights / total
    sums = [np.sum(shares * stacked[:, 0], axis=0), *(np.sum(shares**2 * stacked[:, k], axis=0) for k in (1, 2))]
    return np.stack([*sums, 1.0 / total])


def _difference_remark(names: Sequence[str], groups: Sequence[MatchedPeaks], noun: str, searched: str) -> str:
    """The remark on hits or recordings that differ."""
    differences = []
    for k, name in enumerate(names):
        shifts = [
            np.log(group[k].pole[0]) - np.mean([np.log(peak.pole[0]) for i, peak in group.items() if i != k])
            for group in groups
            if k in group and len(group) > 1 and group[k].is_likely
        ]
        if shifts and abs(shift := float(np.median(shifts))) > _NOTED_SHIFT:
            differences.append(
                (abs(shift), f"{name} {100.0 * abs(shift):.2g} % {'higher' if shift > 0.0 else 'lower'}")
            )
    largest = [words for _, words in sorted(differences, reverse=True)[: 1 if len(names) == 2 else _MOST_NAMED]]
    rest = "the other" if len(names) == 2 else "the others"
    little = "in damping, or by less than 0.1 % in frequency"
    clause = f"in frequency ({', '.join(largest)} than {rest})" if largest else little
    question = (
        "; are they of one board, held and loaded alike?"
        if max(differences, default=(0.0, ""))[0] > _ONE_BOARD_SHIFT
        else ""
    )
    return (
        f"the {noun} differ {clause}: {searched} was searched by itself, and the errors hold by what a mode "
        f"scatters{question}"
    )
