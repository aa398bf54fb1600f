"""Exact frequencies of a board with one more effect, over all sizes that the effect may have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.shifts.baseline import Baseline, symmetry_of
from bayesplate.diagnosis.shifts.following import Following
from bayesplate.diagnosis.shifts.forms import Form
from bayesplate.frequencies.laws import ExactLaw, log_frequency
from bayesplate.frequencies.model import SetupModel, setup_model
from bayesplate.frequencies.system import system_of
from bayesplate.modes.naming import Place
from bayesplate.plate.board import Values
from bayesplate.plate.material import RIGIDITIES
from bayesplate.posterior.laplace import exact_models
from bayesplate.posterior.parameters import N_RIGIDITIES, Parameters

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FormLaw:
    """Frequencies of a form as a function of the constants and of its free parameters.

    Attributes
    ----------
    form : Form
    models : tuple of SetupModel
        With the exact law.
    following : tuple of tuple of Following
        For each setup, one per block where the effect breaks the symmetry; empty where it does not.
    """

    form: Form
    models: tuple[SetupModel, ...]
    following: tuple[tuple[Following, ...], ...] = ()

    def log_frequencies(self, baseline: Baseline, log_rigidities: Floats, values: Mapping[str, Floats]) -> Floats:
        """ln f (Hz) of all labelled modes: (n, n_modes) array.

        Parameters
        ----------
        baseline : Baseline
            Whose inputs are taken.
        log_rigidities : (n, 3) array
        values : dict of (n,) array
            The form's free parameters by name, SI.
        """
        inputs = _inputs(baseline, self.form)
        constants = dict(zip(RIGIDITIES, np.exp(log_rigidities).T, strict=True))
        there: Values = inputs | dict(values) | constants
        followed = self.following or ((),) * len(self.models)
        parts = [_log_frequencies(model, each, there) for model, each in zip(self.models, followed, strict=True)]
        return np.concatenate(parts, axis=1)

    def placed(self, baseline: Baseline) -> FormLaw:
        """The same law with the modes of a baseline, which may be another board of the same sizes.

        Where the effect keeps the symmetry a mode keeps its class and its rank there. Elsewhere it is found by its
        frequency without the effect, and followed from there by its shape.
        """
        models, following = [], []
        first = 0
        for i, model in enumerate(self.models):
            n = len(model.places)
            of_base = baseline.places[first : first + n]
            keeps = symmetry_of([model])[0] == baseline.symmetry[i]
            places = of_base if keeps else self._by_frequency(baseline, model, of_base, slice(first, first + n))
            assert model.exact is not None
            reduced = replace(model.exact.reduced, places=places)
            models.append(replace(model, places=places, exact=ExactLaw(reduced)))
            following.append(() if keeps else self._followed(baseline, models[-1], of_base))
            first += n
        return replace(self, models=tuple(models), following=tuple(following))

    def _followed(self, baseline: Baseline, model: SetupModel, of_base: Sequence[Place]) -> tuple[Following, ...]:
        """Shapes without the effect, block by block."""
        assert model.exact is not None
        weights = model.system.weights(self._without(baseline))
        result = []
        for block in model.exact.reduced.blocks:
            rows = np.flatnonzero([place.parity == block.parity for place in model.places])
            classes: dict[object, list[int]] = {}
            for position, row in enumerate(rows):
                classes.setdefault(of_base[int(row)].parity, []).append(position)
            groups = tuple(
                np.array(sorted(members, key=lambda position: of_base[int(rows[position])].rank))
                for members in classes.values()
            )
            wanted = np.array([model.places[row].rank for row in rows])
            result.append(Following.of(block, weights, wanted, groups))
        return tuple(result)

    def _without(self, baseline: Baseline) -> Values:
        """Values of the baseline with the effect absent."""
        nothing = {free.name: np.full(1, free.null) for free in self.form.free}
        constants = dict(zip(RIGIDITIES, np.exp(baseline.log_rigidities)[:, None], strict=True))
        return _inputs(baseline, self.form) | nothing | constants

    def _by_frequency(
        self, baseline: Baseline, model: SetupModel, of_base: Sequence[Place], rows: slice
    ) -> tuple[Place, ...]:
        assert model.exact is not None
        weights = model.system.weights(self._without(baseline))
        wanted = baseline.log_frequency[rows]
        symmetry = symmetry_of([model])[0]
        found = []
        for place, target in zip(of_base, wanted, strict=True):
            best: tuple[float, Place] | None = None
            for block in model.exact.reduced.blocks:
                kept = zip(symmetry, block.parity, place.parity, strict=True)
                if any(is_kept and one != other for is_kept, one, other in kept):
                    continue
                there_too = 0.5 * np.log(block.eigenvalues(weights)[0]) - np.log(2.0 * np.pi)
                rank = int(np.argmin(np.abs(there_too - target)))
                miss = abs(float(there_too[rank] - target))
                if best is None or miss < best[0]:
                    best = (miss, Place(block.parity, rank, place.correlation))
            assert best is not None
            found.append(best[1])
        return tuple(found)


def form_law(baseline: Baseline, form: Form, half_width: float | None = None) -> FormLaw:
    """Solve a form around a baseline and over the prior of its parameters.

    Parameters
    ----------
    baseline : Baseline
    form : Form
    half_width : float, optional
        Of the region in ln D_x / D_s and ln D_y / D_s; by default three standard deviations of the fit.

    Returns
    -------
    FormLaw
    """
    board = form.board
    parameters = Parameters(board)
    values = dict(_inputs(baseline, form))
    middle = {free.name: np.asarray(free.prior.median) for free in form.free}
    at_middle = {**values, **middle, **{n: baseline.values[n] for n in RIGIDITIES}}
    models = tuple(setup_model(system_of(board, setup), at_middle) for setup in board.setups)
    noise = np.array([setup.noise.median for setup in board.setups])
    centre = parameters.theta(at_middle, noise)
    covariance = np.eye(parameters.n_dim)
    if half_width is None:
        weighted = baseline.slopes / baseline.scales[:, None]
        covariance[:N_RIGIDITIES, :N_RIGIDITIES] = np.linalg.inv(weighted.T @ weighted)
    else:
        covariance[:N_RIGIDITIES, :N_RIGIDITIES] = np.diag([half_width**2 / 9.0] * 2 + [0.0])
    return FormLaw(form, exact_models(board, models, centre, covariance))


def _log_frequencies(model: SetupModel, following: Sequence[Following], values: Values) -> Floats:
    """ln f of a setup's labelled modes: by rank, or followed by their shapes."""
    if not following:
        return model.log_frequencies(values, "exact")
    weights = model.system.weights(values)
    squared = np.empty((len(weights.stiffness), len(model.places)))
    for each in following:
        squared[:, [place.parity == each.block.parity for place in model.places]] = each.eigenvalues(weights)
    return log_frequency(squared)


def _inputs(baseline: Baseline, form: Form) -> dict[str, Floats]:
    """The baseline's inputs, and the form's exact ones."""
    exact = {name: np.asarray(q.mean) for name, q in form.board.inputs.items() if q.is_exact}
    return exact | {name: value for name, value in baseline.values.items() if name not in RIGIDITIES}
