"""Exponential sine sweeps to impulse responses: the response is divided by the sweep, frequency by frequency.

An exponential sweep x(t) = sin(K (exp(t / L) - 1)) with L = T / ln(f2 / f1) and K = 2 pi f1 L passes each octave in
the same time, so that what the loudspeaker adds in harmonics comes out before the impulse response and is cut away.
Where another sweep was played, its frequencies come out one after the other: that is no impulse, and is refused.

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

_LONGEST = 600.0
"""s."""
_BEFORE = 0.01
"""s before the impulse response that are kept."""
_AFTER = 0.002
"""s after it from which on the board rings by itself."""
_SETS_IN = 0.3
"""Share of its height that it reaches first where it sets in: several modes may be highest together only later."""
_ABOUT, _APART, _MOST_BEFORE = 0.1, 0.02, 0.05
"""s before and after it sets in, s that are left out before that, and power there over that after it, at most; both
less the noise."""
_LOOK, _LOUD, _CLEAR = 1.0, 1e-3, 30.0
"""s before and after it sets in, in which frequencies are looked at, and power of those that count: over the loudest
one, and over what is usual at the same frequency."""
_OFF, _MOST_OFF = 0.06, 0.16
"""s by which a frequency may come at another time than the others, and the share of them that may be off by more."""
_OF_MEDIAN = 0.455
"""Median of the square of a normal variable over its mean."""
_FLOOR = 1e-4
"""Share of a sweep's greatest power below which a frequency was not excited."""
_OUTSIDE = 5e-3
"""Share of a sweep's power below the frequencies that it passes, and above them: it begins and ends suddenly."""
_WHOLE, _NOTHING = 1.5, 2.0
"""Frequency over the highest that is asked for up to which an impulse response is kept, and from which on nothing."""


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
    if not (0.0 < first < last < np.inf and LEAST_DURATION < duration <= _LONGEST):
        wanted = f"two rising frequencies in Hz and a time in s, up to {_LONGEST:g}"
        raise InputError(Fault("sweep", wanted, got, "45,8000,8"))
    return Sweep(first, last, duration)


def band_of(played: Floats, rate: float) -> tuple[float, float]:
    """Frequencies in Hz between which a sweep excites a board: outside there is noise alone."""
    from scipy.fft import rfft

    power = np.cumsum(np.abs(rfft(played)) ** 2)
    first, last = np.searchsorted(power, power[-1] * np.array([_OUTSIDE, 1.0 - _OUTSIDE])) * rate / played.size
    return float(first), float(last)


def impulse_response(recording: Recording, played: Floats, highest: float) -> tuple[Recording, Hit]:
    """The impulse response in a recording of a sweep, as if the board had been hit once, for modes up to some Hz.

    The sweep is given as samples at the rate of the recording. It is refused where what comes out is no impulse
    response.
    """
    rate = recording.rate
    whole = _divided(recording.response, played, highest / rate)
    onset = _sets_in(np.abs(whole), round(_ABOUT * rate))
    if not _is_impulse(whole, onset, rate):
        got = "no impulse when it is turned back: its frequencies come one after the other, or are lost in noise"
        remedy = "--sweep with what was played: its frequencies and seconds, exponential"
        raise InputError(Fault(recording.name, "the response to this sweep", got, remedy))
    first = max(onset - round(_BEFORE * rate), 0)
    response = whole[first : first + round((LONGEST_DURATION + _BEFORE) * rate)]
    onset -= first
    return replace(recording, response=response), Hit(onset, onset + round(_AFTER * rate), response.size)


def _sets_in(size: Floats, about: int) -> int:
    """Sample at which an impulse response sets in, within some samples before its height."""
    highest = int(np.argmax(size))
    first = max(highest - about, 0)
    return first + int(np.argmax(size[first : highest + 1] >= _SETS_IN * size[highest]))


def _is_impulse(whole: Floats, onset: int, rate: float) -> bool:
    """Whether hardly anything comes before the onset, and few of the frequencies come late."""
    about, apart, look = (round(seconds * rate) for seconds in (_ABOUT, _APART, _LOOK))
    near = whole[max(onset - look, 0) :][: 2 * look]
    noise = float(np.median(near**2)) / _OF_MEDIAN
    before, after = whole[max(onset - apart - about, 0) : max(onset - apart, 0)], whole[onset : onset + about]
    before_power, after_power = (float(np.sum(part**2 - noise)) for part in (before, after))
    return before_power <= _MOST_BEFORE * max(after_power, 0.0) and not _come_late(near, rate)


def _come_late(near: Floats, rate: float) -> bool:
    """Whether many of the frequencies that stand out come at another time than the others, or none stands out."""
    from scipy.signal import stft

    n = round(_ABOUT * rate)
    _, times, lines = stft(near, rate, nperseg=n, noverlap=n - n // 10, boundary=None, padded=False)
    power = np.abs(lines) ** 2
    loudest = power.max(axis=1)
    counts = (loudest > _LOUD * loudest.max()) & (loudest > _CLEAR * np.median(power, axis=1))
    when = times[power.argmax(axis=1)][counts]
    return not when.size or bool(np.mean(np.abs(when - np.median(when)) > _OFF) > _MOST_OFF)


def _divided(response: Floats, played: Floats, highest: float) -> Floats:
    """The response over the sweep, frequency by frequency, where the sweep has any power.

    What lies far above the highest frequency, in periods a sample, is left out: a sweep excites it least, and its noise
    would hide where the rest sets in.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    n = next_fast_len(response.size + played.size, real=True)
    x = rfft(played, n)
    power = np.abs(x) ** 2
    above = np.clip((np.arange(x.size) / (n * highest) - _WHOLE) / (_NOTHING - _WHOLE), 0.0, 1.0)
    kept = np.cos(0.5 * np.pi * above) ** 2
    quotient = kept * rfft(response, n) * x.conj() / np.maximum(power, _FLOOR * power.max())
    delay = played.size  # a sweep that was heard before it was played would come out negative
    turned = quotient * np.exp(-2j * np.pi * np.arange(x.size) * delay / n)
    return np.asarray(irfft(turned, n))
