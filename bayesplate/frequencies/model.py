"""Frequencies of one setup: its plate, the places of its modes, and the two laws around an estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values
from bayesplate.board.sessions import discrepancy_names
from bayesplate.board.setup import Setup
from bayesplate.frequencies.columns import with_and_without
from bayesplate.frequencies.laws import ExactLaw, LawName, LinearLaw, log_frequency, mean_log_frequency
from bayesplate.frequencies.residues import residues_of
from bayesplate.frequencies.system import System
from bayesplate.labels import Label
from bayesplate.plate.beams import Beams
from bayesplate.plate.naming import CERTAIN, Place, find, name_modes, reaching
from bayesplate.plate.plate import Plate
from bayesplate.plate.reduction import reduced_order_model
from bayesplate.plate.solve import Modes, solve_classes, solve_up_to

_ABOVE = 1.15
"""Frequency up to which modes are looked for, over the highest peak: what lies higher will not come down to it."""


@dataclass(frozen=True)
class OtherMode:
    """A mode that no reading is labelled with."""

    place: Place
    beams: Beams | None  # orders of the beam functions that its shape resembles; None: clearly of none


def every_label(setup: Setup, others: Sequence[OtherMode]) -> tuple[Label | None, ...]:
    """Labels of a setup's readings, then of other modes; None where a shape clearly resembles no beam functions."""
    first, beams = setup.first_label, (other.beams for other in others)
    return (*setup.labels, *(None if one is None else Label(one[0] + first.m, one[1] + first.n) for one in beams))


