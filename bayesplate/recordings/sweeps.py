"""Exponential sine sweeps to impulse responses: the response is divided by the sweep, frequency by frequency.

An exponential sweep x(t) = sin(K (exp(t / L) - 1)) with L = T / ln(f2 / f1) and K = 2 pi f1 L passes each octave in
the same time, so that harmonics of the loudspeaker come before the impulse response and are cut away. Where another
sweep was played, its frequencies come one after the other: that is no impulse, and is refused.

References
----------
Farina, Simultaneous measurement of impulse response and distortion with a swept-sine technique, AES 108, 2000.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.hits import LEAST_DURATION, LONGEST_DURATION, Hit
from bayesplate.recordings.signals import Recording

_LONGEST_SWEEP = 600.0
"""Longest duration of a sweep, s."""
_BEFORE_IMPULSE = 0.01
"""s before the onset of the impulse response that are kept."""
_AFTER_IMPULSE = 0.002
"""s after the onset from which on the board rings freely."""
_ONSET_SHARE = 0.3
"""Share of the height of an impulse response that it reaches first at its onset: several modes may peak later."""
_ONSET_SPAN, _ONSET_GAP, _MOST_BEFORE = 0.1, 0.02, 0.05
"""s before and after the onset that are compared, s just before the onset that are left out, and the largest power
before it over that after it; both less the noise."""
_LOOK_SPAN, _LOUD_SHARE, _CLEAR_RATIO = 1.0, 1e-3, 30.0
"""s before and after the onset in which frequencies are examined, and least power of a clear frequency: over the
loudest one, and over the median at the same frequency."""
_LATE_TIME, _MOST_LATE = 0.06, 0.16
"""s by which a frequency may differ in time from the others, and the share of frequencies that may differ by more."""
_RISING_SHARE, _LEAST_RANGE, _MOST_FLUCTUATION = 0.9, 2.0, 20.0
"""Least share of the time in which the frequency of what was played rises, the least ratio of its last frequency to its
first, and the largest sum of the rises and falls of its level, dB, less the difference between its ends."""
_MEDIAN_SQUARE = 0.455
"""Median of the square of a normal variable over its mean."""
_POWER_FLOOR = 1e-4
"""Share of a sweep's greatest power below which a frequency was not excited."""
_OUTSIDE_SHARE = 5e-3
"""Share of a sweep's power below its first frequency, and above its last: it begins and ends suddenly."""
_PASS_RATIO, _STOP_RATIO = 1.5, 2.0
"""Frequencies over the highest of the modes: end of the pass band of an impulse response, start of its stop band."""


class Sweep(NamedTuple):
    """An exponential sweep between two frequencies in Hz, in some seconds."""

    first: float
    last: float
    duration: float

    def signal(self, rate: float) -> Floats:
        """The sweep: (n_samples,) array, -1 to 1."""
        times = np.arange(round(self.duration * rate)) / rate
        scale = self.duration / np.log(self.last / self.first)
        return np.asarray(np.sin(2.0 * np.pi * self.first * scale * np.expm1(times / scale)))


def read_sweep(text: str) -> Sweep:
    """A sweep from its parameters, "F1,F2,SECONDS"."""
    got = f'"{text[:60]}"'
    try:
        first, last, duration = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(Fault("sweep", "F1,F2,SECONDS or a file", got, "45,8000,8")) from None
    if not (0.0 < first < last < np.inf and LEAST_DURATION < duration <= _LONGEST_SWEEP):
        wanted = f"two rising frequencies in Hz and a time in s, up to {_LONGEST_SWEEP:g}"
        raise InputError(Fault("sweep", wanted, got, "45,8000,8"))
    return Sweep(first, last, duration)


def sweep_band(played: Floats, rate: float) -> tuple[float, float]:
    """Frequencies in Hz between which a sweep excites a board: outside there is noise alone."""
    from scipy.fft import rfft

    power = np.cumsum(np.abs(rfft(played)) ** 2)
    first, last = (
        np.searchsorted(power, power[-1] * np.array([_OUTSIDE_SHARE, 1.0 - _OUTSIDE_SHARE])) * rate / played.size
    )
    return float(first), float(last)


