"""Exact frequencies of a board with one more effect, over all sizes that the effect may have.

A laboratory names a mode by its figure. Where an effect breaks the symmetry, modes that crossed before now veer, and
the rank by frequency no longer says which figure it is. So each mode is sought among those of the plate with the effect
by its share in the shape that it has without. Within a symmetry class of the plate without the effect the rank decides,
there as everywhere: the lower reading is the lower mode, whatever the two are called.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values
from bayesplate.board.material import RIGIDITIES
from bayesplate.diagnosis.baseline import Baseline, Rows, symmetry_of
from bayesplate.diagnosis.forms import Form
from bayesplate.frequencies.laws import ExactLaw
from bayesplate.frequencies.model import OtherMode, SetupModel, setup_model
from bayesplate.frequencies.system import system_of
from bayesplate.plate.naming import Place
from bayesplate.plate.reduced import ReducedClass, ReducedOrderModel
from bayesplate.plate.terms import Parity, Weights
from bayesplate.posterior.laplace import exact_models
from bayesplate.posterior.parameters import Parameters

_ACCEPTED_CENTS = 0.05
"""Error of a law where it is checked, cents. It errs more at the ends of a prior: with half a cent here, transverse
shear was 0.7 cents off there, which took two nats from its odds on a half-top."""
_BEYOND = 3
"""Modes above the wanted ones among which these are sought."""


@dataclass(frozen=True, eq=False)
class Following:
    """Shapes of a block without the effect."""

    block: ReducedClass
    # (n_modes, r) array: shape times mass of its lowest modes: their product with another shape is the share
    shapes: Floats
    wanted: Rows  # (n_wanted,) array of int: which of them are labelled
    # tuple of array of int: positions in `wanted` of the modes of one symmetry class, in the order of their ranks
    groups: tuple[Rows, ...]

    @classmethod
    def of(cls, block: ReducedClass, without: Weights, wanted: Rows, groups: tuple[Rows, ...]) -> Following:
        """Take the shapes at the weights of one draw without the effect."""
        _, vectors = block.modes(without, int(wanted.max()) + 1 + _BEYOND)
        return cls(block, vectors[0].T @ block.mass(without)[0], wanted, groups)

    def eigenvalues(self, weights: Weights) -> Floats:
        """Eigenvalue of each labelled mode for many draws: (n_draws, n_wanted) array, s^-2.

        Not a number where the weights are those of no material.
        """
        from scipy.optimize import linear_sum_assignment

        values, vectors = self.block.modes(weights, len(self.shapes) + _BEYOND)
        shares = (self.shapes @ vectors) ** 2
        found = np.full((len(values), self.wanted.size), np.nan)
        for draw in np.flatnonzero(np.isfinite(values).all(axis=1)):
            picked = linear_sum_assignment(shares[draw], maximize=True)[1][self.wanted]
            found[draw] = values[draw, picked]
        for group in self.groups:
            found[:, group] = np.sort(found[:, group], axis=1)
        return found


@dataclass(frozen=True, eq=False)
class FollowedLaw(ExactLaw):
    """The exact law of modes that are followed by their shapes, block by block."""

    following: tuple[Following, ...] = ()

    def squared(self, weights: Weights) -> Floats:
        """omega^2 in s^-2: (n_draws, n_modes) array; not a number at a draw that is no plate."""
        squared = np.empty((len(weights.stiffness), len(self.reduced.places)))
        for each in self.following:
            own = [place.parity == each.block.parity for place in self.reduced.places]
            squared[:, own] = each.eigenvalues(weights)
        return squared


@dataclass(frozen=True, eq=False)
class FormLaw:
    """Frequencies of a form as a function of the constants and of its free parameters."""

    form: Form
    models: tuple[SetupModel, ...]  # with the exact law

    def log_frequencies(self, baseline: Baseline, log_rigidities: Floats, values: Mapping[str, Floats]) -> Floats:
        """ln f (Hz) of labelled modes, (n, n_modes), at (n, n_constants) ln D and (n,) free parameters, SI."""
        return self.every_log_frequency(baseline, log_rigidities, values)[:, baseline.rows]

    def every_log_frequency(self, baseline: Baseline, log_rigidities: Floats, values: Mapping[str, Floats]) -> Floats:
        """ln f (Hz) of all modes that the baseline's readings may be, at the same values: (n, n_every) array."""
        there = _with_rigidities(baseline, _inputs(baseline, self.form) | dict(values), np.exp(log_rigidities).T)
        parts = [model.every_log_frequency(there, "exact") for model in self.models]
        return np.concatenate(parts, axis=1) + baseline.every.discrepancy

    def placed(self, baseline: Baseline) -> FormLaw:
        """The same law with the modes of a baseline, which may be another board of the same sizes.

        Where the effect keeps the symmetry a mode keeps its class and its rank there. Elsewhere it is found by its
        frequency without the effect, and followed from there by its shape.
        """
        stations = [[self._placed(baseline, i, one) for one in model.stations] for i, model in enumerate(self.models)]
        return replace(self, models=tuple(replace(first, roved=tuple(rest)) for first, *rest in stations))

    def _placed(self, baseline: Baseline, setup: int, model: SetupModel) -> SetupModel:
        """One station of a setup with the modes of a baseline."""
        assert model.exact is not None
        of_base, n_labelled = baseline.every.places[setup], len(model.setup.readings)
        if symmetry_of([model])[0] == baseline.symmetry[setup]:
            places = of_base
            exact = ExactLaw(replace(model.exact.reduced, places=places))
        else:
            places = self._by_frequency(baseline, setup, model)
            reduced = replace(model.exact.reduced, places=places)
            exact = FollowedLaw(reduced, following=self._followed(baseline, model, reduced, of_base))
        others = tuple(OtherMode(place, None) for place in places[n_labelled:])
        return replace(model, places=places[:n_labelled], others=others, exact=exact)

    def _followed(
        self, baseline: Baseline, model: SetupModel, reduced: ReducedOrderModel, of_base: Sequence[Place]
    ) -> tuple[Following, ...]:
        """Shapes without the effect, block by block."""
        weights = model.system.weights(self._without(baseline))
        result = []
        for block in reduced.classes:
            rows = np.flatnonzero([place.parity == block.parity for place in reduced.places])
            classes: dict[object, list[int]] = {}
            for position, row in enumerate(rows):
                classes.setdefault(of_base[int(row)].parity, []).append(position)
            groups = tuple(
                np.array(sorted(members, key=lambda position: of_base[int(rows[position])].rank))
                for members in classes.values()
            )
            wanted = np.array([reduced.places[row].rank for row in rows])
            result.append(Following.of(block, weights, wanted, groups))
        return tuple(result)

    def _without(self, baseline: Baseline) -> Values:
        """Values of the baseline with the effect absent, whether its sizes are free or exact."""
        sizes = [one for one in self.form.board.parameters if one.effect and one.effect not in baseline.board.effects]
        nothing = {one.name: np.full(1, one.null) for one in sizes if one.null is not None}
        free = np.exp(baseline.log_rigidities)[:, None]
        return _with_rigidities(baseline, _inputs(baseline, self.form) | nothing, free)

    def _by_frequency(self, baseline: Baseline, setup: int, model: SetupModel) -> tuple[Place, ...]:
        """Where the modes of a setup stand on the plate with the effect absent, each at a place of its own."""
        from scipy.optimize import linear_sum_assignment

        of_base = baseline.every.places[setup]
        assert model.exact is not None
        weights = model.system.weights(self._without(baseline))
        start = baseline.every.starts[setup]
        of_plate = baseline.every.log_frequency - baseline.every.discrepancy
        wanted = of_plate[start : start + len(of_base)]
        found: dict[int, Place] = {}
        for block in model.exact.reduced.classes:
            rows = [
                i for i, place in enumerate(of_base) if merged(place.parity, symmetry_of([model])[0]) == block.parity
            ]
            there = 0.5 * np.log(block.eigenvalues(weights)[0]) - np.log(2.0 * np.pi)
            misses = (wanted[rows, None] - there) ** 2
            for row, rank in zip(*linear_sum_assignment(misses), strict=True):
                at = rows[int(row)]
                found[at] = Place(block.parity, int(rank), of_base[at].correlation)
        return tuple(found[i] for i in range(len(of_base)))


