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

_BEFORE = 0.01
"""s before the impulse response that are kept."""
_AFTER = 0.002
"""s after it from which on the board rings by itself."""
_ABOUT, _APART, _MOST_BEFORE = 0.1, 0.02, 0.05
"""s before and after its height, s that are left out before it, and power there over that after it, at most."""
_LOOK, _LOUD, _OFF, _MOST_OFF = 1.0, 1e-3, 0.06, 0.3
"""s before and after its height in which frequencies are looked at, power over the loudest of those that count, s by
which one may come at another time than the others, and the share of them that may be off by more."""
_FLOOR = 1e-4
"""Share of a sweep's greatest power below which a frequency was not excited."""


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
    if not (0.0 < first < last < np.inf and LEAST_DURATION < duration < np.inf):
        raise InputError(Fault("sweep", "two rising frequencies in Hz and a time in s", got, "45,8000,8"))
    return Sweep(first, last, duration)


def impulse_response(recording: Recording, sweep: Sweep | Floats) -> tuple[Recording, Hit]:
    """The impulse response in a recording of a sweep, as if the board had been hit once.

    The sweep is given by its parameters, or as samples at the rate of the recording. It is refused where what comes out
    is no impulse response.
    """
    rate = recording.rate
    whole = _divided(recording.response, sweep.signal(rate) if isinstance(sweep, Sweep) else sweep)
    onset = int(np.argmax(np.abs(whole)))
    about, apart, look = (round(seconds * rate) for seconds in (_ABOUT, _APART, _LOOK))
    before = np.sum(whole[max(onset - apart - about, 0) : max(onset - apart, 0)] ** 2)
    after = max(np.sum(whole[onset : onset + about] ** 2), 1e-300)
    if before > _MOST_BEFORE * after or _late(whole[max(onset - look, 0) :][: 2 * look], rate):
        got = "no impulse when it is turned back: its frequencies come one after the other"
        remedy = "--sweep with what was played: its frequencies and seconds, exponential"
        raise InputError(Fault(recording.name, "the response to this sweep", got, remedy))
    first = max(onset - round(_BEFORE * rate), 0)
    response = whole[first : first + round((LONGEST_DURATION + _BEFORE) * rate)]
    onset -= first
    return replace(recording, response=response), Hit(onset, onset + round(_AFTER * rate), response.size)


def _late(about: Floats, rate: float) -> bool:
    """Whether many of the frequencies of an impulse response come at another time than the others."""
    from scipy.signal import stft

    n = round(_ABOUT * rate)
    _, times, lines = stft(about, rate, nperseg=n, noverlap=n - n // 10, boundary=None, padded=False)
    power = np.abs(lines) ** 2
    loudest = power.max(axis=1)
    when = times[power.argmax(axis=1)][loudest > _LOUD * loudest.max()]
    return bool(np.mean(np.abs(when - np.median(when)) > _OFF) > _MOST_OFF)


def _divided(response: Floats, sweep: Floats) -> Floats:
    """The response over the sweep, frequency by frequency, where the sweep has any power."""
    from scipy.fft import irfft, next_fast_len, rfft

    n = next_fast_len(response.size + sweep.size, real=True)
    x = rfft(sweep, n)
    power = np.abs(x) ** 2
    quotient = rfft(response, n) * x.conj() / np.maximum(power, _FLOOR * power.max())
    delay = sweep.size  # a sweep that was heard before it was played would come out negative
    turned = quotient * np.exp(-2j * np.pi * np.arange(x.size) * delay / n)
    return np.asarray(irfft(turned, n))
