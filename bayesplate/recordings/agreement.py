"""Whether records show the same modes: the scatter of the poles of their strongest peaks, each record by itself.

Two recordings of one board differ where it was laid down anew, held elsewhere, or where a sensor was moved: its modes
lie a little elsewhere, or are damped otherwise. A fit of modes that all records have in common then needs several for
each. So records that differ are searched apart.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayesplate.arrays import Bools, Complex, Floats
from bayesplate.recordings.local_fit import STEADY, Window, refined
from bayesplate.recordings.spectra import Rows, Spectra

_MOST_PEAKS, _FEWEST, _MOST_RECORDS = 12, 2, 8
_PROMINENCE = 12.0
"""dB by which a peak stands out of the mean of all records."""
_REACH, _LEAST_LINES, _WIDEST = 6.0, 7, 0.03
"""Widths of a peak on either side of it that are fitted, lines at least, and share of its frequency at most."""
_SURE, _SIMPLE = 0.02, 0.1
"""Error of a pole over its decay rate, and what a fit leaves over the highest line, of records that tell."""
_ALIKE = 0.025
"""Root mean square of poles over their decay rates up to which records have the same modes."""


def agreeing(spectra: Spectra, lowest: float, highest: float) -> list[Rows]:
    """Sets of records that show the same modes, by their peaks between two frequencies.

    They are all records, those of each file, or the clearest, each by itself.
    """
    every = np.arange(spectra.files.size)
    squares = np.array([_squares(*one) for one in _poles(spectra, lowest, highest)]).reshape(-1, 2)
    within, among = (_middle(column) for column in squares.T)
    if within > _ALIKE**2:
        return [np.array([r]) for r in _clearest(spectra)]
    if (spectra.files == spectra.files[0]).all():
        return [every]
    n_common = np.isfinite(squares[:, 1]).sum()
    have_few_in_common = n_common < _FEWEST <= len(squares) - n_common
    if among <= _ALIKE**2 and not have_few_in_common:
        return [every]
    return [every[spectra.files == file] for file in np.unique(spectra.files)]


def _clearest(spectra: Spectra) -> Rows:
    """The records of each file that stand highest above their noise, as many as can be searched one by one."""
    clear = np.sum(np.abs(spectra.values / spectra.noise) ** 2, axis=0)
    files = np.unique(spectra.files)
    most = max(_MOST_RECORDS // files.size, _FEWEST)
    own = [np.flatnonzero(spectra.files == file) for file in files]
    return np.concatenate([np.sort(one[np.argsort(-clear[one], kind="stable")[:most]]) for one in own])


def _middle(squares: Floats) -> float:
    """Median over the peaks, so that one peak of two modes counts little; 0 where few peaks tell."""
    known = np.sort(squares[np.isfinite(squares)])
    return float(known[(known.size - 1) // 2]) if known.size >= _FEWEST else 0.0


def _poles(spectra: Spectra, lowest: float, highest: float) -> Iterator[tuple[Floats, Floats, Rows]]:
    """For each strong peak the (n, 2) poles of the records that show it, over its decay rate; variances; files."""
    from scipy.signal import find_peaks, peak_widths

    values = spectra.values / spectra.noise
    inside = np.flatnonzero((spectra.frequency >= lowest) & (spectra.frequency <= highest))
    level = np.abs(values[inside]) ** 2
    decibels = 10.0 * np.log10(np.mean(level / level.mean(axis=0), axis=1))
    peaks, _ = find_peaks(decibels, prominence=_PROMINENCE)
    peaks = peaks[np.argsort(decibels[peaks])[::-1][:_MOST_PEAKS]]
    spacing = spectra.spacing
    power = 10.0 ** (decibels / 10.0)
    for peak, width in zip(peaks, peak_widths(power, peaks, 0.5)[0], strict=True):
        hertz, half = float(spectra.frequency[inside[peak]]), 0.5 * float(width) * spacing
        reach = max(min(_REACH * half, _WIDEST * hertz), _LEAST_LINES * spacing)
        near = np.abs(spectra.frequency - hertz) <= reach
        found = [_pole(spectra, values[near, r], near, np.array([[hertz, half]])) for r in range(values.shape[1])]
        told = np.array([one is not None for one in found])
        if told.any():
            poles, variances = (np.array([one[k] for one in found if one is not None]) for k in (0, 1))
            decay = float(np.median(poles[:, 1]))
            yield poles / decay, variances / decay**2, spectra.files[told]


def _pole(spectra: Spectra, values: Complex, near: Bools, start: Floats) -> tuple[Floats, Floats] | None:
    """Frequency and decay rate of a record's only mode near a peak, and their variances; None if that tells little."""
    fit = refined(Window(spectra.frequency[near], values[:, None], np.zeros((0, 2))), start)
    ((_, decay),) = fit.poles
    variances = np.diagonal(np.linalg.pinv(fit.information()[1][0], hermitian=True))
    is_simple = np.sqrt(np.mean(np.abs(fit.rest) ** 2)) < _SIMPLE * np.abs(values).max()
    is_sure = 0.0 < variances.max() < (_SURE * decay) ** 2
    rings = decay * spectra.duration > STEADY
    return (fit.poles[0], variances) if is_simple and is_sure and rings else None


def _squares(poles: Floats, variances: Floats, files: Rows) -> tuple[float, float]:
    """Mean squares by which poles scatter beyond their errors: within files, and among several; NaN where none can."""
    _, own, counts = np.unique(files, return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(own, poles[:, k]) / counts for k in (0, 1)], axis=1)
    error = float(variances.sum(axis=1).mean())
    spare = poles.shape[0] - counts.size
    within = float(np.sum((poles - means[own]) ** 2)) / spare - error if spare else np.nan
    among = float(np.sum(np.var(poles, axis=0, ddof=1))) - error if counts.size > 1 else np.nan
    return within, among
