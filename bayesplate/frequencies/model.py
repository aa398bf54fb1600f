"""Model of one setup's frequencies: its plate, the places of its modes, and the two laws around an estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values
from bayesplate.board.sessions import discrepancy_names
from bayesplate.board.setup import Setup
from bayesplate.frequencies.columns import squared_frequencies_by_rigidity
from bayesplate.frequencies.laws import ExactLaw, LawName, LinearLaw, log_frequency, mean_log_frequency
from bayesplate.frequencies.residues import residues_of
from bayesplate.frequencies.system import System
from bayesplate.labels import Label
from bayesplate.plate.beams import Beams
from bayesplate.plate.naming import CERTAIN_CORRELATION, ModePlace, find_named_modes, modes_to_hold, name_modes
from bayesplate.plate.plate import Plate
from bayesplate.plate.reduction import reduced_order_model
from bayesplate.plate.solve import Modes, solve_classes, solve_up_to

_FREQUENCY_MARGIN = 1.15
"""Modes are solved up to this multiple of the highest peak: higher ones cannot come down to a peak."""


@dataclass(frozen=True)
class OtherMode:
    """A mode that no reading is labelled with."""

    place: ModePlace
    beams: Beams | None  # orders of the beam functions that its shape resembles; None: it clearly resembles none


@dataclass(frozen=True, eq=False)
class SetupModel:
    """The frequencies of a setup's labelled modes as a function of constants and sizes."""

    system: System
    plate: Plate
    # of each labelled mode, by its shape at the estimate; elsewhere its label means the same rank of the same class
    places: tuple[ModePlace, ...]
    linear: LinearLaw
    exact: ExactLaw | None = None  # None until `with_exact_law`
    # modes without a label, up to above the highest peak; none until `with_other_modes`
    other_modes: tuple[OtherMode, ...] = ()
    # (n_modes,), over the largest that each shape could give; None: places not known
    residues: Floats | None = None
    # models with the roving item at its further places: a frequency is the mean over all places
    roving_models: tuple[SetupModel, ...] = ()

    @property
    def stations(self) -> tuple[SetupModel, ...]:
        """The model with the roving item at each of its places; itself where nothing roved."""
        return (replace(self, roving_models=()), *self.roving_models)

    @property
    def worst_cents(self) -> float:
        """Largest error of the exact law against full solves that it was not trained on, cents."""
        return max(station.exact.reduced.worst_cents for station in self.stations if station.exact is not None)

    @property
    def setup(self) -> Setup:
        return self.system.setup

    def law(self, name: LawName) -> LinearLaw | ExactLaw:
        if name == "linear":
            return self.linear
        if self.exact is None:
            raise ValueError("the exact law of this setup has not been built yet")
        return self.exact

    @property
    def mode_places(self) -> tuple[ModePlace, ...]:
        return (*self.places, *(other.place for other in self.other_modes))

    def log_frequencies(self, values: Values, law: LawName) -> Floats:
        """ln f of each labelled mode: (n_draws, n_labelled) array; not a number where the law gives no frequency."""
        return self.mode_log_frequencies(values, law)[:, : len(self.places)]

    def mode_log_frequencies(self, values: Values, law: LawName) -> Floats:
        """ln f of the labelled modes, then of the others: (n_draws, n_modes) array."""
        log_frequencies = log_frequency(self.law(law).squared(self.system.weights(values)))
        return mean_log_frequency(
            [log_frequencies, *(station.mode_log_frequencies(values, law) for station in self.roving_models)]
        )

    @cached_property
    def _discrepancy_names(self) -> dict[int, tuple[str, str]]:
        """Names of the two parameters whose product is the discrepancy of a mode, by mode."""
        names_by_mode = {i: discrepancy_names(self.setup, label) for i, label in enumerate(self.mode_labels) if label}
        return {i: names for i, names in names_by_mode.items() if names is not None}

    def discrepancies(self, values: Values) -> Floats:
        """ln f of the board less that of its plate, (n_draws, n_modes); one zero where sessions share none."""
        shared = {i: names for i, names in self._discrepancy_names.items() if names[1] in values}
        if not shared:
            return np.zeros((1, 1))
        shifts = {i: np.ravel(values[scale] * values[standard]) for i, (scale, standard) in shared.items()}
        discrepancies = np.zeros((max(shift.size for shift in shifts.values()), len(self.mode_places)))
        for i, shift in shifts.items():
            discrepancies[:, i] = shift
        return discrepancies

    def tangent(self, values: Values) -> SetupModel:
        """The model with the linear law of the exact law's modes at one draw of values."""
        assert self.exact is not None
        linear = self.exact.tangent(self.system.weights(values))
        return replace(
            self, linear=linear, roving_models=tuple(station.tangent(values) for station in self.roving_models)
        )

    @cached_property
    def mode_labels(self) -> tuple[Label | None, ...]:
        """Labels of the readings, then of the other modes; None where a shape clearly resembles no beam functions."""
        first, all_beams = self.setup.first_label, (other.beams for other in self.other_modes)
        return (
            *self.setup.labels,
            *(None if beams is None else Label(beams[0] + first.m, beams[1] + first.n) for beams in all_beams),
        )

    @property
    def mode_beams(self) -> tuple[Beams | None, ...]:
        """Orders of the beam functions of the labelled modes, then of the others."""
        return (*(reading.beams for reading in self.setup.readings), *(other.beams for other in self.other_modes))

    def labelled_as(self, setup: Setup) -> SetupModel:
        """The same modes for a setup with other labels, all of modes that this model has: nothing is solved again."""
        beams = self.mode_beams
        labelled = [beams.index(reading.beams) for reading in setup.readings]
        return self._labelled_as(setup, labelled, [i for i in range(len(beams)) if i not in labelled])

    def _labelled_as(self, setup: Setup, labelled: list[int], unlabelled: list[int]) -> SetupModel:
        beams, order, places = self.mode_beams, [*labelled, *unlabelled], self.mode_places
        exact = self.exact
        if exact is not None:
            exact = ExactLaw(replace(exact.reduced, places=tuple(places[i] for i in order)))
        return replace(
            self,
            system=replace(self.system, setup=setup),
            places=tuple(places[i] for i in labelled),
            linear=LinearLaw(self.linear.stiffness[order], self.linear.mass[order]),
            exact=exact,
            other_modes=tuple(OtherMode(places[i], beams[i]) for i in unlabelled),
            residues=None if self.residues is None else self.residues[order],
            roving_models=tuple(station._labelled_as(setup, labelled, unlabelled) for station in self.roving_models),
        )

    def sensitivities(self, values: Values) -> Floats:
        """d ln f / d ln D at the point where the modes were computed: (n_labelled, 3) array, columns D_x, D_y, D_s.

        It is half the share of each constant in the mode's energy: for the bare thin plate rows sum to one half.
        """
        if self.roving_models:
            return np.asarray(np.mean([station.sensitivities(values) for station in self.stations], axis=0))
        total, without = squared_frequencies_by_rigidity(self.system, values, self.linear.stiffness[: len(self.places)])
        return 0.5 * (1.0 - without / total[:, None])


