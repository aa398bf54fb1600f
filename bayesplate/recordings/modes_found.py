"""Modes of all records: found in overlapping windows of two widths, then fitted together with their errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Complex, Floats, Indices
from bayesplate.recordings.local_fit import Fitted, Window, refined, search
from bayesplate.recordings.spectra import Spectra

WIDTHS = (100.0, 60.0)
"""Hz of the windows in which modes are looked for; the first are those of the final fits."""
_MARGIN = 40.0
"""Hz on either side of a window that are fitted too."""
_REACH = 150.0
"""Hz beyond a window up to which the modes that were found take part in its fit as they are."""
_NOTED = 2.0
"""Standard errors from which on the difference of two windows is more than chance."""
_LEAST_LINES = 40
_MOST_RECORDS, _MOST_FITTED = 6, 10
"""Combinations of records among which modes are looked for, and to which they are fitted before the last steps."""
_LAST_STEPS = 4
UNLIKE, FLOOR = 0.03, 0.01
"""In the search: share of a line, and of the window's highest line, that simple modes need not describe."""
_SHARES = (0.0, 0.01, 0.03, 0.1)
_CHANCE = 0.3
"""Modes that noise alone may give in a window before the search of it ends."""
_CELLS_A_LINE = 3.0
"""Different modes that can be tried for one line of a spectrum."""
_PRIOR_GROUPS = 8.0
"""Hits or places without scatter of their own that stand beside those that were taken, so that few tell little."""
_BROADEST = 0.06
"""Damping ratio beyond which what was fitted is no mode of a board but the ground on which others stand."""


@dataclass(frozen=True, eq=False)
class Mode:
    """A mode that was found."""

    frequency: float
    decay: float  # Hz, half the width of the peak at half its power: damping ratio times frequency
    noise: Floats  # (2,), Hz: standard deviations of frequency and decay, by what each record leaves after the fit
    scatter: Floats  # the same for what hits, places and files scatter beyond it
    window: Floats  # the same for the choice of lines
    residues: Complex  # (n_records,), in units of the spectra
    residue_sd: Floats
    expected: float  # how many modes noise alone would show as clearly, in all the band
    seen: float  # share of the widths of windows in which it was found

    @property
    def pole(self) -> Floats:
        """Frequency and decay rate: (2,) array, Hz."""
        return np.array([self.frequency, self.decay])

    @property
    def damping(self) -> float:
        return self.decay / self.frequency


class Path(NamedTuple):
    """Frequencies in one window of some width in Hz, with one mode, with two, and so on: the diagram of stability."""

    width: float
    orders: tuple[Floats, ...]


class _Part(NamedTuple):
    """A window with its margins, and the ends in Hz between which its modes count."""

    window: Window
    low: float
    high: float

    def own(self, poles: Floats) -> Floats:
        """Those of (n_modes, 2) modes that count."""
        return poles[(poles[:, 0] >= self.low) & (poles[:, 0] < self.high)]


def find_modes(spectra: Spectra, lowest: float, highest: float) -> tuple[list[Floats], list[Path]]:
    """Modes between two frequencies that windows of each width show, (n_modes, 2: Hz), and the paths of the search."""
    by_width: list[Floats] = []
    paths: list[Path] = []
    for width in WIDTHS:
        found = []
        for part in _parts(spectra, lowest, highest, width):
            strongest = part.window.compressed(_MOST_RECORDS)
            searched = replace(strongest, unlike=UNLIKE, floor=FLOOR, least_variance=1.0)
            orders = [part.own(poles) for poles in search(searched, _least_gain(part.window))]
            found.append(orders[-1] if orders else np.zeros((0, 2)))
            paths.append(Path(width, tuple(np.sort(poles[:, 0]) for poles in orders)))
        by_width.append(np.concatenate(found))
    return by_width, paths


def joined(by_width: list[Floats], spacing: float) -> Floats:
    """Modes of windows of the first width, and of the others where the first have none: (n_modes, 2) array, Hz."""
    every = by_width[0]
    for poles in by_width[1:]:
        new = [pole for pole in poles if not _has(every, pole, spacing)]
        every = np.concatenate([every, np.reshape(new, (-1, 2))])
    return every[np.argsort(every[:, 0])]


