"""The search: the probability of each hypothesis and effect from tables of shifts, and the p-value of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.forms import Form, forms
from bayesplate.diagnosis.hypotheses import Hypothesis, log_evidences, make_hypotheses, odds_against_none, probabilities
from bayesplate.diagnosis.laws import FormLaw, form_law
from bayesplate.diagnosis.shifts import COARSE_CELLS, Cells, refitted_shifts, tabulate
from bayesplate.diagnosis.signatures import Signature, signature
from bayesplate.diagnosis.terms import NormalTerms

LEAST_TRACE = 2.0
"""Length of a trace, in units of the readings' uncertainty, from which an effect may be one of two."""
LEAST_P_VALUE = 0.05
_LEAST_SETS, _MOST_SETS = 1000, 20_000
"""Simulated sets of readings: the standard error of a p-value of 0.05 is then a seventh, or a thirtieth, of it."""
_MOST_TERMS = 2_000_000
"""Normal densities to compute, up to which more than the least number of sets are simulated."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that the search tries, with its laws and tables."""

    name: str
    laws: tuple[FormLaw, ...]
    fine: Cells
    coarse: Cells
    signature: Signature  # of the most visible form
    # length of its visible shift at nominal size, in units of the readings' uncertainty, at the constants that a board
    # with the effect and the same frequencies would have
    trace: float


@dataclass(frozen=True, eq=False)
class SearchGround:
    """The baseline, candidates and hypotheses of a board: all that a search needs beside a residual."""

    baseline: Baseline
    candidates: Mapping[str, Candidate]
    hypotheses: tuple[Hypothesis, ...]

    @property
    def n_directions(self) -> int:
        """Directions of the readings that the constants cannot reach, by which hypotheses are judged."""
        return len(self.baseline.residual_directions)

    @property
    def paired(self) -> tuple[str, ...]:
        """Effects that may be in a pair: those with a trace that the search can see."""
        return tuple(name for name, candidate in self.candidates.items() if not candidate.trace < LEAST_TRACE)

    def with_hypotheses(self, paired: Sequence[str]) -> SearchGround:
        """The same candidates and all hypotheses about them, with pairs of the effects `paired`."""
        fine, coarse = (
            {name: getattr(candidate, kind) for name, candidate in self.candidates.items()}
            for kind in ("fine", "coarse")
        )
        return replace(self, hypotheses=make_hypotheses(self.baseline, fine, coarse, paired))

    def members(self, index: int) -> tuple[Candidate, ...]:
        """The effects of a hypothesis; none where it only exchanges labels."""
        return tuple(self.candidates[name] for name in self.hypotheses[index].members if name in self.candidates)


@dataclass(frozen=True, eq=False)
class SearchResult:
    """The evidence and the probability of each hypothesis, given one set of readings."""

    ground: SearchGround
    residual: Floats  # (n_modes,) array: ln measured less ln f of the baseline
    # log_evidence, probability: (n_hypotheses,) array
    log_evidence: Floats
    probability: Floats

    @property
    def probability_of_none(self) -> float:
        """Probability that no effect is lacking."""
        return float(self.probability[0])

    @property
    def log_odds(self) -> float:
        """ln of the odds that an effect is lacking against that none is."""
        if not self.probability_of_none:  # less than any number: the logarithms still tell how much less
            return float(odds_against_none(self.ground.hypotheses, self.log_evidence))
        with np.errstate(divide="ignore"):
            return float(np.log(self.probability[1:].sum()) - np.log(self.probability_of_none))

    def inclusion(self, name: str) -> float:
        """Probability that an effect is present, alone or with another."""
        present = [name in hypothesis.members for hypothesis in self.ground.hypotheses]
        return float(self.probability[present].sum())

    def residual_under_labels(self, index: int) -> Floats:
        """The residual under the labels of a hypothesis: (1, n_modes) array."""
        return self.ground.hypotheses[index].residual_under_labels(self.ground.baseline, self.residual[None, :])

    def cells(self, index: int) -> Floats:
        """Posterior probability of each cell of the table of a hypothesis: (n_cells,) array."""
        return self.ground.hypotheses[index].cells(self.ground.baseline, self.residual)

    def p_value(self, index: int) -> float:
        """The prior predictive p-value of a hypothesis."""
        if index not in self._p_values:
            p_values = predictive_p_value(self.ground.hypotheses[index], self.ground.baseline, self.residual[None, :])
            self._p_values[index] = float(p_values[0])
        return self._p_values[index]

    @cached_property
    def _p_values(self) -> dict[int, float]:
        """P-values computed so far, by index: each takes thousands of simulated readings."""
        return {}


