"""ln f of a board's modes as a function of what a fit moves, with its tangent anywhere."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Values
from bayesplate.frequencies.laws import LawName
from bayesplate.frequencies.model import SetupModel, log_frequencies_of_board


@dataclass(frozen=True, eq=False)
class Predictor:
    """ln f (Hz) of modes, setup after setup, as a function of the (n, n_free) parameters of a fit."""

    values: Callable[[Floats], Values]  # to constants and sizes by name, SI
    models: Sequence[SetupModel]
    law: LawName
    rows: Indices | None = None  # (n_modes,): which of all modes that the models have
    n_constants: int = 3  # the first parameters, logarithms of free rigidities: all others have priors

    def __call__(self, x: Floats) -> Floats:
        """ln f, (n, n_modes), at (n, n_free) parameters."""
        values = self.values(x)
        every = np.concatenate(log_frequencies_of_board(self.models, values, self.law), axis=1)
        return every if self.rows is None else every[:, self.rows]

    def of(self, rows: Indices) -> Predictor:
        """A predictor of some of the modes, by their places among all."""
        return replace(self, rows=rows)

    def of_labelled(self) -> Predictor:
        starts = np.cumsum([0, *(len(model.every_place) for model in self.models)])[:-1]
        both = zip(starts, self.models, strict=True)
        return self.of(np.concatenate([start + np.arange(len(model.places)) for start, model in both]))

    def with_fixed(self, rest: Floats) -> Predictor:
        """A predictor of the first parameters only, the (n_rest,) others held where they are."""
        return replace(self, values=lambda x: self.values(np.concatenate([x, np.tile(rest, (len(x), 1))], axis=1)))

    def tangent(self, at: Floats) -> Predictor:
        """The linear law of the modes at a point: equal to the exact one there, with the same slopes.

        Energies are stationary at a mode (Rayleigh's principle), so that one solution gives all slopes.
        """
        if self.law == "linear":
            return self
        values = self.values(at[None, :])
        return replace(self, models=[model.tangent(values) for model in self.models], law="linear")
