"""Exact frequencies of a board with one more effect, over all sizes that the effect may have."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Values
from bayesplate.board.material import RIGIDITIES
from bayesplate.diagnosis.shifts.baseline import Baseline, symmetry_of
from bayesplate.diagnosis.shifts.following import Following
from bayesplate.diagnosis.shifts.forms import Form
from bayesplate.frequencies.laws import ExactLaw, log_frequency, mean_log_frequency
from bayesplate.frequencies.model import OtherMode, SetupModel, setup_model
from bayesplate.frequencies.system import system_of
from bayesplate.modes.naming import Place
from bayesplate.modes.terms import Parity
from bayesplate.posterior.laplace import exact_models
from bayesplate.posterior.parameters import Parameters

Floats = NDArray[np.float64]

_ACCEPTED_CENTS = 0.5
"""Error of a law where it is checked: what `check` solves in full is shown to a tenth of a cent beside it."""


@dataclass(frozen=True, eq=False)
class FormLaw:
    """Frequencies of a form as a function of the constants and of its free parameters.

    Attributes
    ----------
    form : Form
    models : tuple of SetupModel
        With the exact law.
    following : tuple of tuple of tuple of Following
        For each setup and each station of its model, one per block where the effect breaks the symmetry; empty where it
        does not.
    """

    form: Form
    models: tuple[SetupModel, ...]
    following: tuple[tuple[tuple[Following, ...], ...], ...] = ()

    def log_frequencies(self, baseline: Baseline, log_rigidities: Floats, values: Mapping[str, Floats]) -> Floats:
        """ln f (Hz) of all labelled modes: (n, n_modes) array.

        Parameters
        ----------
        baseline : Baseline
            Whose inputs are taken.
        log_rigidities : (n, n_constants) array
        values : dict of (n,) array
            The form's free parameters by name, SI.
        """
        return self.every_log_frequency(baseline, log_rigidities, values)[:, baseline.rows]

    def every_log_frequency(self, baseline: Baseline, log_rigidities: Floats, values: Mapping[str, Floats]) -> Floats:
        """The same of all modes that the baseline's readings may be: (n, n_every) array."""
        there = _with_rigidities(baseline, _inputs(baseline, self.form) | dict(values), np.exp(log_rigidities).T)
        followed = self.following or tuple(((),) * len(model.stations) for model in self.models)
        parts = [
            mean_log_frequency(
                [_log_frequencies(one, each, there) for one, each in zip(model.stations, by_station, strict=True)]
            )
            for model, by_station in zip(self.models, followed, strict=True)
        ]
        return np.concatenate(parts, axis=1) + baseline.every.discrepancy

    def placed(self, baseline: Baseline) -> FormLaw:
        """The same law with the modes of a baseline, which may be another board of the same sizes.

        Where the effect keeps the symmetry a mode keeps its class and its rank there. Elsewhere it is found by its
        frequency without the effect, and followed from there by its shape.
        """
        models, following = [], []
        for i, model in enumerate(self.models):
            (first, *rest), followed = zip(*(self._placed(baseline, i, one) for one in model.stations), strict=True)
            models.append(replace(first, roved=tuple(rest)))
            following.append(followed)
        return replace(self, models=tuple(models), following=tuple(following))

    def _placed(self, baseline: Baseline, setup: int, model: SetupModel) -> tuple[SetupModel, tuple[Following, ...]]:
        """One station of a setup with the modes of a baseline, and the shapes that are followed."""
        of_base = baseline.every.places[setup]
        keeps = symmetry_of([model])[0] == baseline.symmetry[setup]
        places = of_base if keeps else self._by_frequency(baseline, setup, model)
        assert model.exact is not None
        labelled = len(model.setup.readings)
        others = tuple(OtherMode(place, None) for place in places[labelled:])
        exact = ExactLaw(replace(model.exact.reduced, places=places))
        placed = replace(model, places=places[:labelled], others=others, exact=exact)
        return placed, () if keeps else self._followed(baseline, placed, of_base)

    def _followed(self, baseline: Baseline, model: SetupModel, of_base: Sequence[Place]) -> tuple[Following, ...]:
        """Shapes without the effect, block by block."""
        assert model.exact is not None
        weights = model.system.weights(self._without(baseline))
        result = []
        for block in model.exact.reduced.classes:
            rows = np.flatnonzero([place.parity == block.parity for place in model.every_place])
            classes: dict[object, list[int]] = {}
            for position, row in enumerate(rows):
                classes.setdefault(of_base[int(row)].parity, []).append(position)
            groups = tuple(
                np.array(sorted(members, key=lambda position: of_base[int(rows[position])].rank))
                for members in classes.values()
            )
            wanted = np.array([model.every_place[row].rank for row in rows])
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

    Parameters
    ----------
    baseline : Baseline
    form : Form
    half_width : float, optional
        Of the region in ln D_x / D_s and ln D_y / D_s, of which an isotropic board has none; by default three standard
        deviations of the fit.

    Returns
    -------
    FormLaw
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


def _log_frequencies(model: SetupModel, following: Sequence[Following], values: Values) -> Floats:
    """ln f of all modes of a station: by rank, or followed by their shapes."""
    if not following:
        return model.every_log_frequency(values, "exact")
    weights = model.system.weights(values)
    squared = np.empty((len(weights.stiffness), len(model.every_place)))
    for each in following:
        squared[:, [place.parity == each.block.parity for place in model.every_place]] = each.eigenvalues(weights)
    return log_frequency(squared)


def _with_rigidities(baseline: Baseline, values: Values, free: Floats) -> Values:
    """Values with D_x, D_y, D_s from the (n_constants, n) free rigidities, by the Poisson ratio among them."""
    return {**values, **baseline.board.symmetry.rigidities(free, values["poisson_xy"])}


def _inputs(baseline: Baseline, form: Form) -> dict[str, Floats]:
    """The baseline's inputs, and the form's exact ones."""
    exact = {name: np.asarray(q.mean) for name, q in form.board.inputs.items() if q.is_exact}
    return exact | {name: value for name, value in baseline.values.items() if name not in RIGIDITIES}
