"""The search: from tables of shifts to the probability of every hypothesis and effect, and to the p-value of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.forms import Form, forms
from bayesplate.diagnosis.hypotheses import Hypothesis, hypotheses, log_evidences, odds_against_none, probabilities
from bayesplate.diagnosis.laws import FormLaw, form_law
from bayesplate.diagnosis.shifts import COARSE, Cells, refitted, tabulate
from bayesplate.diagnosis.signatures import Signature, signature
from bayesplate.diagnosis.terms import Terms

LEAST_TRACE = 2.0
"""Length of a trace, in units of the readings' uncertainty, from which an effect may be one of two."""
PASSES = 0.05
_LEAST, _MOST = 1000, 20_000
"""Simulated sets of readings: make the standard error of a p-value of 0.05 a seventh, or a thirtieth, of it."""
_MOST_TERMS = 2_000_000
"""Normal densities up to which more sets are simulated than the least."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that is tried."""

    name: str
    laws: tuple[FormLaw, ...]
    fine: Cells
    coarse: Cells
    signature: Signature  # of the form that shows most
    # length of its visible shift at nominal size, at the constants of a board with the effect that looks like the one
    # at hand, in units of the readings' uncertainty: what the search goes by
    trace: float


@dataclass(frozen=True, eq=False)
class Ground:
    """Everything about a board that a search needs, whatever the readings turn out to be."""

    baseline: Baseline
    candidates: Mapping[str, Candidate]
    hypotheses: tuple[Hypothesis, ...]

    @property
    def n_directions(self) -> int:
        """Directions of the readings that the constants cannot reach, and that are left to judge by."""
        return len(self.baseline.blind)

    @property
    def paired(self) -> tuple[str, ...]:
        """Effects that may be one of two: those whose trace the search could see."""
        return tuple(name for name, one in self.candidates.items() if not one.trace < LEAST_TRACE)

    def with_hypotheses(self, paired: Sequence[str]) -> Ground:
        """The same candidates and every hypothesis about them, pairs being of these effects."""
        fine, coarse = (
            {name: getattr(one, kind) for name, one in self.candidates.items()} for kind in ("fine", "coarse")
        )
        return replace(self, hypotheses=hypotheses(self.baseline, fine, coarse, paired))

    def members(self, index: int) -> tuple[Candidate, ...]:
        """The effects of a hypothesis; none where it only exchanges labels."""
        return tuple(self.candidates[name] for name in self.hypotheses[index].members if name in self.candidates)


@dataclass(frozen=True, eq=False)
class SearchResult:
    """What the search finds in one set of readings."""

    ground: Ground
    residual: Floats  # (n_modes,) array: ln measured less ln f of the baseline
    # log_evidence, probability: (n_hypotheses,) array
    log_evidence: Floats
    probability: Floats

    @property
    def none(self) -> float:
        """Probability that nothing is lacking."""
        return float(self.probability[0])

    @property
    def against_none(self) -> float:
        """ln of the odds that something is lacking against that nothing is."""
        if not self.none:  # less than any number: the logarithms still tell how much less
            return float(odds_against_none(self.ground.hypotheses, self.log_evidence))
        with np.errstate(divide="ignore"):
            return float(np.log(self.probability[1:].sum()) - np.log(self.none))

    def inclusion(self, name: str) -> float:
        """Probability that an effect is present, alone or with another."""
        present = [name in one.members for one in self.ground.hypotheses]
        return float(self.probability[present].sum())

    def seen(self, index: int) -> Floats:
        """The residual as a hypothesis reads it: (1, n_modes) array."""
        return self.ground.hypotheses[index].seen(self.ground.baseline, self.residual[None, :])

    def cells(self, index: int) -> Floats:
        """Posterior probability of each cell of the table of a hypothesis: (n_cells,) array."""
        return self.ground.hypotheses[index].cells(self.ground.baseline, self.residual)

    def p_value(self, index: int) -> float:
        """The prior predictive p-value of a hypothesis."""
        if index not in self._p_values:
            found = predictive_p_value(self.ground.hypotheses[index], self.ground.baseline, self.residual[None, :])
            self._p_values[index] = float(found[0])
        return self._p_values[index]

    @cached_property
    def _p_values(self) -> dict[int, float]:
        """Those that were asked for: each takes thousands of simulated readings."""
        return {}


