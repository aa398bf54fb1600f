"""All modes that the readings of a board may be, linear in constants and inputs around an estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.refit import Predict
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.modes.naming import Place

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Spectrum:
    """All modes of a board's setups, one setup after the other: the labelled ones first, then those of peaks.

    Attributes
    ----------
    log_frequency : (n_every,) array
        ln f (Hz) at the estimate.
    slopes : (n_every, n_constants) array
        d ln f / d ln D.
    input_slopes : (n_every, n_inputs) array
        d ln f / d z.
    places : tuple of tuple of Place
        One tuple per setup.
    inputs : (n_inputs,) array
        z at the estimate.
    peaks : tuple of PeakLikelihood or None
        For each setup what its peaks say of its modes; None where all labels are certain.
    predict : callable, optional
        ln f (Hz) of all of them as a function of x, without an effect; by default linear.
    discrepancy : (n_every,) array or 0
        ln f of the board less that of its plate, at the estimate: `bayesplate.board.sessions`.
    """

    log_frequency: Floats
    slopes: Floats
    input_slopes: Floats
    places: tuple[tuple[Place, ...], ...]
    inputs: Floats
    peaks: tuple[PeakLikelihood | None, ...]
    predict: Predict | None = None
    discrepancy: Floats | float = 0.0

    @cached_property
    def flat_places(self) -> tuple[Place, ...]:
        """Places of all modes."""
        return tuple(place for part in self.places for place in part)

    @cached_property
    def starts(self) -> Rows:
        """Where each setup begins: (n_setups,) array."""
        return np.cumsum([0, *(len(part) for part in self.places)])[:-1]

    @property
    def is_open(self) -> bool:
        """Whether a reading may be another mode than its label says."""
        return any(peaks is not None for peaks in self.peaks)

    def first_of_each(self, counts: Sequence[int]) -> Rows:
        """The first so many modes of each setup: (sum of counts,) array."""
        return np.concatenate([start + np.arange(n) for start, n in zip(self.starts, counts, strict=True)])
