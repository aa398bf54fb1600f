"""From spectra of decays to picked modes: frequency, damping and residues, each with what is not known of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import Fault, InputError
from bayesplate.recordings.across import Seen, Shown, modes_across
from bayesplate.recordings.agreement import agreeing
from bayesplate.recordings.modes_found import Mode, Path, find_modes, fit_modes, joined
from bayesplate.recordings.plausibility import Verdict, complexity, part_words, verdicts
from bayesplate.recordings.spectra import Rows, Spectra
from bayesplate.recordings.strength import Answer, answers

Floats = NDArray[np.float64]

LOWEST, HIGHEST = 20.0, 1000.0
"""Hz between which modes are looked for unless others are given."""
_BEYOND = 100.0
"""Hz below the lowest and above the highest in which modes are looked for too: they reach into the band."""
_FEWEST_LINES = 5
_PART = 0.5
"""Probability from which on a part of another peak is fitted together with it as one mode."""
_SAME = 3.0
"""Decay rates within which a mode is found again in a fit without the parts."""


@dataclass(frozen=True)
class PickedMode:
    """A mode as the recordings show it.

    Attributes
    ----------
    frequency, sd : float, Hz
        With its standard error, everything below joined.
    noise_sd, scatter_sd, window_sd : float, Hz
        What noise leaves open; what hits and places scatter beyond it; how far the choice of lines moves it.
    damping, damping_sd : float
        Ratio to the critical one.
    mobility : tuple of float
        Residue of the mobility between each pair of places, its real part, in the units of the recordings.
    complexity : float
        Degrees by which the residues are not real.
    alike : float
        Share of the residues' power that is the same from hit to hit.
    amplitude : float
        Strength over the strongest likely mode's.
    seen : float
        Share of the widths of windows in which it was found.
    spurious : float
        Probability that it is no mode of the board.
    kind : str
        What it would be then.
    """

    frequency: float
    sd: float
    noise_sd: float
    scatter_sd: float
    window_sd: float
    damping: float
    damping_sd: float
    mobility: tuple[float, ...]
    mobility_sd: tuple[float, ...]
    complexity: float
    alike: float
    amplitude: float
    seen: float
    spurious: float
    kind: str

    @property
    def is_likely(self) -> bool:
        """Whether it is a mode rather than not."""
        return self.spurious < 0.5


@dataclass(frozen=True, eq=False)
class Picked:
    """What was picked from recordings.

    Attributes
    ----------
    modes : tuple of PickedMode
        In the order of frequency, those that are likely none included.
    paths : tuple of Path
        Of the search, for the diagram of stability.
    lowest, highest : float, Hz
    remarks : tuple of str
        How recordings differ that do not show quite the same modes.
    """

    modes: tuple[PickedMode, ...]
    spectra: Spectra
    paths: tuple[Path, ...]
    lowest: float
    highest: float
    remarks: tuple[str, ...] = ()

    @property
    def likely(self) -> tuple[PickedMode, ...]:
        """The modes that are modes rather than not."""
        return tuple(mode for mode in self.modes if mode.is_likely)


def pick_modes(spectra: Spectra, lowest: float = LOWEST, highest: float = HIGHEST) -> Picked:
    """Modes between two frequencies.

    Parameters
    ----------
    lowest, highest : float, Hz

    Raises
    ------
    InputError
        If the spectra have next to nothing between the two, as frequency responses that end below; if two recordings
        have no modes in common.
    """
    n_lines = int(((spectra.frequency >= lowest) & (spectra.frequency <= highest)).sum())
    if n_lines < _FEWEST_LINES:
        place, wanted = f"{spectra.names[0]} between {lowest:g} and {highest:g} Hz", f"{_FEWEST_LINES} lines or more"
        raise InputError(Fault(place, wanted, str(n_lines), "--lowest and --highest look elsewhere"))
    sets = agreeing(spectra, lowest, highest)
    searched = [_searched(spectra.only(records), lowest, highest) for records in sets]
    peaks, remarks = searched[0][0], tuple[str, ...]()
    if len(sets) > 1:
        across = modes_across(spectra, [_shown(*one) for one in zip(sets, (own for own, _ in searched), strict=True)])
        spectra, remarks = across.spectra, across.remarks
        judged = zip(_judged(spectra, across.modes), across.spurious, strict=True)
        peaks = [replace(one, verdict=one.verdict.at_least(spurious)) for one, spurious in judged]
    peaks = sorted(peaks, key=lambda peak: peak.mode.frequency)
    strongest = max((peak.answer.strength for peak in peaks if peak.verdict.spurious < _PART), default=1.0)
    picked = tuple(_picked(peak, strongest) for peak in peaks)
    return Picked(picked, spectra, tuple(path for _, paths in searched for path in paths), lowest, highest, remarks)


def _shown(records: Rows, peaks: Sequence[_Peak]) -> Shown:
    """What a set of records shows by itself, parts of peaks left out."""
    whole = [one for one in peaks if one.verdict.part_of < 0 or one.verdict.spurious < _PART]
    return Shown(records, [Seen(one.mode, one.pole, one.split, one.verdict.spurious) for one in whole])


def _searched(spectra: Spectra, lowest: float, highest: float) -> tuple[list[_Peak], list[Path]]:
    """Peaks of records that show the same modes, parts of peaks included, and the paths of the search."""
    below, above = max(lowest - _BEYOND, min(lowest, LOWEST)), min(highest + _BEYOND, float(spectra.frequency[-1]))
    by_width, paths = find_modes(spectra, below, above)
    modes = fit_modes(spectra, joined(by_width, spectra), by_width, lowest, highest)
    kept, parts = _without_parts(spectra, modes, by_width, (lowest, highest))
    return [*kept, *parts], paths


@dataclass(frozen=True, eq=False)
class _Peak:
    """A mode as it was fitted and judged last; `other`, as it was with a part of it as a mode of its own.

    `doubt` is the probability that the part is none.
    """

    mode: Mode
    answer: Answer
    verdict: Verdict
    other: Mode
    doubt: float = 1.0

    @property
    def pole(self) -> Floats:
        """Frequency and decay rate averaged over both: (2,) array, Hz."""
        return self.doubt * self.mode.pole + (1.0 - self.doubt) * self.other.pole

    @property
    def split(self) -> Floats:
        """Standard deviations of both for not knowing which of the two it is: (2,) array, Hz."""
        return np.abs(self.mode.pole - self.other.pole) * np.sqrt(self.doubt * (1.0 - self.doubt))


def _without_parts(
    spectra: Spectra, modes: Sequence[Mode], by_width: list[Floats], band: tuple[float, float]
) -> tuple[list[_Peak], list[_Peak]]:
    """Modes fitted again without those that are rather parts of the peaks of others than modes; and those parts.

    Parts are left out once and not again: where a peak is not simple in earnest, its modes come out right only beside
    something that takes up the rest.
    """
    from scipy.optimize import linear_sum_assignment

    before = _judged(spectra, modes)
    leaving = whole_peaks([one.verdict for one in before])
    kept = {m: one for m, one in enumerate(before) if m not in leaving}
    beside = [m for m in kept if any(_overlap(modes[m], modes[k]) for k in leaving)]
    if beside:
        left = list(kept)
        start = np.array([[modes[m].frequency, modes[m].decay] for m in left])
        again = _judged(spectra, fit_modes(spectra, start, by_width, *band))
        apart = np.abs(start[:, :1] - [one.mode.frequency for one in again]) / start[:, 1:]
        for i, new in zip(*linear_sum_assignment(np.minimum(apart, _SAME)), strict=True):
            m = left[i]
            if m in beside and apart[i, new] < _SAME:
                kept[m] = _whole(again[new], [before[k] for k in (m, *leaving) if k == m or leaving[k] == m])
    return list(kept.values()), [_part_of(before[k], kept[of]) for k, of in leaving.items()]


def _overlap(one: Mode, other: Mode) -> bool:
    """Whether two modes lie within their widths of each other."""
    return abs(one.frequency - other.frequency) < one.decay + other.decay


def whole_peaks(verdicts: Sequence[Verdict]) -> dict[int, int]:
    """Numbers of those modes that are rather parts than modes, each with the number of that which it is a part of.

    What is a part of a part is not among them: beside the whole peak it may be a mode.
    """
    part_of = {m: one.part_of for m, one in enumerate(verdicts) if one.spurious > _PART}
    return {m: of for m, of in part_of.items() if of >= 0 and part_of.get(of, -1) < 0}


def _judged(spectra: Spectra, modes: Sequence[Mode]) -> list[_Peak]:
    answered = answers(spectra, modes)
    judged = zip(modes, answered, verdicts(spectra, modes, answered), strict=True)
    return [_Peak(mode, answer, verdict, mode) for mode, answer, verdict in judged]


def _whole(now: _Peak, before: Sequence[_Peak]) -> _Peak:
    """A peak after parts of it were left out, with what it was before: first the mode, then its parts.

    That of them counts as what it was which lies nearest.
    """
    _, *parts = before
    if not parts:
        return now
    other = min((one.mode for one in before), key=lambda one: abs(one.frequency - now.mode.frequency))
    return replace(now, other=other, doubt=max(one.verdict.spurious for one in parts))


def _part_of(part: _Peak, whole: _Peak) -> _Peak:
    """A part that is told by the frequency of its peak as that came out."""
    return replace(part, verdict=replace(part.verdict, kind=part_words(whole.pole[0])))


def _picked(peak: _Peak, strongest: float) -> PickedMode:
    """A mode averaged over two fits: with a part of its peak as a mode, and without."""
    mode, answer, verdict = peak.mode, peak.answer, peak.verdict
    frequency, decay = (float(one) for one in peak.pole)
    window = np.hypot(mode.window, peak.split)
    sd, decay_sd = (float(one) for one in np.sqrt(mode.noise**2 + mode.scatter**2 + window**2))
    return PickedMode(
        frequency=frequency,
        sd=sd,
        noise_sd=float(mode.noise[0]),
        scatter_sd=float(mode.scatter[0]),
        window_sd=float(window[0]),
        damping=decay / frequency,
        damping_sd=decay_sd / frequency,
        mobility=tuple(float(one) for one in np.real(answer.mobility)),
        mobility_sd=tuple(float(one) for one in answer.sd),
        complexity=complexity(answer),
        alike=answer.alike,
        amplitude=answer.strength / strongest,
        seen=mode.seen,
        spurious=verdict.spurious,
        kind=verdict.kind,
    )