def prepare_search(
    baseline: Baseline,
    solve: Callable[[Baseline, Form], FormLaw] = form_law,
    effects: Sequence[str] | None = None,
    tell: Callable[[float], None] | None = None,
) -> SearchGround:
    """Tabulate the candidates of a board, with forms solved by `solve`; without effects that no plate can have."""
    forms_by_effect = {
        name: effect_forms for name, effect_forms in forms(baseline.board).items() if effects is None or name in effects
    }
    all_candidates = []
    for name, effect_forms in forms_by_effect.items():
        all_candidates.append(
            _make_candidate(
                baseline, name, tuple(solve(baseline, form).with_modes_of(baseline) for form in effect_forms)
            )
        )
        if tell is not None:
            tell(len(all_candidates) / len(forms_by_effect))
    candidates = {
        candidate.name: candidate for candidate in all_candidates if candidate.fine.n_cells and candidate.coarse.n_cells
    }
    ground = SearchGround(baseline, candidates, ())
    return ground.with_hypotheses(ground.paired)


def run_search(ground: SearchGround, residual: Floats | None = None) -> SearchResult:
    """Compute the probabilities of the hypotheses for the board's readings, or for those of another residual."""
    residual = ground.baseline.residual if residual is None else residual
    evidence = log_evidences(ground.hypotheses, ground.baseline, residual[None, :])
    return SearchResult(ground, residual, evidence[:, 0], probabilities(ground.hypotheses, evidence)[:, 0])


def _make_candidate(baseline: Baseline, name: str, laws: tuple[FormLaw, ...]) -> Candidate:
    signatures, traces = [], []
    for law in laws:
        free = law.form.free
        nominal = {parameter.name: np.array([parameter.nominal]) for parameter in free}
        log_frequency = law.log_frequencies(baseline, baseline.log_rigidities[None, :], nominal)[0]
        signatures.append(signature(baseline, name, free, log_frequency))
        z = np.array([[float(parameter.prior.standard(parameter.nominal)) for parameter in free]])
        shift = refitted_shifts(baseline, law, z)[0][0, baseline.rows]
        traces.append(np.linalg.norm((shift - baseline.slopes @ (baseline.absorption @ shift)) / baseline.scales))
    strongest = int(np.argmax([np.nansum((signature.visible / signature.scales) ** 2) for signature in signatures]))
    fine, coarse = tabulate(baseline, laws), tabulate(baseline, laws, COARSE_CELLS)
    return Candidate(name, laws, fine, coarse, signatures[strongest], float(np.fmax.reduce(traces)))


def predictive_p_value(hypothesis: Hypothesis, baseline: Baseline, residuals: Floats) -> Floats:
    """Prior predictive probability of readings that a hypothesis expects as little as these: (n_sets,) array.

    The share of readings simulated under the hypothesis whose marginal density is no larger: noise and sizes are drawn
    from their priors and integrated over in the density, so that a size that the prior hardly allows counts as misfit,
    and neither noise nor size can follow the residual. Uniform if the hypothesis is true, whatever the number of setups
    and however different their noise. At least 1 / 1001, and 1 / 20,001 where nothing is lacking.

    Box, Sampling and Bayes' inference in scientific modelling and robustness, J. R. Stat. Soc. A 143, 383 (1980).
    """
    terms = hypothesis.terms
    observed = terms.log_evidence(hypothesis.residual_under_labels(baseline, residuals))
    expected = _simulated_log_evidences(terms)
    return np.asarray((1.0 + np.searchsorted(expected, observed, side="right")) / (1.0 + expected.size))


def _simulated_log_evidences(terms: NormalTerms) -> Floats:
    """ln of the marginal density of readings simulated under a hypothesis, in ascending order: (n_sets,) array."""
    rng = np.random.default_rng(0)
    n_batches = int(np.clip(_MOST_TERMS // terms.log_weights.size, _LEAST_SETS, _MOST_SETS)) // _LEAST_SETS
    return np.sort(
        np.concatenate([terms.log_evidence(_simulate_residuals(terms, rng, _LEAST_SETS)) for _ in range(n_batches)])
    )


def _simulate_residuals(terms: NormalTerms, rng: np.random.Generator, n_sets: int) -> Floats:
    """Simulated residuals with an effect whose size is drawn from its prior: (n_sets, n_modes) array, ln f."""
    table = terms.table
    cells = rng.choice(table.n_cells, n_sets, p=table.weights / table.weights.sum())
    coordinates = rng.standard_normal((n_sets, table.slopes.shape[2]))
    effect = table.shift[cells] + np.einsum("nip,np->ni", table.slopes[cells], coordinates)
    return effect + simulate_noise(terms.baseline, rng, n_sets)


def simulate_noise(baseline: Baseline, rng: np.random.Generator, n_sets: int) -> Floats:
    """Simulated residuals of readings without any effect: (n_sets, n_modes) array, ln f.

    Noise levels and inputs are drawn from their priors. The constants are not drawn, because the search does not depend
    on them.
    """
    noise = [setup.noise.value(rng.standard_normal(n_sets)) for setup in baseline.board.setups]
    sd = np.sqrt(np.stack(noise, axis=1)[:, baseline.setup_index] ** 2 + baseline.own_variance)
    inputs = rng.standard_normal((n_sets, baseline.input_slopes.shape[1]))
    return np.asarray(sd * rng.standard_normal(sd.shape) + inputs @ baseline.input_slopes.T)