def setup_model(
    system: System, values: Values, plate: Plate | None = None, as_before: SetupModel | None = None
) -> SetupModel:
    """Solve a setup at given constants and sizes, and identify its labelled modes; with their linear law.

    Labels keep their ranks in the model `as_before`; otherwise modes are identified by their shapes (KeyError where no
    shape fits a label). The plate is by default that of the production mesh.
    """
    previous = (
        [None] * len(system.stations) if as_before is None else [station.places for station in as_before.stations]
    )
    first, *further = (
        _setup_model(station, values, station.plate(values) if plate is None or k else plate, places)
        for k, (station, places) in enumerate(zip(system.stations, previous, strict=True))
    )
    return replace(first, roving_models=tuple(further))


def _setup_model(system: System, values: Values, plate: Plate, places: tuple[ModePlace, ...] | None) -> SetupModel:
    if places is not None:
        return _ranked_model(system, values, plate, places)
    beams = [reading.beams for reading in system.setup.readings]
    weights = system.weights(values).at(0)
    modes = find_named_modes(plate, weights, beams)
    return SetupModel(
        system=system,
        plate=plate,
        places=tuple(modes[b].place for b in beams),
        linear=LinearLaw(
            np.reshape([modes[b].stiffness for b in beams], (len(beams), weights.stiffness.size)),
            np.reshape([modes[b].mass for b in beams], (len(beams), weights.mass.size)),
        ),
    )


