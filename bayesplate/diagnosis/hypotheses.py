"""What may be the case: nothing, one effect, two, or two labels exchanged; and how probable each is beforehand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations, pairwise

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.diagnosis.baseline import Baseline, Rows
from bayesplate.diagnosis.shifts import Cells, JointLaws, nothing, together
from bayesplate.diagnosis.terms import NoiseGrid, Terms, log_sum, noise_grid, normalised, reach_of
from bayesplate.effects import EFFECTS

NONE, ONE, TWO = 0.5, 0.4, 0.1
"""Prior probability that nothing, one effect, or two are behind a residual; each shared equally by those tried."""

RELABELLING = "relabelling"
CLOSE = 0.12
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
        where = f" in setup {setups[baseline.setup_index[self.first]].name}" if len(setups) > 1 else ""
        return f"{labels[self.first]} and {labels[self.second]}{where}"


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One thing that may be the case."""

    members: tuple[str, ...]  # effects that are present; empty for none
    prior: float
    table: Cells  # of all modes that readings may be
    noise: NoiseGrid
    own: Baseline  # the baseline with the labels that readings have if it is the case
    swap: Swap | None = None  # the two labels that it exchanges
    # ln of the likelihood summed over all ways to take the peaks for modes, over that of the labels at hand
    log_labels: float = 0.0
    joint: JointLaws = field(default_factory=dict)  # of a pair whose table is not that of shifts that add

    @cached_property
    def terms(self) -> Terms:
        """Its normal terms for the readings under its labels."""
        return Terms(self.table.of(self.own.rows), self.own, self.noise)

    def seen(self, baseline: Baseline, residuals: Floats) -> Floats:
        """Residuals of a baseline with other labels as this hypothesis reads them: (n_sets, n_modes) arrays."""
        return residuals + (baseline.middle - self.own.middle)

    def labelled(self, baseline: Baseline, rows: Rows) -> Hypothesis:
        """The same hypothesis, the readings of a baseline taken for other modes of its spectrum."""
        return replace(self, own=baseline.labelled(rows))

    def log_by_cell(self, baseline: Baseline, residual: Floats) -> Floats:
        """ln of prior times density of each cell of its table, noise averaged, without volume: (n_cells,) array."""
        log_densities = self.terms.log_densities(self.seen(baseline, residual[None, :]))[:, 0]
        return log_sum(log_densities.reshape(-1, self.table.n_cells))

    def cells(self, baseline: Baseline, residual: Floats) -> Floats:
        """Posterior probability of each cell of its table: (n_cells,) array from an (n_modes,) residual."""
        log_densities = self.terms.log_densities(self.seen(baseline, residual[None, :]))[:, 0]
        return np.asarray(normalised(log_densities).reshape(-1, self.table.n_cells).sum(axis=0))


def hypotheses(
    baseline: Baseline, fine: Mapping[str, Cells], coarse: Mapping[str, Cells], paired: Sequence[str]
) -> tuple[Hypothesis, ...]:
    """Every hypothesis about a board: none first, then single effects, exchanged labels, and pairs of those `paired`.

    These could be seen: a pair costs nothing for a member that cannot, and every effect would seem to come with one.
    Pairs combine coarse tables.
    """
    board = baseline.board
    reach = reach_of(board, baseline.setup_index, np.where(baseline.is_mode, baseline.residual, np.nan))
    levels, few = (noise_grid(board, few=are_few, reach=reach) for are_few in (False, True))
    empty = nothing(baseline.every.log_frequency.size, baseline.log_rigidities.size)
    swaps = confusable(baseline)
    pairs = list(combinations([name for name in fine if name in paired], 2))
    each = ONE / max(len(fine) + bool(swaps), 1)
    found = [Hypothesis((), NONE, empty, levels, baseline)]
    found += [Hypothesis((name,), each, table, levels, baseline) for name, table in fine.items()]
    found += [
        Hypothesis((RELABELLING,), each / len(swaps), empty, levels, swap.applied(baseline), swap) for swap in swaps
    ]
    for pair in pairs:
        prior = each if are_stated(board, pair) else TWO / len(pairs)
        found.append(Hypothesis(pair, prior, together(*(coarse[name] for name in pair)), few, baseline))
    return tuple(found)


def are_stated(board: Board, pair: Sequence[str]) -> bool:
    """Whether two effects are known ones of which the card states at least one, without declaring it.

    What is known to be there is no coincidence of two causes: such a pair has the prior of a single effect, and stands
    for itself.
    """
    effects = [EFFECTS[name] for name in pair if name in EFFECTS]
    return (
        len(effects) == 2
        and all(effect.is_known(board) for effect in effects)
        and any(effect.is_implied(board) for effect in effects)
    )


def confusable(baseline: Baseline) -> tuple[Swap, ...]:
    """Neighbouring readings of one setup that lie close together and whose labels may be each other's.

    None where a card doubts a label or a peak has none: there the sums over assignments of peaks to modes say what each
    may be instead, and a label that is stated for sure stands.
    Either they belong to different symmetry classes; or to one, and stand in the other order than the modes of the
    fitted plate, which an effect that mixes the two may cause as well as a slip.
    """
    readings = baseline.log_readings
    if baseline.every.is_open:
        return ()
    swaps = []
    for setup in range(len(baseline.board.setups)):
        members = np.flatnonzero(baseline.setup_index == setup)
        ordered = members[np.argsort(readings[members])]
        for first, second in pairwise(ordered):
            differ = baseline.places[first].parity != baseline.places[second].parity
            crossed = baseline.log_frequency[first] > baseline.log_frequency[second]
            if (differ or crossed) and readings[second] - readings[first] < CLOSE:
                swaps.append(Swap(int(first), int(second)))
    return tuple(swaps)


def log_evidences(found: Sequence[Hypothesis], baseline: Baseline, residuals: Floats) -> Floats:
    """Logarithm of the evidence of every hypothesis for every data set: (n_hypotheses, n_sets) array.

    Summed over the ways to take peaks for modes, as far as the hypotheses know of any (`with_own_labels`).
    """
    return np.stack([one.terms.log_evidence(one.seen(baseline, residuals)) + one.log_labels for one in found])


def probabilities(found: Sequence[Hypothesis], evidences: Floats) -> Floats:
    """Posterior probabilities, summing to one over the hypotheses: same shape as the evidences."""
    return normalised(_joint(found, evidences))


def odds_against_none(found: Sequence[Hypothesis], evidences: Floats) -> Floats:
    """ln of the odds that something is lacking against that nothing is: one per data set."""
    total = _joint(found, evidences)
    if len(total) == 1:
        return np.full(total.shape[1:], -np.inf)
    return np.asarray(log_sum(total[1:]) - total[0])


def _joint(found: Sequence[Hypothesis], evidences: Floats) -> Floats:
    log_prior = np.log([one.prior for one in found])
    return np.asarray(evidences + log_prior.reshape(-1, *([1] * (evidences.ndim - 1))))
