"""A local rational fit: a few damped modes in a window of frequencies, common to all records, by maximum likelihood.

The spectrum of a free decay that was cut out without a taper is, line by line, a sum of one simple rational term for
each mode, whatever the decay has lost when it is cut off; modes beyond the window are a low polynomial. With the
frequencies f_m and the decay rates d_m of the modes given, the residues of every record are linear: they are projected
out (variable projection), and Gauss's steps are taken in f_m and d_m alone. Modes that are not known are found one by
one: where what a fit leaves looks most like a mode, one is added and all are refitted.

References
----------
Golub and Pereyra, Separable nonlinear least squares, Inverse Problems, 2003.
Pintelon and Schoukens, System Identification: A Frequency Domain Approach, 2012.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from bayesplate.arrays import Complex, Floats

DEGREE = 2
"""Of the polynomial that stands for what lies beyond the window."""
_MOST_STEPS, _FEW_STEPS, _SEARCH_STEPS = 30, 4, 10
_SHRUNK, _GROWN, _FIRST_DAMPING = 0.2, 6.0, 1e-3
_SETTLED = 1e-7
"""Of the sum of squares, relative."""
_LEAST_DECAY = 1e-4
"""Decay rate over the spacing of the lines, at least: a steady line must not need another beside it."""
STEADY = 0.11
"""Decay rate times duration below which a line has not fallen by half: it may be steady."""
MOST_MODES = 14
"""In one window."""
_BEYOND = 0.15
"""Share of the window's width beyond its ends up to which a mode may lie whose tail is seen."""
_DAMPINGS, _STEP = (0.001, 0.004, 0.012, 0.035), 0.7
"""Damping ratios that are tried in a search, and the step of frequencies, in lines."""
_LEAST_OWN = 1e-4
"""Share of a mode's shape that those before it must leave."""


@dataclass(frozen=True, eq=False)
class Window:
    """Lines of all records in a band of frequencies."""

    frequency: Floats
    values: Complex  # (n_lines, n_records): spectra over the standard deviation of each record's noise
    fixed: Floats  # (n_fixed, 2), Hz: frequency and decay rate of strong modes outside, which reach in with tails
    # share of a line that no simple mode describes: no mode of a real board is simple to the last digit
    unlike: float = 0.0
    floor: float = 0.0  # share of the window's highest line that other lines may be off by
    least_variance: float = 0.0  # of a record's noise; 1 is what was expected of it

    @cached_property
    def weights(self) -> Floats:
        """Square roots of the weights of the lines, the same for all records: (n_lines,) array."""
        level = np.mean(np.abs(self.values) ** 2, axis=1)
        return np.asarray(1.0 / np.sqrt(1.0 + self.unlike**2 * level + self.floor**2 * level.max()))

    @property
    def spacing(self) -> float:
        return float(self.frequency[1] - self.frequency[0])

    def basis(self, poles: Floats) -> Complex:
        """Shapes of modes (n_modes, 2: Hz), of what is fixed, and the polynomial: (n_lines, n_basis) array."""
        low, high = self.frequency[0], self.frequency[-1]
        at = (2.0 * self.frequency - low - high) / (high - low)
        every = np.concatenate([poles, self.fixed])
        return np.concatenate([shapes(self.frequency, every), at[:, None] ** np.arange(DEGREE + 1)], axis=1)

    def compressed(self, most: int) -> Window:
        """The strongest combinations of the records: any combination has the same modes."""
        if self.values.shape[1] <= most:
            return self
        _, _, right = np.linalg.svd(self.values, full_matrices=False)
        return replace(self, values=self.values @ right[:most].conj().T)


@dataclass(frozen=True, eq=False)
class Fitted:
    """Modes fitted in a window; `rest`, `jacobian` and `orthogonal` are weighted."""

    window: Window
    poles: Floats  # (n_modes, 2), Hz: frequency, and decay rate: half the width of the peak at half its power
    residues: Complex  # (n_modes, n_records): of the values of the window
    rest: Complex  # (n_lines, n_records): what the fit leaves
    # (n_lines, 2 n_modes): change of a shape with its frequency, then its decay rate, less what other shapes take up
    jacobian: Complex
    orthogonal: Complex  # (n_lines, n_basis): an orthonormal basis of the shapes

    @property
    def n_free(self) -> int:
        """Lines beyond the shapes of each record."""
        return self.window.frequency.size - len(self.poles) - len(self.window.fixed) - DEGREE - 1

    @property
    def variance(self) -> Floats:
        """Noise variance of each record, (n_records,): the mean square of the rest, but not below the least one."""
        power = np.sum(np.abs(self.rest) ** 2, axis=0) / self.n_free
        return np.maximum(power, max(self.window.least_variance, 1e-300))

    def information(self) -> tuple[Floats, Floats]:
        """What each record says of the parameters: scores (n_records, n) and information (n_records, n, n).

        The n parameters are all frequencies, then all decay rates; each record is weighed by what is left of it.
        """
        both = np.concatenate([self.residues, self.residues])
        power = self.variance
        inner = self.jacobian.conj().T @ self.jacobian
        pairs = np.einsum("ar,br->rab", both.conj(), both)
        information = 2.0 * np.real(inner * pairs) / power[:, None, None]
        scores = 2.0 * np.real(both.conj().T * (self.jacobian.conj().T @ self.rest).T) / power[:, None]
        return scores, information

    @cached_property
    def cost(self) -> float:
        """-2 ln of the likelihood, but for a constant: the noise of each record is at its best."""
        squares, variance = np.sum(np.abs(self.rest) ** 2, axis=0), self.variance
        spread = -2.0 * self.rest.shape[1] * float(np.sum(np.log(self.window.weights)))
        return float(2.0 * np.sum(len(self.rest) * np.log(variance) + squares / variance)) + 2.0 * spread

    def without(self, mode: int) -> Fitted:
        """The best fit without one of its modes, the others free to move a little."""
        return refined(self.window, np.delete(self.poles, mode, axis=0), _FEW_STEPS)

    def with_share(self, shares: tuple[float, ...]) -> Fitted:
        """The fit with the share that no simple mode describes which makes the window likeliest."""
        tried = [refined(replace(self.window, unlike=share), self.poles, _FEW_STEPS) for share in shares]
        best = min(tried, key=lambda one: one.cost)
        return refined(best.window, best.poles)


