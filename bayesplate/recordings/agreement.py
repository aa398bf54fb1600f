"""Whether records show the same modes: the scatter of the poles of their strongest peaks, fitted record by record.

Two recordings of one board differ where it was laid down anew, held elsewhere, or where a sensor was moved: its modes
have slightly different frequencies or damping. A common fit to all records would then need several modes for each of
them. So records that differ are searched separately.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayesplate.arrays import Bools, Complex, Floats, Indices
from bayesplate.recordings.local_fit import STEADY_DECAY, Window, refine_poles
from bayesplate.recordings.spectra import Spectra

_MOST_PEAKS, _FEWEST_PEAKS, _MOST_RECORDS = 12, 2, 8
_PROMINENCE = 12.0
"""dB by which a peak stands out of the mean of all records."""
_REACH, _LEAST_LINES, _WIDEST_REACH = 6.0, 7, 0.03
"""Widths of a peak on either side of it that are fitted, lines at least, and share of its frequency at most."""
_POLE_ERROR, _REST_SHARE = 0.02, 0.1
"""Largest error of a pole over its decay rate, and largest residual of its fit over the highest line, of the records
that are compared."""
_ALIKE_SCATTER = 0.025
"""Root mean square of poles over their decay rates up to which records have the same modes."""


def agreeing_records(spectra: Spectra, lowest: float, highest: float) -> list[Indices]:
    """Sets of records that show the same modes, by their peaks between two frequencies.

    Either one set of all records, one set for each file, or one set for each of the clearest records.
    """
    all_records = np.arange(spectra.files.size)
    squares = np.array([_pole_scatter(*peak) for peak in _peak_poles(spectra, lowest, highest)]).reshape(-1, 2)
    within, among = (_median_scatter(column) for column in squares.T)
    if within > _ALIKE_SCATTER**2:
        return [np.array([r]) for r in _clearest_records(spectra)]
    if (spectra.files == spectra.files[0]).all():
        return [all_records]
    n_common = np.isfinite(squares[:, 1]).sum()
    have_few_in_common = n_common < _FEWEST_PEAKS <= len(squares) - n_common
    if among <= _ALIKE_SCATTER**2 and not have_few_in_common:
        return [all_records]
    return [all_records[spectra.files == file] for file in np.unique(spectra.files)]


def _clearest_records(spectra: Spectra) -> Indices:
    """The records of each file that stand highest above their noise, as many as can be searched one by one."""
    snr = np.sum(np.abs(spectra.values / spectra.noise) ** 2, axis=0)
    files = np.unique(spectra.files)
    n_records = max(_MOST_RECORDS // files.size, _FEWEST_PEAKS)
    by_file = [np.flatnonzero(spectra.files == file) for file in files]
    return np.concatenate(
        [np.sort(records[np.argsort(-snr[records], kind="stable")[:n_records]]) for records in by_file]
    )


def _median_scatter(squares: Floats) -> float:
    """Median over the peaks, so that a single peak of two modes counts little; 0 where few peaks have a scatter."""
    finite = np.sort(squares[np.isfinite(squares)])
    return float(finite[(finite.size - 1) // 2]) if finite.size >= _FEWEST_PEAKS else 0.0


def _peak_poles(spectra: Spectra, lowest: float, highest: float) -> Iterator[tuple[Floats, Floats, Indices]]:
    """For each strong peak: (n, 2) poles of the records that show it, over its decay rate; their variances; files."""
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
        reach = max(min(_REACH * half, _WIDEST_REACH * hertz), _LEAST_LINES * spacing)
        near = np.abs(spectra.frequency - hertz) <= reach
        fits = [_fit_pole(spectra, values[near, r], near, np.array([[hertz, half]])) for r in range(values.shape[1])]
        is_fitted = np.array([fit is not None for fit in fits])
        if is_fitted.any():
            poles, variances = (np.array([fit[k] for fit in fits if fit is not None]) for k in (0, 1))
            decay = float(np.median(poles[:, 1]))
            yield poles / decay, variances / decay**2, spectra.files[is_fitted]


def _fit_pole(spectra: Spectra, values: Complex, near: Bools, start: Floats) -> tuple[Floats, Floats] | None:
    """Frequency and decay rate of a record's only mode near a peak, and their variances; None if the fit is poor."""
    fit = refine_poles(Window(spectra.frequency[near], values[:, None], np.zeros((0, 2))), start)
    ((_, decay),) = fit.poles
    variances = np.diagonal(np.linalg.pinv(fit.information()[1][0], hermitian=True))
    is_simple = np.sqrt(np.mean(np.abs(fit.residual) ** 2)) < _REST_SHARE * np.abs(values).max()
    is_sure = 0.0 < variances.max() < (_POLE_ERROR * decay) ** 2
    rings = decay * spectra.duration > STEADY_DECAY
    return (fit.poles[0], variances) if is_simple and is_sure and rings else None


def _pole_scatter(poles: Floats, variances: Floats, files: Indices) -> tuple[float, float]:
    """Variance of poles beyond their errors, within files and among files; NaN where there are too few records."""
    _, file_index, counts = np.unique(files, return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(file_index, poles[:, k]) / counts for k in (0, 1)], axis=1)
    error = float(variances.sum(axis=1).mean())
    n_free = poles.shape[0] - counts.size
    within = float(np.sum((poles - means[file_index]) ** 2)) / n_free - error if n_free else np.nan
    among = float(np.sum(np.var(poles, axis=0, ddof=1))) - error if counts.size > 1 else np.nan
    return within, among
