"""The exact visible shift of an effect over all its sizes, tabulated once: cells of its prior with a tangent each.

The prior of an effect's parameters, pushed through the exact frequencies and the refit of the constants, is a cloud of
shifts. It is kept as a mixture of normal cells: a regular grid in the standard coordinates of the parameters, the exact
shift at each point, and the slope there, so that neighbouring cells join without a gap. Evidence, prediction and the
posterior of a size are then sums over cells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.shifts.baseline import Baseline
from bayesplate.diagnosis.shifts.laws import FormLaw

Floats = NDArray[np.float64]

FINE, COARSE = (33, 11, 256), (9, 5, 27)
"""Cells along one parameter, along each of two, and at most in all of more; the second where effects are combined."""

_REACH = 3.0
_OVERLAP = 0.5
_REFITS = 10
_SETTLED = 2e-4
_LONGEST_STEP = 0.3


@dataclass(frozen=True, eq=False)
class Table:
    """Cells of one effect, or of two together.

    Attributes
    ----------
    members : tuple of str
        Names of the effects.
    weights : (n_cells,) array
        Prior probability, summing to 1.
    shift : (n_cells, n_modes) array
        ln f with the effect, constants refitted, less ln f of the baseline; of all modes that readings may be, or of
        those that they are taken for.
    slopes : (n_cells, n_modes, n_tangents) array
        Change of the shift over one standard deviation of the cell.
    moved : (n_cells, n_constants) array
        Change of ln D by the refit.
    moved_slopes : (n_cells, n_constants, n_tangents) array
    form : (n_cells,) array of int
        Which form of the effect; of the first one where there are two.
    z : (n_cells, n_parameters) array
        Standard coordinates of the first effect's parameters.
    z_slopes : (n_cells, n_parameters) array
        Their change over one standard deviation of the cell.
    """

    members: tuple[str, ...]
    weights: Floats
    shift: Floats
    slopes: Floats
    moved: Floats
    moved_slopes: Floats
    form: NDArray[np.intp]
    z: Floats
    z_slopes: Floats

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return int(self.weights.size)

    def some(self, cells: slice) -> Table:
        """Some of the cells, with the weights that they have among all."""
        return replace(self, **{key: getattr(self, key)[cells] for key in _PER_CELL})

    def of(self, rows: NDArray[np.intp]) -> Table:
        """The same cells for some of the modes, by their indices."""
        if np.array_equal(rows, np.arange(self.shift.shape[1])):
            return self
        return replace(self, shift=self.shift[:, rows], slopes=self.slopes[:, rows])


def tabulate(baseline: Baseline, name: str, laws: Sequence[FormLaw], cells: tuple[int, int, int] = FINE) -> Table:
    """Tabulate an effect over all its forms.

    Parameters
    ----------
    baseline : Baseline
    name : str
    laws : sequence of FormLaw
        Of the effect's forms, equally probable.
    cells : tuple of int
        `FINE` or `COARSE`.

    Returns
    -------
    Table
        Without any cells where no size of the effect leaves a plate.
    """
    parts = [_of_form(baseline, name, i, law, cells) for i, law in enumerate(laws)]
    n_tangents = max(part.slopes.shape[2] for part in parts)
    padded = [_padded(part, n_tangents) for part in parts]
    return Table(
        members=(name,),
        weights=np.concatenate([part.weights for part in padded]) / len(parts),
        shift=np.concatenate([part.shift for part in padded]),
        slopes=np.concatenate([part.slopes for part in padded]),
        moved=np.concatenate([part.moved for part in padded]),
        moved_slopes=np.concatenate([part.moved_slopes for part in padded]),
        form=np.concatenate([part.form for part in padded]),
        z=np.concatenate([part.z for part in padded]),
        z_slopes=np.concatenate([part.z_slopes for part in padded]),
    )


def together(one: Table, other: Table) -> Table:
    """Two effects at once: their shifts and refits add."""

    def added(first: Floats, second: Floats) -> Floats:
        total = first[:, None] + second[None]
        return total.reshape(-1, *total.shape[2:])

    def joined(first: Floats, second: Floats) -> Floats:
        n, m = len(first), len(second)
        parts = (np.repeat(first, m, axis=0), np.tile(second, (n, 1, 1)))
        return np.concatenate(parts, axis=2)

    return Table(
        members=one.members + other.members,
        weights=np.outer(one.weights, other.weights).ravel(),
        shift=added(one.shift, other.shift),
        slopes=joined(one.slopes, other.slopes),
        moved=added(one.moved, other.moved),
        moved_slopes=joined(one.moved_slopes, other.moved_slopes),
        form=np.repeat(one.form, other.n_cells),
        z=np.repeat(one.z, other.n_cells, axis=0),
        z_slopes=np.repeat(one.z_slopes, other.n_cells, axis=0),
    )


def nothing(n_modes: int, n_constants: int = 3) -> Table:
    """No effect: one cell without shift."""
    return Table(
        members=(),
        weights=np.ones(1),
        shift=np.zeros((1, n_modes)),
        slopes=np.zeros((1, n_modes, 0)),
        moved=np.zeros((1, n_constants)),
        moved_slopes=np.zeros((1, n_constants, 0)),
        form=np.zeros(1, dtype=np.intp),
        z=np.zeros((1, 0)),
        z_slopes=np.zeros((1, 0)),
    )


def refitted(baseline: Baseline, law: FormLaw, z: Floats) -> tuple[Floats, Floats]:
    """Shifts of all modes with the constants refitted to the baseline's readings, and what the refit changed.

    Parameters
    ----------
    baseline : Baseline
    law : FormLaw
    z : (n, n_parameters) array
        Standard coordinates.

    Returns
    -------
    shift : (n, n_every) array
        Not a number where the law gives no frequency.
    moved : (n, n_constants) array
    """
    values = {free.name: free.prior.value(z[:, i]) for i, free in enumerate(law.form.free)}
    moved = np.zeros((len(z), baseline.log_rigidities.size))
    shift = np.empty((len(z), baseline.every.log_frequency.size))
    moving = np.arange(len(z))
    for n_done in range(_REFITS):
        there = {name: value[moving] for name, value in values.items()}
        at = baseline.log_rigidities + moved[moving]
        shift[moving] = law.every_log_frequency(baseline, at, there) - baseline.every.log_frequency
        step = -np.nan_to_num(shift[moving][:, baseline.rows]) @ baseline.absorbing.T
        longest = np.abs(step).max(axis=1)
        moving, step, longest = (each[longest > _SETTLED] for each in (moving, step, longest))
        if not moving.size or n_done == _REFITS - 1:
            break
        moved[moving] += step * np.minimum(1.0, _LONGEST_STEP / longest)[:, None]
    return shift, moved


def nominal_shift(baseline: Baseline, law: FormLaw) -> tuple[Floats, Floats, Floats]:
    """Raw and visible shift at the nominal size, (n_modes,) arrays, ln f, and what the refit hides of ln D, (n,)."""
    values = {free.name: np.array([free.nominal]) for free in law.form.free}
    raw = law.log_frequencies(baseline, baseline.log_rigidities[None, :], values)[0] - baseline.log_frequency
    visible, step = baseline.refitted_to(raw)
    return raw, visible, -step


def traced_shift(baseline: Baseline, law: FormLaw) -> Floats:
    """Visible shift at the form's nominal size where the search finds the constants: (n_modes,) array, ln f."""
    z = np.array([[float(free.prior.standard(free.nominal)) for free in law.form.free]])
    return np.asarray(refitted(baseline, law, z)[0][0, baseline.rows])


