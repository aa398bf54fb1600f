"""Exact frequencies of a board with one more effect, over all sizes that the effect may have.

A laboratory names a mode by its figure. Where an effect breaks the symmetry, modes that crossed without it veer, and
the rank by frequency no longer tells the figure. So each mode is followed to the plate with the effect by the share of
its old shape in the new ones. Within a symmetry class of the plate without the effect the rank decides, as everywhere:
the lower reading is the lower mode, whatever their labels.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Values
from bayesplate.board.material import RIGIDITIES
from bayesplate.diagnosis.baseline import Baseline, symmetry_of
from bayesplate.diagnosis.forms import Form
from bayesplate.frequencies.laws import ExactLaw
from bayesplate.frequencies.model import OtherMode, SetupModel, setup_model
from bayesplate.frequencies.system import system_of
from bayesplate.plate.naming import ModePlace
from bayesplate.plate.reduced import ReducedClass, ReducedOrderModel
from bayesplate.plate.terms import Parity, Weights
from bayesplate.posterior.laplace import exact_models
from bayesplate.posterior.parameters import Parameters

_ACCEPTED_CENTS = 0.05
"""Error of a law where it is checked, cents. It errs more at the ends of a prior: with half a cent here, transverse
shear was 0.7 cents off there, which took two nats from its odds on a half-top."""
_N_SPARE_MODES = 3
"""Modes above the highest labelled one among which the labelled modes are sought."""


@dataclass(frozen=True, eq=False)
class FollowedShapes:
    """Mode shapes of a block without the effect, by which modes are followed to the plate with it."""

    block: ReducedClass
    # (n_modes, r) array: shape times mass of the lowest modes; the product with another shape is the share
    shapes: Floats
    labelled_rows: Indices  # (n_labelled,) array of int: indices of the labelled modes among them
    # tuple of array of int: positions in `labelled_rows` of the modes of one symmetry class, in order of their ranks
    groups: tuple[Indices, ...]

    @classmethod
    def of(
        cls, block: ReducedClass, bare_weights: Weights, labelled_rows: Indices, groups: tuple[Indices, ...]
    ) -> FollowedShapes:
        """The shapes at the weights of one draw without the effect."""
        _, vectors = block.modes(bare_weights, int(labelled_rows.max()) + 1 + _N_SPARE_MODES)
        return cls(block, vectors[0].T @ block.mass(bare_weights)[0], labelled_rows, groups)

    def eigenvalues(self, weights: Weights) -> Floats:
        """Eigenvalue of each labelled mode for many draws: (n_draws, n_labelled) array, s^-2.

        Not a number where the weights are those of no material.
        """
        from scipy.optimize import linear_sum_assignment

        values, vectors = self.block.modes(weights, len(self.shapes) + _N_SPARE_MODES)
        shares = (self.shapes @ vectors) ** 2
        eigenvalues = np.full((len(values), self.labelled_rows.size), np.nan)
        for draw in np.flatnonzero(np.isfinite(values).all(axis=1)):
            picked = linear_sum_assignment(shares[draw], maximize=True)[1][self.labelled_rows]
            eigenvalues[draw] = values[draw, picked]
        for group in self.groups:
            eigenvalues[:, group] = np.sort(eigenvalues[:, group], axis=1)
        return eigenvalues


@dataclass(frozen=True, eq=False)
class FollowedLaw(ExactLaw):
    """The exact law of modes that are followed by their shapes in each block."""

    following: tuple[FollowedShapes, ...] = ()

    def squared(self, weights: Weights) -> Floats:
        """omega^2 in s^-2: (n_draws, n_modes) array; not a number at a draw that is no plate."""
        squared = np.empty((len(weights.stiffness), len(self.reduced.places)))
        for shapes in self.following:
            is_of_block = [place.parity == shapes.block.parity for place in self.reduced.places]
            squared[:, is_of_block] = shapes.eigenvalues(weights)
        return squared


@dataclass(frozen=True, eq=False)
class FormLaw:
    """Frequencies of a form as a function of the constants and of its free parameters."""

    form: Form
    models: tuple[SetupModel, ...]  # with the exact law

    def log_frequencies(self, baseline: Baseline, log_rigidities: Floats, values: Mapping[str, Floats]) -> Floats:
        """ln f (Hz) of labelled modes, (n, n_modes), at (n, n_constants) ln D and (n,) free parameters, SI."""
        return self.mode_log_frequencies(baseline, log_rigidities, values)[:, baseline.rows]

    def mode_log_frequencies(self, baseline: Baseline, log_rigidities: Floats, values: Mapping[str, Floats]) -> Floats:
        """ln f (Hz) of all modes that the baseline's readings may be, at the same values: (n, n_modes) array."""
        all_values = _with_rigidities(baseline, _inputs(baseline, self.form) | dict(values), np.exp(log_rigidities).T)
        by_setup = [model.mode_log_frequencies(all_values, "exact") for model in self.models]
        return np.concatenate(by_setup, axis=1) + baseline.possible_modes.discrepancy

    def with_modes_of(self, baseline: Baseline) -> FormLaw:
        """The same law with the modes of a baseline, which may be another board of the same sizes.

        Where the effect keeps the symmetry, a mode keeps its class and its rank there. Elsewhere it is found by its
        frequency on the plate without the effect, and followed by its shape to the plate with it.
        """
        stations = [
            [self._place_station(baseline, i, station) for station in model.stations]
            for i, model in enumerate(self.models)
        ]
        return replace(self, models=tuple(replace(first, roving_models=tuple(rest)) for first, *rest in stations))

    def _place_station(self, baseline: Baseline, setup: int, model: SetupModel) -> SetupModel:
        """One station of a setup with the modes of a baseline."""
        assert model.exact is not None
        base_places, n_labelled = baseline.possible_modes.places[setup], len(model.setup.readings)
        if symmetry_of([model])[0] == baseline.symmetry[setup]:
            places = base_places
            exact = ExactLaw(replace(model.exact.reduced, places=places))
        else:
            places = self._places_by_frequency(baseline, setup, model)
            reduced = replace(model.exact.reduced, places=places)
            exact = FollowedLaw(reduced, following=self._followed_shapes(baseline, model, reduced, base_places))
        others = tuple(OtherMode(place, None) for place in places[n_labelled:])
        return replace(model, places=places[:n_labelled], other_modes=others, exact=exact)

    def _followed_shapes(
        self, baseline: Baseline, model: SetupModel, reduced: ReducedOrderModel, base_places: Sequence[ModePlace]
    ) -> tuple[FollowedShapes, ...]:
        """Mode shapes of each block without the effect."""
        weights = model.system.weights(self._values_without_effect(baseline))
        followed_shapes = []
        for block in reduced.classes:
            rows = np.flatnonzero([place.parity == block.parity for place in reduced.places])
            classes: dict[object, list[int]] = {}
            for position, row in enumerate(rows):
                classes.setdefault(base_places[int(row)].parity, []).append(position)
            groups = tuple(
                np.array(sorted(members, key=lambda position: base_places[int(rows[position])].rank))
                for members in classes.values()
            )
            ranks = np.array([reduced.places[row].rank for row in rows])
            followed_shapes.append(FollowedShapes.of(block, weights, ranks, groups))
        return tuple(followed_shapes)

    def _values_without_effect(self, baseline: Baseline) -> Values:
        """Values of the baseline with the effect absent, whether its sizes are free or exact."""
        sizes = [
            parameter
            for parameter in self.form.board.parameters
            if parameter.effect and parameter.effect not in baseline.board.effects
        ]
        null_values = {
            parameter.name: np.full(1, parameter.neutral_value)
            for parameter in sizes
            if parameter.neutral_value is not None
        }
        free_rigidities = np.exp(baseline.log_rigidities)[:, None]
        return _with_rigidities(baseline, _inputs(baseline, self.form) | null_values, free_rigidities)

    def _places_by_frequency(self, baseline: Baseline, setup: int, model: SetupModel) -> tuple[ModePlace, ...]:
        """The places of the modes of a setup on the plate with the effect absent, each at a place of its own."""
        from scipy.optimize import linear_sum_assignment

        base_places = baseline.possible_modes.places[setup]
        assert model.exact is not None
        weights = model.system.weights(self._values_without_effect(baseline))
        start = baseline.possible_modes.starts[setup]
        plate_log_frequency = baseline.possible_modes.log_frequency - baseline.possible_modes.discrepancy
        base_log_frequency = plate_log_frequency[start : start + len(base_places)]
        places: dict[int, ModePlace] = {}
        for block in model.exact.reduced.classes:
            rows = [
                i
                for i, place in enumerate(base_places)
                if merged_parity(place.parity, symmetry_of([model])[0]) == block.parity
            ]
            block_log_frequency = 0.5 * np.log(block.eigenvalues(weights)[0]) - np.log(2.0 * np.pi)
            misses = (base_log_frequency[rows, None] - block_log_frequency) ** 2
            for row, rank in zip(*linear_sum_assignment(misses), strict=True):
                position = rows[int(row)]
                places[position] = ModePlace(block.parity, int(rank), base_places[position].correlation)
        return tuple(places[i] for i in range(len(base_places)))


