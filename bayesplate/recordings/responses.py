"""What a figure shows of recordings: frequency responses (H1) with their coherence, or averaged spectra of taps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.recordings.hits import Hit
from bayesplate.recordings.taking import Heard

Floats = NDArray[np.float64]
_BEFORE = 0.001


@dataclass(frozen=True, eq=False)
class Averaged:
    """The response between two places, averaged over hits.

    Attributes
    ----------
    name : str
        Of its first file.
    frequency : (n_lines,) array, Hz
    level : (n_lines,) array
        Magnitude: of H1 with a force, else root mean square of the hits' spectra, each over its own strength.
    coherence : (n_lines,) array or None
        Of force and response over the hits, 0 to 1; None for one hit or without a force.
    n_hits : int
    """

    name: str
    frequency: Floats
    level: Floats
    coherence: Floats | None
    n_hits: int


def averaged(heard: Heard) -> tuple[Averaged, ...]:
    """The response of each pair of places.

    H1 is the sum over hits of the conjugate of the force times the response, over the sum of the force's power: noise
    of the response averages out of it. The coherence is the share of the response's power that the force explains.
    """
    spectra = heard.spectra
    responses, forces = _whole(heard) if heard.hits else (spectra.values, spectra.force)
    found = []
    for place in range(len(spectra.between)):
        own = spectra.places == place
        y = responses[:, own]
        coherence = None
        if forces is None:
            y = y / np.maximum(np.sqrt(np.mean(np.abs(y) ** 2, axis=0)), 1e-300)
            level = np.sqrt(np.mean(np.abs(y) ** 2, axis=1))
        else:
            f = forces[:, own]
            power = np.maximum(np.sum(np.abs(f) ** 2, axis=1), 1e-300)
            cross = np.sum(f.conj() * y, axis=1)
            level = np.abs(cross) / power
            if own.sum() > 1 and heard.hits:
                coherence = np.abs(cross) ** 2 / power / np.maximum(np.sum(np.abs(y) ** 2, axis=1), 1e-300)
        name = spectra.names[int(np.flatnonzero(own)[0])].rpartition(" hit ")[0] or spectra.names[0]
        found.append(Averaged(name, spectra.frequency, level, coherence, int(own.sum())))
    return tuple(found)


def _whole(heard: Heard) -> tuple[NDArray[np.complex128], NDArray[np.complex128] | None]:
    """Spectra of force and response from before each hit on: decays alone would lack what happens under it."""
    from scipy.fft import rfft

    spectra = heard.spectra
    n_lines = spectra.frequency.size
    responses, forces = [], []
    for recording, hits in heard.hits:
        n = round(spectra.duration * recording.rate)
        for hit in hits:
            first = max(hit.onset - round(_BEFORE * recording.rate), 0)
            responses.append(rfft(_cut(recording.response, first, first + n))[:n_lines])
            if recording.force is not None:
                forces.append(rfft(_pulse(recording.force, hit, first, n))[:n_lines])
    return np.stack(responses, axis=1), np.stack(forces, axis=1) if len(forces) == len(responses) else None


def _cut(signal: Floats, first: int, last: int) -> Floats:
    cut = signal[first:last]
    return np.pad(cut, (0, last - first - cut.size))


def _pulse(force: Floats, hit: Hit, first: int, n: int) -> Floats:
    """The force of one hit; beyond the pulse it is noise and left out."""
    pulse = np.zeros(n)
    length = min(hit.start - first, n)
    pulse[:length] = force[first : first + length] - np.median(force)
    return pulse
