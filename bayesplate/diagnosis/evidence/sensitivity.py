"""How far the answer hangs on what was assumed: the same search with other priors, and under the exact law."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.evidence.exact import under_exact_law
from bayesplate.diagnosis.evidence.hypotheses import Hypothesis, log_evidences, probabilities
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.shifts.tables import Table

Floats = NDArray[np.float64]

WIDTHS = {"halved": 0.5, "doubled": 2.0}
"""Factors of the standard deviation of the priors of all sizes."""
NOISES = {"smaller": 1.0 / 1.5, "larger": 1.5}
"""Factors of the noise prior."""


@dataclass(frozen=True, eq=False)
class Variant:
    """The search under another assumption.

    Attributes
    ----------
    words : str
        Which: "if the noise is 1.5 times larger".
    found : Found
    """

    words: str
    found: Found


def variants(found: Found) -> Iterator[Variant]:
    """The searches that a name has to survive, each made when it is asked for.

    Parameters
    ----------
    found : Found

    Returns
    -------
    iterator of Variant
        With the width of the sizes' priors halved and doubled, the noise prior moved by 1.5 either way, and under the
        exact law where the candidates have one.
    """
    for word, factor in WIDTHS.items():
        yield Variant(f"with the priors of the sizes {word}", varied(found, width=factor))
    for word, factor in NOISES.items():
        yield Variant(f"if the noise is 1.5 times {word}", varied(found, noise=factor))
    exact = under_exact_law(found)
    if exact is not None:
        yield Variant("under the exact law", exact)


@lru_cache(maxsize=8)  # the verdict, the claim and the result ask for the same
def varied(found: Found, *, width: float = 1.0, noise: float = 1.0) -> Found:
    """The same search with other priors.

    Parameters
    ----------
    found : Found
    width : float
        Factor of the standard deviation of every size's prior. The cells reach three of the old standard deviations;
        what a wider prior puts beyond them counts as unable to explain the readings.
    noise : float
        Factor of every noise prior.

    Returns
    -------
    Found
    """
    ground = found.ground
    changed = replace(ground, hypotheses=tuple(_changed(found, one, width, noise) for one in ground.hypotheses))
    evidences = log_evidences(changed.hypotheses, changed.whole, found.residual[None, :])
    return Found(changed, found.residual, evidences[:, 0], probabilities(changed.hypotheses, evidences)[:, 0])


def inclusion_with_width(found: Found, factor: float) -> dict[str, float]:
    """Inclusion probability of each candidate when the standard deviation of every amplitude prior is multiplied.

    Parameters
    ----------
    found : Found
    factor : float

    Returns
    -------
    dict of float
        By name; "" is no effect at all.
    """
    wider = varied(found, width=factor)
    return {"": wider.none, **{name: wider.inclusion(name) for name in found.ground.candidates}}


def _changed(found: Found, one: Hypothesis, width: float, noise: float) -> Hypothesis:
    candidates = [found.ground.candidates[name] for name in one.members if name in found.ground.candidates]
    tables = [each.fine if len(candidates) == 1 else each.coarse for each in candidates]
    weights = np.ones(1)
    for candidate, table in zip(candidates, tables, strict=True):
        free = [[parameter.prior for parameter in law.form.free] for law in candidate.laws]
        weights = np.outer(weights, table.weights * _widening(table, free, width)).ravel()
    table = one.table if not candidates else replace(one.table, weights=weights)
    return replace(one, table=table, noise=replace(one.noise, sd=noise * one.noise.sd))


def _widening(table: Table, priors: list[list[Quantity]], factor: float) -> Floats:
    """Density of the wider prior over that of the old one at each cell: (n_cells,) array."""
    result = np.ones(table.n_cells)
    for index, of_form in enumerate(priors):
        own = table.form == index
        for i, prior in enumerate(of_form):
            z = table.z[own, i]
            wider = np.exp(-0.5 * (z / factor) ** 2) / (factor * _inside(prior, factor))
            result[own] *= wider / (np.exp(-0.5 * z**2) / _inside(prior, 1.0))
    return result


def _inside(prior: Quantity, factor: float) -> float:
    """Share of a normal distribution of that standard deviation within the prior's bounds."""
    from scipy.special import ndtr

    low, high = (float(prior.standard(bound)) / factor for bound in (prior.lower, prior.upper))
    return float(ndtr(high) - ndtr(low))
