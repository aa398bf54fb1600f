"""Spectra of free decays or frequency responses on one grid of frequencies, with the places of hammer and sensor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Complex, Floats, Indices
from bayesplate.recordings.hits import LONGEST_DURATION, Hit
from bayesplate.recordings.signals import FrequencyResponse, Motion, Place, Recording

PlacePair = tuple[Place | None, Place | None]
"""Places of hammer and sensor."""

_BAND_MARGIN = 1.25
"""Frequency up to which spectra are kept, over the highest at which modes are searched."""
_BEFORE_PULSE = 0.001
_MEDIAN_OVER_RMS = np.sqrt(6.0 * np.log(2.0))
"""Median of the size of the second difference of complex white noise, over the root mean square of the noise."""


@dataclass(frozen=True, eq=False)
class Spectra:
    """Spectra of decays, or frequency responses, on one grid."""

    frequency: Floats  # (n_lines,), Hz
    values: Complex  # (n_lines, n_records): of the free decays, without a taper
    force: Complex | None  # (n_lines, n_records): of each hit from the same origin of time; 1 for frequency responses
    file_names: tuple[str, ...]  # of each record
    files: Indices  # (n_records,): number of the file of each record
    hits: Indices  # (n_records,): number of the hit in its file, from 1 on; 0 for frequency responses
    places: Indices  # (n_records,): number of the pair of places of each record
    place_pairs: tuple[PlacePair, ...]  # the pairs of places
    motion: Motion
    duration: float  # s, of each decay

    @property
    def spacing(self) -> float:
        return float(self.frequency[1] - self.frequency[0])

    @property
    def n_records(self) -> int:
        return self.files.size

    @property
    def noise(self) -> Floats:
        """Level of each record's noise, from the median difference of neighbouring lines: (n_records,) array."""
        second = self.values[2:] - 2.0 * self.values[1:-1] + self.values[:-2]
        level = np.median(np.abs(second), axis=0) / _MEDIAN_OVER_RMS
        top = np.abs(self.values).max(axis=0)
        return np.asarray(np.maximum(level, 1e-9 * top + 1e-300))

    def of_records(self, records: Indices) -> Spectra:
        kept_places = np.unique(self.places[records])
        return replace(
            self,
            values=self.values[:, records],
            force=None if self.force is None else self.force[:, records],
            file_names=tuple(self.file_names[r] for r in records),
            files=self.files[records],
            hits=self.hits[records],
            places=np.searchsorted(kept_places, self.places[records]),
            place_pairs=tuple(self.place_pairs[k] for k in kept_places),
        )


def decay_spectra(hits_by_recording: Sequence[tuple[Recording, Sequence[Hit]]], highest: float) -> Spectra:
    """Spectra of the decays after all hits of recordings of one rate, cut to one length, for modes up to some Hz."""
    from scipy.fft import prev_fast_len, rfft

    first = hits_by_recording[0][0]
    all_hits = [(recording, hit) for recording, hits in hits_by_recording for hit in hits]
    shortest = min(hit.stop - hit.start for _, hit in all_hits)
    n_samples = prev_fast_len(min(shortest, round(LONGEST_DURATION * first.rate)), real=True)
    n_lines = min(int(_BAND_MARGIN * highest * n_samples / first.rate) + 1, n_samples // 2)
    frequency = np.arange(n_lines) * first.rate / n_samples
    columns = [
        rfft(recording.response[hit.start : hit.start + n_samples])[:n_lines] / recording.rate
        for recording, hit in all_hits
    ]
    forces = [
        _force_spectrum(recording.force, recording.rate, hit, frequency)
        for recording, hit in all_hits
        if recording.force is not None
    ]
    places, between = _group_by_places([recording for recording, _ in all_hits])
    return Spectra(
        frequency=frequency,
        values=np.stack(columns, axis=1),
        force=np.stack(forces, axis=1) if forces else None,
        file_names=tuple(recording.name for recording, _ in all_hits),
        files=np.repeat(np.arange(len(hits_by_recording)), [len(hits) for _, hits in hits_by_recording]),
        hits=np.array([hit.number for _, hit in all_hits], dtype=np.intp),
        places=places,
        place_pairs=between,
        motion=first.motion,
        duration=n_samples / first.rate,
    )


def response_spectra(responses: Sequence[FrequencyResponse], highest: float, padding: int = 1) -> Spectra:
    """Frequency responses on one grid for modes up to some Hz; of padded ones only the lines of the record are kept."""
    first = responses[0]
    spacing = float(first.frequency[1] - first.frequency[0])
    lines = np.rint(first.frequency / spacing).astype(np.intp)
    kept_lines = (first.frequency <= _BAND_MARGIN * highest) & (lines % padding == 0)
    values = np.stack([response.values[kept_lines] for response in responses], axis=1).astype(complex)
    places, between = _group_by_places(responses)
    return Spectra(
        frequency=first.frequency[kept_lines],
        values=values,
        force=np.ones_like(values),
        file_names=tuple(response.name for response in responses),
        files=np.arange(len(responses)),
        hits=np.zeros(len(responses), dtype=np.intp),
        places=places,
        place_pairs=between,
        motion=first.motion,
        duration=1.0 / (padding * spacing),
    )


def _force_spectrum(force: Floats, rate: float, hit: Hit, frequency: Floats) -> Complex:
    """Spectrum of one pulse, with time counted from the start of the decay; outside the pulse the force is noise."""
    first = max(hit.onset - round(_BEFORE_PULSE * rate), 0)
    pulse = force[first : hit.start] - np.median(force)
    times = (np.arange(first, hit.start) - hit.start) / rate
    # few samples and many lines: a product is faster than a transform
    return np.asarray(np.exp(-2j * np.pi * np.outer(frequency, times)) @ pulse / rate)


def _group_by_places(records: Sequence[Recording | FrequencyResponse]) -> tuple[Indices, tuple[PlacePair, ...]]:
    """Number of the pair of places of each record, and the pairs; a file with an unknown place is a pair of its own."""
    pairs = [(record.hammer, record.sensor) for record in records]
    keys = [record.name if None in pair else pair for pair, record in zip(pairs, records, strict=True)]
    order = list(dict.fromkeys(keys))
    return np.array([order.index(key) for key in keys], dtype=np.intp), tuple(pairs[keys.index(k)] for k in order)
