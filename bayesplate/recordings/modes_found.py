"""Modes of all records: searched in overlapping windows of two widths, then fitted to all records with their errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Complex, Floats, Indices
from bayesplate.recordings.local_fit import Window, WindowFit, refine_poles, search_modes
from bayesplate.recordings.spectra import Spectra

WIDTHS = (100.0, 60.0)
"""Widths in Hz of the windows in which modes are searched; the final fits have windows of the first width."""
_MARGIN = 40.0
"""Hz on either side of a window that are fitted too."""
_REACH = 150.0
"""Hz beyond a window up to which modes that were found are held fixed in its fit."""
_NOTED_SDS = 2.0
"""Standard errors from which on the difference of two windows is more than chance."""
_LEAST_LINES = 40
_MOST_RECORDS, _MOST_FITTED_RECORDS = 6, 10
"""Combinations of records in which modes are searched, and to which they are fitted before the last steps."""
_LAST_STEPS = 4
UNLIKE_SHARE, FLOOR_SHARE = 0.03, 0.01
"""In the search: share of a line, and of the window's highest line, that simple modes need not describe."""
_UNLIKE_SHARES = (0.0, 0.01, 0.03, 0.1)
_NOISE_MODES = 0.3
"""Expected number of modes that noise alone gives in a window, at which its search ends."""
_CELLS_A_LINE = 3.0
"""Independent trial modes for each line of a spectrum."""
_PRIOR_GROUPS = 8.0
"""Hits or places without excess scatter that count beside the recorded ones: the scatter of a few is uncertain."""
_BROADEST_DAMPING = 0.06
"""Damping ratio beyond which a fitted pole is no mode of a board but the background of the others."""


@dataclass(frozen=True, eq=False)
class Mode:
    """A fitted mode."""

    frequency: float
    decay: float  # Hz, half the width of the peak at half its power: damping ratio times frequency
    noise: Floats  # (2,), Hz: standard deviations of frequency and decay by noise, from the residuals of the fit
    scatter: Floats  # (2,), Hz: the same by scatter of hits, places and files beyond the noise
    window: Floats  # (2,), Hz: the same by the choice of lines
    residues: Complex  # (n_records,), in units of the spectra
    residue_sd: Floats
    expected: float  # expected number of modes in the band that noise alone would show as clearly
    seen: float  # share of the widths of windows in which it was found

    @property
    def pole(self) -> Floats:
        """Frequency and decay rate: (2,) array, Hz."""
        return np.array([self.frequency, self.decay])

    @property
    def damping(self) -> float:
        return self.decay / self.frequency


class StabilityPath(NamedTuple):
    """Frequencies in one window of a width in Hz, with one mode, two modes, and so on: the diagram of stability."""

    width: float
    orders: tuple[Floats, ...]


class _Band(NamedTuple):
    """A band of frequencies between two ends in Hz, and the window with margins in which its modes are fitted."""

    window: Window
    low: float
    high: float

    def poles_inside(self, poles: Floats) -> Floats:
        """The (n_modes, 2) poles between the ends of the band."""
        return poles[(poles[:, 0] >= self.low) & (poles[:, 0] < self.high)]


def find_modes(spectra: Spectra, lowest: float, highest: float) -> tuple[list[Floats], list[StabilityPath]]:
    """Modes between two frequencies by windows of each width, (n_modes, 2: Hz) arrays, and the paths of the search."""
    by_width: list[Floats] = []
    paths: list[StabilityPath] = []
    for width in WIDTHS:
        band_poles = []
        for band in _bands(spectra, lowest, highest, width):
            strongest = band.window.compressed(_MOST_RECORDS)
            search_window = replace(strongest, model_error=UNLIKE_SHARE, floor=FLOOR_SHARE, least_variance=1.0)
            orders = [band.poles_inside(poles) for poles in search_modes(search_window, _least_gain(band.window))]
            band_poles.append(orders[-1] if orders else np.zeros((0, 2)))
            paths.append(StabilityPath(width, tuple(np.sort(poles[:, 0]) for poles in orders)))
        by_width.append(np.concatenate(band_poles))
    return by_width, paths


def merge_modes(by_width: list[Floats], spacing: float) -> Floats:
    """Modes of windows of the first width, and those of the others that are not among them: (n_modes, 2) array, Hz."""
    merged = by_width[0]
    for poles in by_width[1:]:
        new_poles = [pole for pole in poles if not _contains_pole(merged, pole, spacing)]
        merged = np.concatenate([merged, np.reshape(new_poles, (-1, 2))])
    return merged[np.argsort(merged[:, 0])]


