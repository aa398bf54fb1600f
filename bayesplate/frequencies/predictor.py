"""ln f of a board's modes as a function of the parameters of a fit, with its tangent at any point."""

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

    values: Callable[[Floats], Values]  # from parameters to constants and sizes by name, SI
    models: Sequence[SetupModel]
    law: LawName
    rows: Indices | None = None  # (n_modes,): indices of its modes among all of the models; None: all
    n_constants: int = 3  # number of free rigidities: their logarithms are the first parameters; the others have priors

    def __call__(self, x: Floats) -> Floats:
        """ln f, (n, n_modes), at (n, n_free) parameters."""
        values = self.values(x)
        log_frequencies = np.concatenate(log_frequencies_of_board(self.models, values, self.law), axis=1)
        return log_frequencies if self.rows is None else log_frequencies[:, self.rows]

    def of(self, rows: Indices) -> Predictor:
        """A predictor of some of the modes, by their indices among all."""
        return replace(self, rows=rows)

    def of_labelled(self) -> Predictor:
        starts = np.cumsum([0, *(len(model.mode_places) for model in self.models)])[:-1]
        setups = zip(starts, self.models, strict=True)
        return self.of(np.concatenate([start + np.arange(len(model.places)) for start, model in setups]))

    def with_fixed(self, fixed_values: Floats) -> Predictor:
        """A predictor as a function of the first parameters only, the (n_rest,) others held fixed."""
        return replace(
            self, values=lambda x: self.values(np.concatenate([x, np.tile(fixed_values, (len(x), 1))], axis=1))
        )

    def tangent(self, at: Floats) -> Predictor:
        """The linear law of the modes at a point: equal to the exact one there, with the same slopes.

        Energies are stationary at a mode (Rayleigh's principle), so that one solution gives all slopes.
        """
        if self.law == "linear":
            return self
        values = self.values(at[None, :])
        return replace(self, models=[model.tangent(values) for model in self.models], law="linear")