def require_sweep(played: Recording) -> None:
    """Refuse a recording that cannot have been played: no sweep, or what a board or a room made of one."""
    from scipy.signal import stft

    n = round(_ONSET_SPAN * played.rate)
    hertz, _, lines = stft(played.response, played.rate, nperseg=n, noverlap=0, boundary=None, padded=False)
    power = np.abs(lines) ** 2
    total = power.sum(axis=0)
    is_loud = total > _POWER_FLOOR * total.max()
    peaks, level = hertz[power[:, is_loud].argmax(axis=0)], 10.0 * np.log10(total[is_loud])
    got = ""
    if peaks.size < 3 or np.mean(np.diff(peaks) >= 0.0) < _RISING_SHARE or peaks[-1] < _LEAST_RANGE * peaks[0]:
        got = "its frequency does not rise from beginning to end"
    elif (fluctuation := np.abs(np.diff(level[1:-1])).sum() - abs(level[-2] - level[1])) > _MOST_FLUCTUATION:
        got = f"its level goes up and down by {fluctuation:.0f} dB: it was recorded, not played"
    if got:
        remedy = "--sweep with the file that was played, or its frequencies and seconds"
        raise InputError(Fault(played.name, "a sweep, as it was played", got, remedy))


def impulse_response(recording: Recording, played: Floats, highest: float) -> tuple[Recording, Hit]:
    """The impulse response in a recording of a sweep, as if the board had been hit once, for modes up to some Hz.

    `played` holds the samples of the sweep at the rate of the recording. A recording that gives no impulse response is
    refused.
    """
    rate = recording.rate
    impulse = _divide_by_sweep(recording.response, played, highest / rate)
    onset = _onset_sample(np.abs(impulse), round(_ONSET_SPAN * rate))
    if not _is_impulse(impulse, onset, rate):
        got = "no impulse when it is turned back: its frequencies come one after the other, or are lost in noise"
        remedy = "--sweep with what was played: its frequencies and seconds, exponential"
        raise InputError(Fault(recording.name, "the response to this sweep", got, remedy))
    first = max(onset - round(_BEFORE_IMPULSE * rate), 0)
    response = impulse[first : first + round((LONGEST_DURATION + _BEFORE_IMPULSE) * rate)]
    onset -= first
    return replace(recording, response=response), Hit(onset, onset + round(_AFTER_IMPULSE * rate), response.size)


def _onset_sample(level: Floats, span: int) -> int:
    """Sample of the onset of an impulse response, within a span of samples before its highest one."""
    highest = int(np.argmax(level))
    first = max(highest - span, 0)
    return first + int(np.argmax(level[first : highest + 1] >= _ONSET_SHARE * level[highest]))


def _is_impulse(impulse: Floats, onset: int, rate: float) -> bool:
    """Whether hardly anything comes before the onset, and few of the frequencies come late."""
    span, gap, look = (round(seconds * rate) for seconds in (_ONSET_SPAN, _ONSET_GAP, _LOOK_SPAN))
    near = impulse[max(onset - look, 0) :][: 2 * look]
    noise = float(np.median(near**2)) / _MEDIAN_SQUARE
    before, after = impulse[max(onset - gap - span, 0) : max(onset - gap, 0)], impulse[onset : onset + span]
    before_power, after_power = (float(np.sum(part**2 - noise)) for part in (before, after))
    return before_power <= _MOST_BEFORE * max(after_power, 0.0) and not _frequencies_come_late(near, rate)


def _frequencies_come_late(near: Floats, rate: float) -> bool:
    """Whether many of the clear frequencies come at another time than the others, or there is no clear one."""
    from scipy.signal import stft

    n = round(_ONSET_SPAN * rate)
    _, times, lines = stft(near, rate, nperseg=n, noverlap=n - n // 10, boundary=None, padded=False)
    power = np.abs(lines) ** 2
    loudest = power.max(axis=1)
    is_clear = (loudest > _LOUD_SHARE * loudest.max()) & (loudest > _CLEAR_RATIO * np.median(power, axis=1))
    peak_times = times[power.argmax(axis=1)][is_clear]
    return not peak_times.size or bool(np.mean(np.abs(peak_times - np.median(peak_times)) > _LATE_TIME) > _MOST_LATE)


def _divide_by_sweep(response: Floats, played: Floats, highest: float) -> Floats:
    """The response over the sweep, frequency by frequency, where the sweep has any power.

    Frequencies far above `highest`, in periods a sample, are left out: a sweep excites them least, and their noise
    would hide the onset.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    n = next_fast_len(response.size + played.size, real=True)
    x = rfft(played, n)
    power = np.abs(x) ** 2
    above = np.clip((np.arange(x.size) / (n * highest) - _PASS_RATIO) / (_STOP_RATIO - _PASS_RATIO), 0.0, 1.0)
    gain = np.cos(0.5 * np.pi * above) ** 2
    quotient = gain * rfft(response, n) * x.conj() / np.maximum(power, _POWER_FLOOR * power.max())
    delay = played.size  # times before the sweep was played would be negative
    delayed = quotient * np.exp(-2j * np.pi * np.arange(x.size) * delay / n)
    return np.asarray(irfft(delayed, n))
