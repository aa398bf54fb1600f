"""What a file holds: a recording of a response, with or without the force, or a frequency response already made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
Place = tuple[float, float]

Motion = Literal["acceleration", "velocity", "displacement", "pressure"]
MOTIONS: tuple[Motion, ...] = ("acceleration", "velocity", "displacement", "pressure")


@dataclass(frozen=True, eq=False)
class Recording:
    """A response over time.

    Attributes
    ----------
    name : str
        Of its file, and of the channel where the file has several.
    rate : float, Hz
    response : (n_samples,) array
        In any unit.
    force : (n_samples,) array or None
        Of the hammer, in any unit; None where it was not recorded.
    motion : str
        What the response is: "acceleration", "velocity", "displacement" or "pressure".
    full_scale : float
        Largest value that the file can hold; infinity for numbers without a limit.
    hammer, sensor : tuple of float or None, m
        Where the board was hit and where it was listened to, from the corner of the edges x0 and y0.
    remarks : tuple of str
        What is told of its file.
    """

    name: str
    rate: float
    response: Floats
    force: Floats | None = None
    motion: Motion = "acceleration"
    full_scale: float = np.inf
    hammer: Place | None = None
    sensor: Place | None = None
    remarks: tuple[str, ...] = ()

    def at(self, hammer: Place | None, sensor: Place | None) -> Recording:
        """The same, taken between two places."""
        return replace(self, hammer=hammer, sensor=sensor)


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """A response over a force as a function of frequency.

    Attributes
    ----------
    frequency : (n_lines,) array, Hz
        Evenly spaced.
    values : (n_lines,) complex array
    coherence : (n_lines,) array or None
    hammer, sensor : tuple of float or None, m
    """

    name: str
    frequency: Floats
    values: Complex
    coherence: Floats | None = None
    motion: Motion = "acceleration"
    hammer: Place | None = None
    sensor: Place | None = None
    remarks: tuple[str, ...] = ()

    def at(self, hammer: Place | None, sensor: Place | None) -> FrequencyResponse:
        """The same, taken between two places."""
        return replace(self, hammer=hammer, sensor=sensor)
