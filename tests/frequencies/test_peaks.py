"""The likelihood of peaks against enumeration of all that they may be: labels, signs, doubts, the cut."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.stats import norm

from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak, Reading
from bayesplate.board.setup import Setup
from bayesplate.frequencies.model import OtherMode, SetupModel
from bayesplate.frequencies.peaks import PeakLikelihood, needs_assignment
from bayesplate.frequencies.residues import NODAL_LINE, detection_share, sign_probabilities
from bayesplate.frequencies.system import System
from bayesplate.plate.naming import ModePlace
from bayesplate.plate.terms import Parity

NOISE = np.array([0.01, 0.03, 0.002])
PLACE = ModePlace(Parity(0, 0), 0, 1.0)
MODES = np.log(
    [[100.0, 130.0, 131.0, 180.0, 240.0], [99.0, 131.0, 129.0, 182.0, 235.0], [101.0, 130.5, 132.0, 178.0, 239.0]]
)
"""ln f of five modes at three draws; the first two are labelled where a setup has readings, and two of them cross."""
BEAMS = ((1, 1), (2, 0), (0, 2), (2, 1), (1, 2))
MISSED, SPURIOUS = 0.25, 0.05


def exact(hertz: float) -> Quantity:
    return Quantity.exact(hertz)


def setup_of(readings=(), peaks=(), resolution=0.0) -> Setup:
    made = Setup.from_frequencies({(1, 1): 100.0}, edges="free", resolution=resolution)
    return replace(made, readings=tuple(readings), peaks=tuple(peaks), missed=MISSED, spurious=SPURIOUS)


def reading(beams, hertz, sign="", confidence=1.0) -> Reading:
    return replace(Reading.of(beams, exact(hertz), sign), confidence=confidence)


def model_of(setup: Setup, residues=None, beams=BEAMS) -> SetupModel:
    """A model without a plate: of its modes the likelihood asks for the labels alone."""
    labelled = [one.beams for one in setup.readings]
    others = tuple(OtherMode(PLACE, one) for one in beams if one not in labelled)
    places = (PLACE,) * len(setup.readings)
    return SetupModel(System(setup), None, places, None, other_modes=others, residues=residues)


def every_of(setup: Setup, modes=MODES):
    """Columns in the order of a model: labelled first."""
    labelled = [BEAMS.index(one.beams) for one in setup.readings]
    return modes[:, [*labelled, *(i for i in range(len(BEAMS)) if i not in labelled)]]


def enumerated(peaks, modes, seen, noise, cut, alone=SPURIOUS, pair=lambda i, j: 1.0, n_peaks=None):
    """The sum over sets of pairs that rise, from peaks (Hz) and modes (ln f) in any order, and each pair's share."""
    order, n_peaks = np.argsort(modes), len(peaks) if n_peaks is None else n_peaks
    peaks, total, pairs = sorted(peaks), 0.0, np.zeros((len(peaks), len(modes)))
    gone = [1.0 - seen[j] * norm.cdf((np.log(cut) - modes[j]) / noise) for j in range(len(modes))]
    for size in range(min(len(peaks), len(modes)) + 1):
        for rows in combinations(range(len(peaks)), size):
            for columns in combinations(order, size):
                weight = np.prod([gone[j] for j in order if j not in columns])
                weight *= np.prod([n_peaks * alone * peaks[i] / cut for i in range(len(peaks)) if i not in rows])
                for i, j in zip(rows, columns, strict=True):
                    weight *= (1.0 - SPURIOUS) * seen[j] * norm.pdf(np.log(peaks[i]), modes[j], noise) * pair(i, j)
                total += weight
                pairs[list(rows), list(columns)] += weight
    return total, pairs / total


def test_bare_peaks_are_summed_over_all_modes() -> None:
    hertz = [99.5, 130.2, 150.0, 181.0]
    setup = setup_of(peaks=[Peak(exact(one)) for one in hertz])
    likelihood = PeakLikelihood.of(model_of(setup))
    found = likelihood.log_likelihood(MODES, NOISE)
    shares = [likelihood.probabilities(MODES[[i]], NOISE[[i]]) for i in range(3)]
    for draw in range(3):
        total, pairs = enumerated(hertz, MODES[draw], [1.0 - MISSED] * 5, NOISE[draw], 181.0)
        assert found[draw] == pytest.approx(np.log(total), abs=1e-9)
        assert shares[draw] == pytest.approx(pairs, abs=1e-9)
    assert likelihood.probabilities(MODES, NOISE) == pytest.approx(np.mean(shares, axis=0), abs=1e-12)


def test_sure_labels_take_their_mode_away() -> None:
    setup = setup_of([reading((1, 1), 100.0), reading((2, 0), 130.0)], [Peak(exact(131.0)), Peak(exact(178.0))])
    likelihood = PeakLikelihood.of(model_of(setup))
    found = likelihood.log_likelihood(every_of(setup), NOISE)
    for draw in range(3):
        total, _ = enumerated([131.0, 178.0], MODES[draw, 2:], [1.0 - MISSED] * 3, NOISE[draw], 178.0)
        assert found[draw] == pytest.approx(np.log(total), abs=1e-9)
    assert [str(label) for label in likelihood.labels] == ["(0,2)", "(2,1)", "(1,2)"]