def fit_modes(spectra: Spectra, start: Floats, by_width: list[Floats], lowest: float, highest: float) -> list[Mode]:
    """Fit modes, from (n_modes, 2) starts in Hz, to all records at once, each in its window; in the order of frequency.

    Those that noise alone would give are left out; `by_width` is what windows of each width have shown.
    """
    n_lines = int(np.sum((spectra.frequency >= lowest) & (spectra.frequency < highest)))
    parts = _parts(spectra, lowest, highest, WIDTHS[0])
    modes = [mode for part in parts for mode in _modes_of(spectra, part, start, n_lines, by_width)]
    return sorted(modes, key=lambda mode: mode.frequency)


def _parts(spectra: Spectra, lowest: float, highest: float, width: float) -> Iterator[_Part]:
    """Windows of about one width."""
    spacing, hertz, values = spectra.spacing, spectra.frequency, spectra.values / spectra.noise
    n = max(1, round((highest - lowest) / max(width, _LEAST_LINES * spacing)))
    margin = max(_MARGIN, 0.5 * _LEAST_LINES * spacing)
    for low, high in pairwise(np.linspace(lowest, highest, n + 1).tolist()):
        kept = (hertz >= max(low - margin, 0.3 * lowest, 3.0 * spacing)) & (hertz <= high + margin)
        if kept.any():  # else a frequency response that ends below
            yield _Part(Window(hertz[kept], values[kept], np.zeros((0, 2))), low, high)


def _least_gain(window: Window) -> float:
    """Gain of the likelihood that noise alone gives to few modes in a window."""
    from scipy.special import chdtri

    n_records = min(window.values.shape[1], _MOST_RECORDS)
    return float(chdtri(2.0 * n_records + 2.0, _CHANCE / (_CELLS_A_LINE * window.frequency.size)))


def _has(poles: Floats, one: Floats, spacing: float) -> bool:
    """Whether a mode is among others, but for its width or a line."""
    reach = np.maximum(np.maximum(poles[:, 1], one[1]), spacing)
    return bool(np.any(np.abs(poles[:, 0] - one[0]) < reach))


def _modes_of(spectra: Spectra, part: _Part, start: Floats, n_lines: int, by_width: list[Floats]) -> Iterator[Mode]:
    """Modes of one window, fitted to all records at once."""
    window = part.window
    outside = np.maximum(window.frequency[0] - start[:, 0], start[:, 0] - window.frequency[-1])
    own = start[outside <= 0.0]
    if not len(own):
        return
    window = replace(window, fixed=start[(outside > 0.0) & (outside <= _REACH)])
    strongest = refined(window.compressed(_MOST_FITTED), own).with_share(_SHARES)
    few, gains = _pruned(strongest, _least_gain(window))
    if not len(few.poles):
        return
    fit = refined(replace(window, unlike=few.window.unlike), few.poles, _LAST_STEPS)
    scores, information = fit.information()
    inverse = _inverse(information)
    steps, level = scores @ inverse, spectra.noise
    widening = _correlation(fit)
    narrow = _narrower(fit, part)
    n = len(fit.poles)
    for m, (frequency, decay) in enumerate(fit.poles):
        if not part.low <= frequency < part.high or decay > _BROADEST * frequency:
            continue
        at = np.array([m, n + m])
        own_variance = np.diagonal(inverse)[at]
        each = widening * np.einsum("ij,rjk,ki->ri", inverse[at], information, inverse[:, at])
        excess = _excess(spectra.places, steps[:, at], each)
        yield Mode(
            frequency=float(frequency),
            decay=float(decay),
            noise=np.sqrt(widening * own_variance),
            scatter=np.sqrt(widening * own_variance * (excess - 1.0)),
            # two choices of lines are two estimates, each with an error of its own: twice its variance apart
            window=_shift(narrow, fit.poles[m], own_variance) / np.sqrt(2.0),
            residues=fit.residues[m] * level,
            residue_sd=_residue_sd(fit, m) * level,
            expected=_expected(gains[m], few.rest.shape[1], n_lines),
            seen=float(np.mean([_has(poles, fit.poles[m], window.spacing) for poles in by_width])),
        )