def form_law(baseline: Baseline, form: Form, half_width: float | None = None) -> FormLaw:
    """Solve a form around a baseline and over the prior of its parameters.

    `half_width` is that of the region in ln D_x / D_s and ln D_y / D_s, of which an isotropic board has none; by
    default three standard deviations of the fit.
    """
    board = form.board
    parameters = Parameters(board)
    values = dict(_inputs(baseline, form))
    middle = {free.name: np.asarray(free.prior.median) for free in form.free}
    at_middle = {**values, **middle, **{n: baseline.values[n] for n in RIGIDITIES}}
    models = tuple(
        _with_others(setup_model(system_of(board, setup), at_middle), baseline, i)
        for i, setup in enumerate(board.setups)
    )
    noise = np.array([setup.noise.median for setup in board.setups])
    centre = parameters.theta(at_middle, noise)
    n, covariance = parameters.n_constants, np.eye(parameters.n_dim)
    if half_width is None:
        weighted = baseline.slopes / baseline.scales[:, None]
        covariance[:n, :n] = np.linalg.inv(weighted.T @ weighted)
    else:
        covariance[:n, :n] = np.diag([half_width**2 / 9.0] * (n - 1) + [0.0])
    return FormLaw(form, exact_models(board, models, centre, covariance, accepted_cents=_ACCEPTED_CENTS))


def merged(parity: Parity, symmetry: tuple[bool, bool]) -> Parity:
    """The class of a mode on a plate that has only the given symmetries left."""
    return Parity(parity.x if symmetry[0] else 0, parity.y if symmetry[1] else 0)


def _with_others(model: SetupModel, baseline: Baseline, setup: int) -> SetupModel:
    """A model of as many modes of each class as the baseline has of those that fall into it."""
    if model.roved:
        first, *rest = (_with_others(one, baseline, setup) for one in model.stations)
        return replace(first, roved=tuple(rest))
    of_base = baseline.every.places[setup]
    n_readings = len(model.setup.readings)
    if len(of_base) == n_readings:
        return model
    symmetry = symmetry_of([model])[0]
    counts = Counter(merged(place.parity, symmetry) for place in of_base)
    others = [Place(parity, rank, 0.0) for parity, n in counts.items() for rank in range(n)]
    if symmetry == baseline.symmetry[setup]:
        others = list(of_base[n_readings:])
    return replace(model, others=tuple(OtherMode(place, None) for place in others))


def _with_rigidities(baseline: Baseline, values: Values, free: Floats) -> Values:
    """Values with D_x, D_y, D_s from the (n_constants, n) free rigidities, by the Poisson ratio among them."""
    return {**values, **baseline.board.symmetry.rigidities(free, values["poisson_xy"])}


def _inputs(baseline: Baseline, form: Form) -> dict[str, Floats]:
    """The baseline's inputs, and the form's exact ones."""
    exact = {name: np.asarray(q.mean) for name, q in form.board.inputs.items() if q.is_exact}
    return exact | {name: value for name, value in baseline.values.items() if name not in RIGIDITIES}
