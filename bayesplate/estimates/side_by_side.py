"""Many fits under one law at once: Newton's steps side by side, the law asked for the points of all of them together.

A point of a board's law costs a fraction among many of what it costs alone. And where residuals are as large as noise,
steps that leave the curvature of ln f out (Gauss and Newton) come nearer by a constant share each, twenty to a fit;
with it a handful do. It changes little on the way, and is found anew only where a fit comes on slowly. What does not
settle so, as at a veering too narrow for differences, is left to `bayesplate.estimates.refit`. Where the loss is flat
a step of Newton leads anywhere: it is shortened, and halved where the law gives no frequency.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.refit import Bounds, Floats, Misfit, Predict, has_come_to_rest, most_likely, n_constants

_MOST_STEPS = 15
_FIRST, _SECOND = 1e-4, 1e-3
"""Steps in ln D and standard coordinates for slopes and curvatures by differences."""
_APART = 0.01
"""Step in standard deviations of a reading for how the slope of its likelihood changes."""
_ENOUGH = 1e-10
"""Gain of ln likelihood that a step promises below which it is the last: a hundred-thousandth of a standard error."""
_ROUNDING = 1e-9
"""Rise of the same that is none."""
_FAST = 0.01
"""Gain that a step promises, over that of the step before, up to which curvatures are kept."""
_LONGEST = 7.0
"""Change of ln D or of a standard coordinate in one step, at most."""
_FLATTEST = 1e-12
"""Curvature in a direction over the highest of all, at least."""


def most_likely_of_each(
    predict: Predict,
    misfit: Misfit,
    starts: Floats,
    left_out: Sequence[Sequence[int]],
    bounds: Bounds | None = None,
) -> Floats:
    """Parameters that minimise the squares of a misfit, of several problems that differ in what is left out.

    Parameters
    ----------
    predict, misfit, bounds
        As for `bayesplate.estimates.refit.most_likely`.
    starts : (n_problems, n_free) array
        Within the bounds.
    left_out : sequence of sequence of int
        Readings that are not used, for each problem.

    Returns
    -------
    (n_problems, n_free) array
        Not numbers where the law gives no frequency at the start.
    """
    found, is_settled = starts.copy(), np.zeros(len(starts), dtype=bool)
    if bounds is None or bounds.are_open:
        kept = np.ones((len(starts), predict(starts[:1]).shape[1]))
        for row, readings in zip(kept, left_out, strict=True):
            row[list(readings)] = 0.0
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a step may go too far, and is halved
            found, is_settled = _newton(_Problems(predict, misfit, kept), starts)
        is_settled &= has_come_to_rest(found, starts, n_constants(predict))
    rest = np.flatnonzero(~is_settled).tolist()
    for i in rest:
        found[i] = most_likely(predict, misfit, starts[i], bounds, left_out[i])
    return found


@dataclass(frozen=True, eq=False)
class _Place:
    """Problems, each at a point of its own: their numbers, what is lost there, and its derivatives but for curvatures.

    Attributes
    ----------
    problems : (n,) array of int
    loss : (n,) array
        Half the sum of squares; not a number where the law gives no frequency, or none nearby.
    gradient : (n, n_free) array
    flat : (n, n_free, n_free) array
        Second derivatives of the loss if those of ln f were zero.
    pull : (n, n_modes) array
        Derivatives of the loss by ln f.
    """

    problems: NDArray[np.intp]
    loss: Floats
    gradient: Floats
    flat: Floats
    pull: Floats

    def at(self, kept: NDArray[np.bool_]) -> _Place:
        """Some of them."""
        return _Place(self.problems[kept], self.loss[kept], self.gradient[kept], self.flat[kept], self.pull[kept])

    def steps(self, curvatures: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """Newton's steps with the (n, n_modes, n_free, n_free) curvatures of ln f, downhill in every direction.

        Returns
        -------
        steps : (n, n_free) array
        gains : (n,) array
            By how much twice the loss falls to second order.
        is_bowl : (n,) array of bool
            Whether the loss is curved upward in all directions.
        """
        bent, axes = np.linalg.eigh(self.flat + np.einsum("pk,pkij->pij", self.pull, curvatures))
        sizes = np.abs(bent)
        along = np.einsum("pij,pi->pj", axes, self.gradient) / np.maximum(sizes, _FLATTEST * sizes.max(axis=1)[:, None])
        steps = -np.einsum("pij,pj->pi", axes, along)
        return steps, -np.sum(self.gradient * steps, axis=1), bent[:, 0] > 0


@dataclass(frozen=True, eq=False)
class _Problems:
    """A law, a misfit and the readings that each problem uses: (n_problems, n_modes) array of ones and zeros."""

    predict: Predict
    misfit: Misfit
    kept: Floats

    def place(self, problems: NDArray[np.intp], x: Floats) -> _Place:
        """Some of the problems at (n, n_free) points."""
        is_input = (np.arange(x.shape[1]) >= n_constants(self.predict)).astype(np.float64)
        ends = _FIRST * np.concatenate([np.zeros((1, x.shape[1])), np.eye(x.shape[1]), -np.eye(x.shape[1])])
        middle, above, below = np.split(_around(self.predict, x, ends), [1, 1 + x.shape[1]], axis=1)
        log_f, slopes = middle[:, 0], (above - below) / (2.0 * _FIRST)
        residuals, changes = self.misfit(log_f)
        apart = _APART / np.maximum(np.abs(changes).max(axis=-1, keepdims=True), 1.0)
        high, low = (np.multiply(*self.misfit(log_f + sign * apart)) for sign in (1.0, -1.0))
        kept = self.kept[problems]
        pull, stiffness = kept * residuals * changes, kept * (high - low) / (2.0 * apart)
        loss = 0.5 * (np.sum(kept * residuals**2, axis=1) + np.sum(is_input * x**2, axis=1))
        gradient = np.einsum("pik,pk->pi", slopes, pull) + is_input * x
        flat = np.einsum("pik,pjk->pij", slopes * stiffness[:, None], slopes) + np.diag(is_input)
        is_known = np.isfinite(gradient).all(axis=1) & np.isfinite(flat).all(axis=(1, 2))
        return _Place(problems, np.where(is_known, loss, np.nan), gradient, flat, pull)


def _newton(every: _Problems, starts: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Where the problems are lowest, from the start of each, and which of them have settled there.

    A step is halved until the loss there is known and does not rise.
    """
    n = len(starts)
    at, tried, steps, is_settled = starts.copy(), starts.copy(), np.zeros_like(starts), np.zeros(n, dtype=bool)
    lowest, promised = np.full(n, np.inf), np.full(n, np.inf)
    distinct, which = np.unique(starts, axis=0, return_inverse=True)
    bent = curvatures(every.predict, distinct)[which.ravel()]
    for _ in range(_MOST_STEPS):
        under_way = np.flatnonzero(~is_settled)
        if not under_way.size:
            break
        there = every.place(under_way, tried[under_way])
        is_lower = there.loss < lowest[under_way] + _ROUNDING
        steps[under_way[~is_lower]] /= 2.0
        there = there.at(is_lower)
        taken = there.problems
        at[taken], lowest[taken] = tried[taken], there.loss
        found, gains, is_bowl = there.steps(bent[taken])
        is_slow = (gains > _ENOUGH) & (gains > _FAST * promised[taken])
        if is_slow.any():
            bent[taken[is_slow]] = curvatures(every.predict, at[taken[is_slow]])
            found, gains, is_bowl = there.steps(bent[taken])
        found /= np.maximum(np.abs(found).max(axis=1, keepdims=True) / _LONGEST, 1.0)
        steps[taken], promised[taken] = found, gains
        is_settled[taken] = is_bowl & (gains <= _ENOUGH)
        tried = at + steps
    return tried, is_settled


def curvatures(predict: Predict, x: Floats) -> Floats:
    """Second derivatives of ln f by the parameters at (n, n_free) points: (n, n_modes, n_free, n_free) array.

    By differences; zero where the law gives no frequency nearby.
    """
    n_free = x.shape[1]
    one = np.eye(n_free)
    first, second = np.tril_indices(n_free, -1)
    ends = _SECOND * np.concatenate([np.zeros((1, n_free)), one, -one, one[first] + one[second]])
    middle, above, below, both = np.split(_around(predict, x, ends), np.cumsum([1, n_free, n_free]), axis=1)
    found = np.zeros((len(x), n_free, n_free, middle.shape[-1]))
    found[:, range(n_free), range(n_free)] = above + below - 2.0 * middle
    found[:, first, second] = found[:, second, first] = both - above[:, first] - above[:, second] + middle
    return np.nan_to_num(np.moveaxis(found, -1, 1) / _SECOND**2, posinf=0.0, neginf=0.0)


def _around(predict: Predict, x: Floats, ends: Floats) -> Floats:
    """ln f at points beside others: (n, n_ends, n_modes) array."""
    return predict((x[:, None] + ends).reshape(-1, x.shape[1])).reshape(len(x), len(ends), -1)
