"""The exact visible shift of an effect over all its sizes, tabulated once: cells of its prior with a tangent each.

The prior of an effect's parameters, pushed through the exact frequencies and the refit of the constants, is a cloud of
shifts. It is kept as a mixture of normal cells: a regular grid in the standard coordinates of the parameters, the exact
shift at each point, and its change up to the sides of the cell, so that neighbouring cells join without a gap.
Evidence, prediction and the posterior of a size are then sums over cells.

The shifts of two effects are added. This is approximate: the frequency that a mass lowers is raised less by a tension.
Plausible pairs are therefore solved together, at every pair of their cells.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats, Indices
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.forms import Form, with_forms
from bayesplate.diagnosis.laws import FormLaw, form_law

JointLaws = Mapping[tuple[int, int], FormLaw]
"""Joint laws of two effects, by the indices of their forms; free parameters of the first effect, then of the second."""

FINE_CELLS, COARSE_CELLS = (33, 11, 256), (9, 5, 27)
"""Cells along a single parameter, along each of two, and in all along more; the coarse ones for pairs of effects."""

REACH = 3.0
"""Standard deviations of a size's prior up to which there are cells."""
_FEW_CELLS = 2
_OVERLAP = 0.5
_POINT_DIGITS = 9
"""Decimals of standard coordinates in which cells that touch have the same side."""
_REFITS = 10
_SETTLED_STEP = 2e-4
_LONGEST_STEP = 0.3


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of one effect, or of two together."""

    weights: Floats  # (n_cells,) array: prior probability, summing to 1
    shift: Floats  # (n_cells, n_modes) array: ln f with the effect, constants refitted, less ln f of the baseline
    slopes: Floats  # (n_cells, n_modes, n_tangents) array: change of the shift over one standard deviation of the cell
    moved: Floats  # (n_cells, n_constants) array: change of ln D by the refit
    moved_slopes: Floats  # (n_cells, n_constants, n_tangents) array
    form: Indices  # (n_cells,) array of int: which form of the effect; of the first one where there are two
    z: Floats  # (n_cells, n_parameters) array: standard coordinates of the first effect's parameters
    z_slopes: Floats  # (n_cells, n_parameters) array: their change over one standard deviation of the cell
    # of two effects together: the tables of both, the cells of the second effect running fastest
    parts: tuple[Cells, ...] = ()

    @property
    def n_cells(self) -> int:
        return int(self.weights.size)

    def select(self, cells: slice | Indices) -> Cells:
        """Some of the cells, with their weights unchanged."""
        return replace(self, **{key: getattr(self, key)[cells] for key in _PER_CELL})

    def at_modes(self, rows: Indices) -> Cells:
        """The same cells for some of the modes, by their indices."""
        if np.array_equal(rows, np.arange(self.shift.shape[1])):
            return self
        return replace(self, shift=self.shift[:, rows], slopes=self.slopes[:, rows])

    def member(self, index: int, cells: Indices | None = None) -> tuple[Cells, Indices]:
        """The table of one of its effects, and the index there of each of some cells; by default of all cells."""
        cells = np.arange(self.n_cells) if cells is None else cells
        return (self.parts[index], np.divmod(cells, self.parts[1].n_cells)[index]) if self.parts else (self, cells)

    def tangents(self, index: int) -> slice:
        """The slice of the tangents of one of its effects."""
        ends = np.cumsum([0, *(part.slopes.shape[2] for part in self.parts or (self,))])
        return slice(int(ends[index]), int(ends[index + 1]))


_PER_CELL = ("weights", "shift", "slopes", "moved", "moved_slopes", "form", "z", "z_slopes")


def no_effect_cells(n_modes: int, n_constants: int = 3) -> Cells:
    """No effect: one cell without shift."""
    return Cells(
        weights=np.ones(1),
        shift=np.zeros((1, n_modes)),
        slopes=np.zeros((1, n_modes, 0)),
        moved=np.zeros((1, n_constants)),
        moved_slopes=np.zeros((1, n_constants, 0)),
        form=np.zeros(1, dtype=np.intp),
        z=np.zeros((1, 0)),
        z_slopes=np.zeros((1, 0)),
    )


def tabulate(baseline: Baseline, laws: Sequence[FormLaw], cells: tuple[int, int, int] = FINE_CELLS) -> Cells:
    """Tabulate an effect over all its forms, equally probable; without cells where no plate has it at any size."""
    n_tangents = max(len(law.form.free) for law in laws)
    tables = [_tabulate_form(baseline, i, law, cells, n_tangents) for i, law in enumerate(laws)]
    columns: dict[str, Any] = {key: np.concatenate([getattr(table, key) for table in tables]) for key in _PER_CELL}
    return replace(tables[0], **columns | {"weights": columns["weights"] / len(laws)})


def combine_cells(first: Cells, second: Cells) -> Cells:
    """The table of two effects together: their shifts and refits add."""

    def add(first: Floats, second: Floats) -> Floats:
        total = first[:, None] + second[None]
        return total.reshape(-1, *total.shape[2:])

    def join(first: Floats, second: Floats) -> Floats:
        parts = (np.repeat(first, len(second), axis=0), np.tile(second, (len(first), 1, 1)))
        return np.concatenate(parts, axis=2)

    return Cells(
        weights=np.outer(first.weights, second.weights).ravel(),
        shift=add(first.shift, second.shift),
        slopes=join(first.slopes, second.slopes),
        moved=add(first.moved, second.moved),
        moved_slopes=join(first.moved_slopes, second.moved_slopes),
        form=np.repeat(first.form, second.n_cells),
        z=np.repeat(first.z, second.n_cells, axis=0),
        z_slopes=np.repeat(first.z_slopes, second.n_cells, axis=0),
        parts=(first, second),
    )


def joint_law(baseline: Baseline, first: Form, second: Form) -> FormLaw:
    """Solve a board with two effects around a baseline and over the priors of both."""
    detail = ", ".join(form_detail for form_detail in (first.detail, second.detail) if form_detail)
    board = with_forms(baseline.board, (first, second))
    pair_form = Form(f"{first.effect} and {second.effect}", detail, board, (*first.free, *second.free))
    return form_law(baseline, pair_form).with_modes_of(baseline)


def joint_table(baseline: Baseline, added: Cells, laws: JointLaws) -> Cells:
    """The table of two effects, exact for forms with a joint law, and otherwise that of `added`, with its cells."""
    (first_table, first_cells), (second_table, second_cells) = added.member(0), added.member(1)
    arrays = {key: getattr(added, key).copy() for key in ("shift", "moved", "slopes", "moved_slopes")}
    for (i, j), law in laws.items():
        cells = np.flatnonzero((first_table.form[first_cells] == i) & (second_table.form[second_cells] == j))
        used_tangents = np.flatnonzero(
            np.r_[first_table.z_slopes[first_cells[cells[0]]], second_table.z_slopes[second_cells[cells[0]]]] > 0.0
        )
        z, step = (
            np.hstack([first_values[first_cells[cells]], second_values[second_cells[cells]]])[:, used_tangents]
            for first_values, second_values in (
                (first_table.z, second_table.z),
                (first_table.z_slopes, second_table.z_slopes),
            )
        )
        solved = _solve_cells(baseline, law, z, step)
        is_solved = _is_finite(*solved)
        for key, values in zip(arrays, solved, strict=True):
            if key.endswith("slopes"):
                arrays[key][np.ix_(cells[is_solved], np.arange(values.shape[1]), used_tangents)] = values[is_solved]
            else:
                arrays[key][cells[is_solved]] = values[is_solved]
    return replace(added, **arrays)


def refitted_shifts(baseline: Baseline, law: FormLaw, z: Floats) -> tuple[Floats, Floats]:
    """Shifts, (n, n_modes), with the constants refitted at (n, n_parameters) standard coordinates, and the changes of
    ln D.

    A shift is not a number where the law gives no frequency.
    """
    values = {free.name: free.prior.value(z[:, i]) for i, free in enumerate(law.form.free)}
    moved = np.zeros((len(z), baseline.log_rigidities.size))
    shift = np.empty((len(z), baseline.possible_modes.log_frequency.size))
    moving = np.arange(len(z))
    for n_done in range(_REFITS):
        moving_values = {name: value[moving] for name, value in values.items()}
        log_rigidities = baseline.log_rigidities + moved[moving]
        shift[moving] = (
            law.mode_log_frequencies(baseline, log_rigidities, moving_values) - baseline.possible_modes.log_frequency
        )
        step = -np.nan_to_num(shift[moving][:, baseline.rows]) @ baseline.absorption.T
        longest = np.abs(step).max(axis=1)
        moving, step, longest = (array[longest > _SETTLED_STEP] for array in (moving, step, longest))
        if not moving.size or n_done == _REFITS - 1:
            break
        moved[moving] += step * np.minimum(1.0, _LONGEST_STEP / longest)[:, None]
    return shift, moved


def _solve_cells(baseline: Baseline, law: FormLaw, z: Floats, step: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Shift and refit of cells, and their changes over one standard deviation of the cell along each parameter."""
    n_parameters = z.shape[1]
    sides = [sign * step * (np.arange(n_parameters) == k) for k in range(n_parameters) for sign in (1.0, -1.0)]
    points = np.concatenate([z, *(z + side for side in sides)])
    points, places = np.unique(np.round(points, _POINT_DIGITS), axis=0, return_inverse=True)
    shift, moved = (values[places.reshape(-1, len(z))] for values in refitted_shifts(baseline, law, points))
    slopes, moved_slopes = (np.moveaxis(0.5 * (values[1::2] - values[2::2]), 0, 2) for values in (shift, moved))
    return shift[0], moved[0], slopes, moved_slopes


