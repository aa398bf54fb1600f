"""The hypotheses about a board and their priors: no effect, one effect, two effects, or two labels exchanged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations, pairwise

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Board
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.shifts import Cells, JointLaws, combine_cells, no_effect_cells
from bayesplate.diagnosis.terms import NoiseGrid, NormalTerms, log_sum, noise_grid, noise_reach, normalised_weights
from bayesplate.effects import EFFECTS

PRIOR_OF_NONE, PRIOR_OF_ONE, PRIOR_OF_TWO = 0.5, 0.4, 0.1
"""Prior probability that no effect, one or two cause a residual; shared equally by the hypotheses of each kind."""

RELABELLING = "relabelling"
CLOSE_LOG_RATIO = 0.12
"""ln of a frequency ratio up to which neighbouring readings of different symmetry may have been confused."""


@dataclass(frozen=True)
class Swap:
    """Two readings whose labels may have been exchanged: indices among all readings."""

    first: int
    second: int

    def applied(self, baseline: Baseline) -> Baseline:
        """The baseline with each of the two readings under the other label."""
        rows = baseline.rows.copy()
        rows[[self.first, self.second]] = rows[[self.second, self.first]]
        return baseline.labelled(rows)

    def words(self, baseline: Baseline) -> str:
        """Which labels: "(2,0) and (1,2)", with the setup where there are several."""
        setups = baseline.board.setups
        labels = [str(label) for setup in setups for label in setup.labels]
        setup_words = f" in setup {setups[baseline.setup_index[self.first]].name}" if len(setups) > 1 else ""
        return f"{labels[self.first]} and {labels[self.second]}{setup_words}"


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One hypothesis about a board: the effects that act, or two labels exchanged."""

    members: tuple[str, ...]  # effects that are present; empty for none
    prior: float
    table: Cells  # of all modes that readings may be
    noise: NoiseGrid
    baseline: Baseline  # the baseline with the labels that readings have under this hypothesis
    swap: Swap | None = None  # the two labels that it exchanges
    # ln of the likelihood summed over all assignments of peaks to modes, over that of the labels of `baseline`
    log_labels: float = 0.0
    joint: JointLaws = field(default_factory=dict)  # joint laws of a pair, where its shifts are not just added

    @cached_property
    def terms(self) -> NormalTerms:
        """Its normal terms for the readings under its labels."""
        return NormalTerms(self.table.at_modes(self.baseline.rows), self.baseline, self.noise)

    def residual_under_labels(self, baseline: Baseline, residuals: Floats) -> Floats:
        """Residuals of a baseline, which may have other labels, under the labels of this hypothesis: (n_sets, n_modes)
        arrays."""
        return residuals + (baseline.middle - self.baseline.middle)

    def labelled(self, baseline: Baseline, rows: Indices) -> Hypothesis:
        """The same hypothesis with other labels of the readings, by indices of modes."""
        return replace(self, baseline=baseline.labelled(rows))

    def log_by_cell(self, baseline: Baseline, residual: Floats) -> Floats:
        """ln of prior times density of each cell of its table, noise averaged, without `half_log_det`: (n_cells,)
        array."""
        log_densities = self.terms.log_densities(self.residual_under_labels(baseline, residual[None, :]))[:, 0]
        return log_sum(log_densities.reshape(-1, self.table.n_cells))

    def cells(self, baseline: Baseline, residual: Floats) -> Floats:
        """Posterior probability of each cell of its table: (n_cells,) array from an (n_modes,) residual."""
        return normalised_weights(self.log_by_cell(baseline, residual))


