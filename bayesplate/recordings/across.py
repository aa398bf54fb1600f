"""Modes of recordings that differ: what each shows by itself, matched, and averaged with its scatter.

A board that was laid down anew, held elsewhere, or that carries its sensor at another place has the same modes at
frequencies that differ a little, mostly all of them in the same sense. So each recording is first laid over one of them
as a whole, then its modes are matched one to one. The mean of a mode over recordings has the error of a random effect:
recordings scatter by more than their own errors, and a mode that few of them show has the scatter of the others.

Reference
---------
DerSimonian and Laird, Meta-analysis in clinical trials, Controlled Clinical Trials 7, 1986.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.modes_found import Mode
from bayesplate.recordings.plausibility import Peak
from bayesplate.recordings.spectra import Rows, Spectra

Group = dict[int, Peak]
"""One mode: from the number of a set of records to the peak that it shows of it."""

_OFFSETS = np.arange(-0.05, 0.0501, 5e-4)
"""Relative differences of two recordings as a whole that are tried."""
_NEAR, _SAME, _LEAST = 3e-3, 9e-3, 5e-4
"""Relative differences of two modes beyond it: which half speaks for it, up to which they show what is usual
and which may always be."""
_MOSTLY, _REACH, _OF_DAMPING = 0.8, 4.0, 0.7
"""Share of the modes of which the differences are usual, how many times those, and how much of the damping ratio two
modes may differ by that are matched."""
_FEWEST, _CANDIDATES = 3, 5
"""How many likely modes tell of a recording, and how many of the fullest recordings are tried as the one over which the
others are laid."""
_OF_ONE_BOARD = 0.02
"""Difference in frequency up to which one board may change from day to day, with the air or where it is held."""
_NOTED = 1e-3
"""Relative difference of a recording from the others from which on it is told."""
_MOST_NAMED = 4
_OTHERS = 2.0
"""Modes of its own as which the scatter of all others counts for that of one mode."""


class Across(NamedTuple):
    """Modes of several sets of records, and the spectra without recordings that have other modes than all others."""

    modes: list[Mode]
    spurious: list[float]
    """Probability that it is no mode in the set that shows it best."""
    spectra: Spectra
    remarks: tuple[str, ...]


def modes_across(spectra: Spectra, sets: Sequence[Rows], shown: Sequence[Sequence[Peak]]) -> Across:
    """Modes of all records from the peaks that each set of records shows by itself.

    Refused where half of the recordings or more have other modes than the rest.
    """
    names = [_name(spectra, records) for records in sets]
    hertz = [np.array([peak.pole[0] for peak in own if peak.is_likely]) for own in shown]
    first, offsets, shares = _laid_over(hertz)
    strange = [k for k, own in enumerate(hertz) if own.size >= _FEWEST and 2 * shares[k] < own.size]
    told = {k: f"{shares[k]} of {hertz[k].size} modes are those of {names[first]}" for k in strange}
    if 2 * len(strange) >= len(sets):
        raise InputError([Fault(names[k], "a recording of the same board", told[k], "pick it apart") for k in strange])
    kept = [k for k in range(len(sets)) if k not in strange]
    groups = _matched([shown[k] for k in kept], [offsets[k] for k in kept], kept.index(first))
    own = spectra.only(np.concatenate([sets[k] for k in kept]))
    modes = _averaged(own, groups, [sets[k].size for k in kept])
    remarks = [f"{names[k]} left out: {told[k]} (is it of the same board?)" for k in strange]
    remarks.append(_differences([names[k] for k in kept], groups, spectra.files.size))
    least = [min(peak.verdict.spurious for peak in group.values()) for group in groups]
    return Across(modes, least, own, tuple(remarks))


def _name(spectra: Spectra, records: Rows) -> str:
    """Name of a set of records: the file if the set is all of it, else the hit."""
    name = spectra.names[records[0]]
    is_whole = records.size == np.sum(spectra.files == spectra.files[records[0]])
    return name.rpartition(" hit ")[0] or name if is_whole else name


def _laid_over(hertz: Sequence[Floats]) -> tuple[int, list[float], list[int]]:
    """The recording over which the others are best laid, by what (relative), and how many modes of each it has."""
    fullest = sorted(range(len(hertz)), key=lambda k: -hertz[k].size)[:_CANDIDATES]
    tried = [(k, [_offset(own, hertz[k]) for own in hertz]) for k in fullest]
    first, found = max(tried, key=lambda one: sum(common for _, common in one[1]))
    return first, [offset for offset, _ in found], [common for _, common in found]


def _offset(own: Floats, other: Floats) -> tuple[float, int]:
    """Relative offset of a recording's modes from another's as a whole, and how many are the other's then."""
    if not own.size or not other.size:
        return 0.0, 0
    off = np.abs(np.log(own)[None, :, None] - _OFFSETS[:, None, None] - np.log(other)).min(axis=2)
    likely = np.sum(np.exp(-np.log(2.0) * (off / _NEAR) ** 2), axis=1) - np.abs(_OFFSETS)
    best = int(np.argmax(likely))
    return float(_OFFSETS[best]), int(np.sum(off[best] < 2.0 * _NEAR))