def test_a_doubtful_label_counts_by_its_confidence() -> None:
    setup = setup_of([reading((2, 0), 130.0, confidence=0.9)], [Peak(exact(180.0))])
    likelihood = PeakLikelihood.of(model_of(setup))
    found = likelihood.log_likelihood(every_of(setup), NOISE)
    by_label = np.full((2, 5), 1.0)
    by_label[0] = 0.1 / 5
    by_label[0, BEAMS.index((2, 0))] = 0.9
    for draw in range(3):

        def pair(i, j):
            return by_label[i, j] / (by_label[0, 0] if i == 0 else 1.0)

        # As no mode the peak has the chance of any other label too, which is taken out of the sum as a factor.
        total, pairs = enumerated([130.0, 180.0], MODES[draw], [0.75] * 5, NOISE[draw], 180.0, pair=pair)
        assert found[draw] == pytest.approx(np.log(total * 0.1 / 5), abs=1e-9)
        mine = likelihood.probabilities(every_of(setup)[[draw]], NOISE[[draw]])
        in_order = [BEAMS.index((label.m, label.n)) for label in likelihood.labels]
        assert mine == pytest.approx(pairs[:, in_order], abs=1e-9)


def test_a_proposed_label_says_nothing() -> None:
    bare = setup_of(peaks=[Peak(exact(130.0)), Peak(exact(180.0))])
    proposed = setup_of([reading((2, 0), 130.0, confidence=0.0), reading((2, 1), 180.0, confidence=0.0)])
    one, other = (PeakLikelihood.of(model_of(setup)) for setup in (bare, proposed))
    expected = one.log_likelihood(MODES, NOISE)
    assert other.log_likelihood(every_of(proposed), NOISE) == pytest.approx(expected, abs=1e-12)


def test_as_many_peaks_are_none_as_stated():
    """Spectra drawn as the likelihood says: a fifth of the peaks, on average, is no mode, and is found to be none."""
    rng = np.random.default_rng(4)
    spurious, missed, noise, n_sets = 0.2, 0.3, 0.02, 300
    modes = np.log(60.0) + 0.1 * np.arange(12)
    names = [(i + 2, 0) for i in range(modes.size)]
    told, true = [], []
    for _ in range(n_sets):
        seen = modes[rng.random(modes.size) > missed]
        read = np.exp(seen + noise * rng.standard_normal(seen.size))
        n_none = rng.poisson(spurious / (1.0 - spurious) * (1.0 - missed) * modes.size)
        hertz = np.sort(np.concatenate([read, rng.uniform(0.0, np.exp(modes[-1]), n_none)]))
        setup = replace(setup_of(peaks=[Peak(exact(float(one))) for one in hertz]), missed=missed, spurious=spurious)
        likelihood = PeakLikelihood.of(model_of(setup, beams=names))
        shares = 1.0 - likelihood.probabilities(modes[None], np.array([noise])).sum(axis=1)
        told.append(shares.sum())
        true.append(n_none)
    error = 4.0 * np.sqrt(np.var(np.subtract(told, true)) * n_sets)
    assert abs(np.sum(told) - np.sum(true)) < error + 0.05 * np.sum(true)  # the highest peak ends the range
    assert error < 0.15 * np.sum(true)


RESIDUES = np.array([0.6, -0.4, 0.5, -0.02, 0.3])


@pytest.mark.parametrize(
    "signed", [{99.5: "+", 130.2: "-", 131.5: "+", 181.0: "-"}, {99.5: "+", 130.2: "-", 179.5: "+", 180.5: "-"}]
)
def test_signs_keep_peaks_and_modes_apart(signed) -> None:
    """The fourth mode may have either sign: the sum over both, each with its probability; it is never two peaks."""
    setup = setup_of(peaks=[Peak(exact(hertz), sign) for hertz, sign in signed.items()])
    likelihood = PeakLikelihood.of(model_of(setup, RESIDUES))
    found = likelihood.log_likelihood(MODES, NOISE)
    assert (likelihood.probabilities(MODES, NOISE).sum(axis=0) <= 1.0 + 1e-12).all()
    seen = (1.0 - MISSED) * detection_share(RESIDUES)
    positive = norm.cdf(RESIDUES[3] / NODAL_LINE)
    for draw in range(3):
        expected = 0.0
        for is_positive, weight in ((True, positive), (False, 1.0 - positive)):
            has_plus = np.array([True, False, True, is_positive, True])
            for sign, wanted in (("+", has_plus), ("-", ~has_plus)):
                hertz = [one for one, own in signed.items() if own == sign]
                weight *= enumerated(
                    hertz, MODES[draw, wanted], seen[wanted], NOISE[draw], max(signed), 0.5 * SPURIOUS, n_peaks=4
                )[0]
            expected += weight
        assert found[draw] == pytest.approx(np.log(expected), abs=1e-9)


