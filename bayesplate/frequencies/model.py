"""Frequencies of one setup: its plate, the places of its labelled modes, and the two laws around an estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.laws import ExactLaw, Law, LawName, LinearLaw, log_frequency
from bayesplate.frequencies.system import System
from bayesplate.modes.naming import Place, find
from bayesplate.modes.plate import PlateMatrices
from bayesplate.modes.reduced import reduced_order_model
from bayesplate.plate.board import Values
from bayesplate.plate.setup import Setup


@dataclass(frozen=True, eq=False)
class SetupModel:
    """The frequencies of a setup's labelled modes as a function of constants and sizes.

    Attributes
    ----------
    system : System
        The setup and its effects.
    plate : PlateMatrices
    places : tuple of Place
        Where each labelled mode stands at the estimate; from there on a label means this rank of this class.
    linear : LinearLaw
    exact : ExactLaw or None
        None until `with_exact` has built it.
    """

    system: System
    plate: PlateMatrices
    places: tuple[Place, ...]
    linear: LinearLaw
    exact: ExactLaw | None = None

    @property
    def setup(self) -> Setup:
        """The setup."""
        return self.system.setup

    def law(self, name: LawName) -> Law:
        """The law of that name."""
        if name == "linear":
            return self.linear
        if self.exact is None:
            raise ValueError("the exact law of this setup has not been built yet")
        return self.exact

    def log_frequencies(self, values: Values, law: LawName) -> NDArray[np.float64]:
        """ln f of each labelled mode: (n_draws, n_modes) array; not a number where the law gives no frequency."""
        return log_frequency(self.law(law).squared(self.system.weights(values)))

    def sensitivities(self, values: Values) -> NDArray[np.float64]:
        """d ln f / d ln D at the point where the model was made: (n_modes, 3) array, columns D_x, D_y, D_s.

        Half the share of each constant in the mode's energy: for the bare thin plate rows sum to one half.
        """
        total = self.linear.stiffness @ self.system.weights(values).stiffness[0]
        columns = []
        for name in ("D_x", "D_y", "D_s"):
            without = self.system.weights({**values, name: 0.0 * values[name]}).stiffness[0]
            columns.append(0.5 * (1.0 - self.linear.stiffness @ without / total))
        return np.column_stack(columns)


def setup_model(system: System, values: Values, plate: PlateMatrices | None = None) -> SetupModel:
    """Solve a setup at given constants and sizes, and find its labelled modes.

    Parameters
    ----------
    system : System
    values : dict of float
        D_x, D_y, D_s (N m), the board's inputs and the effects' parameters.
    plate : PlateMatrices, optional
        Matrices to use again; by default those of the production mesh for these values.

    Returns
    -------
    SetupModel
        With its linear law.

    Raises
    ------
    KeyError
        If a label is no mode of the plate.
    """
    plate = system.plate(values) if plate is None else plate
    beams = [reading.beams for reading in system.setup.readings]
    found = find(plate, system.weights(values).at(0), beams)
    return SetupModel(
        system=system,
        plate=plate,
        places=tuple(found[b].place for b in beams),
        linear=LinearLaw(np.stack([found[b].stiffness for b in beams]), np.stack([found[b].mass for b in beams])),
    )


def with_exact(model: SetupModel, centre: Values, around: Sequence[Values], held_out: Sequence[Values]) -> SetupModel:
    """Add the exact law, trained at `centre` and `around` it and checked at the points `held_out`."""
    reduced = reduced_order_model(
        model.plate,
        model.places,
        model.system.weights(centre).at(0),
        [model.system.weights(values).at(0) for values in around],
        [model.system.weights(values).at(0) for values in held_out],
    )
    return replace(model, exact=ExactLaw(reduced))
