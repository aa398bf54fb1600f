"""The search: from tables of shifts to the probability of every hypothesis and every effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.hypotheses import (
    Hypothesis,
    hypotheses,
    log_evidences,
    odds_against_none,
    probabilities,
)
from bayesplate.diagnosis.evidence.predictive import predictive_p_value
from bayesplate.diagnosis.evidence.terms import Fold
from bayesplate.diagnosis.shifts.baseline import Baseline
from bayesplate.diagnosis.shifts.forms import forms
from bayesplate.diagnosis.shifts.laws import FormLaw, form_law
from bayesplate.diagnosis.shifts.pairs import JointLaws, Solve
from bayesplate.diagnosis.shifts.tables import COARSE, Table, nominal_shift, tabulate, traced_shift

Floats = NDArray[np.float64]

LEAST_TRACE = 2.0
"""Length of a trace, in units of the readings' uncertainty, from which an effect may be one of two."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An effect that is tried.

    Attributes
    ----------
    name : str
    laws : tuple of FormLaw
        Of its forms.
    fine, coarse : Table
    raw, visible : (n_modes,) array
        Shift at nominal size before and after the constants are refitted, ln f; of the form that shows most.
    moved : (n_constants,) array
        What that refit takes from ln D, so that the constants of a board with the effect are larger by it.
    traced : (n_modes,) array, optional
        The visible shift at the constants of a board with the effect that looks like the one at hand: what the search
        goes by. By default the same as `visible`.
    shown : int
        Which of the laws `raw` and `visible` are of.
    """

    name: str
    laws: tuple[FormLaw, ...]
    fine: Table
    coarse: Table
    raw: Floats
    visible: Floats
    moved: Floats
    traced: Floats | None = None
    shown: int = 0


@dataclass(frozen=True, eq=False)
class Ground:
    """Everything about a board that a search needs, whatever the readings turn out to be.

    Attributes
    ----------
    baseline : Baseline
    candidates : dict of Candidate
    hypotheses : tuple of Hypothesis
    joint : dict of JointLaws
        By the members of a pair whose table is not that of shifts that add.
    """

    baseline: Baseline
    candidates: Mapping[str, Candidate]
    hypotheses: tuple[Hypothesis, ...]
    joint: Mapping[tuple[str, ...], JointLaws] = field(default_factory=dict)

    @cached_property
    def whole(self) -> Fold:
        """The fold that uses all readings."""
        return Fold(self.baseline)

    @property
    def n_directions(self) -> int:
        """Directions of the readings that the constants cannot reach, and that are left to judge by."""
        return len(self.whole.blind)

    def visibility(self, name: str) -> float:
        """Visible rms of a candidate in units of the rms that drowns in the noise: 2 noise / sqrt(n)."""
        seen = self.candidates[name].visible / self.baseline.scales
        return float(np.sqrt(np.mean(seen**2) * self.baseline.n_modes)) / 2.0

    @property
    def paired(self) -> tuple[str, ...]:
        """Effects that may be one of two: those whose trace the search could see."""
        return tuple(name for name in self.candidates if not self.trace(name) < LEAST_TRACE)

    def trace(self, name: str) -> float:
        """Root of the sum of squares of a candidate's traced shift, in units of each reading's uncertainty."""
        one = self.candidates[name]
        seen = self.baseline.whitened(one.visible if one.traced is None else one.traced)
        return float(np.sqrt(np.sum(seen**2)))

    def is_below_detection_limit(self, name: str) -> bool:
        """Whether this experiment could not see a candidate even if it were there."""
        return self.visibility(name) < 1.0

    def cosine(self, one: str, other: str) -> float:
        """Likeness of the visible parts of two candidates, -1 to 1; 0 where nothing is visible."""
        first, second = (self.candidates[name].visible / self.baseline.scales for name in (one, other))
        norms = float(np.linalg.norm(first) * np.linalg.norm(second))
        return float(first @ second) / norms if norms > 0 and self.n_directions else 0.0


@dataclass(frozen=True, eq=False)
class Found:
    """What the search finds in one set of readings.

    Attributes
    ----------
    ground : Ground
    residual : (n_modes,) array
        ln measured less ln f of the baseline.
    log_evidence, probability : (n_hypotheses,) array
    """

    ground: Ground
    residual: Floats
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

    def p_value(self, index: int) -> float:
        """The prior predictive p-value of a hypothesis."""
        if index not in self._p_values:
            found = predictive_p_value(self.ground.hypotheses[index], self.ground.whole, self.residual[None, :])
            self._p_values[index] = float(found[0])
        return self._p_values[index]

    @cached_property
    def _p_values(self) -> dict[int, float]:
        """Those that were asked for: each takes thousands of simulated readings."""
        return {}


def prepare_search(
    baseline: Baseline,
    solve: Solve | None = None,
    tried: Sequence[str] | None = None,
    tell: Callable[[float], None] | None = None,
) -> Ground:
    """Tabulate every candidate of a board.

    Parameters
    ----------
    baseline : Baseline
    solve : callable, optional
        By default full solves around the baseline.
    tried : sequence of str, optional
        Effects to try; by default all that are not declared and can act.
    tell : callable, optional
        Told which share of the effects is done.

    Returns
    -------
    Ground
        Without effects that leave no plate, whatever their size.
    """
    solve = form_law if solve is None else solve
    every = {name: each for name, each in forms(baseline.board).items() if tried is None or name in tried}

    def candidate(name: str) -> Candidate:
        return _candidate(baseline, name, tuple(solve(baseline, form).placed(baseline) for form in every[name]))

    made = []
    for name in every:
        made.append(candidate(name))
        if tell is not None:
            tell(len(made) / len(every))
    candidates = {one.name: one for one in made if one.fine.n_cells and one.coarse.n_cells}
    ground = Ground(baseline, candidates, ())
    fine = {name: one.fine for name, one in candidates.items()}
    coarse = {name: one.coarse for name, one in candidates.items()}
    return Ground(baseline, candidates, hypotheses(baseline, fine, coarse, ground.paired))


def search(ground: Ground, residual: Floats | None = None) -> Found:
    """Judge one set of readings: those of the board, or others given by their residual."""
    residual = ground.baseline.residual if residual is None else residual
    evidence = log_evidences(ground.hypotheses, ground.whole, residual[None, :])
    return Found(ground, residual, evidence[:, 0], probabilities(ground.hypotheses, evidence)[:, 0])


def _candidate(baseline: Baseline, name: str, laws: tuple[FormLaw, ...]) -> Candidate:
    shifts = [nominal_shift(baseline, law) for law in laws]
    shown = int(np.argmax([np.nansum((visible / baseline.scales) ** 2) for _, visible, _ in shifts]))
    traced = max((traced_shift(baseline, law) for law in laws), key=lambda shift: float(np.nansum(shift**2)))
    fine, coarse = tabulate(baseline, name, laws), tabulate(baseline, name, laws, COARSE)
    return Candidate(name, laws, fine, coarse, *shifts[shown], traced, shown)