def fit_modes(spectra: Spectra, start: Floats, by_width: list[Floats], lowest: float, highest: float) -> list[Mode]:
    """Fit modes, from (n_modes, 2) starts in Hz, to all records at once, each in its window; in the order of frequency.

    Modes that noise alone would give are left out; `by_width` are the modes that windows of each width have shown.
    """
    n_lines = int(np.sum((spectra.frequency >= lowest) & (spectra.frequency < highest)))
    bands = _bands(spectra, lowest, highest, WIDTHS[0])
    modes = [mode for band in bands for mode in _fit_band(spectra, band, start, n_lines, by_width)]
    return sorted(modes, key=lambda mode: mode.frequency)


def _bands(spectra: Spectra, lowest: float, highest: float, width: float) -> Iterator[_Band]:
    """Adjoining bands of about one width, with their windows."""
    spacing, hertz, values = spectra.spacing, spectra.frequency, spectra.values / spectra.noise
    n = max(1, round((highest - lowest) / max(width, _LEAST_LINES * spacing)))
    margin = max(_MARGIN, 0.5 * _LEAST_LINES * spacing)
    for low, high in pairwise(np.linspace(lowest, highest, n + 1).tolist()):
        kept_lines = (hertz >= max(low - margin, 0.3 * lowest, 3.0 * spacing)) & (hertz <= high + margin)
        # a frequency response may begin above the band, or end in it or below
        if np.any((hertz >= low) & (hertz < high)):
            yield _Band(Window(hertz[kept_lines], values[kept_lines], np.zeros((0, 2))), low, high)


def _least_gain(window: Window) -> float:
    """Gain of -2 ln likelihood that noise alone gives to `_NOISE_MODES` modes in a window."""
    from scipy.special import chdtri

    n_records = min(window.values.shape[1], _MOST_RECORDS)
    return float(chdtri(2.0 * n_records + 2.0, _NOISE_MODES / (_CELLS_A_LINE * window.frequency.size)))


def _contains_pole(poles: Floats, pole: Floats, spacing: float) -> bool:
    """Whether one of several poles lies within a width, or a line, of a pole."""
    reach = np.maximum(np.maximum(poles[:, 1], pole[1]), spacing)
    return bool(np.any(np.abs(poles[:, 0] - pole[0]) < reach))


def _fit_band(spectra: Spectra, band: _Band, start: Floats, n_lines: int, by_width: list[Floats]) -> Iterator[Mode]:
    """Modes of one band, fitted to all records at once."""
    window = band.window
    outside = np.maximum(window.frequency[0] - start[:, 0], start[:, 0] - window.frequency[-1])
    band_poles = start[outside <= 0.0]
    if not len(band_poles):
        return
    window = replace(window, fixed=start[(outside > 0.0) & (outside <= _REACH)])
    strongest = refine_poles(window.compressed(_MOST_FITTED_RECORDS), band_poles).with_share(_UNLIKE_SHARES)
    pruned, gains = _prune_modes(strongest, _least_gain(window))
    if not len(pruned.poles):
        return
    fit = refine_poles(replace(window, model_error=pruned.window.model_error), pruned.poles, _LAST_STEPS)
    scores, information = fit.information()
    inverse = _pole_covariance(information)
    steps, noise_level = scores @ inverse, spectra.noise
    widening = _correlation_factor(fit)
    narrow = _fit_without_margins(fit, band)
    n = len(fit.poles)
    for m, (frequency, decay) in enumerate(fit.poles):
        if not band.low <= frequency < band.high or decay > _BROADEST_DAMPING * frequency:
            continue
        columns = np.array([m, n + m])
        own_variance = np.diagonal(inverse)[columns]
        variances = widening * np.einsum("ij,rjk,ki->ri", inverse[columns], information, inverse[:, columns])
        excess = _scatter_factor(spectra.places, steps[:, columns], variances)
        yield Mode(
            frequency=float(frequency),
            decay=float(decay),
            noise=np.sqrt(widening * own_variance),
            scatter=np.sqrt(widening * own_variance * (excess - 1.0)),
            # two choices of lines are two estimates with errors of their own: they differ by twice the variance
            window=_pole_shift(narrow, fit.poles[m], own_variance) / np.sqrt(2.0),
            residues=fit.residues[m] * noise_level,
            residue_sd=_residue_sd(fit, m) * noise_level,
            expected=_expected_noise_modes(gains[m], pruned.residual.shape[1], n_lines),
            seen=float(np.mean([_contains_pole(poles, fit.poles[m], window.spacing) for poles in by_width])),
        )


