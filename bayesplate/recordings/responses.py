"""What a figure shows of recordings: frequency responses (H1) with their coherence, or averaged spectra of taps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.recordings.spectra import Spectra

Floats = NDArray[np.float64]


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
    """

    name: str
    frequency: Floats
    level: Floats
    coherence: Floats | None
    n_hits: int


def averaged(spectra: Spectra) -> tuple[Averaged, ...]:
    """The response of each pair of places, from what rings down after the hits.

    H1 is the sum over hits of the conjugate of the force times the response, over the sum of the force's power: noise
    of the response averages out of it. The coherence is the share of the response's power that the force explains.
    """
    found = []
    for place in range(len(spectra.between)):
        own = spectra.places == place
        y, coherence = spectra.values[:, own], None
        if spectra.force is None:
            y = y / np.maximum(np.sqrt(np.mean(np.abs(y) ** 2, axis=0)), 1e-300)
            level = np.sqrt(np.mean(np.abs(y) ** 2, axis=1))
        else:
            f = spectra.force[:, own]
            power = np.maximum(np.sum(np.abs(f) ** 2, axis=1), 1e-300)
            cross = np.sum(f.conj() * y, axis=1)
            level = np.abs(cross) / power
            if own.sum() > 1:
                coherence = np.abs(cross) ** 2 / power / np.maximum(np.sum(np.abs(y) ** 2, axis=1), 1e-300)
        name = spectra.names[int(np.flatnonzero(own)[0])].rpartition(" hit ")[0] or spectra.names[0]
        found.append(Averaged(name, spectra.frequency, level, coherence, int(own.sum())))
    return tuple(found)