def _matched(shown: Sequence[Sequence[Peak]], offsets: Sequence[float], first: int) -> list[Group]:
    """Groups of one mode each, in the order of frequency."""
    from scipy.optimize import linear_sum_assignment

    groups: list[Group] = [{first: one} for one in shown[first]]
    for k, own in enumerate(shown):
        if k == first or not own:
            continue
        logs = np.log([one.pole[0] for one in own]) - offsets[k]
        there = np.array([np.mean([np.log(one.pole[0]) - offsets[i] for i, one in g.items()]) for g in groups])
        off = np.abs(logs[:, None] - there)
        nearest = off.min(axis=1)[[one.is_likely for one in own]]
        known = nearest[nearest < _SAME]
        usual = max(float(np.quantile(known, _MOSTLY)) if known.size else 0.0, _LEAST)
        reach = _REACH * usual + _OF_DAMPING * np.array([one.pole[1] / one.pole[0] for one in own])
        pairs = zip(*linear_sum_assignment(np.minimum(off / reach[:, None], 1.0)), strict=True)
        of_row = {row: column for row, column in pairs if off[row, column] < reach[row]}
        for row, one in enumerate(own):
            if row in of_row:
                groups[of_row[row]][k] = one
            else:
                groups.append({k: one})
    return sorted(groups, key=lambda group: float(np.mean([one.pole[0] for one in group.values()])))


def _averaged(spectra: Spectra, groups: Sequence[Group], sizes: Sequence[int]) -> list[Mode]:
    """Each group as a mode of all records: hits are averaged within each file, then files."""
    ends = np.cumsum(sizes)
    files = spectra.files[ends - 1]
    by_file = [
        [[_part(one) for k, one in group.items() if files[k] == file] for file in np.unique(files)] for group in groups
    ]
    within = _common([own for each in by_file for own in each])
    means = [[_mean(own, within) for own in each if own] for each in by_file]
    among = _common(means)
    found = []
    for group, parts in zip(groups, means, strict=True):
        logs, noise, window, whole = _mean(parts, among)
        pole = np.exp(logs)
        residues, residue_sd = np.zeros(ends[-1], dtype=complex), spectra.noise * pole[1]
        for k, one in group.items():
            residues[ends[k] - sizes[k] : ends[k]] = one.mode.residues
            residue_sd[ends[k] - sizes[k] : ends[k]] = one.mode.residue_sd
        found.append(
            Mode(
                frequency=float(pole[0]),
                decay=float(pole[1]),
                noise=pole * np.sqrt(noise),
                scatter=pole * np.sqrt(np.maximum(whole - noise - window, 0.0)),
                window=pole * np.sqrt(window),
                residues=residues,
                residue_sd=residue_sd,
                expected=len(sizes) * min(one.mode.expected for one in group.values()),
                seen=sum(one.mode.seen for one in group.values()) / len(sizes),
            )
        )
    return found


def _part(one: Peak) -> Floats:
    """Logarithms of frequency and decay rate, and variances: by noise, by the choice of lines, whole. (4, 2) array."""
    noise, window = one.mode.noise**2, one.mode.window**2 + one.split**2
    scale = one.pole**-2
    return np.stack([np.log(one.pole), noise * scale, window * scale, (noise + window + one.mode.scatter**2) * scale])


def _excess(parts: Sequence[Floats]) -> Floats:
    """Variance between parts beyond their own: (2,) array."""
    every = np.array(parts)
    return np.maximum(np.var(every[:, 0], axis=0, ddof=1) - every[:, 3].mean(axis=0), 0.0)


def _common(several: Sequence[Sequence[Floats]]) -> Floats:
    """Variance between parts beyond their own, averaged over all modes that have several: (2,) array."""
    known = [(len(parts) - 1.0, _excess(parts)) for parts in several if len(parts) > 1]
    total = sum(spare for spare, _ in known)
    return np.asarray(sum(spare * excess for spare, excess in known) / total) if known else np.zeros(2)


def _mean(parts: Sequence[Floats], common: Floats) -> Floats:
    """The mean of parts with its variances, their scatter included: (4, 2) array."""
    every, spare = np.array(parts), len(parts) - 1.0
    own = _excess(parts) if spare else np.zeros(2)
    weights = 1.0 / (every[:, 3] + (_OTHERS * common + spare * own) / (_OTHERS + spare) + 1e-300)
    total = weights.sum(axis=0)
    shares = weights / total
    sums = [np.sum(shares * every[:, 0], axis=0), *(np.sum(shares**2 * every[:, k], axis=0) for k in (1, 2))]
    return np.stack([*sums, 1.0 / total])


def _differences(names: Sequence[str], groups: Sequence[Group], n_records: int) -> str:
    """What is told of recordings that differ."""
    told = []
    for k, name in enumerate(names):
        beside = [
            np.log(group[k].pole[0]) - np.mean([np.log(one.pole[0]) for i, one in group.items() if i != k])
            for group in groups
            if k in group and len(group) > 1 and group[k].is_likely
        ]
        if beside and abs(off := float(np.median(beside))) > _NOTED:
            told.append((abs(off), f"{name} {100.0 * abs(off):.2g} % {'higher' if off > 0.0 else 'lower'}"))
    most = [words for _, words in sorted(told, reverse=True)[: 1 if len(names) == 2 else _MOST_NAMED]]
    others = "the other" if len(names) == 2 else "the others"
    little = "in damping, or by less than 0.1 % in frequency"
    how = f"in frequency ({', '.join(most)} than {others})" if most else little
    are_hits = any(" hit " in name for name in names)
    which = f"each of the {len(names)} clearest" if are_hits and len(names) < n_records else "each"
    what = "hits" if are_hits else "recordings"
    ask = "; are they of one board, held and loaded alike?" if max(told, default=(0.0, ""))[0] > _OF_ONE_BOARD else ""
    return f"the {what} differ {how}: {which} was searched by itself, and the errors hold by what a mode scatters{ask}"