def _pole_covariance(information: Floats) -> Floats:
    """Covariance of all parameters from the information of each record."""
    return np.asarray(np.linalg.pinv(information.sum(axis=0), hermitian=True))


def _scatter_factor(places: Indices, steps: Floats, variances: Floats) -> Floats:
    """Factor, at least 1, by which the scatter of hits, or of places if larger, exceeds the variances.

    The steps are those by which each record alone would move frequency and decay rate.
    """
    of_place = np.eye(int(places.max()) + 1)[places]
    by_hit, by_place = _variance_ratio(steps, variances), _variance_ratio(of_place.T @ steps, of_place.T @ variances)
    return np.maximum(np.maximum(by_hit, by_place), 1.0)


def _variance_ratio(steps: Floats, variances: Floats) -> Floats:
    """Sum of squares over the expected one, as if `_PRIOR_GROUPS` more groups had scattered as expected.

    The steps of all records add up to zero, so that one degree of freedom is lost.
    """
    if len(steps) < 2:
        return np.ones(2)
    squares = np.sum(steps**2 / np.maximum(variances, 1e-300), axis=0)
    return np.asarray((squares + _PRIOR_GROUPS) / (len(steps) - 1.0 + _PRIOR_GROUPS))


def _prune_modes(fit: WindowFit, least: float) -> tuple[WindowFit, list[float]]:
    """The fit without the modes that noise alone would give, and the gain of each of the others."""
    while len(fit.poles):
        gains = [fit.without(m).cost - fit.cost for m in range(len(fit.poles))]
        if min(gains) >= least:
            return fit, gains
        fit = fit.without(int(np.argmin(gains)))
    return fit, []


def _expected_noise_modes(gain: float, n_records: int, n_lines: int) -> float:
    """Expected number of modes in the whole band for which noise alone would give such a gain."""
    from scipy.special import chdtrc

    return float(_CELLS_A_LINE * n_lines * chdtrc(2.0 * n_records + 2.0, max(gain, 0.0)))


def _correlation_factor(fit: WindowFit) -> float:
    """Factor of variances, 1 to 10, by which the residual of a fit is correlated from line to line."""
    rest = fit.residual / np.sqrt(fit.variance)
    total = float(np.sum(np.abs(rest) ** 2))
    factor = 1.0
    for k in range(1, 7):
        lag = float(np.real(np.sum(rest[k:].conj() * rest[:-k]))) / max(total, 1e-300)
        if lag < 2.0 / np.sqrt(rest.size):
            break
        factor += 2.0 * lag
    return min(factor, 10.0)


def _fit_without_margins(fit: WindowFit, band: _Band) -> WindowFit:
    """A fit of the same modes to the lines of the window without most of its margins."""
    window = fit.window
    kept_lines = (window.frequency >= band.low - 0.4 * _MARGIN) & (window.frequency <= band.high + 0.4 * _MARGIN)
    if kept_lines.sum() < 0.6 * kept_lines.size or kept_lines.sum() < 3 * len(fit.poles) + 8:
        return fit
    return refine_poles(
        replace(window, frequency=window.frequency[kept_lines], values=window.values[kept_lines]), fit.poles
    )


def _pole_shift(narrow: WindowFit, pole: Floats, variances: Floats) -> Floats:
    """Change of frequency and decay rate in the narrower window beyond what fewer lines let expect."""
    nearest = int(np.argmin(np.abs(narrow.poles[:, 0] - pole[0])))
    narrow_variances = np.diagonal(_pole_covariance(narrow.information()[1]))[[nearest, len(narrow.poles) + nearest]]
    expected = np.maximum(narrow_variances - variances, 0.0)
    squares = (narrow.poles[nearest] - pole) ** 2
    return np.asarray(np.sqrt(np.where(squares > _NOTED_SDS**2 * expected, squares - expected, 0.0)))


def _residue_sd(fit: WindowFit, mode: int) -> Floats:
    """Standard deviation of a mode's residue in each record, the poles being given: (n_records,) array."""
    weighted = fit.window.basis(fit.poles) * fit.window.weights[:, None]
    gram = np.linalg.pinv(weighted.conj().T @ weighted, hermitian=True)
    return np.asarray(np.sqrt(max(float(np.real(gram[mode, mode])), 0.0) * fit.variance))
