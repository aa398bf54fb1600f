"""Spectra of free decays, line by line on one grid of frequencies, and what was between hammer and sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Complex, Floats, Indices
from bayesplate.recordings.hits import LONGEST_DURATION, Hit
from bayesplate.recordings.signals import FrequencyResponse, Motion, Place, Recording

Rows = Indices
Between = tuple[Place | None, Place | None]
"""Places of hammer and sensor."""

_ABOVE = 1.25
"""Frequency up to which spectra are kept, over the highest at which modes are looked for."""
_BEFORE_PULSE = 0.001
_MEDIAN = np.sqrt(6.0 * np.log(2.0))
"""Median of the second difference of complex white noise over its root mean square."""


@dataclass(frozen=True, eq=False)
class Spectra:
    """Spectra of decays, or frequency responses, on one grid."""

    frequency: Floats  # (n_lines,), Hz
    values: Complex  # (n_lines, n_records): from where the board rings by itself, without a taper
    force: Complex | None  # (n_lines, n_records): of each hit from the same origin of time; 1 for frequency responses
    names: tuple[str, ...]
    files: Rows  # (n_records,): which records are hits of one file
    places: Rows  # (n_records,): which were taken between the same two places
    between: tuple[Between, ...]  # of each of `places`
    motion: Motion
    duration: float  # s, of each decay

    @property
    def spacing(self) -> float:
        return float(self.frequency[1] - self.frequency[0])

    @property
    def noise(self) -> Floats:
        """Level of each record's noise, robustly from how much neighbouring lines differ: (n_records,) array."""
        second = self.values[2:] - 2.0 * self.values[1:-1] + self.values[:-2]
        level = np.median(np.abs(second), axis=0) / _MEDIAN
        top = np.abs(self.values).max(axis=0)
        return np.asarray(np.maximum(level, 1e-9 * top + 1e-300))

    def only(self, records: Rows) -> Spectra:
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
    """Spectra of what follows every hit of recordings of one rate, all of one length, for modes up to some Hz."""
    from scipy.fft import prev_fast_len, rfft

    first = heard[0][0]
    every = [(recording, number, hit) for recording, hits in heard for number, hit in enumerate(hits, start=1)]
    shortest = min(hit.stop - hit.start for _, _, hit in every)
    n_samples = prev_fast_len(min(shortest, round(LONGEST_DURATION * first.rate)), real=True)
    n_lines = min(int(_ABOVE * highest * n_samples / first.rate) + 1, n_samples // 2)
    frequency = np.arange(n_lines) * first.rate / n_samples
    columns = [rfft(one.response[hit.start : hit.start + n_samples])[:n_lines] / one.rate for one, _, hit in every]
    forces = [_force_spectrum(one.force, one.rate, hit, frequency) for one, _, hit in every if one.force is not None]
    places, between = _grouped([one for one, _, _ in every])
    return Spectra(
        frequency=frequency,
        values=np.stack(columns, axis=1),
        force=np.stack(forces, axis=1) if forces else None,
        names=tuple(f"{one.name} hit {number}" for one, number, _ in every),
        files=np.repeat(np.arange(len(heard)), [len(hits) for _, hits in heard]),
        places=places,
        between=between,
        motion=first.motion,
        duration=n_samples / first.rate,
    )


def response_spectra(responses: Sequence[FrequencyResponse], highest: float, padding: int = 1) -> Spectra:
    """Frequency responses on one grid up to somewhat above some Hz; of padded ones the lines of their records."""
    first = responses[0]
    spacing = float(first.frequency[1] - first.frequency[0])
    lines = np.rint(first.frequency / spacing).astype(np.intp)
    kept = (first.frequency <= _ABOVE * highest) & (lines % padding == 0)
    values = np.stack([one.values[kept] for one in responses], axis=1).astype(complex)
    places, between = _grouped(responses)
    return Spectra(
        frequency=first.frequency[kept],
        values=values,
        force=np.ones_like(values),
        names=tuple(one.name for one in responses),
        files=np.arange(len(responses)),
        places=places,
        between=between,
        motion=first.motion,
        duration=1.0 / (padding * spacing),
    )


def _force_spectrum(force: Floats, rate: float, hit: Hit, frequency: Floats) -> Complex:
    """Spectrum of one pulse, its time counted from where the decay begins; outside the pulse the force is noise."""
    first = max(hit.onset - round(_BEFORE_PULSE * rate), 0)
    pulse = force[first : hit.start] - np.median(force)
    at = (np.arange(first, hit.start) - hit.start) / rate
    # few samples and many lines: a product is faster than a transform
    return np.asarray(np.exp(-2j * np.pi * np.outer(frequency, at)) @ pulse / rate)


def _grouped(records: Sequence[Recording | FrequencyResponse]) -> tuple[Rows, tuple[Between, ...]]:
    """Which records share their places; a file of which one place is not known is a pair of places of its own."""
    between = [(one.hammer, one.sensor) for one in records]
    keys = [one.name if None in pair else pair for pair, one in zip(between, records, strict=True)]
    order = list(dict.fromkeys(keys))
    return np.array([order.index(key) for key in keys], dtype=np.intp), tuple(between[keys.index(k)] for k in order)