def prepare_search(
    baseline: Baseline,
    solve: Callable[[Baseline, Form], FormLaw] = form_law,
    tried: Sequence[str] | None = None,
    tell: Callable[[float], None] | None = None,
) -> Ground:
    """Tabulate the candidates of a board, their forms solved by `solve`; without any that leaves no plate."""
    every = {name: each for name, each in forms(baseline.board).items() if tried is None or name in tried}
    made = []
    for name, each in every.items():
        made.append(_candidate(baseline, name, tuple(solve(baseline, form).placed(baseline) for form in each)))
        if tell is not None:
            tell(len(made) / len(every))
    candidates = {one.name: one for one in made if one.fine.n_cells and one.coarse.n_cells}
    ground = Ground(baseline, candidates, ())
    return ground.with_hypotheses(ground.paired)


def search(ground: Ground, residual: Floats | None = None) -> SearchResult:
    """Judge one set of readings: those of the board, or others given by their residual."""
    residual = ground.baseline.residual if residual is None else residual
    evidence = log_evidences(ground.hypotheses, ground.baseline, residual[None, :])
    return SearchResult(ground, residual, evidence[:, 0], probabilities(ground.hypotheses, evidence)[:, 0])


def _candidate(baseline: Baseline, name: str, laws: tuple[FormLaw, ...]) -> Candidate:
    seen, traces = [], []
    for law in laws:
        free = law.form.free
        nominal = {one.name: np.array([one.nominal]) for one in free}
        there = law.log_frequencies(baseline, baseline.log_rigidities[None, :], nominal)[0]
        seen.append(signature(baseline, name, free, there))
        z = np.array([[float(one.prior.standard(one.nominal)) for one in free]])
        shift = refitted(baseline, law, z)[0][0, baseline.rows]
        traces.append(np.linalg.norm((shift - baseline.slopes @ (baseline.absorbing @ shift)) / baseline.scales))
    shown = int(np.argmax([np.nansum((one.visible / one.scales) ** 2) for one in seen]))
    fine, coarse = tabulate(baseline, laws), tabulate(baseline, laws, COARSE)
    return Candidate(name, laws, fine, coarse, seen[shown], float(np.fmax.reduce(traces)))


def predictive_p_value(hypothesis: Hypothesis, baseline: Baseline, residuals: Floats) -> Floats:
    """Prior predictive probability of readings that a hypothesis expects as little as these: (n_sets,) array.

    The share of readings simulated under the hypothesis whose marginal density is no larger: noise and sizes are drawn
    from their priors and integrated over in the density, so that a size that the prior hardly allows counts as misfit,
    and neither noise nor size can follow the residual. Uniform if the hypothesis is true, whatever the number of setups
    and however different their noise. At least 1 / 1001, and 1 / 20,001 where nothing is lacking.

    Box, Sampling and Bayes' inference in scientific modelling and robustness, J. R. Stat. Soc. A 143, 383 (1980).
    """
    terms = hypothesis.terms
    observed = terms.log_evidence(hypothesis.seen(baseline, residuals))
    expected = _expected(terms)
    return np.asarray((1.0 + np.searchsorted(expected, observed, side="right")) / (1.0 + expected.size))


def _expected(terms: Terms) -> Floats:
    """ln of the marginal density of readings simulated under a hypothesis, in ascending order: (n_sets,) array."""
    rng = np.random.default_rng(0)
    n_batches = int(np.clip(_MOST_TERMS // terms.log_weights.size, _LEAST, _MOST)) // _LEAST
    return np.sort(np.concatenate([terms.log_evidence(_simulated(terms, rng, _LEAST)) for _ in range(n_batches)]))


def _simulated(terms: Terms, rng: np.random.Generator, n_sets: int) -> Floats:
    """Residuals with an effect whose size is drawn from its prior: (n_sets, n_modes) array, ln f."""
    table = terms.table
    cells = rng.choice(table.n_cells, n_sets, p=table.weights / table.weights.sum())
    along = rng.standard_normal((n_sets, table.slopes.shape[2]))
    effect = table.shift[cells] + np.einsum("nip,np->ni", table.slopes[cells], along)
    return effect + noise_of_board(terms.baseline, rng, n_sets)


def noise_of_board(baseline: Baseline, rng: np.random.Generator, n_sets: int) -> Floats:
    """Residuals of readings without any effect: (n_sets, n_modes) array, ln f.

    Noise levels and inputs are drawn from their priors; the constants need no drawing, for the search does not see
    them.
    """
    noise = [setup.noise.value(rng.standard_normal(n_sets)) for setup in baseline.board.setups]
    sd = np.sqrt(np.stack(noise, axis=1)[:, baseline.setup_index] ** 2 + baseline.own_variance)
    inputs = rng.standard_normal((n_sets, baseline.input_slopes.shape[1]))
    return np.asarray(sd * rng.standard_normal(sd.shape) + inputs @ baseline.input_slopes.T)