def form_law(baseline: Baseline, form: Form, half_width: float | None = None) -> FormLaw:
    """Solve a form around a baseline and over the prior of its parameters.

    `half_width` is half the width of the region in ln D_x / D_s and ln D_y / D_s, ratios that an isotropic board does
    not have; by default three standard deviations of the fit.
    """
    board = form.board
    parameters = Parameters(board)
    values = dict(_inputs(baseline, form))
    medians = {free.name: np.asarray(free.prior.median) for free in form.free}
    median_values = {**values, **medians, **{n: baseline.values[n] for n in RIGIDITIES}}
    models = tuple(
        _with_modes_of_baseline(setup_model(system_of(board, setup), median_values), baseline, i)
        for i, setup in enumerate(board.setups)
    )
    noise = np.array([setup.noise.median for setup in board.setups])
    centre = parameters.theta(median_values, noise)
    n, covariance = parameters.n_constants, np.eye(parameters.n_dim)
    if half_width is None:
        weighted = baseline.slopes / baseline.scales[:, None]
        covariance[:n, :n] = np.linalg.inv(weighted.T @ weighted)
    else:
        covariance[:n, :n] = np.diag([half_width**2 / 9.0] * (n - 1) + [0.0])
    return FormLaw(form, exact_models(board, models, centre, covariance, accepted_cents=_ACCEPTED_CENTS))