@dataclass(frozen=True, eq=False)
class SetupModel:
    """The frequencies of a setup's labelled modes as a function of constants and sizes."""

    system: System
    plate: Plate
    # of each labelled mode at the estimate; from there on a label means this rank of this class
    places: tuple[Place, ...]
    linear: LinearLaw
    exact: ExactLaw | None = None  # None until `with_exact`
    others: tuple[OtherMode, ...] = ()  # modes without a label, up to above the highest peak; none until `with_others`
    # (n_modes + n_others,), over the largest that each shape could give; None: places not known
    residues: Floats | None = None
    # the modes with what roved at its further places: a frequency is the mean over all
    roved: tuple[SetupModel, ...] = ()

    @property
    def stations(self) -> tuple[SetupModel, ...]:
        """The model with what roved at each of its places, the first one first; itself where nothing did."""
        return (replace(self, roved=()), *self.roved)

    @property
    def worst_cents(self) -> float:
        """Largest error of the exact law against full solves that it was not trained on, cents."""
        return max(one.exact.reduced.worst_cents for one in self.stations if one.exact is not None)

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
    def every_place(self) -> tuple[Place, ...]:
        return (*self.places, *(other.place for other in self.others))

    def log_frequencies(self, values: Values, law: LawName) -> Floats:
        """ln f of each labelled mode: (n_draws, n_modes) array; not a number where the law gives no frequency."""
        return self.every_log_frequency(values, law)[:, : len(self.places)]

    def every_log_frequency(self, values: Values, law: LawName) -> Floats:
        """ln f of the labelled modes, then of the others: (n_draws, n_modes + n_others) array."""
        own = log_frequency(self.law(law).squared(self.system.weights(values)))
        return mean_log_frequency([own, *(one.every_log_frequency(values, law) for one in self.roved)])

    @cached_property
    def _discrepancy_names(self) -> dict[int, tuple[str, str]]:
        """Names of the two parameters whose product is the discrepancy of a mode, by mode."""
        names = {i: discrepancy_names(self.setup, label) for i, label in enumerate(self.every_label) if label}
        return {i: both for i, both in names.items() if both is not None}

    def discrepancies(self, values: Values) -> Floats:
        """ln f of the board less that of its plate, (n_draws, n_every); a single zero where no session shares any."""
        known = {i: names for i, names in self._discrepancy_names.items() if names[1] in values}
        if not known:
            return np.zeros((1, 1))
        shifts = {i: np.ravel(values[scale] * values[standard]) for i, (scale, standard) in known.items()}
        found = np.zeros((max(one.size for one in shifts.values()), len(self.every_place)))
        for i, shift in shifts.items():
            found[:, i] = shift
        return found

    def tangent(self, values: Values) -> SetupModel:
        """A model with the linear law of the modes that the exact law has at one draw of values."""
        assert self.exact is not None
        linear = self.exact.tangent(self.system.weights(values))
        return replace(self, linear=linear, roved=tuple(one.tangent(values) for one in self.roved))

    @cached_property
    def every_label(self) -> tuple[Label | None, ...]:
        return every_label(self.setup, self.others)

    @property
    def every_beams(self) -> tuple[Beams | None, ...]:
        """Orders of the beam functions of the labelled modes, then of the others."""
        return (*(reading.beams for reading in self.setup.readings), *(other.beams for other in self.others))

    def labelled_as(self, setup: Setup) -> SetupModel:
        """A model of the same modes where other readings have labels, each of a mode that it has: nothing is solved."""
        beams = self.every_beams
        labelled = [beams.index(reading.beams) for reading in setup.readings]
        return self._labelled_as(setup, labelled, [i for i in range(len(beams)) if i not in labelled])

    def _labelled_as(self, setup: Setup, labelled: list[int], rest: list[int]) -> SetupModel:
        beams, order, places = self.every_beams, [*labelled, *rest], self.every_place
        exact = self.exact
        if exact is not None:
            exact = ExactLaw(replace(exact.reduced, places=tuple(places[i] for i in order)))
        return replace(
            self,
            system=replace(self.system, setup=setup),
            places=tuple(places[i] for i in labelled),
            linear=LinearLaw(self.linear.stiffness[order], self.linear.mass[order]),
            exact=exact,
            others=tuple(OtherMode(places[i], beams[i]) for i in rest),
            residues=None if self.residues is None else self.residues[order],
            roved=tuple(one._labelled_as(setup, labelled, rest) for one in self.roved),
        )

    def sensitivities(self, values: Values) -> Floats:
        """d ln f / d ln D at the point where the model was made: (n_modes, 3) array, columns D_x, D_y, D_s.

        Half the share of each constant in the mode's energy: for the bare thin plate rows sum to one half.
        """
        if self.roved:
            return np.asarray(np.mean([one.sensitivities(values) for one in self.stations], axis=0))
        total, without = with_and_without(self.system, values, self.linear.stiffness[: len(self.places)])
        return 0.5 * (1.0 - without / total[:, None])


def setup_model(
    system: System, values: Values, plate: Plate | None = None, as_before: SetupModel | None = None
) -> SetupModel:
    """Solve a setup at given constants and sizes, and find its labelled modes; with its linear law.

    Labels keep their ranks in the model `as_before`; otherwise they are found by the shapes (KeyError if there is
    none). The plate is by default that of the production mesh.
    """
    before = [None] * len(system.stations) if as_before is None else [one.places for one in as_before.stations]
    first, *further = (
        _setup_model(one, values, one.plate(values) if plate is None or k else plate, places)
        for k, (one, places) in enumerate(zip(system.stations, before, strict=True))
    )
    return replace(first, roved=tuple(further))


def _setup_model(system: System, values: Values, plate: Plate, places: tuple[Place, ...] | None) -> SetupModel:
    if places is not None:
        return _ranked_model(system, values, plate, places)
    beams = [reading.beams for reading in system.setup.readings]
    weights = system.weights(values).at(0)
    found = find(plate, weights, beams)
    return SetupModel(
        system=system,
        plate=plate,
        places=tuple(found[b].place for b in beams),
        linear=LinearLaw(
            np.reshape([found[b].stiffness for b in beams], (len(beams), weights.stiffness.size)),
            np.reshape([found[b].mass for b in beams], (len(beams), weights.mass.size)),
        ),
    )


