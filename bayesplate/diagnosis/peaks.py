"""The labels of the peaks under each hypothesis: the likely ones, and the evidence of all other assignments.

A search compares hypotheses by one list of readings, but an uncertain label need not be the same under all of them:
with another law a peak may be another mode. So each hypothesis has labels of its own. They are found from draws of its
normal terms, first with a large noise, under which only certain peaks have a label, then with less and less. The
likelihood summed over all assignments of peaks to modes, over that of these labels alone, is averaged over the draws
and added to the evidence, so that the result does not depend on the choice of labels.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.draws import TermDraws, draw_hypothesis
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.search import SearchGround
from bayesplate.estimates.labelling import LIKELY_LABEL
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.posterior.statistics import resample

_N_DRAWS, _N_WIDE, _N_BEST = 64, 256, 3
_NOISES = (8.0, 4.0, 2.0, 1.0)
"""Factors of the noise, one per round of labelling."""
_ROUNDS = 3
"""Rounds of labelling from each first labelling."""
_MOST_LABELLINGS, _LARGEST_DROP = 6, 5.0
"""Largest number of labellings to draw from, and drop of ln evidence from the best to the last of them."""


def with_own_labels(ground: SearchGround) -> SearchGround:
    """The ground with each hypothesis under the labels that the readings likely have if it holds."""
    baseline = ground.baseline
    if not baseline.possible_modes.is_open:
        return ground
    single_hypotheses = [hypothesis for hypothesis in ground.hypotheses if len(hypothesis.members) < 2]
    labellings = [
        baseline.rows,
        *(rows for hypothesis in single_hypotheses for rows in _annealed_labels(ground, hypothesis)),
    ]
    labelled_hypotheses = {
        hypothesis.members: _label_hypothesis(ground, hypothesis, labellings) for hypothesis in single_hypotheses
    }
    for hypothesis in ground.hypotheses:
        if hypothesis.members not in labelled_hypotheses:
            member_hypotheses = [
                labelled_hypotheses[members] for members in ((), *((name,) for name in hypothesis.members))
            ]
            labelled_hypotheses[hypothesis.members] = _label_hypothesis(
                ground, hypothesis, [member.baseline.rows for member in member_hypotheses]
            )
    return replace(
        ground, hypotheses=tuple(labelled_hypotheses[hypothesis.members] for hypothesis in ground.hypotheses)
    )


def log_likelihood_summed(baseline: Baseline, log_frequency: Floats, noise: Floats) -> Floats:
    """ln of the likelihood of all readings and peaks, summed over their assignments to modes: (n_draws,) array.

    From ln f (Hz) of all modes, (n_draws, n_modes), and the relative noise, (n_draws, n_setups).
    """
    total = np.zeros(len(log_frequency))
    for i, (setup, setup_log_frequency) in enumerate(
        zip(baseline.board.setups, _split_by_setup(baseline, log_frequency), strict=True)
    ):
        is_sure = np.array([reading.is_sure for reading in setup.readings], dtype=bool)
        errors = ReadingErrors.of(setup).select(is_sure)
        total += errors.log_likelihood(setup_log_frequency[:, : is_sure.size][:, is_sure], noise[:, i]).sum(axis=1)
        peaks = baseline.possible_modes.peaks[i]
        if peaks is not None:
            total += peaks.log_likelihood(setup_log_frequency, noise[:, i])
    return total


def log_likelihood_of_labels(baseline: Baseline, log_readings: Floats, draws: TermDraws) -> Floats:
    """ln of the likelihood of readings (ln f) under the labels of a baseline, at draws of its terms: (n_draws,)
    array."""
    is_mode = baseline.is_mode
    variance = draws.noise[:, baseline.setup_index[is_mode]] ** 2 + baseline.own_variance[is_mode]
    squares = (log_readings[is_mode] - draws.predicted[:, baseline.rows[is_mode]]) ** 2 / variance + np.log(
        2.0 * np.pi * variance
    )
    return np.asarray(-0.5 * squares.sum(axis=1))


def _annealed_labels(ground: SearchGround, hypothesis: Hypothesis) -> Iterator[Indices]:
    """Labellings under a hypothesis while the noise is reduced, starting from the labels of the board.

    At each noise the labels that are likely over all draws, and those at the few draws with the highest likelihood of
    the peaks.
    """
    rows = ground.baseline.rows
    for factor in _NOISES:
        noisy_hypothesis = replace(
            hypothesis, noise=replace(hypothesis.noise, sd=factor * hypothesis.noise.sd)
        ).labelled(ground.baseline, rows)
        draws = _draw(ground, noisy_hypothesis, _N_WIDE)
        log_likelihoods = log_likelihood_summed(ground.baseline, draws.predicted, draws.noise)
        for best in np.argsort(-log_likelihoods)[:_N_BEST]:
            yield _labels_at_draws(ground, draws.select(best[None]), rows)
        rows = _labels_at_draws(ground, draws, rows)
        yield rows


def _labels_at_draws(ground: SearchGround, draws: TermDraws, fallback: Indices) -> Indices:
    return likely_labels(ground.baseline, draws.predicted, draws.noise, fallback)


def likely_labels(baseline: Baseline, log_frequency: Floats, noise: Floats, default: Indices) -> Indices:
    """Index of the likely mode of each reading at some draws: (n_modes,) array, -1 where there is none.

    `default` where too few readings have a likely mode.
    """
    rows = baseline.rows.copy()
    by_setup = _split_by_setup(baseline, log_frequency)
    n_before = 0
    for i, (setup, peaks) in enumerate(zip(baseline.board.setups, baseline.possible_modes.peaks, strict=True)):
        if peaks is not None:
            likely = peaks.probabilities(by_setup[i], noise[:, i])
            for position, mode_probabilities in zip(peaks.readings, likely, strict=True):
                if position >= 0:
                    best = int(np.argmax(mode_probabilities))
                    is_likely = mode_probabilities[best] > LIKELY_LABEL
                    rows[n_before + position] = (
                        baseline.possible_modes.starts[i] + peaks.columns[best] if is_likely else -1
                    )
        n_before += len(setup.readings)
    # A labelling needs one more reading than there are constants.
    return rows if np.sum(rows >= 0) > baseline.log_rigidities.size else default


def _label_hypothesis(ground: SearchGround, hypothesis: Hypothesis, first_labellings: Iterable[Indices]) -> Hypothesis:
    """The hypothesis with its likely labels, its evidence summed over all assignments of peaks to modes.

    Starts from the first labellings, and those to which they lead under this hypothesis.
    """
    labellings = {tuple(rows): rows for rows in first_labellings}
    for rows in list(labellings.values()):
        for _ in range(_ROUNDS):
            rows = _labels_at_draws(ground, _draw(ground, hypothesis.labelled(ground.baseline, rows)), rows)
            if tuple(rows) in labellings:
                break
            labellings[tuple(rows)] = rows
    labelled_hypotheses = [hypothesis.labelled(ground.baseline, rows) for rows in labellings.values()]
    return _sum_labellings(ground, labelled_hypotheses)


def _sum_labellings(ground: SearchGround, hypotheses: Sequence[Hypothesis]) -> Hypothesis:
    """The hypothesis with its likely labels, and in `log_labels` the share of all other labellings in its evidence.

    Draws come from several labellings and are weighted to the likelihood summed over all of them. Each labelling by
    itself estimates the same sum, so that the largest estimate does not tell the labels: the weighted draws do.
    """
    from scipy.special import logsumexp

    evidence = np.array([_log_evidence(ground, hypothesis) for hypothesis in hypotheses])
    draws_by_labels = [_draw(ground, hypothesis) for hypothesis in hypotheses]
    log_likelihoods = [
        log_likelihood_summed(ground.baseline, draws.predicted, draws.noise) for draws in draws_by_labels
    ]
    log_readings = ground.baseline.log_readings
    labellings = zip(log_likelihoods, hypotheses, draws_by_labels, strict=True)
    estimates = evidence + [
        log_mean(log_likelihood - log_likelihood_of_labels(hypothesis.baseline, log_readings, draws))
        for log_likelihood, hypothesis, draws in labellings
    ]
    kept_indices = np.argsort(-estimates)[:_MOST_LABELLINGS]
    kept_indices = kept_indices[estimates[kept_indices] > estimates[kept_indices[0]] - _LARGEST_DROP]
    log_share = estimates[kept_indices] - logsumexp(estimates[kept_indices])
    log_weights = []
    for share, i in zip(log_share, kept_indices, strict=True):
        densities = [
            log_likelihood_of_labels(hypotheses[j].baseline, log_readings, draws_by_labels[i]) - evidence[j]
            for j in kept_indices
        ]
        log_weights.append(share + log_likelihoods[i] - logsumexp(np.array(densities) + log_share[:, None], axis=0))
    weights = np.concatenate(log_weights)
    log_sum = float(logsumexp(weights)) - np.log(_N_DRAWS)
    picked = resample(np.exp(weights - weights.max()), _N_WIDE, np.random.default_rng(0))
    predicted, noise = (
        np.concatenate([getattr(draws_by_labels[i], name) for i in kept_indices])[picked]
        for name in ("predicted", "noise")
    )
    likeliest = hypotheses[kept_indices[0]]
    rows = likely_labels(ground.baseline, predicted, noise, likeliest.baseline.rows)
    labelled_hypothesis = likeliest.labelled(ground.baseline, rows)
    return replace(labelled_hypothesis, log_labels=log_sum - _log_evidence(ground, labelled_hypothesis))


def _log_evidence(ground: SearchGround, hypothesis: Hypothesis) -> float:
    """ln of the evidence of a hypothesis under its own labels alone, by its normal terms."""
    return float(
        hypothesis.terms.log_evidence(
            hypothesis.residual_under_labels(ground.baseline, ground.baseline.residual[None, :])
        )[0]
    )


def log_mean(values: Floats) -> float:
    """ln of the mean of exponentials."""
    from scipy.special import logsumexp

    return float(logsumexp(values) - np.log(len(values)))


def _draw(ground: SearchGround, hypothesis: Hypothesis, n_draws: int = _N_DRAWS) -> TermDraws:
    return draw_hypothesis(ground.baseline, hypothesis, ground.baseline.residual, np.random.default_rng(0), n_draws)


def _split_by_setup(baseline: Baseline, log_frequency: Floats) -> list[Floats]:
    return np.split(log_frequency, baseline.possible_modes.starts[1:], axis=1)