def make_hypotheses(
    baseline: Baseline, fine: Mapping[str, Cells], coarse: Mapping[str, Cells], paired: Sequence[str]
) -> tuple[Hypothesis, ...]:
    """All hypotheses about a board: no effect first, then single effects, exchanged labels, and pairs of effects.

    Pairs are of the effects `paired`, which are visible: an effect that cannot be seen would cost a pair nothing, and
    every effect would seem to come with one. Pairs combine coarse tables.
    """
    board = baseline.board
    reach = noise_reach(board, baseline.setup_index, np.where(baseline.is_mode, baseline.residual, np.nan))
    levels, few_levels = (noise_grid(board, is_coarse=are_few, reach=reach) for are_few in (False, True))
    empty = no_effect_cells(baseline.possible_modes.log_frequency.size, baseline.log_rigidities.size)
    swaps = confusable_labels(baseline)
    pairs = list(combinations([name for name in fine if name in paired], 2))
    single_prior = PRIOR_OF_ONE / max(len(fine) + bool(swaps), 1)
    all_hypotheses = [Hypothesis((), PRIOR_OF_NONE, empty, levels, baseline)]
    all_hypotheses += [Hypothesis((name,), single_prior, table, levels, baseline) for name, table in fine.items()]
    all_hypotheses += [
        Hypothesis((RELABELLING,), single_prior / len(swaps), empty, levels, swap.applied(baseline), swap)
        for swap in swaps
    ]
    for pair in pairs:
        pair_prior = single_prior if are_stated(board, pair) else PRIOR_OF_TWO / len(pairs)
        all_hypotheses.append(
            Hypothesis(pair, pair_prior, combine_cells(*(coarse[name] for name in pair)), few_levels, baseline)
        )
    return tuple(all_hypotheses)


def are_stated(board: Board, pair: Sequence[str]) -> bool:
    """Whether two effects are known ones of which the card states at least one, without declaring it.

    Two effects that are known to act are no coincidence: such a pair has the prior of a single effect, and is an
    explanation of its own.
    """
    effects = [EFFECTS[name] for name in pair if name in EFFECTS]
    return (
        len(effects) == 2
        and all(effect.is_known(board) for effect in effects)
        and any(effect.is_implied(board) for effect in effects)
    )


def confusable_labels(baseline: Baseline) -> tuple[Swap, ...]:
    """Pairs of neighbouring readings of one setup, close in frequency, whose labels may have been exchanged.

    Either their modes belong to different symmetry classes; or to one, and the readings are in the other order than the
    modes of the fitted plate, which an effect that mixes the two may cause as well as a slip.
    Empty where a card doubts a label or a peak has none: there the sums over assignments of peaks to modes cover other
    labels, and a label that is stated for sure is kept.
    """
    readings = baseline.log_readings
    if baseline.possible_modes.is_open:
        return ()
    swaps = []
    for setup in range(len(baseline.board.setups)):
        members = np.flatnonzero(baseline.setup_index == setup)
        ordered = members[np.argsort(readings[members])]
        for first, second in pairwise(ordered):
            differ = baseline.places[first].parity != baseline.places[second].parity
            crossed = baseline.log_frequency[first] > baseline.log_frequency[second]
            if (differ or crossed) and readings[second] - readings[first] < CLOSE_LOG_RATIO:
                swaps.append(Swap(int(first), int(second)))
    return tuple(swaps)


def log_evidences(hypotheses: Sequence[Hypothesis], baseline: Baseline, residuals: Floats) -> Floats:
    """Logarithm of the evidence of every hypothesis for every data set: (n_hypotheses, n_sets) array.

    Summed over the assignments of peaks to modes, where the hypotheses have labels of their own (`with_own_labels`).
    """
    return np.stack(
        [
            hypothesis.terms.log_evidence(hypothesis.residual_under_labels(baseline, residuals)) + hypothesis.log_labels
            for hypothesis in hypotheses
        ]
    )


def probabilities(hypotheses: Sequence[Hypothesis], evidences: Floats) -> Floats:
    """Posterior probabilities, summing to one over the hypotheses: same shape as the evidences."""
    return normalised_weights(_log_joint(hypotheses, evidences))


def odds_against_none(hypotheses: Sequence[Hypothesis], evidences: Floats) -> Floats:
    """ln of the odds that an effect is lacking against that none is: one per data set."""
    total = _log_joint(hypotheses, evidences)
    if len(total) == 1:
        return np.full(total.shape[1:], -np.inf)
    return np.asarray(log_sum(total[1:]) - total[0])


def _log_joint(all_hypotheses: Sequence[Hypothesis], evidences: Floats) -> Floats:
    log_prior = np.log([hypothesis.prior for hypothesis in all_hypotheses])
    return np.asarray(evidences + log_prior.reshape(-1, *([1] * (evidences.ndim - 1))))
