"""Spectra of free decays, line by line on one grid of frequencies, and what was between hammer and sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.recordings.hits import LONGEST_DURATION, Hit
from bayesplate.recordings.signals import FrequencyResponse, Motion, Place, Recording

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Rows = NDArray[np.intp]

_ABOVE = 1.25
"""Frequency up to which spectra are kept, over the highest at which modes are looked for."""
_BEFORE_PULSE = 0.001
_MEDIAN = np.sqrt(6.0 * np.log(2.0))
"""Median of the second difference of complex white noise over its root mean square."""


@dataclass(frozen=True, eq=False)
class Spectra:
    """Spectra of decays, or frequency responses, on one grid.

    Attributes
    ----------
    frequency : (n_lines,) array, Hz
    values : (n_lines, n_records) complex array
        From the moment on at which the board rings by itself, without a taper.
    force : (n_lines, n_records) complex array or None
        Spectrum of each hit's force from the same origin of time; one for frequency responses.
    names : tuple of str
        Of the records, "tap.wav hit 3".
    files : (n_records,) array of int
        Which records are hits of one file.
    places : (n_records,) array of int
        Which records were taken between the same two places.
    between : tuple of (Place or None, Place or None)
        The places of hammer and sensor, m.
    duration : float, s
        Of each decay.
    """

    frequency: Floats
    values: Complex
    force: Complex | None
    names: tuple[str, ...]
    files: Rows
    places: Rows
    between: tuple[tuple[Place | None, Place | None], ...]
    motion: Motion
    duration: float

    @property
    def noise(self) -> Floats:
        """Level of each record's noise, robustly from how much neighbouring lines differ: (n_records,) array."""
        second = self.values[2:] - 2.0 * self.values[1:-1] + self.values[:-2]
        level = np.median(np.abs(second), axis=0) / _MEDIAN
        top = np.abs(self.values).max(axis=0)
        return np.asarray(np.maximum(level, 1e-9 * top + 1e-300))

    def only(self, records: Rows) -> Spectra:
        """The same of some records."""
        kept = np.unique(self.places[records])
        return replace(
            self,
            values=self.values[:, records],
            force=None if self.force is None else self.force[:, records],
            names=tuple(self.names[r] for r in records),
            files=self.files[records],
            places=np.searchsorted(kept, self.places[records]),
            between=tuple(self.between[k] for k in kept),
        )


def decay_spectra(heard: Sequence[tuple[Recording, Sequence[Hit]]], highest: float) -> Spectra:
    """Spectra of what follows every hit, all of one length.

    Parameters
    ----------
    heard : sequence of (Recording, sequence of Hit)
        All of one rate, with the hits that can be used.
    highest : float, Hz
        Up to which modes are looked for.
    """
    from scipy.fft import prev_fast_len, rfft

    rate = heard[0][0].rate
    every = [(recording, number, hit) for recording, hits in heard for number, hit in enumerate(hits, start=1)]
    shortest = min(hit.stop - hit.start for _, _, hit in every)
    n_samples = prev_fast_len(min(shortest, round(LONGEST_DURATION * rate)), real=True)
    n_lines = min(int(_ABOVE * highest * n_samples / rate) + 1, n_samples // 2)
    frequency = np.arange(n_lines) * rate / n_samples
    columns, forces = [], []
    for recording, _, hit in every:
        decay = recording.response[hit.start : hit.start + n_samples]
        columns.append(rfft(decay)[:n_lines] / rate)
        if recording.force is not None:
            forces.append(_force_spectrum(recording, hit, frequency))
    between = [(recording.hammer, recording.sensor) for recording, _, _ in every]
    places, distinct = _grouped(between, [recording.name for recording, _, _ in every])
    return Spectra(
        frequency=frequency,
        values=np.stack(columns, axis=1),
        force=np.stack(forces, axis=1) if len(forces) == len(columns) else None,
        names=tuple(f"{recording.name} hit {number}" for recording, number, _ in every),
        files=np.repeat(np.arange(len(heard)), [len(hits) for _, hits in heard]),
        places=places,
        between=distinct,
        motion=heard[0][0].motion,
        duration=n_samples / rate,
    )


def response_spectra(responses: Sequence[FrequencyResponse], highest: float, padding: int = 1) -> Spectra:
    """Frequency responses as they are, up to somewhat above the highest frequency.

    Parameters
    ----------
    responses : sequence of FrequencyResponse
        All on one grid.
    highest : float, Hz
        Up to which modes are looked for.
    padding : int
        How many times as many lines there are as in the records: those at multiples of so many spacings are theirs.
    """
    first = responses[0]
    spacing = float(first.frequency[1] - first.frequency[0])
    lines = np.rint(first.frequency / spacing).astype(np.intp)
    kept = (first.frequency <= _ABOVE * highest) & (lines % padding == 0)
    between = [(one.hammer, one.sensor) for one in responses]
    places, distinct = _grouped(between, [one.name for one in responses])
    values = np.stack([one.values[kept] for one in responses], axis=1).astype(complex)
    return Spectra(
        frequency=first.frequency[kept],
        values=values,
        force=np.ones_like(values),
        names=tuple(one.name for one in responses),
        files=np.arange(len(responses)),
        places=places,
        between=distinct,
        motion=first.motion,
        duration=1.0 / (padding * spacing),
    )


def _force_spectrum(recording: Recording, hit: Hit, frequency: Floats) -> Complex:
    """Of one pulse, from the moment at which the decay begins; outside the pulse the force is noise."""
    assert recording.force is not None
    first = max(hit.onset - round(_BEFORE_PULSE * recording.rate), 0)
    pulse = recording.force[first : hit.start] - np.median(recording.force)
    at = (np.arange(first, hit.start) - hit.start) / recording.rate
    # few samples and many lines: a product is faster than a transform
    return np.asarray(np.exp(-2j * np.pi * np.outer(frequency, at)) @ pulse / recording.rate)


def _grouped(
    between: Sequence[tuple[Place | None, Place | None]], names: Sequence[str]
) -> tuple[Rows, tuple[tuple[Place | None, Place | None], ...]]:
    """Which records share their places; a file of which one place is not known is a pair of places of its own."""
    keys = [name if None in pair else pair for pair, name in zip(between, names, strict=True)]
    order = list(dict.fromkeys(keys))
    places = np.array([order.index(key) for key in keys], dtype=np.intp)
    return places, tuple(between[keys.index(key)] for key in order)