def merged_parity(parity: Parity, symmetry: tuple[bool, bool]) -> Parity:
    """The class of a mode on a plate that has only the given symmetries left."""
    return Parity(parity.x if symmetry[0] else 0, parity.y if symmetry[1] else 0)


def _with_modes_of_baseline(model: SetupModel, baseline: Baseline, setup: int) -> SetupModel:
    """A model with as many modes of each class as the baseline has modes that fall into this class."""
    if model.roving_models:
        first, *rest = (_with_modes_of_baseline(station, baseline, setup) for station in model.stations)
        return replace(first, roving_models=tuple(rest))
    base_places = baseline.possible_modes.places[setup]
    n_readings = len(model.setup.readings)
    if len(base_places) == n_readings:
        return model
    symmetry = symmetry_of([model])[0]
    counts = Counter(merged_parity(place.parity, symmetry) for place in base_places)
    other_places = [ModePlace(parity, rank, 0.0) for parity, n in counts.items() for rank in range(n)]
    if symmetry == baseline.symmetry[setup]:
        other_places = list(base_places[n_readings:])
    return replace(model, other_modes=tuple(OtherMode(place, None) for place in other_places))


def _with_rigidities(baseline: Baseline, values: Values, free: Floats) -> Values:
    """Values with D_x, D_y, D_s from the (n_constants, n) free rigidities, by the Poisson ratio among them."""
    return {**values, **baseline.board.symmetry.rigidities(free, values["poisson_xy"])}


def _inputs(baseline: Baseline, form: Form) -> dict[str, Floats]:
    """The baseline's inputs, and the form's exact ones."""
    exact = {name: np.asarray(q.mean) for name, q in form.board.inputs.items() if q.is_exact}
    return exact | {name: value for name, value in baseline.values.items() if name not in RIGIDITIES}
