"""A local rational fit: a few damped modes in a window of frequencies, common to all records, by maximum likelihood.

The spectrum of a free decay that was cut out without a taper is, line by line, a sum of one simple rational term for
each mode, however far it has decayed where it is cut off; modes beyond the window are a low polynomial. With the
frequencies f_m and the decay rates d_m of the modes given, the residues of every record are linear: they are projected
out (variable projection), and Gauss's steps are taken in f_m and d_m alone. Unknown modes are found one by one: a mode
is added where the residual of a fit looks most like one, and all are refitted.

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
"""Degree of the polynomial that stands for modes beyond the window."""
_MOST_STEPS, _FEW_STEPS, _SEARCH_STEPS = 30, 4, 10
_DAMPING_CUT, _DAMPING_RISE, _FIRST_DAMPING = 0.2, 6.0, 1e-3
_COST_TOLERANCE = 1e-7
"""Relative change of the cost at which a fit has converged."""
_LEAST_DECAY = 1e-4
"""Least decay rate over the spacing of the lines: a steady line must not need another beside it."""
STEADY_DECAY = 0.11
"""Decay rate times duration below which a line has not fallen by half: it may be steady."""
MOST_MODES = 14
"""Most modes in one window."""
_OUTSIDE_SHARE = 0.15
"""Share of the window's width beyond its ends within which modes are tried: their tails reach into the window."""
_DAMPINGS, _FREQUENCY_STEP = (0.001, 0.004, 0.012, 0.035), 0.7
"""Damping ratios that a search tries, and its step of frequencies, in lines."""
_LEAST_ORTHOGONAL = 1e-4
"""Least share of a trial mode's power that must be orthogonal to the fitted modes."""


@dataclass(frozen=True, eq=False)
class Window:
    """Lines of all records in a band of frequencies."""

    frequency: Floats
    values: Complex  # (n_lines, n_records): spectra over the standard deviation of each record's noise
    fixed: Floats  # (n_fixed, 2), Hz: frequency and decay rate of modes outside, whose tails reach in
    # share of a line that no simple mode describes: no mode of a real board is perfectly simple
    model_error: float = 0.0
    floor: float = 0.0  # error of each line as a share of the window's highest line
    least_variance: float = 0.0  # of a record's noise; 1 is the expected noise

    @cached_property
    def weights(self) -> Floats:
        """Square roots of the weights of the lines, the same for all records: (n_lines,) array."""
        level = np.mean(np.abs(self.values) ** 2, axis=1)
        return np.asarray(1.0 / np.sqrt(1.0 + self.model_error**2 * level + self.floor**2 * level.max()))

    @property
    def spacing(self) -> float:
        return float(self.frequency[1] - self.frequency[0])

    def basis(self, poles: Floats) -> Complex:
        """Resonance terms of modes (n_modes, 2: Hz) and of fixed modes, then the polynomial: (n_lines, n_basis)."""
        low, high = self.frequency[0], self.frequency[-1]
        position = (2.0 * self.frequency - low - high) / (high - low)
        all_poles = np.concatenate([poles, self.fixed])
        return np.concatenate(
            [resonance_terms(self.frequency, all_poles), position[:, None] ** np.arange(DEGREE + 1)], axis=1
        )

    def compressed(self, n_records: int) -> Window:
        """The window of the strongest combinations of its records: any combination has the same modes."""
        if self.values.shape[1] <= n_records:
            return self
        _, _, right = np.linalg.svd(self.values, full_matrices=False)
        return replace(self, values=self.values @ right[:n_records].conj().T)


@dataclass(frozen=True, eq=False)
class WindowFit:
    """A fit of modes in a window; `residual`, `jacobian` and `orthogonal` are weighted."""

    window: Window
    poles: Floats  # (n_modes, 2), Hz: frequency, and decay rate: half the width of the peak at half its power
    residues: Complex  # (n_modes, n_records), in the units of the window's values
    residual: Complex  # (n_lines, n_records): residual of the fit
    # (n_lines, 2 n_modes): derivatives of the resonance terms by frequency, then by decay rate, orthogonal to the basis
    jacobian: Complex
    orthogonal: Complex  # (n_lines, n_basis): an orthonormal basis of the resonance terms and the polynomial

    @property
    def n_free(self) -> int:
        """Degrees of freedom of the residual of each record: lines less basis functions."""
        return self.window.frequency.size - len(self.poles) - len(self.window.fixed) - DEGREE - 1

    @property
    def variance(self) -> Floats:
        """Noise variance of each record, (n_records,): mean square of the residual, but not below the least one."""
        power = np.sum(np.abs(self.residual) ** 2, axis=0) / self.n_free
        return np.maximum(power, max(self.window.least_variance, 1e-300))

    def information(self) -> tuple[Floats, Floats]:
        """Scores (n_records, n) and information (n_records, n, n) of the parameters by each record.

        The n parameters are all frequencies, then all decay rates; each record is weighted by its residual.
        """
        doubled = np.concatenate([self.residues, self.residues])
        power = self.variance
        inner = self.jacobian.conj().T @ self.jacobian
        pairs = np.einsum("ar,br->rab", doubled.conj(), doubled)
        information = 2.0 * np.real(inner * pairs) / power[:, None, None]
        scores = 2.0 * np.real(doubled.conj().T * (self.jacobian.conj().T @ self.residual).T) / power[:, None]
        return scores, information

    @cached_property
    def cost(self) -> float:
        """-2 ln of the likelihood, up to a constant, with the most likely noise of each record."""
        squares, variance = np.sum(np.abs(self.residual) ** 2, axis=0), self.variance
        spread = -2.0 * self.residual.shape[1] * float(np.sum(np.log(self.window.weights)))
        return float(2.0 * np.sum(len(self.residual) * np.log(variance) + squares / variance)) + 2.0 * spread

    def without(self, mode: int) -> WindowFit:
        """The fit without one of its modes, the others refined in a few steps."""
        return refine_poles(self.window, np.delete(self.poles, mode, axis=0), _FEW_STEPS)

    def with_share(self, shares: tuple[float, ...]) -> WindowFit:
        """The fit with the likeliest of some shares of a line that no simple mode describes."""
        fits = [refine_poles(replace(self.window, model_error=share), self.poles, _FEW_STEPS) for share in shares]
        best = min(fits, key=lambda fit: fit.cost)
        return refine_poles(best.window, best.poles)