def _ranked_model(system: System, values: Values, plate: Plate, places: tuple[Place, ...]) -> SetupModel:
    """The model in which each label means the mode at its place."""
    weights = system.weights(values).at(0)
    energies = {parity: one.coefficients() for parity, one in solve_classes(plate, weights, reaching(places)).items()}
    stiffness, mass = (
        np.reshape([energies[one.parity][side][one.rank] for one in places], (len(places), weights[side].size))
        for side in (0, 1)
    )
    return SetupModel(system, plate, places, LinearLaw(stiffness, mass))


def with_others(model: SetupModel, values: Values) -> SetupModel:
    """Add the modes without a label, at least one, up to above the highest peak, with their linear law."""
    found, modes = _with_others(model, values)
    roved = tuple(_with_others(one, values, len(modes.eigenvalues))[0] for one in model.roved)
    n_labelled, n_others = len(model.places), min(len(one.others) for one in (found, *roved))
    rest = range(n_labelled, n_labelled + n_others)
    return replace(found, roved=roved)._labelled_as(model.setup, list(range(n_labelled)), list(rest))


def _with_others(model: SetupModel, values: Values, n_least: int = 0) -> tuple[SetupModel, Modes]:
    setup = model.setup
    highest = 2.0 * np.pi * _ABOVE * max([*setup.measured, *setup.unlabelled])
    n_least = max(n_least, 1 + len(model.places))
    modes = solve_up_to(model.plate, model.system.weights(values).at(0), highest**2, n_least)
    at = {(parity, int(rank)): i for i, (parity, rank) in enumerate(zip(modes.parities, modes.ranks, strict=True))}
    labelled = [at.get((place.parity, place.rank)) for place in model.places]
    rest = [i for i in range(len(modes.eigenvalues)) if i not in labelled]
    named = name_modes(modes)
    taken = {reading.beams for reading in setup.readings}
    others = tuple(
        OtherMode(
            Place(modes.parities[i], int(modes.ranks[i]), named[i][1]),
            named[i][0] if named[i][1] >= CERTAIN and named[i][0] not in taken else None,
        )
        for i in rest
    )
    n = len(model.places)
    linear = LinearLaw(
        np.concatenate([model.linear.stiffness[:n], modes.coefficients[rest]]),
        np.concatenate([model.linear.mass[:n], modes.mass_coefficients[rest]]),
    )
    by_mode = residues_of(setup, modes, values, model.system.shaped)
    residues = None
    if by_mode is not None:
        residues = np.array([np.nan if i is None else by_mode[i] for i in [*labelled, *rest]])
    return replace(model, linear=linear, exact=None, others=others, residues=residues), modes


def log_frequencies_of_board(models: Sequence[SetupModel], values: Values, law: LawName) -> list[Floats]:
    """ln f of all modes of each setup, (n_draws, n_every), with the discrepancies that sessions share."""
    return [model.every_log_frequency(values, law) + model.discrepancies(values) for model in models]


def with_exact(
    model: SetupModel, centre: Values, around: Sequence[Values], held_out: Sequence[Values], tolerance: float
) -> SetupModel:
    """Add the exact law, trained at `centre` and `around` it and checked at the points `held_out`, in cents."""
    reduced = reduced_order_model(
        model.plate,
        model.every_place,
        model.system.weights(centre).at(0),
        [model.system.weights(values).at(0) for values in around],
        [model.system.weights(values).at(0) for values in held_out],
        tolerance,
    )
    roved = tuple(with_exact(one, centre, around, held_out, tolerance) for one in model.roved)
    return replace(model, exact=ExactLaw(reduced), roved=roved)


def full_log_frequencies(model: SetupModel, values: Values) -> Floats:
    """ln f (Hz) of a setup's labelled modes, (n_modes,), solved at given constants instead of taken from a law."""
    if model.roved:
        return mean_log_frequency([full_log_frequencies(one, values) for one in model.stations])
    solved = solve_classes(model.plate, model.system.weights(values).at(0), reaching(model.places))
    return log_frequency(np.array([solved[place.parity].eigenvalues[place.rank] for place in model.places]))