def test_nodal_lines_hide_modes() -> None:
    """By the mean over residues that scatter about the computed one; where it is large, nearly all is seen."""
    rng = np.random.default_rng(1)
    drawn = RESIDUES + NODAL_LINE * rng.standard_normal((200_000, RESIDUES.size))
    shares = drawn**2 / (drawn**2 + NODAL_LINE**2)
    error = 4.0 * shares.std(axis=0) / np.sqrt(len(drawn))
    assert (np.abs(detection_share(RESIDUES) - shares.mean(axis=0)) < error).all()
    assert detection_share(np.zeros(1))[0] == pytest.approx(0.344, abs=5e-4)
    assert (np.abs(RESIDUES**2 / (RESIDUES**2 + NODAL_LINE**2) - shares.mean(axis=0)) > error).all()  # control


def test_a_sign_is_certain_away_from_nodal_lines_only() -> None:
    positive, negative = sign_probabilities(np.array([0.6, -0.4, 0.0, 0.05, np.nan]))
    assert positive == pytest.approx([1.0, 0.0, 0.5, norm.cdf(1.0), 0.5])
    assert positive[:2].tolist() == [1.0, 0.0]
    assert positive + negative == pytest.approx(1.0)


def test_a_peak_of_unknown_sign_is_tried_with_both() -> None:
    known = [Peak(exact(99.5), "+"), Peak(exact(181.0), "-")]
    unknown = setup_of(peaks=[*known, Peak(exact(130.2))])
    tried = [setup_of(peaks=[*known, Peak(exact(130.2), sign)]) for sign in "+-"]
    found, *parts = (
        PeakLikelihood.of(model_of(setup, RESIDUES)).log_likelihood(MODES, NOISE) for setup in (unknown, *tried)
    )
    assert found == pytest.approx(np.logaddexp(*parts), abs=1e-12)


def test_a_wrong_sign_is_never_that_mode() -> None:
    residues = np.array([0.6, -0.4, 0.5, -0.3, 0.3])
    setup = setup_of(peaks=[Peak(exact(100.0), "-"), Peak(exact(180.0), "-")])
    shares = PeakLikelihood.of(model_of(setup, residues)).probabilities(MODES[:1], NOISE[:1])
    assert (shares[:, residues > 0] == 0).all()
    assert shares[1, 3] > 0.9


def test_a_rounded_peak_has_the_probability_of_its_interval() -> None:
    setup = setup_of(peaks=[Peak(exact(130.0))], resolution=2.0)
    mode, noise = MODES[0, 0], NOISE[0]
    inside = norm.cdf(np.log(131.0), mode, noise) - norm.cdf(np.log(129.0), mode, noise)
    gone = 1.0 - 0.75 * norm.cdf((np.log(130.0) - mode) / np.hypot(noise, 2.0 / 130.0 / np.sqrt(12.0)))
    expected = (1.0 - SPURIOUS) * 0.75 * inside + SPURIOUS * 2.0 / 130.0 * gone
    found = PeakLikelihood.of(model_of(setup, beams=[(1, 1)])).log_likelihood(MODES[:1, :1], NOISE[:1])
    assert found == pytest.approx(np.log(expected), abs=1e-9)


def test_sure_readings_alone_take_no_part() -> None:
    sure = setup_of([reading((1, 1), 100.0)])
    assert not needs_assignment(sure)
    assert PeakLikelihood.of(model_of(sure)) is None
    assert needs_assignment(setup_of([reading((1, 1), 100.0, confidence=0.99)]))
    assert needs_assignment(replace(sure, peaks=(Peak(exact(130.0)),)))


def test_draws_are_judged_a_few_at_a_time_and_say_the_same(monkeypatch):
    """To the last bit, a draw without a frequency among them."""
    setup = setup_of([reading((1, 1), 100.0)], [Peak(exact(130.0)), Peak(exact(181.0))])
    likelihood = PeakLikelihood.of(model_of(setup))
    rng = np.random.default_rng(3)
    every = every_of(setup, MODES[rng.integers(0, 3, 50)] + 0.01 * rng.standard_normal((50, 5)))
    every[7, 3] = np.nan
    noise = np.exp(0.3 * rng.standard_normal(50)) * 0.01
    together = likelihood.log_likelihood(every, noise)
    monkeypatch.setattr("bayesplate.frequencies.peaks._DRAWS_AT_ONCE", 4)

    np.testing.assert_array_equal(likelihood.log_likelihood(every, noise), together)
    assert together[7] == -np.inf
    assert np.isfinite(np.delete(together, 7)).all()


def test_a_peak_may_be_none_with_a_probability_of_its_own():
    """The odds that a single peak is a mode go with (1 - s) / s; without its own it has that of its setup."""

    def odds(spurious):
        setup = setup_of(peaks=[Peak(exact(131.0), spurious=spurious)])
        share = PeakLikelihood.of(model_of(setup)).probabilities(every_of(setup)[:1], NOISE[:1]).sum()
        return share / (1.0 - share)

    assert odds(SPURIOUS) == pytest.approx(odds(None), rel=1e-12)
    assert odds(None) / odds(0.4) == pytest.approx((1.0 - SPURIOUS) / SPURIOUS / (0.6 / 0.4), rel=1e-9)
