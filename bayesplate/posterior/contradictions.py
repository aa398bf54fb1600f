"""What the readings contradict before anything is sampled: a prior out of reach, a noise far too small."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI, moduli
from bayesplate.errors import NotIdentifiableError
from bayesplate.posterior.target import Posterior

Floats = NDArray[np.float64]

N_TRIED = 1000
_SPREAD = 3.0
"""Standard errors of the draws that are tried, as of the sampler's starts."""
NOISE_SDS = 6.0
"""The largest noise that a prior is taken to allow lies this many standard deviations of its logarithm above."""
IMPOSSIBLE_MISFIT = 1e4
"""Chi^2 per degree of freedom at that noise from which it contradicts the readings: residuals a hundred times as
large. An effect that the model lacks leaves less, and is for `diagnose` to find."""
_UNITS = {**dict.fromkeys(MODULI, (1e9, "GPa")), **dict.fromkeys(("D_x", "D_y", "D_s"), (1.0, "N m"))}


def require_reachable(posterior: Posterior, centre: Floats, covariance: Floats) -> None:
    """Refuse a prior of the constants that is zero wherever the readings allow them to be.

    Parameters
    ----------
    centre, covariance : (n_dim,) and (n_dim, n_dim) arrays
        Normal approximation of what the readings tell.

    Raises
    ------
    NotIdentifiableError
        If none of the draws around the estimate, three times as wide as its standard errors, has a prior density.
    """
    draws = np.random.default_rng(0).multivariate_normal(centre, _SPREAD**2 * covariance, N_TRIED)
    columns, limits = posterior.parameters.fitted_columns, posterior.parameters.fitted_bounds
    draws[:, columns] = np.clip(draws[:, columns], limits.lower, limits.upper)
    if np.isfinite(posterior.log_prior_constants(draws)).any():
        return
    raise NotIdentifiableError(
        f"{posterior.board.name}: the prior {posterior.prior.name} excludes the data: 0 of {N_TRIED} draws around the "
        f"least-squares estimate have a density under it{_out_of_reach(posterior, centre)}; nothing was sampled: check "
        "the prior, the labels and the units"
    )


def _out_of_reach(posterior: Posterior, centre: Floats) -> str:
    """Which constants lie outside the limits of their prior at the estimate."""
    values = posterior.parameters.values(centre[None, :])
    elastic = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
    by_name = values | elastic._asdict()
    told = []
    for name, density in posterior.prior.constants.items():
        value = float(np.ravel(by_name[name])[0])
        if not density.lower <= value <= density.upper:
            factor, unit = _UNITS[name]
            low, high = density.lower / factor, density.upper / factor
            told.append(f"{name} is about {value / factor:.3g} {unit}, the prior wants {low:g} to {high:g}")
    return f" ({'; '.join(told)})" if told else ""


def require_possible_noise(posterior: Posterior, centre: Floats) -> None:
    """Refuse a noise so small that no draw from its prior comes near the residuals.

    Parameters
    ----------
    posterior : Posterior
        Its models hold the exact law.
    centre : (n_dim,) array
        Where the residuals are smallest.

    Raises
    ------
    NotIdentifiableError
        With chi^2 per degree of freedom at the largest noise that the prior allows.
    """
    board, values = posterior.board, posterior.parameters.values(centre[None, :])
    largest = [setup.noise.median * np.exp(NOISE_SDS * setup.noise.log_sd) for setup in board.setups]
    squares, n_modes = 0.0, 0
    for readings, model, noise in zip(posterior.readings, posterior.models, largest, strict=True):
        predicted = model.log_frequencies(values, "exact")[0]
        gaps = np.maximum(np.maximum(readings.log_low - predicted, predicted - readings.log_high), 0.0)
        squares += float(np.sum((gaps / np.hypot(noise, readings.own_sd)) ** 2))
        n_modes += gaps.size
    misfit = squares / max(n_modes - board.symmetry.n, 1)
    if not misfit > IMPOSSIBLE_MISFIT:
        return
    levels = ", ".join(
        f"{100.0 * noise:.2g} %" + (f" in setup {setup.name}" if len(board.setups) > 1 else "")
        for setup, noise in zip(board.setups, largest, strict=True)
    )
    raise NotIdentifiableError(
        f"{board.name}: the declared noise contradicts the data: chi^2 / dof = {misfit:.2g} at a noise of {levels}, "
        "the most that its prior allows; nothing was sampled: look for a reading that is a decimal place off, or has "
        "another's label, or state noise_percent as large as repeated readings differ"
    )