def shapes(frequency: Floats, poles: Floats) -> Complex:
    """1 / (i (f - f_m) + d_m) of each mode: (n_lines, n_modes) array."""
    return np.asarray(1.0 / (1j * (frequency[:, None] - poles[:, 0]) + poles[:, 1]))


def fitted(window: Window, poles: Floats) -> Fitted:
    """What modes with given frequencies and decay rates leave of a window."""
    basis, weights = window.basis(poles), window.weights[:, None]
    n = len(poles)
    change = np.concatenate([1j * basis[:, :n] ** 2, -(basis[:, :n] ** 2)], axis=1) * weights
    basis = basis * weights
    scale = np.linalg.norm(basis, axis=0)
    both: tuple[Complex, Complex] = np.linalg.qr(basis / scale)
    orthogonal, triangle = both
    values = window.values * weights
    inner = orthogonal.conj().T @ values
    residues = (solve_triangular(triangle, inner) / scale[:, None])[:n]
    jacobian = change - orthogonal @ (orthogonal.conj().T @ change)
    return Fitted(window, poles, residues, values - orthogonal @ inner, jacobian, orthogonal)


def refined(window: Window, poles: Floats, most_steps: int = _MOST_STEPS) -> Fitted:
    """The most likely modes near given ones, (n_modes, 2: Hz), by damped Gauss-Newton steps."""
    here = fitted(window, poles)
    if not len(poles):
        return here
    damping = _FIRST_DAMPING
    for _ in range(most_steps):
        scores, information = here.information()
        score, matrix = scores.sum(axis=0), information.sum(axis=0)
        scale = np.diagonal(matrix)
        step = np.linalg.solve(matrix + np.diag(damping * scale + 1e-300), score)
        there = fitted(window, _moved(window, here.poles, step))
        if there.cost < here.cost:
            is_settled = here.cost - there.cost < _SETTLED * abs(there.cost) + 1e-4
            here, damping = there, max(damping * _SHRUNK, 1e-9)
            if is_settled:
                break
        else:
            damping *= _GROWN
            if damping > 1e6:
                break
    return here


def _moved(window: Window, poles: Floats, step: Floats) -> Floats:
    """Modes after a step: none moves further than its own width or a few lines, none grows with time."""
    n = len(poles)
    reach = np.maximum(poles[:, 1], window.spacing)
    frequency = poles[:, 0] + np.clip(step[:n], -reach, reach)
    decay = np.clip(poles[:, 1] + step[n:], 0.4 * poles[:, 1], 2.5 * poles[:, 1])
    return np.stack([frequency, np.maximum(decay, _LEAST_DECAY * window.spacing)], axis=1)


def search(window: Window, least_gain: float) -> list[Floats]:
    """Modes of a window, (n_modes, 2: Hz), one more at each step while -2 ln likelihood falls by `least_gain`."""
    fit = refined(window, np.zeros((0, 2)))
    candidates = _candidates(window)
    tried = shapes(window.frequency, candidates) * window.weights[:, None]
    own = np.sum(np.abs(tried) ** 2, axis=0)
    adjoint = np.ascontiguousarray(tried.conj().T)
    path: list[Floats] = []
    while len(path) < MOST_MODES and fit.n_free >= 2 * len(path) + 8:
        free = own - np.sum(np.abs(adjoint @ fit.orthogonal) ** 2, axis=1)
        gains = np.sum(np.abs(adjoint @ (fit.rest / np.sqrt(fit.variance))) ** 2, axis=1)
        best = int(np.argmax(gains / np.maximum(free, _LEAST_OWN * own)))
        better = refined(window, np.concatenate([fit.poles, candidates[best][None]]), _SEARCH_STEPS)
        if fit.cost - better.cost < least_gain:
            break
        fit = better
        path.append(fit.poles)
    return path


def _candidates(window: Window) -> Floats:
    """Frequencies and decay rates that are tried: (n, 2) array, Hz."""
    low, high = window.frequency[0], window.frequency[-1]
    reach = _BEYOND * (high - low)
    frequency = np.arange(max(low - reach, window.spacing), high + reach, _STEP * window.spacing)
    decay = np.maximum(np.outer(frequency, _DAMPINGS), 0.1 * window.spacing)
    return np.stack([np.repeat(frequency, len(_DAMPINGS)), decay.ravel()], axis=1)
