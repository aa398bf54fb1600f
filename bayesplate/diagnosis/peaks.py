"""Peaks as each hypothesis takes them: the labels that they likely have, and what all other ways to take them add.

A search compares hypotheses by one list of readings, but a label that is not certain need not be the same under all of
them: with another law a peak may be another mode. So each hypothesis has labels of its own. They are found by draws of
its normal terms, first with much noise, under which only what is certain has a label, then with less and less. The
likelihood summed over all assignments of peaks to modes, over that of these labels alone, is averaged over the draws
and joins the evidence, so that nothing hangs on the choice.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.diagnosis.baseline import Baseline, Rows
from bayesplate.diagnosis.draws import TermDraws, draw_hypothesis
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.search import Ground
from bayesplate.estimates.labelling import LIKELY
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.posterior.statistics import resampled

_N_DRAWS, _N_WIDE, _N_BEST = 64, 256, 3
_NOISES = (8.0, 4.0, 2.0, 1.0)
"""Factors of the noise, one per round of labelling."""
_ROUNDS = 3
"""Of labelling anew, from labels that were found before."""
_MOST_WAYS, _WORTH = 6, 5.0
"""Ways to label the readings that are drawn from at most, and by how much of ln evidence the last may be worse."""


def with_own_labels(ground: Ground) -> Ground:
    """The hypotheses about a board, each with the labels that readings likely have if it holds."""
    baseline = ground.baseline
    if not baseline.every.is_open:
        return ground
    alone = [one for one in ground.hypotheses if len(one.members) < 2]
    pool = [baseline.rows, *(rows for one in alone for rows in _annealed(ground, one))]
    found = {one.members: _best(ground, one, pool) for one in alone}
    for one in ground.hypotheses:
        if one.members not in found:
            known = [found[members] for members in ((), *((name,) for name in one.members))]
            found[one.members] = _best(ground, one, [each.own.rows for each in known])
    return replace(ground, hypotheses=tuple(found[one.members] for one in ground.hypotheses))


def log_summed(baseline: Baseline, log_frequency: Floats, noise: Floats) -> Floats:
    """ln of the likelihood of all readings and peaks, summed over the ways to take them for modes: (n_draws,) array.

    From ln f (Hz) of all modes, (n_draws, n_every), and the relative noise, (n_draws, n_setups).
    """
    total = np.zeros(len(log_frequency))
    for i, (setup, every) in enumerate(zip(baseline.board.setups, _by_setup(baseline, log_frequency), strict=True)):
        sure = np.array([reading.is_sure for reading in setup.readings], dtype=bool)
        errors = ReadingErrors.of(setup).at(sure)
        total += errors.log_likelihood(every[:, : sure.size][:, sure], noise[:, i]).sum(axis=1)
        peaks = baseline.every.peaks[i]
        if peaks is not None:
            total += peaks.log_likelihood(every, noise[:, i])
    return total


def log_of_terms(own: Baseline, seen: Floats, drawn: TermDraws) -> Floats:
    """ln of the likelihood of readings (ln f) under the labels of a baseline, by its terms: (n_draws,) array."""
    kept = own.is_mode
    variance = drawn.noise[:, own.setup_index[kept]] ** 2 + own.own_variance[kept]
    squares = (seen[kept] - drawn.predicted[:, own.rows[kept]]) ** 2 / variance + np.log(2.0 * np.pi * variance)
    return np.asarray(-0.5 * squares.sum(axis=1))


def _annealed(ground: Ground, one: Hypothesis) -> Iterator[Rows]:
    """Labels that come out under a hypothesis as the noise goes down, from those of the board on.

    With each noise those that are likely over all draws, and those at the few draws at which the peaks are most likely.
    """
    rows = ground.baseline.rows
    for factor in _NOISES:
        noisy = replace(one, noise=replace(one.noise, sd=factor * one.noise.sd)).labelled(ground.baseline, rows)
        drawn = _drawn(ground, noisy, _N_WIDE)
        every = log_summed(ground.baseline, drawn.predicted, drawn.noise)
        for best in np.argsort(-every)[:_N_BEST]:
            yield _labels_of(ground, drawn.at(best[None]), rows)
        rows = _labels_of(ground, drawn, rows)
        yield rows


def _labels_of(ground: Ground, drawn: TermDraws, otherwise: Rows) -> Rows:
    return likely_labels(ground.baseline, drawn.predicted, drawn.noise, otherwise)


def likely_labels(baseline: Baseline, log_frequency: Floats, noise: Floats, otherwise: Rows) -> Rows:
    """Which mode each reading likely is at some draws: (n_modes,) rows, -1 where none; `otherwise` if too few are."""
    result = baseline.rows.copy()
    every = _by_setup(baseline, log_frequency)
    n_before = 0
    for i, (setup, peaks) in enumerate(zip(baseline.board.setups, baseline.every.peaks, strict=True)):
        if peaks is not None:
            likely = peaks.probabilities(every[i], noise[:, i])
            for at, row in zip(peaks.readings, likely, strict=True):
                if at >= 0:
                    best = int(np.argmax(row))
                    is_likely = row[best] > LIKELY
                    result[n_before + at] = baseline.every.starts[i] + peaks.columns[best] if is_likely else -1
        n_before += len(setup.readings)
    # Without as many readings as constants, and one more to judge by, no round goes on.
    return result if np.sum(result >= 0) > baseline.log_rigidities.size else otherwise


def _best(ground: Ground, one: Hypothesis, begun: Iterable[Rows]) -> Hypothesis:
    """The hypothesis with the labels that its readings likely have, summed over all ways to take them.

    Looked for around labels that were found elsewhere, and those that they lead to under this hypothesis.
    """
    tried = {tuple(rows): rows for rows in begun}
    for rows in list(tried.values()):
        for _ in range(_ROUNDS):
            rows = _labels_of(ground, _drawn(ground, one.labelled(ground.baseline, rows)), rows)
            if tuple(rows) in tried:
                break
            tried[tuple(rows)] = rows
    labelled = [one.labelled(ground.baseline, rows) for rows in tried.values()]
    return _summed(ground, labelled)


def _summed(ground: Ground, labelled: Sequence[Hypothesis]) -> Hypothesis:
    """The hypothesis with its likely labels, knowing what all other ways to label the readings add to its evidence.

    Draws come from each of several ways and are weighted to the likelihood summed over all of them. Every way by itself
    estimates the same sum, so the largest estimate says nothing of the labels: the weighted draws tell them.
    """
    from scipy.special import logsumexp

    evidence = np.array([_log_evidence(ground, one) for one in labelled])
    drawn = [_drawn(ground, one) for one in labelled]
    full = [log_summed(ground.baseline, each.predicted, each.noise) for each in drawn]
    read = ground.baseline.log_readings
    both = zip(full, labelled, drawn, strict=True)
    alone = evidence + [log_mean(sums - log_of_terms(one.own, read, each)) for sums, one, each in both]
    kept = np.argsort(-alone)[:_MOST_WAYS]
    kept = kept[alone[kept] > alone[kept[0]] - _WORTH]
    log_share = alone[kept] - logsumexp(alone[kept])
    log_weights = []
    for share, at in zip(log_share, kept, strict=True):
        densities = [log_of_terms(labelled[other].own, read, drawn[at]) - evidence[other] for other in kept]
        log_weights.append(share + full[at] - logsumexp(np.array(densities) + log_share[:, None], axis=0))
    weights = np.concatenate(log_weights)
    log_sum = float(logsumexp(weights)) - np.log(_N_DRAWS)
    picked = resampled(np.exp(weights - weights.max()), _N_WIDE, np.random.default_rng(0))
    predicted, noise = (
        np.concatenate([getattr(drawn[at], name) for at in kept])[picked] for name in ("predicted", "noise")
    )
    likeliest = labelled[kept[0]]
    rows = likely_labels(ground.baseline, predicted, noise, likeliest.own.rows)
    own = likeliest.labelled(ground.baseline, rows)
    return replace(own, log_labels=log_sum - _log_evidence(ground, own))


def _log_evidence(ground: Ground, one: Hypothesis) -> float:
    """Under its own labels alone, by its normal terms."""
    return float(one.terms.log_evidence(one.seen(ground.baseline, ground.baseline.residual[None, :]))[0])


def log_mean(values: Floats) -> float:
    """ln of the mean of exponentials."""
    from scipy.special import logsumexp

    return float(logsumexp(values) - np.log(len(values)))


def _drawn(ground: Ground, one: Hypothesis, n_draws: int = _N_DRAWS) -> TermDraws:
    return draw_hypothesis(ground.baseline, one, ground.baseline.residual, np.random.default_rng(0), n_draws)


def _by_setup(baseline: Baseline, log_frequency: Floats) -> list[Floats]:
    return np.split(log_frequency, baseline.every.starts[1:], axis=1)