def _inverse(information: Floats) -> Floats:
    """Covariance of all parameters by the information of each record."""
    return np.asarray(np.linalg.pinv(information.sum(axis=0), hermitian=True))


def _excess(places: Indices, steps: Floats, variances: Floats) -> Floats:
    """Factor, at least 1, by which the steps of hits, or of places if larger, exceed their variances.

    The steps are those by which each record would move frequency and decay rate.
    """
    of_place = np.eye(int(places.max()) + 1)[places]
    by_hit, by_place = _ratio(steps, variances), _ratio(of_place.T @ steps, of_place.T @ variances)
    return np.maximum(np.maximum(by_hit, by_place), 1.0)


def _ratio(steps: Floats, variances: Floats) -> Floats:
    """Sum of squares over the expected one, as if `_PRIOR_GROUPS` more had scattered as expected.

    The steps of all records add up to nothing, so that one degree of freedom is lost.
    """
    if len(steps) < 2:
        return np.ones(2)
    squares = np.sum(steps**2 / np.maximum(variances, 1e-300), axis=0)
    return np.asarray((squares + _PRIOR_GROUPS) / (len(steps) - 1.0 + _PRIOR_GROUPS))


def _pruned(fit: Fitted, least: float) -> tuple[Fitted, list[float]]:
    """The fit without the modes that noise alone would give, and what each of the others gains."""
    while len(fit.poles):
        gains = [fit.without(m).cost - fit.cost for m in range(len(fit.poles))]
        if min(gains) >= least:
            return fit, gains
        fit = fit.without(int(np.argmin(gains)))
    return fit, []


def _expected(gain: float, n_records: int, n_lines: int) -> float:
    """How many modes in all the band noise alone would give such a gain."""
    from scipy.special import chdtrc

    return float(_CELLS_A_LINE * n_lines * chdtrc(2.0 * n_records + 2.0, max(gain, 0.0)))


def _correlation(fit: Fitted) -> float:
    """Factor of variances, 1 to 10, by which the rest of a fit varies more slowly than from line to line."""
    rest = fit.rest / np.sqrt(fit.variance)
    total = float(np.sum(np.abs(rest) ** 2))
    factor = 1.0
    for k in range(1, 7):
        lag = float(np.real(np.sum(rest[k:].conj() * rest[:-k]))) / max(total, 1e-300)
        if lag < 2.0 / np.sqrt(rest.size):
            break
        factor += 2.0 * lag
    return min(factor, 10.0)


def _narrower(fit: Fitted, part: _Part) -> Fitted:
    """A fit of the same modes to the lines of the window without most of its margins."""
    window = fit.window
    kept = (window.frequency >= part.low - 0.4 * _MARGIN) & (window.frequency <= part.high + 0.4 * _MARGIN)
    if kept.sum() < 0.6 * kept.size or kept.sum() < 3 * len(fit.poles) + 8:
        return fit
    return refined(replace(window, frequency=window.frequency[kept], values=window.values[kept]), fit.poles)


def _shift(narrow: Fitted, pole: Floats, variances: Floats) -> Floats:
    """Change of frequency and decay rate in the narrower window, if it is more than fewer lines let expect."""
    nearest = int(np.argmin(np.abs(narrow.poles[:, 0] - pole[0])))
    own = np.diagonal(_inverse(narrow.information()[1]))[[nearest, len(narrow.poles) + nearest]]
    expected = np.maximum(own - variances, 0.0)
    squares = (narrow.poles[nearest] - pole) ** 2
    return np.asarray(np.sqrt(np.where(squares > _NOTED**2 * expected, squares - expected, 0.0)))


def _residue_sd(fit: Fitted, mode: int) -> Floats:
    """Standard deviation of a mode's residue in each record at given modes: (n_records,) array."""
    weighted = fit.window.basis(fit.poles) * fit.window.weights[:, None]
    gram = np.linalg.pinv(weighted.conj().T @ weighted, hermitian=True)
    return np.asarray(np.sqrt(max(float(np.real(gram[mode, mode])), 0.0) * fit.variance))
