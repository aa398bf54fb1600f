"""What is believed of a board now: every surviving explanation as normal terms of constants, inputs and sizes.

Around a cell of an effect's table and at one level of noise everything is linear and normal,

    y = shift + X x + Z z + S t + noise,

with x the logarithms of the free rigidities beyond what the cell has moved them by, z the standard coordinates of the
uncertain inputs, and t the place within the cell. Given the readings at hand u = (x, z, t) is normal, so that an
explanation is a mixture of normal terms, each with the weight that its cell and its level have now.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, RIGIDITIES, moduli
from bayesplate.diagnosis.decision.verdict import Answer, answer_words
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.evidence.terms import Terms, normalised
from bayesplate.posterior.parameters import Parameters

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

N_TERMS = 96
"""Equally weighted terms that stand for an explanation."""
NOTHING_LACKS = "no effect"
_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class Explanation:
    """One thing that may be the case, as equally probable normal terms of u = (x, z, t).

    Attributes
    ----------
    members : tuple of str
        Effects that are present; empty for none.
    words : str
    probability : float
        Among the explanations that survive; they sum to one.
    mean : (n_terms, n_u) array
    covariance : (n_terms, n_u, n_u) array
    noise : (n_terms, n_setups) array
        Relative.
    log_moduli : (n_terms, 3) array
        ln of E_x, E_y, G_xy (Pa) where u is zero.
    to_moduli : (n_terms, 3, n_u) array
        Their slopes.
    cells : (n_terms,) array of int
        Of the table of its hypothesis.
    hypothesis : int
        Its index; 0 where nothing is lacking.
    """

    members: tuple[str, ...]
    words: str
    probability: float
    mean: Floats
    covariance: Floats
    noise: Floats
    log_moduli: Floats
    to_moduli: Floats
    cells: Rows
    hypothesis: int = 0

    @property
    def n_terms(self) -> int:
        """Number of terms."""
        return len(self.mean)

    @property
    def expected(self) -> Floats:
        """Mean of ln E_x, E_y, G_xy in each term: (n_terms, 3) array."""
        return np.asarray(self.log_moduli + np.einsum("tmu,tu->tm", self.to_moduli, self.mean))


@dataclass(frozen=True, eq=False)
class Beliefs:
    """What is believed of a board now.

    Attributes
    ----------
    board : Board
    explanations : tuple of Explanation
        The most probable first.
    n_inputs : int
        Uncertain inputs: the columns of u after the constants.
    """

    board: Board
    explanations: tuple[Explanation, ...]
    n_inputs: int

    @property
    def probabilities(self) -> Floats:
        """Of the explanations: (n_explanations,) array."""
        return np.array([one.probability for one in self.explanations])

    @property
    def entropy(self) -> float:
        """Of the explanations, nats."""
        return float(-np.sum([p * np.log(p) for p in self.probabilities if p > 0.0]))


def believed(found: Found, survivors: Sequence[Answer], rng: np.random.Generator) -> Beliefs:
    """What a search leaves to be believed of a board.

    Parameters
    ----------
    found : Found
    survivors : sequence of Answer
        That of no effect with index 0.
    rng : numpy.random.Generator
        Picks the terms that stand for all.
    """
    baseline = found.ground.baseline
    total = sum(one.support for one in survivors)
    explanations = tuple(_explained(found, one, one.support / total, rng) for one in survivors)
    return Beliefs(baseline.board, explanations, baseline.input_slopes.shape[1])


def _explained(found: Found, answer: Answer, probability: float, rng: np.random.Generator) -> Explanation:
    """An answer of the search as terms: cells and levels of noise drawn by what they weigh now."""
    hypothesis = found.ground.hypotheses[answer.index]
    terms = hypothesis.terms(found.ground.whole)
    seen = hypothesis.seen(found.ground.baseline, found.residual[None, :])
    shares = normalised(terms.log_densities(seen)[:, 0])
    picked = picked_by(shares, N_TERMS, rng)
    levels, cells = np.divmod(picked, terms.table.n_cells)
    noise = terms.noise.sd[levels]
    mean, covariance = _conditioned(terms, seen[0], cells, noise)
    log_moduli, gradient = _moduli(found, mean.shape[1])
    by_constants = gradient[:, : found.ground.baseline.log_rigidities.size]
    moved, slopes = terms.table.moved[cells], terms.table.moved_slopes[cells]
    to_moduli = np.tile(gradient, (len(cells), 1, 1))
    to_moduli[:, :, mean.shape[1] - slopes.shape[2] :] = by_constants @ slopes
    words = answer_words(found, answer) if answer.members else NOTHING_LACKS
    return Explanation(
        members=hypothesis.members,
        words=words,
        probability=probability,
        mean=mean,
        covariance=covariance,
        noise=noise,
        log_moduli=log_moduli + moved @ by_constants.T,
        to_moduli=to_moduli,
        cells=cells,
        hypothesis=answer.index,
    )


def picked_by(shares: Floats, n: int, rng: np.random.Generator) -> Rows:
    """Indices drawn by their shares with the least scatter (systematic): (n,) array."""
    places = (np.arange(n) + rng.random()) / n
    return np.asarray(np.minimum(np.searchsorted(np.cumsum(shares), places), shares.size - 1), dtype=np.intp)


def _conditioned(terms: Terms, seen: Floats, cells: Rows, noise: Floats) -> tuple[Floats, Floats]:
    """Mean and covariance of u in some terms, given the residuals of the readings that are used."""
    base, used, table = terms.fold.baseline, terms.fold.used, terms.table
    sides = np.concatenate([base.slopes, base.input_slopes], axis=1)[used]
    tangents = table.slopes[cells][:, used]
    design = np.concatenate([np.tile(sides, (len(cells), 1, 1)), tangents], axis=2)
    variance = noise[:, base.setup_index[used]] ** 2 + base.own_variance[used]
    weighted = design / variance[:, :, None]
    precision = np.swapaxes(weighted, 1, 2) @ design
    n = base.log_rigidities.size
    prior = np.r_[np.zeros(n), np.ones(design.shape[2] - n)]
    covariance = np.linalg.inv(precision + np.diag(prior))
    told = np.einsum("tnu,tn->tu", weighted, seen[used] - table.shift[cells][:, used])
    return np.einsum("tuv,tv->tu", covariance, told), covariance


def _moduli(found: Found, n_u: int) -> tuple[Floats, Floats]:
    """ln of the moduli at the baseline with inputs at the middle of their priors, and their slopes by x and z."""
    baseline = found.ground.baseline
    return moduli_at(baseline.board, baseline.log_rigidities, n_u)


def moduli_at(board: Board, log_rigidities: Floats, n_u: int) -> tuple[Floats, Floats]:
    """ln E_x, E_y, G_xy (Pa), (3,) array, and their slopes, (3, n_u) array, zero beyond the inputs.

    Parameters
    ----------
    board : Board
    log_rigidities : (n_constants,) array
        Where the slopes are taken, the inputs at the middle of their priors.
    n_u : int
        Columns of u, at least the constants and the inputs.
    """
    parameters = Parameters(board)
    columns = parameters.fitted_columns
    theta = np.zeros((1 + 2 * columns.size, parameters.n_dim))
    theta[:, : parameters.n_constants] = log_rigidities
    for i, column in enumerate(columns):
        theta[1 + 2 * i, column] += _STEP
        theta[2 + 2 * i, column] -= _STEP
    values = parameters.values(theta)
    D_x, D_y, D_s = (values[name] for name in RIGIDITIES)
    found = moduli(D_x, D_y, D_s, values["thickness"], values["poisson_xy"])
    logs = np.stack([np.log(np.broadcast_to(one, len(theta))) for one in found], axis=1)
    slopes = np.zeros((len(MODULI), n_u))
    slopes[:, : columns.size] = ((logs[1::2] - logs[2::2]) / (2.0 * _STEP)).T
    return logs[0], slopes
