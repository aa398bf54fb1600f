"""The lowest modes of a setup with their labels, and conflicts of measured labels and signs with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.board.board import Values
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Effect
from bayesplate.frequencies.model import SetupModel
from bayesplate.frequencies.residues import NODAL_LINE, residues_of
from bayesplate.frequencies.system import System
from bayesplate.labels import Label
from bayesplate.plate.naming import CERTAIN_CORRELATION, name_modes
from bayesplate.plate.plate import Plate
from bayesplate.plate.solve import Modes, solve

_FEWEST_MODES = 12


@dataclass(frozen=True)
class NamedMode:
    label: Label | None  # None where no product of beam functions fits
    frequency: float  # Hz
    correlation: float  # with the product that the label names

    @property
    def name(self) -> str:
        return "cannot tell" if self.label is None else str(self.label)


def spectrum(
    system: System, values: Values, n_modes: int, plate: Plate | None = None
) -> tuple[Modes, tuple[NamedMode, ...]]:
    """Lowest modes of a setup at given constants and sizes, and their names, in the order of frequency."""
    plate = system.plate(values) if plate is None else plate
    modes = solve(plate, system.weights(values).at(0), n_modes)
    first = system.setup.first_label
    named_modes = []
    for eigenvalue, ((i, j), correlation) in zip(modes.eigenvalues, name_modes(modes), strict=True):
        label = Label(i + first.m, j + first.n) if correlation >= CERTAIN_CORRELATION else None
        named_modes.append(NamedMode(label, float(np.sqrt(eigenvalue) / (2.0 * np.pi)), correlation))
    return modes, tuple(named_modes)


def spectra(models: Sequence[SetupModel], values: Values) -> dict[str, tuple[Modes, tuple[NamedMode, ...]]]:
    """Spectrum of every setup with a hammer, to compare signs with; at least two modes for each reading."""
    by_setup = {}
    for model in models:
        setup = model.setup
        if setup.hammer is not None:
            n_modes = max(_FEWEST_MODES, 2 * len(setup.readings))
            by_setup[setup.name] = spectrum(model.system, values, n_modes, model.plate)
    return by_setup


def doubtful_labels(models: Sequence[SetupModel]) -> tuple[str, ...]:
    """A sentence for each mode with a sure label that its shape does not clearly fit."""
    return tuple(
        f"setup {model.setup.name}: the shape of mode {reading.label} fits its label only to {place.correlation:.2f}; "
        "it may be its neighbour at a veering"
        for model in models
        for reading, place in zip(model.setup.readings, model.places, strict=True)
        if reading.is_sure and place.correlation < CERTAIN_CORRELATION
    )


def sign_conflicts(
    setup: Setup, modes: Modes, named: tuple[NamedMode, ...], values: Values, shaped: Effect | None = None
) -> tuple[str, ...]:
    """Sentences on labels whose measured sign of the residue differs from that of the shape.

    Only where the setup states signs and both places are known and away from nodal lines, near which the sign is
    uncertain.
    """
    stated = {reading.label: reading.sign for reading in setup.readings if reading.sign}
    residues = residues_of(setup, modes, values, shaped) if stated else None
    if residues is None:
        return ()
    sentences = []
    for mode, residue in zip(named, residues, strict=True):
        expected = "+" if residue > 0 else "-"
        if mode.label in stated and stated[mode.label] != expected and abs(residue) > NODAL_LINE:
            sentences.append(
                f"setup {setup.name}: mode {mode.name} should have sign {expected} between hammer and sensor, the card "
                f"says {stated[mode.label]}: check its label"
            )
    return tuple(sentences)
