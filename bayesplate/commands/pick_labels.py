"""Labels of picked peaks: the assignment likelihood of the spectrum, residues between known places, and sand.

Labellings of the lower peaks come from `bayesplate.posterior.first_labels`; at the constants of each, all peaks are
assigned to modes by the likelihood that the fit uses, with the evidence of residues and sand for each pair added.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import log
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak
from bayesplate.commands.assigned import PeakAssignment
from bayesplate.commands.fragment import spurious_share
from bayesplate.errors import NotIdentifiableError
from bayesplate.posterior.first_labels import FEWEST_PEAKS, probable_labellings
from bayesplate.recordings.patterns import residue_evidence, sign_odds
from bayesplate.recordings.sand import sand_evidence, straighten_picture

if TYPE_CHECKING:
    from bayesplate.board.board import Board
    from bayesplate.board.prior import PriorCard
    from bayesplate.recordings.contract import PickedRow
    from bayesplate.recordings.picking import PickedModes


MOST_PROPOSING = 12
"""Lowest peaks whose labels are proposed: higher ones lie where a thin plate is less and less like a real one."""
_LEAST_SHARE, _MOST_LABELLINGS = 0.01, 3
_POLARITY_LOG_ODDS = log(20.0)
_STATED_PROBABILITY, _CERTAIN_PROBABILITY = 0.5, 0.99
"""Probability from which on a label is stated: where sand and residues speak for it too, and where they do not."""
_GRID = np.linspace(0.0, 1.0, 61)
_CLEAR_PROBABILITY, _CLEAR_LOG_ODDS = 0.9, log(20.0)
"""Probability of a mode by the frequencies, and ln of the odds by the sand, from which on the two are compared."""
_NEAR_DISTANCE = 0.15
"""Relative distance within which sand and residues choose among the modes."""
_PICTURE_DISTANCE = 0.03
"""Relative distance up to which a picture of sand belongs to a peak."""
_OBLONG_PRODUCT = 0.01
"""Product of the logarithms of two aspect ratios from which on it matters that one is oblong the other way."""
_CONTRADICTION_GAIN = -12.0
"""ln of how much likelier all peaks are with their residues than without, below which the places must be wrong: more
than one peak contradicts every way to label them."""
_WRONG_PLACES_DOUBT = (
    "the residues are those of no modes between these places, and say nothing of the labels: are hammer and sensor "
    "where the files say, in mm from the corner of x0 and y0, and in the order of the files?"
)
_MOST_COMPLEX = 45.0
"""Degrees by which a residue may be complex whose sign tells the polarity."""


@dataclass(frozen=True, eq=False)
class Labels:
    """Labels of the likely peaks."""

    probabilities: tuple[dict[str, float], ...]  # of each likely peak: its labels, the most probable first
    by_evidence: tuple[dict[str, float], ...]  # from sand and residues alone; empty where neither tells anything
    flips: bool | None  # whether force and response have opposite polarity; None if that does not show
    doubts: tuple[str, ...] = ()  # places or pictures that contradict the frequencies

    def label_to_state(self, peak: int) -> tuple[str, float] | None:
        """The label that a card may state, and the confidence in it; None where it is left to the fit.

        The fit does not use sand and residues: where they agree with the label, theirs is the confidence. It uses the
        frequencies, which would count twice, unless the label is beyond doubt: then the fit can begin with it.
        """
        name, share = next(iter(self.probabilities[peak].items()), ("", 0.0))
        evidence_label, evidence_share = next(iter(self.by_evidence[peak].items()), ("", 0.0))
        if share < _STATED_PROBABILITY or not name.startswith("("):
            return None
        if name == evidence_label and evidence_share >= _STATED_PROBABILITY:
            return name, evidence_share
        return (name, share) if share >= _CERTAIN_PROBABILITY else None


def label_peaks(
    board: Board, prior: PriorCard, picked: PickedModes, flips: bool | None, pictures: Mapping[int, Sequence[Floats]]
) -> Labels:
    """Labels of the likely peaks, from a board with one setup of which sizes and edges are known.

    `pictures` are straightened ones of sand, by number of the peak. Raises NotIdentifiableError for too few peaks.
    """
    likely = picked.likely
    if len(likely) < FEWEST_PEAKS:
        raise NotIdentifiableError(f"{FEWEST_PEAKS} peaks or more are needed to tell modes by their frequencies")
    labellings = probable_labellings(_bare_board(board, likely[:MOST_PROPOSING]), prior)
    labellings = [(labelling, share) for labelling, share in labellings if share > _LEAST_SHARE][:_MOST_LABELLINGS]
    if not labellings:
        raise NotIdentifiableError("no plate of these sizes and edges has such peaks")
    assignments = [PeakAssignment.of(labelling, _bare_board(board, likely)) for labelling, _ in labellings]
    shares = np.array([share for _, share in labellings])
    doubts = []
    if max(assignment.gain(_residue_matrix(assignment, picked)) for assignment in assignments) < _CONTRADICTION_GAIN:
        doubts.append(_WRONG_PLACES_DOUBT)
        picked = replace(
            picked, spectra=replace(picked.spectra, place_pairs=((None, None),) * len(picked.spectra.place_pairs))
        )
    if flips is None:
        flips = _find_polarity(assignments, shares, picked)
    if flips is not None:
        signs = [picked.sign(answer, flips) for answer in picked.likely_mobilities]
        assignments = [assignment.with_peaks(_bare_board(board, likely, signs)) for assignment in assignments]
    doubts += _picture_doubts(assignments[int(np.argmax(shares))], likely, pictures)
    evidence = [_combined_evidence(assignment, picked, pictures) for assignment in assignments]
    weights = np.log(shares) + [
        assignment.gain(pair_evidence) for assignment, pair_evidence in zip(assignments, evidence, strict=True)
    ]
    shares = np.exp(weights - weights.max())
    shares /= shares.sum()
    weighted = [*zip(assignments, evidence, shares, strict=True)]
    by_all = _sum_by_label(
        [
            (assignment.names, share * assignment.probabilities(pair_evidence))
            for assignment, pair_evidence, share in weighted
        ]
    )
    by_evidence = _sum_by_label(
        [
            (assignment.names, share * _evidence_probabilities(pair_evidence, assignment, likely))
            for assignment, pair_evidence, share in weighted
        ]
    )
    return Labels(by_all, by_evidence, flips, tuple(doubts))


def _bare_board(board: Board, peaks: Sequence[PickedRow], signs: Sequence[str] | None = None) -> Board:
    """The board with unlabelled peaks as its only readings."""
    (setup,) = board.setups
    signed_peaks = zip(peaks, signs or [""] * len(peaks), strict=True)
    bare_peaks = tuple(
        Peak(Quantity.from_mean(peak.hz, peak.sd_hz), sign, spurious=spurious_share([peak]))
        for peak, sign in signed_peaks
    )
    return replace(board, setups=(replace(setup, readings=(), peaks=bare_peaks),))


def _sum_by_label(named_probabilities: Sequence[tuple[Sequence[str], Floats]]) -> tuple[dict[str, float], ...]:
    """Probabilities of each peak by the names of the modes, summed over the labellings, the largest first."""
    totals: list[dict[str, float]] = [{} for _ in named_probabilities[0][1]]
    for names, probabilities in named_probabilities:
        for total, row in zip(totals, probabilities.tolist(), strict=True):
            for name, probability in zip(names, row, strict=True):
                if probability > 0.0:
                    total[name] = total.get(name, 0.0) + probability
    return tuple(dict(sorted(total.items(), key=lambda item: -item[1])) for total in totals)


def _residues(assignment: PeakAssignment, picked: PickedModes) -> Floats | None:
    """Residues of the modes between the places, 1/kg: (n_modes, n_places) array.

    None where a place is not known, or the force: then each place has a gain and a sign of its own.
    """
    if picked.spectra.force is None:
        return None
    columns = [
        assignment.deflections(hammer) * assignment.deflections(sensor)
        for hammer, sensor in picked.spectra.place_pairs
        if hammer is not None and sensor is not None
    ]
    return np.stack(columns, axis=1) if len(columns) == len(picked.spectra.place_pairs) else None


def _residue_evidence(assignment: PeakAssignment, picked: PickedModes, residues: Floats) -> tuple[Floats, float]:
    """Evidence of the residues for each pair of a likely peak and a mode, and for the polarity."""
    answers = picked.likely_mobilities
    measured, sd = (
        np.array([np.real(answer.mobility) for answer in answers]),
        np.array([answer.sd for answer in answers]),
    )
    return residue_evidence(measured, sd, residues, assignment.largest, assignment.probabilities(None))


def _residue_matrix(assignment: PeakAssignment, picked: PickedModes) -> Floats:
    """ln evidence of the residues for each pair of a likely peak and a mode: (n_likely, n_modes) array."""
    residues = _residues(assignment, picked)
    if residues is None:
        return np.zeros((len(picked.likely), len(assignment.names)))
    return _residue_evidence(assignment, picked, residues)[0]


def _find_polarity(assignments: Sequence[PeakAssignment], shares: Floats, picked: PickedModes) -> bool | None:
    """Whether force and response have opposite polarity, where the signs leave no doubt."""
    odds = 0.0
    for assignment, share in zip(assignments, shares / shares.sum(), strict=True):
        if (residues := _residues(assignment, picked)) is None:
            return None
        if residues.shape[1] == 1:
            answers = picked.likely_mobilities
            signs = [
                np.sign(answer.mobility[0].real) if answer.complexity < _MOST_COMPLEX else 0.0 for answer in answers
            ]
            odds += share * sign_odds(
                np.array(signs), residues[:, 0], assignment.largest, assignment.probabilities(None)
            )
        else:
            odds += share * _residue_evidence(assignment, picked, residues)[1]
    return None if abs(odds) < _POLARITY_LOG_ODDS else bool(odds < 0.0)


def _combined_evidence(
    assignment: PeakAssignment, picked: PickedModes, pictures: Mapping[int, Sequence[Floats]]
) -> Floats:
    """ln evidence of residues and sand for each pair of a likely peak and a mode: (n_likely, n_modes) array."""
    evidence = _residue_matrix(assignment, picked)
    for peak, peak_pictures in pictures.items():
        for picture in peak_pictures:
            evidence[peak] += sand_evidence(picture, assignment.shapes(_GRID))
    return evidence


def _picture_doubts(
    assignment: PeakAssignment, likely: Sequence[PickedRow], pictures: Mapping[int, Sequence[Floats]]
) -> Iterator[str]:
    """A question on each picture that shows another mode than the frequencies give its peak."""
    probabilities = assignment.probabilities(None)
    for peak, peak_pictures in pictures.items():
        expected_mode = int(np.argmax(probabilities[peak]))
        for picture in peak_pictures if probabilities[peak, expected_mode] > _CLEAR_PROBABILITY else ():
            evidence = sand_evidence(picture, assignment.shapes(_GRID))
            shown_mode = int(np.argmax(evidence))
            if evidence[shown_mode] - evidence[expected_mode] > _CLEAR_LOG_ODDS:
                yield (
                    f"the sand at {likely[peak].hz:.4g} Hz shows {assignment.names[shown_mode]}, and its frequency is "
                    f"that of {assignment.names[expected_mode]}: is it the picture of this peak, x from left to right?"
                )


def _evidence_probabilities(evidence: Floats, assignment: PeakAssignment, likely: Sequence[PickedRow]) -> Floats:
    """Probabilities by sand and residues alone, among the modes near each peak."""
    is_near = np.abs(np.log(assignment.hertz / np.array([[peak.hz] for peak in likely]))) < _NEAR_DISTANCE
    has_evidence = np.abs(evidence).max(axis=1, keepdims=True) > 0.0
    weights = np.where(is_near & has_evidence, np.exp(evidence), 0.0)
    return np.asarray(weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-300))


def assign_pictures(
    board: Board, likely: Sequence[PickedRow], pictures: Mapping[float, Floats]
) -> tuple[dict[int, list[Floats]], list[str]]:
    """Straightened pictures by the number of the likely peak nearest to them; and why others were left out."""
    from bayesplate.board.board import vibrating_lengths

    (setup,) = board.setups
    x, y = (1e3 * float(side) for side in vibrating_lengths(board.nominal(), setup))
    shape = "higher than wide" if x > y else "wider than high"
    pictures_by_peak: dict[int, list[Floats]] = {}
    remarks = []
    for hertz, picture in pictures.items():
        distances = [abs(peak.hz / hertz - 1.0) for peak in likely]
        if log(picture.shape[1] / picture.shape[0]) * log(x / y) < -_OBLONG_PRODUCT:
            remarks.append(
                f"the sand at {hertz:g} Hz left out: the picture is {shape}, the board {x:.0f} mm along x and "
                f"{y:.0f} mm along y where it vibrates; turn it, x from left to right"
            )
        elif min(distances, default=1.0) > _PICTURE_DISTANCE:
            remarks.append(f"no peak within {100.0 * _PICTURE_DISTANCE:g} % of the sand at {hertz:g} Hz")
        else:
            pictures_by_peak.setdefault(distances.index(min(distances)), []).append(straighten_picture(picture))
    return pictures_by_peak, remarks