def _ranked_model(system: System, values: Values, plate: Plate, places: tuple[ModePlace, ...]) -> SetupModel:
    """The model in which each label means the mode at its place."""
    weights = system.weights(values).at(0)
    energies = {
        parity: modes.coefficients() for parity, modes in solve_classes(plate, weights, modes_to_hold(places)).items()
    }
    stiffness, mass = (
        np.reshape([energies[place.parity][side][place.rank] for place in places], (len(places), weights[side].size))
        for side in (0, 1)
    )
    return SetupModel(system, plate, places, LinearLaw(stiffness, mass))


def with_other_modes(model: SetupModel, values: Values) -> SetupModel:
    """Add the modes without a label, up to above the highest peak and at least one, with their linear law."""
    extended, modes = _with_other_modes(model, values)
    roving_models = tuple(
        _with_other_modes(station, values, len(modes.eigenvalues))[0] for station in model.roving_models
    )
    n_labelled, n_others = len(model.places), min(len(station.other_modes) for station in (extended, *roving_models))
    unlabelled = range(n_labelled, n_labelled + n_others)
    return replace(extended, roving_models=roving_models)._labelled_as(
        model.setup, list(range(n_labelled)), list(unlabelled)
    )


def _with_other_modes(model: SetupModel, values: Values, n_least: int = 0) -> tuple[SetupModel, Modes]:
    setup = model.setup
    highest = 2.0 * np.pi * _FREQUENCY_MARGIN * max([*setup.measured, *setup.unlabelled])
    n_least = max(n_least, 1 + len(model.places))
    modes = solve_up_to(model.plate, model.system.weights(values).at(0), highest**2, n_least)
    index = {(parity, int(rank)): i for i, (parity, rank) in enumerate(zip(modes.parities, modes.ranks, strict=True))}
    labelled = [index.get((place.parity, place.rank)) for place in model.places]
    unlabelled = [i for i in range(len(modes.eigenvalues)) if i not in labelled]
    names = name_modes(modes)
    labelled_beams = {reading.beams for reading in setup.readings}
    other_modes = tuple(
        OtherMode(
            ModePlace(modes.parities[i], int(modes.ranks[i]), names[i][1]),
            names[i][0] if names[i][1] >= CERTAIN_CORRELATION and names[i][0] not in labelled_beams else None,
        )
        for i in unlabelled
    )
    n = len(model.places)
    linear = LinearLaw(
        np.concatenate([model.linear.stiffness[:n], modes.coefficients[unlabelled]]),
        np.concatenate([model.linear.mass[:n], modes.mass_coefficients[unlabelled]]),
    )
    by_mode = residues_of(setup, modes, values, model.system.shaped)
    residues = None
    if by_mode is not None:
        residues = np.array([np.nan if i is None else by_mode[i] for i in [*labelled, *unlabelled]])
    return replace(model, linear=linear, exact=None, other_modes=other_modes, residues=residues), modes


def log_frequencies_of_board(models: Sequence[SetupModel], values: Values, law: LawName) -> list[Floats]:
    """ln f of all modes of each setup, (n_draws, n_modes), with the discrepancies that sessions share."""
    return [model.mode_log_frequencies(values, law) + model.discrepancies(values) for model in models]


def with_exact_law(
    model: SetupModel, centre: Values, around: Sequence[Values], held_out: Sequence[Values], tolerance: float
) -> SetupModel:
    """Add the exact law, trained at `centre` and `around` it and checked at the points `held_out`, in cents."""
    reduced = reduced_order_model(
        model.plate,
        model.mode_places,
        model.system.weights(centre).at(0),
        [model.system.weights(values).at(0) for values in around],
        [model.system.weights(values).at(0) for values in held_out],
        tolerance,
    )
    roving_models = tuple(
        with_exact_law(station, centre, around, held_out, tolerance) for station in model.roving_models
    )
    return replace(model, exact=ExactLaw(reduced), roving_models=roving_models)


def full_log_frequencies(model: SetupModel, values: Values) -> Floats:
    """ln f (Hz) of a setup's labelled modes, (n_labelled,), solved at given constants instead of taken from a law."""
    if model.roving_models:
        return mean_log_frequency([full_log_frequencies(station, values) for station in model.stations])
    classes = solve_classes(model.plate, model.system.weights(values).at(0), modes_to_hold(model.places))
    return log_frequency(np.array([classes[place.parity].eigenvalues[place.rank] for place in model.places]))