def _of_form(baseline: Baseline, name: str, index: int, law: FormLaw, cells: tuple[int, int, int]) -> Table:
    axes = [_axis(free.prior, cells_along(len(law.form.free), cells)) for free in law.form.free]
    sides = [axis[0].size for axis in axes]
    z = np.array(list(product(*(axis[0] for axis in axes)))).reshape(int(np.prod(sides)), len(axes))
    log_weights = np.zeros(len(z))
    for i, free in enumerate(law.form.free):
        log_weights = log_weights + free.prior.log_prior(z[:, i])
    shift, moved = refitted(baseline, law, z)
    slopes = _slopes(shift, sides, axes)
    moved_slopes = _slopes(moved, sides, axes)
    finite = np.isfinite(shift).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2)) & np.isfinite(log_weights)
    weights = np.where(finite, np.exp(np.where(finite, log_weights, -np.inf)), 0.0)
    table = Table(
        members=(name,),
        weights=weights / max(weights.sum(), np.finfo(float).tiny),
        shift=shift,
        slopes=slopes,
        moved=moved,
        moved_slopes=moved_slopes,
        form=np.full(len(z), index),
        z=z,
        z_slopes=np.tile([_OVERLAP * width for _, width in axes], (len(z), 1)),
    )
    return replace(table, **{key: getattr(table, key)[finite] for key in _PER_CELL})


_PER_CELL = ("weights", "shift", "slopes", "moved", "moved_slopes", "form", "z", "z_slopes")


def cells_along(n_parameters: int, cells: tuple[int, int, int]) -> int:
    """Cells along each of so many parameters; their product stays bounded, however many setups have one each."""
    *few, most = cells
    return few[n_parameters - 1] if n_parameters <= len(few) else int(most ** (1.0 / n_parameters) + 1e-9)


def _axis(prior: Quantity, n: int) -> tuple[Floats, float]:
    """Middles of n equal cells between the prior's bounds or three standard deviations, and their width."""
    low = max(float(prior.standard(prior.lower)), -_REACH) if np.isfinite(prior.lower) else -_REACH
    high = min(float(prior.standard(prior.upper)), _REACH) if np.isfinite(prior.upper) else _REACH
    width = (high - low) / n
    return np.asarray(low + width * (np.arange(n) + 0.5)), width


def _slopes(values: Floats, sides: list[int], axes: list[tuple[Floats, float]]) -> Floats:
    """Change over the standard deviation of a cell along each parameter: (n_cells, n_values, n_parameters) array."""
    if not sides:
        return np.zeros((*values.shape, 0))
    gridded = values.reshape(*sides, values.shape[1])
    columns = []
    for i, (points, width) in enumerate(axes):
        slope = np.gradient(gridded, points, axis=i) if len(points) > 1 else np.zeros_like(gridded)
        columns.append((_OVERLAP * width * slope).reshape(values.shape))
    return np.stack(columns, axis=-1)


def _padded(table: Table, n_tangents: int) -> Table:
    more = n_tangents - table.slopes.shape[2]
    if not more:
        return table
    pad = ((0, 0), (0, 0), (0, more))
    flat = ((0, 0), (0, n_tangents - table.z.shape[1]))
    return replace(
        table,
        slopes=np.pad(table.slopes, pad),
        moved_slopes=np.pad(table.moved_slopes, pad),
        z=np.pad(table.z, flat),
        z_slopes=np.pad(table.z_slopes, flat),
    )