def _is_finite(*values: Floats) -> NDArray[np.bool_]:
    return np.all([np.isfinite(array).reshape(len(array), -1).all(axis=1) for array in values], axis=0)


def _tabulate_form(baseline: Baseline, index: int, law: FormLaw, cells: tuple[int, int, int], n_tangents: int) -> Cells:
    free = law.form.free
    axes = [_axis_cells(parameter.prior, cells_along(len(free), cells)) for parameter in free]
    points = list(product(*(middles for middles, _ in axes)))
    z = np.reshape(points, (len(points), len(axes)))
    step = np.tile([_OVERLAP * width for _, width in axes], (len(z), 1))
    log_weights = np.sum([parameter.prior.log_prior(z[:, i]) for i, parameter in enumerate(free)], axis=0) + np.zeros(
        len(z)
    )
    shift, moved, slopes, moved_slopes = _solve_cells(baseline, law, z, step)
    is_plate = _is_finite(shift, slopes, log_weights)
    weights = np.exp(np.where(is_plate, log_weights, -np.inf))
    n_unused = n_tangents - len(free)
    return Cells(
        weights=weights / max(weights.sum(), np.finfo(float).tiny),
        shift=shift,
        slopes=np.pad(slopes, ((0, 0), (0, 0), (0, n_unused))),
        moved=moved,
        moved_slopes=np.pad(moved_slopes, ((0, 0), (0, 0), (0, n_unused))),
        form=np.full(len(z), index),
        z=np.pad(z, ((0, 0), (0, n_unused))),
        z_slopes=np.pad(step, ((0, 0), (0, n_unused))),
    ).select(np.flatnonzero(is_plate))


def cells_along(n_parameters: int, cells: tuple[int, int, int]) -> int:
    """Cells along each of `n_parameters`; their product stays bounded, however many setups have a size each."""
    *few, most = cells
    return few[n_parameters - 1] if n_parameters <= len(few) else int(most ** (1.0 / n_parameters) + 1e-9)


def _axis_cells(prior: Quantity, n: int) -> tuple[Floats, float]:
    """Middles of n equal cells between the prior's bounds or three standard deviations, and their width.

    One cell or two reach only as far as they have the prior's mean square: a cell is a normal of half its width.
    """
    low, high = prior.standard_bounds
    reach = REACH if n > _FEW_CELLS else np.sqrt(n if low < 0.0 < high else 2.0 * n)
    low, high = max(low, -reach), min(high, reach)
    width = (high - low) / n
    return np.asarray(low + width * (np.arange(n) + 0.5)), width