def resonance_terms(frequency: Floats, poles: Floats) -> Complex:
    """1 / (i (f - f_m) + d_m) of each mode: (n_lines, n_modes) array."""
    return np.asarray(1.0 / (1j * (frequency[:, None] - poles[:, 0]) + poles[:, 1]))


def fit_at_poles(window: Window, poles: Floats) -> WindowFit:
    """The fit of the residues of modes whose frequencies and decay rates are given."""
    basis, weights = window.basis(poles), window.weights[:, None]
    n = len(poles)
    change = np.concatenate([1j * basis[:, :n] ** 2, -(basis[:, :n] ** 2)], axis=1) * weights
    basis = basis * weights
    scale = np.linalg.norm(basis, axis=0)
    factors: tuple[Complex, Complex] = np.linalg.qr(basis / scale)
    orthogonal, triangle = factors
    values = window.values * weights
    inner = orthogonal.conj().T @ values
    residues = (solve_triangular(triangle, inner) / scale[:, None])[:n]
    jacobian = change - orthogonal @ (orthogonal.conj().T @ change)
    return WindowFit(window, poles, residues, values - orthogonal @ inner, jacobian, orthogonal)


def refine_poles(window: Window, poles: Floats, most_steps: int = _MOST_STEPS) -> WindowFit:
    """The most likely modes near given ones, (n_modes, 2: Hz), by damped Gauss-Newton steps."""
    fit = fit_at_poles(window, poles)
    if not len(poles):
        return fit
    damping = _FIRST_DAMPING
    for _ in range(most_steps):
        scores, information = fit.information()
        score, matrix = scores.sum(axis=0), information.sum(axis=0)
        scale = np.diagonal(matrix)
        step = np.linalg.solve(matrix + np.diag(damping * scale + 1e-300), score)
        trial = fit_at_poles(window, _move_poles(window, fit.poles, step))
        if trial.cost < fit.cost:
            is_settled = fit.cost - trial.cost < _COST_TOLERANCE * abs(trial.cost) + 1e-4
            fit, damping = trial, max(damping * _DAMPING_CUT, 1e-9)
            if is_settled:
                break
        else:
            damping *= _DAMPING_RISE
            if damping > 1e6:
                break
    return fit


def _move_poles(window: Window, poles: Floats, step: Floats) -> Floats:
    """Poles after a step: none moves further than its own width or a line, none grows with time."""
    n = len(poles)
    reach = np.maximum(poles[:, 1], window.spacing)
    frequency = poles[:, 0] + np.clip(step[:n], -reach, reach)
    decay = np.clip(poles[:, 1] + step[n:], 0.4 * poles[:, 1], 2.5 * poles[:, 1])
    return np.stack([frequency, np.maximum(decay, _LEAST_DECAY * window.spacing)], axis=1)


def search_modes(window: Window, least_gain: float) -> list[Floats]:
    """Modes of a window, (n_modes, 2: Hz), one more at each step while -2 ln likelihood falls by `least_gain`."""
    fit = refine_poles(window, np.zeros((0, 2)))
    candidates = _candidate_poles(window)
    terms = resonance_terms(window.frequency, candidates) * window.weights[:, None]
    power = np.sum(np.abs(terms) ** 2, axis=0)
    adjoint = np.ascontiguousarray(terms.conj().T)
    path: list[Floats] = []
    while len(path) < MOST_MODES and fit.n_free >= 2 * len(path) + 8:
        free_power = power - np.sum(np.abs(adjoint @ fit.orthogonal) ** 2, axis=1)
        gains = np.sum(np.abs(adjoint @ (fit.residual / np.sqrt(fit.variance))) ** 2, axis=1)
        best = int(np.argmax(gains / np.maximum(free_power, _LEAST_ORTHOGONAL * power)))
        trial = refine_poles(window, np.concatenate([fit.poles, candidates[best][None]]), _SEARCH_STEPS)
        if fit.cost - trial.cost < least_gain:
            break
        fit = trial
        path.append(fit.poles)
    return path


def _candidate_poles(window: Window) -> Floats:
    """Frequencies and decay rates that a search tries: (n, 2) array, Hz."""
    low, high = window.frequency[0], window.frequency[-1]
    reach = _OUTSIDE_SHARE * (high - low)
    frequency = np.arange(max(low - reach, window.spacing), high + reach, _FREQUENCY_STEP * window.spacing)
    decay = np.maximum(np.outer(frequency, _DAMPINGS), 0.1 * window.spacing)
    return np.stack([np.repeat(frequency, len(_DAMPINGS)), decay.ravel()], axis=1)
